//! Water in the pores of a group.
//!
//! Its hydrostatic pressure is known beforehand, and acts as a load. Undrained ground adds an excess
//! pressure u that follows from the volume strain: with compression positive,
//!
//! - Δu = −(K_w/n) Δε_v (1)
//! - K_w/n = 2G (1 + ν_u)/(3 (1 − 2ν_u)) − K' (2)
//!
//! where G and K' are those of the law's elastic operator and ν_u is Poisson's ratio of the undrained ground. The law
//! sees effective stresses σ'; the element carries σ' − u δ, with the tangent D + (K_w/n) δ δᵀ. When it drains again,
//! the remaining u dissipates in proportion to the phase's time, however long that is; what an early end of the phase
//! leaves stays.

use super::PointFailure;
use crate::element::Axes;
use crate::group::{Field, Group};
use crate::problem::{Drainage, Water};
use law::Operator;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// Pore water that follows the deformation.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(in crate::group) struct Pores {
    pub(in crate::group) drainage: Drainage,
    /// Excess pressure of every point, compression positive, kPa.
    pub(in crate::group) excess: Field,
    /// K_w/n of every point, kPa; nothing while it drains.
    stiffness: Vec<f64>,
    /// The phase that drained it has ended early: the excess pressure left stays.
    is_left: bool,
}

impl Group {
    /// Undrained from now on, or drained again. Inside: Poisson's ratio of the law where ν_u does not exceed
    /// it, so that (2) leaves no stiffness to the water.
    ///
    /// # Errors
    /// The law has no elastic operator.
    pub(crate) fn set_drainage(
        &mut self,
        drainage: Drainage,
        nu_u: f64,
    ) -> Result<Result<(), f64>, PointFailure> {
        if drainage == Drainage::Drained {
            if let Some(pores) = &mut self.pores {
                pores.drainage = drainage;
                pores.stiffness = Vec::new();
            }
            return Ok(Ok(()));
        }
        let n = self.kinematics.n_points();
        // Its equations are no longer those of the law alone.
        if self.tangents.are_constant {
            self.tangents.are_constant = false;
            self.tangents.values = vec![0.0; 16 * n];
        }
        let mut operator = vec![0.0; 16 * n];
        let time = self.moment.step_start;
        self.run_law(Operator::Elastic, (time, 0.0), &mut operator)
            .map_err(|failure| self.locate(&failure))?;
        self.forget_trial();
        let mut stiffness = Vec::with_capacity(n);
        for d in operator.chunks_exact(16) {
            let bulk = (0..9).map(|i| d[4 * (i / 3) + i % 3]).sum::<f64>() / 9.0;
            let shear = d[15];
            let undrained = 2.0 * shear * (1.0 + nu_u) / (3.0 * (1.0 - 2.0 * nu_u));
            if undrained <= bulk {
                return Ok(Err(
                    (3.0 * bulk - 2.0 * shear) / (2.0 * (3.0 * bulk + shear))
                ));
            }
            stiffness.push(undrained - bulk);
        }
        let excess = match self.pores.take() {
            Some(pores) => pores.excess,
            None => Field::new(vec![0.0; n]),
        };
        self.pores = Some(Pores {
            drainage,
            excess,
            stiffness,
            is_left: false,
        });
        Ok(Ok(()))
    }

    /// Excess pore pressure of a point (committed), kPa.
    pub fn excess_pore_pressure(&self, point: usize) -> f64 {
        let pores = self.pores.as_ref();
        pores.map_or(0.0, |pores| pores.excess.committed[point])
    }

    /// Whether what is left of a draining excess pressure stays, or dissipates.
    pub(crate) fn leave_excess(&mut self, is_left: bool) {
        if let Some(pores) = &mut self.pores {
            pores.is_left = is_left;
        }
    }

    /// Whether it is undrained now.
    pub(crate) fn is_undrained(&self) -> bool {
        let pores = self.pores.as_ref();
        pores.is_some_and(|pores| pores.drainage == Drainage::Undrained)
    }

    /// Excess pressures of the trial state: (1), or what draining leaves of them.
    pub(in crate::group) fn follow_pores(&mut self, time: f64, time_increment: f64) {
        let swollen = self.swollen();
        let Some(pores) = &mut self.pores else {
            return;
        };
        pores.excess.begin();
        let Field { committed, trial } = &mut pores.excess;
        if pores.drainage == Drainage::Undrained {
            let strains = self.strain.trial.chunks_exact(4);
            let strains = strains.zip(self.strain.committed.chunks_exact(4));
            let volume = |e: &[f64]| e[0] + e[1] + e[2];
            let points = trial.iter_mut().zip(&*committed).zip(&pores.stiffness);
            for (((u, u_0), k), (strain, strain_0)) in points.zip(strains) {
                *u = u_0 - k * (volume(strain) - volume(strain_0) + swollen);
            }
        } else if !pores.is_left {
            let since = (time - self.moment.step_start) / self.moment.step_length;
            let share = time_increment / self.moment.step_length;
            let left = |share: f64| (1.0 - share).max(0.0);
            let share = if left(since) > 0.0 {
                left(since + share) / left(since)
            } else {
                0.0
            };
            for (u, u_0) in trial.iter_mut().zip(&*committed) {
                *u = share * u_0;
            }
        }
    }

    /// Adds the pore water's stiffness to tangents of the law.
    pub(in crate::group) fn stiffen(&self, tangents: &mut [f64]) {
        let Some(pores) = self.pores.as_ref().filter(|_| self.is_undrained()) else {
            return;
        };
        for (d, k) in tangents.chunks_exact_mut(16).zip(&pores.stiffness) {
            for i in 0..9 {
                d[4 * (i / 3) + i % 3] += k;
            }
        }
    }

    /// Stresses that the elements carry, of the committed state: with excess pore pressure, of interfaces with what
    /// exact integration adds to the tractions that they began with.
    pub fn carried(&self) -> Cow<'_, [f64]> {
        self.with_excess(&self.stress.committed, |excess| &excess.committed)
    }

    /// The same of the trial state.
    pub fn carried_on_trial(&self) -> Cow<'_, [f64]> {
        self.with_excess(&self.stress.trial, |excess| &excess.trial)
    }

    fn with_excess<'s>(
        &'s self,
        stress: &'s [f64],
        of: impl Fn(&Field) -> &Vec<f64>,
    ) -> Cow<'s, [f64]> {
        if !self.correction.is_empty() {
            let both = stress.iter().zip(&self.correction);
            return both.map(|(stress, more)| stress + more).collect();
        }
        let Some(pores) = &self.pores else {
            return Cow::Borrowed(stress);
        };
        let mut carried = stress.to_vec();
        for (stress, u) in carried.chunks_exact_mut(4).zip(of(&pores.excess)) {
            stress[..3].iter_mut().for_each(|component| *component -= u);
        }
        Cow::Owned(carried)
    }

    /// Stresses of a pressure in the pores of an element, or between its faces, point by point.
    pub fn pore_flux(&self, element: usize, pressure: impl Fn([f64; 2]) -> f64) -> Vec<f64> {
        let n = self.kinematics.n_components();
        let between = |at: [f64; 2], _: &Axes| [pressure(at), 0.0];
        if let Some(gathered) = self.kinematics.gathered(element, &between) {
            return gathered.into_flattened();
        }
        let of_point = |point: usize| {
            let mut flux = [0.0; 4];
            // Of a traction, the normal component.
            flux[..if n == 2 { 1 } else { 3 }].fill(pressure(self.kinematics.position(point)));
            flux.into_iter().take(n)
        };
        self.kinematics
            .points_of(element)
            .flat_map(of_point)
            .collect()
    }

    /// Adds the nodal forces of hydrostatic pore pressures, in all elements or in some.
    pub fn add_pore_forces(&self, water: &Water, elements: Option<&[usize]>, force: &mut [f64]) {
        let n = self.kinematics.n_components();
        let mut flux = vec![0.0; n * self.kinematics.n_points()];
        let all = 0..self.kinematics.n_elements();
        let some = elements.map_or_else(|| all.collect(), <[usize]>::to_vec);
        for element in some {
            let points = self.kinematics.points_of(element);
            let own = self.pore_flux(element, |at| water.pressure(at));
            flux[n * points.start..n * points.end].copy_from_slice(&own);
        }
        if flux.iter().any(|pressure| *pressure != 0.0) {
            self.kinematics.add_forces(&flux, force);
        }
    }
}
