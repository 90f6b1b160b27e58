//! Propagation of the scatter of measured values to parameters and predictions.
//!
//! To first order the error of the parameters is linear in the errors η of the measured values, in units of
//! their noise: δu = L η. A stage fits u_f while u_h of earlier stages are held. Its residuals are −√w η +
//! J_f δu_f + J_h δu_h, so that δu_f = −A⁻¹ J_fᵀ (−√w η + J_h δu_h). That carries the errors of each stage
//! into the next ones. A measured value that several stages are fitted to has the same error in all. An
//! undetermined direction z of a stage leaves its parameters free along it; later stages follow it, δu_f =
//! −A⁻¹ J_fᵀ J_h z_h.
//!
//! A computed value changes by g = ∂y/∂u: its variance is s² |gᵀL|², and is unbounded where gᵀz is
//! not 0.

use super::model::Model;
use super::stage::{Group, Stage};
use crate::Error;
use nalgebra::{DMatrix, DVector};

/// Errors of all parameters.
#[derive(Clone, Debug)]
pub(super) struct Errors {
    /// By parameter and measured point, those of all tests one after the other.
    by_point: DMatrix<f64>,
    /// Directions that nothing holds, by parameter: the largest entry is the width of a range.
    open: Vec<Vec<f64>>,
    /// Where the points of each test begin.
    first: Vec<usize>,
}

/// Uncertainty of a computed value.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Known {
    /// Its variance, over that of the residuals.
    Variance(f64),
    /// Parameters, by number, that nothing holds and that it depends on.
    Open(Vec<usize>),
}

impl Errors {
    /// Directions of parameters that were not fitted.
    pub(super) fn new(model: &Model) -> Self {
        let mut n = 0;
        let first = model.tests.iter().map(|test| {
            n += test.n_points();
            n - test.n_points()
        });
        let first = first.collect();
        Self {
            by_point: DMatrix::zeros(model.parameters.len(), n),
            open: Vec::new(),
            first,
        }
    }

    /// What the parameters of a stage do where its own measured values change.
    fn of_own_points(&self, model: &Model, group: &Group, answer: &DMatrix<f64>) -> DMatrix<f64> {
        let mut rows = DMatrix::zeros(answer.nrows(), self.by_point.ncols());
        let mut row = 0;
        for &test in &group.tests {
            for (point, weight) in model.weights(&[test]).into_iter().enumerate() {
                let mut column = rows.column_mut(self.first[test] + point);
                column -= answer.column(row) * weight.sqrt();
                row += 1;
            }
        }
        rows
    }

    /// Takes in a stage, whose end is at `counted`.
    ///
    /// # Errors
    /// As [`Model::computed`].
    pub(super) fn add(
        &mut self,
        model: &mut Model,
        stage: &Stage,
        counted: &[f64],
    ) -> Result<(), Error> {
        let group = &stage.group;
        let variables = &stage.covariance.variables;
        let numbers = variables.iter().map(|&place| group.parameters[place]);
        let numbers: Vec<usize> = numbers.collect();
        let answer = stage.covariance.answer(&stage.jacobian);
        let n = model.parameters.len();
        let is_held = |p: &usize| !group.parameters.contains(p) && self.is_known(*p);
        let held: Vec<usize> = (0..n).filter(is_held).collect();
        let by_held = Self::by_held(model, group.tests.as_slice(), counted, &held)?;
        // Rows of this stage: its own measured values, and what the held ones do.
        let mut rows = self.of_own_points(model, group, &answer);
        let follow = by_held.as_ref().map(|by_held| &answer * by_held);
        if let Some(follow) = &follow {
            rows += follow * self.by_point.select_rows(&held);
        }
        for direction in &mut self.open {
            let of_held = held.iter().map(|&p| direction[p]);
            let of_held = DVector::from_iterator(held.len(), of_held);
            let moved = follow.as_ref().map(|follow| follow * of_held);
            group.parameters.iter().for_each(|&p| direction[p] = 0.0);
            for (k, &p) in numbers.iter().enumerate() {
                direction[p] = moved.as_ref().map_or(0.0, |moved| moved[k]);
            }
        }
        for &p in &group.parameters {
            self.by_point.row_mut(p).fill(0.0);
        }
        for (k, &p) in numbers.iter().enumerate() {
            self.by_point.row_mut(p).copy_from(&rows.row(k));
        }
        self.open.extend(open_directions(model, stage));
        if follow.is_none() {
            // What the held ones do cannot be computed: nothing is known of these.
            let all = |p: usize| if numbers.contains(&p) { 1.0 } else { 0.0 };
            self.open.push((0..n).map(all).collect());
        }
        self.open
            .retain(|direction| direction.iter().any(|d| d.abs() > 0.0));
        Ok(())
    }

    /// Derivatives of a stage's residuals by parameters that it holds; `None` where absent to be
    /// had.
    fn by_held(
        model: &mut Model,
        tests: &[usize],
        counted: &[f64],
        held: &[usize],
    ) -> Result<Option<DMatrix<f64>>, Error> {
        let n = tests.iter().map(|&test| model.tests[test].n_points()).sum();
        let mut matrix = DMatrix::zeros(n, held.len());
        let mut first = 0;
        for &test in tests {
            let gradients = model.gradients(test, counted, held)?;
            let of_test = &model.tests[test];
            for (column, gradient) in gradients.into_iter().enumerate() {
                let Some(gradient) = gradient else {
                    return Ok(None);
                };
                matrix
                    .view_mut((first, column), (gradient.len(), 1))
                    .copy_from_slice(&of_test.weighed(&gradient));
            }
            first += of_test.n_points();
        }
        Ok(Some(matrix))
    }

    /// Whether a parameter was fitted: what is held at its start has no error that is known of.
    fn is_known(&self, parameter: usize) -> bool {
        let row = self.by_point.row(parameter);
        row.iter().any(|value| value.abs() > 0.0)
            || self
                .open
                .iter()
                .any(|direction| direction[parameter].abs() > 0.0)
    }

    /// The parameters that have errors.
    pub(super) fn of_parameters(&self) -> Vec<usize> {
        (0..self.by_point.nrows())
            .filter(|p| self.is_known(*p))
            .collect()
    }

    /// How many directions of the parameters the tests determine.
    pub(super) fn n_determined(&self) -> usize {
        let moves = |p: usize| self.by_point.row(p).norm() > 0.0;
        let n = self.by_point.nrows();
        let is_among = |direction: &&Vec<f64>| (0..n).any(|p| moves(p) && direction[p].abs() > 0.0);
        let lost = self.open.iter().filter(is_among).count();
        (0..n).filter(|p| moves(*p)).count().saturating_sub(lost)
    }

    /// Variance of a parameter over that of the residuals; `None` if nothing holds it.
    pub(super) fn of_parameter(&self, parameter: usize) -> Option<f64> {
        let is_open = self.open.iter().any(|direction| {
            let largest = direction.iter().fold(0.0_f64, |most, d| most.max(d.abs()));
            direction[parameter].abs() > 1e-6 * largest
        });
        (!is_open).then(|| self.by_point.row(parameter).norm_squared())
    }

    /// Uncertainty of the values of a curve. `gradients` has their derivatives by the parameters `of`, a
    /// column for each, `None` if it cannot be computed. A change of less than `least` while a direction
    /// goes once through the range of a parameter counts as zero; changes that cancel leave `exactness` of
    /// the largest.
    pub(super) fn of_values(
        &self,
        of: &[usize],
        gradients: &[Option<&[f64]>],
        least: &[f64],
        exactness: f64,
    ) -> Vec<Known> {
        let pairs = of.iter().zip(gradients);
        let unknown: Vec<usize> = pairs
            .filter(|(_, g)| g.is_none())
            .map(|(p, _)| *p)
            .collect();
        if !unknown.is_empty() {
            return vec![Known::Open(unknown); least.len()];
        }
        let matrix = DMatrix::from_fn(least.len(), of.len(), |i, k| {
            gradients[k].map_or(0.0, |column| column[i])
        });
        let mut open: Vec<Vec<usize>> = vec![Vec::new(); least.len()];
        for direction in &self.open {
            let parts = DMatrix::from_fn(least.len(), of.len(), |i, k| {
                matrix[(i, k)] * direction[of[k]]
            });
            let sizes = parts
                .row_iter()
                .map(|row| row.iter().map(|part| part.abs()).sum());
            let little = exactness * sizes.fold(0.0, f64::max);
            for (i, row) in parts.row_iter().enumerate() {
                if row.sum().abs() > least[i].max(little) {
                    let counts = (0..of.len()).filter(|&k| row[k].abs() > little);
                    open[i].extend(counts.map(|k| of[k]));
                }
            }
        }
        let errors = matrix * self.by_point.select_rows(of);
        let known = |(i, mut open): (usize, Vec<usize>)| {
            if open.is_empty() {
                return Known::Variance(errors.row(i).norm_squared());
            }
            open.sort_unstable();
            open.dedup();
            Known::Open(open)
        };
        open.into_iter().enumerate().map(known).collect()
    }
}

/// Directions of all parameters that a stage does not determine.
fn open_directions(model: &Model, stage: &Stage) -> Vec<Vec<f64>> {
    let n = model.parameters.len();
    let width = |p: usize| {
        let [low, high] = model.parameters[p].counted_range();
        (high - low).max(f64::MIN_POSITIVE)
    };
    let mut all = Vec::new();
    for blind in &stage.covariance.blind {
        let mut direction = vec![0.0; n];
        for (&place, part) in stage.covariance.variables.iter().zip(blind) {
            direction[stage.group.parameters[place]] = part / stage.answers[place];
        }
        let widest = (0..n).fold(0.0_f64, |most, p| most.max(direction[p].abs() / width(p)));
        for part in &mut direction {
            *part /= widest.max(f64::MIN_POSITIVE);
        }
        all.push(direction);
    }
    for (place, &p) in stage.group.parameters.iter().enumerate() {
        if !stage.seen[place] {
            let mut direction = vec![0.0; n];
            direction[p] = width(p);
            all.push(direction);
        }
    }
    all
}
