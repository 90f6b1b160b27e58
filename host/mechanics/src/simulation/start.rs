//! The start of a phase: laws are swapped, their answer to the stresses they find is taken over, and loads are set.

use super::loads::Prescribed;
use super::{Simulation, Warning, Watch};
use crate::check::{Cause, Item, Key, Refusal};
use crate::element::Axes;
use crate::equilibrium::StepFailure;
use crate::error::{Error, Place};
use crate::ground::beside_joints;
use crate::group::{Group, PointFailure};
use crate::mesh::Solid;
use crate::model::Model;
use crate::problem::{Formulation, InitialStress};
use abi::status::Outcome;
use law::Moment;

/// A point of an interface is moved by this fraction of the way to the middle of the adjacent element. So where it
/// reaches the surface of the ground, rounding does not decide whether it is compressed.
const INSIDE: f64 = 1e-11;
/// Change of stress, relative to the largest of its group and of all groups, that is reported.
const WORTH_A_WORD: f64 = 1e-6;
/// The same for earth pressure at rest: above the law's tolerance, so that it means its strength.
const OUTSIDE: f64 = 1e-3;

fn cannot_start(failure: PointFailure) -> Error {
    Error::CannotStart(Box::new(failure))
}

impl Simulation {
    /// Starts a phase: what is there, its laws and its loads. Returns its prescribed displacements.
    pub(super) fn start(
        &mut self,
        number: usize,
        watch: &mut dyn Watch,
    ) -> Result<Vec<Prescribed>, Error> {
        let phase = self.problem.phases[number].clone();
        let mut starts = vec![number == 0; self.groups.len()];
        let moment = self.moment(number, 1);
        let mut start = self.loading[1].clone();
        // Water between faces that were closed had its pressure before.
        for &group in &phase.activate {
            start.active[group] |= self.groups[group].formulation == Formulation::ZeroThickness;
        }
        if !phase.activate.is_empty() {
            // Faces that were one part: each has its own share of what acts on them.
            self.force = start.forces(&self.problem, &self.groups);
        }
        self.loading = [start.clone(), start.changed_by(&phase)];
        let activated = phase.activate.iter();
        let beside: Vec<_> = activated.map(|&group| self.stress_beside(group)).collect();
        self.released.fill(0.0);
        for &group in &phase.deactivate {
            let gone = &self.groups[group];
            gone.kinematics
                .add_forces(&gone.carried(), &mut self.released);
            self.groups[group].disappear();
        }
        for (group, law) in self.swaps[number].clone() {
            starts[group] = true;
            self.groups[group].moment = moment;
            if let Some(parted) = self.groups[group].set_law(law).map_err(cannot_start)? {
                watch.warning(&Warning::GroupSplit(phase.name.clone(), parted));
            }
        }
        for (&group, [stress, lost]) in phase.activate.iter().zip(beside) {
            starts[group] = true;
            self.groups[group].moment = moment;
            self.groups[group].appear(stress).map_err(cannot_start)?;
            self.groups[group].correct(lost);
        }
        self.add_lacking(number, &phase.activate)?;
        Model::check_layers(&self.groups)?;
        for group in (0..self.groups.len()).filter(|&group| starts[group]) {
            self.groups[group].moment = moment;
            if self.groups[group].is_active {
                self.ask_law(group, number, watch)?;
            }
        }
        self.set_drainages(number, &starts, moment)?;
        let prescribed = self.take_loads(number, watch)?;
        // The equations of the phase are set up in the room of trial states.
        self.groups.iter_mut().for_each(Group::forget_trial);
        Ok(prescribed)
    }

    /// Sets the drainage of groups that a phase names, and of those whose law starts. The stiffness of the pore water
    /// follows from that of the law.
    fn set_drainages(
        &mut self,
        number: usize,
        starts: &[bool],
        moment: Moment,
    ) -> Result<(), Error> {
        let changed = &self.problem.phases[number].drainage;
        for (of, group) in self.groups.iter_mut().enumerate() {
            let is_changed = changed.iter().any(|(group, _)| *group == of);
            if !(group.is_active && (is_changed || starts[of])) {
                continue;
            }
            group.moment = moment;
            if is_changed {
                group.leave_excess(false);
            }
            let own = &self.problem.groups[of];
            let drainage = self.problem.drainage(of, number);
            let set = group.set_drainage(drainage, own.undrained_poisson_ratio);
            let set = set.map_err(|failure| Error::CannotStart(Box::new(failure)))?;
            if let Err(ratio) = set {
                let cause = Cause::NoPoreStiffness {
                    group: own.name.clone(),
                    undrained: own.undrained_poisson_ratio,
                    drained: ratio,
                };
                let item = Item::GroupKey(of, Key::UndrainedPoissonRatio);
                return Err(Refusal::new(item, cause).into());
            }
        }
        Ok(())
    }

    /// Adds to the stress of interfaces that appear what the forces on the faces lack.
    fn add_lacking(&mut self, number: usize, activated: &[usize]) -> Result<(), Error> {
        let is_interface =
            |&group: &usize| self.groups[group].formulation == Formulation::ZeroThickness;
        let appeared: Vec<usize> = activated.iter().copied().filter(is_interface).collect();
        if number == 0 || appeared.is_empty() {
            return Ok(());
        }
        let lacking = self.lacking(number, &appeared)?;
        for (&group, lacking) in appeared.iter().zip(lacking) {
            let beside = self.groups[group].stress.committed.clone();
            let both = beside.iter().zip(lacking);
            let stress = both.map(|(beside, lacking)| beside + lacking).collect();
            // Some laws start from compression only: then the means are nearer to what they can carry.
            if self.groups[group].appear(stress).is_err() {
                self.groups[group].appear(beside).map_err(cannot_start)?;
            }
        }
        Ok(())
    }

    /// Stress with which a group appears: none in solids; in interfaces that computed next to them, in
    /// axes of the elements, and what exact integration adds to it. Water between the faces carries its own pressure.
    fn stress_beside(&self, number: usize) -> [Vec<f64>; 2] {
        let group = &self.groups[number];
        let kinematics = &group.kinematics;
        let n = kinematics.n_points();
        if kinematics.n_components() == 4 {
            return [vec![0.0; 4 * n], Vec::new()];
        }
        let solids = &self.problem.mesh.solids;
        // Number of each solid within its group.
        let mut counts = vec![0; self.groups.len()];
        let number_within = |solid: &Solid| {
            counts[solid.group] += 1;
            counts[solid.group] - 1
        };
        let within: Vec<usize> = solids.iter().map(number_within).collect();
        let beside = beside_joints(&self.problem.mesh);
        let water = self.loading[0].water(&self.problem);
        let traction = |element: usize, at: [f64; 2], axes: &Axes| {
            let nodes = kinematics.nodes(element);
            let pressure = water.as_ref().map_or(0.0, |water| water.pressure(at));
            let of_side = |face: usize| {
                let solid = *beside.get(&face)?;
                let group = solids[solid].group;
                if !self.groups[group].is_active {
                    return None;
                }
                let inside = self.problem.mesh.towards_middle(&solids[solid], at, INSIDE);
                let mut total = self.groups[group].carried_at(within[solid], inside);
                if self.problem.groups[group].pore_water {
                    (0..3).for_each(|component| total[component] -= pressure);
                }
                Some(total)
            };
            let faces = [nodes[2], nodes[5]].into_iter();
            let sides: Vec<[f64; 4]> = faces.filter_map(of_side).collect();
            let share = 1.0 / sides.len().max(1) as f64;
            let mean =
                std::array::from_fn(|c| share * sides.iter().map(|side| side[c]).sum::<f64>());
            let [_, mut normal, _, shear] = axes.stress_from_global(mean);
            if self.problem.groups[number].pore_water && !sides.is_empty() {
                normal += pressure;
            }
            [normal, shear]
        };
        let at_point = |point: usize| {
            let (element, _) = kinematics.place_of(point);
            let (at, axes) = (kinematics.position(point), kinematics.axes_at(point));
            traction(element, at, &axes)
        };
        let stress: Vec<f64> = (0..n).flat_map(at_point).collect();
        let lost = group.lost(&stress, traction);
        [stress, lost]
    }

    /// The largest component of all stresses.
    fn largest_stress(&self) -> f64 {
        let active = self.groups.iter().filter(|group| group.is_active);
        let stresses = active.flat_map(|group| &group.stress.committed);
        stresses.fold(0.0, |most, stress| most.max(stress.abs()))
    }

    /// Takes over what the law of a group, which starts now, makes of the stresses it finds, and
    /// says how much that is. Its forces out of balance are carried over the phase.
    ///
    /// A law that cannot be led through a nil increment is left as it is: it returns the stresses
    /// at the first increment.
    fn ask_law(&mut self, group: usize, number: usize, watch: &mut dyn Watch) -> Result<(), Error> {
        let phase = &self.problem.phases[number];
        let name = phase.name.clone();
        // What a group that carries nothing has beside others that do is round-off.
        let worth = WORTH_A_WORD * self.largest_stress();
        match self.groups[group].take_over() {
            Ok(Some(change)) if change.change > worth => {
                let own = &self.problem.groups[group];
                if let Some(InitialStress::AtRest(at_rest)) = &own.initial_stress
                    && number == 0
                    && change.relative > OUTSIDE
                {
                    let cause = Cause::AtRestOutsideStrength {
                        group: change.group,
                        material: change.law,
                        at: change.position,
                        stress: change.stress[0].map(|stress| -stress),
                        returned: change.stress[1].map(|stress| -stress),
                        unloading: at_rest.ratio.beyond_passive(change.position[1]),
                    };
                    let item = Item::GroupKey(group, Key::InitialStress);
                    return Err(Refusal::new(item, cause).into());
                }
                if change.relative > WORTH_A_WORD {
                    watch.warning(&Warning::TookOver(name, change));
                }
                Ok(())
            }
            Ok(_) => Ok(()),
            Err(point) => {
                let is_given = !self.groups[group].law.initial.is_empty();
                if is_given && point.failure.outcome == Outcome::Domain {
                    return Err(Error::CannotStart(Box::new(point)));
                }
                let failure = StepFailure::from(point);
                if let Some(defect) = failure.defect() {
                    return Err(Error::Law {
                        place: Place {
                            phase: name,
                            increment: 1,
                        },
                        failure: Box::new(defect.clone()),
                        however_small: false,
                    });
                }
                watch.warning(&Warning::Unasked(name, failure.reason.to_string()));
                Ok(())
            }
        }
    }
}
