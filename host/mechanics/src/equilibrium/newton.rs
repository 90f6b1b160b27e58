//! Newton iterations and a line search; with consistent tangents, or with a matrix that is kept.
//! Viscous relaxation where full Newton iterations come to a standstill, or arc-length control.
//!
//! Displacements and forces are vectors by place ([`Places`]) if nothing else is said.

mod acceleration;
mod acceptance;
mod failure;
mod given;
mod matrix;
mod path;
mod relaxation;

pub use failure::{
    Criterion, Culprit, DomainFailure, Imbalance, Iterations, PointPlace, Reason, Runaway,
    Singularity, StepFailure, Symptom, Unmet,
};
pub use matrix::Matrix;
pub use path::Measure;

use super::diagnosis::{self, Snapshot};
use super::linear_domain::LinearDomain;
use crate::assembly::{Places, System, norms};
use crate::group::{Group, PointFailure};
use crate::settings::{Control, Method, Settings};
use acceleration::Acceleration;
use acceptance::{Change, Criteria, EXACT, Measures, STALE};
use algebra::LinearSolver;
use given::Given;
use law::Operator;
use law::Stop;
use relaxation::Relaxation;
use serde::{Deserialize, Serialize};
use std::time::{Duration, Instant};

/// Lengths of a correction that the line search tries, in order.
const STEP_LENGTHS: [f64; 5] = [1.0, 0.5, 0.25, 0.125, 0.0625];
/// A quasi-Newton matrix is renewed where this many iterations (the state before them included)
/// have not brought the residual down to this fraction.
const PATIENCE: usize = 6;
const PROGRESS: f64 = 0.1;
/// Largest relative residual that may be round-off.
pub(crate) const STILL_SMALL: f64 = 1e-6;
/// Round-off that a state may have, in changes of its forces by the last bit of the displacement
/// increments.
pub(super) const ACCEPTED_ROUND_OFF: f64 = 8.0;
/// Round-off of K u, relative to the forces it is the difference of.
pub(crate) const ROUND_OFF: f64 = 64.0 * f64::EPSILON;

/// Loads over a phase, as functions of the load factor λ from 0 to 1.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Loads {
    /// External forces at λ = 0, by degree of freedom.
    pub force_start: Vec<f64>,
    /// External forces at λ = 1.
    pub force_end: Vec<f64>,
    /// Prescribed displacements: degree of freedom, value at λ = 0, value at λ = 1.
    pub prescribed: Vec<(usize, f64, f64)>,
    /// Forces out of balance at the start, carried to equilibrium in proportion to λ.
    pub out_of_balance: Vec<f64>,
    /// Largest of the forces (2-norms) at the start of the phase, and what rounding leaves of those of
    /// earlier phases: where all forces vanish, the residual is still measured against something.
    pub scale: f64,
    /// The same at every degree of freedom.
    pub largest: Vec<f64>,
}

impl Loads {
    /// External forces and what is left of the forces out of balance.
    pub fn external(&self, lambda: f64) -> Vec<f64> {
        let ends = self.force_start.iter().zip(&self.force_end);
        ends.zip(&self.out_of_balance)
            .map(|((start, end), rest)| start + lambda * (end - start) + (1.0 - lambda) * rest)
            .collect()
    }

    /// Change of the external forces with λ, by degree of freedom.
    fn external_rate(&self) -> Vec<f64> {
        let ends = self.force_start.iter().zip(&self.force_end);
        ends.zip(&self.out_of_balance)
            .map(|((start, end), rest)| end - start - rest)
            .collect()
    }

    /// Change of prescribed displacements with λ, by degree of freedom.
    fn prescribed_rate(&self) -> Vec<f64> {
        let mut rate = vec![0.0; self.force_start.len()];
        for &(dof, start, end) in &self.prescribed {
            rate[dof] = end - start;
        }
        rate
    }

    /// Increments of prescribed displacements between two load factors, by degree of freedom.
    fn prescribed_increments(&self, from: f64, to: f64) -> Vec<f64> {
        let mut increments = vec![0.0; self.force_start.len()];
        for &(dof, start, end) in &self.prescribed {
            increments[dof] = Self::value(start, end, to) - Self::value(start, end, from);
        }
        increments
    }

    /// Value of a prescribed displacement; exact at both ends.
    fn value(start: f64, end: f64, lambda: f64) -> f64 {
        if lambda >= 1.0 {
            end
        } else {
            start + lambda * (end - start)
        }
    }
}

/// One iteration, for the log.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Iteration {
    /// Relative residual after it.
    pub residual: f64,
    /// Relative correction; null before the first one.
    pub correction: Option<f64>,
    /// Fraction of the correction that was taken.
    pub step_length: f64,
    /// Share of the elastic stiffness added to the tangent; 0 in a Newton iteration.
    pub viscosity: f64,
}

impl Iteration {
    /// The state before the first correction.
    fn first(balance: &Balance) -> Self {
        Self {
            residual: balance.relative,
            correction: None,
            step_length: 1.0,
            viscosity: 0.0,
        }
    }

    /// The state after this fraction of a correction of this relative size.
    fn of(balance: &Balance, correction: f64, step_length: f64) -> Self {
        Self {
            residual: balance.relative,
            correction: Some(correction),
            step_length,
            viscosity: 0.0,
        }
    }
}

/// Seconds by part, and counts.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct Costs {
    /// Laws, with the strains before and the forces after them.
    pub laws: Duration,
    /// Assembly of matrices.
    pub assembly: Duration,
    /// Factorisation and solution.
    pub equations: Duration,
    /// Evaluations of all groups.
    pub evaluations: u64,
    /// Matrices factorised.
    pub factorisations: u64,
}

/// Where the iterations of a step start.
#[derive(Clone, Debug)]
pub struct Guess {
    /// Displacement increments, by place.
    pub increment: Vec<f64>,
    /// Fraction of the residual that the first correction will probably leave, as it did in the
    /// last step; `None` if nothing is known.
    pub contraction: Option<f64>,
}

/// A step that reached equilibrium. The groups' trial state is that of equilibrium.
#[derive(Clone, Debug)]
pub struct StepSuccess {
    /// Displacement increments, by place.
    pub increment: Vec<f64>,
    /// What happened.
    pub iterations: Vec<Iteration>,
    /// Points whose laws call their result inaccurate.
    pub unreliable: Option<String>,
    /// Newton iterations alone had come to a standstill; viscous relaxation led to this state.
    pub relaxed: bool,
    /// Relative residual that had to be taken for round-off, above the tolerance; else 0.
    pub round_off: f64,
    /// What the residual was measured against, by body.
    pub scales: Vec<f64>,
}

/// What iterations work on.
#[derive(Debug)]
pub struct Newton<'a> {
    /// Unknowns.
    system: &'a System,
    places: &'a Places,
    /// Linear groups that stand beside the system as one element.
    domain: Option<&'a LinearDomain>,
    /// Equations.
    solver: &'a mut LinearSolver,
    /// What is factorised.
    matrix: &'a mut Matrix,
    /// Elements and their state.
    groups: &'a mut [Group],
    /// Settings.
    settings: &'a Settings,
    /// Costs so far.
    costs: &'a mut Costs,
    /// Largest of the forces at the start of the phase, by body.
    at_start: Vec<f64>,
    /// What is given to the step.
    given: Given,
    /// Sizes of the last correction, by body.
    changes: Vec<Change>,
    /// What ran away in the last evaluation.
    runaway: Option<Runaway>,
    /// What the last evaluation asked the laws for.
    tangents: Operator,
    /// The matrix has been renewed in this step.
    renewed: bool,
    /// The kept matrix makes too little progress.
    stalls: bool,
    /// Fraction of the residual that the next correction will probably leave.
    contraction: f64,
    /// Forces of the domain at the end of the step if its boundary stays where it is.
    domain_forces: Vec<f64>,
    /// Room for displacements and forces by degree of freedom; the forces are zero between
    /// evaluations.
    displacement: Vec<f64>,
    force: Vec<f64>,
    /// Who may want to stop the step, and when it was last asked for.
    stop: Stop,
    asked: Instant,
}

/// A step's end.
struct Task<'t> {
    /// External forces.
    external: &'t [f64],
    /// Norm of those on all degrees of freedom, or of the forces at the start of the phase; by body.
    imposed: Vec<f64>,
    /// Increments of prescribed displacements.
    prescribed: &'t [f64],
    /// Time at the start, and its increment.
    period: (f64, f64),
}

/// Residual by equation, and the residual's norm relative to the forces in play.
struct Balance {
    residual: Vec<f64>,
    /// The largest of all bodies.
    relative: f64,
    by_body: Vec<f64>,
    /// What it is relative to, by body.
    scales: Vec<f64>,
    /// Of every body, whether it has run away.
    away: Vec<bool>,
    unreliable: Option<String>,
}

impl<'a> Newton<'a> {
    /// Iterations on these elements and equations.
    pub fn new(
        (system, places): (&'a System, &'a Places),
        domain: Option<&'a LinearDomain>,
        (solver, matrix): (&'a mut LinearSolver, &'a mut Matrix),
        groups: &'a mut [Group],
        settings: &'a Settings,
        costs: &'a mut Costs,
    ) -> Self {
        let mut included = groups
            .iter()
            .enumerate()
            .filter(|(i, _)| system.includes(*i));
        matrix.is_constant = included.all(|(_, group)| group.is_linear());
        Self {
            system,
            places,
            domain,
            solver,
            matrix,
            groups,
            settings,
            costs,
            at_start: Vec::new(),
            given: Given::default(),
            changes: Vec::new(),
            runaway: None,
            tangents: Operator::None,
            renewed: false,
            stalls: false,
            contraction: f64::INFINITY,
            domain_forces: Vec::new(),
            displacement: vec![0.0; system.n_dofs()],
            force: vec![0.0; system.n_dofs()],
            stop: Stop::never(),
            asked: Instant::now(),
        }
    }

    /// The same iterations, to be stopped when asked.
    #[must_use]
    pub fn stopped_by(mut self, stop: &Stop) -> Self {
        self.stop = stop.clone();
        self
    }

    /// Ends a step that is to stop: once in every iteration, before its laws are called.
    fn may_go_on(&mut self) -> Result<(), StepFailure> {
        let now = Instant::now();
        self.stop
            .beat(now - std::mem::replace(&mut self.asked, now));
        if self.stop.is_urgent() {
            return Err(Reason::Stopped.into());
        }
        Ok(())
    }

    /// Factorises the matrix from the tangents that the groups hold, as an interrupted run had it.
    ///
    /// # Errors
    /// It is singular.
    pub fn restore_matrix(&mut self) -> Result<(), StepFailure> {
        let values = self.stiffness();
        self.factorise(values, 1.0)?;
        self.matrix.hold();
        Ok(())
    }

    /// Seeks equilibrium at the end of a step, starting from a guess of the displacement
    /// increments or, without one, from the tangent at the start.
    ///
    /// # Errors
    /// No equilibrium within the allowed iterations, or a law or the equations failed.
    pub fn step(
        &mut self,
        loads: &Loads,
        lambda_start: f64,
        lambda_end: f64,
        time: f64,
        guess: Option<Guess>,
    ) -> Result<StepSuccess, StepFailure> {
        self.set_out(loads);
        let contraction = guess.as_ref().and_then(|guess| guess.contraction);
        self.contraction = contraction.unwrap_or(f64::INFINITY);
        if let Some(domain) = self.domain {
            self.domain_forces = domain.forces_at(lambda_end);
        }
        let mut iterations = Vec::new();
        let outcome = self.iterate(
            loads,
            [lambda_start, lambda_end],
            time,
            guess,
            &mut iterations,
        );
        self.end(outcome.is_ok());
        let period = (time, lambda_end - lambda_start);
        outcome.map_err(|failure| self.explained(failure, iterations, lambda_start, period))
    }

    /// Begins a step under these loads.
    fn set_out(&mut self, loads: &Loads) {
        let bodies = &self.places.bodies;
        self.at_start = if bodies.n == 1 {
            vec![loads.scale]
        } else {
            norms(&bodies.of_dof, bodies.n, &loads.largest)
        };
        self.given = Given::default();
        self.changes = Vec::new();
        self.runaway = None;
        self.begin();
    }

    /// Norm of external forces, or of the forces at the start of the phase; by body.
    fn imposed(&self, external: &[f64]) -> Vec<f64> {
        let bodies = &self.places.bodies;
        let norms = norms(&bodies.of_dof, bodies.n, external);
        let both = norms.iter().zip(&self.at_start);
        both.map(|(norm, at_start)| norm.max(*at_start)).collect()
    }

    /// A failure with all that can be said of it.
    fn explained(
        &mut self,
        failure: StepFailure,
        iterations: Vec<Iteration>,
        lambda: f64,
        period: (f64, f64),
    ) -> StepFailure {
        let failure = StepFailure {
            iterations,
            runaway: self.runaway,
            ..failure
        };
        if failure.is_singular() {
            let singularity = self.singularity(period);
            self.tangents = Operator::None;
            self.will_compute(Operator::Elastic);
            failure.explained(singularity, lambda)
        } else {
            failure
        }
    }

    #[expect(
        clippy::too_many_lines,
        reason = "one loop, whose branches share its state"
    )]
    fn iterate(
        &mut self,
        loads: &Loads,
        [lambda_start, lambda_end]: [f64; 2],
        time: f64,
        guess: Option<Guess>,
        iterations: &mut Vec<Iteration>,
    ) -> Result<StepSuccess, StepFailure> {
        let external = loads.external(lambda_end);
        let prescribed = loads.prescribed_increments(lambda_start, lambda_end);
        let prescribed = self.places.gather(&prescribed);
        let task = Task {
            external: &self.places.gather(&external),
            imposed: self.imposed(&external),
            prescribed: &prescribed,
            period: (time, lambda_end - lambda_start),
        };
        let from_tangent = guess.is_none();
        let mut increment = match guess {
            Some(guess) => self.completed(guess.increment, &prescribed),
            None => self.predict(&task)?,
        };
        self.starts_from(&increment, from_tangent);
        let operator = self.operator();
        let mut balance = self
            .evaluate(&increment, &task, operator)
            .map_err(StepFailure::from)?;
        iterations.push(Iteration::first(&balance));
        let quasi = self.settings.method == Method::QuasiNewton;
        let mut acceleration = quasi.then(Acceleration::default);
        // Where the iterations with the present matrix start.
        let mut since = 0;
        let mut relaxation: Option<Relaxation> = None;
        let relaxes = self.settings.relaxation
            && self.settings.control == Control::Load
            && self.settings.method.is_newton();
        let mut may_relax = relaxes;
        // Where Newton iterations first came to a standstill, and how many they were.
        let mut standstill = (Vec::new(), 0);
        // Where the last series of Newton iterations starts.
        let mut first = 0;
        loop {
            self.may_go_on()?;
            let series = &iterations[first..];
            // Methods that keep their matrix are slow without having come to an end.
            let stands_still = self.settings.method.is_newton() && relaxation::stands_still(series);
            let is_over = series.len() > self.settings.max_iterations();
            let is_equilibrium = self.is_equilibrium(&balance, &series[series.len() - 1]);
            let ends = stands_still || is_over;
            if is_equilibrium || (ends && self.is_round_off(&increment, &balance, &task)) {
                let round_off = if is_equilibrium {
                    0.0
                } else {
                    balance.relative
                };
                return Ok(StepSuccess {
                    increment,
                    iterations: std::mem::take(iterations),
                    unreliable: balance.unreliable,
                    relaxed: relaxation.is_some(),
                    round_off,
                    scales: balance.scales,
                });
            }
            if is_over {
                break;
            }
            if may_relax && stands_still {
                if relaxation.is_none() {
                    standstill = (increment, series.len());
                    relaxation = self.start_relaxation(&task);
                }
                let relaxed = relaxation
                    .as_mut()
                    .and_then(|relaxation| self.relax(relaxation, &task, iterations).ok());
                if let Some(state) = relaxed {
                    (increment, balance) = state;
                    first = iterations.len() - 1;
                } else {
                    self.may_go_on()?;
                    // Newton iterations go on where they stood, for as many as are left to them.
                    may_relax = false;
                    relaxation = None;
                    increment = std::mem::take(&mut standstill.0);
                    balance = self
                        .evaluate(&increment, &task, Operator::Consistent)
                        .map_err(StepFailure::from)?;
                    first = iterations.len() - standstill.1;
                }
                continue;
            }
            self.stalls = stalls(&iterations[since..]);
            let corrected = self
                .renew(&iterations[first..], &increment, &task)
                .and_then(|renewed| {
                    if renewed {
                        since = iterations.len() - 1;
                        acceleration = quasi.then(Acceleration::default);
                    }
                    self.correct(&increment, &balance, &task, &mut acceleration)
                });
            let (last, next, at) = match corrected {
                Err(failure)
                    if failure.is_singular() && self.has_settled(&increment, &balance, &task) =>
                {
                    return Ok(StepSuccess {
                        increment,
                        iterations: std::mem::take(iterations),
                        unreliable: balance.unreliable,
                        relaxed: relaxation.is_some(),
                        round_off: 0.0,
                        scales: balance.scales,
                    });
                }
                corrected => corrected?,
            };
            iterations.push(last);
            (increment, balance) = (next, at);
        }
        let relaxed_in_vain = relaxes != may_relax;
        let last = iterations[iterations.len() - 1];
        Err(self.no_equilibrium(&increment, &balance, &task, &last, relaxed_in_vain))
    }

    /// Notes a correction, or a fraction of it, that was taken.
    fn took(&mut self, at: &Balance, correction: &[f64], moved: &[f64], length: f64) -> Iteration {
        self.changes = self.changes(correction, moved);
        // Of several bodies one that is at rest has nothing to correct.
        let criteria = self.criteria(false);
        let moving = self
            .measures(at, length >= 1.0)
            .into_iter()
            .zip(&self.changes);
        let relative = moving
            .filter(|(measures, _)| self.changes.len() == 1 || !measures.is_exact(criteria))
            .map(|(_, change)| change.relative)
            .fold(0.0, f64::max);
        Iteration::of(at, relative, length)
    }

    /// One correction, as far as it does not make the residual grow. Where one with the matrix of
    /// an earlier step does, the matrix of this state takes its place.
    fn correct(
        &mut self,
        increment: &[f64],
        before: &Balance,
        task: &Task<'_>,
        acceleration: &mut Option<Acceleration>,
    ) -> Result<(Iteration, Vec<f64>, Balance), StepFailure> {
        if self.is_stale() {
            let correction = self.solve(&before.residual, None)?;
            let moved = moved_by(increment, 1.0, &correction);
            let operator = self.operator();
            match self.evaluate(&moved, task, operator) {
                Ok(at) if at.relative <= before.relative.max(self.settings.force_tolerance) => {
                    let taken = self.took(&at, &correction, &moved, 1.0);
                    return Ok((taken, moved, at));
                }
                _ => {
                    // The groups hold another state.
                    self.tangents = Operator::None;
                    self.contraction = f64::INFINITY;
                    self.prepare(increment, task)?;
                }
            }
        }
        let mut correction = self.solve(&before.residual, None)?;
        if let Some(acceleration) = acceleration {
            correction = acceleration.improve(correction);
        }
        let size = norm(&correction) / norm(increment).max(f64::MIN_POSITIVE);
        let ends = self.probably_ends(before.relative, size);
        let (length, moved, at) = self.search(increment, &correction, before, task, ends)?;
        if let Some(acceleration) = acceleration {
            acceleration.took(&correction, length);
        }
        let taken = self.took(&at, &correction, &moved, length);
        Ok((taken, moved, at))
    }

    /// Takes up what the last correction achieved, and renews the matrix where the method wants it.
    /// Says whether there is another one now.
    fn renew(
        &mut self,
        iterations: &[Iteration],
        increment: &[f64],
        task: &Task<'_>,
    ) -> Result<bool, StepFailure> {
        let achieved = achieved(iterations);
        self.contraction = achieved.unwrap_or(self.contraction);
        let renewed = self.prepare(increment, task)?;
        if renewed && achieved.is_some() {
            // The residual will fall quadratically: r₃ / r₂ = (r₂ / r₁)².
            self.contraction *= self.contraction;
        }
        Ok(renewed)
    }

    /// A guess with the increments of prescribed and tied degrees of freedom.
    fn completed(&self, mut guess: Vec<f64>, prescribed: &[f64]) -> Vec<f64> {
        for &place in &self.places.prescribed {
            guess[place] = prescribed[place];
        }
        self.places.follow(&mut guess);
        guess
    }

    /// Whether a correction of this relative size will probably be the last one.
    fn probably_ends(&self, residual: f64, correction: f64) -> bool {
        let expected = residual * self.contraction;
        let tolerance = self.settings.force_tolerance;
        expected <= EXACT * tolerance
            || (expected <= tolerance && correction <= self.settings.displacement_tolerance)
    }

    /// What is asked of a state, of one that was corrected with the matrix of an earlier step or not.
    fn criteria(&self, is_stale: bool) -> Criteria {
        Criteria {
            force: self.settings.force_tolerance,
            displacement: self.settings.displacement_tolerance,
            is_stale,
        }
    }

    /// The bodies after an iteration, with a whole Newton correction or not.
    fn measures(&self, balance: &Balance, is_whole: bool) -> Vec<Measures> {
        let bodies = balance.by_body.iter().zip(&balance.away).enumerate();
        bodies
            .map(|(body, (&residual, &is_away))| {
                let change = self.changes.get(body).copied();
                Measures {
                    residual,
                    whole: change.filter(|_| is_whole),
                    beyond: change.map_or(0.0, |change| change.beyond),
                    is_away,
                }
            })
            .collect()
    }

    /// Whether an iteration has ended in equilibrium.
    fn is_equilibrium(&self, balance: &Balance, last: &Iteration) -> bool {
        let criteria = self.criteria(last.correction.is_some() && self.is_stale());
        let is_whole =
            last.correction.is_some() && last.step_length >= 1.0 && last.viscosity <= 0.0;
        let bodies = self.measures(balance, is_whole);
        bodies.iter().all(|body| body.is_equilibrium(criteria))
    }

    /// Whether a state whose tangent is singular is in equilibrium all the same, by the matrix at
    /// the start of the step: a layer that has just lost its contact, with it its stiffness, and
    /// whose residual is round-off. The trial state stays.
    fn has_settled(&mut self, increment: &[f64], balance: &Balance, task: &Task<'_>) -> bool {
        let criteria = Criteria {
            is_stale: true,
            ..self.criteria(true)
        };
        if balance.relative > STALE * criteria.force {
            return false;
        }
        let still = vec![0.0; increment.len()];
        let operator = self.operator();
        let settled = self.evaluate(&still, task, operator).is_ok() && {
            let values = self.stiffness();
            self.factorise(values, 1.0).is_ok() && {
                self.matrix.hold();
                self.solve(&balance.residual, None).is_ok_and(|correction| {
                    self.changes = self.changes(&correction, increment);
                    let bodies = self.measures(balance, true);
                    bodies.iter().all(|body| body.is_equilibrium(criteria))
                })
            }
        };
        settled && self.evaluate(increment, task, Operator::None).is_ok()
    }

    /// Whether a small residual is one that the last bit of the displacement increments makes, so
    /// that no iteration can lessen it. The trial state stays.
    fn is_round_off(&mut self, increment: &[f64], balance: &Balance, task: &Task<'_>) -> bool {
        if balance.relative > STILL_SMALL || balance.away.contains(&true) {
            return false;
        }
        let operator = self.tangents;
        let mut scattered = last_bit_scattered(increment);
        self.places.follow(&mut scattered);
        let moved = self.evaluate(&scattered, task, Operator::None);
        let again = self.evaluate(increment, task, operator);
        let (Ok(moved), Ok(_)) = (moved, again) else {
            return false;
        };
        let pairs = moved.residual.iter().zip(&balance.residual);
        let change: Vec<f64> = pairs.map(|(a, b)| a - b).collect();
        // The noise of a stiff body excuses nothing in another one.
        let bodies = &self.places.bodies;
        let of = |vector: &[f64]| norms(&bodies.of_equation, bodies.n, vector);
        let sizes = of(&balance.residual).into_iter().zip(of(&change));
        let tolerance = self.settings.force_tolerance;
        sizes
            .zip(&balance.by_body)
            .all(|((left, noise), &relative)| {
                relative <= tolerance || left <= ACCEPTED_ROUND_OFF * noise
            })
    }

    /// What is said of iterations that have come to their end.
    fn no_equilibrium(
        &mut self,
        increment: &[f64],
        balance: &Balance,
        task: &Task<'_>,
        last: &Iteration,
        relaxed_in_vain: bool,
    ) -> StepFailure {
        let n = self.settings.max_iterations();
        let unmet = self.unmet(balance, last.correction);
        let runaway = self.runaway;
        let culprit = self.diagnose(increment, balance, task);
        self.runaway = runaway;
        StepFailure {
            culprit,
            ..Reason::Unmet(Iterations::Newton(n, relaxed_in_vain), unmet).into()
        }
    }

    /// Both criteria at a state.
    fn unmet(&self, balance: &Balance, correction: Option<f64>) -> Unmet {
        let residual_tolerance = self.settings.force_tolerance;
        Unmet {
            failed: if balance.relative <= residual_tolerance {
                Criterion::Correction
            } else {
                Criterion::Residual
            },
            residual: balance.relative,
            residual_tolerance,
            correction,
            correction_tolerance: self.settings.displacement_tolerance,
        }
    }

    /// Does one iteration more and compares: what keeps Newton iterations from settling. With a
    /// kept matrix they are slow, which says nothing of a point.
    fn diagnose(
        &mut self,
        increment: &[f64],
        balance: &Balance,
        task: &Task<'_>,
    ) -> Option<Culprit> {
        if !self.settings.method.is_newton() {
            return None;
        }
        self.contraction = f64::INFINITY;
        self.prepare(increment, task).ok()?;
        let before = Snapshot::of(self.groups);
        let correction = self.solve(&balance.residual, None).ok()?;
        let (_, moved, _) = self
            .search(increment, &correction, balance, task, true)
            .ok()?;
        self.evaluate(&moved, task, Operator::Consistent).ok()?;
        diagnosis::compare(self.groups, &before, task.period)
    }

    /// Displacement increments that the tangent at the start predicts.
    fn predict(&mut self, task: &Task<'_>) -> Result<Vec<f64>, StepFailure> {
        let still = vec![0.0; task.external.len()];
        let operator = self.operator();
        let balance = self
            .evaluate(&still, task, operator)
            .map_err(StepFailure::from)?;
        self.prepare(&still, task)?;
        let mut increment = self.solve(&balance.residual, Some(task.prescribed))?;
        for (value, prescribed) in increment.iter_mut().zip(task.prescribed) {
            *value += prescribed;
        }
        self.places.follow(&mut increment);
        Ok(increment)
    }

    /// Takes the longest of a few fractions of the correction that does not make the residual
    /// grow; if all do, the one with the smallest residual. A law that fails is treated like a
    /// residual that grows, unless every fraction fails. Where the step probably `ends` here,
    /// tangents are left out.
    fn search(
        &mut self,
        increment: &[f64],
        correction: &[f64],
        before: &Balance,
        task: &Task<'_>,
        ends: bool,
    ) -> Result<(f64, Vec<f64>, Balance), StepFailure> {
        let mut best: Option<(f64, Vec<f64>, Balance)> = None;
        // Below the tolerance the residual may grow: there it is round-off.
        let enough = before.relative.max(self.settings.force_tolerance);
        let mut first_failure = None;
        let tries = if self.settings.line_search {
            STEP_LENGTHS.len()
        } else {
            1
        };
        for &length in &STEP_LENGTHS[..tries] {
            self.may_go_on()?;
            let moved = moved_by(increment, length, correction);
            let operator = if ends {
                Operator::None
            } else {
                self.operator()
            };
            match self.evaluate(&moved, task, operator) {
                Ok(balance) if balance.relative <= enough => {
                    return Ok((length, moved, balance));
                }
                Ok(balance) => {
                    if best
                        .as_ref()
                        .is_none_or(|(_, _, b)| balance.relative < b.relative)
                    {
                        best = Some((length, moved, balance));
                    }
                }
                Err(failure) => first_failure = first_failure.or(Some(failure)),
            }
        }
        match (best, first_failure) {
            // The groups hold the state of the last fraction tried.
            (Some((length, moved, _)), _) => {
                let operator = self.operator();
                let balance = self
                    .evaluate(&moved, task, operator)
                    .map_err(StepFailure::from)?;
                Ok((length, moved, balance))
            }
            (None, Some(failure)) => Err(failure.into()),
            (None, None) => Err(Reason::NoState.into()),
        }
    }

    /// Trial state, internal forces and residual under displacement increments; also the
    /// tangents if an `operator` is wanted.
    fn evaluate(
        &mut self,
        increment: &[f64],
        task: &Task<'_>,
        operator: Operator,
    ) -> Result<Balance, PointFailure> {
        let away = self.away(increment, task);
        let start = Instant::now();
        self.will_compute(operator);
        let (mut internal, mut unreliable) = self.internal_forces(increment, task, operator)?;
        // Forces in play before those of the domain cancel them out.
        let trial = |group: &Group, _: usize| group.stress.trial.clone();
        let in_play = self.forces_by_body(&internal, &trial);
        let floors = self.floors(increment, task);
        let (scales, has_moved) = self.scales(&in_play, &floors, task);
        if has_moved {
            (internal, unreliable) = self.internal_forces(increment, task, operator)?;
        }
        self.tangents = operator;
        if let Some(domain) = self.domain {
            let boundary = &self.places.boundary;
            let moved: Vec<f64> = boundary.iter().map(|&place| increment[place]).collect();
            let mut forces = self.domain_forces.clone();
            domain.add_product(&moved, &mut forces);
            for (&place, force) in boundary.iter().zip(forces) {
                internal[place] += force;
            }
        }
        let free = self.places.free.iter();
        let residual: Vec<f64> = free
            .map(|&place| task.external[place] - internal[place])
            .collect();
        let bodies = &self.places.bodies;
        let sizes = norms(&bodies.of_equation, bodies.n, &residual);
        let both = sizes.iter().zip(&scales);
        let by_body: Vec<f64> = both
            .map(|(size, &scale)| if scale > 0.0 { size / scale } else { 0.0 })
            .collect();
        self.costs.laws += start.elapsed();
        Ok(Balance {
            residual,
            relative: largest(&by_body),
            by_body,
            scales,
            away,
            unreliable,
        })
    }

    /// Trial state and internal forces by place, without those of the domain, under displacement
    /// increments. Says which law calls its result unreliable.
    fn internal_forces(
        &mut self,
        increment: &[f64],
        task: &Task<'_>,
        operator: Operator,
    ) -> Result<(Vec<f64>, Option<String>), PointFailure> {
        self.costs.evaluations += 1;
        self.places.scatter(increment, &mut self.displacement);
        let outcome = self.evaluate_groups(task.period, operator);
        let mut internal = self.places.take(&mut self.force);
        let unreliable = outcome?;
        self.places.fold(&mut internal);
        Ok((internal, unreliable))
    }

    /// Forces by body that count as none where no force has ever acted: round-off of K u.
    fn floors(&self, increment: &[f64], task: &Task<'_>) -> Vec<f64> {
        let bodies = &self.places.bodies;
        let sizes = self.by_body(increment);
        let of_domain = norm(&self.domain_forces);
        (0..bodies.n)
            .map(|body| {
                let cancelling = self.matrix.largest_of(body) * sizes[body] + of_domain;
                // Forces no larger than that are themselves what rounding leaves.
                if task.imposed[body] > ROUND_OFF * cancelling {
                    0.0
                } else {
                    ROUND_OFF * cancelling / self.settings.force_tolerance
                }
            })
            .collect()
    }

    /// Trial state of the groups under the displacements in their room; the forces are added up in
    /// theirs. Says which law calls its result unreliable.
    fn evaluate_groups(
        &mut self,
        (time, time_increment): (f64, f64),
        operator: Operator,
    ) -> Result<Option<String>, PointFailure> {
        let mut unreliable = None;
        for (number, group) in self.groups.iter_mut().enumerate() {
            if !self.system.includes(number) {
                continue;
            }
            let success = group.evaluate(&self.displacement, operator, time, time_increment)?;
            group
                .kinematics
                .add_forces(&group.stress.trial, &mut self.force);
            unreliable = unreliable.or(success
                .unreliable
                .map(|(_, why)| format!("group `{}`: {why}", group.name)));
        }
        Ok(unreliable)
    }
}

/// Fraction of the residual that the last correction left; `None` before the first one, infinite if
/// it was not taken as a whole.
fn achieved(iterations: &[Iteration]) -> Option<f64> {
    let [.., before, last] = iterations else {
        return None;
    };
    let is_whole = last.step_length >= 1.0 && last.viscosity <= 0.0;
    let ratio = last.residual / before.residual;
    Some(if is_whole && ratio.is_finite() {
        ratio
    } else {
        f64::INFINITY
    })
}

/// u + length · δ.
fn moved_by(increment: &[f64], length: f64, correction: &[f64]) -> Vec<f64> {
    let pairs = increment.iter().zip(correction);
    pairs.map(|(u, d)| u + length * d).collect()
}

/// Whether iterations with one matrix make too little progress.
fn stalls(iterations: &[Iteration]) -> bool {
    let Some([before, .., last]) = iterations.last_chunk::<PATIENCE>() else {
        return false;
    };
    last.residual > PROGRESS * before.residual
}

/// Displacement increments larger or smaller by their last bit, as the sum over many elements
/// scatters them.
pub(super) fn last_bit_scattered(increment: &[f64]) -> Vec<f64> {
    // The top bit of a multiple of 2⁶⁴ / golden ratio: a scatter of signs, the same every time.
    let sign = |i: usize| {
        let top = (i as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 63;
        1.0 - 2.0 * top as f64
    };
    let numbered = increment.iter().enumerate();
    let scattered = numbered.map(|(i, u)| u * (1.0 + sign(i) * f64::EPSILON));
    scattered.collect()
}

/// The largest of some sizes; not a number if one is none.
fn largest(sizes: &[f64]) -> f64 {
    let larger = |a: f64, b: &f64| if *b > a || b.is_nan() { *b } else { a };
    sizes.iter().fold(0.0, larger)
}

/// 2-norm.
pub(crate) fn norm(v: &[f64]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}
