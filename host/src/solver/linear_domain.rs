//! The part of a model whose laws are linear: assembled and factorised once in a phase, and
//! condensed onto the unknowns it shares with the rest.
//!
//! Counted from the start of the phase, with loads proportional to λ, its equations are
//!
//! - K_ii u_i + K_ib u_b = r_i(λ), K_bi u_i + K_bb u_b = r_b(λ) + f_b (1)
//!
//! with interior unknowns i, boundary unknowns b, and forces f_b from the elements beyond the
//! boundary. The right-hand sides are r(λ) = r₀ + λ r₁: external forces less the internal ones at
//! the start of the phase less those of the prescribed displacements. Eliminating u_i leaves
//!
//! - S u_b = r_b' (λ) + f_b, r' = r_b − K_bi K_ii⁻¹ r_i (2)
//!
//! which is all that the iterations see. u_i follows from the first of (1) when it is wanted.

use super::Singular;
use super::multifrontal::{Kind, Multifrontal};
use super::newton::Loads;
use crate::assembly::{System, Tie};
use crate::group::Group;

/// The linear part of a model during one phase.
#[derive(Debug)]
pub struct LinearDomain {
    system: System,
    factors: Multifrontal,
    /// Degrees of freedom of the boundary, in the order of the Schur complement.
    boundary: Vec<usize>,
    /// L⁻¹ r_i for λ⁰ and λ¹.
    y: [Vec<f64>; 2],
    /// r' for λ⁰ and λ¹.
    condensed: [Vec<f64>; 2],
    /// Displacements of the boundary since the start of the phase.
    moved: Vec<f64>,
}

/// Whether groups are linear enough, and large enough beside the others, for condensation to pay.
///
/// The dense equations of the boundary must not cost more than the sparse ones they replace.
fn pays(n_interior: usize, n_boundary: usize, n_rest: usize) -> bool {
    let dense = 5.0 * f64::sqrt(n_interior as f64);
    n_interior > n_rest && n_boundary as f64 <= dense
}

impl LinearDomain {
    /// Condenses the linear groups. `None` if there are none, or it does not pay unless `always`.
    ///
    /// # Errors
    /// [`Singular`] if they are not held where they are not connected to the rest.
    pub fn new(
        groups: &[Group],
        prescribed: &[bool],
        ties: &[Tie],
        always: bool,
    ) -> Result<Option<(Self, System)>, Singular> {
        let system = System::new(groups, Group::is_linear, prescribed, ties, None);
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
        let mut factors = Multifrontal::new(&system.pattern, kind, &kept)?;
        let mut values = Vec::new();
        system.assemble(groups, &mut values);
        factors.factorise(&values)?;
        let free = system.free();
        let boundary: Vec<usize> = factors.kept().iter().map(|&e| free[e as usize]).collect();
        let domain = Self {
            moved: vec![0.0; boundary.len()],
            boundary,
            factors,
            system,
            y: Default::default(),
            condensed: Default::default(),
        };
        Ok(Some((domain, rest)))
    }

    /// Stiffness of the boundary, column-major: S of (2).
    pub fn stiffness(&self) -> &[f64] {
        self.factors.schur()
    }

    /// Sets up the right-hand sides of a phase that starts from the groups' committed state.
    pub fn start(&mut self, groups: &[Group], loads: &Loads) {
        let n_dofs = self.system.n_dofs();
        let mut internal = vec![0.0; n_dofs];
        for (number, group) in groups.iter().enumerate() {
            if self.system.includes(number) {
                group
                    .kinematics
                    .add_forces(&group.stress.committed, &mut internal);
            }
        }
        self.system.fold(&mut internal);
        let mut prescribed = vec![0.0; n_dofs];
        for &(dof, start, end) in &loads.prescribed {
            prescribed[dof] = end - start;
        }
        let n = self.system.n_equations();
        let mut by_prescribed = vec![0.0; n];
        self.system
            .prescribed_forces(groups, &prescribed, &mut by_prescribed);
        let (at_start, at_end) = (loads.external(0.0), loads.external(1.0));
        let mut is_boundary = vec![false; n_dofs];
        self.boundary
            .iter()
            .for_each(|&dof| is_boundary[dof] = true);
        let mut constant = vec![0.0; n];
        let mut slope = vec![0.0; n];
        for (equation, &dof) in self.system.free().iter().enumerate() {
            constant[equation] = -internal[dof];
            slope[equation] = -by_prescribed[equation];
            // External forces on the boundary are left to the equations of the rest.
            if !is_boundary[dof] {
                constant[equation] += at_start[dof];
                slope[equation] += at_end[dof] - at_start[dof];
            }
        }
        let (y_0, condensed_0) = self.factors.forward(&constant);
        let (y_1, condensed_1) = self.factors.forward(&slope);
        self.y = [y_0, y_1];
        self.condensed = [condensed_0, condensed_1];
        self.moved.fill(0.0);
    }

    /// Internal forces on the boundary at load factor λ if it stays where it is, by
    /// [`System::boundary`].
    pub fn forces(&self, lambda: f64) -> Vec<f64> {
        let [constant, slope] = &self.condensed;
        let mut forces: Vec<f64> = constant
            .iter()
            .zip(slope)
            .map(|(c, s)| -(c + lambda * s))
            .collect();
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

    /// Displacements since the start of the phase at load factor λ, by degree of freedom: all
    /// unknowns of the domain. Others are left alone.
    pub fn expand(&self, lambda: f64, displacement: &mut [f64]) {
        let [y_0, y_1] = &self.y;
        let y: Vec<f64> = y_0.iter().zip(y_1).map(|(a, b)| a + lambda * b).collect();
        let values = self.factors.backward(&y, &self.moved);
        for (&dof, value) in self.system.free().iter().zip(values) {
            displacement[dof] = value;
        }
    }

    /// Degrees of freedom of the unknowns in the interior.
    pub fn interior(&self) -> impl Iterator<Item = usize> {
        let on_boundary = |dof: &usize| self.boundary.binary_search(dof).is_ok();
        self.system
            .free()
            .iter()
            .copied()
            .filter(move |dof| !on_boundary(dof))
    }

    /// Degrees of freedom of the domain's unknowns, boundary included.
    pub fn unknowns(&self) -> &[usize] {
        self.system.free()
    }
}
