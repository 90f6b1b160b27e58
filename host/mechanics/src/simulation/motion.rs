//! Motions that led to equilibrium, viscous relaxation or creep: they are counted, the first of each kind is told, and it
//! is measured how far from each other two ways lead that a step may take: where relaxation has found an equilibrium,
//! Newton iterations from the tangent, and creep where they stand still, may find another one.

use super::phase::PhaseEquations;
use super::{Simulation, UnderWay, Warning, Watch};
use crate::assembly::fold;
use crate::equilibrium::{Costs, Matrix, Newton, StepSuccess, norm};
use crate::error::Place;
use crate::group::{Aside, Group};
use crate::settings::{Control, Settings};

/// Where a step that relaxation led to equilibrium leads from its tangent, by creep where need be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Neighbour {
    /// Elsewhere, by these shares of what the step changes (2-norms): of its displacement increments, and of the
    /// changes of the forces that the groups under iteration exert on the nodes.
    Apart {
        /// Of the displacement increments.
        displacements: f64,
        /// Of the changes of forces.
        forces: f64,
    },
    /// To no equilibrium.
    None,
}

impl Simulation {
    /// Counts a motion that led to equilibrium, and speaks of the first one of its kind; the phase's end says how
    /// many there were.
    pub(super) fn note_motion(
        &mut self,
        success: &StepSuccess,
        step: [f64; 2],
        control: Control,
        (place, phase): (&Place, &mut UnderWay),
        watch: &mut dyn Watch,
    ) {
        phase.record.relaxed += 1;
        if control == Control::Creep {
            phase.record.crept += 1;
            if phase.record.crept == 1 && self.problem.settings.control == Control::Creep {
                watch.warning(&Warning::Crept(place.clone()));
            }
        } else if phase.record.relaxed - phase.record.crept == 1 {
            let by_creep = self.neighbour(phase, success, step);
            watch.warning(&Warning::Relaxed(place.clone(), by_creep));
        }
    }

    /// Where a step leads so that ended in `success`, whose trial state is left as it is. `None` if it was stopped.
    fn neighbour(
        &mut self,
        phase: &UnderWay,
        success: &StepSuccess,
        [from, to]: [f64; 2],
    ) -> Option<Neighbour> {
        let equations = &phase.equations;
        let mut solver = self
            .solver(&equations.system, equations.domain.as_ref())
            .ok()?;
        let bytes = solver.bytes() + equations.system.bytes_of_elements(&self.groups);
        self.reuse
            .announce(bytes, "factorising the equations once more");
        let before = self.forces(equations, Group::add_carried);
        let here = self.forces(equations, Group::add_trial_forces);
        let aside: Vec<Aside> = self.groups.iter_mut().map(Group::put_aside).collect();
        let settings = Settings {
            control: Control::Creep,
            ..self.settings()
        };
        let mut matrix = Matrix::resumed(equations.matrix.largest());
        let mut costs = Costs::default();
        let clock = self.clock(phase.number);
        let crept = Newton::new(
            (&equations.system, &equations.places),
            equations.domain.as_ref(),
            (&mut solver, &mut matrix),
            &mut self.groups,
            &settings,
            &mut costs,
        )
        .stopped_by(&self.stop)
        .step(&phase.course.loads, [from, to], clock, None);
        let neighbour = match crept {
            Ok(crept) if crept.tolerated == 0.0 => {
                let there = self.forces(equations, Group::add_trial_forces);
                Some(Neighbour::Apart {
                    displacements: apart(&crept.increment, &success.increment, None),
                    forces: apart(&there, &here, Some(&before)),
                })
            }
            Ok(_) => Some(Neighbour::None),
            Err(failure) => (!failure.is_stop()).then_some(Neighbour::None),
        };
        for (group, aside) in self.groups.iter_mut().zip(aside) {
            group.take_back(aside);
        }
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

/// ‖a − b‖ / ‖b − start‖.
fn apart(a: &[f64], b: &[f64], start: Option<&[f64]>) -> f64 {
    let difference: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).collect();
    let change: Vec<f64> = match start {
        Some(start) => b.iter().zip(start).map(|(b, start)| b - start).collect(),
        None => b.to_vec(),
    };
    norm(&difference) / norm(&change).max(f64::MIN_POSITIVE)
}
