//! The measured curves of a calibration.

use crate::Error;
use crate::calibration::curve::{Curve, Gap, extent};
use crate::calibration::model::Subject;
use crate::experiment::Rows;
use input::calibration::{Calibration, CurveInput, TestInput};
use text::{Spanned, suggestion};

/// The curves of a test.
pub(super) fn curves(
    calibration: &Calibration,
    input: &TestInput,
    subject: &Subject,
) -> Result<Vec<Curve>, Error> {
    let curve = |written: &CurveInput| {
        let points = calibration.measured(written)?.points;
        let label = |label: &Option<String>, column: &Spanned<String>| {
            let label = label.as_ref().unwrap_or(column.get_ref());
            label.clone()
        };
        Ok(Curve {
            x: written.x.get_ref().clone(),
            y: written.y.get_ref().clone(),
            labels: [
                label(&written.x_label, &written.x),
                label(&written.y_label, &written.y),
            ],
            stretch: stretch(calibration, written, subject)?,
            deviations: deviations(calibration, written, &points)?,
            points,
            is_noise_given: written.noise.is_some() || written.relative_noise.is_some(),
            readings: [None; 4],
            weight: written.weight.get_ref() * input.weight.get_ref(),
        })
    };
    input.curve.iter().map(curve).collect()
}

/// The segment of a driver, or the phase of a case, that a curve shows.
fn stretch(
    calibration: &Calibration,
    written: &CurveInput,
    subject: &Subject,
) -> Result<Option<usize>, Error> {
    match subject {
        Subject::Driver(driver) => {
            let n = driver.point().segments().len();
            let number = written.segment.as_ref();
            if let Some(segment) = number.filter(|s| !(1..=n).contains(s.get_ref())) {
                let number = segment.get_ref();
                let message = format!("there is no segment {number}: the driver has {n}");
                return Err(calibration.error(segment.span(), message));
            }
            Ok(number.map(|segment| segment.get_ref() - 1))
        }
        Subject::Case(case) => {
            let phases = case.file.phases.iter();
            let names: Vec<&str> = phases.map(|phase| phase.name.get_ref().as_str()).collect();
            let Some(phase) = &written.phase else {
                return Ok(Some(names.len().saturating_sub(1)));
            };
            let place = names.iter().position(|name| name == phase.get_ref());
            place.map(Some).ok_or_else(|| {
                let message = format!("there is no phase `{}`", phase.get_ref());
                let hint = suggestion(phase.get_ref(), names);
                calibration.error(phase.span(), message).with_hint(&hint)
            })
        }
    }
}

/// Part of the largest value that counts as noise where nothing is reported.
const USUAL_NOISE: f64 = 0.01;

fn deviations(
    calibration: &Calibration,
    written: &CurveInput,
    points: &[(f64, f64)],
) -> Result<Vec<f64>, Error> {
    let largest = points.iter().map(|(_, y)| y.abs()).fold(0.0, f64::max);
    let [plain, relative] = match [&written.noise, &written.relative_noise] {
        [None, None] => [USUAL_NOISE * largest, 0.0],
        noise => noise.map(|noise| noise.as_ref().map_or(0.0, |noise| *noise.get_ref())),
    };
    let deviation = |(_, y): &(f64, f64)| plain.hypot(relative * y);
    let all: Vec<f64> = points.iter().map(deviation).collect();
    if all.iter().all(|deviation| *deviation > 0.0) {
        return Ok(all);
    }
    let written = written.noise.as_ref().or(written.relative_noise.as_ref());
    let at = written.map_or(0..0, Spanned::span);
    let message = "a measured value has no noise: `noise` is above 0 where a value is 0";
    Err(calibration.error(at, message))
}

/// Leaves out measured points beyond the computed ones. Returns from where to where these go.
pub(super) fn compared(
    calibration: &Calibration,
    (curve, written): (&mut Curve, &CurveInput),
    rows: &Rows,
    values: &[f64],
    bounds: &[[f64; 2]],
) -> Result<[f64; 2], Error> {
    let line = |values: &[f64]| {
        let line = curve.line(rows, values);
        line.map_err(|gap| explain(calibration, written, gap, rows))
    };
    // Whatever offset and scale may become, a point that is compared stays one.
    let mut lines = vec![line(values)?];
    for ends in [[0, 0], [0, 1], [1, 0], [1, 1]] {
        let mut values = values.to_vec();
        for (place, end) in ends.into_iter().enumerate() {
            if let Some(parameter) = curve.readings[place] {
                values[parameter] = bounds[parameter][end];
            }
        }
        lines.push(line(&values)?);
    }
    let is_there = |x: f64| lines.iter().all(|line| curve.spot(line, x).is_some());
    let all = curve.points.iter().zip(&curve.deviations);
    let there = all.filter(|((x, _), _)| is_there(*x));
    let (points, deviations) = there.map(|(point, deviation)| (*point, *deviation)).unzip();
    (curve.points, curve.deviations) = (points, deviations);
    let [low, high] = extent(&lines[0]);
    if curve.points.is_empty() {
        let message = format!(
            "no measured point lies where `{}` is computed, from {low:e} to {high:e}: are units and \
             signs those of the computed column?",
            curve.x
        );
        let error = calibration.error(written.measured.span(), message);
        return Err(error.with_hint("`x_scale` of `measured` brings it to the unit"));
    }
    Ok([low, high])
}

/// Why a curve cannot be read off, at its place in the file.
fn explain(calibration: &Calibration, curve: &CurveInput, gap: Gap, rows: &Rows) -> Error {
    let at_x = |message: String| calibration.error(curve.x.span(), message);
    let (x, y) = (curve.x.get_ref(), curve.y.get_ref());
    match gap {
        Gap::NoColumn(name) => {
            let written = if *x == name { &curve.x } else { &curve.y };
            let error = calibration.error(written.span(), format!("there is no column `{name}`"));
            let hint = suggestion(&name, rows.names.iter().map(String::as_str));
            error.with_hint(&hint)
        }
        Gap::TurnsBack { row, at } => at_x(format!(
            "`{x}` does not only grow or only fall: at row {row} it is {at:e} and turns, or stays"
        ))
        .with_hint(
            "`segment` of a driver, `phase` of a case chooses a part of the path; each part is a curve of its own",
        ),
        Gap::NoRows => at_x(format!(
            "`{x}` and `{y}` have fewer than two rows of numbers here"
        )),
        Gap::Outside(_) => at_x("no measured point lies here".to_owned()),
    }
}
