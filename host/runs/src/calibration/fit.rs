//! A stage: the parameters of a group fitted to the tests, from several starts, with what is known of
//! each afterwards.

use super::coordinates::{Parameter, spread};
use super::derivatives::Sides;
use super::least_squares::{End, Minimum, Problem, Settings, free, minimise};
use super::model::Model;
use super::profile::{Profile, follow};
use super::statistics::{Covariance, joint, two_sided};
use crate::Error;
use input::calibration::Variance;
use nalgebra::{DMatrix, DVector};

/// Task of a fit.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wish {
    pub(super) starts: usize,
    pub(super) seed: u64,
    pub(super) variance: Variance,
    pub(super) confidence: f64,
    pub(super) profiles: bool,
}

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

/// The parameters of a group, some of them held.
struct Search<'m> {
    model: &'m mut Model,
    group: &'m Group,
    /// All parameters of the model; those of the group are put in.
    all: Vec<f64>,
    /// The parameters that move, by place in the group.
    moving: Vec<usize>,
}

impl Search<'_> {
    fn put(&mut self, u: &[f64]) {
        for (&place, &u) in self.moving.iter().zip(u) {
            self.all[self.group.parameters[place]] = u;
        }
    }

    /// Residuals of a test at a place.
    fn of_test(&mut self, test: usize, place: &[f64]) -> Result<Option<Vec<f64>>, Error> {
        let computed = self.model.computed(test, place)?.ok();
        Ok(computed.map(|values| self.model.tests[test].residuals(&values)))
    }

    /// Derivatives of a test's residuals by one parameter.
    fn derivative(&mut self, test: usize, parameter: usize) -> Result<Option<Vec<f64>>, Error> {
        let sides = if self.model.tests[test].is_slow() {
            Sides::One
        } else {
            Sides::Both
        };
        let Ok(here) = self.model.computed(test, &self.all)? else {
            return Ok(None);
        };
        let derivative = self
            .model
            .difference(test, parameter, (&self.all, &here), sides)?;
        let of_test = &self.model.tests[test];
        let weighed = |derivative: Vec<f64>| {
            let of_curves = of_test.of_curves(&derivative);
            of_curves
                .flat_map(|(curve, own)| curve.weighed(own))
                .collect()
        };
        Ok(derivative.map(weighed))
    }
}

impl Problem for Search<'_> {
    type Error = Error;

    fn residuals(&mut self, u: &[f64]) -> Result<Option<DVector<f64>>, Error> {
        self.put(u);
        let place = self.all.clone();
        let mut all = Vec::new();
        for &test in &self.group.tests {
            match self.of_test(test, &place)? {
                Some(residuals) => all.extend(residuals),
                None => return Ok(None),
            }
        }
        Ok(Some(DVector::from_vec(all)))
    }

    fn jacobian(
        &mut self,
        u: &[f64],
        residuals: &DVector<f64>,
    ) -> Result<Option<DMatrix<f64>>, Error> {
        self.put(u);
        let mut jacobian = DMatrix::zeros(residuals.len(), self.moving.len());
        let mut first = 0;
        for &test in &self.group.tests {
            let n = self.model.tests[test].n_points();
            let moving = self.moving.clone();
            let numbers: Vec<usize> = moving.iter().map(|&p| self.group.parameters[p]).collect();
            let by_law = self.model.derivatives_by_law(test, &self.all, &numbers)?;
            for (column, parameter) in numbers.into_iter().enumerate() {
                if !self.model.tests[test].has(parameter) {
                    continue;
                }
                let derivative = match &by_law {
                    // A law's rates say nothing of how a curve was read.
                    Some(columns) if self.model.parameters[parameter].of_curve.is_none() => {
                        Some(columns[column].clone())
                    }
                    _ => self.derivative(test, parameter)?,
                };
                let Some(derivative) = derivative else {
                    return Ok(None);
                };
                jacobian
                    .view_mut((first, column), (n, 1))
                    .copy_from_slice(&derivative);
            }
            first += n;
        }
        Ok(Some(jacobian))
    }
}

/// Places are one optimum if no parameter differs by more than this as the search counts, or by this
/// part of its standard error.
const SAME: f64 = 1e-3;
const SAME_OF_ERROR: f64 = 0.2;
/// So many places are there for each start, should the tests not be computed at the first.
const RESERVE: usize = 4;
/// Most iterations from one start.
const ITERATIONS: usize = 60;
/// Longest step of the search: by a factor of e, or by the width of a range.
const LONGEST: f64 = 1.0;

/// Fits a group; `values` are all parameters of the model as the search counts, those of the group where
/// it starts.
///
/// # Errors
/// Stopped; a test that cannot be computed for a reason other than the values.
#[expect(
    clippy::too_many_lines,
    reason = "starts, then profiles that may start anew"
)]
pub(super) fn fit(
    model: &mut Model,
    group: &Group,
    values: &[f64],
    wish: Wish,
    say: &mut dyn FnMut(&str),
) -> Result<Option<Stage>, Error> {
    let parameters: Vec<_> = group
        .parameters
        .iter()
        .map(|&p| model.parameters[p].clone())
        .collect();
    let bounds: Vec<[f64; 2]> = parameters.iter().map(Parameter::counted_bounds).collect();
    let ranges: Vec<[f64; 2]> = parameters.iter().map(Parameter::counted_range).collect();
    let exactness = model.exactness_of(&group.tests);
    let Exactness { derivatives, .. } = known_to(model, group);
    let settings = Settings {
        reduction: 0.1 * exactness,
        step: (1e-2 * exactness.sqrt()).max(1e-9),
        gradient: exactness.sqrt().min(1e-3),
        least: derivatives,
        iterations: ITERATIONS,
        longest: LONGEST,
    };
    let given: Vec<f64> = group.parameters.iter().map(|&p| values[p]).collect();
    // Some places are values that a law refuses: there are others in reserve.
    let others = wish.starts.saturating_sub(1);
    let mut starts = vec![given];
    starts.extend(spread(&ranges, RESERVE * others, wish.seed));
    let everything: Vec<usize> = (0..parameters.len()).collect();
    let search = |model: &mut Model, from: &[f64], moving: &[usize], all: &[f64]| {
        let bounds: Vec<[f64; 2]> = moving.iter().map(|&place| bounds[place]).collect();
        let mut search = Search {
            model,
            group,
            all: all.to_vec(),
            moving: moving.to_vec(),
        };
        minimise(&mut search, from, &bounds, settings)
    };
    let mut landings = Vec::new();
    let mut found: Vec<Minimum> = Vec::new();
    for from in starts {
        if found.len() == wish.starts {
            break;
        }
        let minimum = search(model, &from, &everything, values)?;
        let what = format!(
            "{}: start {} of {}",
            group.name,
            found.len() + 1,
            wish.starts
        );
        say(&match &minimum {
            None => format!("{what}: the tests cannot be computed there, another is tried"),
            Some(minimum) => format!(
                "{what}: sum of squares {:.4e} after {} iterations",
                minimum.sum(),
                minimum.iterations
            ),
        });
        landings.push(Landing {
            from,
            to: minimum.as_ref().map(|m| (m.u.clone(), m.sum())),
            iterations: minimum.as_ref().map_or(0, |m| m.iterations),
            end: minimum.as_ref().map(|m| m.end),
            optimum: None,
        });
        found.extend(minimum);
    }
    let failures = found.iter().map(|minimum| minimum.failures).sum();
    let Some(mut best) = found.into_iter().min_by(|a, b| a.sum().total_cmp(&b.sum())) else {
        return Ok(None);
    };
    // What nothing answers to keeps the value that was given, wherever the search happened to start.
    let norms: Vec<f64> = best.jacobian.column_iter().map(|c| c.norm()).collect();
    let mut kept = best.u.clone();
    for (place, norm) in norms.iter().enumerate() {
        if *norm <= settings.least {
            kept[place] = landings[0].from[place];
        }
    }
    if kept != best.u {
        let mut search = Search {
            model,
            group,
            all: values.to_vec(),
            moving: everything.clone(),
        };
        let residuals = search.residuals(&kept)?;
        let same = |residuals: &DVector<f64>| {
            let change = (residuals.norm_squared() - best.sum()).abs();
            change <= settings.reduction * best.sum()
        };
        if let Some(residuals) = residuals.filter(same) {
            (best.u, best.residuals) = (kept, residuals);
        }
    }
    let (mut is_renewed, mut was_tried) = (false, false);
    let (mut stage, profiles) = loop {
        let stage = known(model, group, &best, &bounds, wish);
        if !wish.profiles {
            break (stage, Vec::new());
        }
        let mut profiles = Vec::new();
        let mut better: Option<Vec<f64>> = None;
        for place in 0..parameters.len() {
            if !stage.seen[place] {
                profiles.push(Profile::default());
                continue;
            }
            say(&format!(
                "{}: profile of {}",
                group.name, parameters[place].name
            ));
            let mut at = |model: &mut Model, value: f64, near: &[f64]| {
                let moving: Vec<usize> =
                    everything.iter().copied().filter(|&i| i != place).collect();
                let mut all = values.to_vec();
                all[group.parameters[place]] = value;
                let from: Vec<f64> = moving.iter().map(|&i| near[i]).collect();
                let minimum = if moving.is_empty() {
                    let mut search = Search {
                        model,
                        group,
                        all: all.clone(),
                        moving: Vec::new(),
                    };
                    let residuals = search.residuals(&[])?;
                    residuals.map(|residuals| (Vec::new(), residuals.norm_squared()))
                } else {
                    search(model, &from, &moving, &all)?.map(|m| (m.u.clone(), m.sum()))
                };
                Ok(minimum.map(|(others, sum)| {
                    let mut others = others.into_iter();
                    let u = (0..near.len()).map(|i| {
                        if i == place {
                            value
                        } else {
                            others.next().unwrap_or(near[i])
                        }
                    });
                    (u.collect::<Vec<f64>>(), sum)
                }))
            };
            let (profile, lower) = follow(model, &stage, place, bounds[place], &mut at)?;
            better = better.or(lower);
            profiles.push(profile);
        }
        match better.filter(|_| !was_tried) {
            None => break (stage, profiles),
            Some(from) => {
                was_tried = true;
                match search(model, &from, &everything, values)? {
                    Some(minimum) if minimum.sum() < best.sum() => {
                        is_renewed = true;
                        best = minimum;
                    }
                    _ => break (stage, profiles),
                }
            }
        }
    };
    stage.profiles = profiles;
    stage.is_renewed = is_renewed;
    stage.failures = failures;
    stage.optima = optima(&stage, &mut landings, wish);
    stage.landings = landings;
    Ok(Some(stage))
}

/// Accuracy of the tests of a group.
#[derive(Clone, Copy, Debug)]
pub(super) struct Exactness {
    /// Square of what residuals without weights are known to, in the mean.
    pub(super) floor: f64,
    /// Accuracy of the norm of a column of derivatives, with weights.
    derivatives: f64,
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

/// What residuals and derivatives say of the best place.
fn known(model: &Model, group: &Group, best: &Minimum, bounds: &[[f64; 2]], wish: Wish) -> Stage {
    let blind = model.blind_in(&group.tests);
    let n = best.u.len();
    let weights: Vec<f64> = group
        .tests
        .iter()
        .flat_map(|&test| &model.tests[test].curves)
        .flat_map(|curve| std::iter::repeat_n(curve.weight, curve.points.len()))
        .collect();
    let squares = best.residuals.iter().zip(&weights).map(|(r, w)| r * r / w);
    let plain_sum: f64 = squares.sum();
    let Exactness { floor, derivatives } = known_to(model, group);
    let variance_of = |degrees: usize| match wish.variance {
        Variance::Estimated => (plain_sum / degrees.max(1) as f64).max(floor),
        Variance::Given => 1.0,
    };
    let may_move = free(
        &best.u,
        &best.jacobian,
        &best.residuals,
        bounds,
        derivatives,
    );
    let answers: Vec<f64> = best
        .jacobian
        .column_iter()
        .map(|column| column.norm())
        .collect();
    let noise = variance_of(best.residuals.len().saturating_sub(may_move.len())).sqrt();
    let is_seen = |place: usize| {
        let [low, high] = model.parameters[group.parameters[place]].counted_range();
        let range = high - low;
        // The noise is that of residuals without weights.
        let column = best.jacobian.column(place);
        let plain: f64 = column.iter().zip(&weights).map(|(d, w)| d * d / w).sum();
        plain.sqrt() * range > 1e-3 * noise && answers[place] > derivatives
    };
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
fn optima(stage: &Stage, landings: &mut [Landing], wish: Wish) -> Vec<Optimum> {
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
