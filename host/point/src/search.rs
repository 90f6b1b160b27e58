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
//! Newton's method with the law's tangent, restricted to f, comes first ([`newton`]). If that matrix is
//! singular, the step is the least-squares solution of minimum norm ([`direction`]). A line search keeps
//! ‖r‖ falling. If it does not fall, the flux does not respond to the remaining r: on an edge, at an
//! apex, over an open gap. Then a search along the elastic direction leaves that zone. Where this ends
//! too, fixed-point iterations with the elastic operator go on ([`relaxation`]). The criteria for the
//! end are in [`acceptance`].

mod acceptance;
mod direction;
mod newton;
mod norm;
mod obstacle;
mod relaxation;

pub(crate) use obstacle::{Miss, Obstacle};

use crate::frame::Frame;
use crate::restrictions::Restrictions;
use crate::state::{Goal, N_MAX, Point, Step, Vector};
use crate::tolerance_scale::ToleranceScale;
use abi::status::Outcome;
use acceptance::Verdict;
use law::{BatchFailure, BatchSuccess, End, Law, Moment, Operator, Start, Stop, Strided};
use norm::{largest, same};
use std::mem::swap;

/// The law's answer to one gradient.
#[derive(Clone, Debug)]
struct Sample {
    point: Point,
    operator: Vec<f64>,
    residual: Vector,
    norm: f64,
    verdict: Verdict,
}

/// Failures that no smaller step mends.
pub(crate) type Fatal = Box<BatchFailure>;

/// Finds equilibrium steps of one law; keeps its buffers.
#[derive(Debug)]
pub(crate) struct Search<'a> {
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
    anchor: ToleranceScale,
    tangent: Operator,
    relaxation: Operator,
    base: Sample,
    trial: Sample,
    obstacle: Obstacle,
    /// The segment and the increment.
    pub(crate) moment: Moment,
    frame: Frame,
    /// Restrictions, scaled, and the point where they begin.
    restricted: Option<(Restrictions, Point)>,
    /// Calls of the law.
    pub(crate) calls: usize,
    /// A request to stop: from then on the law refuses every call.
    pub(crate) stop: Stop,
    /// Number of updates that the law called unreliable, and its first words about them.
    pub(crate) unreliable: (usize, String),
}

impl<'a> Search<'a> {
    pub(crate) fn new(law: &'a Law, start: &Point) -> Self {
        let n = law.n_components();
        let mut anchor = ToleranceScale::default();
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
    pub(crate) fn control(
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

    /// Puts restrictions from this point on in the place of controlled components. Their goals at
    /// the end.
    pub(crate) fn restrict(&mut self, restrictions: &Restrictions, from: &Point) -> Vector {
        self.control(0..self.n, [0.0; N_MAX], [0.0; N_MAX]);
        let scaled = restrictions.scaled(self.elastic_norm);
        scaled.operator(&mut self.elastic);
        let change = scaled.change;
        self.restricted = Some((scaled, from.clone()));
        change
    }

    /// Anchors the tolerances of the increment that ends at this goal.
    pub(crate) fn anchor(&mut self, goal: &Goal) {
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

    /// Whether restrictions replace controlled components.
    pub(crate) fn is_restricted(&self) -> bool {
        self.restricted.is_some()
    }

    /// Whether the elastic operator of the initial state is zero.
    pub(crate) fn is_without_stiffness(&self) -> bool {
        largest(&self.elastic_cartesian) == 0.0
    }

    /// The answer to a step of no size, and with it the elastic operator. `None` if the law
    /// refuses: see [`Self::take_obstacle`].
    pub(crate) fn at_rest(&mut self, start: &Point) -> Result<Option<Vector>, Fatal> {
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

    /// Sets the kind of components of points and goals.
    pub(crate) fn set_frame(&mut self, frame: Frame) {
        self.frame = frame;
        self.elastic.copy_from_slice(&self.elastic_cartesian);
        frame.operator(&mut self.elastic);
        self.elastic_norm = largest(&self.elastic);
    }

    /// The kind of components of points and goals.
    pub(crate) fn frame(&self) -> Frame {
        self.frame
    }

    /// Why the last step failed.
    pub(crate) fn take_obstacle(&mut self) -> Obstacle {
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
    pub(crate) fn find(&mut self, step: &Step<'_>, guess: Option<&Vector>) -> Result<bool, Fatal> {
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
    pub(crate) fn commit(&mut self, point: &mut Point) {
        if self.n_free > 0 {
            self.anchor.modulus(largest(&self.base.operator));
        }
        swap(point, &mut self.base.point);
    }

    /// Whether the law ignored the step found: the gradient moved, but flux and internal variables are
    /// unchanged to the last bit. Besides, its operator either predicts a change or is zero, and a step
    /// back changes nothing. `None`: the gradient did not move.
    pub(crate) fn is_ignored(&mut self, step: &Step<'_>) -> Result<Option<bool>, Fatal> {
        let (start, end) = (step.start, &self.base.point);
        if same(&start.gradient, &end.gradient) {
            return Ok(None);
        }
        if !same(&start.flux, &end.flux) || !same(&start.internal, &end.internal) {
            return Ok(Some(false));
        }
        let (gradient, flux, internal) = (end.gradient, end.flux, end.internal.clone());
        // What the law says of the same step now must not be counted twice.
        let unreliable = self.unreliable.0;
        let answers = self.evaluate(step, gradient, self.tangent);
        self.unreliable.0 = unreliable;
        if !answers? {
            return Ok(Some(false));
        }
        let operator = &self.trial.operator;
        if largest(operator) == 0.0 {
            // At its strength a law without hardening answers to the way back alone. So does a routine
            // that refuses what is too far for it, without a way to say so.
            if largest(&flux) == 0.0 || self.law.library().foreign().is_some() {
                return Ok(Some(true));
            }
            let back: Vector = std::array::from_fn(|i| 2.0 * start.gradient[i] - gradient[i]);
            let unreliable = self.unreliable.0;
            let answers = self.evaluate(step, back, Operator::None);
            self.unreliable.0 = unreliable;
            let point = &self.trial.point;
            let is_same = same(&flux, &point.flux) && same(&internal, &point.internal);
            return Ok(Some(!answers? || is_same));
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
                self.take_answer(gradient, operator, success);
                self.assess(step);
                Ok(true)
            }
            Err(failure) => match failure.outcome {
                Outcome::CutStep | Outcome::Domain | Outcome::Numeric => {
                    self.obstacle.refused(failure);
                    Ok(false)
                }
                Outcome::Unsupported => match self.other_than(operator) {
                    Some(other) => self.evaluate(step, gradient, other),
                    None => Err(Box::new(failure)),
                },
                _ => Err(Box::new(failure)),
            },
        }
    }

    /// Takes in the law's answer, in the components of points and goals.
    fn take_answer(&mut self, gradient: Vector, operator: Operator, success: BatchSuccess) {
        if let Some((_, message)) = success.unreliable {
            if self.unreliable.0 == 0 {
                self.unreliable.1 = message;
            }
            self.unreliable.0 += 1;
        }
        let Sample {
            point,
            operator: matrix,
            ..
        } = &mut self.trial;
        point.gradient = gradient;
        point.flux = self.frame.flux(&point.flux);
        if operator != Operator::None {
            self.frame.operator(matrix);
            if let Some((restrictions, _)) = &self.restricted {
                restrictions.operator(matrix);
            }
        }
    }

    /// The law may offer one operator only: the one to fall back on, if there is one left.
    fn other_than(&mut self, operator: Operator) -> Option<Operator> {
        match operator {
            Operator::Consistent if self.relaxation == Operator::Elastic => {
                self.tangent = Operator::Elastic;
                Some(self.tangent)
            }
            Operator::Elastic if self.tangent == Operator::Consistent => {
                self.relaxation = Operator::Consistent;
                Some(self.relaxation)
            }
            _ => None,
        }
    }
}
