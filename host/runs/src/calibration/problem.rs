//! A calibration as functions of its parameters, for optimisers and samplers of others.

use super::coordinates::Parameter;
use super::fit::Search;
use super::least_squares::Problem as _;
use super::model::Model;
use super::stage::Group;
use super::{Options, groups};
use crate::Error;
use crate::experiment::{Kept, Scratch};
use crate::variants::keep;
use input::calibration::Calibration;
use law::Stop;
use nalgebra::{DMatrix, DVector};
use std::f64::consts::TAU;
use std::path::Path;

/// Residuals of all tests that are fitted, by all parameters. Slices `values` have one for each of [`Self::parameters`], in
/// the unit of its law.
#[derive(Debug)]
pub struct ResidualProblem {
    model: Model,
    group: Group,
}

impl ResidualProblem {
    /// Reads all files and computes each test once, with the values that the command starts from. Runs of cases are in the
    /// folder of the results for a while.
    ///
    /// # Errors
    /// Bad input; several variants and none chosen; a test that cannot be computed with the starting values.
    pub fn new(path: &Path, options: &Options) -> Result<Self, Error> {
        let mut all = Calibration::load_with(path, &options.settings)?;
        keep(&mut all, options.variant.as_deref(), |one| {
            one.variant.clone()
        })?;
        let (Some(mut calibration), []) = (all.pop(), all.as_slice()) else {
            let message = format!("{} has variants: `variant` chooses one", path.display());
            return Err(Error::usage(message));
        };
        let folder = options.folder(&calibration);
        let model = Model::new(&calibration, &options.opener, &folder, &options.stop)?;
        calibration.file.stage.clear();
        let group = groups(&calibration, &model).remove(0);
        Ok(Self { model, group })
    }

    /// The parameters.
    pub fn parameters(&self) -> &[Parameter] {
        &self.model.parameters
    }

    /// Number of residuals.
    pub fn n_points(&self) -> usize {
        self.model.weights(&self.group.tests).len()
    }

    /// Sets who may want the next calls to stop, and the folder of their runs.
    ///
    /// # Errors
    /// [`text::Error::Unwritable`].
    pub fn begin(&mut self, folder: &Path, stop: &Stop) -> Result<(), Error> {
        self.model.stop = stop.clone();
        self.model.scratch = Scratch::new(folder, stop)?;
        self.model.kept = Kept::default();
        Ok(())
    }

    /// Computed less measured values over their deviations, times the root of the weights.
    ///
    /// # Errors
    /// Values outside their bounds; a test has no answer.
    pub fn residuals(&mut self, values: &[f64]) -> Result<Vec<f64>, Error> {
        let place = self.place(values)?;
        let mut all = Vec::new();
        for &test in &self.group.tests {
            match self.model.computed(test, &place)? {
                Ok(computed) => all.extend(self.model.tests[test].residuals(&computed)),
                Err(why) => return Err(self.refusal(test, &place, &why)),
            }
        }
        Ok(all)
    }

    /// Derivatives of the residuals: a row for each, a column for each parameter. They are those of a driver's law if
    /// it gives rates, else differences.
    ///
    /// # Errors
    /// As [`Self::residuals`], or neither side of the values has an answer.
    pub fn jacobian(&mut self, values: &[f64]) -> Result<DMatrix<f64>, Error> {
        let here = DVector::from_vec(self.residuals(values)?);
        let place = self.place(values)?;
        let mut search = Search {
            model: &mut self.model,
            group: &self.group,
            all: place.clone(),
            moving: (0..place.len()).collect(),
            is_one_sided: false,
        };
        let Some(mut jacobian) = search.jacobian(&place, &here)? else {
            let message = "no derivatives: the tests have an answer on neither side of the values";
            return Err(Error::library(message));
        };
        let parameters = self.model.parameters.iter().zip(values);
        for (mut column, (parameter, value)) in jacobian.column_iter_mut().zip(parameters) {
            column /= parameter.slope(*value);
        }
        Ok(jacobian)
    }

    /// Logarithm of the probability density of the measured values, normal and independent, with `scatter` times their
    /// deviations. Weights do not count. It is −∞ outside the bounds and where a test has no answer.
    ///
    /// # Errors
    /// What is no matter of the values.
    pub fn log_likelihood(&mut self, values: &[f64], scatter: f64) -> Result<f64, Error> {
        let Ok(place) = self.place(values) else {
            return Ok(f64::NEG_INFINITY);
        };
        let mut sum = 0.0;
        for &test in &self.group.tests {
            let Ok(computed) = self.model.computed(test, &place)? else {
                return Ok(f64::NEG_INFINITY);
            };
            for (curve, own) in self.model.tests[test].of_curves(&computed) {
                let points = curve.points.iter().zip(&curve.deviations).zip(own);
                let density = points.map(|(((_, y), deviation), computed)| {
                    let deviation = scatter * deviation;
                    -0.5 * ((computed - y) / deviation).powi(2) - (deviation * TAU.sqrt()).ln()
                });
                sum += density.sum::<f64>();
            }
        }
        Ok(sum)
    }

    /// Values as the search counts them.
    fn place(&self, values: &[f64]) -> Result<Vec<f64>, Error> {
        let counted = |(p, &value): (&Parameter, &f64)| {
            let (name, bounds) = (p.name.clone(), p.bounds);
            if (bounds[0]..=bounds[1]).contains(&value) {
                return Ok(p.counted(value));
            }
            Err(text::Error::OutOfBounds {
                name,
                value,
                bounds,
            }
            .into())
        };
        self.parameters().iter().zip(values).map(counted).collect()
    }

    /// Why a test has no answer: the error of its computation, if that fails.
    fn refusal(&self, test: usize, place: &[f64], why: &str) -> Error {
        let test = &self.model.tests[test];
        let again = test.rows(&self.model.values(place), &self.model.scratch);
        let told = || Error::library(format!("test `{}`: {why}", test.name));
        again.err().unwrap_or_else(told)
    }
}
