//! Newton iterations and a line search; with consistent tangents, or with a matrix that is kept.
//! Viscous relaxation where full Newton iterations come to a standstill, or arc-length control.
//!
//! Displacements and forces are vectors by place ([`Places`]) if nothing else is said.

mod acceleration;
mod matrix;
mod path;
mod relaxation;

pub use matrix::Matrix;
pub use path::Measure;

use super::diagnosis::{self, Snapshot};
use super::linear::LinearSolver;
use super::linear_domain::LinearDomain;
use crate::assembly::{Places, System};
use crate::case::{Control, Method, SolverInput};
use crate::group::{Group, PointFailure};
use crate::plugin::Operator;
use crate::stop::Stop;
use acceleration::Acceleration;
use relaxation::Relaxation;
use serde::{Deserialize, Serialize};
use std::time::{Duration, Instant};

/// Lengths of a correction that the line search tries, in order.
const STEP_LENGTHS: [f64; 5] = [1.0, 0.5, 0.25, 0.125, 0.0625];
/// The displacement criterion is waived where the residual is this far below its tolerance: a
/// linear step ends after one correction, which is as large as the increment itself.
const EXACT: f64 = 1e-3;
/// Share of the tolerances that a correction with the matrix of an earlier step, and the residual
/// it leaves, must not exceed; none is waived then.
const STALE: f64 = 0.1;
/// A quasi-Newton matrix is renewed where this many iterations (the state before them included)
/// have not brought the residual down to this fraction.
const PATIENCE: usize = 6;
const PROGRESS: f64 = 0.1;
/// Largest relative residual that may be round-off.
pub(super) const STILL_SMALL: f64 = 1e-6;
/// Round-off that a state may have, in changes of its forces by the last bit of the displacement
/// increments.
pub(super) const ACCEPTED_ROUND_OFF: f64 = 8.0;
/// Round-off of K u, relative to the forces it is the difference of.
const ROUND_OFF: f64 = 64.0 * f64::EPSILON;

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
    /// Largest of the forces (2-norms) at the start of the phase: where all forces vanish in its
    /// course, the residual is still measured against something.
    pub scale: f64,
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
}

/// A step that did not. The committed state is untouched.
#[derive(Clone, Debug)]
pub struct StepFailure {
    /// What happened until then.
    pub iterations: Vec<Iteration>,
    /// Why.
    pub reason: String,
    /// Size of the next attempt that a law asks for, as a fraction of this one.
    pub factor: Option<f64>,
    /// A law that no smaller step will help.
    pub defect: Option<PointFailure>,
    /// The point whose law failed, if one did.
    pub failed: Option<Box<PointFailure>>,
    /// What keeps the iterations from settling, if that could be found out.
    pub culprit: Option<String>,
    /// The step was stopped as asked: it says nothing of equilibrium.
    pub is_stop: bool,
}

impl StepFailure {
    /// A failure of which nothing more is known.
    pub fn because(reason: String) -> Self {
        Self {
            iterations: Vec::new(),
            reason,
            factor: None,
            defect: None,
            failed: None,
            culprit: None,
            is_stop: false,
        }
    }

    /// A step that was stopped as asked.
    pub fn stopped() -> Self {
        Self {
            is_stop: true,
            ..Self::because("stopped as asked".to_owned())
        }
    }
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
    settings: &'a SolverInput,
    /// Costs so far.
    costs: &'a mut Costs,
    scale: f64,
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
    /// Norm of those on all degrees of freedom, or of the forces at the start of the phase.
    imposed: f64,
    /// Increments of prescribed displacements.
    prescribed: &'t [f64],
    /// Time at the start, and its increment.
    period: (f64, f64),
}

/// Residual by equation, and the residual's norm relative to the forces in play.
struct Balance {
    residual: Vec<f64>,
    relative: f64,
    unreliable: Option<String>,
}

impl<'a> Newton<'a> {
    /// Iterations on these elements and equations.
    pub fn new(
        (system, places): (&'a System, &'a Places),
        domain: Option<&'a LinearDomain>,
        (solver, matrix): (&'a mut LinearSolver, &'a mut Matrix),
        groups: &'a mut [Group],
        settings: &'a SolverInput,
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
            scale: 0.0,
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
            return Err(StepFailure::stopped());
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
        self.scale = loads.scale;
        self.begin();
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
        outcome.map_err(|failure| StepFailure {
            iterations,
            ..failure
        })
    }

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
            imposed: norm(&external).max(self.scale),
            prescribed: &prescribed,
            period: (time, lambda_end - lambda_start),
        };
        let mut increment = match guess {
            Some(guess) => self.completed(guess.increment, &prescribed),
            None => self.predict(&task)?,
        };
        let operator = self.operator();
        let mut balance = self
            .evaluate(&increment, &task, operator)
            .map_err(failed_law)?;
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
            let stands_still = relaxation::stands_still(series);
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
                        .map_err(failed_law)?;
                    first = iterations.len() - standstill.1;
                }
                continue;
            }
            self.stalls = stalls(&iterations[since..]);
            if self.renew(&iterations[first..], &increment, &task)? {
                since = iterations.len() - 1;
                acceleration = quasi.then(Acceleration::default);
            }
            let (last, next, at) = self.correct(&increment, &balance, &task, &mut acceleration)?;
            iterations.push(last);
            (increment, balance) = (next, at);
        }
        let relaxed_in_vain = relaxes != may_relax;
        Err(self.no_equilibrium(&increment, &balance, &task, relaxed_in_vain))
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
        let size = |vector: &[f64]| norm(vector).max(f64::MIN_POSITIVE);
        if self.is_stale() {
            let correction = self.solve(&before.residual, None)?;
            let moved = moved_by(increment, 1.0, &correction);
            let operator = self.operator();
            match self.evaluate(&moved, task, operator) {
                Ok(at) if at.relative <= before.relative.max(self.settings.force_tolerance) => {
                    let taken = Iteration::of(&at, norm(&correction) / size(&moved), 1.0);
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
        let ends = self.probably_ends(before.relative, norm(&correction) / size(increment));
        let (length, moved, at) = self.search(increment, &correction, before, task, ends)?;
        if let Some(acceleration) = acceleration {
            acceleration.took(&correction, length);
        }
        let taken = Iteration::of(&at, norm(&correction) / size(&moved), length);
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

    /// Whether an iteration has ended in equilibrium.
    fn is_equilibrium(&self, balance: &Balance, last: &Iteration) -> bool {
        // To the matrix of an earlier step a part that has yielded since still looks stiff: its
        // corrections are smaller than what is left.
        let is_stale = last.correction.is_some() && self.is_stale();
        let share = if is_stale { STALE } else { 1.0 };
        let tolerance = share * self.settings.force_tolerance;
        let enough = share * self.settings.displacement_tolerance;
        let small_correction = last.step_length >= 1.0
            && last.viscosity <= 0.0
            && last.correction.is_some_and(|c| c <= enough);
        let small_residual = balance.relative <= tolerance;
        let is_exact = !is_stale && balance.relative <= EXACT * tolerance;
        is_exact || (small_residual && small_correction)
    }

    /// Whether a small residual is one that the last bit of the displacement increments makes, so
    /// that no iteration can lessen it. The trial state stays.
    fn is_round_off(&mut self, increment: &[f64], balance: &Balance, task: &Task<'_>) -> bool {
        if balance.relative > STILL_SMALL {
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
        let change = norm(&pairs.map(|(a, b)| a - b).collect::<Vec<f64>>());
        norm(&balance.residual) <= ACCEPTED_ROUND_OFF * change
    }

    /// What is said of iterations that have come to their end.
    fn no_equilibrium(
        &mut self,
        increment: &[f64],
        balance: &Balance,
        task: &Task<'_>,
        relaxed_in_vain: bool,
    ) -> StepFailure {
        let tried = if relaxed_in_vain {
            ", nor by viscous relaxation"
        } else {
            ""
        };
        let reason = format!(
            "no equilibrium after {} iterations{tried}: residual {:.1e}, tolerance {:.1e}",
            self.settings.max_iterations(),
            balance.relative,
            self.settings.force_tolerance
        );
        StepFailure {
            culprit: self.diagnose(increment, balance, task),
            ..plain(&reason)
        }
    }

    /// Does one iteration more and compares: what keeps Newton iterations from settling. With a
    /// kept matrix they are slow, which says nothing of a point.
    fn diagnose(
        &mut self,
        increment: &[f64],
        balance: &Balance,
        task: &Task<'_>,
    ) -> Option<String> {
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
        diagnosis::compare(self.groups, &before)
    }

    /// Displacement increments that the tangent at the start predicts.
    fn predict(&mut self, task: &Task<'_>) -> Result<Vec<f64>, StepFailure> {
        let still = vec![0.0; task.external.len()];
        let operator = self.operator();
        let balance = self.evaluate(&still, task, operator).map_err(failed_law)?;
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
                let balance = self.evaluate(&moved, task, operator).map_err(failed_law)?;
                Ok((length, moved, balance))
            }
            (None, Some(failure)) => Err(failed_law(failure)),
            (None, None) => Err(plain("the line search found no state")),
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
        let start = Instant::now();
        self.will_compute(operator);
        self.costs.evaluations += 1;
        self.places.scatter(increment, &mut self.displacement);
        let outcome = self.evaluate_groups(task.period, operator);
        let mut internal = self.places.take(&mut self.force);
        let unreliable = outcome?;
        self.tangents = operator;
        self.places.fold(&mut internal);
        // Forces in play before those of the domain cancel them out.
        let in_play = norm(&internal);
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
        let imposed = task.imposed;
        // Where no force has ever acted, what is below round-off of K u counts as none.
        let floor = if imposed > 0.0 {
            0.0
        } else {
            let cancelling = self.matrix.largest * norm(increment) + norm(&self.domain_forces);
            ROUND_OFF * cancelling / self.settings.force_tolerance
        };
        let scale = in_play.max(imposed).max(floor);
        let size = norm(&residual);
        let relative = if scale > 0.0 { size / scale } else { 0.0 };
        self.costs.laws += start.elapsed();
        Ok(Balance {
            residual,
            relative,
            unreliable,
        })
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

/// 2-norm.
pub(super) fn norm(v: &[f64]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

fn plain(reason: &str) -> StepFailure {
    StepFailure::because(reason.to_owned())
}

fn failed_law(failure: PointFailure) -> StepFailure {
    use abi::status::Outcome::{Argument, Internal, Unknown, Unsupported};
    let defective = matches!(
        failure.failure.outcome,
        Argument | Internal | Unknown(_) | Unsupported
    );
    StepFailure {
        iterations: Vec::new(),
        reason: failure.to_string(),
        factor: failure.failure.factor,
        failed: Some(Box::new(failure.clone())),
        defect: defective.then_some(failure),
        culprit: None,
        is_stop: false,
    }
}
