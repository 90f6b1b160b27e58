//! Loads over a phase.
//!
//! Vectors are by degree of freedom here: loads know nothing of the places of a system.

use serde::{Deserialize, Serialize};

/// Loads over a leg of a phase, linear in the phase's time λ from 0 to 1; a phase without a course is one
/// leg.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Loads {
    /// Times at which the leg starts and ends.
    pub leg: [f64; 2],
    /// External forces at the leg's start, by degree of freedom.
    #[serde(with = "crate::numbers")]
    pub force_start: Vec<f64>,
    /// External forces at its end.
    #[serde(with = "crate::numbers")]
    pub force_end: Vec<f64>,
    /// Prescribed displacements: degree of freedom, value at the leg's start, value at its end.
    pub prescribed: Vec<(usize, f64, f64)>,
    /// Forces out of balance at the start of the phase, carried to equilibrium in proportion to λ.
    #[serde(with = "crate::numbers")]
    pub out_of_balance: Vec<f64>,
    /// Largest of the forces (2-norms) at the start of the phase, and what rounding leaves of those of
    /// earlier phases: where all forces vanish, the residual is still measured against something.
    pub scale: f64,
    /// The same at every degree of freedom.
    #[serde(with = "crate::numbers")]
    pub largest: Vec<f64>,
    /// Nodal forces of the stresses in the iterated groups at the start of the phase, if residuals are measured against
    /// their change.
    #[serde(with = "crate::numbers")]
    pub carried: Vec<f64>,
}

impl Default for Loads {
    fn default() -> Self {
        Self {
            leg: [0.0, 1.0],
            force_start: Vec::new(),
            force_end: Vec::new(),
            prescribed: Vec::new(),
            out_of_balance: Vec::new(),
            scale: 0.0,
            largest: Vec::new(),
            carried: Vec::new(),
        }
    }
}

impl Loads {
    /// How far along the leg λ is.
    fn share(&self, lambda: f64) -> f64 {
        (lambda - self.leg[0]) / self.length()
    }

    fn length(&self) -> f64 {
        self.leg[1] - self.leg[0]
    }

    /// External forces, without those out of balance.
    pub fn forces(&self, lambda: f64) -> impl Iterator<Item = f64> {
        let share = self.share(lambda);
        let ends = self.force_start.iter().zip(&self.force_end);
        ends.map(move |(start, end)| start + share * (end - start))
    }

    /// External forces and what is left of the forces out of balance.
    pub fn external(&self, lambda: f64) -> Vec<f64> {
        let forces = self.forces(lambda).zip(&self.out_of_balance);
        forces
            .map(|(force, rest)| force + (1.0 - lambda) * rest)
            .collect()
    }

    /// One of them.
    pub fn external_at(&self, dof: usize, lambda: f64) -> f64 {
        let (start, end) = (self.force_start[dof], self.force_end[dof]);
        start + self.share(lambda) * (end - start) + (1.0 - lambda) * self.out_of_balance[dof]
    }

    /// Change of the external forces with λ, by degree of freedom.
    pub(in crate::equilibrium) fn external_rate(&self) -> Vec<f64> {
        let ends = self.force_start.iter().zip(&self.force_end);
        ends.zip(&self.out_of_balance)
            .map(|((start, end), rest)| (end - start) / self.length() - rest)
            .collect()
    }

    /// Change of prescribed displacements with λ, by degree of freedom.
    pub fn prescribed_rate(&self) -> Vec<f64> {
        let mut rate = vec![0.0; self.force_start.len()];
        for &(dof, start, end) in &self.prescribed {
            rate[dof] = (end - start) / self.length();
        }
        rate
    }

    /// Increments of prescribed displacements between two load factors, by degree of freedom.
    pub(in crate::equilibrium) fn prescribed_increments(&self, from: f64, to: f64) -> Vec<f64> {
        let mut increments = vec![0.0; self.force_start.len()];
        for &(dof, start, end) in &self.prescribed {
            increments[dof] = self.value(start, end, to) - self.value(start, end, from);
        }
        increments
    }

    /// Value of a prescribed displacement; exact at both ends.
    fn value(&self, start: f64, end: f64, lambda: f64) -> f64 {
        if lambda >= self.leg[1] {
            end
        } else {
            start + self.share(lambda) * (end - start)
        }
    }
}
