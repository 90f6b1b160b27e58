//! Loads over a phase.
//!
//! Vectors are by degree of freedom here: loads know nothing of the places of a system.

use serde::{Deserialize, Serialize};

/// Loads over a phase, as functions of the load factor λ from 0 to 1.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Loads {
    /// External forces at λ = 0, by degree of freedom.
    pub force_start: Vec<f64>,
    /// External forces at λ = 1.
    pub force_end: Vec<f64>,
    /// Prescribed displacements: degree of freedom, value at λ = 0, value at λ = 1.
    pub prescribed: Vec<(usize, f64, f64)>,
    /// Forces out of balance at the start, carried to equilibrium in proportion to λ.
    pub out_of_balance: Vec<f64>,
    /// Largest of the forces (2-norms) at the start of the phase, and what rounding leaves of those of
    /// earlier phases: where all forces vanish, the residual is still measured against something.
    pub scale: f64,
    /// The same at every degree of freedom.
    pub largest: Vec<f64>,
}

impl Loads {
    /// External forces and what is left of the forces out of balance.
    pub fn external(&self, lambda: f64) -> Vec<f64> {
        let ends = self.force_start.iter().zip(&self.force_end);
        ends.zip(&self.out_of_balance)
            .map(|((start, end), rest)| start + lambda * (end - start) + (1.0 - lambda) * rest)
            .collect()
    }

    /// Change of the external forces with λ, by degree of freedom.
    pub(super) fn external_rate(&self) -> Vec<f64> {
        let ends = self.force_start.iter().zip(&self.force_end);
        ends.zip(&self.out_of_balance)
            .map(|((start, end), rest)| end - start - rest)
            .collect()
    }

    /// Change of prescribed displacements with λ, by degree of freedom.
    pub(super) fn prescribed_rate(&self) -> Vec<f64> {
        let mut rate = vec![0.0; self.force_start.len()];
        for &(dof, start, end) in &self.prescribed {
            rate[dof] = end - start;
        }
        rate
    }

    /// Increments of prescribed displacements between two load factors, by degree of freedom.
    pub(super) fn prescribed_increments(&self, from: f64, to: f64) -> Vec<f64> {
        let mut increments = vec![0.0; self.force_start.len()];
        for &(dof, start, end) in &self.prescribed {
            increments[dof] = Self::value(start, end, to) - Self::value(start, end, from);
        }
        increments
    }

    /// Value of a prescribed displacement; exact at both ends.
    fn value(start: f64, end: f64, lambda: f64) -> f64 {
        if lambda >= 1.0 {
            end
        } else {
            start + lambda * (end - start)
        }
    }
}
