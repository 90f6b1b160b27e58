//! A phase: its equations, its loads, and what is out of balance as it begins.

use super::commit::among_both;
use super::history::History;
use super::state::PhaseCourse;
use super::{PhaseRecord, Simulation, UnderWay, Warning, Watch};
use crate::assembly::{Bodies, Places, System, fold};
use crate::element::Kinematics;
use crate::equilibrium::{
    Costs, Equations, Held, LinearDomain, Loads, Matrix, Newton, reference_of_round_off,
};
use crate::error::Error;
use crate::group::Group;
use crate::problem::Axis;
use crate::settings::{self, Method, Settings};
use algebra::{Block, LinearSolver, Singular};
use std::collections::HashSet;

/// The equations of one phase.
#[derive(Debug)]
pub(super) struct PhaseEquations {
    /// Unknowns of the groups that iterate.
    pub(super) system: System,
    pub(super) places: Places,
    /// The groups that do not.
    pub(super) domain: Option<LinearDomain>,
    pub(super) solver: LinearSolver,
    /// What the solver holds factorised.
    pub(super) matrix: Matrix,
    /// What the residual of the last step was measured against, by body, and its tolerance; nothing
    /// before the first step.
    pub(super) measured: Option<(Vec<f64>, f64)>,
    /// Forces out of balance at the start, relative to the forces in play: all, and without those that the phase
    /// releases.
    out_of_balance: [f64; 2],
    n_unknowns: usize,
    /// Factorisations and fallbacks in the phase that the solver does not count, modulo 2⁶⁴.
    counted: [u64; 2],
}

/// Smallest share of the forces in play that is reported where a phase starts out of balance; `summary.json` has all.
const NOTABLE: f64 = 1e-3;

impl PhaseEquations {
    fn n(&self) -> usize {
        self.n_unknowns
    }

    /// Factorisations and fallbacks since the equations were set up.
    fn counts(&self) -> [u64; 2] {
        let domain = self.domain.as_ref().is_some_and(|domain| domain.factorised);
        let factorisations = self.solver.factorisations + u64::from(domain);
        [factorisations, self.solver.fallbacks]
    }

    /// The equations for iterations.
    pub(super) fn iterated(&mut self) -> Equations<'_> {
        Equations {
            system: &self.system,
            places: &self.places,
            domain: self.domain.as_ref(),
            solver: &mut self.solver,
            matrix: &mut self.matrix,
        }
    }

    /// The record of the phase with all that has been counted.
    pub(super) fn counted_in(&self, record: &PhaseRecord) -> PhaseRecord {
        let [factorisations, fallbacks] = self.counts();
        PhaseRecord {
            factorisations: self.counted[0].wrapping_add(factorisations),
            fallbacks: self.counted[1].wrapping_add(fallbacks),
            ..record.clone()
        }
    }
}

/// Whether the first matrix of a phase is not the only one.
fn matrices_follow(system: &System, groups: &[Group], settings: &Settings) -> bool {
    !system.is_constant(groups) && settings.method != Method::InitialStress
}

impl Simulation {
    /// Begins the next phase: its laws, its loads, its equations.
    pub(super) fn begin_phase(&mut self, watch: &mut dyn Watch) -> Result<(), Error> {
        let number = self.done;
        let input = &self.problem.phases[number];
        let (name, increments) = (input.name.clone(), input.increments);
        watch.phase(&name, increments);
        let prescribed = self.start(number, watch)?;
        let offsets = self.offsets();
        let loads = self.loads_on(number, 0, &prescribed);
        self.set_swelling(number, 0);
        self.count_swelling();
        let (equations, loads) = self.equations_of(number, loads, None)?;
        let [imbalance, unasked] = equations.out_of_balance;
        let weight = crate::equilibrium::norm(&loads.force_start);
        let has_weight = self.loading[0]
            .unit_weight
            .iter()
            .flatten()
            .any(|weight| *weight > 0.0);
        if number == 0 && has_weight && weight > 0.0 {
            watch.at_rest(&name, imbalance * self.largest_force / weight);
        }
        if unasked > f64::max(NOTABLE, self.settings().force_tolerance) {
            watch.warning(&Warning::OutOfBalance(name.clone(), unasked));
        }
        let record = PhaseRecord {
            method: self.settings().method,
            ..PhaseRecord::new(&name, equations.n(), imbalance)
        };
        let course = PhaseCourse {
            loads,
            increment: 0,
            lambda: 0.0,
            step: 1.0 / increments as f64,
            history: History::default(),
            domain: None,
            has_matrix: false,
            largest: 0.0,
            record,
            leg: 0,
            prescribed,
            offsets,
            measured: None,
            taken_back: 0,
            is_over: false,
        };
        self.enter(number, equations, course, watch);
        self.look_at_start(watch);
        Ok(())
    }

    /// Difference between tied displacements and those that they follow: zero if they were always
    /// tied.
    fn offsets(&self) -> Vec<f64> {
        let offset = |tie: &crate::assembly::Tie| {
            if self.ties.contains(tie) {
                return 0.0;
            }
            let masters = tie.masters.iter();
            let followed: f64 = masters
                .map(|&(dof, weight)| weight * self.displacement[dof])
                .sum();
            self.displacement[tie.dof] - followed
        };
        self.tied.iter().map(offset).collect()
    }

    /// Takes up a phase where it stands.
    pub(super) fn resume_phase(&mut self, number: usize, course: PhaseCourse) -> Result<(), Error> {
        let loads = course.loads.clone();
        self.set_swelling(number, course.leg);
        let (equations, _) = self.equations_of(number, loads, Some(&course))?;
        self.enter(number, equations, course, &mut ());
        Ok(())
    }

    fn enter(
        &mut self,
        number: usize,
        equations: PhaseEquations,
        course: PhaseCourse,
        watch: &mut dyn Watch,
    ) {
        self.choose_tangents(watch);
        let phase = &self.problem.phases[number];
        let active = self.groups.iter().filter(|group| group.is_active);
        let mut dependent =
            active.filter_map(|group| Some((group, group.law.built.law.time_dependence()?)));
        if phase.time.is_none()
            && let Some((group, by)) = dependent.next()
        {
            watch.warning(&Warning::NoTime {
                phase: phase.name.clone(),
                law: group.law.name.clone(),
                by,
            });
        }
        self.done = number;
        self.under_way = Some(UnderWay {
            number,
            equations,
            record: course.record.clone(),
            course,
        });
    }

    /// Ends a phase, be it as it may.
    pub(super) fn end_phase(&mut self, phase: &UnderWay, watch: &mut dyn Watch) {
        self.tell_end(phase, watch);
        self.keep_loads(phase.number, &phase.course);
        let length = self.problem.phases[phase.number].length();
        self.time += if phase.course.is_over {
            for &(group, _) in &self.problem.phases[phase.number].drainage {
                self.groups[group].leave_excess(true);
            }
            phase.course.lambda * length
        } else {
            length
        };
        self.done = phase.number + 1;
        self.report_phase(phase, watch);
    }

    /// Says what there is to say of a phase that has ended, or that goes on later.
    pub(super) fn report_phase(&mut self, phase: &UnderWay, watch: &mut dyn Watch) {
        for group in &self.groups {
            for note in group.law.built.law.take_notes() {
                watch.warning(&Warning::Note(note));
            }
        }
        let UnderWay {
            equations, record, ..
        } = phase;
        if record.relaxed + record.regularised > 1 {
            watch.warning(&Warning::RelaxedOften {
                phase: record.name.clone(),
                relaxed: record.relaxed - record.viscous,
                viscous: record.viscous,
                regularised: record.regularised,
            });
        }
        if record.tolerated > 1 {
            watch.warning(&Warning::ToleratedOften {
                phase: record.name.clone(),
                steps: record.tolerated,
                largest: record.tolerated_residual,
                force: record.tolerated_force,
            });
        }
        if record.by_force > 0 {
            watch.warning(&Warning::ByForce {
                phase: record.name.clone(),
                steps: record.by_force,
                open: record.open,
            });
        }
        let of_domain = equations
            .domain
            .as_ref()
            .map_or(0.0, |d| d.standing().round_off);
        let left = of_domain.max(record.round_off);
        let tolerance = self.problem.settings.force_tolerance;
        if left > tolerance {
            watch.warning(&Warning::RoundOff {
                phase: record.name.clone(),
                asked: tolerance,
                left,
            });
        }
        if record.unsettled > 0.0 {
            watch.warning(&Warning::Unsettled {
                phase: record.name.clone(),
                asked: self.problem.settings.displacement_tolerance,
                left: record.unsettled,
            });
        }
        let (mesh, analysis) = (&self.problem.mesh, self.problem.analysis);
        self.beyond
            .look(mesh, analysis, &self.groups, &self.displacement);
        watch.phase_ends(equations.counted_in(record));
    }

    fn equations_of(
        &mut self,
        number: usize,
        loads: Loads,
        course: Option<&PhaseCourse>,
    ) -> Result<(PhaseEquations, Loads), Error> {
        let mut is_prescribed = vec![false; self.displacement.len()];
        for &(dof, ..) in &loads.prescribed {
            is_prescribed[dof] = true;
        }
        self.equations(number, &is_prescribed, loads, course)
            .map_err(|Singular| Error::Singular {
                phase: self.problem.phases[number].name.clone(),
            })
    }

    /// Degrees of freedom of a line's nodes.
    pub(super) fn dofs(&self, line: &str, components: &[Axis]) -> Vec<usize> {
        let nodes = self
            .problem
            .mesh
            .lines
            .get(line)
            .map_or(&[][..], |line| &line.nodes);
        let offset = |axis: &Axis| usize::from(*axis == Axis::Y);
        nodes
            .iter()
            .flat_map(|&n| components.iter().map(move |c| 2 * n + offset(c)))
            .collect()
    }

    /// The equations of a phase, at its start or where it stands; the loads with what is out of
    /// balance at its start.
    fn equations(
        &mut self,
        number: usize,
        is_prescribed: &[bool],
        mut loads: Loads,
        course: Option<&PhaseCourse>,
    ) -> Result<(PhaseEquations, Loads), Singular> {
        let condensed = self.condensed(number, is_prescribed);
        self.reuse.forget();
        let (system, mut domain, solver) = self.unknowns(condensed, is_prescribed)?;
        // A matrix and the one before it.
        let matrices = 2 * size_of::<f64>() * system.pattern.rows.len();
        let bytes = solver.bytes() + system.bytes_of_elements(&self.groups) + matrices as u64;
        self.reuse.announce(bytes, "factorising the equations");
        let of_domain = domain.iter().flat_map(LinearDomain::unknowns);
        let unknowns = among_both(system.free(), of_domain, system.n_dofs());
        let standing = course.and_then(|course| course.domain.as_ref());
        let begins = domain.as_ref().filter(|_| standing.is_none());
        let internal = begins.map(|domain| domain.internal_forces(&self.groups));
        let out_of_balance = if let Some(course) = course {
            [course.record.out_of_balance; 2]
        } else {
            let beside = domain.as_ref().zip(internal.as_deref());
            self.out_of_balance(number, &unknowns, beside, &mut loads)
        };
        if course.is_none()
            && self.problem.settings.tolerance_of == settings::ToleranceOf::ActiveLoad
        {
            loads.carried = system.carried(&self.groups);
        }
        let tolerance = self.problem.settings.force_tolerance;
        if let Some(domain) = &mut domain {
            if let Some(standing) = standing {
                domain.restart(&self.groups, &loads, standing, tolerance);
            } else if let Some(internal) = internal {
                let displacement = &self.displacement;
                domain.start(&self.groups, internal, &loads, displacement, tolerance);
            }
        }
        let bodies = Bodies::new(
            &self.groups,
            &self.tied,
            &self.problem.mesh.nodes,
            is_prescribed,
        );
        let mut equations = PhaseEquations {
            places: Places::new(&system, is_prescribed).of(&bodies, &system),
            system,
            domain,
            solver,
            matrix: Matrix::resumed(course.map_or(0.0, |course| course.largest))
                .announcing(self.reuse.announces),
            measured: None,
            out_of_balance,
            n_unknowns: unknowns.len(),
            counted: [0; 2],
        };
        if let Some(course) = course {
            if course.has_matrix {
                let settings = self.settings();
                let (groups, mut costs) = (&mut self.groups, Costs::default());
                let mut newton = Newton::new(equations.iterated(), groups, &settings, &mut costs);
                newton.restore_matrix().map_err(|_| Singular)?;
            }
            // What was counted before counts on, without what it took to get here again.
            let [factorisations, fallbacks] = equations.counts();
            equations.counted = [
                course.record.factorisations.wrapping_sub(factorisations),
                course.record.fallbacks.wrapping_sub(fallbacks),
            ];
        }
        Ok((equations, loads))
    }

    /// The linear part of a phase and the equations of the rest, if it is to be condensed. Preferred are the groups
    /// that stay linear in the phases to come, which then need no other factors; if that does not pay, those that are
    /// linear now.
    fn condensed(
        &mut self,
        number: usize,
        is_prescribed: &[bool],
    ) -> Option<(LinearDomain, System)> {
        self.reuse.is_last_phase = number + 1 == self.problem.phases.len();
        let wanted = self.problem.settings.equations;
        if wanted == settings::Equations::Sparse {
            return None;
        }
        // Groups that are held by the others alone cannot be condensed.
        let always = wanted == settings::Equations::Condensed;
        let (groups, ties, lines) = (&self.groups, &self.tied, &self.lines);
        let held = Held {
            now: is_prescribed,
            sometimes: &self.sometimes_held,
        };
        let linear: Vec<bool> = groups.iter().map(Group::is_linear).collect();
        let mut lasting = linear.clone();
        for (group, law) in self.swaps.iter().skip(number + 1).flatten() {
            lasting[*group] &= groups[*group].is_linear_with(law);
        }
        if lasting != linear {
            let (of, reuse) = (
                (groups.as_slice(), lasting.as_slice()),
                Some(&mut self.reuse),
            );
            let found = LinearDomain::new(of, &held, ties, lines, false, reuse);
            if let Ok(Some(found)) = found {
                return Some(found);
            }
        }
        let (of, reuse) = (
            (groups.as_slice(), linear.as_slice()),
            Some(&mut self.reuse),
        );
        LinearDomain::new(of, &held, ties, lines, always, reuse).unwrap_or(None)
    }

    /// Unknowns with their solver, of what is not condensed or of all.
    fn unknowns(
        &self,
        condensed: Option<(LinearDomain, System)>,
        is_prescribed: &[bool],
    ) -> Result<(System, Option<LinearDomain>, LinearSolver), Singular> {
        let solver = self.solver();
        if let Some((domain, system)) = condensed {
            let solver = solver(&system, Some(domain.block(&system)))?;
            return Ok((system, Some(domain), solver));
        }
        let (groups, ties) = (&self.groups, &self.tied);
        let takes_part = |_: usize, group: &Group| group.is_active;
        let of_all = |system: &System| solver(system, None);
        let (system, solver) =
            System::new_with(groups, takes_part, is_prescribed, ties, None, of_all);
        Ok((system, None, solver?))
    }

    /// Makes a solver for equations, with the block of a condensed domain if there is one.
    fn solver(
        &self,
    ) -> impl Fn(&System, Option<Block>) -> Result<LinearSolver, Singular> + Sync + use<'_> {
        let mut active = self.groups.iter().filter(|group| group.is_active);
        let is_symmetric = active.all(|group| group.is_linear() && group.is_symmetric());
        let (lines, groups, settings) = (&self.lines, &self.groups, self.settings());
        move |system, block| {
            let (pattern, lines) = (&system.pattern, system.lines(lines));
            let mut solver = match block {
                Some(block) => LinearSolver::with_block(pattern, Some(&lines), block),
                None => LinearSolver::new(pattern, is_symmetric, Some(&lines)),
            }?;
            if matrices_follow(system, groups, &settings) {
                solver.expect_others();
            }
            Ok(solver)
        }
    }

    /// Internal less external forces at the start of a phase where nothing holds them (after a
    /// swap of laws, a support given up, an initial stress, ground removed). Returns their size, relative to
    /// the forces in play, without what ground that is removed carried; and the same without what `free` gives up.
    /// Internal forces of a domain `beside` the equations are known.
    fn out_of_balance(
        &mut self,
        number: usize,
        unknowns: &[usize],
        beside: Option<(&LinearDomain, &[f64])>,
        loads: &mut Loads,
    ) -> [f64; 2] {
        let n_dofs = self.displacement.len();
        let mut internal = match beside {
            Some((_, of_domain)) => of_domain.to_vec(),
            None => vec![0.0; n_dofs],
        };
        for (number, group) in self.groups.iter().enumerate() {
            let is_known = beside.is_some_and(|(domain, _)| domain.includes(number));
            if group.is_active && !is_known {
                group.kinematics.add_forces(&group.carried(), &mut internal);
            }
        }
        fold(&self.tied, &mut internal);
        let mut released = self.released.clone();
        fold(&self.tied, &mut released);
        loads.out_of_balance = vec![0.0; n_dofs];
        let free = self.problem.phases[number].free.iter();
        let free: HashSet<usize> = free
            .flat_map(|free| self.dofs(&free.line, &free.components))
            .collect();
        let (mut rest, mut against_end, mut play) = ([0.0; 2], [0.0; 2], 0.0);
        for &dof in unknowns {
            let difference = internal[dof] - loads.force_start[dof];
            loads.out_of_balance[dof] = difference;
            let unasked = f64::from(!free.contains(&dof));
            for (sum, weight) in [1.0, unasked].into_iter().enumerate() {
                rest[sum] += weight * (difference + released[dof]).powi(2);
                against_end[sum] += weight * (internal[dof] - loads.force_end[dof]).powi(2);
            }
        }
        for (internal, external) in internal.iter().zip(&loads.force_start) {
            play += f64::max(internal * internal, external * external);
        }
        // Where nothing is left of earlier forces, what remains of them is round-off.
        let tolerance = self.problem.settings.force_tolerance;
        let left_of = |earlier: f64| reference_of_round_off(earlier, tolerance);
        let now = f64::sqrt(play);
        loads.scale = now.max(left_of(self.largest_force));
        let both = internal.iter().zip(&loads.force_start);
        let now_by_dof = both.map(|(internal, external)| internal.abs().max(external.abs()));
        let now_by_dof: Vec<f64> = now_by_dof.collect();
        let earlier = now_by_dof.iter().zip(&self.largest_forces);
        loads.largest = earlier
            .map(|(now, &earlier)| now.max(left_of(earlier)))
            .collect();
        self.largest_force = self.largest_force.max(now);
        for (largest, now) in self.largest_forces.iter_mut().zip(now_by_dof) {
            *largest = largest.max(now);
        }
        // An initial stress that the loads of its own phase balance is in balance.
        let share = |sum: usize| f64::sqrt(rest[sum].min(against_end[sum])) / self.largest_force;
        if play > 0.0 {
            [share(0), share(1)]
        } else {
            [0.0; 2]
        }
    }
}

/// Elements that mostly show what is true of all.
const FEW: usize = 16;

/// Whether a rotation of all nodes about one of them is no strain in a group's elements.
pub(super) fn turns_freely(group: &Group, nodes: &[[f64; 2]]) -> bool {
    let first: Vec<usize> = (0..group.kinematics.n_elements().min(FEW)).collect();
    let first = group.kinematics.only(&first);
    first.is_none_or(|first| turn_freely(first.as_ref(), nodes))
        && turn_freely(group.kinematics.as_ref(), nodes)
}

fn turn_freely(elements: &dyn Kinematics, nodes: &[[f64; 2]]) -> bool {
    let Some(&[x, y]) = nodes.first() else {
        return true;
    };
    let gradients = |turn: [f64; 4]| {
        let moved = |node: &[f64; 2]| {
            let (x, y) = (node[0] - x, node[1] - y);
            [turn[0] * x + turn[1] * y, turn[2] * x + turn[3] * y]
        };
        let displacement: Vec<f64> = nodes.iter().flat_map(moved).collect();
        let mut strains = vec![0.0; elements.n_components() * elements.n_points()];
        elements.add_gradients(&displacement, &mut strains);
        strains
            .iter()
            .fold(0.0, |largest: f64, e| largest.max(e.abs()))
    };
    // A shear of the same displacements for comparison.
    let (turned, sheared) = (
        gradients([0.0, -1.0, 1.0, 0.0]),
        gradients([0.0, 1.0, 1.0, 0.0]),
    );
    turned <= 1e-6 * sheared.max(1.0)
}
