//! A stage that was fitted, with what is known of each of its parameters.

use super::fit::Wish;
use super::least_squares::{End, Minimum, free};
use super::model::Model;
use super::profile::Profile;
use super::statistics::{Covariance, joint, two_sided};
use input::calibration::Variance;
use nalgebra::{DMatrix, DVector};

/// Parameters that are fitted together, and the tests that they are fitted to; both by number.
#[derive(Clone, Debug)]
pub struct Group {
    /// Name of the stage.
    pub name: String,
    /// The parameters.
    pub parameters: Vec<usize>,
    /// The tests.
    pub tests: Vec<usize>,
}

/// End of the search from one of the starts.
#[derive(Clone, Debug)]
pub struct Landing {
    /// Where it started, all parameters of the group as the search counts them.
    pub from: Vec<f64>,
    /// Where it ended, and the sum of squares there; `None` if the tests cannot be computed at the start.
    pub to: Option<(Vec<f64>, f64)>,
    /// Steps taken.
    pub iterations: usize,
    /// How it ended.
    pub end: Option<End>,
    /// The optimum that it is, from 0, the best first.
    pub optimum: Option<usize>,
}

/// A place where no way leads down.
#[derive(Clone, Debug)]
pub struct Optimum {
    /// The parameters of the group as the search counts them.
    pub u: Vec<f64>,
    /// Sum of squares.
    pub sum: f64,
    /// Starts that led there.
    pub times: usize,
    /// It cannot be told from the best one at the level of confidence.
    pub is_as_good: bool,
}

/// Result of a stage.
#[derive(Clone, Debug)]
pub struct Stage {
    /// Parameters and tests.
    pub group: Group,
    /// The best place.
    pub best: Vec<f64>,
    /// Sum of squares there, and how many.
    pub sum: f64,
    /// Number of residuals.
    pub n_residuals: usize,
    /// How the search ended there.
    pub end: End,
    /// The same without weights.
    pub plain_sum: f64,
    /// Degrees of freedom: residuals less what they determine of parameters that are not on a bound.
    pub degrees: usize,
    /// Variance of residuals that were divided by their noise, without weights.
    pub variance: f64,
    /// The residuals are smaller than what computed values are known to: that is the variance.
    pub is_exact: bool,
    /// The residuals there.
    pub residuals: DVector<f64>,
    /// Derivatives of residuals there.
    pub jacobian: DMatrix<f64>,
    /// Covariance for unit variance, of the parameters that are seen and not on a bound.
    pub covariance: Covariance,
    /// Quantile of Student's distribution for the level of confidence; of the normal one where the
    /// variance is given.
    pub quantile: f64,
    /// For each parameter, whether it lies on its lower or upper bound.
    pub on_bound: Vec<[bool; 2]>,
    /// For each parameter, the norm of its column of derivatives.
    pub answers: Vec<f64>,
    /// For each parameter, whether the tests answer to it at all: over the whole of its range residuals change
    /// by more than a thousandth of the noise, and by more than derivatives are known to.
    pub seen: Vec<bool>,
    /// Ends of the searches.
    pub landings: Vec<Landing>,
    /// Places where no way leads down, the best first.
    pub optima: Vec<Optimum>,
    /// For each parameter; empty if they are not followed.
    pub profiles: Vec<Profile>,
    /// A profile found a better place, from where the search went on.
    pub is_renewed: bool,
    /// Steps that were shortened because a test could not be computed.
    pub failures: usize,
}

/// Places are one optimum if no parameter differs by more than this as the search counts, or by this
/// part of its standard error.
const SAME: f64 = 1e-3;
const SAME_OF_ERROR: f64 = 0.2;
/// The last stage that fitted a parameter, and the parameter's place there.
pub(super) fn last_stage(stages: &[Stage], parameter: usize) -> Option<(usize, usize)> {
    let place = |(number, stage): (usize, &Stage)| {
        let mut own = stage.group.parameters.iter();
        Some((number, own.position(|&p| p == parameter)?))
    };
    stages.iter().enumerate().rev().find_map(place)
}

/// Accuracy of the tests of a group.
#[derive(Clone, Copy, Debug)]
pub(super) struct Exactness {
    /// Square of what residuals without weights are known to, in the mean.
    pub(super) floor: f64,
    /// Accuracy of the norm of a column of derivatives, with weights.
    pub(super) derivatives: f64,
}

/// Each test is known to its own exactness, relative to the largest measured value of a curve.
pub(super) fn known_to(model: &Model, group: &Group) -> Exactness {
    let (mut n, mut squares, mut weighed) = (0, 0.0, 0.0);
    for &test in &group.tests {
        let (exactness, blind) = (model.tests[test].exactness, model.blind_in(&[test]));
        for curve in &model.tests[test].curves {
            let largest = curve.largest();
            n += curve.points.len();
            let of_curve: f64 = curve.deviations.iter().map(|d| (largest / d).powi(2)).sum();
            squares += exactness.powi(2) * of_curve;
            weighed += curve.weight * blind.powi(2) * of_curve;
        }
    }
    Exactness {
        floor: squares / n.max(1) as f64,
        derivatives: weighed.sqrt(),
    }
}

/// How much the residuals, without their weights, change where a parameter goes through its range.
fn plain_answers(
    model: &Model,
    group: &Group,
    jacobian: &DMatrix<f64>,
    weights: &[f64],
) -> Vec<f64> {
    let columns = jacobian.column_iter().zip(&group.parameters);
    let answer = columns.map(|(column, &parameter)| {
        let [low, high] = model.parameters[parameter].counted_range();
        let plain: f64 = column.iter().zip(weights).map(|(d, w)| d * d / w).sum();
        plain.sqrt() * (high - low)
    });
    answer.collect()
}

/// What residuals and derivatives say of the best place.
pub(super) fn known(
    model: &Model,
    group: &Group,
    best: &Minimum,
    bounds: &[[f64; 2]],
    wish: Wish,
) -> Stage {
    let blind = model.blind_in(&group.tests);
    let n = best.u.len();
    let weights = model.weights(&group.tests);
    let squares = best.residuals.iter().zip(&weights).map(|(r, w)| r * r / w);
    let plain_sum: f64 = squares.sum();
    let Exactness { floor, derivatives } = known_to(model, group);
    let variance_of = |degrees: usize| match wish.variance {
        Variance::Estimated => (plain_sum / degrees.max(1) as f64).max(floor),
        Variance::Given => 1.0,
    };
    let Minimum {
        u,
        jacobian,
        residuals,
        ..
    } = best;
    let may_move = free(u, jacobian, residuals, bounds, derivatives);
    let noise = variance_of(best.residuals.len().saturating_sub(may_move.len())).sqrt();
    let answers: Vec<f64> = best.jacobian.column_iter().map(|c| c.norm()).collect();
    let by_range = plain_answers(model, group, &best.jacobian, &weights);
    let is_seen = |i: usize| by_range[i] > 1e-3 * noise && answers[i] > derivatives;
    let seen: Vec<bool> = (0..n).map(is_seen).collect();
    let moving: Vec<usize> = may_move.iter().copied().filter(|&i| seen[i]).collect();
    let on_bound = (0..n).map(|i| {
        let is_held = !may_move.contains(&i);
        let [lower, upper] = bounds[i];
        [is_held && best.u[i] <= lower, is_held && best.u[i] >= upper]
    });
    let covariance = Covariance::weighted(&best.jacobian, &weights, &moving, blind);
    let rank = moving.len().saturating_sub(covariance.blind.len());
    let degrees = best.residuals.len().saturating_sub(rank);
    let counted = (wish.variance == Variance::Estimated).then_some(degrees);
    Stage {
        group: group.clone(),
        best: best.u.clone(),
        sum: best.sum(),
        plain_sum,
        n_residuals: best.residuals.len(),
        end: best.end,
        degrees,
        variance: variance_of(degrees),
        is_exact: plain_sum <= floor * degrees as f64,
        on_bound: on_bound.collect(),
        answers,
        seen,
        covariance,
        residuals: best.residuals.clone(),
        jacobian: best.jacobian.clone(),
        quantile: two_sided(wish.confidence, counted),
        landings: Vec::new(),
        optima: Vec::new(),
        profiles: Vec::new(),
        is_renewed: false,
        failures: 0,
    }
}

impl Stage {
    /// Standard error of a parameter of the group, as the search counts it; `None` if it is on a bound or
    /// not determined.
    pub fn error(&self, place: usize) -> Option<f64> {
        let variance = self.covariance.variance(place)?;
        Some((variance * self.variance).sqrt())
    }

    /// How much the sum may grow for a value of a parameter to stay in the interval of confidence.
    pub(super) fn allowance(&self, place: usize) -> f64 {
        self.variance * self.quantile.powi(2) * self.covariance.growth(place)
    }

    /// Whether two places are one optimum: parameters that are determined agree, and what differs of the
    /// others changes no residual.
    fn is_same(&self, (a, a_sum): (&[f64], f64), (b, b_sum): (&[f64], f64)) -> bool {
        let mut rest = DVector::zeros(self.residuals.len());
        let (mut is_open, mut most) = (false, 0.0_f64);
        for (place, (a, b)) in a.iter().zip(b).enumerate() {
            let apart = a - b;
            let error = self.error(place);
            if apart.abs() <= SAME.max(SAME_OF_ERROR * error.unwrap_or(0.0)) {
                continue;
            }
            let is_held = self.on_bound[place] != [false, false];
            if error.is_some() || self.seen[place] && is_held {
                return false;
            }
            is_open = true;
            if self.seen[place] {
                rest += self.jacobian.column(place) * apart;
                most = most.max(self.answers[place]);
            }
        }
        let little = SAME_OF_ERROR * (self.variance * self.covariance.mean_growth()).sqrt();
        !is_open
            || rest.norm() <= little.max(SAME * most) && (a_sum - b_sum).abs() <= little * little
    }
}

/// The different places that the starts have led to, the best first; which of them each start led to.
pub(super) fn optima(stage: &Stage, landings: &mut [Landing], wish: Wish) -> Vec<Optimum> {
    let mut order: Vec<usize> = (0..landings.len())
        .filter(|&i| landings[i].to.is_some())
        .collect();
    let sum =
        |i: usize, landings: &[Landing]| landings[i].to.as_ref().map_or(f64::INFINITY, |to| to.1);
    order.sort_by(|&a, &b| sum(a, landings).total_cmp(&sum(b, landings)));
    let counted = (wish.variance == Variance::Estimated).then_some(stage.degrees);
    let rank = stage.covariance.variables.len() - stage.covariance.blind.len();
    let room = stage.variance
        * stage.covariance.mean_growth()
        * joint(wish.confidence, rank.max(1), counted);
    let mut optima = vec![Optimum {
        u: stage.best.clone(),
        sum: stage.sum,
        times: 0,
        is_as_good: true,
    }];
    for i in order {
        let Some((u, sum)) = landings[i].to.clone() else {
            continue;
        };
        // A place on the way to another, where a search was given up, is no optimum.
        let is_settled = landings[i].end == Some(End::Converged);
        let known = optima
            .iter()
            .position(|known| stage.is_same((&known.u, known.sum), (&u, sum)));
        let number = match known {
            Some(number) => number,
            None if !is_settled => continue,
            None => {
                optima.push(Optimum {
                    u,
                    sum,
                    times: 0,
                    is_as_good: sum - stage.sum <= room,
                });
                optima.len() - 1
            }
        };
        optima[number].times += 1;
        landings[i].optimum = Some(number);
    }
    optima
}
