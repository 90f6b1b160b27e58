//! The part of a model whose laws are linear: assembled and factorised once in a phase, and
//! condensed onto the unknowns it shares with the rest.
//!
//! Its equations between two states of equilibrium, with loads proportional to λ, are
//!
//! - K_ii Δu_i + K_ib Δu_b = Δλ r_i, K_bi Δu_i + K_bb Δu_b = Δλ r_b + Δf_b (1)
//!
//! with interior unknowns i, boundary unknowns b, and forces f_b from the elements beyond the
//! boundary. r are the external forces of the phase less those of its prescribed displacements.
//! Eliminating Δu_i leaves
//!
//! - S Δu_b = Δλ r' + Δf_b, r' = r_b − K_bi K_ii⁻¹ r_i (2)
//!
//! which is all that the iterations see. Δu_i follows from the first of (1) when it is wanted.
//! Everything is counted from the last state that was completed.
//! Unknowns that some phases of the run prescribe and others do not are kept with the boundary, so
//! that one factorisation serves all phases: see `aside`.
//! If results need only some groups (the pile, not the sand), or some elements (those at its head),
//! only these are updated, from the state before. The others wait for the next complete state.

mod factor_reuse;
mod probed_elements;
mod probed_part;
mod switched_unknowns;

pub use factor_reuse::Reuse;

use super::newton::{DomainFailure, Loads, noise, norm};
use crate::assembly::{System, Tie, used};
use crate::group::Group;
use algebra::{Block, Dense, Kind, Multifrontal, Pattern, Singular};
use factor_reuse::{Condensed, Numbered, Setup};
use probed_elements::Ahead;
use probed_part::{Goal, Part};
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use switched_unknowns::Aside;
pub use switched_unknowns::Held;

/// What results look at.
#[derive(Clone, Copy, Debug)]
pub struct CheckedPoints<'l> {
    /// For every group of the model, whether they do.
    pub groups: &'l [bool],
    /// Elements of every group that they look at where they do not at all of it, ascending.
    pub elements: &'l [Vec<usize>],
    /// Degrees of freedom whose displacements they give.
    pub dofs: &'l [usize],
}

/// A state that is counted from.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
struct Origin {
    lambda: f64,
    /// Displacements by degree of freedom.
    displacement: Vec<f64>,
    /// Displacements of the boundary since then.
    moved: Vec<f64>,
}

/// State of a domain.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Standing {
    /// The last complete state.
    complete: Origin,
    /// The last state in which a part of the groups was looked at; theirs counts from there.
    latest: Origin,
    /// Internal forces on the boundary in that state.
    forces: Vec<f64>,
    /// For every group of the model, whether it belongs to that part; `None` if the latest state is
    /// the complete one.
    part: Option<Vec<bool>>,
    /// Elements of other groups that are in the latest state, and theirs in the complete one.
    excerpt: Option<Ahead>,
    /// Their groups follow as a whole from now on, since rounding would show.
    as_groups: bool,
    /// Largest relative residual that had to be taken for round-off, above the tolerance; else 0.
    pub round_off: f64,
}

/// The linear part of a model during one phase.
#[derive(Debug)]
pub struct LinearDomain {
    system: Arc<System>,
    factors: Arc<Multifrontal>,
    /// Whether the factors were made for this phase.
    pub factorised: bool,
    /// Largest entry of the boundary's stiffness.
    pub largest: f64,
    /// Largest entry of its matrix before it was condensed.
    pub stiffest: f64,
    /// 2-norm of its diagonal, and of the diagonal of the kept unknowns.
    diagonal: f64,
    diagonal_kept: f64,
    /// Degrees of freedom of the boundary, in the order of its stiffness.
    boundary: Vec<usize>,
    /// For every unknown, whether it is one of them.
    on_boundary: Vec<bool>,
    /// For every unknown, whether it is prescribed in this phase, but not in all phases.
    is_held: Vec<bool>,
    /// The unknowns kept with the boundary, if any.
    aside: Option<Aside>,
    /// S.
    stiffness: Dense,
    /// L⁻¹ r_i.
    y: Vec<f64>,
    /// r'.
    condensed: Vec<f64>,
    standing: Standing,
    /// The part that is looked at.
    part: Option<Part>,
    /// All groups.
    whole: Option<Part>,
}

/// For every unknown of a system, whether the rest shares it, or some phases prescribe it.
fn kept(system: &System, rest: &System, sometimes: &[bool]) -> Vec<bool> {
    let free = system.free().iter();
    let mut kept: Vec<bool> = free.map(|&dof| sometimes[dof]).collect();
    let shared = rest.boundary().iter();
    for equation in shared.filter_map(|&dof| system.equation(dof)) {
        kept[equation] = true;
    }
    kept
}

/// A matrix that is to be condensed.
struct Matrix {
    kind: Kind,
    pattern: Arc<Pattern>,
    values: Vec<f64>,
}

impl Matrix {
    /// Its factors but for the unknowns that are kept, on these mesh lines; whether they were made now.
    fn condensed_onto(
        self,
        kept: &[bool],
        lines: &[[u32; 2]],
        mut reuse: Option<&mut Reuse>,
    ) -> Result<(Arc<Multifrontal>, bool), Singular> {
        let Self {
            kind,
            pattern,
            values,
        } = self;
        let known = reuse
            .as_ref()
            .and_then(|reuse| reuse.find(kind, &pattern, &values, kept));
        if let Some(reuse) = &mut reuse {
            reuse.forget();
        }
        if let Some(factors) = known {
            return Ok((factors, false));
        }
        let mut factors = Multifrontal::new(&pattern, kind, kept, Some(lines))?;
        if let Some(reuse) = &reuse {
            reuse.announce(factors.bytes(), "factorising the linear groups");
        }
        let gathered = factors.gather(&values);
        // Where nothing may find the matrix, it is given up before its factors need the room.
        let remembered = reuse
            .filter(|reuse| reuse.may_recur())
            .map(|reuse| (reuse, pattern, values));
        factors.factorise_gathered(&gathered)?;
        drop(gathered);
        let factors = Arc::new(factors);
        if let Some((reuse, pattern, values)) = remembered {
            reuse.remember(Condensed {
                kind,
                pattern,
                values,
                kept: kept.to_vec(),
                factors: Arc::clone(&factors),
            });
        }
        Ok((factors, true))
    }
}

/// Whether condensation pays: the linear part is the larger one, and its boundary small. Unknowns are counted
/// before anything is numbered: of the linear part, those that are not `lasting`ly prescribed; of the rest, those that
/// are not `now`.
///
/// The dense equations of the boundary must not cost more than the sparse ones they replace.
fn pays(
    (groups, condensed): (&[Group], &[bool]),
    [lasting, now]: [&[bool]; 2],
    ties: &[Tie],
) -> bool {
    let of = |in_domain: bool| {
        let numbered = groups.iter().zip(condensed);
        let chosen =
            numbered.filter(|(group, condensed)| group.is_active && **condensed == in_domain);
        let nodes = chosen.flat_map(|(group, _)| group.nodes());
        used(nodes, ties, now.len())
    };
    let (own, others) = (of(true), of(false));
    let (mut n_own, mut n_boundary, mut n_others) = (0, 0, 0);
    for dof in 0..now.len() {
        let (own, others) = (own[dof] && !lasting[dof], others[dof] && !now[dof]);
        n_own += usize::from(own);
        n_others += usize::from(others);
        n_boundary += usize::from(own && others);
    }
    let n_interior = n_own - n_boundary;
    let dense = 5.0 * f64::sqrt(n_interior as f64);
    n_interior > n_others && n_boundary as f64 <= dense
}

/// Puts what stands below the diagonal of n columns above it, too.
fn mirror(matrix: &mut [f64], n: usize) {
    for column in 1..n {
        for row in 0..column {
            matrix[column * n + row] = matrix[row * n + column];
        }
    }
}

impl LinearDomain {
    /// Condenses those of the groups that are to be `condensed`, all of them linear, of a mesh whose nodes lie
    /// on these lines. `None` if no group is linear, or if it saves no time and is not wanted `always`.
    ///
    /// # Errors
    /// [`Singular`] if they are not held where they are not connected to the rest.
    pub fn new(
        (groups, condensed): (&[Group], &[bool]),
        held: &Held<'_>,
        ties: &[Tie],
        lines: &[[u32; 2]],
        always: bool,
        mut reuse: Option<&mut Reuse>,
    ) -> Result<Option<(Self, System)>, Singular> {
        let sometimes = held.kept((groups, condensed));
        let lasting = held.but_for(&sometimes);
        if !always && !pays((groups, condensed), [&lasting, held.now], ties) {
            return Ok(None);
        }
        let setup = Setup::of((groups, condensed), &lasting, ties);
        let is_other = |number: usize, group: &Group| group.is_active && !condensed[number];
        let rest = |system: &System| System::new(groups, is_other, held.now, ties, Some(system));
        let same = reuse.as_ref().and_then(|reuse| reuse.same(&setup));
        if let Some(numbered) = same {
            let rest = rest(&numbered.system);
            if numbered.kept == kept(&numbered.system, &rest, &sometimes) {
                if let Some(reuse) = reuse {
                    reuse.forget();
                }
                let domain = Self::of(numbered, false, held.now, &rest)?;
                return Ok(Some((domain, rest)));
            }
        }
        let mut system = System::new(
            groups,
            |number, group| group.is_active && condensed[number],
            &lasting,
            ties,
            None,
        );
        if system.n_equations() == 0 {
            return Ok(None);
        }
        let rest = rest(&system);
        let kept = kept(&system, &rest, &sometimes);
        let symmetric = groups
            .iter()
            .zip(condensed)
            .all(|(group, condensed)| !condensed || group.is_symmetric());
        let kind = if symmetric {
            Kind::Symmetric
        } else {
            Kind::Unsymmetric
        };
        let mut values = Vec::new();
        system.assemble(groups, &mut values);
        let stiffest = algebra::largest(&values);
        let pattern = system.forget_matrix();
        let mut diagonal = pattern.diagonal(&values);
        let of_all = norm(&diagonal);
        for (value, _) in diagonal.iter_mut().zip(&kept).filter(|(_, kept)| !**kept) {
            *value = 0.0;
        }
        let diagonal = [of_all, norm(&diagonal)];
        let lines = system.lines(lines);
        let matrix = Matrix {
            kind,
            pattern,
            values,
        };
        let (factors, factorised) = matrix.condensed_onto(&kept, &lines, reuse.as_deref_mut())?;
        let numbered = Numbered {
            system: Arc::new(system),
            kept,
            factors,
            stiffest,
            diagonal,
        };
        if let Some(reuse) = reuse {
            reuse.keep(setup, &numbered);
        }
        let domain = Self::of(numbered, factorised, held.now, &rest)?;
        Ok(Some((domain, rest)))
    }

    /// With its unknowns and its factors, and whether those were made for this phase, in which these degrees
    /// of freedom are prescribed.
    fn of(
        numbered: Numbered,
        factorised: bool,
        prescribed: &[bool],
        rest: &System,
    ) -> Result<Self, Singular> {
        let Numbered {
            system,
            mut kept,
            factors,
            stiffest,
            diagonal: [diagonal, diagonal_kept],
        } = numbered;
        let free = system.free();
        let of_kept = factors.kept().iter().map(|&e| free[e as usize]);
        let of_kept: Vec<usize> = of_kept.collect();
        let mut is_held = vec![false; free.len()];
        let mut stiffness = Dense::SchurOf(Arc::clone(&factors));
        let mut aside = None;
        if of_kept.len() != rest.boundary().len() {
            let (found, mut own) = Aside::new(factors.schur(), &of_kept, prescribed, rest)?;
            for (&equation, dof) in factors.kept().iter().zip(&of_kept) {
                kept[equation as usize] = rest.boundary().binary_search(dof).is_ok();
                is_held[equation as usize] = prescribed[*dof];
            }
            stiffness = if factors.is_symmetric() {
                mirror(&mut own, rest.boundary().len());
                Dense::Symmetric(Arc::new(own))
            } else {
                Dense::Of(Arc::new(own))
            };
            aside = Some(found);
        }
        Ok(Self {
            stiffest,
            diagonal,
            diagonal_kept,
            largest: algebra::largest(stiffness.values()),
            standing: Standing::default(),
            part: None,
            whole: None,
            boundary: match &aside {
                Some(_) => rest.boundary().to_vec(),
                None => of_kept,
            },
            on_boundary: kept,
            is_held,
            aside,
            stiffness,
            factors,
            factorised,
            system,
            y: Vec::new(),
            condensed: Vec::new(),
        })
    }

    /// The domain as a dense block in the equations of the rest.
    pub fn block(&self, rest: &System) -> Block {
        let equations = self.boundary.iter().filter_map(|&dof| rest.equation(dof));
        Block::new(equations.collect(), self.stiffness.clone())
    }

    /// Stiffness of the boundary, column-major: S of (2).
    pub fn stiffness(&self) -> &[f64] {
        self.stiffness.values()
    }

    /// Nodal forces of its groups in their committed state, by degree of freedom: those of ties where they arise.
    pub fn internal_forces(&self, groups: &[Group]) -> Vec<f64> {
        let mut internal = vec![0.0; self.system.n_dofs()];
        let numbered = groups.iter().enumerate();
        for (_, group) in numbered.filter(|(number, _)| self.includes(*number)) {
            group.kinematics.add_forces(&group.carried(), &mut internal);
        }
        internal
    }

    /// Whether a group belongs to it.
    pub fn includes(&self, group: usize) -> bool {
        self.system.includes(group)
    }

    /// Sets up a phase that starts from the groups' committed state, with these
    /// [internal forces](Self::internal_forces), and these displacements. Interior forces that
    /// change by much less than the tolerance count as unchanged.
    pub fn start(
        &mut self,
        groups: &[Group],
        mut internal: Vec<f64>,
        loads: &Loads,
        displacement: &[f64],
        tolerance: f64,
    ) {
        let prescribed = loads.prescribed_rate();
        let mut right = vec![0.0; self.system.n_equations()];
        self.system
            .prescribed_forces(groups, &prescribed, &mut right);
        let (at_start, at_end) = (loads.external(0.0), loads.external(1.0));
        let noise = noise(right.len(), tolerance) * loads.scale;
        let unknowns = self.system.free().iter().zip(&self.on_boundary);
        for (right, (&dof, on_boundary)) in right.iter_mut().zip(unknowns) {
            *right = -*right;
            // External forces on the boundary are left to the equations of the rest.
            let change = at_end[dof] - at_start[dof];
            if !on_boundary && (change.is_nan() || change.abs() > noise) {
                *right += change;
            }
        }
        // Loads that stay as they are, or act in few places, leave most of it nothing to eliminate.
        let loaded: Vec<bool> = right.iter().map(|value| value.abs() > 0.0).collect();
        let fronts = self.factors.fronts_of(&loaded);
        let (y, left) = self.factors.forward(&right, Some(&fronts));
        self.y = y;
        self.condensed = match &mut self.aside {
            Some(aside) => aside.condense(self.factors.schur(), &left, &prescribed),
            None => left,
        };
        self.system.fold(&mut internal);
        self.is_complete(loads.leg[0], displacement, &internal);
    }

    /// As [`Self::start`], within a phase.
    pub fn restart(
        &mut self,
        groups: &[Group],
        loads: &Loads,
        standing: &Standing,
        tolerance: f64,
    ) {
        let internal = self.internal_forces(groups);
        let displacement = &standing.complete.displacement;
        self.start(groups, internal, loads, displacement, tolerance);
        self.standing = standing.clone();
    }

    /// If only a part of the groups was updated: the forces that the domain takes from its
    /// boundary, by degree of freedom. `None` if all groups were.
    pub fn forces_beside(&self) -> Option<Vec<(usize, f64)>> {
        let forces = self.boundary.iter().zip(&self.standing.forces);
        let forces = forces.map(|(&dof, &force)| (dof, force));
        self.standing.part.is_some().then(|| forces.collect())
    }

    /// State of the domain.
    pub fn standing(&self) -> &Standing {
        &self.standing
    }

    /// Counts from this state on.
    fn is_complete(&mut self, lambda: f64, displacement: &[f64], internal: &[f64]) {
        let complete = Origin {
            lambda,
            displacement: displacement.to_vec(),
            moved: vec![0.0; self.boundary.len()],
        };
        self.standing = Standing {
            latest: complete.clone(),
            complete,
            forces: self.boundary.iter().map(|&dof| internal[dof]).collect(),
            part: None,
            excerpt: None,
            as_groups: self.standing.as_groups,
            round_off: self.standing.round_off,
        };
    }

    /// Internal forces on the boundary at load factor λ if it stays where it is, in the order of
    /// the system's boundary.
    pub fn forces_at(&self, lambda: f64) -> Vec<f64> {
        // Since the latest state the boundary has not moved far: the forces of a stiff body that
        // moves as a whole do not cancel.
        let Origin {
            lambda: latest,
            moved,
            ..
        } = &self.standing.latest;
        let rise = lambda - latest;
        let forces = self.standing.forces.iter().zip(&self.condensed);
        let mut forces: Vec<f64> = forces.map(|(force, r)| force - rise * r).collect();
        // At the start of an increment it stands in the latest state.
        if moved.iter().any(|moved| *moved != 0.0) {
            self.add_product(moved, &mut forces);
        }
        forces
    }

    /// Change of the forces that the domain takes from its boundary with λ, in the order of the
    /// system's boundary: r' of (2).
    pub fn load_rate(&self) -> &[f64] {
        &self.condensed
    }

    /// forces += S u.
    pub fn add_product(&self, displacement: &[f64], forces: &mut [f64]) {
        self.stiffness.add_product(displacement, forces);
    }

    /// The boundary has moved by these increments, in the order of the system's boundary.
    pub fn follow(&mut self, increment: &[f64]) {
        let Standing {
            complete, latest, ..
        } = &mut self.standing;
        for origin in [complete, latest] {
            for (moved, increment) in origin.moved.iter_mut().zip(increment) {
                *moved += increment;
            }
        }
    }

    /// Brings the domain's groups to load factor λ and to where the boundary is; only those that
    /// are `looked_at` if there are others, and if that suffices. Returns their internal forces, by
    /// degree of freedom. Displacements (by degree of freedom) of their unknowns are filled in.
    ///
    /// # Errors
    /// Why the groups are not in equilibrium.
    pub fn bring_up(
        &mut self,
        looked_at: Option<CheckedPoints<'_>>,
        groups: &mut [Group],
        loads: &Loads,
        lambda: f64,
        displacement: &mut [f64],
        tolerance: f64,
    ) -> Result<Vec<f64>, DomainFailure> {
        let goal = Goal {
            loads,
            lambda,
            tolerance,
        };
        let looked_at = looked_at.filter(|looked_at| self.may_go_ahead(looked_at, &goal));
        let is_part = self.choose_part(looked_at, groups);
        if is_part && let Some(part) = self.part.take() {
            let mut reached = self.settle(&part, groups, &goal, displacement);
            let numbers = part.groups.clone();
            // A part that is not in the latest state yet starts where that one is the complete one.
            if let Ok((internal, increment)) = &mut reached {
                self.go_ahead(&part, groups, increment, internal);
            }
            self.part = Some(part);
            // Where round-off alone keeps a part from equilibrium, that shows in the whole.
            if let Ok((internal, _)) = reached {
                self.standing.forces = self.forces_at(lambda);
                let latest = &mut self.standing.latest;
                latest.lambda = lambda;
                latest.displacement.copy_from_slice(displacement);
                latest.moved.fill(0.0);
                self.commit(groups, &numbers);
                self.standing.part = Some(numbers);
                return Ok(internal);
            }
        }
        self.go_back(groups);
        let all = vec![true; groups.len()];
        let whole = match self.whole.take() {
            Some(whole) => whole,
            None => self.of_groups(&all, Vec::new(), &[]),
        };
        let reached = self.settle(&whole, groups, &goal, displacement);
        self.whole = Some(whole);
        let (internal, _) = reached?;
        let off = self.off_boundary(&internal, &goal);
        if off > tolerance {
            self.standing.round_off = self.standing.round_off.max(off);
        }
        self.commit(groups, &all);
        self.is_complete(lambda, displacement, &internal);
        Ok(internal)
    }

    /// How far the forces of a complete state on the boundary are from those that the iterations saw, (2), relative to
    /// the forces in play: what rounding of both leaves.
    fn off_boundary(&self, internal: &[f64], goal: &Goal<'_>) -> f64 {
        let of_groups = self.boundary.iter().map(|&dof| internal[dof]);
        let seen = self.forces_at(goal.lambda);
        let off: Vec<f64> = of_groups.zip(seen).map(|(a, b)| a - b).collect();
        let scale = norm(internal).max(goal.loads.scale);
        norm(&off) / scale.max(f64::MIN_POSITIVE)
    }

    fn commit(&self, groups: &mut [Group], which: &[bool]) {
        for (number, group) in groups.iter_mut().enumerate() {
            if self.system.includes(number) && which[number] {
                group.commit();
            }
        }
    }

    /// Degrees of freedom of the domain's unknowns in this phase, boundary included.
    pub fn unknowns(&self) -> impl Iterator<Item = usize> {
        let free = self.system.free().iter().zip(&self.is_held);
        free.filter(|(_, is_held)| !**is_held).map(|(dof, _)| *dof)
    }
}
