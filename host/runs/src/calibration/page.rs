//! A calibration as a page, in the style of the reports.

use super::Outcome;
use super::figures::Drawn;
use super::messages::digits;
use super::output::words_of;
use crate::Error;
use input::calibration::{Calibration, Variance};
use minijinja::{Environment, Value, context};
use results::report::STYLE;
use std::path::Path;

const TEMPLATE: &str = include_str!("page.html");

/// The page; figures are read from the folder that they were drawn into.
///
/// # Errors
/// [`text::Error::Internal`]; [`text::Error::Unreadable`].
pub(super) fn render(
    outcome: &Outcome,
    calibration: &Calibration,
    drawn: &Drawn,
    folder: &Path,
) -> Result<String, Error> {
    let picture = |(name, heading): &(String, String)| {
        let path = folder.join(format!("{name}.svg"));
        let svg = std::fs::read_to_string(&path);
        let svg = svg.map_err(|source| text::Error::Unreadable { path, source })?;
        Ok(context! { heading, svg })
    };
    let pictures =
        |all: &[(String, String)]| all.iter().map(picture).collect::<Result<Vec<_>, Error>>();
    let page = context! {
        version => env!("CARGO_PKG_VERSION"),
        style => STYLE,
        title => outcome.title.clone(),
        variant => calibration.variant.clone(),
        percent => digits(100.0 * outcome.confidence),
        is_estimated => outcome.variance == Variance::Estimated,
        parameters => parameters(outcome),
        warnings => outcome.words[..outcome.warnings].to_vec(),
        notes => outcome.words[outcome.warnings..].to_vec(),
        block => outcome.block.clone(),
        fits => pictures(&drawn.fits)?,
        profiles => pictures(&drawn.profiles)?,
        tests => tests(outcome),
        stages => stages(outcome),
        computations => outcome.computations,
        path => calibration.source.path().display().to_string(),
        text => calibration.source.text_of_files(),
    };
    let mut environment = Environment::new();
    environment
        .add_template("report.html", TEMPLATE)
        .and_then(|()| environment.get_template("report.html"))
        .and_then(|template| template.render(page))
        .map_err(|error| Error::internal(format!("page: {error:#}")))
}

fn parameters(outcome: &Outcome) -> Vec<Value> {
    let row = |(i, p): (usize, &super::Parameter)| {
        let linear = match outcome.linear_interval(i) {
            None => String::new(),
            some => words_of(some),
        };
        context! {
            name => p.name.clone(),
            doc => p.doc.clone(),
            unit => p.unit.clone(),
            value => digits(outcome.values[i]),
            interval => outcome.interval_in_words(i),
            linear,
            start => digits(p.start),
            bounds => format!("{} to {}", digits(p.bounds[0]), digits(p.bounds[1])),
        }
    };
    outcome.parameters.iter().enumerate().map(row).collect()
}

fn tests(outcome: &Outcome) -> Vec<Value> {
    let rows = outcome.tests.iter().flat_map(|test| {
        test.curves.iter().map(|fitted| {
            context! {
                test => test.name.clone(),
                kind => if test.is_predicted { "predicted" } else { "fitted" },
                curve => format!("{} over {}", fitted.curve.y, fitted.curve.x),
                points => fitted.curve.points.len(),
                rms => digits(fitted.rms),
                relative => format!("{:.2}", fitted.relative),
                beyond => fitted.systematic.far.len(),
                neighbours => format!("{:.2}", fitted.neighbours),
                explained => fitted.explained.map_or("–".to_owned(), |part| format!("{:.1}", 100.0 * part)),
                inside => fitted.inside.map_or("no interval".to_owned(), |part| format!("{:.0}", 100.0 * part)),
            }
        })
    });
    rows.collect()
}

fn stages(outcome: &Outcome) -> Vec<Value> {
    let stage = |stage: &super::Stage| {
        let names = stage
            .group
            .parameters
            .iter()
            .map(|&p| outcome.parameters[p].name.clone());
        let names: Vec<String> = names.collect();
        let row = |a: usize| {
            let cell = |b: usize| match stage.covariance.correlation(a, b) {
                Some(value) => format!("{value:.2}"),
                None => "–".to_owned(),
            };
            context! { name => names[a].clone(), cells => (0..names.len()).map(cell).collect::<Vec<_>>() }
        };
        let optimum = |optimum: &super::Optimum| {
            let value = |(place, u): (usize, &f64)| {
                digits(outcome.parameters[stage.group.parameters[place]].value(*u))
            };
            context! {
                sum => digits(optimum.sum),
                times => optimum.times,
                values => optimum.u.iter().enumerate().map(value).collect::<Vec<_>>(),
            }
        };
        context! {
            name => stage.group.name.clone(),
            sum => digits(stage.sum),
            residuals => stage.n_residuals,
            degrees => stage.degrees,
            scatter => digits(stage.variance.sqrt()),
            starts => stage.landings.len(),
            correlations => (0..names.len()).map(row).collect::<Vec<_>>(),
            optima => stage.optima.iter().map(optimum).collect::<Vec<_>>(),
            names => names.clone(),
        }
    };
    outcome.stages.iter().map(stage).collect()
}
