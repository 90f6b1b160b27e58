//! One step: the free gradient components that bring the controlled fluxes to their goal.
//!
//! | symbol | here | |
//! |---|---|---|
//! | f | `free` | components whose flux or stiffness is controlled |
//! | K | `stiffness` | stiffness control; 0 under flux control |
//! | F | `flux` of [`Goal`] | what flux + K (gradient − origin) has to become |
//! | r | `residual` | flux + K (gradient − origin) − F, in the components f |
//!
//! Under [`Restrictions`] all components are free, and what these make of the changes since the start of
//! the segment stands for the flux.
//!
//! Newton's method with the law's tangent, restricted to f, comes first. Where that matrix is
//! singular, the step is the least-squares solution of minimum norm. A line search keeps ‖r‖
//! falling. Where it does not fall, the flux does not answer to what is left of r: on an edge, at
//! an apex, over an open gap. Then a search along the elastic direction leaves that zone. Where
//! this ends too, fixed-point iterations with the elastic operator go on, accelerated after
//! Anderson (type II).
//!
//! Tolerances are relative to fluxes and gradients, as far as what the path was given explains
//! them ([`Anchor`]).

use super::anchor::Anchor;
use super::frame::Frame;
use super::restrictions::Restrictions;
use super::{N_MAX, Vector};
use crate::plugin::{BatchFailure, End, Law, Moment, Operator, Start, Strided};
use crate::stop::Stop;
use abi::status::Outcome;
use nalgebra::{SMatrix, SVector};
use std::mem::swap;

/// Residual against the component's own flux, or against the largest flux where no iteration
/// comes closer.
const RELATIVE_TOLERANCE: f64 = 1e-10;
/// Residuals that summing fluxes and rounding gradients leave behind: a law computes the flux from
/// the difference of two totals, each known to half a unit in the last place.
const ROUND_OFF: f64 = 16.0 * f64::EPSILON;
/// Ratio of singular values below which a direction counts as flat.
const FLAT: f64 = 1e-10;
const MAX_NEWTON: usize = 40;
const MAX_HALVINGS: usize = 10;
const MAX_RELAXATIONS: usize = 160;
/// Doublings and bisections on the way out of a zone where the flux does not answer.
const MAX_DOUBLINGS: usize = 100;
const MAX_BISECTIONS: usize = 60;
/// Iterations spent on coming closer than [`RELATIVE_TOLERANCE`] of the largest flux.
const MAX_POLISH: usize = 3;
/// Newton is tried again after so many fixed-point iterations.
const NEWTON_EVERY: usize = 8;
/// Differences that Anderson's acceleration remembers.
const MEMORY: usize = 4;

/// A point that carries its history.
#[derive(Clone, Debug)]
pub(super) struct Point {
    pub(super) gradient: Vector,
    pub(super) flux: Vector,
    pub(super) internal: Vec<f64>,
}

/// What a step has to reach: gradients where they are prescribed, F where the flux is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Goal {
    pub(super) gradient: Vector,
    pub(super) flux: Vector,
}

/// A step: where it starts, where it goes, and its time.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step<'a> {
    pub(super) start: &'a Point,
    pub(super) goal: &'a Goal,
    pub(super) time: f64,
    pub(super) time_increment: f64,
}

/// How near the goal a sample is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Verdict {
    Far,
    /// Within the tolerance relative to the largest flux.
    Close,
    /// Within the tolerance relative to each component.
    Tight,
}

/// The law's answer to one gradient.
#[derive(Clone, Debug)]
struct Sample {
    point: Point,
    operator: Vec<f64>,
    residual: Vector,
    norm: f64,
    verdict: Verdict,
}

/// The controlled component that missed its goal by most, in the best attempt.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Miss {
    pub(super) component: usize,
    pub(super) flux: f64,
    pub(super) goal: f64,
    pub(super) residual: f64,
    pub(super) tolerance: f64,
}

/// Why a step failed: what is known for the next try and for the message.
#[derive(Clone, Debug, Default)]
pub(super) struct Obstacle {
    /// The smallest step factor a law asked for.
    pub(super) factor: Option<f64>,
    /// The law's last words, if it refused an update.
    pub(super) law: Option<String>,
    /// That refusal.
    pub(super) refusal: Option<Box<BatchFailure>>,
    /// How near the best attempt came.
    pub(super) miss: Option<Miss>,
    /// What its components are.
    pub(super) frame: Frame,
    /// Its components are restrictions.
    pub(super) is_restricted: bool,
    /// Their stiffness control.
    stiffness: Vector,
    norm: f64,
}

impl Obstacle {
    /// Whether the stiffness of a component is controlled, not its flux.
    pub(super) fn is_sprung(&self, component: usize) -> bool {
        self.stiffness[component] > 0.0
    }
}

/// Failures that no smaller step mends.
pub(super) type Fatal = Box<BatchFailure>;

/// Finds equilibrium steps of one law; keeps its buffers.
#[derive(Debug)]
pub(super) struct Search<'a> {
    law: &'a Law,
    n: usize,
    free: [usize; N_MAX],
    n_free: usize,
    stiffness: Vector,
    origin: Vector,
    /// The elastic operator, for predictors.
    elastic: Vec<f64>,
    /// The same in the components themselves.
    elastic_cartesian: Vec<f64>,
    elastic_norm: f64,
    anchor: Anchor,
    tangent: Operator,
    relaxation: Operator,
    base: Sample,
    trial: Sample,
    obstacle: Obstacle,
    /// Which segment and increment it is.
    pub(super) moment: Moment,
    frame: Frame,
    /// Restrictions, scaled, and the point where they begin.
    restricted: Option<(Restrictions, Point)>,
    /// Calls of the law.
    pub(super) calls: usize,
    /// Who may want the search to stop: then the law refuses whatever it is asked.
    pub(super) stop: Stop,
    /// Number of updates that the law called unreliable, and its first words about them.
    pub(super) unreliable: (usize, String),
}

impl<'a> Search<'a> {
    pub(super) fn new(law: &'a Law, start: &Point) -> Self {
        let n = law.n_components();
        let mut anchor = Anchor::default();
        start.flux.iter().for_each(|flux| anchor.flux(*flux));
        let sample = Sample {
            point: start.clone(),
            operator: vec![0.0; n * n],
            residual: [0.0; N_MAX],
            norm: 0.0,
            verdict: Verdict::Far,
        };
        Self {
            law,
            n,
            free: [0; N_MAX],
            n_free: 0,
            stiffness: [0.0; N_MAX],
            origin: [0.0; N_MAX],
            elastic: vec![0.0; n * n],
            elastic_cartesian: vec![0.0; n * n],
            elastic_norm: 0.0,
            anchor,
            tangent: Operator::Consistent,
            relaxation: Operator::Elastic,
            base: sample.clone(),
            trial: sample,
            obstacle: Obstacle::default(),
            moment: Moment::default(),
            frame: Frame::Cartesian,
            restricted: None,
            calls: 0,
            stop: Stop::never(),
            unreliable: (0, String::new()),
        }
    }

    /// Says which components are free, and their stiffness control.
    pub(super) fn control(
        &mut self,
        free: impl Iterator<Item = usize>,
        stiffness: Vector,
        origin: Vector,
    ) {
        self.n_free = 0;
        for i in free {
            self.free[self.n_free] = i;
            self.n_free += 1;
        }
        self.stiffness = stiffness;
        self.origin = origin;
        if self.restricted.take().is_some() {
            self.set_frame(self.frame);
        }
    }

    /// Puts restrictions from this point on in the place of controlled components. What they have
    /// to become at the end.
    pub(super) fn restrict(&mut self, restrictions: &Restrictions, from: &Point) -> Vector {
        self.control(0..self.n, [0.0; N_MAX], [0.0; N_MAX]);
        let scaled = restrictions.scaled(self.elastic_norm);
        scaled.operator(&mut self.elastic);
        let change = scaled.change;
        self.restricted = Some((scaled, from.clone()));
        change
    }

    /// Anchors the tolerances of the increment that ends at this goal.
    pub(super) fn anchor(&mut self, goal: &Goal) {
        let controlled = &self.free[..self.n_free];
        for i in 0..self.n {
            if controlled.contains(&i) {
                self.anchor.flux(goal.flux[i]);
                self.anchor.modulus(self.stiffness[i]);
            } else {
                self.anchor.reach(goal.gradient[i]);
            }
        }
        self.anchor.modulus(self.elastic_norm);
    }

    /// The controlled component of a point that is farthest from its goal, if one is farther than it
    /// may be at the end of an increment: whatever the iterations found.
    pub(super) fn unmet(&self, point: &Point, goal: &Goal) -> Option<Miss> {
        let answer = self.answer(point);
        let found = largest(&point.flux[..self.n]);
        let missed = self.free[..self.n_free].iter().filter_map(|&i| {
            let spring = self.stiffness[i] * (point.gradient[i] - self.origin[i]);
            let residual = answer[i] + spring - goal.flux[i];
            let tolerance = self.anchor.bound(goal.flux[i], found, ROUND_OFF);
            // Not met, too, if it is not a number.
            let is_met = residual.abs() <= tolerance;
            (!is_met).then_some(Miss {
                component: i,
                flux: answer[i],
                goal: goal.flux[i] - spring,
                residual,
                tolerance,
            })
        });
        missed.max_by(|a, b| a.residual.abs().total_cmp(&b.residual.abs()))
    }

    /// The controlled component that went farther than its goal explains.
    pub(super) fn strayed(&self, point: &Point) -> Option<usize> {
        let mut controlled = self.free[..self.n_free].iter().copied();
        controlled.find(|&i| {
            let gradient = point.gradient[i].abs();
            gradient > self.anchor.reach_of(gradient)
        })
    }

    /// Whether the elastic operator of the initial state is zero.
    pub(super) fn is_without_stiffness(&self) -> bool {
        largest(&self.elastic_cartesian) == 0.0
    }

    /// What is compared with the goal F.
    fn answer(&self, point: &Point) -> Vector {
        match &self.restricted {
            None => point.flux,
            Some((restrictions, from)) => restrictions.answer(from, point),
        }
    }

    /// The answer to a step of no size, and with it the elastic operator. `None` if the law
    /// refuses, with its words in [`Self::take_obstacle`].
    pub(super) fn at_rest(&mut self, start: &Point) -> Result<Option<Vector>, Fatal> {
        let goal = Goal {
            gradient: start.gradient,
            flux: start.flux,
        };
        let step = Step {
            start,
            goal: &goal,
            time: 0.0,
            time_increment: 0.0,
        };
        self.obstacle = Obstacle::default();
        if !self.evaluate(&step, start.gradient, self.relaxation)? {
            return Ok(None);
        }
        self.elastic_cartesian.copy_from_slice(&self.trial.operator);
        self.set_frame(Frame::Cartesian);
        Ok(Some(self.trial.point.flux))
    }

    /// What the components of points and goals are from now on.
    pub(super) fn set_frame(&mut self, frame: Frame) {
        self.frame = frame;
        self.elastic.copy_from_slice(&self.elastic_cartesian);
        frame.operator(&mut self.elastic);
        self.elastic_norm = largest(&self.elastic);
    }

    /// What the components of points and goals are.
    pub(super) fn frame(&self) -> Frame {
        self.frame
    }

    /// Why the last step failed.
    pub(super) fn take_obstacle(&mut self) -> Obstacle {
        let frame = self.frame;
        Obstacle {
            frame,
            stiffness: self.stiffness,
            is_restricted: self.restricted.is_some(),
            ..std::mem::take(&mut self.obstacle)
        }
    }

    /// Finds the end of a step, from a guess of the free gradient increments if there is one.
    /// `false`: not found; see [`Self::take_obstacle`].
    pub(super) fn find(&mut self, step: &Step<'_>, guess: Option<&Vector>) -> Result<bool, Fatal> {
        self.obstacle = Obstacle::default();
        let mut gradient = step.goal.gradient;
        if self.n_free == 0 {
            let found = self.evaluate(step, gradient, Operator::None)?;
            swap(&mut self.base, &mut self.trial);
            return Ok(found);
        }
        if let Some(guess) = guess {
            for &i in &self.free[..self.n_free] {
                gradient[i] = step.start.gradient[i] + guess[i];
            }
            if self.newton(step, gradient)? {
                return Ok(true);
            }
        }
        let elastic = self.elastic_guess(step);
        Ok(self.newton(step, elastic)? || self.relax(step, elastic)?)
    }

    /// Hands over the end of the step found; the point becomes the start of the next.
    pub(super) fn commit(&mut self, point: &mut Point) {
        if self.n_free > 0 {
            self.anchor.modulus(largest(&self.base.operator));
        }
        swap(point, &mut self.base.point);
    }

    /// Whether the law took no notice of the step found: the gradient moved, flux and internal
    /// variables stayed to the last bit, and its operator is zero or says that they should not have.
    /// `None`: the gradient did not move.
    pub(super) fn is_ignored(&mut self, step: &Step<'_>) -> Result<Option<bool>, Fatal> {
        let (start, end) = (step.start, &self.base.point);
        if same(&start.gradient, &end.gradient) {
            return Ok(None);
        }
        if !same(&start.flux, &end.flux) || !same(&start.internal, &end.internal) {
            return Ok(Some(false));
        }
        let gradient = end.gradient;
        // What the law says of the same step now must not be counted twice.
        let unreliable = self.unreliable.0;
        let answers = self.evaluate(step, gradient, self.tangent);
        self.unreliable.0 = unreliable;
        if !answers? {
            return Ok(Some(false));
        }
        let operator = &self.trial.operator;
        if largest(operator) == 0.0 {
            return Ok(Some(true));
        }
        let moved: Vector = std::array::from_fn(|i| gradient[i] - start.gradient[i]);
        let expected = operator.chunks_exact(self.n).map(|row| {
            let terms = row.iter().zip(&moved);
            f64::abs(terms.map(|(c, d)| c * d).sum())
        });
        let expected = expected.fold(0.0, f64::max);
        // Perfect plasticity stays where it is, and so does what round-off swallows.
        let plain = 1e-3 * largest(operator) * largest(&moved[..self.n]);
        Ok(Some(
            expected > plain && expected > 1e-9 * largest(&start.flux),
        ))
    }

    /// Calls the law. `false`: it refuses this gradient.
    fn evaluate(
        &mut self,
        step: &Step<'_>,
        gradient: Vector,
        operator: Operator,
    ) -> Result<bool, Fatal> {
        if self.stop.is_asked() {
            return Ok(false);
        }
        let rows = Strided::rows(self.n);
        let frame = self.frame;
        let gradient_start = frame.cartesian_gradient(&step.start.gradient);
        let gradient_end = frame.cartesian_gradient(&gradient);
        let flux_start = frame.cartesian_flux(&step.start.flux);
        let start = Start {
            n_points: 1,
            gradient: (&gradient_start[..self.n], rows),
            gradient_end: (&gradient_end[..self.n], rows),
            flux: (&flux_start[..self.n], rows),
            state: &step.start.internal,
            time: step.time,
            time_increment: step.time_increment,
            moment: self.moment,
            sites: &[],
        };
        let end = End {
            flux: (&mut self.trial.point.flux[..self.n], rows),
            state: &mut self.trial.point.internal,
            operator: &mut self.trial.operator,
        };
        self.calls += 1;
        match self.law.integrate(&start, operator, end) {
            Ok(success) => {
                if let Some((_, message)) = success.unreliable {
                    if self.unreliable.0 == 0 {
                        self.unreliable.1 = message;
                    }
                    self.unreliable.0 += 1;
                }
                self.trial.point.gradient = gradient;
                self.trial.point.flux = frame.flux(&self.trial.point.flux);
                if operator != Operator::None {
                    frame.operator(&mut self.trial.operator);
                    if let Some((restrictions, _)) = &self.restricted {
                        restrictions.operator(&mut self.trial.operator);
                    }
                }
                self.assess(step);
                Ok(true)
            }
            Err(failure) => match failure.outcome {
                Outcome::CutStep | Outcome::Domain | Outcome::Numeric => {
                    let smallest = self.obstacle.factor.unwrap_or(1.0);
                    self.obstacle.factor = failure
                        .factor
                        .map(|f| f.min(smallest))
                        .or(self.obstacle.factor);
                    self.obstacle.law = Some(failure.message.clone());
                    self.obstacle.refusal = Some(Box::new(failure));
                    Ok(false)
                }
                Outcome::Unsupported if self.do_without(operator) => {
                    let other = if operator == Operator::Elastic {
                        self.relaxation
                    } else {
                        self.tangent
                    };
                    self.evaluate(step, gradient, other)
                }
                _ => Err(Box::new(failure)),
            },
        }
    }

    /// The law may offer one operator only. `false`: there is nothing left to fall back on.
    fn do_without(&mut self, operator: Operator) -> bool {
        match operator {
            Operator::Consistent if self.relaxation == Operator::Elastic => {
                self.tangent = Operator::Elastic;
                true
            }
            Operator::Elastic if self.tangent == Operator::Consistent => {
                self.relaxation = Operator::Consistent;
                true
            }
            _ => false,
        }
    }

    /// Residual of the trial sample, and how near it is.
    fn assess(&mut self, step: &Step<'_>) {
        let (answer, at_start) = (self.answer(&self.trial.point), self.answer(step.start));
        let sample = &mut self.trial;
        let (flux, gradient) = (&sample.point.flux[..self.n], &sample.point.gradient);
        let start_reach = largest(&step.start.gradient[..self.n]);
        let mut found = largest(flux).max(largest(&step.start.flux[..self.n]));
        let mut asked = 0.0_f64;
        let mut springs = [0.0; N_MAX];
        for (k, &i) in self.free[..self.n_free].iter().enumerate() {
            springs[k] = self.stiffness[i] * (gradient[i] - self.origin[i]);
            found = found.max(f64::abs(springs[k]));
            asked = asked.max(step.goal.flux[i].abs());
        }
        // A free component that runs away must not widen its own tolerance: neither in this step
        // nor, by what each lets the next one do, over many.
        let scale = asked.max(self.anchor.flux_of(found));
        let likely = 10.0 * (start_reach + largest(&step.goal.gradient[..self.n]))
            + 1e3 * scale / self.elastic_norm.max(f64::MIN_POSITIVE);
        let reach = start_reach.max(largest(&gradient[..self.n]).min(likely));
        let reach = self.anchor.reach_of(reach);
        let mut verdict = Verdict::Tight;
        let mut worst = 0.0;
        let mut miss = None;
        for (k, &i) in self.free[..self.n_free].iter().enumerate() {
            let r = answer[i] + springs[k] - step.goal.flux[i];
            let own = step.goal.flux[i].abs().max(at_start[i].abs());
            let own = own.max(f64::abs(springs[k]));
            let floor = ROUND_OFF * (scale + (self.elastic_norm + self.stiffness[i]) * reach);
            let close = RELATIVE_TOLERANCE * scale + floor;
            // Never true of a residual that is not a number.
            let within = |bound: f64| r.abs() <= bound;
            if !within(close) {
                verdict = Verdict::Far;
            } else if verdict == Verdict::Tight && !within(RELATIVE_TOLERANCE * own + floor) {
                verdict = Verdict::Close;
            }
            if r.abs() > worst {
                worst = r.abs();
                miss = Some(Miss {
                    component: i,
                    flux: answer[i],
                    goal: step.goal.flux[i] - springs[k],
                    residual: r,
                    tolerance: close,
                });
            }
            sample.residual[k] = r;
        }
        sample.norm = norm(&sample.residual[..self.n_free]);
        sample.verdict = verdict;
        let first = self.obstacle.miss.is_none();
        if verdict == Verdict::Far && (first || sample.norm < self.obstacle.norm) {
            self.obstacle.miss = miss;
            self.obstacle.norm = sample.norm;
        }
    }

    /// −(operator + K)⁻¹ r in the free components, of minimum norm where there is no inverse.
    fn descent(&self, operator: &[f64], r: &Vector) -> Vector {
        let mut matrix = SMatrix::<f64, N_MAX, N_MAX>::zeros();
        for (a, &i) in self.free[..self.n_free].iter().enumerate() {
            for (b, &j) in self.free[..self.n_free].iter().enumerate() {
                matrix[(a, b)] = operator[i * self.n + j];
            }
            matrix[(a, a)] += self.stiffness[i];
        }
        let by_free = solve(&matrix, r, self.n_free, FLAT * 1e-4 * self.elastic_norm);
        let mut d = [0.0; N_MAX];
        for (k, &i) in self.free[..self.n_free].iter().enumerate() {
            d[i] = -by_free[k];
        }
        d
    }

    /// The end of the step if the law were elastic.
    fn elastic_guess(&self, step: &Step<'_>) -> Vector {
        let (goal, start) = (step.goal, step.start);
        let answer = self.answer(start);
        let mut gradient = goal.gradient;
        for &i in &self.free[..self.n_free] {
            gradient[i] = start.gradient[i];
        }
        let mut r = [0.0; N_MAX];
        for (k, &i) in self.free[..self.n_free].iter().enumerate() {
            let spring = self.stiffness[i] * (start.gradient[i] - self.origin[i]);
            let prescribed: f64 = (0..self.n)
                .map(|j| self.elastic[i * self.n + j] * (gradient[j] - start.gradient[j]))
                .sum();
            r[k] = answer[i] + spring - goal.flux[i] + prescribed;
        }
        let d = self.descent(&self.elastic, &r);
        for &i in &self.free[..self.n_free] {
            gradient[i] += d[i];
        }
        gradient
    }

    /// Newton's method with a line search. The solution, or the best sample, is in `base`.
    fn newton(&mut self, step: &Step<'_>, guess: Vector) -> Result<bool, Fatal> {
        if !self.evaluate(step, guess, self.tangent)? {
            return Ok(false);
        }
        swap(&mut self.base, &mut self.trial);
        let mut polish = 0;
        for _ in 0..MAX_NEWTON {
            match self.base.verdict {
                Verdict::Tight => return Ok(true),
                Verdict::Close if polish == MAX_POLISH => return Ok(true),
                Verdict::Close => polish += 1,
                Verdict::Far => {}
            }
            let d = self.descent(&self.base.operator, &self.base.residual);
            if !self.line_search(step, &d)? && !self.escape(step, &d)? {
                break;
            }
        }
        Ok(self.base.verdict != Verdict::Far)
    }

    /// Moves `base` along d as far as the residual falls enough. `false`: it does not fall.
    fn line_search(&mut self, step: &Step<'_>, d: &Vector) -> Result<bool, Fatal> {
        let mut fraction = 1.0;
        for _ in 0..MAX_HALVINGS {
            let Some(gradient) = self.moved(d, fraction) else {
                return Ok(false);
            };
            if self.evaluate(step, gradient, self.tangent)?
                && self.trial.norm <= (1.0 - 1e-4 * fraction) * self.base.norm
            {
                swap(&mut self.base, &mut self.trial);
                return Ok(true);
            }
            fraction *= 0.5;
        }
        Ok(false)
    }

    /// Moves `base` along the elastic answer to what the step d leaves of the residual, until the
    /// residual falls. `false`: it does not fall.
    fn escape(&mut self, step: &Step<'_>, d: &Vector) -> Result<bool, Fatal> {
        let left = self.left_over(d);
        let direction = self.descent(&self.elastic, &left);
        let longest = 8.0
            * (largest(&step.start.gradient)
                + largest(&self.base.point.gradient)
                + largest(&direction));
        let enough = 0.9 * self.base.norm;
        let (mut low, mut high) = (0.0, f64::INFINITY);
        let mut fraction = 1.0;
        for _ in 0..MAX_DOUBLINGS + MAX_BISECTIONS {
            let Some(gradient) = self.moved(&direction, fraction) else {
                return Ok(false);
            };
            let answers = if self.evaluate(step, gradient, self.tangent)? {
                if self.trial.norm <= enough {
                    swap(&mut self.base, &mut self.trial);
                    return Ok(true);
                }
                let turned: f64 = (0..self.n_free)
                    .map(|k| self.trial.residual[k] * left[k])
                    .sum();
                turned <= 0.0
            } else {
                true
            };
            if answers {
                high = fraction;
            } else {
                low = fraction;
            }
            fraction = if high.is_finite() {
                0.5 * (low + high)
            } else {
                2.0 * fraction
            };
            let resolved = high.is_finite() && high - low <= 1e-15 * high;
            if resolved || fraction * largest(&direction) > longest {
                return Ok(false);
            }
        }
        Ok(false)
    }

    /// What a step d leaves of the residual of `base`, to first order; the whole of it where that
    /// is next to nothing.
    fn left_over(&self, d: &Vector) -> Vector {
        let mut left = self.base.residual;
        for (k, &i) in self.free[..self.n_free].iter().enumerate() {
            let answer: f64 = self.free[..self.n_free]
                .iter()
                .map(|&j| self.base.operator[i * self.n + j] * d[j])
                .sum();
            left[k] += answer + self.stiffness[i] * d[i];
        }
        if norm(&left[..self.n_free]) > 1e-3 * self.base.norm {
            left
        } else {
            self.base.residual
        }
    }

    /// The gradient of `base` moved by a part of d; `None` if rounding leaves it where it is.
    fn moved(&self, d: &Vector, fraction: f64) -> Option<Vector> {
        let mut gradient = self.base.point.gradient;
        for &i in &self.free[..self.n_free] {
            gradient[i] += fraction * d[i];
        }
        let moves = gradient
            .iter()
            .zip(&self.base.point.gradient)
            .any(|(a, b)| a.to_bits() != b.to_bits());
        moves.then_some(gradient)
    }

    /// Fixed-point iterations with the elastic operator.
    fn relax(&mut self, step: &Step<'_>, guess: Vector) -> Result<bool, Fatal> {
        if !self.evaluate(step, guess, self.relaxation)? {
            return Ok(false);
        }
        swap(&mut self.base, &mut self.trial);
        let mut history = History::default();
        let mut damping = 1.0;
        let mut polish = 0;
        for k in 1..=MAX_RELAXATIONS {
            match self.base.verdict {
                Verdict::Tight => return Ok(true),
                Verdict::Close if polish == MAX_POLISH => return Ok(true),
                Verdict::Close => polish += 1,
                Verdict::Far => {}
            }
            let f = self.descent(&self.base.operator, &self.base.residual);
            let d = history.accelerated(&f, damping);
            let Some(gradient) = self.moved(&d, 1.0) else {
                break;
            };
            if !self.evaluate(step, gradient, self.relaxation)?
                || self.trial.norm > 2.0 * self.base.norm
            {
                if history.is_empty() {
                    damping *= 0.5;
                    if damping < 1e-3 {
                        break;
                    }
                }
                history.forget();
                continue;
            }
            let f_new = self.descent(&self.trial.operator, &self.trial.residual);
            history.add(&d, &f, &f_new);
            damping = f64::min(1.0, 2.0 * damping);
            swap(&mut self.base, &mut self.trial);
            if k % NEWTON_EVERY == 0 && self.base.verdict == Verdict::Far {
                let gradient = self.base.point.gradient;
                if self.newton(step, gradient)? {
                    return Ok(true);
                }
                if !self.evaluate(step, gradient, self.relaxation)? {
                    break;
                }
                swap(&mut self.base, &mut self.trial);
            }
        }
        Ok(self.base.verdict != Verdict::Far)
    }
}

/// The last steps x and the differences of f = −E⁻¹ r over them.
#[derive(Debug, Default)]
struct History {
    steps: [Vector; MEMORY],
    changes: [Vector; MEMORY],
    n: usize,
}

impl History {
    fn is_empty(&self) -> bool {
        self.n == 0
    }

    fn forget(&mut self) {
        self.n = 0;
    }

    fn add(&mut self, step: &Vector, f: &Vector, f_new: &Vector) {
        self.steps.rotate_right(1);
        self.changes.rotate_right(1);
        self.steps[0] = *step;
        self.changes[0] = std::array::from_fn(|i| f_new[i] - f[i]);
        self.n = MEMORY.min(self.n + 1);
    }

    /// f + … : the step that would cancel f if f were linear in what is remembered.
    fn accelerated(&self, f: &Vector, damping: f64) -> Vector {
        if self.n == 0 {
            return f.map(|f| damping * f);
        }
        let changes = SMatrix::<f64, N_MAX, MEMORY>::from_fn(|i, k| {
            if k < self.n { self.changes[k][i] } else { 0.0 }
        });
        let right = SVector::<f64, N_MAX>::from_column_slice(f);
        let svd = changes.svd(true, true);
        let threshold = FLAT * svd.singular_values.max();
        let Ok(weights) = svd.solve(&right, threshold) else {
            return *f;
        };
        std::array::from_fn(|i| {
            let correction: f64 = (0..self.n)
                .map(|k| weights[k] * (self.steps[k][i] + self.changes[k][i]))
                .sum();
            f[i] - correction
        })
    }
}

/// x with A x = b in the leading m components: by elimination if A is regular, otherwise of minimum
/// norm among the least-squares solutions. Singular values up to `flat` count as zero.
fn solve(a: &SMatrix<f64, N_MAX, N_MAX>, b: &Vector, m: usize, flat: f64) -> Vector {
    macro_rules! sized {
        ($m:literal) => {{
            let a = a.fixed_view::<$m, $m>(0, 0).into_owned();
            let b = SVector::<f64, $m>::from_column_slice(&b[..$m]);
            let lu = a.full_piv_lu();
            let pivots = lu.u().diagonal().abs();
            let x = if pivots.min() > (FLAT * pivots.max()).max(flat) {
                lu.solve(&b)
            } else {
                let svd = a.svd(true, true);
                let threshold = (FLAT * svd.singular_values.max()).max(flat);
                svd.solve(&b, threshold).ok()
            };
            let mut padded = [0.0; N_MAX];
            if let Some(x) = x {
                padded[..$m].copy_from_slice(x.as_slice());
            }
            padded
        }};
    }
    match m {
        1 => sized!(1),
        2 => sized!(2),
        3 => sized!(3),
        4 => sized!(4),
        5 => sized!(5),
        _ => sized!(6),
    }
}

fn same(a: &[f64], b: &[f64]) -> bool {
    let mut pairs = a.iter().zip(b);
    pairs.all(|(a, b)| a.to_bits() == b.to_bits())
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |max, v| max.max(v.abs()))
}

/// Euclidean norm without overflow.
fn norm(values: &[f64]) -> f64 {
    let scale = largest(values);
    if scale > 0.0 && scale.is_finite() {
        let sum: f64 = values.iter().map(|v| (v / scale) * (v / scale)).sum();
        scale * sum.sqrt()
    } else {
        scale
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn singular_matrices_give_the_solution_of_minimum_norm() {
        let mut a = SMatrix::<f64, N_MAX, N_MAX>::zeros();
        for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            a[(i, j)] = 3.0;
        }
        let x = solve(&a, &[6.0, 6.0, 0.0, 0.0, 0.0, 0.0], 2, 0.0);
        assert_relative_eq!(x[0], 1.0, epsilon = 1e-14);
        assert_relative_eq!(x[1], 1.0, epsilon = 1e-14);
    }

    #[test]
    fn a_vanishing_matrix_gives_no_step() {
        let a = SMatrix::<f64, N_MAX, N_MAX>::zeros();
        for m in 1..=N_MAX {
            assert!(
                solve(&a, &[1.0; N_MAX], m, 0.0)
                    .iter()
                    .all(|x| x.abs() == 0.0)
            );
        }
    }

    #[test]
    fn the_norm_does_not_overflow() {
        assert_relative_eq!(norm(&[3e200, 4e200]), 5e200, max_relative = 1e-15);
        assert!(norm(&[]).abs() == 0.0);
    }
}
