//! A stage: the parameters of a group fitted to the tests, from several starts, with what is known of
//! each afterwards.

use super::coordinates::{Parameter, spread};
use super::least_squares::{End, Minimum, Problem, Settings, free, minimise};
use super::model::Model;
use super::statistics::{Covariance, joint, two_sided};
use crate::Error;
use input::calibration::Variance;
use nalgebra::{DMatrix, DVector};

/// What a fit is asked for.
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

/// Where one of the starts has led to.
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

/// The least sum of squares for values of one parameter beside the best.
#[derive(Clone, Debug, Default)]
pub struct Profile {
    /// Values of the parameter, as the search counts it, ascending, with the sum of squares of the best of
    /// the others; the best one among them.
    pub points: Vec<(f64, f64)>,
    /// Where the profile leaves the interval of confidence below and above; `None` where it does not up to
    /// the bound, or cannot be followed.
    pub interval: [Option<f64>; 2],
    /// Whether the bound was reached inside the interval, below and above.
    pub meets_bound: [bool; 2],
}

/// What a stage has found.
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
    /// Degrees of freedom: residuals less parameters that are not on a bound.
    pub degrees: usize,
    /// Variance of residuals that were divided by their noise.
    pub variance: f64,
    /// Derivatives of residuals there.
    pub jacobian: DMatrix<f64>,
    /// Covariance for unit variance, of the parameters that are not on a bound.
    pub covariance: Covariance,
    /// Quantile of Student's distribution for the level of confidence; of the normal one where the
    /// variance is given.
    pub quantile: f64,
    /// Of each parameter, whether it lies on its lower or upper bound.
    pub on_bound: Vec<[bool; 2]>,
    /// Of each parameter, the norm of its column of derivatives.
    pub answers: Vec<f64>,
    /// Where the starts have led to.
    pub landings: Vec<Landing>,
    /// Places where no way leads down, the best first.
    pub optima: Vec<Optimum>,
    /// Of each parameter; empty if they are not followed.
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
        let rows = self.model.computed(test, place)?;
        Ok(rows
            .ok()
            .and_then(|rows| self.model.tests[test].residuals(&rows).ok()))
    }

    /// Derivatives of a test's residuals by one parameter: central differences, one-sided at bounds, where
    /// a side has no answer, or where a test takes long.
    fn derivative(
        &mut self,
        test: usize,
        parameter: usize,
        here: &[f64],
    ) -> Result<Option<Vec<f64>>, Error> {
        let step = self.model.difference;
        let [lower, upper] = self.model.parameters[parameter].counted_bounds();
        let mut sides = [None, None];
        for (side, sign) in sides.iter_mut().zip([1.0, -1.0]) {
            let mut place = self.all.clone();
            place[parameter] += sign * step;
            if (lower..=upper).contains(&place[parameter]) {
                *side = self.of_test(test, &place)?;
            }
            if side.is_some() && self.model.tests[test].is_slow() {
                break;
            }
        }
        let between = |a: &[f64], b: &[f64], width: f64| {
            a.iter()
                .zip(b)
                .map(|(a, b)| (a - b) / width)
                .collect::<Vec<f64>>()
        };
        Ok(match &sides {
            [Some(above), Some(below)] => Some(between(above, below, 2.0 * step)),
            [Some(above), None] => Some(between(above, here, step)),
            [None, Some(below)] => Some(between(here, below, step)),
            [None, None] => None,
        })
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
            let here = residuals
                .rows(first, n)
                .iter()
                .copied()
                .collect::<Vec<f64>>();
            let moving = self.moving.clone();
            let numbers: Vec<usize> = moving.iter().map(|&p| self.group.parameters[p]).collect();
            let by_law = self.model.derivatives_by_law(test, &self.all, &numbers);
            for (column, parameter) in numbers.into_iter().enumerate() {
                if !self.model.tests[test].has(parameter) {
                    continue;
                }
                let derivative = match &by_law {
                    Some(columns) => Some(columns[column].clone()),
                    None => self.derivative(test, parameter, &here)?,
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
/// A profile is followed for at most so many points on either side.
const MOST_POINTS: usize = 12;
/// Steps of a profile, in quantiles.
const STEP_OF_PROFILE: f64 = 0.4;
/// On a logarithmic scale or in widths of the range, a profile goes no farther than this.
const FARTHEST: f64 = 12.0;

/// Fits a group; `values` are all parameters of the model as the search counts, those of the group where
/// it starts.
///
/// # Errors
/// Stopped; a test that cannot be computed for a reason that is none of the values.
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
    let settings = Settings {
        reduction: 0.1 * model.exactness,
        step: (1e-2 * model.exactness.sqrt()).max(1e-9),
        gradient: model.exactness.sqrt().min(1e-3),
        blind: blind(model),
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
    let largest = norms.iter().fold(0.0, |m: f64, norm| m.max(*norm));
    let mut kept = best.u.clone();
    for (place, norm) in norms.iter().enumerate() {
        if *norm <= settings.blind * largest {
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
    let mut is_renewed = false;
    let (mut stage, profiles) = loop {
        let stage = known(model, group, &best, &bounds, wish);
        if !wish.profiles {
            break (stage, Vec::new());
        }
        let mut profiles = Vec::new();
        let mut better: Option<Vec<f64>> = None;
        for place in 0..parameters.len() {
            if !stage.is_seen(place, ranges[place]) {
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
            let (profile, lower) = profile(model, &stage, place, bounds[place], &mut at)?;
            better = better.or(lower);
            profiles.push(profile);
        }
        match better.filter(|_| !is_renewed) {
            None => break (stage, profiles),
            Some(from) => {
                is_renewed = true;
                match search(model, &from, &everything, values)? {
                    Some(minimum) if minimum.sum() < best.sum() => best = minimum,
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

/// What moves the residuals by less than their differences are known to is not seen.
fn blind(model: &Model) -> f64 {
    (model.exactness / model.difference).max(1e-6)
}

/// What residuals and derivatives say of the best place.
fn known(model: &Model, group: &Group, best: &Minimum, bounds: &[[f64; 2]], wish: Wish) -> Stage {
    let blind = blind(model);
    let moving = free(&best.u, &best.jacobian, &best.residuals, bounds, blind);
    let n = best.u.len();
    let on_bound = (0..n).map(|i| {
        let is_held = !moving.contains(&i);
        let [lower, upper] = bounds[i];
        [is_held && best.u[i] <= lower, is_held && best.u[i] >= upper]
    });
    let degrees = best.residuals.len().saturating_sub(moving.len());
    let variance = match wish.variance {
        Variance::Estimated => best.sum() / degrees.max(1) as f64,
        Variance::Given => 1.0,
    };
    let counted = (wish.variance == Variance::Estimated).then_some(degrees);
    Stage {
        group: group.clone(),
        best: best.u.clone(),
        sum: best.sum(),
        n_residuals: best.residuals.len(),
        end: best.end,
        degrees,
        variance,
        on_bound: on_bound.collect(),
        answers: best
            .jacobian
            .column_iter()
            .map(|column| column.norm())
            .collect(),
        covariance: Covariance::new(&best.jacobian, &moving, blind),
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

    /// Whether the tests answer to a parameter at all: over the whole of its range a residual would change
    /// by more than a thousandth of the noise.
    pub fn is_seen(&self, place: usize, range: [f64; 2]) -> bool {
        let noise = self.variance.sqrt().max(1e-12);
        self.answers[place] * (range[1] - range[0]) > 1e-3 * noise
    }

    /// How much the sum may grow for a value to stay in the interval of confidence.
    fn allowance(&self) -> f64 {
        self.variance * self.quantile.powi(2)
    }
}

/// Follows the profile of a parameter to either side, until it leaves the interval of confidence; and a
/// better place, if one was met.
#[expect(
    clippy::type_complexity,
    reason = "the search for the others, handed in"
)]
#[expect(clippy::float_cmp, reason = "a value that was brought to its bound")]
fn profile(
    model: &mut Model,
    stage: &Stage,
    place: usize,
    bounds: [f64; 2],
    at: &mut dyn FnMut(&mut Model, f64, &[f64]) -> Result<Option<(Vec<f64>, f64)>, Error>,
) -> Result<(Profile, Option<Vec<f64>>), Error> {
    let best = stage.best[place];
    let allowance = stage.allowance();
    let mut profile = Profile::default();
    let mut better = None;
    let error = stage.error(place).filter(|error| *error > 0.0);
    let first = error.map_or(0.05, |error| STEP_OF_PROFILE * stage.quantile * error);
    let first = first.clamp(1e-9, 0.5);
    let mut sides = [Vec::new(), Vec::new()];
    for (side, sign) in [-1.0, 1.0].into_iter().enumerate() {
        let (mut near, mut value, mut step) = (stage.best.clone(), best, first);
        let mut last = (best, 0.0);
        for _ in 0..MOST_POINTS {
            if value == bounds[side] || !allowance.is_finite() || allowance <= 0.0 {
                break;
            }
            let target = if sign < 0.0 {
                (value - step).max(bounds[0])
            } else {
                (value + step).min(bounds[1])
            };
            let Some((u, sum)) = at(model, target, &near)? else {
                // The law cannot follow there: a shorter step may do.
                step *= 0.3;
                if step < 1e-2 * first {
                    break;
                }
                continue;
            };
            let rise = sum - stage.sum;
            if rise < -1e-3 * allowance && better.is_none() {
                better = Some(u.clone());
            }
            sides[side].push((target, sum));
            if rise >= allowance {
                // √ of the rise is nearly straight.
                let (a, b) = (last.1, rise.sqrt());
                let part = (allowance.sqrt() - a) / (b - a);
                profile.interval[side] = Some(last.0 + part * (target - last.0));
                break;
            }
            let slope = (rise.max(0.0).sqrt() - last.1) / (target - value).abs();
            last = (target, rise.max(0.0).sqrt());
            (near, value) = (u, target);
            if value == bounds[side] {
                profile.meets_bound[side] = true;
            }
            if (value - best).abs() > FARTHEST {
                break;
            }
            // The next step is one that takes the root as far again, but no leap.
            let wanted = STEP_OF_PROFILE * allowance.sqrt() / slope.max(1e-12);
            step = wanted.clamp(0.5 * step, 3.0 * step);
        }
    }
    let [mut below, above] = sides;
    below.reverse();
    profile.points = below;
    profile.points.push((best, stage.sum));
    profile.points.extend(above);
    Ok((profile, better))
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
    let room = stage.variance * joint(wish.confidence, stage.best.len(), counted);
    let mut optima = vec![Optimum {
        u: stage.best.clone(),
        sum: stage.sum,
        times: 0,
        is_as_good: true,
    }];
    let is_same = |a: &[f64], b: &[f64]| {
        a.iter().zip(b).enumerate().all(|(place, (a, b))| {
            let error = stage.error(place).unwrap_or(f64::INFINITY);
            (a - b).abs() <= SAME.max(SAME_OF_ERROR * error)
        })
    };
    for i in order {
        let Some((u, sum)) = landings[i].to.clone() else {
            continue;
        };
        // A place on the way to another, where a search was given up, is no optimum.
        let is_settled = landings[i].end == Some(End::Converged);
        let known = optima.iter().position(|optimum| is_same(&optimum.u, &u));
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
