//! Bounds of the scalar equation over an interval of Δλ, from the values of μ and
//! 1/cosh at its ends: both are monotonic on a leg.

use crate::hardening::{Branch, sech_tanh};
use crate::interface::{Constants, STABILISATION_BOUND};
use crate::return_mapping::{Increment, Leg, Sample};

/// Bounds over an interval.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bounds {
    /// Upper bound of c.
    pub(crate) contraction_high: f64,
    /// Upper bound of `σ_n`.
    pub(crate) sigma_high: f64,
    /// Lower bound of g.
    pub(crate) residual_low: f64,
    /// Upper bound of dg/dΔλ.
    pub(crate) residual_slope: f64,
}

impl Increment<'_> {
    /// Bounds between two samples of a leg.
    pub(crate) fn bounds(&self, leg: &Leg, from: &Sample, to: &Sample) -> Bounds {
        let Constants {
            K_n,
            K_t,
            ref hardening,
            ..
        } = *self.constants;
        let (travel_from, travel_to) = (from.d_lambda - leg.origin, to.d_lambda - leg.origin);
        let (xi_from, xi_to) = (self.xi + from.d_lambda, self.xi + to.d_lambda);

        // μ is monotonic on a leg; so is its slope under Eq. (10).
        let (mu_low, mu_high) = (from.mu.min(to.mu), from.mu.max(to.mu));
        let (slope_low, slope_high) = match (leg.branch, &hardening.softening) {
            (Branch::Softening, Some(softening)) => {
                let (sech_from, tanh_from) = sech_tanh(softening.rate * (xi_from - softening.u_tp));
                let (sech_to, tanh_to) = sech_tanh(softening.rate * (xi_to - softening.u_tp));
                let scale = (softening.mu_r - softening.mu_pk) * softening.rate;
                let one = scale * sech_to * tanh_from;
                let other = scale * (sech_from * tanh_to).min(0.5);
                (one.min(other), one.max(other))
            }
            _ => (to.mu_slope, from.mu_slope),
        };

        // β before and after the characteristic state, and w = β + Δλ β'.
        let mu_c0 = hardening.mu_c0;
        let (sech_from, tanh_to, sech_to) = if mu_high > mu_c0 {
            let (sech_to, tanh_to) = hardening.stabilisation(xi_to);
            (hardening.stabilisation(xi_from).0, tanh_to, sech_to)
        } else {
            (1.0, 1.0, 1.0)
        };
        let (before, after) = (mu_low < mu_c0, mu_high > mu_c0);
        let beyond_low = (mu_low - mu_c0).max(0.0);
        let beyond_high = (mu_high - mu_c0).max(0.0);
        let beta_high = if before {
            mu_c0 - mu_low
        } else {
            -beyond_low * sech_to
        };
        let beta_low = if after {
            -beyond_high * sech_from
        } else {
            mu_c0 - mu_high
        };
        let mut rate_high = f64::NEG_INFINITY;
        if before {
            let travel = if slope_low < 0.0 {
                travel_to
            } else {
                travel_from
            };
            rate_high = mu_c0 - mu_low - travel * slope_low;
        }
        if after || !before {
            let hardening_part = if slope_low < 0.0 {
                travel_to * slope_low * sech_from
            } else {
                travel_from * slope_low * sech_to
            };
            let q = travel_to * hardening.stabilisation_rate * tanh_to - 1.0;
            let stabilisation_part = if q > 0.0 {
                (sech_from * q).min(STABILISATION_BOUND) * beyond_high
            } else {
                sech_to * q * beyond_low
            };
            rate_high = rate_high.max(stabilisation_part - hardening_part);
        }

        let contraction_high = (leg.contraction
            + (travel_from * beta_high).max(travel_to * beta_high))
        .min(from.contraction + (to.d_lambda - from.d_lambda) * rate_high.max(0.0));
        let contraction_low = leg.contraction + (travel_from * beta_low).min(travel_to * beta_low);
        let sigma_low = self.sigma - K_n * contraction_high;
        let sigma_high = self.sigma - K_n * contraction_low;

        let friction_part = [
            slope_low * sigma_low,
            slope_low * sigma_high,
            slope_high * sigma_low,
            slope_high * sigma_high,
        ]
        .into_iter()
        .fold(f64::INFINITY, f64::min);
        let coupling = rate_high * if rate_high > 0.0 { mu_high } else { mu_low };
        let mobilised = sigma_high * if sigma_high > 0.0 { mu_high } else { mu_low };
        Bounds {
            contraction_high,
            sigma_high,
            residual_low: self.tau - K_t * to.d_lambda - mobilised,
            residual_slope: K_n * coupling - K_t - friction_part,
        }
    }
}
