//! References of a step: the forces and displacements that an iterate is measured against.
//!
//! They are computed on demand. In ordinary steps the loads or the last equilibrium already exceed a tenth of the
//! forces in play, and nothing more is computed. In other steps (a start without stress, a load that grows tenfold) the
//! elastic response is computed once. It uses the factors of the iterations if these are elastic, else separate
//! equations, so that the matrix stays unchanged.

use super::acceptance::{Change, Forces, MOVES};
use super::failure::{Runaway, Singularity};
use super::residual::Task;
use super::{Equations, Newton, norm};
use crate::assembly::norms;
use crate::group::Group;
use algebra::{LastMatrix, LinearSolver, Singular};
use law::Operator;
use std::collections::BTreeSet;

/// Most bytes of a factorisation beside that of the iterations.
const MOST_BESIDE: u64 = 1 << 26;

/// The equations that the tangents at the start of a step are factorised in.
enum AtStart {
    /// Those of the iterations, which hold this matrix.
    Held,
    /// Those of the iterations, in place of this matrix.
    Instead(LastMatrix),
    /// Separate ones, so that the matrix of the iterations stays.
    Beside(Box<LinearSolver>),
}

/// References of the present step, and how its last iterate compares with them; by body.
#[derive(Debug, Default)]
pub(in crate::equilibrium) struct Reference {
    /// Largest of the forces at the start of the phase.
    pub(super) at_start: Vec<f64>,
    /// Sizes of the last correction.
    pub(super) changes: Vec<Change>,
    /// What ran away in the last evaluation.
    pub(super) runaway: Option<Runaway>,
    /// Numbers of interfaces of which a point opened in an iterate.
    pub(super) opened: BTreeSet<usize>,
    /// Sizes of the displacement increments that the iterations start from; empty before.
    predicted: Vec<f64>,
    /// They come from the tangent at the start, which may have next to no stiffness.
    from_tangent: bool,
    /// Internal forces of the last equilibrium.
    last: Option<Vec<f64>>,
    /// The elastic answer; `Some(None)` if absent.
    #[expect(clippy::option_option, reason = "not asked for, or asked for in vain")]
    elastic: Option<Option<Elastic>>,
}

/// The elastic answer to a step, by body.
#[derive(Debug)]
struct Elastic {
    /// Its forces.
    forces: Vec<f64>,
    /// Sizes of the displacement increments.
    moves: Vec<f64>,
}

impl Reference {
    /// Nothing but the loads at the start of a step.
    pub(super) fn at_start(at_start: Vec<f64>) -> Self {
        Self {
            at_start,
            ..Self::default()
        }
    }

    /// Size of the displacement increments of a body that can be expected; 0: not known.
    fn expected(&self, body: usize) -> f64 {
        let predicted = self.predicted.get(body).copied().unwrap_or(0.0);
        match &self.elastic {
            Some(Some(elastic)) if self.from_tangent => elastic.moves[body],
            Some(Some(elastic)) => elastic.moves[body].max(predicted),
            _ => predicted,
        }
    }
}

impl Newton<'_> {
    /// 2-norms by body of a vector by place.
    pub(super) fn by_body(&self, by_place: &[f64]) -> Vec<f64> {
        let bodies = &self.equations.places.bodies;
        norms(&bodies.of_place, bodies.n, by_place)
    }

    /// Norms of internal forces, by body: `internal` by place, from these stresses by group. At a shared place each
    /// body gets the forces of its elements only.
    pub(super) fn forces_by_body(
        &mut self,
        internal: &[f64],
        stress: &dyn Fn(&Group, usize) -> Vec<f64>,
    ) -> Vec<f64> {
        let mut sizes = self.by_body(internal);
        if self.equations.places.bodies.shared.is_empty() {
            return sizes;
        }
        for (body, size) in sizes.iter_mut().enumerate() {
            for (number, group) in self.groups.iter().enumerate() {
                if !self.equations.system.includes(number) {
                    continue;
                }
                let n = group.kinematics.n_components();
                let mut own = stress(group, number);
                let of_element = &self.equations.places.bodies.of_element[number];
                for (element, &of) in of_element.iter().enumerate() {
                    if of as usize != body {
                        let points = group.kinematics.points_of(element);
                        own[points.start * n..points.end * n].fill(0.0);
                    }
                }
                group.kinematics.add_forces(&own, &mut self.room.force);
            }
            let mut forces = self.equations.places.take(&mut self.room.force);
            self.equations.places.fold(&mut forces);
            let shared = self
                .equations
                .places
                .bodies
                .shared
                .iter()
                .map(|&place| forces[place]);
            *size = shared.fold(*size, f64::hypot);
        }
        sizes
    }

    /// Takes note of where the iterations start.
    pub(in crate::equilibrium) fn starts_from(&mut self, increment: &[f64], from_tangent: bool) {
        self.reference.predicted = self.by_body(increment);
        self.reference.from_tangent = from_tangent;
    }

    /// Largest displacement increment of every body, and where it is.
    fn largest_moves(&self, increment: &[f64]) -> Vec<(f64, usize)> {
        let bodies = &self.equations.places.bodies;
        let mut largest = vec![(0.0, 0); bodies.n];
        for (place, value) in increment.iter().enumerate() {
            let body = bodies.of_place.get(place).map_or(0, |&body| body as usize);
            if let Some(largest) = largest.get_mut(body)
                && value.abs() > largest.0
            {
                *largest = (value.abs(), place);
            }
        }
        largest
    }

    /// For every body, whether it has moved by more than its own size and far beyond what can be
    /// expected.
    pub(super) fn away(&mut self, increment: &[f64], task: &Task) -> Vec<bool> {
        self.reference.runaway = None;
        let n = self.equations.places.bodies.n;
        // What is linear cannot run away.
        if self.reference.predicted.is_empty() || self.equations.matrix.is_constant {
            return vec![false; n];
        }
        let sizes = self.by_body(increment);
        let largest = self.largest_moves(increment);
        let extents = &self.equations.places.bodies.extents;
        let leaves =
            |body: usize| largest[body].0 > extents.get(body).copied().unwrap_or(f64::INFINITY);
        let exceeds = |given: &Reference, body: usize| {
            let expected = given.expected(body);
            expected > 0.0 && sizes[body] > MOVES * expected
        };
        let is_odd =
            |body| exceeds(&self.reference, body) || (self.reference.from_tangent && leaves(body));
        if self.reference.elastic.is_none() && (0..n).any(is_odd) {
            self.reference.elastic = Some(self.elastic_answer(task));
        }
        let away: Vec<bool> = (0..n)
            .map(|body| leaves(body) && exceeds(&self.reference, body))
            .collect();
        let farthest = (0..n)
            .filter(|&body| away[body])
            .max_by(|&a, &b| largest[a].0.total_cmp(&largest[b].0));
        self.reference.runaway = farthest.map(|body| {
            let place = largest[body].1;
            Runaway {
                dof: self.equations.places.dof(place),
                increment: increment[place],
            }
        });
        away
    }

    /// How large a correction is in every body.
    pub(super) fn changes(&self, correction: &[f64], moved: &[f64]) -> Vec<Change> {
        let sizes = self.by_body(correction);
        let moved = self.by_body(moved);
        let both = sizes.iter().zip(moved).enumerate();
        both.map(|(body, (&size, moved))| Change::of(size, moved, self.reference.expected(body)))
            .collect()
    }

    /// How large a correction is, all bodies together, relative to the increment as far as that may measure it.
    pub(in crate::equilibrium) fn relative(&self, correction: &[f64], moved: &[f64]) -> f64 {
        let bodies = self.by_body(correction).len();
        let predicted: Vec<f64> = (0..bodies)
            .map(|body| self.reference.expected(body))
            .collect();
        Change::of(norm(correction), norm(moved), norm(&predicted)).relative
    }

    /// Reference of the residual, by body, under these internal forces. The trial state
    /// may be another one afterwards: says whether.
    pub(super) fn scales(
        &mut self,
        in_play: &[f64],
        floors: &[f64],
        task: &Task,
    ) -> (Vec<f64>, bool) {
        let n = in_play.len();
        let mut forces: Vec<Forces> = (0..n)
            .map(|body| Forces {
                in_play: in_play[body],
                imposed: task.imposed[body],
                last: 0.0,
                elastic: Some(0.0),
                floor: floors[body],
            })
            .collect();
        let is_capped = |forces: &[Forces]| forces.iter().any(|f| f.scale() < f.in_play);
        let mut has_moved = false;
        if self.equations.matrix.is_constant {
            for (forces, in_play) in forces.iter_mut().zip(in_play) {
                forces.last = *in_play;
            }
        }
        if is_capped(&forces) {
            let last = self.last_forces();
            for (forces, last) in forces.iter_mut().zip(last) {
                forces.last = last;
            }
        }
        if is_capped(&forces) {
            if self.reference.elastic.is_none() {
                self.reference.elastic = Some(self.elastic_answer(task));
                has_moved = true;
            }
            let elastic = self.reference.elastic.as_ref().and_then(Option::as_ref);
            for (body, forces) in forces.iter_mut().enumerate() {
                forces.elastic = elastic.map(|elastic| elastic.forces[body]);
            }
        }
        (
            forces.iter().map(|forces| forces.scale()).collect(),
            has_moved,
        )
    }

    /// Internal forces of the last equilibrium, by body.
    fn last_forces(&mut self) -> Vec<f64> {
        if let Some(last) = &self.reference.last {
            return last.clone();
        }
        let carried = self.equations.system.carried(self.groups);
        let mut internal = self.equations.places.gather(&carried);
        self.equations.places.fold(&mut internal);
        let committed = |group: &Group, _: usize| group.carried().into_owned();
        let last = self.forces_by_body(&internal, &committed);
        self.reference.last = Some(last.clone());
        last
    }

    /// Answers the step elastically, or with the tangents at its start if a law knows no elastic
    /// ones. The groups' tangents stay; their trial state does not.
    fn elastic_answer(&mut self, task: &Task) -> Option<Elastic> {
        // Nor is what measures the iterations counted among them.
        let kept = |group: &Group| (group.tangents().to_vec(), group.law_calls.clone());
        let kept: Vec<_> = self.groups.iter().map(kept).collect();
        let mut answer = self.answer(Operator::Elastic, task);
        if answer.is_none() {
            answer = self.answer(Operator::Consistent, task);
        }
        for (group, (tangents, calls)) in self.groups.iter_mut().zip(kept) {
            group.put_tangents(tangents);
            group.law_calls = calls;
        }
        answer
    }

    fn answer(&mut self, operator: Operator, task: &Task) -> Option<Elastic> {
        let (by, mut internal) = self.factorise_at_start(operator, task.period).ok()?;
        if self.equations.domain.is_some() {
            for (&place, force) in self
                .equations
                .places
                .boundary
                .iter()
                .zip(&self.start.domain_forces)
            {
                internal[place] += force;
            }
        }
        let mut coupling = vec![0.0; self.equations.places.free.len()];
        self.equations
            .places
            .scatter(&task.prescribed, &mut self.room.displacement);
        self.equations.system.prescribed_forces(
            self.groups,
            &self.room.displacement,
            &mut coupling,
        );
        let free = self.equations.places.free.iter().zip(&coupling);
        let right: Vec<f64> = free
            .map(|(&place, coupling)| task.external[place] - internal[place] - coupling)
            .collect();
        let solution = self.solve_at_start(by, &right).ok()?;
        let mut increment = task.prescribed.clone();
        for (&place, value) in self.equations.places.free.iter().zip(solution) {
            increment[place] = value;
        }
        self.equations.places.follow(&mut increment);
        self.equations
            .places
            .scatter(&increment, &mut self.room.displacement);
        let groups = self.groups.iter();
        let stresses: Vec<Vec<f64>> = groups
            .map(|group| group.linear_change(&self.room.displacement))
            .collect();
        for (number, (group, stress)) in self.groups.iter().zip(&stresses).enumerate() {
            if self.equations.system.includes(number) {
                group.kinematics.add_forces(stress, &mut self.room.force);
            }
        }
        let mut forces = self.equations.places.take(&mut self.room.force);
        self.equations.places.fold(&mut forces);
        Some(Elastic {
            forces: self.forces_by_body(&forces, &|_, number| stresses[number].clone()),
            moves: self.by_body(&increment),
        })
    }

    /// Factorises the tangents at the start of a step: by which equations, and the internal forces there.
    fn factorise_at_start(
        &mut self,
        operator: Operator,
        period: (f64, f64),
    ) -> Result<(AtStart, Vec<f64>), Singularity> {
        self.room.displacement.fill(0.0);
        let outcome = self.evaluate_groups(period, operator);
        let mut internal = self.equations.places.take(&mut self.room.force);
        outcome.map_err(|_| Singularity::Unknown)?;
        self.equations.places.fold(&mut internal);
        let Equations {
            system,
            solver,
            matrix,
            ..
        } = &mut self.equations;
        if matrix.is_of_tangents(system, self.groups) {
            return Ok((AtStart::Held, internal));
        }
        let is_large = solver.bytes() > MOST_BESIDE;
        let mut values = solver.room();
        system.assemble(self.groups, &mut values);
        if let Some(last) = is_large.then(|| solver.set_aside()).flatten() {
            if solver.factorise(values).is_err() {
                matrix.restore(solver, Some(last), matrix.held);
                return Err(Singularity::Free);
            }
            return Ok((AtStart::Instead(last), internal));
        }
        let mut beside = if let Some(solver) = matrix.beside.take() {
            solver
        } else {
            let other = solver.another().map_err(|_| Singularity::Free)?;
            matrix.announce_beside(other.bytes());
            other
        };
        let outcome = beside.factorise(values);
        outcome.map_err(|_| Singularity::Free)?;
        Ok((AtStart::Beside(Box::new(beside)), internal))
    }

    /// Solves with the equations that [`Self::factorise_at_start`] gave. Keeps separate equations for the next time.
    /// If the equations of the iterations need full row exchanges for it, they keep them from then on.
    fn solve_at_start(&mut self, by: AtStart, right: &[f64]) -> Result<Vec<f64>, Singular> {
        let Equations { solver, matrix, .. } = &mut self.equations;
        match by {
            AtStart::Held => solver.solve(right),
            AtStart::Instead(last) => {
                let solution = solver.solve(right);
                matrix.restore(solver, Some(last), matrix.held);
                solution
            }
            AtStart::Beside(mut beside) => {
                let solution = beside.solve(right);
                if beside.bytes() <= MOST_BESIDE && !beside.has_fallen_back() {
                    matrix.beside = Some(*beside);
                }
                solution
            }
        }
    }

    /// Whether the model with a singular tangent matrix is held elastically, at the start of the
    /// step.
    pub(super) fn singularity(&mut self, period: (f64, f64)) -> Singularity {
        match self.factorise_at_start(Operator::Elastic, period) {
            Err(singularity) => singularity,
            Ok((by, _)) => {
                let right = vec![1.0; self.equations.places.free.len()];
                if self.solve_at_start(by, &right).is_ok() {
                    Singularity::Limit
                } else {
                    Singularity::Free
                }
            }
        }
    }
}
