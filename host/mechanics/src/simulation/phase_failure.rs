//! The error of a phase that cannot go on: place and cause.

use super::{Simulation, UnderWay};
use crate::equilibrium::{Reason, Runaway, StepFailure};
use crate::error::{Error, NoEquilibrium, Place, RunawayAt};
use crate::group::Group;
use crate::problem::Axis;
use crate::settings::Control;

impl Simulation {
    /// The error of a phase that ends at load factor λ.
    pub(super) fn cannot_go_on(
        &self,
        phase: &UnderWay,
        place: &Place,
        lambda: f64,
        failure: StepFailure,
    ) -> Error {
        if let Some(defect) = failure.defect() {
            return Error::Law {
                place: place.clone(),
                failure: Box::new(defect.clone()),
                however_small: false,
            };
        }
        let broken = failure.failed().filter(|point| {
            let mut groups = self.groups.iter();
            let group = groups.find(|group| group.name == point.group);
            group.is_some_and(|group| group.law.built.law.breaks_down(&point.failure))
        });
        if let Some(broken) = broken {
            return Error::Law {
                place: place.clone(),
                failure: Box::new(broken.clone()),
                however_small: true,
            };
        }
        let runaway = failure.runaway.map(|runaway| self.runaway_at(runaway));
        Error::NoEquilibrium(Box::new(NoEquilibrium {
            runaway,
            ..self.stopped_at(phase, place, lambda, failure)
        }))
    }

    /// No equilibrium of a phase beyond load factor λ.
    fn stopped_at(
        &self,
        phase: &UnderWay,
        place: &Place,
        lambda: f64,
        failure: StepFailure,
    ) -> NoEquilibrium {
        let of = self.problem.phases[phase.number].increments;
        let settings = &self.problem.settings;
        NoEquilibrium {
            place: place.clone(),
            reached: lambda * of as f64,
            of,
            control: settings.control,
            viscous: phase.record.viscous_from.is_some(),
            may_move: settings.method.is_newton()
                && (settings.relaxation || settings.control == Control::Viscous),
            failure,
            runaway: None,
        }
    }

    /// The same where a step is found not to be complete.
    pub(super) fn incomplete(
        &self,
        phase: &UnderWay,
        place: &Place,
        lambda: f64,
        reason: Reason,
    ) -> Error {
        let none = self.stopped_at(phase, place, lambda, reason.into());
        Error::NoEquilibrium(Box::new(none))
    }

    /// Where a displacement ran away.
    fn runaway_at(&self, Runaway { dof, increment }: Runaway) -> RunawayAt {
        let node = dof / 2;
        let of_node = |group: &&Group| {
            let mut elements = 0..group.kinematics.n_elements();
            elements.any(|element| group.kinematics.nodes(element).contains(&node))
        };
        let groups = self.groups.iter().filter(of_node);
        RunawayAt {
            axis: if dof.is_multiple_of(2) {
                Axis::X
            } else {
                Axis::Y
            },
            increment,
            node: self.problem.mesh.nodes[node],
            groups: groups.map(|group| group.name.clone()).collect(),
        }
    }
}
