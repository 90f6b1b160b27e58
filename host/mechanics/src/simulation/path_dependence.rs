//! How far apart two ways lead that a step may take.
//!
//! Motions (viscous relaxation or viscous control) that led to equilibrium are counted, and the first of each kind is
//! reported. After relaxation the step is repeated from its tangent, under viscous control if Newton iterations stand
//! still: this may lead to another equilibrium. If steps are cut back, iterations choose the steps: two halves of a
//! step may end elsewhere than the whole.

use super::phase::PhaseEquations;
use super::{Simulation, UnderWay, Warning, Watch};
use crate::assembly::fold;
use crate::equilibrium::{Costs, Equations, LedBy, Newton, StepSuccess, norm};
use crate::error::Place;
use crate::group::{Aside, Group};
use crate::settings::{Control, Settings};
use serde::{Deserialize, Serialize};

/// Another way that a step is tried on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Trial {
    /// From its tangent, under viscous control where Newton iterations stand still.
    Viscous,
    /// In two halves, by the load alone.
    Halves,
}

/// Where a step leads on another way.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Neighbour {
    /// Elsewhere, by these shares of what the step changes (2-norms): of its displacement increments, and of the
    /// changes of the forces that the groups under iteration exert on the nodes.
    Apart {
        /// The distance of the displacement increments.
        displacements: f64,
        /// The distance of the changes of forces.
        forces: f64,
        /// The largest difference of a displacement (m) and of a nodal force (kN).
        largest: [f64; 2],
    },
    /// To no equilibrium.
    None,
}

impl Simulation {
    /// Counts a step that regularised corrections or a motion led to equilibrium, and reports the first one of its kind;
    /// the phase's end reports their number.
    pub(super) fn note_motion(
        &mut self,
        success: &StepSuccess,
        step: [f64; 2],
        control: Control,
        (place, phase): (&Place, &mut UnderWay),
        watch: &mut dyn Watch,
    ) {
        if success.led_by == LedBy::Regularised {
            phase.record.regularised += 1;
            if phase.record.regularised == 1 {
                let other = self.neighbour(phase, success, step, Trial::Viscous);
                watch.warning(&Warning::Regularised(place.clone(), other));
            }
            return;
        }
        phase.record.relaxed += 1;
        if control == Control::Viscous {
            phase.record.viscous += 1;
            if phase.record.viscous == 1 && self.problem.settings.control == Control::Viscous {
                watch.warning(&Warning::Viscous(place.clone()));
            }
        } else if phase.record.relaxed - phase.record.viscous == 1 {
            let by_viscous_control = self.neighbour(phase, success, step, Trial::Viscous);
            watch.warning(&Warning::Relaxed(place.clone(), by_viscous_control));
        }
    }

    /// Reports the first step of a phase, in a cut increment, whose two halves end elsewhere, and how far. In steps
    /// before it nothing may flow.
    pub(super) fn note_cut_back(
        &mut self,
        success: &StepSuccess,
        step: [f64; 2],
        (place, phase): (&Place, &mut UnderWay),
        watch: &mut dyn Watch,
    ) {
        let told = phase.record.in_halves;
        if phase.record.halved == MOST_HALVED || told.is_some_and(|told| !told.is_the_same()) {
            return;
        }
        phase.record.halved += 1;
        if let Some(in_halves) = self.neighbour(phase, success, step, Trial::Halves) {
            phase.record.in_halves = Some(in_halves);
            if !in_halves.is_the_same() {
                watch.warning(&Warning::CutBack(place.clone(), in_halves));
            }
        }
    }

    /// Result of another way for a step that ended in `success`, whose trial state is left unchanged. `None` if it was
    /// stopped.
    fn neighbour(
        &mut self,
        phase: &mut UnderWay,
        success: &StepSuccess,
        [from, to]: [f64; 2],
        trial: Trial,
    ) -> Option<Neighbour> {
        let equations = &mut phase.equations;
        let before = self.forces(equations, Group::add_carried);
        let here = self.forces(equations, Group::add_trial_forces);
        let aside: Vec<Aside> = self.groups.iter_mut().map(Group::put_aside).collect();
        let settings = match trial {
            Trial::Viscous => Settings {
                control: Control::Viscous,
                ..self.settings()
            },
            Trial::Halves => Settings {
                control: Control::Load,
                relaxation: false,
                tolerated_residual: 0.0,
                ..self.settings()
            },
        };
        let last = equations.solver.set_aside();
        let mut another = match last {
            Some(_) => None,
            None => Some(equations.solver.another().ok()?),
        };
        let mut matrix = equations.matrix.lend();
        let mut costs = Costs::default();
        let clock = self.clock(phase.number);
        let equations_of_trial = Equations {
            system: &equations.system,
            places: &equations.places,
            domain: equations.domain.as_ref(),
            solver: another.as_mut().unwrap_or(&mut equations.solver),
            matrix: &mut matrix,
        };
        let mut newton = Newton::new(equations_of_trial, &mut self.groups, &settings, &mut costs)
            .stopped_by(&self.stop);
        let (loads, history) = (&phase.course.loads, &phase.course.history);
        let other = match trial {
            Trial::Viscous => newton.step(loads, [from, to], clock, None),
            Trial::Halves => {
                let guess = history.guess(0.5 * (to - from));
                newton.step_in_halves(loads, [from, to], clock, guess)
            }
        };
        let neighbour = match other {
            Ok(other) if other.tolerated == 0.0 => {
                let there = self.forces(equations, Group::add_trial_forces);
                // Where forces no longer change, what the tolerance leaves of them is no difference.
                let least = self.settings().force_tolerance / SAME * norm(&here);
                Some(Neighbour::Apart {
                    displacements: apart(&other.increment, &success.increment, None, 0.0),
                    forces: apart(&there, &here, Some(&before), least),
                    largest: [
                        largest_difference(&other.increment, &success.increment),
                        largest_difference(&there, &here),
                    ],
                })
            }
            Ok(_) => Some(Neighbour::None),
            Err(failure) => (!failure.is_stop()).then_some(Neighbour::None),
        };
        for (group, aside) in self.groups.iter_mut().zip(aside) {
            group.take_back(aside);
        }
        let PhaseEquations {
            matrix: own,
            solver,
            ..
        } = equations;
        own.put_back(matrix, solver, last);
        neighbour
    }

    /// Forces of the groups that iterate, by degree of freedom.
    fn forces(
        &mut self,
        equations: &PhaseEquations,
        add: impl Fn(&mut Group, &mut [f64]),
    ) -> Vec<f64> {
        let mut forces = vec![0.0; self.displacement.len()];
        for (number, group) in self.groups.iter_mut().enumerate() {
            if equations.system.includes(number) {
                add(group, &mut forces);
            }
        }
        fold(&self.tied, &mut forces);
        forces
    }
}

/// Steps of a phase that are tried in two halves, at most.
const MOST_HALVED: usize = 4;
/// Two ways that lead a step no further from each other than this, as shares of what it changes, lead to one
/// equilibrium.
const SAME: f64 = 1e-6;

impl Neighbour {
    /// How far it is from the state that the step ended in, in words.
    pub(super) fn distance(self) -> String {
        match self {
            Self::Apart {
                displacements,
                forces,
                largest: [displacement, force],
            } => format!(
                "at most {displacement:.1e} m and {force:.1e} kN at a node ({displacements:.1e} and {forces:.1e} of the step)"
            ),
            Self::None => String::new(),
        }
    }

    /// Whether it is the state that the step ended in.
    pub(super) fn is_the_same(self) -> bool {
        let Self::Apart {
            displacements,
            forces,
            ..
        } = self
        else {
            return false;
        };
        displacements.max(forces) <= SAME
    }
}

fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    let differences = a.iter().zip(b).map(|(a, b)| (a - b).abs());
    differences.fold(0.0, f64::max)
}

/// ‖a − b‖ / ‖b − start‖, or over what the change is at `least`.
fn apart(a: &[f64], b: &[f64], start: Option<&[f64]>, least: f64) -> f64 {
    let difference: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).collect();
    let change: Vec<f64> = match start {
        Some(start) => b.iter().zip(start).map(|(b, start)| b - start).collect(),
        None => b.to_vec(),
    };
    norm(&difference) / norm(&change).max(least).max(f64::MIN_POSITIVE)
}
