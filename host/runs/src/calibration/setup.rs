//! A calibration read: its tests with their laws, what its parameters stand for, where the search starts.

mod curves;
mod names;

use super::coordinates::Parameter;
use super::model::{Model, Setting, Subject, Test, words};
use crate::experiment::{Kept, Scratch};
use crate::variants::keep;
use crate::{Error, run};
use curves::{compared, curves};
use input::calibration::{Calibration, FreeInput, Scale, TestInput};
use input::{Case, Driver};
use law::{Bounds, Opener, ParameterDescription, Stop};
use names::{Claim, Given, Known, claims, names};
use results::output_request::Output;
use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use text::Spanned;

/// Step of differences of drivers, whose results are known to many digits.
const STEP_OF_DRIVERS: f64 = 1e-4;
/// Accuracy of results of drivers.
const EXACTNESS_OF_DRIVERS: f64 = 1e-9;
/// A parameter that may come as near to 0 as it likes is at least this part of its start.
const NEAREST_TO_ZERO: f64 = 1e-9;

impl Model {
    /// Reads all files and computes each test once, with the values that the search starts from.
    ///
    /// # Errors
    /// Bad input, trouble with libraries; a test that cannot be computed with the starting values.
    pub(super) fn new(
        calibration: &Calibration,
        opener: &Opener,
        folder: &Path,
        stop: &Stop,
    ) -> Result<Self, Error> {
        let mut model = Self {
            parameters: Vec::new(),
            tests: Vec::new(),
            difference: STEP_OF_DRIVERS,
            stop: stop.clone(),
            kept: Kept::default(),
            first_failure: None,
            notes: Vec::new(),
            scratch: Scratch::new(folder, stop)?,
            rows_of_late: VecDeque::new(),
        };
        let read = calibration.file.test.iter();
        let read = read.map(|input| subject(calibration, input, opener));
        let (subjects, laws): (Vec<_>, Vec<_>) =
            read.collect::<Result<Vec<_>, _>>()?.into_iter().unzip();
        let names = names(calibration);
        let claims = claims(calibration, &names, &laws)?;
        for (number, (input, subject)) in calibration.file.test.iter().zip(subjects).enumerate() {
            let subject = with_fixed(calibration, (number, subject), &claims)?;
            let test = test(calibration, input, subject)?;
            if let Subject::Case(_) = test.subject {
                let of_case = test.exactness.sqrt().clamp(1e-3, 0.03);
                model.difference = model.difference.max(of_case);
            }
            model.tests.push(test);
        }
        if let Some(step) = &calibration.file.difference {
            model.difference = *step.get_ref();
        }
        for name in names {
            let Given::Free(input) = name.given else {
                continue;
            };
            let is_own = |claim: &&Claim<'_>| std::ptr::eq(claim.name.written, name.written);
            let own: Vec<&Claim<'_>> = claims.iter().filter(is_own).collect();
            if own.is_empty() {
                return Err(name.nowhere(calibration, &laws));
            }
            model.add(calibration, name.written, input, &own)?;
        }
        model.add_readings(calibration);
        model.start(calibration)?;
        Ok(model)
    }

    /// Adds a parameter, and what it stands for in each test.
    fn add(
        &mut self,
        calibration: &Calibration,
        name: &Spanned<String>,
        input: &FreeInput,
        claims: &[&Claim<'_>],
    ) -> Result<(), Error> {
        let number = self.parameters.len();
        let mut own: Option<f64> = None;
        for claim in claims {
            let test = &mut self.tests[claim.test];
            let id = claim.parameter().id.clone();
            own = own.or_else(|| claim.law.value(&test.subject, &id));
            test.targets.push((number, claim.law.table.clone(), id));
        }
        let declared: Vec<&ParameterDescription> =
            claims.iter().map(|claim| claim.parameter()).collect();
        let Some(first) = declared.first() else {
            return Err(Error::internal("a parameter that stands for nothing"));
        };
        if !first.choices.is_empty() {
            let message = format!("`{}` is a choice, which cannot be looked for", first.id);
            return Err(calibration.error(name.span(), message));
        }
        let law = declared.iter().fold(WIDE, |both, p| common(both, p.bounds));
        let usual = declared.iter().fold(WIDE, |both, p| common(both, p.usual));
        let given = [&input.start, &input.min, &input.max];
        let [start, given @ ..] = given.map(|value| value.as_ref().map(|value| *value.get_ref()));
        let Some(start) = start.or(own) else {
            let message = format!(
                "`{}` needs a `start`: no test gives it a value",
                name.get_ref()
            );
            return Err(calibration.error(name.span(), message));
        };
        let (scale, bounds) = limits(calibration, (name, &first.id), input, law, start)?;
        self.parameters.push(Parameter {
            name: name.get_ref().clone(),
            id: first.id.clone(),
            laws: input.laws.iter().map(|law| law.get_ref().clone()).collect(),
            unit: first.unit.clone(),
            doc: first.doc.clone(),
            start,
            bounds,
            range: range(bounds, usual, given, start, scale),
            scale,
            of_curve: None,
        });
        Ok(())
    }

    /// Adds what is looked for of how curves were read.
    fn add_readings(&mut self, calibration: &Calibration) {
        for (test, input) in calibration.file.test.iter().enumerate() {
            for (curve, written) in input.curve.iter().enumerate() {
                let y = written.y.get_ref();
                let is_alone = input.curve.iter().filter(|c| c.y.get_ref() == y).count() == 1;
                let which = if is_alone {
                    String::new()
                } else {
                    format!(", curve {}", curve + 1)
                };
                for (place, (key, none, reading)) in written.readings().into_iter().enumerate() {
                    let Some(reading) = reading.map(text::Spanned::get_ref) else {
                        continue;
                    };
                    let bounds = [reading.min, reading.max];
                    self.tests[test].curves[curve].readings[place] = Some(self.parameters.len());
                    self.parameters.push(Parameter {
                        name: format!("{key} of {}, {y}{which}", input.name.get_ref()),
                        id: key.to_owned(),
                        laws: Vec::new(),
                        unit: String::new(),
                        doc: format!("{key} of a measured curve"),
                        start: reading.start.unwrap_or(none.clamp(bounds[0], bounds[1])),
                        bounds,
                        range: bounds,
                        scale: Scale::Linear,
                        of_curve: Some((test, curve)),
                    });
                }
            }
        }
    }

    /// Computes all tests with the starting values: what fails there is an error of the input. Measured
    /// points beyond the computed ones are left out.
    fn start(&mut self, calibration: &Calibration) -> Result<(), Error> {
        let start: Vec<f64> = self.parameters.iter().map(|p| p.counted(p.start)).collect();
        let values = self.values(&start);
        let bounds: Vec<[f64; 2]> = self.parameters.iter().map(|p| p.bounds).collect();
        for number in 0..self.tests.len() {
            let input = &calibration.file.test[number];
            let rows = self.rows(number, &start)?.map_err(|why| {
                let message = format!(
                    "test `{}` cannot be computed with the starting values: {why}",
                    self.tests[number].name
                );
                let error = calibration.error(input.name.span(), message);
                error.with_hint("a `start` of the free parameters that the law can follow")
            })?;
            let test = &mut self.tests[number];
            for (curve, written) in test.curves.iter_mut().zip(&input.curve) {
                let before = curve.points.len();
                let [low, high] = compared(calibration, (curve, written), &rows, &values, &bounds)?;
                let left = before - curve.points.len();
                if left > 0 {
                    self.notes.push(format!(
                        "{}, {}: {left} of {before} measured points are left out: `{}` is computed from {low:e} to \
                         {high:e} only",
                        test.name, curve.y, curve.x
                    ));
                }
            }
            let curves = test.curves.iter();
            let there = curves.map(|curve| curve.computed(&rows, &values));
            test.at_start = there.map(Result::unwrap_or_default).collect();
        }
        Ok(())
    }
}

/// A test before it is computed.
fn test(calibration: &Calibration, input: &TestInput, subject: Subject) -> Result<Test, Error> {
    let tolerance = match &subject {
        Subject::Case(case) => case.file.solver.get_ref().force_tolerance,
        Subject::Driver(_) => 0.0,
    };
    Ok(Test {
        name: input.name.get_ref().clone(),
        is_predicted: input.predict,
        curves: curves(calibration, input, &subject)?,
        subject,
        targets: Vec::new(),
        exactness: EXACTNESS_OF_DRIVERS.max(tolerance),
        is_by_law: false,
        at_start: Vec::new(),
    })
}

/// What a test computes, with the laws that it calls.
fn subject(
    calibration: &Calibration,
    input: &TestInput,
    opener: &Opener,
) -> Result<(Subject, Vec<Known>), Error> {
    let existing = |written: &Spanned<PathBuf>, is_there: fn(&Path) -> bool| {
        let path = calibration.path_of(written);
        if is_there(&path) {
            return Ok(path);
        }
        let message = format!("there is no file {}", path.display());
        Err(calibration.error(written.span(), message))
    };
    if let Some(written) = &input.driver {
        let path = existing(written, Path::is_file)?;
        let drivers = Driver::read(opener, &path, &[])?;
        let name = |driver: &Driver| driver.point().variant().map(str::to_owned);
        let driver = the_one(calibration, input, &path, drivers, name)?;
        let known = Known {
            table: None,
            description: driver.point().law().description().clone(),
        };
        return Ok((Subject::Driver(Box::new(driver)), vec![known]));
    }
    let Some(written) = &input.case else {
        return Err(Error::internal("a test without driver and case"));
    };
    let path = existing(written, Path::exists)?;
    let cases = Case::load_with(&path, &[])?.into_iter();
    let cases = cases.map(|case| case.opened_by(opener)).collect();
    let name = |case: &Case| case.variant.clone();
    let mut case = the_one(calibration, input, &path, cases, name)?;
    case.file.output = Output::default();
    case.file.figures.clear();
    let (_, laws) = run::begin(&case)?;
    let known = laws.iter().map(|((table, _), built)| Known {
        table: Some(table.clone()),
        description: built.law.description().clone(),
    });
    let known = known.collect();
    Ok((Subject::Case(Box::new(case)), known))
}

/// The variant of a test's file that is chosen, or the only one.
fn the_one<T>(
    calibration: &Calibration,
    input: &TestInput,
    path: &Path,
    mut all: Vec<T>,
    name: impl Fn(&T) -> Option<String>,
) -> Result<T, Error> {
    let variant = input.variant.as_ref();
    let wanted = variant.map(|variant| variant.get_ref().as_str());
    keep(&mut all, wanted, &name).map_err(|error| match (variant, error) {
        (Some(name), Error::Text(text::Error::Usage(message))) => {
            calibration.error(name.span(), message)
        }
        (_, error) => error,
    })?;
    if all.len() > 1 {
        let names: Vec<String> = all.iter().filter_map(&name).collect();
        let message = format!("{} has variants: `variant` chooses one", path.display());
        let error = calibration.error(input.name.span(), message);
        return Err(error.with_hint(&format!("there are {}", names.join(", "))));
    }
    all.pop()
        .ok_or_else(|| Error::internal("a file without drivers or cases"))
}

/// The same with the fixed parameters of the calibration.
fn with_fixed(
    calibration: &Calibration,
    (test, subject): (usize, Subject),
    claims: &[Claim<'_>],
) -> Result<Subject, Error> {
    let own = claims.iter().filter(|claim| claim.test == test);
    let settings = own.filter_map(|claim| match claim.name.given {
        Given::Fixed(value) => {
            let id = claim.parameter().id.clone();
            Some((claim.law.table.clone(), id, value.clone()))
        }
        Given::Free(_) => None,
    });
    let settings: Vec<Setting> = settings.collect();
    if settings.is_empty() {
        return Ok(subject);
    }
    subject.with(settings).map_err(|error| {
        let first = calibration.file.fixed.first();
        let first = first.map_or(0..0, |(name, _)| name.span());
        calibration.error(first, format!("[fixed]: {}", words(&error)))
    })
}

const WIDE: Bounds = Bounds {
    lower: f64::NEG_INFINITY,
    open_lower: false,
    upper: f64::INFINITY,
    open_upper: false,
};

/// Where both hold.
fn common(a: Bounds, b: Bounds) -> Bounds {
    let lower = a.lower.max(b.lower);
    let upper = a.upper.min(b.upper);
    Bounds {
        lower,
        open_lower: !(a.contain(lower) && b.contain(lower)),
        upper,
        open_upper: !(a.contain(upper) && b.contain(upper)),
    }
}

/// Scale and bounds of the search for a parameter, known to the law as `id`: what is given has to be within `law`.
#[expect(clippy::float_cmp, reason = "an end that was given as it is")]
fn limits(
    calibration: &Calibration,
    (name, id): (&Spanned<String>, &str),
    input: &FreeInput,
    law: Bounds,
    start: f64,
) -> Result<(Scale, [f64; 2]), Error> {
    let at = |value: &Option<Spanned<f64>>| value.as_ref().map_or(name.span(), Spanned::span);
    let outside = |key: &str, value: f64, within: String, span| {
        let message = format!("`{key}` is {value}, outside {within} of `{id}`");
        calibration.error(span, message)
    };
    for (key, value) in [
        ("start", &input.start),
        ("min", &input.min),
        ("max", &input.max),
    ] {
        let Some(value) = value else { continue };
        let number = *value.get_ref();
        // A bound may lie on an end that the law leaves out.
        let is_end = key != "start" && (number == law.lower || number == law.upper);
        if !(law.contain(number) || is_end) {
            return Err(outside(key, number, law.to_string(), value.span()));
        }
    }
    let scale = match &input.scale {
        Some(scale) => *scale.get_ref(),
        None if law.lower > 0.0 || law.lower == 0.0 && law.open_lower => Scale::Log,
        None => Scale::Linear,
    };
    if scale == Scale::Log && start <= 0.0 {
        let name = name.get_ref();
        let message = format!("`{name}` starts from {start}, which has no logarithm");
        let error = calibration.error(at(&input.start), message);
        return Err(error.with_hint("`scale = \"linear\"`, or a `start` above 0"));
    }
    let given = [&input.min, &input.max].map(|end| end.as_ref().map(|end| *end.get_ref()));
    let bounds = bounds(law, given, start, scale);
    if bounds[0] >= bounds[1] {
        let message = format!("`min` is {}, not below `max`, {}", bounds[0], bounds[1]);
        return Err(calibration.error(at(&input.min), message));
    }
    if !(bounds[0]..=bounds[1]).contains(&start) {
        let within = format!("[{}, {}]", bounds[0], bounds[1]);
        return Err(outside("start", start, within, at(&input.start)));
    }
    Ok((scale, bounds))
}

/// Least and greatest value that the search tries: given, else the law's, ends that the law leaves out
/// left out.
#[expect(clippy::float_cmp, reason = "an end that was given as it is")]
fn bounds(law: Bounds, given: [Option<f64>; 2], start: f64, scale: Scale) -> [f64; 2] {
    let inset = 1e-9 * start.abs().max(1e-30);
    let mut lower = given[0].unwrap_or(law.lower);
    let mut upper = given[1].unwrap_or(law.upper);
    if lower == law.lower && law.open_lower && lower.is_finite() {
        lower += inset;
    }
    if upper == law.upper && law.open_upper && upper.is_finite() {
        upper -= inset;
    }
    if scale == Scale::Log {
        lower = lower.max(NEAREST_TO_ZERO * start);
        upper = upper.min(start / NEAREST_TO_ZERO);
    }
    [lower, upper]
}

/// Range of other starts: between the given ends, else usual values within three decades (logarithmic
/// scale) or ten times the start (linear scale) of it. A start of zero has the width of the usual range
/// instead of ten times the start.
fn range(
    bounds: [f64; 2],
    usual: Bounds,
    given: [Option<f64>; 2],
    start: f64,
    scale: Scale,
) -> [f64; 2] {
    // A start at nothing tells no size: the law's usual values do, or else its unit.
    let reach = if start.abs() > 0.0 {
        10.0 * start.abs()
    } else {
        Some(usual.upper - usual.lower)
            .filter(|width| width.is_finite() && *width > 0.0)
            .unwrap_or(1.0)
    };
    let near = match scale {
        Scale::Log => [start / 1000.0, start * 1000.0],
        Scale::Linear => [start - reach, start + reach],
    };
    let low = given[0].unwrap_or_else(|| near[0].max(usual.lower.min(start)));
    let high = given[1].unwrap_or_else(|| near[1].min(usual.upper.max(start)));
    [low.max(bounds[0]), high.min(bounds[1])]
}
