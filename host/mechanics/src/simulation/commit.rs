//! Taking over a step, and completing a state: what a linear domain left out of the iterations, the
//! reactions, the balance of all forces.

use super::phase::PhaseEquations;
use super::{Part, Simulation, UnderWay, statics};
use crate::assembly::fold;
use crate::equilibrium::{CheckedPoints, Loads, Reason, StepSuccess, norm};
use std::time::Instant;

impl Simulation {
    /// Takes over a step: the groups that took part in it, and the displacements they know.
    pub(super) fn accept(&mut self, success: &StepSuccess, phase: &mut UnderWay, lambda: f64) {
        let (equations, loads) = (&mut phase.equations, &phase.course.loads);
        for (number, group) in self.groups.iter_mut().enumerate() {
            if equations.system.includes(number) {
                group.commit();
            }
        }
        let tolerance = self.problem.settings.force_tolerance;
        let tolerance = tolerance.max(success.round_off).max(success.tolerated);
        equations.measured = Some((success.scales.clone(), tolerance));
        if let Some(domain) = &mut equations.domain {
            let boundary = equations.places.boundary.iter();
            let moved: Vec<f64> = boundary.map(|&place| success.increment[place]).collect();
            domain.follow(&moved);
        }
        let places = &equations.places;
        places.add(&success.increment, &mut self.displacement);
        for (force, now) in self.force.iter_mut().zip(loads.forces(lambda)) {
            *force = now;
        }
        if lambda >= loads.leg[1] {
            // Totals that were asked for are met exactly, whatever the increments added up to.
            for &(dof, _, end) in &loads.prescribed {
                self.displacement[dof] = end;
            }
        }
    }

    /// Completes the state at the phase's load factor: the linear domain, which the iterations leave out, and the
    /// reactions (internal less external forces, by degree of freedom). If only a part is `looked_at`, the rest of the
    /// domain may keep its earlier state.
    ///
    /// # Errors
    /// Why the domain is not in equilibrium.
    pub(super) fn complete(
        &mut self,
        phase: &mut UnderWay,
        looked_at: Option<&Part>,
    ) -> Result<(), Reason> {
        let UnderWay {
            equations,
            course,
            record,
            ..
        } = phase;
        let (loads, lambda) = (&course.loads, course.lambda);
        let started = Instant::now();
        let mut reaction = vec![0.0; self.displacement.len()];
        for (number, group) in self.groups.iter().enumerate() {
            if equations.system.includes(number) {
                group.kinematics.add_forces(&group.carried(), &mut reaction);
            }
        }
        fold(&self.tied, &mut reaction);
        // Where a part of a domain is looked at, the forces on its boundary stand for the rest.
        let mut beside = None;
        if let Some(domain) = &mut equations.domain {
            let tolerance = self.problem.settings.force_tolerance;
            let looked_at = looked_at.map(|part| CheckedPoints {
                groups: &part.groups,
                elements: &part.elements,
                dofs: &part.dofs,
            });
            let (groups, displacement) = (&mut self.groups, &mut self.displacement);
            let internal = domain
                .bring_up(looked_at, groups, loads, lambda, displacement, tolerance)
                .map_err(Reason::Domain)?;
            beside = domain.forces_beside();
            if beside.is_none() {
                for (reaction, internal) in reaction.iter_mut().zip(&internal) {
                    *reaction += internal;
                }
            }
            self.check_balance(equations, loads, lambda, &reaction, beside.as_deref())?;
            if beside.is_some() {
                for (reaction, internal) in reaction.iter_mut().zip(&internal) {
                    *reaction += internal;
                }
            }
        } else {
            self.check_balance(equations, loads, lambda, &reaction, beside.as_deref())?;
        }
        equations.system.follow(&mut self.displacement);
        for (tie, offset) in self.tied.iter().zip(&course.offsets) {
            self.displacement[tie.dof] += offset;
        }
        for (force, external) in reaction.iter_mut().zip(&self.force) {
            *force -= external;
        }
        fold(&self.led, &mut reaction);
        record.costs.laws += started.elapsed();
        self.reaction = reaction;
        self.note_bodies(phase.number, &phase.course);
        Ok(())
    }

    /// Holds reactions against loads, by the internal forces of the groups that were evaluated and
    /// those that the domain `beside` them takes.
    ///
    /// # Errors
    /// The imbalance.
    fn check_balance(
        &self,
        equations: &PhaseEquations,
        loads: &Loads,
        lambda: f64,
        internal: &[f64],
        beside: Option<&[(usize, f64)]>,
    ) -> Result<(), Reason> {
        let Some((scales, tolerance)) = &equations.measured else {
            return Ok(());
        };
        let supports = || {
            let prescribed = loads.prescribed.iter();
            prescribed.map(|&(dof, ..)| (dof, internal[dof]))
        };
        let mut unknowns = equations.system.free().to_vec();
        if let (Some(domain), None) = (&equations.domain, beside) {
            unknowns = among_both(&unknowns, domain.unknowns(), internal.len());
        }
        let taken = |dof: &usize| {
            let beside = beside.unwrap_or_default();
            let at = beside.binary_search_by_key(dof, |(dof, _)| *dof);
            at.map_or(0.0, |at| beside[at].1)
        };
        let unknowns = || {
            let external = |dof: &usize| (*dof, loads.external_at(*dof, lambda) - taken(dof));
            unknowns.iter().map(external)
        };
        // Supports may be those of several bodies: they are added up together.
        let bound = statics::Bound {
            scale: scales.iter().copied().fold(0.0, f64::hypot),
            tolerance: *tolerance,
            with_domain: equations.domain.is_some() && beside.is_none(),
            last_bit: equations
                .domain
                .iter()
                .filter(|_| beside.is_none())
                .map(|domain| domain.stiffest * norm(&self.displacement))
                .sum(),
        };
        let model = statics::Model {
            analysis: self.problem.analysis,
            nodes: &self.problem.mesh.nodes,
            turns_freely: self.turns_freely,
        };
        match statics::complaint(model, supports(), unknowns(), bound) {
            None => Ok(()),
            Some(imbalance) => Err(Reason::Unbalanced(imbalance)),
        }
    }
}

/// Degrees of freedom that are among some or others, ascending.
pub(super) fn among_both(
    some: &[usize],
    others: impl Iterator<Item = usize>,
    n_dofs: usize,
) -> Vec<usize> {
    let mut is_any = vec![false; n_dofs];
    for dof in some.iter().copied().chain(others) {
        is_any[dof] = true;
    }
    (0..n_dofs).filter(|&dof| is_any[dof]).collect()
}
