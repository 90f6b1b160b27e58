//! Loads of a phase: what acts at its end, and how it gets there.
//!
//! A phase may follow a course: pairs of time and factor on what it changes. Between two of them, a leg,
//! loads are linear in the time; legs follow one another within the phase.

use super::state::PhaseCourse;
use super::ties::Tied;
use super::{Simulation, Warning, Watch};
use crate::assembly::fold;
use crate::equilibrium::{Loads, norm};
use crate::error::Error;
use crate::ground::{Acting, Loading};
use crate::problem::{Axis, Phase};

/// A prescribed displacement of a phase: degree of freedom, value at its start and at its end.
pub(super) type Prescribed = (usize, f64, f64);

/// Times and factors at the start and at the end of a leg of a phase.
pub(super) fn leg(phase: &Phase, number: usize) -> Option<[[f64; 2]; 2]> {
    if phase.course.is_empty() {
        return (number == 0).then_some([[0.0, 0.0], [1.0, 1.0]]);
    }
    Some([*phase.course.get(number)?, *phase.course.get(number + 1)?])
}

impl Simulation {
    /// Takes over what a phase changes of loads and constraints. Returns its prescribed displacements.
    ///
    /// # Errors
    /// Lines that move alike are prescribed to move differently.
    pub(super) fn take_loads(
        &mut self,
        number: usize,
        watch: &mut dyn Watch,
    ) -> Result<Vec<Prescribed>, Error> {
        self.prescribe(number);
        let own = self.prescribed.iter();
        let own = own.map(|(&dof, &end)| (dof, self.displacement[dof], end));
        let own: Vec<Prescribed> = own.collect();
        let Tied {
            ties,
            prescribed,
            led,
            apart,
        } = self.tied_in(number, own)?;
        if let Some((by, at)) = apart {
            let phase = self.problem.phases[number].name.clone();
            watch.warning(&Warning::LedTogether { phase, by, at });
        }
        (self.tied, self.led) = (ties, led);
        Ok(prescribed)
    }

    /// Takes over what a phase changes of prescribed displacements.
    pub(super) fn prescribe(&mut self, number: usize) {
        let phase = self.problem.phases[number].clone();
        if phase.reset_displacements {
            self.displacement.fill(0.0);
            self.prescribed.values_mut().for_each(|value| *value = 0.0);
        }
        for input in &phase.free {
            for dof in self.dofs(&input.line, &input.components) {
                self.prescribed.remove(&dof);
            }
        }
        for input in &phase.displacement {
            for (value, axis) in [(input.x, Axis::X), (input.y, Axis::Y)] {
                if let Some(value) = value {
                    for dof in self.dofs(&input.line, &[axis]) {
                        self.prescribed.insert(dof, value);
                    }
                }
            }
        }
    }

    /// Before the first phase: the degrees of freedom that some phases prescribe and others do not, but for
    /// what moves alike.
    pub(super) fn held_in_some_phases(&self) -> Vec<bool> {
        let n_dofs = self.displacement.len();
        let mut held = vec![false; n_dofs];
        for &dof in self.prescribed.keys() {
            held[dof] = true;
        }
        let (mut always, mut ever) = (vec![true; n_dofs], vec![false; n_dofs]);
        for phase in &self.problem.phases {
            for input in &phase.free {
                for dof in self.dofs(&input.line, &input.components) {
                    held[dof] = false;
                }
            }
            for input in &phase.displacement {
                let axes = [(input.x, Axis::X), (input.y, Axis::Y)];
                let given = axes.into_iter().filter(|(value, _)| value.is_some());
                for dof in given.flat_map(|(_, axis)| self.dofs(&input.line, &[axis])) {
                    held[dof] = true;
                }
            }
            for (dof, &held) in held.iter().enumerate() {
                always[dof] &= held;
                ever[dof] |= held;
            }
        }
        let both = ever.iter().zip(&always);
        both.map(|(ever, always)| *ever && !always).collect()
    }

    /// Loads on a leg of a phase that starts here.
    pub(super) fn loads_on(
        &self,
        number: usize,
        course: usize,
        prescribed: &[Prescribed],
    ) -> Loads {
        let phase = &self.problem.phases[number];
        let [[t_0, _], [t_1, factor]] = leg(phase, course).unwrap_or([[0.0, 0.0], [1.0, 1.0]]);
        let force_end = self.loading_at(factor).forces(&self.problem, &self.groups);
        let prescribed = prescribed.iter();
        let mut loads = Loads {
            force_start: self.force.clone(),
            force_end,
            prescribed: prescribed
                .map(|&(dof, start, end)| (dof, self.displacement[dof], part(factor, start, end)))
                .collect(),
            leg: [t_0, t_1],
            ..Loads::default()
        };
        fold(&self.tied, &mut loads.force_start);
        fold(&self.tied, &mut loads.force_end);
        loads
    }

    /// Tells the groups how fast their stress-free strains change on a leg of a phase.
    pub(super) fn set_swelling(&mut self, number: usize, course: usize) {
        let leg = leg(&self.problem.phases[number], course);
        let [[t_0, f_0], [t_1, f_1]] = leg.unwrap_or([[0.0, 0.0], [1.0, 1.0]]);
        let speed = (f_1 - f_0) / (t_1 - t_0);
        let [start, end] = &self.loading;
        let changes = start.strain.iter().zip(&end.strain);
        for (group, (start, end)) in self.groups.iter_mut().zip(changes) {
            group.swells_by([0, 1, 2].map(|c| speed * (end[c] - start[c])));
        }
    }

    /// Counts stress-free strains of a phase among the forces in play, with what they would call forth if they were
    /// held: where nothing holds them, only round-off is left of these forces.
    pub(super) fn count_swelling(&mut self) {
        let mut force = vec![0.0; self.displacement.len()];
        let [start, end] = &self.loading;
        let strains = start.strain.iter().zip(&end.strain);
        for (group, (start, end)) in self.groups.iter().zip(strains) {
            if group.is_active {
                let larger = |c: usize| start[c].abs().max(end[c].abs());
                group.add_held([0, 1, 2].map(larger), &mut force);
            }
        }
        self.largest_force = self.largest_force.max(norm(&force));
        for (largest, force) in self.largest_forces.iter_mut().zip(force) {
            *largest = largest.max(force.abs());
        }
    }

    /// Loads when the phase has changed its loads by this factor.
    pub(super) fn loading_at(&self, factor: f64) -> Loading {
        let [start, end] = &self.loading;
        if factor.to_bits() == 1.0_f64.to_bits() {
            end.clone()
        } else {
            start.towards(end, factor)
        }
    }

    /// Goes on to the next leg of a phase, if there is one.
    pub(super) fn next_leg(&mut self, number: usize, course: &mut PhaseCourse) -> bool {
        if leg(&self.problem.phases[number], course.leg + 1).is_none() {
            return false;
        }
        course.leg += 1;
        self.set_swelling(number, course.leg);
        let next = self.loads_on(number, course.leg, &course.prescribed);
        let last = std::mem::take(&mut course.loads);
        course.loads = Loads {
            out_of_balance: last.out_of_balance,
            scale: last.scale,
            largest: last.largest,
            carried: last.carried,
            ..next
        };
        // What the last steps did says nothing of a course that may have turned.
        course.history = super::History::default();
        true
    }

    /// Takes note of what acts within bodies at the phase's load factor.
    pub(super) fn note_bodies(&mut self, number: usize, course: &PhaseCourse) {
        let leg = leg(&self.problem.phases[number], course.leg);
        let [[t_0, f_0], [t_1, f_1]] = leg.unwrap_or([[0.0, 0.0], [1.0, 1.0]]);
        // What a phase activates comes in the course of its first leg.
        let from = if course.leg == 0 {
            self.loading[0].clone()
        } else {
            self.loading_at(f_0)
        };
        let to = self.loading_at(f_1);
        let share = (course.lambda - t_0) / (t_1 - t_0);
        self.acting = Acting::between(&self.problem, from, to, share);
    }

    /// Takes note of what a phase ends with.
    pub(super) fn keep_loads(&mut self, number: usize, course: &PhaseCourse) {
        let phase = &self.problem.phases[number];
        let factor = match (phase.course.last(), leg(phase, course.leg)) {
            (_, Some([[t_0, f_0], [t_1, f_1]])) if course.is_over => {
                f_0 + (course.lambda - t_0) / (t_1 - t_0) * (f_1 - f_0)
            }
            (Some(&[_, factor]), _) => factor,
            (None, _) => return,
        };
        for &(dof, start, end) in &course.prescribed {
            if let Some(value) = self.prescribed.get_mut(&dof) {
                *value = part(factor, start, end);
            }
        }
        self.loading[1] = self.loading_at(factor);
    }
}

/// A displacement after this part of its way. The end is exact to the last bit, whatever the
/// rounding of the difference, so that nodes led to one place move alike from there.
pub(super) fn part(factor: f64, start: f64, end: f64) -> f64 {
    if factor.to_bits() == 1.0_f64.to_bits() {
        end
    } else {
        start + factor * (end - start)
    }
}
