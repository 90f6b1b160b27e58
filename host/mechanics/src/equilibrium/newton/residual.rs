//! Evaluation: what displacement increments leave out of balance.

use super::{Newton, ROUND_OFF, norm, reference_of_round_off};
use crate::assembly::norms;
use crate::group::{Committed, Group, PointFailure};
use law::Operator;
use std::time::Instant;

/// A step's end: what an iterate is held against.
#[derive(Debug)]
pub(in crate::equilibrium) struct Task {
    /// External forces, by place.
    pub(in crate::equilibrium) external: Vec<f64>,
    /// Norm of those on all degrees of freedom, or of the forces at the start of the phase; by body.
    pub(super) imposed: Vec<f64>,
    /// Increments of prescribed displacements, by place.
    pub(in crate::equilibrium) prescribed: Vec<f64>,
    /// Time at the start, and its increment.
    pub(in crate::equilibrium) period: (f64, f64),
}

/// Residual by equation, and the residual's norm relative to the forces in play.
#[derive(Clone, Debug, Default)]
pub(in crate::equilibrium) struct Balance {
    pub(in crate::equilibrium) residual: Vec<f64>,
    /// The largest of all bodies.
    pub(in crate::equilibrium) relative: f64,
    pub(super) by_body: Vec<f64>,
    /// Its reference, by body.
    pub(in crate::equilibrium) scales: Vec<f64>,
    /// For every body, whether it has diverged.
    pub(in crate::equilibrium) away: Vec<bool>,
    pub(in crate::equilibrium) unreliable: Option<String>,
}

impl Newton<'_> {
    /// A step's end with these external forces by degree of freedom, increments of prescribed displacements by place,
    /// and time at its start with its increment.
    pub(in crate::equilibrium) fn task(
        &self,
        external: &[f64],
        prescribed: Vec<f64>,
        period: (f64, f64),
    ) -> Task {
        Task {
            external: self.equations.places.gather(external),
            imposed: self.imposed(external),
            prescribed,
            period,
        }
    }

    /// Takes up the forces of the domain at a load factor if its boundary stays where it is.
    pub(in crate::equilibrium) fn take_domain_forces(&mut self, lambda: f64) {
        if let Some(domain) = self.equations.domain {
            self.start.domain_forces = domain.forces_at(lambda);
        }
    }

    /// Norm of external forces, or of the forces at the start of the phase; by body.
    fn imposed(&self, external: &[f64]) -> Vec<f64> {
        let bodies = &self.equations.places.bodies;
        let norms = norms(&bodies.of_dof, bodies.n, external);
        let both = norms.iter().zip(&self.reference.at_start);
        both.map(|(norm, at_start)| norm.max(*at_start)).collect()
    }

    /// Trial state, internal forces and residual under displacement increments; also the
    /// tangents if an `operator` is wanted.
    pub(in crate::equilibrium) fn evaluate(
        &mut self,
        increment: &[f64],
        task: &Task,
        operator: Operator,
    ) -> Result<Balance, PointFailure> {
        let away = self.away(increment, task);
        let start = Instant::now();
        self.will_compute(operator);
        let (mut internal, mut unreliable) = self.internal_forces(increment, task, operator)?;
        // Forces in play before those of the domain cancel them out.
        let trial = |group: &Group, _: usize| group.carried_on_trial().into_owned();
        let in_play = self.forces_by_body(&internal, &trial);
        let floors = self.floors(increment, task);
        let active = self.active_load(&internal);
        let (mut scales, has_moved) = self.scales(&in_play, &floors, task);
        if let Some(active) = active {
            for scale in &mut scales {
                let least = reference_of_round_off(*scale, self.settings.force_tolerance);
                *scale = active.max(least).min(*scale);
            }
        }
        if has_moved {
            (internal, unreliable) = self.internal_forces(increment, task, operator)?;
        }
        self.kept.tangents = operator;
        self.note_opened();
        if let Some(domain) = self.equations.domain {
            let boundary = &self.equations.places.boundary;
            let moved: Vec<f64> = boundary.iter().map(|&place| increment[place]).collect();
            let mut forces = self.start.domain_forces.clone();
            domain.add_product(&moved, &mut forces);
            for (&place, force) in boundary.iter().zip(forces) {
                internal[place] += force;
            }
        }
        let free = self.equations.places.free.iter();
        let residual: Vec<f64> = free
            .map(|&place| task.external[place] - internal[place])
            .collect();
        let bodies = &self.equations.places.bodies;
        let sizes = norms(&bodies.of_equation, bodies.n, &residual);
        let both = sizes.iter().zip(&scales);
        let by_body: Vec<f64> = both
            .map(|(size, &scale)| if scale > 0.0 { size / scale } else { 0.0 })
            .collect();
        self.costs.laws += start.elapsed();
        Ok(Balance {
            residual,
            relative: largest(&by_body),
            by_body,
            scales,
            away,
            unreliable,
        })
    }

    /// Norm of the change of nodal forces, by place and without those of the domain, since the start of the phase; if
    /// residuals are measured against it.
    fn active_load(&self, internal: &[f64]) -> Option<f64> {
        let carried = self.start.carried.as_slice();
        let changes = internal.iter().zip(carried).map(|(now, start)| now - start);
        (!carried.is_empty()).then(|| norm(&changes.collect::<Vec<_>>()))
    }

    /// Takes note of the interfaces of which a point opens in the trial state.
    fn note_opened(&mut self) {
        let opened = self
            .groups
            .iter()
            .enumerate()
            .filter(|(_, group)| group.opens());
        self.reference
            .opened
            .extend(opened.map(|(number, _)| number));
    }

    /// Trial state and internal forces by place, without those of the domain, under displacement
    /// increments. Says which law calls its result unreliable.
    fn internal_forces(
        &mut self,
        increment: &[f64],
        task: &Task,
        operator: Operator,
    ) -> Result<(Vec<f64>, Option<String>), PointFailure> {
        self.costs.evaluations += 1;
        let mut period = task.period;
        if let Some((base, left)) = &self.start.base {
            let since: Vec<f64> = increment.iter().zip(base).map(|(u, u_0)| u - u_0).collect();
            self.equations
                .places
                .scatter(&since, &mut self.room.displacement);
            period = *left;
        } else {
            self.equations
                .places
                .scatter(increment, &mut self.room.displacement);
        }
        let outcome = self.evaluate_groups(period, operator);
        let mut internal = self.equations.places.take(&mut self.room.force);
        let unreliable = outcome?;
        self.equations.places.fold(&mut internal);
        Ok((internal, unreliable))
    }

    /// Commits the trial state, which belongs to these displacement increments, within the step; when what is left of
    /// it starts, and how long that takes.
    pub(in crate::equilibrium) fn commit(&mut self, increment: &[f64], left: (f64, f64)) {
        for (number, group) in self.groups.iter_mut().enumerate() {
            if self.equations.system.includes(number) {
                group.commit();
            }
        }
        self.start.base = Some((increment.to_vec(), left));
    }

    /// The committed state of the groups.
    pub(in crate::equilibrium) fn committed(&self) -> Vec<Committed> {
        self.groups.iter().map(Group::committed).collect()
    }

    /// Takes back what was committed within the step.
    pub(in crate::equilibrium) fn restore(&mut self, committed: Vec<Committed>) {
        for (group, committed) in self.groups.iter_mut().zip(committed) {
            group.restore_committed(committed);
        }
        self.start.base = None;
    }

    /// Forces by body that count as none where no force has ever acted: round-off of K u.
    fn floors(&self, increment: &[f64], task: &Task) -> Vec<f64> {
        let bodies = &self.equations.places.bodies;
        let sizes = self.by_body(increment);
        let of_domain = super::norm(&self.start.domain_forces);
        (0..bodies.n)
            .map(|body| {
                let cancelling = self.equations.matrix.largest_of(body) * sizes[body] + of_domain;
                // Forces no larger than that are themselves what rounding leaves.
                if task.imposed[body] > ROUND_OFF * cancelling {
                    0.0
                } else {
                    ROUND_OFF * cancelling / self.settings.force_tolerance
                }
            })
            .collect()
    }

    /// Trial state of the groups under the displacements in their room; the forces are added up in
    /// theirs. Says which law calls its result unreliable.
    pub(super) fn evaluate_groups(
        &mut self,
        (time, time_increment): (f64, f64),
        operator: Operator,
    ) -> Result<Option<String>, PointFailure> {
        let mut unreliable = None;
        for (number, group) in self.groups.iter_mut().enumerate() {
            if !self.equations.system.includes(number) {
                continue;
            }
            let success =
                group.evaluate(&self.room.displacement, operator, time, time_increment)?;
            group
                .kinematics
                .add_forces(&group.carried_on_trial(), &mut self.room.force);
            unreliable = unreliable.or(success
                .unreliable
                .map(|(_, why)| format!("group `{}`: {why}", group.name)));
        }
        Ok(unreliable)
    }
}

/// The largest of some sizes; NaN if one is NaN.
fn largest(sizes: &[f64]) -> f64 {
    let larger = |a: f64, b: &f64| if *b > a || b.is_nan() { *b } else { a };
    sizes.iter().fold(0.0, larger)
}
