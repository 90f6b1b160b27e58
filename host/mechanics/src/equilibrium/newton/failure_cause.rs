//! Diagnosis of a step that found no equilibrium.

use super::Newton;
use super::failure::{Culprit, Iterations, Motion, Reason, StepFailure};
use super::iterate::{Control, Correction, State};
use super::outcome::Iteration;
use super::residual::Task;
use crate::equilibrium::diagnosis::{self, Snapshot};
use crate::equilibrium::mechanism::{self, Jumps, Mechanism};
use law::Operator;

impl Newton<'_> {
    /// A failure with its full diagnosis.
    pub(in crate::equilibrium) fn explained(
        &mut self,
        failure: StepFailure,
        iterations: Vec<Iteration>,
        lambda: f64,
        period: (f64, f64),
    ) -> StepFailure {
        let failure = StepFailure {
            iterations,
            runaway: self.reference.runaway,
            ..failure
        };
        if failure.is_singular() {
            let mechanism = self.mechanism(&[], &[], period.0);
            let failure = StepFailure {
                mechanism,
                ..failure
            };
            let singularity = self.singularity(period);
            self.kept.tangents = Operator::None;
            self.will_compute(Operator::Elastic);
            failure.explained(singularity, lambda)
        } else {
            failure
        }
    }

    /// The failure of iterations that have reached their limit.
    pub(in crate::equilibrium) fn no_equilibrium(
        &mut self,
        control: &impl Control,
        state: &State,
        task: &Task,
        (n, correction): (usize, Option<f64>),
        in_vain: Option<Motion>,
    ) -> StepFailure {
        let unmet = self.unmet(&state.balance, correction);
        // What ran away did so in the last iterate, not in the one that is only tried.
        let runaway = self.reference.runaway;
        let (culprit, before) = self.diagnose(control, state, task).unwrap_or_default();
        self.reference.runaway = runaway;
        StepFailure {
            opens_bond: self.opens_bond(),
            culprit,
            mechanism: self.mechanism(&state.balance.residual, &before, task.period.0),
            ..Reason::Unmet(Iterations::Newton(n, in_vain), unmet).into()
        }
    }

    /// Does one iteration more and compares: what keeps Newton iterations from settling. With a
    /// kept matrix they are slow, which says nothing of a point.
    fn diagnose(
        &mut self,
        control: &impl Control,
        state: &State,
        task: &Task,
    ) -> Option<(Option<Culprit>, Jumps)> {
        if !self.settings.method.is_newton() {
            return None;
        }
        self.kept.contraction = f64::INFINITY;
        self.prepare(&state.increment, task).ok()?;
        let (before, jumps) = (Snapshot::of(self.groups), self.jumps());
        let correction = Correction {
            increment: self.solve(&state.balance.residual, None).ok()?,
            rise: 0.0,
        };
        let (_, moved) = self.search(control, state, &correction, true).ok()?;
        self.evaluate(&moved.increment, task, Operator::Consistent)
            .ok()?;
        let culprit = diagnosis::compare(self.groups, &before, task.period);
        Some((culprit, jumps))
    }

    /// Whether a bond has opened in an iterate of the step. It may be closed in the last one.
    fn opens_bond(&self) -> bool {
        let mut opened = self.reference.opened.iter();
        opened.any(|&number| self.groups[number].may_break())
    }

    /// Jumps of the trial state, of the interfaces that may break.
    fn jumps(&self) -> Jumps {
        let groups = self.groups.iter().enumerate();
        let may_break = groups.filter(|(_, group)| group.may_break());
        may_break
            .map(|(number, group)| (number, group.trial_jumps()))
            .collect()
    }

    /// What gives way in the trial state, with this residual by equation, and jumps of an iterate before.
    fn mechanism(
        &self,
        residual: &[f64],
        before: &[(usize, Vec<f64>)],
        time: f64,
    ) -> Option<Mechanism> {
        let mut by_dof = vec![0.0; self.room.displacement.len()];
        for (&dof, force) in self.equations.system.free().iter().zip(residual) {
            by_dof[dof] = *force;
        }
        let includes = |number| self.equations.system.includes(number);
        mechanism::find(self.groups, includes, &by_dof, before, time)
    }
}
