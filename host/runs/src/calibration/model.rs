//! The tests of a calibration, computed for values of its parameters.

use super::coordinates::Parameter;
use super::curve::{Curve, Gap};
use crate::Error;
use crate::experiment::{Earlier, Kept, Rows, Scratch, Timing, bits, measure};
use crate::run::identity_of;
use input::material::{ParameterValue, set_parameters};
use input::{Case, Driver, Kind};
use law::{Stop, hexadecimal_sha256};
use results::point_figure::{drawable, drawn};
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;
use std::fmt::Write as _;
use std::path::Path;

/// All tests, and the parameters that are looked for.
#[derive(Debug)]
pub(super) struct Model {
    pub(super) parameters: Vec<Parameter>,
    pub(super) tests: Vec<Test>,
    /// Step of differences, as the search counts.
    pub(super) difference: f64,
    pub(super) stop: Stop,
    /// What was computed.
    pub(super) kept: Kept<Key, Columns>,
    /// Why the first computation that came to no result did not.
    pub(super) first_failure: Option<String>,
    /// Points that are left out.
    pub(super) notes: Vec<String>,
    pub(super) scratch: Scratch,
    /// Last computations of tests with fitted offsets or scales: other values of these need no new computation.
    pub(super) rows_of_late: VecDeque<(Key, Rows)>,
}

/// Number of these that are kept.
const OF_LATE: usize = 32;

/// The file of what was computed, in the folder of a calibration, and what is done there. The search takes the same way
/// every time: with what each computation came to, the same command takes it for nothing as far as it went before.
const FILE: (&str, &str) = ("computations.jsonl", "calibrates");

/// What was computed of a test: values at its measured points, or their derivatives by the values of some parameters.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub(super) struct Key {
    test: usize,
    /// Values of its parameters, by their bits.
    at: Vec<u64>,
    /// The parameters that derivatives are by; none of values.
    by: Vec<usize>,
}

/// A column of values for each parameter, one of values; or why none exist.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Columns(#[serde(with = "bits")] Computed<Vec<Vec<f64>>>);

/// Removes the file of what was computed: the calibration has come to its end.
pub(super) fn forget(folder: &Path) {
    // What cannot be removed is taken over by the next call, which finds the same with it.
    let _ = std::fs::remove_file(folder.join(FILE.0));
}

/// A test.
#[derive(Debug)]
pub(super) struct Test {
    pub(super) name: String,
    pub(super) is_predicted: bool,
    pub(super) curves: Vec<Curve>,
    pub(super) subject: Subject,
    /// Parameters of laws that the free ones represent: number, table of laws (none for a driver),
    /// id.
    pub(super) targets: Vec<(usize, Option<String>, String)>,
    /// Relative accuracy of its computed values.
    pub(super) exactness: f64,
    /// Whether its derivatives last came from the rates of its law.
    pub(super) is_by_law: bool,
    /// Its curves at the measured points with the starting values.
    pub(super) at_start: Vec<Vec<f64>>,
}

/// The computation.
#[derive(Debug)]
pub(super) enum Subject {
    Driver(Box<Driver>),
    Case(Box<Case>),
}

/// Result of a computation, or the reason why it is missing, in words.
pub(super) type Computed<T> = Result<T, String>;

impl Model {
    /// What a test computes at the measured points of its curves, at a place of the search.
    ///
    /// # Errors
    /// Stopped; what is no matter of the values.
    pub(super) fn computed(
        &mut self,
        test: usize,
        counted: &[f64],
    ) -> Result<Computed<Vec<f64>>, Error> {
        self.stop.check("the calibration")?;
        let columns = self.once(test, counted, &[], |model| {
            let rows = model.rows_for_readings(test, counted)?;
            Ok(rows.and_then(|rows| {
                let values = model.tests[test].computed(&rows, &model.values(counted));
                values
                    .map(|values| vec![values])
                    .map_err(|_| "a curve ends before its last measured point".to_owned())
            }))
        })?;
        if let Err(why) = &columns {
            self.first_failure.get_or_insert_with(|| why.clone());
        }
        Ok(columns.map(|columns| columns.concat()))
    }

    /// Computes something of a test at a place of the search, unless that was done before: values, or derivatives `by`
    /// parameters.
    pub(super) fn once(
        &mut self,
        test: usize,
        counted: &[f64],
        by: &[usize],
        compute: impl FnOnce(&mut Self) -> Result<Computed<Vec<Vec<f64>>>, Error>,
    ) -> Result<Computed<Vec<Vec<f64>>>, Error> {
        let values = self.values(counted).into_iter().enumerate();
        let own = values.filter(|(parameter, _)| self.tests[test].has(*parameter));
        let key = Key {
            test,
            at: own.map(|(_, value)| value.to_bits()).collect(),
            by: by.to_vec(),
        };
        if let Some(Columns(found)) = self.kept.find(&key) {
            return Ok(found.clone());
        }
        let columns = compute(self)?;
        self.kept.keep(key, Columns(columns.clone()))?;
        Ok(columns)
    }

    /// As [`Self::rows`], which takes no account of how curves are read.
    fn rows_for_readings(&mut self, test: usize, counted: &[f64]) -> Result<Computed<Rows>, Error> {
        if !self.tests[test].is_read() {
            return self.rows(test, counted);
        }
        let values = self.values(counted);
        let targets = self.tests[test].targets.iter();
        let key = Key {
            test,
            at: targets.map(|(p, ..)| values[*p].to_bits()).collect(),
            by: Vec::new(),
        };
        if let Some((_, rows)) = self.rows_of_late.iter().find(|(other, _)| *other == key) {
            return Ok(Ok(rows.clone()));
        }
        let rows = self.rows(test, counted)?;
        if let Ok(rows) = &rows {
            self.rows_of_late.push_back((key, rows.clone()));
            if self.rows_of_late.len() > OF_LATE {
                self.rows_of_late.pop_front();
            }
        }
        Ok(rows)
    }

    /// All rows of a test at a place of the search.
    ///
    /// # Errors
    /// As [`Self::computed`].
    pub(super) fn rows(&self, test: usize, counted: &[f64]) -> Result<Computed<Rows>, Error> {
        self.stop.check("the calibration")?;
        let values = self.values(counted);
        match self.tests[test].rows(&values, &self.scratch) {
            Ok(rows) => Ok(Ok(rows)),
            Err(error) if is_of_the_values(&error) => Ok(Err(words(&error))),
            Err(error) => Err(error),
        }
    }

    /// The values of all parameters at a place of the search.
    pub(super) fn values(&self, counted: &[f64]) -> Vec<f64> {
        let pairs = self.parameters.iter().zip(counted);
        pairs.map(|(p, u)| p.value(*u)).collect()
    }

    /// Relative accuracy of the values of some tests: the worst of them.
    pub(super) fn exactness_of(&self, tests: &[usize]) -> f64 {
        let all = tests.iter().map(|&test| self.tests[test].exactness);
        all.fold(0.0, f64::max)
    }

    /// The weight of each residual of some tests.
    pub(super) fn weights(&self, tests: &[usize]) -> Vec<f64> {
        let curves = tests.iter().flat_map(|&test| &self.tests[test].curves);
        curves
            .flat_map(|curve| std::iter::repeat_n(curve.weight, curve.points.len()))
            .collect()
    }

    /// A parameter that moves the values of some tests by less than this, relative to the largest,
    /// is not seen: their differences are not known better.
    pub(super) fn blind_in(&self, tests: &[usize]) -> f64 {
        (self.exactness_of(tests) / self.difference).max(1e-6)
    }

    /// Keeps what is computed in a folder, and takes over what an earlier call has kept there.
    ///
    /// # Errors
    /// Another process calibrates there; files that cannot be read or written.
    pub(super) fn keep_in(&mut self, folder: &Path, anew: bool) -> Result<(), Error> {
        let earlier = if anew {
            Earlier::Forget
        } else {
            Earlier::TakeOver
        };
        self.kept = Kept::in_folder(folder, FILE, &self.identity()?, earlier)?;
        Ok(())
    }

    /// Dependencies of all computations: program, files, libraries, abscissas of the curves,
    /// meaning of the parameters.
    fn identity(&self) -> Result<String, Error> {
        let mut text = format!(
            "pilum {}\nderivatives by values\n{:e}\n",
            env!("CARGO_PKG_VERSION"),
            self.difference
        );
        for test in &self.tests {
            let _ = writeln!(text, "{:?}", test.targets);
            for curve in &test.curves {
                let x: Vec<u64> = curve.points.iter().map(|(x, _)| x.to_bits()).collect();
                let _ = writeln!(text, "{} {} {:?} {x:?}", curve.x, curve.y, curve.stretch);
                if curve.readings.iter().any(Option::is_some) {
                    let _ = writeln!(text, "{:?}", curve.readings);
                }
            }
            match &test.subject {
                Subject::Case(case) => text += &identity_of(case)?,
                Subject::Driver(driver) => {
                    let (point, library) = (driver.point(), driver.point().law().library());
                    let (sha256, sidecar) = (library.sha256(), library.sidecar_sha256());
                    let values = point.law().parameters().iter().map(|value| value.to_bits());
                    let _ = writeln!(
                        text,
                        "{:?} {sha256} {sidecar:?} {:?} {:?}\n{}",
                        point.variant(),
                        values.collect::<Vec<_>>(),
                        point.segment_increments(),
                        driver.source().text_of_files()
                    );
                }
            }
        }
        Ok(hexadecimal_sha256(text.as_bytes()))
    }
}

/// Whether other values might do: the law refuses these, or cannot follow with them.
fn is_of_the_values(error: &Error) -> bool {
    match error {
        Error::Text(text::Error::Input(_)) => true,
        Error::Text(_) => false,
        other => matches!(
            other.kind(),
            Kind::NoEquilibrium | Kind::Library | Kind::Input
        ),
    }
}

/// The first line of an error.
pub(super) fn words(error: &Error) -> String {
    let text = error.to_string();
    text.lines()
        .next()
        .unwrap_or_default()
        .trim_end_matches(':')
        .to_owned()
}

/// A value of a parameter: table of laws (none for a driver), id, value.
pub(super) type Setting = (Option<String>, String, ParameterValue);

impl Subject {
    /// The same with other values of some parameters.
    ///
    /// # Errors
    /// Those of building the law of a driver.
    pub(super) fn with(&self, settings: Vec<Setting>) -> Result<Self, Error> {
        match self {
            Self::Driver(driver) => {
                let settings = settings.into_iter().map(|(_, id, value)| (id, value));
                let driver = driver.with_parameters(&settings.collect::<Vec<_>>())?;
                Ok(Self::Driver(Box::new(driver)))
            }
            Self::Case(case) => {
                let mut case = case.clone();
                for (table, id, value) in settings {
                    let laws = case.file.laws.iter_mut();
                    let mut laws = laws.filter(|(key, _)| Some(key.get_ref()) == table.as_ref());
                    if let Some((_, law)) = laws.next() {
                        set_parameters(&mut law.get_mut().parameters, &[(id, value)]);
                    }
                }
                Ok(Self::Case(case))
            }
        }
    }
}

impl Test {
    /// The subject with these values of the parameters.
    ///
    /// # Errors
    /// As [`Subject::with`].
    pub(super) fn with(&self, values: &[f64]) -> Result<Subject, Error> {
        let targets = self.targets.iter();
        let settings = targets.map(|(parameter, table, id)| {
            let value = ParameterValue::Number(values[*parameter]);
            (table.clone(), id.clone(), value)
        });
        self.subject.with(settings.collect())
    }

    /// What the test computes with these values of the parameters.
    ///
    /// # Errors
    /// Those of the computation.
    pub(super) fn rows(&self, values: &[f64], scratch: &Scratch) -> Result<Rows, Error> {
        match self.with(values)? {
            Subject::Driver(mut driver) => {
                driver.point_mut().stop_on(&scratch.stop);
                rows_of(&driver)
            }
            Subject::Case(case) => Ok(measure(*case, scratch, Timing::Once)?.rows),
        }
    }

    /// Whether a free parameter has a say in it.
    pub(super) fn has(&self, parameter: usize) -> bool {
        let mut read = self.curves.iter().flat_map(|curve| curve.readings);
        self.targets.iter().any(|(number, ..)| *number == parameter)
            || read.any(|number| number == Some(parameter))
    }

    /// Whether it is looked for how a curve was read.
    fn is_read(&self) -> bool {
        let mut read = self.curves.iter().flat_map(|curve| curve.readings);
        read.any(|number| number.is_some())
    }

    /// All curves at their measured points.
    ///
    /// # Errors
    /// One cannot be read off.
    pub(super) fn computed(&self, rows: &Rows, values: &[f64]) -> Result<Vec<f64>, Gap> {
        let mut all = Vec::new();
        for curve in &self.curves {
            all.extend(curve.computed(rows, values)?);
        }
        Ok(all)
    }

    /// Residuals of all curves, from what they are at their measured points.
    pub(super) fn residuals(&self, computed: &[f64]) -> Vec<f64> {
        let of_curves = self.of_curves(computed);
        of_curves
            .flat_map(|(curve, values)| curve.residuals(values))
            .collect()
    }

    /// Differences at all measured points, each as its curve weighs it.
    pub(super) fn weighed(&self, differences: &[f64]) -> Vec<f64> {
        let of_curves = self.of_curves(differences);
        of_curves
            .flat_map(|(curve, own)| curve.weighed(own))
            .collect()
    }

    /// The curves, each with its own of values at all measured points.
    pub(super) fn of_curves<'a, T>(
        &'a self,
        mut values: &'a [T],
    ) -> impl Iterator<Item = (&'a Curve, &'a [T])> {
        self.curves.iter().map(move |curve| {
            let (own, rest) = values.split_at(curve.points.len());
            values = rest;
            (curve, own)
        })
    }

    /// Whether a computation takes long, so that derivatives make do with one each.
    pub(super) fn is_slow(&self) -> bool {
        matches!(self.subject, Subject::Case(_))
    }

    /// Number of measured points.
    pub(super) fn n_points(&self) -> usize {
        self.curves.iter().map(|curve| curve.points.len()).sum()
    }
}

/// The rows of a driver, by segment; each segment starts with the row that it starts from.
fn rows_of(driver: &Driver) -> Result<Rows, Error> {
    let mut all = Vec::new();
    driver.run(|row| {
        let values = drawn(driver.point(), row).into_iter();
        all.push(
            values
                .map(|value| value.unwrap_or(f64::NAN))
                .collect::<Vec<f64>>(),
        );
    })?;
    let mut stretches = Vec::new();
    let mut first = 0;
    for increments in driver.point().segment_increments() {
        stretches.push(all[first..=first + increments].to_vec());
        first += increments;
    }
    Ok(Rows {
        names: drawable(driver.point()),
        stretches,
        ..Rows::default()
    })
}
