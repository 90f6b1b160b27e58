//! The source of the tangents of a phase's laws: the laws, as long as their tangents are the derivatives of their
//! stresses, else differences of these.

use super::{Simulation, Warning, Watch};
use crate::equilibrium::{Clock, LedBy, StepFailure, StepSuccess};
use crate::group::{MadeBy, Went};
use crate::settings::Tangents;

/// Consistent tangents mostly need no more iterations than this.
const MANY: usize = 6;
/// With more, differences cost less: ten evaluations for each of the few iterations that they take.
const TOO_MANY: usize = 12;

impl Simulation {
    /// Tells the groups of a phase where their tangents come from, and warns of laws that declare theirs approximate.
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

    /// Looks at the laws' tangents after a step that took many iterations. Warns if some are not derivatives.
    pub(super) fn look_after(
        &mut self,
        success: &StepSuccess,
        (clock, lambda): (Clock, [f64; 2]),
        watch: &mut dyn Watch,
    ) {
        let went = match success.iterations.len() {
            // What was committed on the way is not where the step began.
            _ if success.was_motion => return,
            _ if success.tolerated > 0.0 || success.led_by == LedBy::Viscous => Went::Badly,
            // Nor do tangents have to answer for corrections without them.
            _ if success.was_kept => return,
            n if n > TOO_MANY => Went::Badly,
            n if n > MANY => Went::Slowly,
            _ => return,
        };
        self.look_at_tangents((clock, lambda), went, watch);
    }

    /// The same after a step that failed; says whether it is worth another attempt.
    pub(super) fn look_after_failure(
        &mut self,
        failure: &StepFailure,
        period: (Clock, [f64; 2]),
        watch: &mut dyn Watch,
    ) -> bool {
        // What ran away is where no law has to answer for its digits.
        !failure.is_stop()
            && failure.runaway.is_none()
            && failure.defect().is_none()
            && self.look_at_tangents(period, Went::Wrong, watch)
    }

    fn look_at_tangents(
        &mut self,
        (clock, [from, to]): (Clock, [f64; 2]),
        went: Went,
        watch: &mut dyn Watch,
    ) -> bool {
        let settings = self.problem.settings;
        if settings.tangents != Tangents::Auto || !settings.method.is_newton() {
            return false;
        }
        let period = (clock.at(from), clock.at(to) - clock.at(from));
        let mut is_new = false;
        for group in &mut self.groups {
            let Some(notice) = group.look(period, went) else {
                continue;
            };
            is_new |= notice.by_differences;
            let law = group.law.built.law.description().id.clone();
            watch.warning(&Warning::NoDerivative {
                group: group.name.clone(),
                law,
                notice,
            });
        }
        is_new
    }
}
