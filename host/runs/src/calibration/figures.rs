//! Figures of a calibration: measured points with the computed curves, and profiles.

use super::{FittedCurve, Outcome};
use crate::Error;
use results::figure::Figures;
use results::output_request::{Figure, Measured};
use std::path::Path;

/// Points of a drawn profile between two that were computed.
const SMOOTH: usize = 8;

/// The figures that were drawn: names of files without `.svg`, with a heading.
#[derive(Clone, Debug, Default)]
pub(super) struct Drawn {
    pub(super) fits: Vec<(String, String)>,
    pub(super) profiles: Vec<(String, String)>,
}

/// Draws all figures into a folder.
///
/// # Errors
/// [`text::Error::Unwritable`].
pub(super) fn draw(outcome: &Outcome, folder: &Path) -> Result<Drawn, Error> {
    let mut drawn = Drawn::default();
    for is_predicted in [false, true] {
        for (x, y) in axes(outcome, is_predicted) {
            let kind = if is_predicted { "prediction" } else { "fit" };
            let name = file_name(&format!("{kind}_{y}_over_{x}"));
            let heading = format!(
                "{}: {y} over {x}",
                if is_predicted { "Predicted" } else { "Fitted" }
            );
            fit(outcome, is_predicted, (&x, &y), &name)?.draw(folder)?;
            drawn.fits.push((name, heading));
        }
    }
    for (parameter, p) in outcome.parameters.iter().enumerate() {
        let name = file_name(&format!("profile_{}", p.name));
        if let Some(figures) = profile(outcome, parameter, &name) {
            figures.draw(folder)?;
            drawn.profiles.push((name, p.name.clone()));
        }
    }
    Ok(drawn)
}

/// A name that a file can have.
fn file_name(name: &str) -> String {
    let plain = |c: char| {
        if c.is_ascii_alphanumeric() || "_-".contains(c) {
            c
        } else {
            '_'
        }
    };
    name.chars().map(plain).collect()
}

fn curves(outcome: &Outcome, is_predicted: bool) -> impl Iterator<Item = (&str, &FittedCurve)> {
    let tests = outcome
        .tests
        .iter()
        .filter(move |test| test.is_predicted == is_predicted);
    tests.flat_map(|test| test.curves.iter().map(|curve| (test.name.as_str(), curve)))
}

/// Pairs of columns that there are curves of.
fn axes(outcome: &Outcome, is_predicted: bool) -> Vec<(String, String)> {
    let mut all = Vec::new();
    for (_, fitted) in curves(outcome, is_predicted) {
        let pair = (fitted.curve.x.clone(), fitted.curve.y.clone());
        if !all.contains(&pair) {
            all.push(pair);
        }
    }
    all
}

/// Names of the columns: x, and one for each curve.
fn columns(curves: &[(&str, &FittedCurve)]) -> Vec<String> {
    let mut columns = vec!["x".to_owned()];
    for (place, (test, fitted)) in curves.iter().enumerate() {
        let of_test = curves.iter().filter(|(other, _)| other == test).count();
        let part = fitted.curve.stretch.filter(|_| of_test > 1);
        let column = match part {
            Some(part) => format!("{test}, part {}", part + 1),
            None => (*test).to_owned(),
        };
        let column = if columns.contains(&column) {
            format!("{column} {}", place + 1)
        } else {
            column
        };
        columns.push(column);
    }
    columns
}

/// Computed curves with their measured points, all tests in one figure.
fn fit(
    outcome: &Outcome,
    is_predicted: bool,
    (x, y): (&str, &str),
    name: &str,
) -> Result<Figures, Error> {
    let of_axes: Vec<(&str, &FittedCurve)> = curves(outcome, is_predicted)
        .filter(|(_, fitted)| fitted.curve.x == x && fitted.curve.y == y)
        .collect();
    let Some((_, first)) = of_axes.first() else {
        return Err(Error::internal("a figure without curves"));
    };
    let columns = columns(&of_axes);
    let measured = of_axes
        .iter()
        .enumerate()
        .map(|(number, (_, fitted))| Measured {
            label: "measured".to_owned(),
            points: fitted.curve.points.clone(),
            of_curve: Some(number),
            ..Measured::default()
        });
    let figure = Figure {
        name: name.to_owned(),
        title: Some(format!(
            "{}: lines computed{}, circles measured",
            outcome.title,
            if is_predicted { " (not fitted)" } else { "" }
        )),
        x: "x".to_owned(),
        x_label: Some(first.curve.labels[0].clone()),
        y: columns[1..].to_vec(),
        y_label: Some(first.curve.labels[1].clone()),
        measured: measured.collect(),
        ..Figure::default()
    };
    let n = columns.len();
    let mut figures = Figures::new(&outcome.title, &[figure], columns);
    for (number, (_, fitted)) in of_axes.iter().enumerate() {
        for (x, y) in &fitted.line {
            let mut row = vec![None; n];
            (row[0], row[number + 1]) = (Some(*x), Some(*y));
            figures.add(&row, |_| true);
        }
    }
    Ok(figures)
}

/// The profile of a parameter, next to what the covariance says and the limit of the interval.
fn profile(outcome: &Outcome, parameter: usize, name: &str) -> Option<Figures> {
    let (stage, place) = outcome.places[parameter];
    let stage = &outcome.stages[stage];
    let profile = stage.profiles.get(place)?;
    if profile.points.len() <= 2 || stage.variance <= 0.0 {
        return None;
    }
    let p = &outcome.parameters[parameter];
    let columns = ["x", "profile", "from the covariance", "limit"];
    let columns = columns.map(str::to_owned).to_vec();
    let figure = Figure {
        name: name.to_owned(),
        title: Some(format!("{}: growth of the sum of squares", p.name)),
        x: "x".to_owned(),
        x_label: Some(if p.unit.is_empty() {
            p.name.clone()
        } else {
            format!("{} ({})", p.name, p.unit)
        }),
        y: columns[1..].to_vec(),
        y_label: Some("growth / variance".to_owned()),
        ..Figure::default()
    };
    let mut figures = Figures::new(&outcome.title, &[figure], columns);
    // What a weight adds to the sum is no information: it is divided out.
    let variance = stage.variance * stage.covariance.growth(place);
    let limit = stage.quantile.powi(2);
    let best = stage.best[place];
    // The root of the growth, with a sign, is nearly straight between points.
    let root = |(u, sum): &(f64, f64)| {
        let root = ((sum - stage.sum) / variance).max(0.0).sqrt();
        (*u, if *u < best { -root } else { root })
    };
    let roots: Vec<(f64, f64)> = profile.points.iter().map(root).collect();
    for pair in roots.windows(2) {
        let [(u, a), (v, b)] = [pair[0], pair[1]];
        for k in 0..=SMOOTH {
            let part = k as f64 / SMOOTH as f64;
            let (at, growth) = (u + part * (v - u), (a + part * (b - a)).powi(2));
            let error = stage.error(place);
            let straight = error.map(|error| ((at - best) / error).powi(2));
            let straight = straight.filter(|value| *value < 2.0 * limit);
            let row = [Some(p.value(at)), Some(growth), straight, Some(limit)];
            figures.add(&row, |_| true);
        }
    }
    Some(figures)
}
