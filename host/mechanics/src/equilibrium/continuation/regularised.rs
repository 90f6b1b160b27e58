//! Regularised Newton iterations, where plain ones get on slowly.
//!
//! If flow is not associated, the tangent K of a state may be indefinite, and Newton iterations alternate between
//! pieces of the law. Corrections with a share of the elastic stiffness K_e,
//!
//!   (K + α K_e) δ = r,
//!
//! are smaller where the body is soft, and go on in one direction. They approach equilibrium linearly;
//! [Anderson acceleration](Acceleration) makes that faster, and so does a smaller α where corrections keep their direction
//! and size. Nothing is committed: laws see one increment from the last equilibrium.
//!
//! A regularised correction is smaller than the error, so its size alone accepts nothing. If the last corrections
//! shrink by a factor ρ < 1 each, those to come add up to ρ/(1 − ρ) times the last one, and that is held against the
//! tolerance. A whole Newton correction of that state must not be larger than the increment: it sees a mode that
//! regularised corrections follow slowly. A body that moves on at constant speed (ρ = 1: a mechanism, until other points
//! yield or unload) is in no equilibrium, however small its residual. It is followed by long moves along the same
//! correction. Where they lead no further, viscous relaxation follows in the same step.

use crate::equilibrium::newton::{
    Acceleration, Control, Correction, Iteration, Newton, State, StepFailure, Task, dot, norm,
};
use crate::settings::Settings;
use law::Operator;

/// Largest and least α. It starts from the largest, falls by a factor where corrections are steady, and rises by it
/// where the residual does.
const SHARES: (f64, f64) = (0.1, 0.02);
const FALL: f64 = 4.0;
/// A whole Newton correction is taken if it leaves no more than this share of the residual.
const HALF: f64 = 0.5;
/// The first corrections of a step may leave more.
const FIRST: f64 = 3.0;
/// Newton iterations without a gain of a tenth after which regularised ones begin.
const PATIENCE: usize = 4;
/// Another Newton correction is tried after this many regularised ones in a row that halved the residual.
const HALVINGS: usize = 2;
/// α falls after steady corrections, of about the same direction and size: the least cosine between them, and how many
/// in a row.
const SHARE_FALLS: (f64, usize) = (0.93, 2);
/// Moves are long after even ones, as those of a constant speed.
const MOVES_ARE_LONG: (f64, usize) = (0.95, 3);
/// Least ratio of sizes in both.
const SAME_SIZE: f64 = 0.8;
/// The residual rises if it grows by more than this factor, and above the tolerance.
const JUMP: f64 = 2.0;
/// An accelerated correction is not taken if the cosine between it and the plain one is less than this.
const ALONG: f64 = 0.3;
/// Growth of a long move from one trial to the next; largest one, relative to the increment.
const GROWTH: f64 = 3.0;
const LONGEST: f64 = 0.5;
/// A long move may raise the residual by this factor, and up to the tolerance.
const RISE: f64 = 1.2;
/// A whole Newton correction of an equilibrium is at most this many times as large as the increment.
const HELD: f64 = 1.0;
/// Regularised corrections of a step, and those without a gain of a tenth that are a standstill.
const MOST: usize = 80;
const STANDSTILL: usize = 60;
const GAIN: f64 = 0.9;
/// The residual falls too slowly if at its rate over this many corrections it would not meet its tolerance within those
/// that are left to the step.
const WINDOW: usize = 12;
/// A body moves on as a mechanism if all corrections of that window are larger than this, relative to the increment, and
/// the residual does not fall by a tenth.
pub(super) const STILL_MOVES: f64 = 0.1;

/// Regularised iterations of a step.
#[derive(Debug)]
pub(super) struct Regularised {
    /// Elastic stiffness, in the matrix's pattern; without the domain.
    elastic: Vec<f64>,
    moves: Acceleration,
    /// α.
    share: f64,
    /// The last correction before acceleration, and the sizes of those since the last long move.
    last: Vec<f64>,
    sizes: Vec<f64>,
    /// Even corrections in a row, and steady ones.
    even: usize,
    steady: usize,
    /// Corrections in a row that each halved the residual.
    halvings: usize,
    /// The last step needed them.
    is_expected: bool,
    /// Number of the first regularised iteration, once there is one.
    since: Option<usize>,
    /// Viscous relaxation leads on in this step.
    pub(super) has_given_way: bool,
    /// The present state is an equilibrium by the rate of the corrections.
    pub(super) has_settled: bool,
}

impl Regularised {
    /// After a step that needed them, or one that did not.
    pub(super) fn new(is_expected: bool) -> Self {
        Self {
            elastic: Vec::new(),
            moves: Acceleration::default(),
            share: SHARES.0,
            last: Vec::new(),
            sizes: Vec::new(),
            even: 0,
            steady: 0,
            halvings: 0,
            is_expected,
            since: None,
            has_given_way: false,
            has_settled: false,
        }
    }

    /// Leaves the rest of the step to viscous relaxation.
    pub(super) fn give_way(&mut self) {
        (self.since, self.has_given_way) = (None, true);
        self.has_settled = false;
    }

    /// Whether Newton corrections are taken whole or not at all.
    pub(super) fn is_expected(&self) -> bool {
        self.is_expected || self.has_begun()
    }

    /// Whether Newton iterations get on slowly.
    pub(super) fn is_due(&self, series: &[Iteration]) -> bool {
        let Some(start) = series
            .len()
            .checked_sub(PATIENCE)
            .filter(|start| *start > 0)
        else {
            return false;
        };
        !self.has_begun() && least(&series[start..]) > GAIN * least(&series[..start])
    }

    /// Whether they have begun.
    pub(super) fn has_begun(&self) -> bool {
        self.since.is_some()
    }

    /// Makes ready for corrections of a state, which need not have been evaluated last.
    ///
    /// # Errors
    /// A law fails, or has no elastic operator.
    pub(super) fn take_over(
        &mut self,
        newton: &mut Newton<'_>,
        task: &Task,
        state: &State,
        iterations: &[Iteration],
    ) -> Result<(), StepFailure> {
        if self.since.is_none() {
            let still = vec![0.0; state.increment.len()];
            newton.evaluate(&still, task, Operator::Elastic)?;
            self.elastic = newton.stiffness().to_vec();
            self.since = Some(iterations.len());
        }
        newton.evaluate(&state.increment, task, Operator::Consistent)?;
        Ok(())
    }

    /// Whether a Newton correction is taken that leaves this share of the residual.
    pub(super) fn takes(&self, left: f64) -> bool {
        left <= if self.has_begun() { HALF } else { FIRST }
    }

    /// Whether a Newton correction may get on faster.
    pub(super) fn lets_try_newton(&self) -> bool {
        self.halvings >= HALVINGS
    }

    /// A Newton correction was tried: taken, or in vain.
    pub(super) fn has_tried_newton(&mut self, was_taken: bool) {
        self.moves = Acceleration::default();
        self.has_settled = false;
        if was_taken {
            self.sizes.clear();
            self.even = 0;
        } else {
            self.halvings = 0;
        }
    }

    /// Whether they have come to their end: too many, a standstill, a residual that falls too slowly, or a mechanism.
    pub(super) fn is_over(&self, settings: &Settings, iterations: &[Iteration]) -> bool {
        let Some(series) = self.since.and_then(|since| iterations.get(since..)) else {
            return false;
        };
        let stands_still = || {
            let (before, after) = series.split_at(series.len() - STANDSTILL);
            !before.is_empty() && least(after) > GAIN * least(before)
        };
        let most = settings.max_iterations.unwrap_or(MOST);
        let is_mechanism = || {
            let (before, after) = series.split_at(series.len() - WINDOW);
            let moves = |i: &Iteration| i.correction.is_some_and(|size| size > STILL_MOVES);
            after.iter().all(moves) && least(after) > GAIN * least(before)
        };
        let is_too_slow = || {
            let (before, after) = series.split_at(series.len() - WINDOW);
            let left = least(after) / settings.force_tolerance;
            let fall = (least(before) / least(after)).ln() / WINDOW as f64;
            left > 1.0 && left.ln() > fall.max(0.0) * (most - series.len()) as f64
        };
        series.len() >= most
            || series.len() > STANDSTILL && stands_still()
            || series.len() >= 2 * WINDOW && (is_too_slow() || is_mechanism())
    }

    /// The state that the next correction leads to.
    ///
    /// # Errors
    /// The step is stopped, or a law or the equations failed.
    pub(super) fn correct(
        &mut self,
        newton: &mut Newton<'_>,
        (control, task): (&impl Control, &Task),
        state: &State,
    ) -> Result<(Iteration, State), StepFailure> {
        newton.tangents_at(&state.increment, task)?;
        let share = self.share;
        // If even that matrix is singular.
        self.has_given_way = true;
        newton.factorise_regularised(&self.elastic, share)?;
        self.has_given_way = false;
        let plain = newton.regularised_answer(&state.balance.residual, share)?;
        let size = norm(&plain);
        let (cosine, ratio) = (self.cosine(&plain), size / norm(&self.last));
        let is_same_size = (SAME_SIZE..=1.0 / SAME_SIZE).contains(&ratio);
        let longer = |row: usize, least: f64| {
            let goes_on = is_same_size && cosine >= least;
            if goes_on { row + 1 } else { 0 }
        };
        self.even = longer(self.even, MOVES_ARE_LONG.0);
        self.steady = longer(self.steady, SHARE_FALLS.0);
        self.last.clone_from(&plain);
        self.sizes.push(size);
        let (correction, length, next) = if self.even >= MOVES_ARE_LONG.1 {
            self.moves = Acceleration::default();
            self.sizes.clear();
            let correction = Correction::by(plain);
            let (length, next) = far_along(newton, control, state, &correction)?;
            (correction, length, next)
        } else {
            self.accelerated(newton, control, state, plain)?
        };
        let taken = Iteration {
            viscosity: share,
            ..newton.took(&next, &correction.increment, length)
        };
        let halves = length >= 1.0 && next.balance.relative <= HALF * state.balance.relative;
        self.halvings = if halves { self.halvings + 1 } else { 0 };
        self.has_settled = length >= 1.0
            && next.balance.relative <= newton.settings.force_tolerance
            && !next.balance.away.contains(&true)
            && self.is_near(&taken, newton.settings.displacement_tolerance)
            && newton_leaves(newton, task, &next.increment)? <= HELD;
        self.adapt_share(rises(newton.settings, state, &next) || length < 1.0);
        newton.kept.contraction = f64::INFINITY;
        Ok((taken, next))
    }

    /// A correction that acceleration has made of the plain one or, if the residual rises along it, the plain one; with
    /// its length, and where it leads.
    fn accelerated(
        &mut self,
        newton: &mut Newton<'_>,
        control: &impl Control,
        state: &State,
        plain: Vec<f64>,
    ) -> Result<(Correction, f64, State), StepFailure> {
        let improved = self.moves.improve(plain.clone());
        if self.cosine(&improved) >= ALONG {
            let correction = Correction::by(improved);
            let (length, next) = as_far_as_laws_go(newton, control, state, &correction)?;
            if self.moves.is_empty() || !rises(newton.settings, state, &next) {
                self.moves.took(&correction.increment, length);
                return Ok((correction, length, next));
            }
            self.moves = Acceleration::default();
            self.moves.improve(plain.clone());
        }
        let correction = Correction::by(plain);
        let (length, next) = as_far_as_laws_go(newton, control, state, &correction)?;
        self.moves.took(&correction.increment, length);
        Ok((correction, length, next))
    }

    /// Chooses α for the next correction. What corrections with another one achieved says nothing of it.
    fn adapt_share(&mut self, is_too_small: bool) {
        self.share = if is_too_small && self.share < SHARES.0 {
            (self.share * FALL).min(SHARES.0)
        } else if !is_too_small && self.steady >= SHARE_FALLS.1 && self.share > SHARES.1 {
            (self.share / FALL).max(SHARES.1)
        } else {
            return;
        };
        self.moves = Acceleration::default();
        self.sizes.clear();
        (self.even, self.steady) = (0, 0);
    }

    /// Cosine of the angle between the last correction and this one; 0 without one.
    fn cosine(&self, correction: &[f64]) -> f64 {
        if self.last.len() != correction.len() {
            return 0.0;
        }
        dot(&self.last, correction) / (norm(&self.last) * norm(correction))
    }

    /// Whether corrections to come will add up to no more than this share of the increment.
    fn is_near(&self, taken: &Iteration, tolerance: f64) -> bool {
        let Some([first, _, _, last]) = self.sizes.last_chunk::<4>() else {
            return false;
        };
        let rate = (last / first).cbrt();
        let left = (rate / (1.0 - rate)).max(1.0);
        rate < 1.0
            && taken
                .correction
                .is_some_and(|size| left * size <= tolerance)
    }
}

/// Size of a whole Newton correction of a state, relative to its increment as far as that may measure it; infinite if
/// the tangent is singular.
///
/// # Errors
/// The step is stopped, or a law fails.
pub(super) fn newton_leaves(
    newton: &mut Newton<'_>,
    task: &Task,
    increment: &[f64],
) -> Result<f64, StepFailure> {
    let balance = newton.evaluate(increment, task, Operator::Consistent)?;
    let correction = newton
        .prepare(increment, task)
        .and_then(|_| newton.correction_of(&balance));
    match correction {
        Err(failure) if failure.is_singular() => Ok(f64::INFINITY),
        correction => Ok(newton.relative(&correction?, increment)),
    }
}

/// Whether a correction has made the residual rise, and above the tolerance.
fn rises(settings: &Settings, from: &State, to: &State) -> bool {
    to.balance.relative > JUMP * from.balance.relative.max(settings.force_tolerance)
}

/// Least residual of iterations.
fn least(part: &[Iteration]) -> f64 {
    part.iter()
        .fold(f64::INFINITY, |least, i| least.min(i.residual))
}

/// The largest length of a correction that the laws can follow, at most 1, and where it leads.
fn as_far_as_laws_go(
    newton: &mut Newton<'_>,
    control: &impl Control,
    state: &State,
    correction: &Correction,
) -> Result<(f64, State), StepFailure> {
    let mut length = 1.0;
    loop {
        let at = state.moved_by(length, correction);
        match control.evaluate(newton, at, Operator::Consistent) {
            Err(failure) if failure.is_stop() || length < 0.1 => return Err(failure),
            Err(_) => length *= 0.5,
            Ok(next) => return Ok((length, next)),
        }
    }
}

/// As many times an even correction as the residual stays where it is, and where that leads.
fn far_along(
    newton: &mut Newton<'_>,
    control: &impl Control,
    state: &State,
    correction: &Correction,
) -> Result<(f64, State), StepFailure> {
    let longest = LONGEST * norm(&state.increment) / norm(&correction.increment);
    let allowed = (RISE * state.balance.relative).max(newton.settings.force_tolerance);
    let mut length = 1.0;
    while GROWTH * length <= longest {
        let at = state.moved_by(GROWTH * length, correction);
        match control.evaluate(newton, at, Operator::None) {
            Err(failure) if failure.is_stop() => return Err(failure),
            Ok(next) if next.balance.relative <= allowed => length *= GROWTH,
            _ => break,
        }
    }
    let at = state.moved_by(length, correction);
    let next = control.evaluate(newton, at, Operator::Consistent)?;
    Ok((length, next))
}
