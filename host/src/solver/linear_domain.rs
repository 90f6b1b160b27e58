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
//! Everything is counted from the last state that was completed, so round-off does not add up.

use super::Singular;
use super::multifrontal::{Kind, Multifrontal};
use super::newton::{Loads, norm};
use crate::assembly::{Pattern, System, Tie};
use crate::group::Group;
use crate::plugin::Operator;
use std::collections::VecDeque;
use std::sync::Arc;

/// Corrections of a complete state, at most.
const REFINEMENTS: usize = 3;
/// A complete state whose residual is within this of the tolerance is left as it is.
const REFINED: f64 = 0.1;
/// Round-off that a complete state may have, in changes of its forces by the last bit of the
/// displacements.
const ROUND_OFF: f64 = 8.0;

/// Matrices whose factors are remembered.
const REMEMBERED: usize = 3;

/// Factors of the linear parts that were condensed last, for phases and cases with the same ones:
/// another interface law on the same mesh, the same law under other loads.
#[derive(Debug, Default)]
pub struct Reuse {
    /// The latest last.
    known: VecDeque<Condensed>,
}

/// A matrix and what became of it.
#[derive(Debug)]
struct Condensed {
    kind: Kind,
    pattern: Pattern,
    values: Vec<f64>,
    kept: Vec<bool>,
    factors: Arc<Multifrontal>,
}

impl Reuse {
    /// The factors of a matrix that is known, to the bit.
    fn find(
        &self,
        kind: Kind,
        pattern: &Pattern,
        values: &[f64],
        kept: &[bool],
    ) -> Option<Arc<Multifrontal>> {
        let same = |known: &&Condensed| {
            known.kind == kind
                && known.kept == kept
                && known.pattern == *pattern
                && known
                    .values
                    .iter()
                    .map(|v| v.to_bits())
                    .eq(values.iter().map(|v| v.to_bits()))
        };
        let known = self.known.iter().find(same)?;
        Some(Arc::clone(&known.factors))
    }

    fn remember(&mut self, condensed: Condensed) {
        if self.known.len() == REMEMBERED {
            self.known.pop_front();
        }
        self.known.push_back(condensed);
    }
}

/// The linear part of a model during one phase.
#[derive(Debug)]
pub struct LinearDomain {
    system: System,
    factors: Arc<Multifrontal>,
    /// Whether the factors were made for this phase.
    pub factorised: bool,
    /// Degrees of freedom of the boundary, in the order of the Schur complement.
    boundary: Vec<usize>,
    /// Of every unknown, whether it is one of them.
    on_boundary: Vec<bool>,
    /// L⁻¹ r_i.
    y: Vec<f64>,
    /// r'.
    condensed: Vec<f64>,
    /// The last complete state: its load factor, and the internal forces on the boundary.
    lambda: f64,
    forces: Vec<f64>,
    /// Displacements of the boundary since then.
    moved: Vec<f64>,
    /// Largest relative residual that had to be taken for round-off, above the tolerance; else 0.
    pub round_off: f64,
}

/// Whether condensation pays: the linear part is the larger one, and its boundary small.
///
/// The dense equations of the boundary must not cost more than the sparse ones they replace.
fn pays(n_interior: usize, n_boundary: usize, n_rest: usize) -> bool {
    let dense = 5.0 * f64::sqrt(n_interior as f64);
    n_interior > n_rest && n_boundary as f64 <= dense
}

impl LinearDomain {
    /// Condenses the linear groups of a mesh whose nodes lie on these lines. `None` if there are
    /// none, or if it does not pay and is not wanted `always`.
    ///
    /// # Errors
    /// [`Singular`] if they are not held where they are not connected to the rest.
    pub fn new(
        groups: &[Group],
        prescribed: &[bool],
        ties: &[Tie],
        lines: &[[u32; 2]],
        always: bool,
        reuse: Option<&mut Reuse>,
    ) -> Result<Option<(Self, System)>, Singular> {
        let mut system = System::new(groups, Group::is_linear, prescribed, ties, None);
        if system.n_equations() == 0 {
            return Ok(None);
        }
        let is_other = |group: &Group| !group.is_linear();
        let rest = System::new(groups, is_other, prescribed, ties, Some(&system));
        let n_boundary = rest.boundary().len();
        let n_interior = system.n_equations() - n_boundary;
        if !always && !pays(n_interior, n_boundary, rest.n_equations()) {
            return Ok(None);
        }
        let mut kept = vec![false; system.n_equations()];
        for equation in rest
            .boundary()
            .iter()
            .filter_map(|&dof| system.equation(dof))
        {
            kept[equation] = true;
        }
        let symmetric = groups
            .iter()
            .filter(|group| group.is_linear())
            .all(Group::is_symmetric);
        let kind = if symmetric {
            Kind::Symmetric
        } else {
            Kind::Unsymmetric
        };
        let mut values = Vec::new();
        system.assemble(groups, &mut values);
        let known = reuse
            .as_ref()
            .and_then(|reuse| reuse.find(kind, &system.pattern, &values, &kept));
        let factorised = known.is_none();
        let factors = if let Some(factors) = known {
            factors
        } else {
            let lines = system.lines(lines);
            let mut factors = Multifrontal::new(&system.pattern, kind, &kept, Some(&lines))?;
            let pattern = system.forget_matrix();
            factors.factorise(&values)?;
            let factors = Arc::new(factors);
            if let Some(reuse) = reuse {
                reuse.remember(Condensed {
                    kind,
                    pattern,
                    values,
                    kept: kept.clone(),
                    factors: Arc::clone(&factors),
                });
            }
            factors
        };
        let free = system.free();
        let boundary: Vec<usize> = factors.kept().iter().map(|&e| free[e as usize]).collect();
        let domain = Self {
            moved: vec![0.0; boundary.len()],
            boundary,
            on_boundary: kept,
            factors,
            factorised,
            system,
            y: Vec::new(),
            condensed: Vec::new(),
            lambda: 0.0,
            forces: Vec::new(),
            round_off: 0.0,
        };
        Ok(Some((domain, rest)))
    }

    /// Stiffness of the boundary, column-major: S of (2).
    pub fn stiffness(&self) -> &[f64] {
        self.factors.schur()
    }

    /// Sets up a phase that starts from the groups' committed state.
    pub fn start(&mut self, groups: &[Group], loads: &Loads) {
        let n_dofs = self.system.n_dofs();
        let mut prescribed = vec![0.0; n_dofs];
        for &(dof, start, end) in &loads.prescribed {
            prescribed[dof] = end - start;
        }
        let mut right = vec![0.0; self.system.n_equations()];
        self.system
            .prescribed_forces(groups, &prescribed, &mut right);
        let (at_start, at_end) = (loads.external(0.0), loads.external(1.0));
        let unknowns = self.system.free().iter().zip(&self.on_boundary);
        for (right, (&dof, on_boundary)) in right.iter_mut().zip(unknowns) {
            *right = -*right;
            // External forces on the boundary are left to the equations of the rest.
            if !on_boundary {
                *right += at_end[dof] - at_start[dof];
            }
        }
        (self.y, self.condensed) = self.factors.forward(&right);
        let internal = self.internal(groups, |group| &group.stress.committed);
        self.complete(0.0, &internal);
    }

    /// As [`Self::start`], at a complete state within the phase: the groups' committed one.
    pub fn restart(&mut self, groups: &[Group], loads: &Loads, lambda: f64) {
        self.start(groups, loads);
        self.lambda = lambda;
    }

    /// Internal forces of the domain's groups under a stress of theirs, by degree of freedom.
    fn internal(&self, groups: &[Group], stress: impl Fn(&Group) -> &[f64]) -> Vec<f64> {
        let mut internal = vec![0.0; self.system.n_dofs()];
        for (number, group) in groups.iter().enumerate() {
            if self.system.includes(number) {
                group.kinematics.add_forces(stress(group), &mut internal);
            }
        }
        self.system.fold(&mut internal);
        internal
    }

    /// Trial state of the domain's groups under displacement increments since the last complete
    /// state; their internal forces, by degree of freedom.
    fn evaluate(&self, groups: &mut [Group], increment: &[f64]) -> Result<Vec<f64>, String> {
        for (number, group) in groups.iter_mut().enumerate() {
            if self.system.includes(number) {
                group
                    .evaluate(increment, Operator::None, 0.0, 0.0)
                    .map_err(|failure| failure.to_string())?;
            }
        }
        Ok(self.internal(groups, |group| &group.stress.trial))
    }

    /// Change of the internal forces (2-norm) if every displacement increment is larger or smaller
    /// by its last bit, as the sum over many elements scatters them. The trial state stays.
    fn last_bit(
        &self,
        groups: &mut [Group],
        increment: &[f64],
        internal: &[f64],
    ) -> Result<f64, String> {
        // The top bit of a multiple of 2⁶⁴ / golden ratio: a scatter of signs, the same every time.
        let sign = |i: usize| {
            let top = (i as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 63;
            1.0 - 2.0 * top as f64
        };
        let mut scattered: Vec<f64> = increment
            .iter()
            .enumerate()
            .map(|(i, u)| u * (1.0 + sign(i) * f64::EPSILON))
            .collect();
        self.system.follow(&mut scattered);
        let moved = self.evaluate(groups, &scattered)?;
        self.evaluate(groups, increment)?;
        let change = |&dof: &usize| moved[dof] - internal[dof];
        let free = self.system.free().iter();
        Ok(norm(&free.map(change).collect::<Vec<f64>>()))
    }

    /// Counts from this state on: a load factor, and the internal forces of the domain's groups.
    fn complete(&mut self, lambda: f64, internal: &[f64]) {
        self.lambda = lambda;
        self.forces = self.boundary.iter().map(|&dof| internal[dof]).collect();
        self.moved.fill(0.0);
    }

    /// Internal forces on the boundary at load factor λ if it stays where it is, in the order of
    /// the system's boundary.
    pub fn forces_at(&self, lambda: f64) -> Vec<f64> {
        let rise = lambda - self.lambda;
        let forces = self.forces.iter().zip(&self.condensed);
        let mut forces: Vec<f64> = forces.map(|(force, r)| force - rise * r).collect();
        self.add_product(&self.moved, &mut forces);
        forces
    }

    /// forces += S u.
    pub fn add_product(&self, displacement: &[f64], forces: &mut [f64]) {
        let n = self.boundary.len();
        for (column, u) in self.stiffness().chunks_exact(n.max(1)).zip(displacement) {
            for (force, s) in forces.iter_mut().zip(column) {
                *force += s * u;
            }
        }
    }

    /// The boundary has moved by these increments (by degree of freedom).
    pub fn follow(&mut self, increment: &[f64]) {
        for (moved, &dof) in self.moved.iter_mut().zip(&self.boundary) {
            *moved += increment[dof];
        }
    }

    /// Brings the domain's groups from the last complete state to load factor λ and to where the
    /// boundary is, and makes that the last complete state. Returns their internal forces, by
    /// degree of freedom. `increment` holds the displacements since then, by degree of freedom;
    /// those of the unknowns are filled in here.
    ///
    /// # Errors
    /// Why the groups are not in equilibrium.
    pub fn bring_up(
        &mut self,
        groups: &mut [Group],
        loads: &Loads,
        lambda: f64,
        increment: &mut [f64],
        tolerance: f64,
    ) -> Result<Vec<f64>, String> {
        let external = loads.external(lambda);
        let rise = lambda - self.lambda;
        let y: Vec<f64> = self.y.iter().map(|y| rise * y).collect();
        for (&dof, value) in self
            .system
            .free()
            .iter()
            .zip(self.factors.backward(&y, &self.moved))
        {
            increment[dof] = value;
        }
        let mut tries = 0..REFINEMENTS;
        let mut before = f64::INFINITY;
        let internal = loop {
            self.system.follow(increment);
            let internal = self.evaluate(groups, increment)?;
            let left = |(&dof, held): (&usize, &bool)| {
                if *held {
                    0.0
                } else {
                    external[dof] - internal[dof]
                }
            };
            let dofs = self.system.free().iter().zip(&self.on_boundary);
            let residual: Vec<f64> = dofs.map(left).collect();
            let scale = norm(&internal).max(loads.scale).max(f64::MIN_POSITIVE);
            let relative = norm(&residual) / scale;
            if relative <= REFINED * tolerance {
                break internal;
            }
            // A residual that no longer falls has come down to round-off.
            if relative > 0.5 * before || tries.next().is_none() {
                if relative <= tolerance {
                    break internal;
                }
                let last_bit = self.last_bit(groups, increment, &internal)? / scale;
                if relative <= ROUND_OFF * last_bit {
                    self.round_off = self.round_off.max(relative);
                    break internal;
                }
                return Err(format!(
                    "the linear groups are left with a residual of {relative:.1e}, tolerance \
                     {tolerance:.1e}; the last bit of their displacements stands for {last_bit:.1e}"
                ));
            }
            before = relative;
            let (y, _) = self.factors.forward(&residual);
            let correction = self.factors.backward(&y, &vec![0.0; self.boundary.len()]);
            for (&dof, value) in self.system.free().iter().zip(correction) {
                increment[dof] += value;
            }
        };
        for (number, group) in groups.iter_mut().enumerate() {
            if self.system.includes(number) {
                group.commit();
            }
        }
        self.complete(lambda, &internal);
        Ok(internal)
    }

    /// Degrees of freedom of the domain's unknowns, boundary included.
    pub fn unknowns(&self) -> &[usize] {
        self.system.free()
    }
}
