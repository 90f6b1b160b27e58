//! Where the tangents of a phase's laws come from: from the laws, as long as they are the derivatives of
//! their stresses, or from differences of these.

use super::{Simulation, Warning, Watch};
use crate::equilibrium::{Clock, StepFailure, StepSuccess};
use crate::group::MadeBy;
use crate::settings::Tangents;

/// Iterations from which on a step is more than Newton's method should take.
const MANY: usize = 6;

impl Simulation {
    /// Tells the groups of a phase where their tangents come from, and who watches, what is not from the
    /// laws.
    pub(super) fn choose_tangents(&mut self, watch: &mut dyn Watch) {
        let settings = self.problem.settings;
        for group in &mut self.groups {
            group.take_tangents(settings.tangents, settings.method.is_newton());
            if group.is_active && group.differences() == Some(MadeBy::Declared) {
                let law = group.law.built.law.description().id.clone();
                watch.warning(&Warning::Approximate(law));
            }
        }
    }

    /// Looks at the laws' tangents after a step that took many iterations. Says so if some are differences
    /// from now on.
    pub(super) fn look_after(
        &mut self,
        success: &StepSuccess,
        (clock, lambda): (Clock, [f64; 2]),
        watch: &mut dyn Watch,
    ) {
        let was_hard =
            success.iterations.len() > MANY || success.tolerated > 0.0 || success.relaxed;
        // What was committed on the way is not where the step began.
        if was_hard && !success.was_motion {
            self.look_at_tangents((clock, lambda), false, watch);
        }
    }

    /// The same after a step that failed; says whether it is worth another attempt.
    pub(super) fn look_after_failure(
        &mut self,
        failure: &StepFailure,
        period: (Clock, [f64; 2]),
        watch: &mut dyn Watch,
    ) -> bool {
        !failure.is_stop()
            && failure.defect().is_none()
            && self.look_at_tangents(period, true, watch)
    }

    fn look_at_tangents(
        &mut self,
        (clock, [from, to]): (Clock, [f64; 2]),
        failed: bool,
        watch: &mut dyn Watch,
    ) -> bool {
        let settings = self.problem.settings;
        if settings.tangents != Tangents::Auto || !settings.method.is_newton() {
            return false;
        }
        let period = (clock.at(from), clock.at(to) - clock.at(from));
        let mut is_new = false;
        for group in &mut self.groups {
            let Some(deviation) = group.look(period, failed) else {
                continue;
            };
            is_new = true;
            let law = group.law.built.law.description().id.clone();
            watch.warning(&Warning::NoDerivative {
                group: group.name.clone(),
                law,
                deviation,
            });
        }
        is_new
    }
}
