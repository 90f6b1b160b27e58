//! Release: bonds that break one after another where iterations cannot settle.
//!
//! A bond that breaks loses its traction at once. Within one increment from the last equilibrium there may be no answer then:
//! bonded, the point opens; broken, what it has lost moves the body so that the point closes, and as its law sees the one increment
//! from before, it has never been open. Iterations alternate between both for ever, however small the step, and so does
//! whatever else starts from the same state.
//! A real bond stays broken. So where iterations stand still the way from their state to the next one is searched for points whose
//! traction breaks off ([`Group::breaks`](crate::group::Group::breaks)); the one that is broken on the largest part of it is
//! committed where it has just broken, alone, and iterations go on from there with what is left. Laws see the path of a point: up to
//! its break, and on. One point after the other is released, each once in a step, until iterations settle or none is left.
//! (So, by load factors instead of iterations, works the sequentially linear analysis of J. G. Rots, 2001.)

use super::failure::StepFailure;
use super::iterate::State;
use super::relaxation::stands_still;
use super::residual::{Balance, Task};
use super::{Iteration, Newton};
use crate::group::{Break, Committed, Group};
use law::Operator;

/// Points that are broken on as much of the way as the first one, but for this, are released with it: those of a body and
/// its mirror image are.
const ALIKE: f64 = 1e-6;

/// Iterations of a series up to which a bond that breaks is looked for where they stand still, before anything else is
/// tried: not every state that they alternate between has one on its way.
const WAITS: usize = 16;

/// What has been released in a step.
#[derive(Debug, Default)]
pub(super) struct Release {
    /// It is asked for.
    is_on: bool,
    /// Committed states before the first release.
    before: Option<Vec<Committed>>,
    /// Points, by group.
    points: Vec<(usize, usize)>,
}

impl Release {
    /// Of a step that bonds may break in, or not.
    pub(super) fn new(is_on: bool) -> Self {
        Self {
            is_on,
            ..Self::default()
        }
    }

    /// What was released.
    pub(super) fn into_points(self) -> Vec<(usize, usize)> {
        self.points
    }

    /// Whether it may lead away from a state that no correction can be computed for.
    pub(super) fn is_at_hand(&self) -> bool {
        self.is_on
    }

    /// Whether iterations go on although they stand still: from their next state a bond may break.
    pub(super) fn waits(&self, series: &[Iteration], is_singular: bool) -> bool {
        self.is_on && !is_singular && series.len() < WAITS
    }

    /// Takes back what was released; whether anything was.
    pub(super) fn undo(&mut self, newton: &mut Newton<'_>) -> bool {
        let before = self.before.take();
        let has_released = before.is_some();
        if let Some(before) = before {
            newton.restore(before);
        }
        has_released
    }

    /// Where iterations stand still, or at a state that no correction can be computed for (`is_singular`), releases the point that
    /// breaks first: the balance of the state without it. `None` where iterations get on, or none breaks.
    ///
    /// # Errors
    /// The step is stopped, or a law fails.
    pub(super) fn relieve(
        &mut self,
        newton: &mut Newton<'_>,
        task: &Task,
        (state, is_singular): (&State, bool),
        series: &[Iteration],
    ) -> Result<Option<Balance>, StepFailure> {
        let is_due = is_singular || stands_still(series);
        if !self.is_on || !is_due {
            return Ok(None);
        }
        newton.may_go_on()?;
        let Some((points, at)) = newton.first_to_break(&self.points, state, task, is_singular)
        else {
            // The groups hold another state.
            newton.evaluate(&state.increment, task, Operator::Consistent)?;
            return Ok(None);
        };
        self.before.get_or_insert_with(|| newton.committed());
        let untimed = (task.period.0, 0.0);
        newton.hold_broken(&points, &at, untimed)?;
        self.points.extend(points);
        newton.matrix.held = false;
        newton.kept.contraction = f64::INFINITY;
        let balance = newton.evaluate(&state.increment, task, Operator::Consistent)?;
        Ok(Some(balance))
    }
}

impl Newton<'_> {
    /// Points, by group, that break first on the way from a state to the next one, and displacement increments where they
    /// have just broken. Those of `others` are broken already.
    fn first_to_break(
        &mut self,
        others: &[(usize, usize)],
        state: &State,
        task: &Task,
        is_singular: bool,
    ) -> Option<(Vec<(usize, usize)>, Vec<f64>)> {
        if !self.groups.iter().any(Group::may_break) {
            return None;
        }
        let operator = if is_singular {
            Operator::Elastic
        } else {
            Operator::Consistent
        };
        let balance = self.evaluate(&state.increment, task, operator).ok()?;
        let from = self.jumps();
        self.factorise_tangents().ok()?;
        self.matrix.held = false;
        let correction = self.solve(&balance.residual, None).ok()?;
        let moved = |share: f64| -> Vec<f64> {
            let pairs = state.increment.iter().zip(&correction);
            pairs.map(|(u, d)| u + share * d).collect()
        };
        self.evaluate(&moved(1.0), task, Operator::None).ok()?;
        let mut found = self.breaks_since(&from, task.period.0);
        for (n, b) in &found {
            let g = &self.groups[*n];
            eprintln!(
                "  cand {} {} at {:?} at={:.3e} onward={} other={} r={:.3e}",
                g.name,
                b.point,
                g.kinematics.position(b.point),
                b.at,
                b.onward,
                others.contains(&(*n, b.point)),
                balance.relative
            );
        }
        eprintln!(" -- iterate r={:.3e} n={}", balance.relative, found.len());
        found.retain(|(number, found)| !others.contains(&(*number, found.point)));
        let shares = found.iter().map(|(_, found)| found.share());
        let most = shares.fold(0.0, f64::max);
        found.retain(|(_, found)| found.share() >= most - ALIKE);
        let (_, first) = *found.first()?;
        found.retain(|(_, found)| found.onward == first.onward);
        let places = found.iter().map(|(_, found)| found.at);
        let at = if first.onward {
            places.fold(first.at, f64::max)
        } else {
            places.fold(first.at, f64::min)
        };
        let points = found.iter().map(|(number, found)| (*number, found.point));
        Some((points.collect(), moved(at)))
    }

    /// Jumps of the trial state, of interfaces that may break.
    pub(super) fn jumps(&self) -> Vec<(usize, Vec<f64>)> {
        let groups = self.groups.iter().enumerate();
        let breaking =
            groups.filter(|(number, group)| self.system.includes(*number) && group.may_break());
        breaking
            .map(|(number, group)| (number, group.trial_jumps()))
            .collect()
    }

    /// Points, by group, whose traction breaks off between an earlier trial state and the present one.
    pub(super) fn breaks_since(
        &self,
        jumps: &[(usize, Vec<f64>)],
        time: f64,
    ) -> Vec<(usize, Break)> {
        let of_group = |&(number, ref from): &(usize, Vec<f64>)| {
            let group = &self.groups[number];
            let breaks = group.breaks([from, &group.trial_jumps()], time);
            breaks.into_iter().map(move |found| (number, found))
        };
        jumps.iter().flat_map(of_group).collect()
    }

    /// Commits points, by group, in the state at these displacement increments.
    ///
    /// # Errors
    /// A law fails.
    fn hold_broken(
        &mut self,
        points: &[(usize, usize)],
        at: &[f64],
        period: (f64, f64),
    ) -> Result<(), StepFailure> {
        self.places.scatter(at, &mut self.displacement);
        let outcome = self.evaluate_groups(period, Operator::None);
        self.force.fill(0.0);
        outcome?;
        for (number, group) in self.groups.iter_mut().enumerate() {
            let own = points.iter().filter(|(of, _)| *of == number);
            let own: Vec<usize> = own.map(|(_, point)| *point).collect();
            if !own.is_empty() {
                for p in &own {
                    eprintln!(
                        "RELEASE {} {} jump {:?} t {:?}",
                        group.name,
                        p,
                        &group.strain.trial[2 * p..2 * p + 2],
                        &group.stress.trial[2 * p..2 * p + 2]
                    );
                }
                group.release(&own);
            }
        }
        Ok(())
    }
}
