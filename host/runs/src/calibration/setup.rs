//! A calibration read: its tests with their laws, what its parameters stand for, where the search starts.

use super::cache::Kept;
use super::coordinates::Parameter;
use super::curve::{Curve, Gap, Rows, extent};
use super::model::{Model, Subject, Test, words};
use crate::trade_off::trial::Scratch;
use crate::variants::keep;
use crate::{Error, run};
use input::calibration::{Calibration, CurveInput, FixedInput, FreeInput, Scale, TestInput};
use input::material::{ParameterValue, set_parameters};
use input::{Case, Driver};
use law::{Bounds, LawDescription, Opener, ParameterDescription, Stop};
use mechanics::equilibrium::Reuse;
use results::output_request::Output;
use std::collections::VecDeque;
use std::path::Path;
use text::suggestion;
use toml::Spanned;

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
        let (mut subjects, mut laws) = (Vec::new(), Vec::new());
        for input in &calibration.file.test {
            let (subject, known) = subject(calibration, input, opener)?;
            subjects.push(subject);
            laws.push(known);
        }
        let claims = claims(calibration, &laws)?;
        for (number, (input, subject)) in calibration.file.test.iter().zip(subjects).enumerate() {
            let subject = with_fixed(calibration, (number, subject), &claims)?;
            let mut exactness = EXACTNESS_OF_DRIVERS;
            if let Subject::Case(case) = &subject {
                let tolerance = case.file.solver.get_ref().force_tolerance;
                exactness = exactness.max(tolerance);
                model.difference = model.difference.max(tolerance.sqrt().clamp(1e-3, 0.03));
            }
            let curves = curves(calibration, input, &subject)?;
            model.tests.push(Test {
                name: input.name.get_ref().clone(),
                is_predicted: input.predict,
                curves,
                subject,
                targets: Vec::new(),
                exactness,
                is_by_law: false,
                at_start: Vec::new(),
            });
        }
        if let Some(step) = &calibration.file.difference {
            model.difference = *step.get_ref();
        }
        for (number, (name, input)) in calibration.file.free.iter().enumerate() {
            let own = claims.iter().filter(|claim| claim.by == By::Free(number));
            let own: Vec<&Claim<'_>> = own.collect();
            if own.is_empty() {
                return Err(Wanted::of_free(name, input.get_ref()).nowhere(calibration, &laws));
            }
            model.add(calibration, name, input.get_ref(), &own)?;
        }
        model.add_readings(calibration);
        model.start(calibration)?;
        Ok(model)
    }

    /// Adds a parameter, and what it stands for in each test.
    #[expect(clippy::float_cmp, reason = "an end that was given as it is")]
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
        let start = input.start.as_ref().map(|start| *start.get_ref()).or(own);
        let Some(start) = start else {
            let message = format!(
                "`{}` needs a `start`: no test gives it a value",
                name.get_ref()
            );
            return Err(calibration.error(name.span(), message));
        };
        let at = |value: &Option<Spanned<f64>>| value.as_ref().map_or(name.span(), Spanned::span);
        let outside = |key: &str, value: f64, within: String, span| {
            calibration.error(
                span,
                format!("`{key}` is {value}, outside {within} of `{}`", first.id),
            )
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
            let message = format!(
                "`{}` starts from {start}, which has no logarithm",
                name.get_ref()
            );
            let hint = "`scale = \"linear\"`, or a `start` above 0";
            return Err(Error::from(
                calibration
                    .source
                    .error(at(&input.start), message)
                    .hint(hint),
            ));
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
                    let Some(reading) = reading.map(toml::Spanned::get_ref) else {
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
                let hint = "a `start` of the free parameters that the law can follow";
                Error::from(
                    calibration
                        .source
                        .error(input.name.span(), message)
                        .hint(hint),
                )
            })?;
            let test = &mut self.tests[number];
            for (curve, written) in test.curves.iter_mut().zip(&input.curve) {
                let line = |values: &[f64]| {
                    let line = curve.line(&rows, values);
                    line.map_err(|gap| explain(calibration, written, gap, &rows))
                };
                // Whatever offset and scale may become, a point that is compared stays one.
                let mut lines = vec![line(&values)?];
                for ends in [[0, 0], [0, 1], [1, 0], [1, 1]] {
                    let mut values = values.clone();
                    for (place, end) in ends.into_iter().enumerate() {
                        if let Some(parameter) = curve.readings[place] {
                            values[parameter] = bounds[parameter][end];
                        }
                    }
                    lines.push(line(&values)?);
                }
                let before = curve.points.len();
                let is_there = |x: f64| lines.iter().all(|line| curve.spot(line, x).is_some());
                let kept: Vec<bool> = curve.points.iter().map(|(x, _)| is_there(*x)).collect();
                let mut keep = kept.iter();
                curve.points.retain(|_| *keep.next().unwrap_or(&false));
                let mut keep = kept.iter();
                curve.deviations.retain(|_| *keep.next().unwrap_or(&false));
                let left = before - curve.points.len();
                let [low, high] = extent(&lines[0]);
                if curve.points.is_empty() {
                    let message = format!(
                        "no measured point lies where `{}` is computed, from {low:e} to {high:e}: are units and \
                         signs those of the computed column?",
                        curve.x
                    );
                    let error = calibration.source.error(written.measured.span(), message);
                    return Err(error
                        .hint("`x_scale` of `measured` brings it to the unit")
                        .into());
                }
                if left > 0 {
                    self.notes.push(format!(
                        "{}, {}: {left} of {before} measured points are left out: `{}` is computed from {low:e} to \
                         {high:e} only",
                        test.name, curve.y, curve.x
                    ));
                }
            }
            let test = &mut self.tests[number];
            let there = test
                .curves
                .iter()
                .map(|curve| curve.computed(&rows, &values));
            test.at_start = there.map(Result::unwrap_or_default).collect();
        }
        Ok(())
    }
}

/// Whose it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum By {
    Free(usize),
    Fixed(usize),
}

/// A parameter of a law in a test, and what of the calibration stands for it.
#[derive(Clone, Copy, Debug)]
struct Claim<'a> {
    test: usize,
    law: &'a Known,
    /// Number in the law.
    number: usize,
    by: By,
    wanted: Wanted<'a>,
}

impl<'a> Claim<'a> {
    fn parameter(&self) -> &'a ParameterDescription {
        &self.law.description.parameters[self.number]
    }

    /// Whether two mean the same value.
    fn is_of(&self, other: &Self) -> bool {
        let place = |claim: &Self| (claim.test, &claim.law.table, claim.number);
        place(self) == place(other)
    }
}

/// Parameters that the names under `[fixed]` and `[free]` stand for. In a driver a name without `laws`
/// takes precedence over those with `laws`.
fn claims<'a>(
    calibration: &'a Calibration,
    laws: &'a [Vec<Known>],
) -> Result<Vec<Claim<'a>>, Error> {
    let file = &calibration.file;
    check_stands_for(calibration)?;
    let fixed = file.fixed.iter().enumerate();
    let fixed =
        fixed.map(|(i, (name, input))| (By::Fixed(i), Wanted::of_fixed(name, input.get_ref())));
    let free = file.free.iter().enumerate();
    let free = free.map(|(i, (name, input))| (By::Free(i), Wanted::of_free(name, input.get_ref())));
    let mut claims: Vec<Claim<'a>> = Vec::new();
    for (by, wanted) in fixed.chain(free) {
        let mut own: Vec<Claim<'a>> = Vec::new();
        for (test, known) in laws.iter().enumerate() {
            let stands_for = file.test[test].stands_for.as_ref();
            for law in wanted.of(calibration, known, stands_for)? {
                let id = wanted.id.get_ref();
                let Some(number) = law.description.parameters.iter().position(|p| p.id == *id)
                else {
                    continue;
                };
                let claim = Claim {
                    test,
                    law,
                    number,
                    by,
                    wanted,
                };
                // A law that a case calls in several ways has one table.
                if !own.iter().any(|other| other.is_of(&claim)) {
                    own.push(claim);
                }
            }
        }
        if own.is_empty() && matches!(by, By::Fixed(_)) {
            return Err(wanted.nowhere(calibration, laws));
        }
        claims.extend(own);
    }
    let is_shared = |claim: &Claim<'_>| claim.law.table.is_none() && !claim.wanted.laws.is_empty();
    let has_own = |claim: &Claim<'_>| {
        let mut others = claims.iter().filter(|other| other.is_of(claim));
        others.any(|other| !is_shared(other))
    };
    let kept = claims
        .iter()
        .filter(|claim| !is_shared(claim) || !has_own(claim));
    let kept: Vec<Claim<'a>> = kept.copied().collect();
    for (place, claim) in kept.iter().enumerate() {
        if let Some(first) = kept[..place].iter().find(|first| first.is_of(claim)) {
            let test = file.test[claim.test].name.get_ref();
            return Err(twice(calibration, first, claim, test));
        }
    }
    Ok(kept)
}

/// Checks that every driver's `stands_for` is a table that some name belongs to.
fn check_stands_for(calibration: &Calibration) -> Result<(), Error> {
    let file = &calibration.file;
    let free = file.free.values().map(|input| &input.get_ref().laws);
    let fixed = file.fixed.values().map(|input| &input.get_ref().laws);
    let tables: Vec<&str> = free
        .chain(fixed)
        .flatten()
        .map(|table| table.get_ref().as_str())
        .collect();
    for test in &file.test {
        let Some(table) = &test.stands_for else {
            continue;
        };
        let error = |message: String| calibration.source.error(table.span(), message);
        if test.driver.is_none() {
            let message = "`stands_for` belongs to a driver: laws of a case have their tables";
            return Err(error(message.to_owned()).into());
        }
        if !tables.contains(&table.get_ref().as_str()) {
            let message = format!("no name belongs to the law `{}`", table.get_ref());
            let hint = suggestion(table.get_ref(), tables);
            return Err(error(message).hint(hint).into());
        }
    }
    Ok(())
}

/// The error of two names for one value.
fn twice(calibration: &Calibration, first: &Claim<'_>, second: &Claim<'_>, test: &str) -> Error {
    let table = |claim: &Claim<'_>| match claim.by {
        By::Free(_) => "free",
        By::Fixed(_) => "fixed",
    };
    let [a, b] = [first, second].map(|claim| (claim.wanted.name.get_ref(), table(claim)));
    let law = second.law.table.as_ref();
    let of_law = law.map_or_else(String::new, |name| format!(" of law `{name}`"));
    let message = format!(
        "`{}`{of_law} has two names in test `{test}`: `{}` of [{}] and `{}` of [{}]",
        second.parameter().id,
        a.0,
        a.1,
        b.0,
        b.1
    );
    let hint = if second.law.table.is_none() && !second.wanted.laws.is_empty() {
        "a name belongs to drivers, too; `stands_for` of the test says of which law its driver is. One without `laws` \
         belongs to drivers alone, and goes before others there"
    } else {
        "a value is looked for or fixed, once"
    };
    let span = second.wanted.name.span();
    calibration.source.error(span, message).hint(hint).into()
}

/// Why a curve cannot be read off, at its place in the file.
fn explain(calibration: &Calibration, curve: &CurveInput, gap: Gap, rows: &Rows) -> Error {
    let source = &calibration.source;
    match gap {
        Gap::NoColumn(name) => {
            let written = if *curve.x.get_ref() == name {
                &curve.x
            } else {
                &curve.y
            };
            let message = format!("there is no column `{name}`");
            let hint = suggestion(&name, rows.names.iter().map(String::as_str));
            source.error(written.span(), message).hint(hint).into()
        }
        Gap::TurnsBack { row, at } => {
            let message = format!(
                "`{}` does not only grow or only fall: at row {row} it is {at:e} and turns, or stays",
                curve.x.get_ref()
            );
            let hint = "`segment` of a driver, `phase` of a case chooses a part of the path; each part is a curve \
                        of its own";
            source.error(curve.x.span(), message).hint(hint).into()
        }
        Gap::NoRows => {
            let message = format!(
                "`{}` and `{}` have fewer than two rows of numbers here",
                curve.x.get_ref(),
                curve.y.get_ref()
            );
            source.error(curve.x.span(), message).into()
        }
        Gap::Outside(_) => source
            .error(curve.x.span(), "no measured point lies here")
            .into(),
    }
}

/// A law that a test calls.
#[derive(Clone, Debug)]
struct Known {
    /// Its table under `[laws]` of a case; none of a driver.
    table: Option<String>,
    description: LawDescription,
}

impl Known {
    fn parameter(&self, id: &str) -> Option<&ParameterDescription> {
        self.description.parameters.iter().find(|p| p.id == id)
    }

    /// The value that the test's file gives to a parameter, or the law itself.
    fn value(&self, subject: &Subject, id: &str) -> Option<f64> {
        let default = || self.parameter(id).and_then(|p| p.default);
        match subject {
            Subject::Driver(driver) => driver.point().parameter(id),
            Subject::Case(case) => {
                let laws = case.file.laws.iter();
                let mut laws = laws.filter(|(key, _)| Some(key.get_ref()) == self.table.as_ref());
                let (_, law) = laws.next()?;
                let mut given = law.get_ref().parameters.iter();
                match given.find(|(key, _)| key.get_ref() == id) {
                    None => default(),
                    Some((_, value)) => match value.get_ref() {
                        ParameterValue::Number(number) => Some(*number),
                        ParameterValue::Integer(number) => Some(*number as f64),
                        _ => None,
                    },
                }
            }
        }
    }
}

/// A parameter of a law as the calibration names it.
#[derive(Clone, Copy, Debug)]
struct Wanted<'a> {
    name: &'a Spanned<String>,
    id: &'a Spanned<String>,
    laws: &'a [Spanned<String>],
}

impl<'a> Wanted<'a> {
    fn of_free(name: &'a Spanned<String>, input: &'a FreeInput) -> Self {
        Self {
            name,
            id: input.parameter.as_ref().unwrap_or(name),
            laws: &input.laws,
        }
    }

    fn of_fixed(name: &'a Spanned<String>, input: &'a FixedInput) -> Self {
        Self {
            name,
            id: input.parameter.as_ref().unwrap_or(name),
            laws: &input.laws,
        }
    }

    /// The laws of a test that it belongs to.
    fn of<'k>(
        self,
        calibration: &Calibration,
        known: &'k [Known],
        stands_for: Option<&Spanned<String>>,
    ) -> Result<Vec<&'k Known>, Error> {
        let has = |law: &&Known| law.parameter(self.id.get_ref()).is_some();
        let is_case = known.iter().any(|law| law.table.is_some());
        if !is_case {
            let is_another = stands_for.is_some_and(|table| {
                let mut laws = self.laws.iter();
                !self.laws.is_empty() && !laws.any(|law| law.get_ref() == table.get_ref())
            });
            let own = known.iter().filter(|_| !is_another);
            return Ok(own.filter(has).collect());
        }
        let named = |law: &&Known| {
            let table = law.table.as_deref();
            self.laws
                .iter()
                .any(|name| Some(name.get_ref().as_str()) == table)
        };
        if let Some(law) = known.iter().filter(named).find(|law| !has(law)) {
            let message = format!(
                "law `{}` has no parameter `{}`",
                law.description.id,
                self.id.get_ref()
            );
            let ids = law.description.parameters.iter().map(|p| p.id.as_str());
            let hint = suggestion(self.id.get_ref(), ids);
            return Err(calibration
                .source
                .error(self.id.span(), message)
                .hint(hint)
                .into());
        }
        Ok(known.iter().filter(named).collect())
    }

    /// The error of a parameter that no test has.
    fn nowhere(self, calibration: &Calibration, laws: &[Vec<Known>]) -> Error {
        let source = &calibration.source;
        let tables = || laws.iter().flatten().filter_map(|law| law.table.as_deref());
        let unknown = self
            .laws
            .iter()
            .find(|name| !tables().any(|t| t == name.get_ref()));
        if let Some(name) = unknown.filter(|_| tables().next().is_some()) {
            let message = format!(
                "no case of a test has a law `{}`, or none uses it",
                name.get_ref()
            );
            let hint = suggestion(name.get_ref(), tables().collect::<Vec<_>>());
            return source.error(name.span(), message).hint(hint).into();
        }
        let has = |law: &&Known| law.parameter(self.id.get_ref()).is_some();
        let of_cases = laws.iter().flatten().filter(has);
        let of_cases: Vec<&str> = of_cases.filter_map(|law| law.table.as_deref()).collect();
        if !of_cases.is_empty() {
            let message = format!(
                "`{}` needs `laws`: the tables under [laws] of the case that it belongs to",
                self.name.get_ref()
            );
            let hint = format!("these have such a parameter: {}", of_cases.join(", "));
            return source.error(self.name.span(), message).hint(hint).into();
        }
        let message = format!("no law of a test has a parameter `{}`", self.id.get_ref());
        let ids = laws
            .iter()
            .flatten()
            .flat_map(|law| &law.description.parameters);
        let mut ids: Vec<&str> = ids.map(|p| p.id.as_str()).collect();
        ids.sort_unstable();
        ids.dedup();
        let hint = suggestion(self.id.get_ref(), ids);
        source.error(self.id.span(), message).hint(hint).into()
    }
}

/// What a test computes, with the laws that it calls.
fn subject(
    calibration: &Calibration,
    input: &TestInput,
    opener: &Opener,
) -> Result<(Subject, Vec<Known>), Error> {
    let source = &calibration.source;
    let variant = input
        .variant
        .as_ref()
        .map(|variant| variant.get_ref().as_str());
    let several = |names: Vec<String>, file: &Path| {
        let message = format!("{} has variants: `variant` chooses one", file.display());
        let error = source.error(input.name.span(), message);
        Error::from(error.hint(format!("there are {}", names.join(", "))))
    };
    let at_variant = |error: Error| match (&input.variant, error) {
        (Some(name), Error::Text(text::Error::Usage(message))) => {
            Error::from(source.error(name.span(), message))
        }
        (_, error) => error,
    };
    let missing = |written: &Spanned<std::path::PathBuf>, path: &Path| {
        let message = format!("there is no file {}", path.display());
        calibration.error(written.span(), message)
    };
    if let Some(written) = &input.driver {
        let path = calibration.path_of(written);
        if !path.is_file() {
            return Err(missing(written, &path));
        }
        let mut drivers = Driver::read_with(opener, &path, &[])?;
        let names = drivers
            .iter()
            .filter_map(|d| d.point().variant().map(str::to_owned))
            .collect();
        keep(&mut drivers, variant, |d| {
            d.point().variant().map(str::to_owned)
        })
        .map_err(at_variant)?;
        if drivers.len() > 1 {
            return Err(several(names, &path));
        }
        let driver = drivers
            .pop()
            .ok_or_else(|| Error::internal("a driver file without drivers"))?;
        let known = Known {
            table: None,
            description: driver.point().law().description().clone(),
        };
        return Ok((Subject::Driver(Box::new(driver)), vec![known]));
    }
    let Some(written) = &input.case else {
        return Err(Error::internal("a test without driver and case"));
    };
    let path = calibration.path_of(written);
    if !path.exists() {
        return Err(missing(written, &path));
    }
    let cases = Case::load_with(&path, &[])?.into_iter();
    let mut cases: Vec<Case> = cases.map(|case| case.opened_by(opener)).collect();
    let names = cases
        .iter()
        .filter_map(|case| case.variant.clone())
        .collect();
    keep(&mut cases, variant, |case| case.variant.clone()).map_err(at_variant)?;
    if cases.len() > 1 {
        return Err(several(names, &path));
    }
    let mut case = cases
        .pop()
        .ok_or_else(|| Error::internal("a case file without cases"))?;
    case.file.output = Output::default();
    case.file.figures.clear();
    let (_, laws) = run::begin(&case, Reuse::default())?;
    let known = laws.iter().map(|((table, _), built)| Known {
        table: Some(table.clone()),
        description: built.law.description().clone(),
    });
    let known = known.collect();
    Ok((Subject::Case(Box::new(case)), known))
}

/// The same with the fixed parameters of the calibration.
fn with_fixed(
    calibration: &Calibration,
    (test, mut subject): (usize, Subject),
    claims: &[Claim<'_>],
) -> Result<Subject, Error> {
    let fixed: Vec<&FixedInput> = calibration
        .file
        .fixed
        .iter()
        .map(|(_, f)| f.get_ref())
        .collect();
    let mut of_driver = Vec::new();
    for claim in claims.iter().filter(|claim| claim.test == test) {
        let By::Fixed(number) = claim.by else {
            continue;
        };
        let value = fixed[number].value.get_ref().clone();
        let set = (claim.parameter().id.clone(), value);
        match &mut subject {
            Subject::Driver(_) => of_driver.push(set),
            Subject::Case(case) => {
                for (key, table) in &mut case.file.laws {
                    if Some(key.get_ref()) == claim.law.table.as_ref() {
                        let own = &mut table.get_mut().parameters;
                        set_parameters(own, std::slice::from_ref(&set));
                    }
                }
            }
        }
    }
    if let Subject::Driver(driver) = &subject
        && !of_driver.is_empty()
    {
        let set = driver.with_parameters(&of_driver).map_err(|error| {
            let first = calibration.file.fixed.iter().next();
            let first = first.map_or(0..0, |(name, _)| name.span());
            calibration.error(first, format!("[fixed]: {}", words(&error)))
        })?;
        subject = Subject::Driver(Box::new(set));
    }
    Ok(subject)
}

/// The curves of a test.
fn curves(
    calibration: &Calibration,
    input: &TestInput,
    subject: &Subject,
) -> Result<Vec<Curve>, Error> {
    let curve = |written: &CurveInput| {
        let stretch = match subject {
            Subject::Driver(driver) => {
                let n = driver.point().segments().len();
                let number = written.segment.as_ref();
                if let Some(segment) = number.filter(|s| !(1..=n).contains(s.get_ref())) {
                    let message = format!(
                        "there is no segment {}: the driver has {n}",
                        segment.get_ref()
                    );
                    return Err(calibration.error(segment.span(), message));
                }
                number.map(|segment| segment.get_ref() - 1)
            }
            Subject::Case(case) => {
                let names = case
                    .file
                    .phases
                    .iter()
                    .map(|phase| phase.name.get_ref().as_str());
                let names: Vec<&str> = names.collect();
                Some(match &written.phase {
                    None => names.len().saturating_sub(1),
                    Some(phase) => {
                        let place = names.iter().position(|name| name == phase.get_ref());
                        place.ok_or_else(|| {
                            let message = format!("there is no phase `{}`", phase.get_ref());
                            let hint = suggestion(phase.get_ref(), names.clone());
                            Error::from(calibration.source.error(phase.span(), message).hint(hint))
                        })?
                    }
                })
            }
        };
        let points = calibration.measured(written)?.points;
        Ok(Curve {
            x: written.x.get_ref().clone(),
            y: written.y.get_ref().clone(),
            labels: [
                written
                    .x_label
                    .clone()
                    .unwrap_or_else(|| written.x.get_ref().clone()),
                written
                    .y_label
                    .clone()
                    .unwrap_or_else(|| written.y.get_ref().clone()),
            ],
            stretch,
            deviations: deviations(calibration, written, &points)?,
            points,
            is_noise_given: written.noise.is_some() || written.relative_noise.is_some(),
            readings: [None; 4],
            weight: written.weight.get_ref() * input.weight.get_ref(),
        })
    };
    input.curve.iter().map(curve).collect()
}

/// Part of the largest value that counts as noise where nothing is reported.
const USUAL_NOISE: f64 = 0.01;

fn deviations(
    calibration: &Calibration,
    written: &CurveInput,
    points: &[(f64, f64)],
) -> Result<Vec<f64>, Error> {
    let largest = points
        .iter()
        .fold(0.0_f64, |largest, (_, y)| largest.max(y.abs()));
    let (plain, relative) = match (&written.noise, &written.relative_noise) {
        (None, None) => (USUAL_NOISE * largest, 0.0),
        (noise, relative) => (
            noise.as_ref().map_or(0.0, |noise| *noise.get_ref()),
            relative.as_ref().map_or(0.0, |noise| *noise.get_ref()),
        ),
    };
    let all: Vec<f64> = points
        .iter()
        .map(|(_, y)| plain.hypot(relative * y))
        .collect();
    if all.iter().all(|deviation| *deviation > 0.0) {
        return Ok(all);
    }
    let written = written.noise.as_ref().or(written.relative_noise.as_ref());
    let at = written.map_or(0..0, Spanned::span);
    let message = "a measured value has no noise: `noise` is above 0 where a value is 0";
    Err(calibration.error(at, message))
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
