//! What a calibration leaves in its folder, and what it shows.

use super::curve::Curve;
use super::messages::digits;
use super::{Interval, Open, Outcome, figures, page};
use crate::Error;
use input::calibration::{Calibration, Scale, Variance};
use results::number;
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::Path;
use text::write::replace;

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
    let put = |name: &str, text: String| replace(&folder.join(name), text);
    put("calibration.json", json + "\n")?;
    put("parameters.toml", outcome.block.clone())?;
    put("parameters.csv", parameters(outcome))?;
    put("correlations.csv", correlations(outcome))?;
    put("fit.csv", fit(outcome))?;
    put("starts.csv", starts(outcome))?;
    put("profiles.csv", profiles(outcome))?;
    put(
        "report.html",
        page::render(outcome, calibration, &drawn, folder)?,
    )?;
    Ok(())
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
pub(super) fn words_of(interval: Option<Interval>) -> String {
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
    /// Interval, or why none exists.
    pub(super) fn interval_in_words(&self, parameter: usize) -> String {
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
        let rows: Vec<[String; 4]> = std::iter::once(head).chain(rows).collect();
        text += &aligned(&rows);
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
        text.push('\n');
        text += &aligned(&fits);
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

/// A cell that holds a name.
fn cell(text: &str) -> String {
    if text.contains([',', '"', '\n']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

fn optional(value: Option<f64>) -> String {
    value.map(number).unwrap_or_default()
}

fn parameters(outcome: &Outcome) -> String {
    let mut text =
        "parameter,value,lower,upper,lower_end,upper_end,linear_lower,linear_upper,relative_error,unit\n"
            .to_owned();
    for (i, p) in outcome.parameters.iter().enumerate() {
        let ends =
            |interval: Option<Interval>| interval.map_or([None, None], |interval| interval.ends);
        let [[low, high], [below, above]] =
            [ends(outcome.interval(i)), ends(outcome.linear_interval(i))];
        let (stage, place) = outcome.places[i];
        let error = outcome.stages[stage].error(place);
        let relative =
            error.map(|error| error * (p.slope(outcome.values[i]) / outcome.values[i]).abs());
        let open = outcome
            .interval(i)
            .map(|interval| interval.open.map(Open::word));
        let cells = [below, above, relative.filter(|r| r.is_finite())].map(optional);
        let _ = writeln!(
            text,
            "{},{},{},{},{},{}",
            cell(&p.name),
            number(outcome.values[i]),
            [low, high].map(optional).join(","),
            open.unwrap_or(["", ""]).join(","),
            cells.join(","),
            cell(&p.unit),
        );
    }
    text
}

fn correlations(outcome: &Outcome) -> String {
    let mut text = "stage,parameter,other,correlation\n".to_owned();
    for stage in &outcome.stages {
        let names = |place: usize| &outcome.parameters[stage.group.parameters[place]].name;
        for a in 0..stage.best.len() {
            for b in 0..a {
                let value = stage.covariance.correlation(a, b);
                let _ = writeln!(
                    text,
                    "{},{},{},{}",
                    cell(&stage.group.name),
                    cell(names(b)),
                    cell(names(a)),
                    optional(value)
                );
            }
        }
    }
    text
}

fn fit(outcome: &Outcome) -> String {
    let mut text =
        "test,predicted,x_column,y_column,x,measured,computed,noise,deviation,beyond_noise\n"
            .to_owned();
    for test in &outcome.tests {
        for fitted in &test.curves {
            let Curve {
                x,
                y,
                points,
                deviations,
                ..
            } = &fitted.curve;
            for (i, (at, measured)) in points.iter().enumerate() {
                let values = [*at, *measured, fitted.computed[i], deviations[i]];
                let is_far = fitted.systematic.far.iter().any(|(point, _)| *point == i);
                let _ = writeln!(
                    text,
                    "{},{},{x},{y},{},{},{is_far}",
                    cell(&test.name),
                    test.is_predicted,
                    values.map(number).join(","),
                    optional(fitted.deviations[i])
                );
            }
        }
    }
    text
}

fn starts(outcome: &Outcome) -> String {
    let mut text = "stage,start,parameter,from,to,sum,iterations,optimum\n".to_owned();
    for stage in &outcome.stages {
        for (number_of, landing) in stage.landings.iter().enumerate() {
            for (place, &p) in stage.group.parameters.iter().enumerate() {
                let parameter = &outcome.parameters[p];
                let to = landing.to.as_ref().map(|(u, _)| parameter.value(u[place]));
                let _ = writeln!(
                    text,
                    "{},{},{},{},{},{},{},{}",
                    cell(&stage.group.name),
                    number_of + 1,
                    cell(&parameter.name),
                    number(parameter.value(landing.from[place])),
                    optional(to),
                    optional(landing.to.as_ref().map(|to| to.1)),
                    landing.iterations,
                    landing
                        .optimum
                        .map(|n| (n + 1).to_string())
                        .unwrap_or_default()
                );
            }
        }
    }
    text
}

fn profiles(outcome: &Outcome) -> String {
    let mut text = "stage,parameter,value,sum\n".to_owned();
    for stage in &outcome.stages {
        for (place, profile) in stage.profiles.iter().enumerate() {
            let parameter = &outcome.parameters[stage.group.parameters[place]];
            for (u, sum) in &profile.points {
                let values = [parameter.value(*u), *sum].map(number).join(",");
                let _ = writeln!(
                    text,
                    "{},{},{values}",
                    cell(&stage.group.name),
                    cell(&parameter.name)
                );
            }
        }
    }
    text
}

fn scale_name(scale: Scale) -> &'static str {
    match scale {
        Scale::Linear => "linear",
        Scale::Log => "log",
    }
}

fn summary(outcome: &Outcome, calibration: &Calibration) -> Value {
    let parameters = outcome.parameters.iter().enumerate().map(|(i, p)| {
        let (stage, place) = outcome.places[i];
        let interval = outcome.interval(i);
        json!({
            "name": p.name,
            "parameter": p.id,
            "laws": p.laws,
            "unit": p.unit,
            "doc": p.doc,
            "value": outcome.values[i],
            "interval": interval.map(|interval| interval.ends),
            "interval_ends": interval.map(|interval| interval.open.map(Open::word)),
            "interval_from": interval.map(|i| if i.is_of_profile { "profile" } else { "covariance" }),
            "linear_interval": outcome.linear_interval(i).map(|interval| interval.ends),
            "start": p.start,
            "bounds": p.bounds,
            "range": p.range,
            "scale": scale_name(p.scale),
            "stage": outcome.stages[stage].group.name,
            "on_bound": outcome.stages[stage].on_bound[place] != [false, false],
        })
    });
    let stages = outcome.stages.iter().map(|stage| {
        let name = |place: usize| outcome.parameters[stage.group.parameters[place]].name.clone();
        let n = stage.best.len();
        let rows = (0..n).map(|a| {
            let row = (0..n).map(|b| stage.covariance.correlation(a, b));
            row.collect::<Vec<_>>()
        });
        let value = |u: &[f64]| {
            let values = u.iter().enumerate().map(|(place, u)| {
                let parameter = &outcome.parameters[stage.group.parameters[place]];
                (parameter.name.clone(), json!(parameter.value(*u)))
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
            "correlations": rows.collect::<Vec<_>>(),
            "starts": stage.landings.len(),
            "optima": stage.optima.iter().map(|optimum| json!({
                "values": value(&optimum.u),
                "sum_of_squares": optimum.sum,
                "starts": optimum.times,
                "as_good": optimum.is_as_good,
            })).collect::<Vec<_>>(),
            "ended": format!("{:?}", stage.end).to_lowercase(),
            "shortened_steps": stage.failures,
        })
    });
    let tests = outcome.tests.iter().map(|test| {
        json!({
            "name": test.name,
            "predicted": test.is_predicted,
            "derivatives": if test.is_by_law { "law" } else { "differences" },
            "curves": test.curves.iter().map(|fitted| json!({
                "x": fitted.curve.x,
                "y": fitted.curve.y,
                "points": fitted.curve.points.len(),
                "rms": fitted.rms,
                "rms_over_noise": fitted.relative,
                "explained": fitted.explained,
                "correlation_of_neighbours": fitted.neighbours,
                "residuals_follow_each_other": !fitted.systematic.follow.is_empty(),
                "beyond_noise": fitted.systematic.far.iter().map(|&(point, times)| json!({
                    "x": fitted.curve.points[point].0,
                    "measured": fitted.curve.points[point].1,
                    "computed": fitted.computed[point],
                    "times": times,
                })).collect::<Vec<_>>(),
                "inside_interval_of_prediction": fitted.inside,
            })).collect::<Vec<_>>(),
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
        "stages": stages.collect::<Vec<_>>(),
        "tests": tests.collect::<Vec<_>>(),
        "warnings": outcome.words[..outcome.warnings],
        "notes": outcome.words[outcome.warnings..],
        "block": outcome.block,
        "computations": outcome.computations,
    })
}
