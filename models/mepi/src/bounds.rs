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

impl Bounds {
    /// Whether g has no root before the end of the interval.
    pub(crate) fn has_no_root(&self, end: &Sample) -> bool {
        self.residual_low > 0.0
            || self.sigma_high < 0.0
            || (self.residual_slope < 0.0 && end.residual > 0.0)
    }
}

/// Bounds of β, and of the rate of contraction.
struct ContractionRate {
    beta_low: f64,
    beta_high: f64,
    /// Upper bound of w = β + Δλ β'.
    rate_high: f64,
}

impl Increment<'_> {
    /// Bounds of dμ/dξ, which is monotonic on a leg as well, under Eq. (10).
    fn slope_bounds(&self, leg: &Leg, from: &Sample, to: &Sample) -> (f64, f64) {
        let (Branch::Softening, Some(softening)) =
            (leg.branch, &self.constants.hardening.softening)
        else {
            return (to.mu_slope, from.mu_slope);
        };
        let at = |sample: &Sample| softening.rate * (self.xi + sample.d_lambda - softening.u_tp);
        let (sech_from, tanh_from) = sech_tanh(at(from));
        let (sech_to, tanh_to) = sech_tanh(at(to));
        let scale = (softening.mu_r - softening.mu_pk) * softening.rate;
        let one = scale * sech_to * tanh_from;
        let other = scale * (sech_from * tanh_to).min(0.5);
        (one.min(other), one.max(other))
    }

    /// Bounds of β and w before and after the characteristic state.
    fn contraction_rate(
        &self,
        [xi_from, xi_to]: [f64; 2],
        [travel_from, travel_to]: [f64; 2],
        [mu_low, mu_high]: [f64; 2],
        slope_low: f64,
    ) -> ContractionRate {
        let hardening = &self.constants.hardening;
        let mu_c0 = hardening.mu_c0;
        let (sech_from, tanh_to, sech_to) = if mu_high > mu_c0 {
            let (sech_to, tanh_to) = hardening.stabilisation(xi_to);
            (hardening.stabilisation(xi_from).0, tanh_to, sech_to)
        } else {
            (1.0, 1.0, 1.0)
        };
        let (before, after) = (mu_low < mu_c0, mu_high > mu_c0);
        let [beyond_low, beyond_high] = [mu_low, mu_high].map(|mu| (mu - mu_c0).max(0.0));
        let mut rate_high = f64::NEG_INFINITY;
        let (travel, sech) = if slope_low < 0.0 {
            (travel_to, sech_from)
        } else {
            (travel_from, sech_to)
        };
        if before {
            rate_high = mu_c0 - mu_low - travel * slope_low;
        }
        if after || !before {
            let hardening_part = travel * slope_low * sech;
            let q = travel_to * hardening.stabilisation_rate * tanh_to - 1.0;
            let stabilisation_part = if q > 0.0 {
                (sech_from * q).min(STABILISATION_BOUND) * beyond_high
            } else {
                sech_to * q * beyond_low
            };
            rate_high = rate_high.max(stabilisation_part - hardening_part);
        }
        ContractionRate {
            beta_low: if after {
                -beyond_high * sech_from
            } else {
                mu_c0 - mu_high
            },
            beta_high: if before {
                mu_c0 - mu_low
            } else {
                -beyond_low * sech_to
            },
            rate_high,
        }
    }

    /// Bounds between two samples of a leg.
    pub(crate) fn bounds(&self, leg: &Leg, from: &Sample, to: &Sample) -> Bounds {
        let Constants { K_n, K_t, .. } = *self.constants;
        let (travel_from, travel_to) = (from.d_lambda - leg.origin, to.d_lambda - leg.origin);
        let (xi_from, xi_to) = (self.xi + from.d_lambda, self.xi + to.d_lambda);

        // μ is monotonic on a leg.
        let (mu_low, mu_high) = (from.mu.min(to.mu), from.mu.max(to.mu));
        let (slope_low, slope_high) = self.slope_bounds(leg, from, to);
        let ContractionRate {
            beta_low,
            beta_high,
            rate_high,
        } = self.contraction_rate(
            [xi_from, xi_to],
            [travel_from, travel_to],
            [mu_low, mu_high],
            slope_low,
        );

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
