//! What a calibration leaves in its folder, and what it shows.

use super::figures::{self, Drawn};
use super::{FittedCurve, Interval, Open, Outcome, Stage};
use crate::Error;
use crate::experiment::{csv, digits, page, write as put};
use input::calibration::{Calibration, Scale, Variance};
use minijinja::value::Serde;
use minijinja::{Value as Template, context};
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::Path;
use text::digits::number;

/// Writes all files of a calibration.
///
/// # Errors
/// [`text::Error::Unwritable`].
pub(super) fn write(
    outcome: &Outcome,
    calibration: &Calibration,
    folder: &Path,
) -> Result<(), Error> {
    std::fs::create_dir_all(folder).map_err(|why| text::Error::unwritable(folder, why))?;
    remove_figures(folder);
    let drawn = figures::draw(outcome, folder)?;
    let mut all = summary(outcome, calibration);
    let names = drawn.fits.iter().chain(&drawn.profiles);
    all["figures"] = names.map(|(name, _)| name.clone()).collect();
    let json = serde_json::to_string_pretty(&all);
    let json = json.map_err(|error| Error::internal(error.to_string()))?;
    let files = [
        ("calibration.json", json + "\n"),
        ("parameters.toml", outcome.block.clone()),
        ("parameters.csv", parameters(outcome)?),
        ("correlations.csv", correlations(outcome)?),
        ("fit.csv", fit(outcome)?),
        ("starts.csv", starts(outcome)?),
        ("profiles.csv", profiles(outcome)?),
        ("report.html", report(outcome, &all, &drawn, folder)?),
    ];
    let mut files = files.into_iter();
    files.try_for_each(|(name, text)| put(&folder.join(name), &text))
}

/// The page: what `calibration.json` has, with intervals in words and figures, which are read from the folder that they
/// were drawn into.
///
/// # Errors
/// [`text::Error::Internal`]; [`text::Error::Unreadable`].
fn report(outcome: &Outcome, all: &Value, drawn: &Drawn, folder: &Path) -> Result<String, Error> {
    let picture = |(name, heading): &(String, String)| {
        let path = folder.join(format!("{name}.svg"));
        let svg = std::fs::read_to_string(&path);
        let svg = svg.map_err(|why| text::Error::unreadable(&path, why))?;
        Ok(context! { heading, svg })
    };
    let pictures =
        |all: &[(String, String)]| all.iter().map(picture).collect::<Result<Vec<_>, Error>>();
    let words = |(i, p): (usize, &super::Parameter)| {
        let linear = outcome.linear_interval(i);
        context! {
            interval => outcome.interval_in_words(i),
            linear => linear.map_or_else(String::new, |some| words_of(Some(some))),
            bounds => format!("{} to {}", digits(p.bounds[0]), digits(p.bounds[1])),
        }
    };
    let contents = context! {
        words => outcome.parameters.iter().enumerate().map(words).collect::<Vec<_>>(),
        fits => pictures(&drawn.fits)?,
        profiles => pictures(&drawn.profiles)?,
        ..Template::from(Serde(all))
    };
    page(include_str!("page.html"), contents)
}

/// Refuses a folder that holds the results of a run, whose report would be replaced.
///
/// # Errors
/// [`text::Error::Usage`].
pub(super) fn refuse_run(folder: &Path) -> Result<(), Error> {
    let of_runs = ["summary.json", "history.csv"];
    if !of_runs.iter().any(|name| folder.join(name).is_file()) {
        return Ok(());
    }
    Err(Error::usage(format!(
        "{} holds the results of a run; `--out` names another folder",
        folder.display()
    )))
}

/// Removes the figures of an earlier calibration, which may have other names.
fn remove_figures(folder: &Path) {
    let earlier = std::fs::read_to_string(folder.join("calibration.json")).unwrap_or_default();
    let earlier: Value = serde_json::from_str(&earlier).unwrap_or_default();
    let names = earlier["figures"].as_array().into_iter().flatten();
    for name in names.filter_map(Value::as_str) {
        let is_plain = |c: char| c.is_ascii_alphanumeric() || "_-".contains(c);
        if name.chars().all(is_plain) {
            let _ = std::fs::remove_file(folder.join(format!("{name}.svg")));
        }
    }
}

/// Ends of an interval in words.
fn words_of(interval: Option<Interval>) -> String {
    let Some(interval) = interval else {
        return "not determined".to_owned();
    };
    let [low, high] = interval.ends.map(|end| end.map(digits));
    match (low, high, interval.open) {
        (Some(low), Some(high), _) => format!("{low} to {high}"),
        (Some(low), None, [_, Open::Unlimited]) => format!("above {low}"),
        (None, Some(high), [Open::Unlimited, _]) => format!("below {high}"),
        (None, None, [Open::Unlimited, Open::Unlimited]) => "no limit".to_owned(),
        (low, high, open) => {
            let side = |end: Option<String>, open: Open| {
                end.unwrap_or_else(|| match open {
                    Open::Barred(value) | Open::Unfinished(value) => {
                        format!("beyond {} (unknown)", digits(value))
                    }
                    _ => "no limit".to_owned(),
                })
            };
            format!("{} to {}", side(low, open[0]), side(high, open[1]))
        }
    }
}

impl Outcome {
    /// A parameter of a stage by its place there.
    fn parameter(&self, stage: &Stage, place: usize) -> &super::Parameter {
        &self.parameters[stage.group.parameters[place]]
    }

    /// Interval, or why none exists.
    fn interval_in_words(&self, parameter: usize) -> String {
        let (stage, place) = self.places[parameter];
        let stage = &self.stages[stage];
        match stage.on_bound[place] {
            [true, _] | [_, true] if stage.seen[place] => "on its bound".to_owned(),
            _ => words_of(self.interval(parameter)),
        }
    }

    /// Output of the command: values, intervals, notes, the set to paste.
    pub fn text(&self) -> String {
        let mut text = format!("{}\n", self.title);
        text += &aligned(&self.table_of_parameters());
        text.push('\n');
        text += &aligned(&self.table_of_curves());
        for stage in &self.stages {
            let name = if self.stages.len() > 1 {
                format!("stage `{}`: ", stage.group.name)
            } else {
                String::new()
            };
            let _ = write!(
                text,
                "\n{name}sum of squares {} of {} residuals, {} degrees of freedom",
                digits(stage.sum),
                stage.n_residuals,
                stage.degrees
            );
            if self.variance == Variance::Estimated {
                let _ = write!(
                    text,
                    "; scatter {} times the noise of the file",
                    digits(stage.variance.sqrt())
                );
            }
        }
        text.push('\n');
        for (number, word) in self.words.iter().enumerate() {
            let kind = if number < self.warnings {
                "warning"
            } else {
                "note"
            };
            let _ = write!(text, "\n{kind}: {word}");
        }
        if !self.words.is_empty() {
            text.push('\n');
        }
        let _ = write!(text, "\n{}", self.block);
        text
    }

    /// Names, values, intervals and units, below their heads.
    fn table_of_parameters(&self) -> Vec<[String; 4]> {
        let rows = (0..self.parameters.len()).map(|i| {
            let p = &self.parameters[i];
            [
                p.name.clone(),
                digits(self.values[i]),
                self.interval_in_words(i),
                p.unit.clone(),
            ]
        });
        let interval = format!("{} % interval", digits(100.0 * self.confidence));
        let head = [
            "parameter".to_owned(),
            "value".to_owned(),
            interval,
            "unit".to_owned(),
        ];
        std::iter::once(head).chain(rows).collect()
    }

    /// Tests, curves, numbers of points and the root of the mean square, below their heads.
    fn table_of_curves(&self) -> Vec<[String; 4]> {
        let mut fits = vec![["test", "curve", "points", "rms"].map(str::to_owned)];
        for test in &self.tests {
            for fitted in &test.curves {
                let name = if test.is_predicted {
                    format!("{} (predicted)", test.name)
                } else {
                    test.name.clone()
                };
                let points = fitted.curve.points.len().to_string();
                fits.push([name, fitted.curve.y.clone(), points, digits(fitted.rms)]);
            }
        }
        fits
    }
}

/// Rows in columns.
fn aligned<const N: usize>(rows: &[[String; N]]) -> String {
    let width = |column: usize| {
        rows.iter()
            .map(|row| row[column].chars().count())
            .max()
            .unwrap_or(0)
    };
    let widths: Vec<usize> = (0..N).map(width).collect();
    let mut text = String::new();
    for row in rows {
        let mut line = String::new();
        for (cell, width) in row.iter().zip(&widths) {
            let _ = write!(line, "{cell:<width$}  ");
        }
        let _ = writeln!(text, "{}", line.trim_end());
    }
    text
}

fn optional(value: Option<f64>) -> String {
    value.map(number).unwrap_or_default()
}

fn parameters(outcome: &Outcome) -> Result<String, Error> {
    let columns = "parameter,value,lower,upper,lower_end,upper_end,linear_lower,linear_upper,relative_error,unit";
    let rows = outcome.parameters.iter().enumerate().map(|(i, p)| {
        let ends = |interval: Option<Interval>| interval.map_or([None; 2], |found| found.ends);
        let (interval, linear) = (outcome.interval(i), outcome.linear_interval(i));
        let open = interval.map_or([""; 2], |interval| interval.open.map(Open::word));
        let (stage, place) = outcome.places[i];
        let error = outcome.stages[stage].error(place);
        let relative =
            error.map(|error| error * (p.slope(outcome.values[i]) / outcome.values[i]).abs());
        let mut row = vec![p.name.clone(), number(outcome.values[i])];
        row.extend(ends(interval).map(optional));
        row.extend(open.map(str::to_owned));
        row.extend(ends(linear).map(optional));
        row.push(optional(relative.filter(|r| r.is_finite())));
        row.push(p.unit.clone());
        row
    });
    csv(columns.split(','), rows)
}

/// Rows of all stages, each after the name of its stage.
fn of_stages(
    outcome: &Outcome,
    columns: &str,
    rows: impl Fn(&Stage) -> Vec<Vec<String>>,
) -> Result<String, Error> {
    let with_name = |stage: &Stage| {
        let name = |row: Vec<String>| [vec![stage.group.name.clone()], row].concat();
        rows(stage).into_iter().map(name).collect::<Vec<_>>()
    };
    csv(
        columns.split(','),
        outcome.stages.iter().flat_map(with_name),
    )
}

fn correlations(outcome: &Outcome) -> Result<String, Error> {
    of_stages(outcome, "stage,parameter,other,correlation", |stage| {
        let name = |place: usize| outcome.parameter(stage, place).name.clone();
        let pairs = (0..stage.best.len()).flat_map(|a| (0..a).map(move |b| (a, b)));
        let row = |(a, b)| {
            let value = stage.covariance.correlation(a, b);
            vec![name(b), name(a), optional(value)]
        };
        pairs.map(row).collect()
    })
}

fn fit(outcome: &Outcome) -> Result<String, Error> {
    let columns =
        "test,predicted,x_column,y_column,x,measured,computed,noise,deviation,beyond_noise";
    let curves = outcome.tests.iter().flat_map(|test| {
        let of_test = [test.name.clone(), test.is_predicted.to_string()];
        test.curves
            .iter()
            .map(move |fitted| (of_test.clone(), fitted))
    });
    let rows = curves.flat_map(|(of_test, fitted)| {
        let row = move |(i, (x, measured)): (usize, &(f64, f64))| {
            let is_far = fitted.systematic.far.iter().any(|(point, _)| *point == i);
            let values = [
                *x,
                *measured,
                fitted.computed[i],
                fitted.curve.deviations[i],
            ];
            let mut row = of_test.to_vec();
            row.extend([fitted.curve.x.clone(), fitted.curve.y.clone()]);
            row.extend(values.map(number));
            row.extend([optional(fitted.deviations[i]), is_far.to_string()]);
            row
        };
        fitted.curve.points.iter().enumerate().map(row)
    });
    csv(columns.split(','), rows)
}

fn starts(outcome: &Outcome) -> Result<String, Error> {
    let columns = "stage,start,parameter,from,to,sum,iterations,optimum";
    of_stages(outcome, columns, |stage| {
        let mut rows = Vec::new();
        for (start, landing) in stage.landings.iter().enumerate() {
            for place in 0..stage.best.len() {
                let parameter = outcome.parameter(stage, place);
                let to = landing.to.as_ref();
                rows.push(vec![
                    (start + 1).to_string(),
                    parameter.name.clone(),
                    number(parameter.value(landing.from[place])),
                    optional(to.map(|(u, _)| parameter.value(u[place]))),
                    optional(to.map(|(_, sum)| *sum)),
                    landing.iterations.to_string(),
                    landing
                        .optimum
                        .map_or_else(String::new, |n| (n + 1).to_string()),
                ]);
            }
        }
        rows
    })
}

fn profiles(outcome: &Outcome) -> Result<String, Error> {
    of_stages(outcome, "stage,parameter,value,sum", |stage| {
        let profiles = stage.profiles.iter().enumerate();
        let rows = profiles.flat_map(|(place, profile)| {
            let parameter = outcome.parameter(stage, place);
            let row = |(u, sum): &(f64, f64)| {
                let value = parameter.value(*u);
                vec![parameter.name.clone(), number(value), number(*sum)]
            };
            profile.points.iter().map(row)
        });
        rows.collect()
    })
}

fn summary(outcome: &Outcome, calibration: &Calibration) -> Value {
    let parameters = 0..outcome.parameters.len();
    let parameters = parameters.map(|parameter| summary_of_parameter(outcome, parameter));
    let stages = outcome.stages.iter();
    let tests = outcome.tests.iter().map(|test| {
        json!({
            "name": test.name,
            "predicted": test.is_predicted,
            "derivatives": if test.is_by_law { "law" } else { "differences" },
            "curves": test.curves.iter().map(summary_of_curve).collect::<Vec<_>>(),
        })
    });
    json!({
        "program": format!("pilum {}", env!("CARGO_PKG_VERSION")),
        "title": outcome.title,
        "file": calibration.source.path().display().to_string(),
        "text": calibration.source.text_of_files(),
        "set": calibration.source.settings().map(|range| &calibration.source.text()[range]).collect::<Vec<_>>(),
        "variant": calibration.variant,
        "confidence": outcome.confidence,
        "variance": match outcome.variance { Variance::Estimated => "estimated", Variance::Given => "given" },
        "parameters": parameters.collect::<Vec<_>>(),
        "stages": stages.map(|stage| summary_of_stage(outcome, stage)).collect::<Vec<_>>(),
        "tests": tests.collect::<Vec<_>>(),
        "warnings": outcome.words[..outcome.warnings],
        "notes": outcome.words[outcome.warnings..],
        "block": outcome.block,
        "computations": outcome.computations,
    })
}

fn summary_of_parameter(outcome: &Outcome, parameter: usize) -> Value {
    let p = &outcome.parameters[parameter];
    let (stage, place) = outcome.places[parameter];
    let stage = &outcome.stages[stage];
    let interval = outcome.interval(parameter);
    json!({
        "name": p.name,
        "parameter": p.id,
        "laws": p.laws,
        "unit": p.unit,
        "doc": p.doc,
        "value": outcome.values[parameter],
        "interval": interval.map(|interval| interval.ends),
        "interval_ends": interval.map(|interval| interval.open.map(Open::word)),
        "interval_from": interval.map(|i| if i.is_of_profile { "profile" } else { "covariance" }),
        "linear_interval": outcome.linear_interval(parameter).map(|interval| interval.ends),
        "start": p.start,
        "bounds": p.bounds,
        "range": p.range,
        "scale": match p.scale { Scale::Linear => "linear", Scale::Log => "log" },
        "stage": stage.group.name,
        "on_bound": stage.on_bound[place] != [false, false],
    })
}

fn summary_of_stage(outcome: &Outcome, stage: &Stage) -> Value {
    let n = stage.best.len();
    let name = |place: usize| outcome.parameter(stage, place).name.clone();
    let row = |a: usize| {
        let row = (0..n).map(|b| stage.covariance.correlation(a, b));
        row.collect::<Vec<_>>()
    };
    let values = |u: &[f64]| {
        let values = u.iter().enumerate().map(|(place, u)| {
            let value = outcome.parameter(stage, place).value(*u);
            (name(place), json!(value))
        });
        values.collect::<serde_json::Map<_, _>>()
    };
    json!({
        "name": stage.group.name,
        "parameters": (0..n).map(name).collect::<Vec<_>>(),
        "tests": stage.group.tests.iter().map(|&t| outcome.tests[t].name.clone()).collect::<Vec<_>>(),
        "sum_of_squares": stage.sum,
        "sum_without_weights": stage.plain_sum,
        "residuals": stage.n_residuals,
        "degrees_of_freedom": stage.degrees,
        "variance": stage.variance,
        "correlations": (0..n).map(row).collect::<Vec<_>>(),
        "starts": stage.landings.len(),
        "optima": stage.optima.iter().map(|optimum| json!({
            "values": values(&optimum.u),
            "sum_of_squares": optimum.sum,
            "starts": optimum.times,
            "as_good": optimum.is_as_good,
        })).collect::<Vec<_>>(),
        "ended": format!("{:?}", stage.end).to_lowercase(),
        "shortened_steps": stage.failures,
    })
}

fn summary_of_curve(fitted: &FittedCurve) -> Value {
    let points = &fitted.curve.points;
    let far = fitted.systematic.far.iter().map(|&(point, times)| {
        let (x, measured) = points[point];
        json!({ "x": x, "measured": measured, "computed": fitted.computed[point], "times": times })
    });
    json!({
        "x": fitted.curve.x,
        "y": fitted.curve.y,
        "points": points.len(),
        "rms": fitted.rms,
        "rms_over_noise": fitted.relative,
        "explained": fitted.explained,
        "correlation_of_neighbours": fitted.neighbours,
        "residuals_follow_each_other": !fitted.systematic.follow.is_empty(),
        "beyond_noise": far.collect::<Vec<_>>(),
        "inside_interval_of_prediction": fitted.inside,
    })
}
