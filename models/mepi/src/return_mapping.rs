//! Backward Euler: the scalar equation in Δλ, Eq. (A), and its root.
//!
//! | symbol | here | |
//! |---|---|---|
//! | σ*, \|τ*\| | `sigma`, `tau` of [`Increment`] | trial stress, compression positive |
//! | c(Δλ) | `contraction` | plastic contraction of the increment |
//! | w | `contraction_slope` | dc/dΔλ |
//! | g | `residual` | yield function at the end of the increment, Eq. (9) |

use crate::hardening::Branch;
use crate::interface::{Constants, STABILISATION_BOUND};
use abi::Failure;

/// One increment of a point in contact, after the elastic trial.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Increment<'a> {
    pub(crate) constants: &'a Constants,
    /// Plastic slip ξ and friction μ(ξ) at the start.
    pub(crate) xi: f64,
    pub(crate) mu: f64,
    /// σ*, and the larger of it and the normal stress at the start.
    pub(crate) sigma: f64,
    pub(crate) highest: f64,
    /// |τ*|.
    pub(crate) tau: f64,
}

/// A stretch of Δλ over which one expression of μ holds.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Leg {
    pub(crate) branch: Branch,
    /// Δλ from which β counts, and the contraction until there; both 0 unless μ jumps.
    pub(crate) origin: f64,
    pub(crate) contraction: f64,
}

/// Everything at one value of Δλ.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sample {
    pub(crate) d_lambda: f64,
    /// μ and its derivative.
    pub(crate) mu: f64,
    pub(crate) mu_slope: f64,
    /// c and w.
    pub(crate) contraction: f64,
    pub(crate) contraction_slope: f64,
    /// `σ_n`.
    pub(crate) sigma: f64,
    /// g and its derivative.
    pub(crate) residual: f64,
    pub(crate) residual_slope: f64,
}

/// How the plastic flow of an increment ends.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Flow {
    /// On the yield surface.
    Slides(Sample),
    /// At `u_tp`, inside the surface that μ jumps to.
    StopsAtPeak(Sample),
    /// Contact is lost on the way; where the contraction uses up `σ_n`, if that is the cause.
    LosesContact { exhausted: Option<f64> },
}

/// After a relative step of this size Newton's next value is exact to round-off.
pub(crate) const LAST_STEP: f64 = 1e-9;
const MAX_NEWTON: usize = 12;

impl Increment<'_> {
    /// The first leg of the increment.
    pub(crate) fn first_leg(&self) -> Leg {
        Leg {
            branch: self.constants.hardening.branch(self.xi),
            origin: 0.0,
            contraction: 0.0,
        }
    }

    /// Δλ at the peak, if it lies ahead.
    pub(crate) fn distance_to_peak(&self) -> Option<f64> {
        let softening = self.constants.hardening.softening?;
        (self.xi < softening.u_tp).then_some(softening.u_tp - self.xi)
    }

    /// The leg beyond the peak, which the first leg reached at this sample.
    pub(crate) fn second_leg(&self, at_peak: &Sample) -> Leg {
        let jumps = self.constants.hardening.softening.is_some_and(|s| s.jumps);
        Leg {
            branch: Branch::Softening,
            origin: if jumps { at_peak.d_lambda } else { 0.0 },
            contraction: if jumps { at_peak.contraction } else { 0.0 },
        }
    }

    /// Evaluates Eq. (A).
    #[inline]
    pub(crate) fn sample(&self, leg: &Leg, d_lambda: f64) -> Sample {
        let Constants {
            K_n,
            K_t,
            ref hardening,
            ..
        } = *self.constants;
        let xi = self.xi + d_lambda;
        let mu = hardening.friction(leg.branch, xi);
        let beta = hardening.contraction_rate(mu, xi);
        // Eq. (14), at the end of the increment.
        let travel = d_lambda - leg.origin;
        let contraction = leg.contraction + travel * beta.value;
        let contraction_slope = beta.value + travel * beta.slope;
        // Eq. (6), and Eq. (A) with its derivative.
        let sigma = self.sigma - K_n * contraction;
        let residual = self.tau - K_t * d_lambda - mu.value * sigma;
        let residual_slope = K_n * mu.value * contraction_slope - K_t - mu.slope * sigma;
        Sample {
            d_lambda,
            mu: mu.value,
            mu_slope: mu.slope,
            contraction,
            contraction_slope,
            sigma,
            residual,
            residual_slope,
        }
    }

    /// Plastic contraction after Δλ, across the peak if need be.
    pub(crate) fn contraction(&self, d_lambda: f64) -> f64 {
        let leg = self.first_leg();
        match self.distance_to_peak() {
            Some(peak) if d_lambda > peak => {
                let leg = self.second_leg(&self.sample(&leg, peak));
                self.sample(&leg, d_lambda).contraction
            }
            _ => self.sample(&leg, d_lambda).contraction,
        }
    }

    /// Follows the flow from Δλ = 0, where the trial stress lies outside the yield surface, to the
    /// first root of g or the loss of contact.
    #[inline]
    pub(crate) fn flow(&self) -> Result<Flow, Failure> {
        let leg = self.first_leg();
        // Beyond this slip τ would change sign.
        let limit = self.tau / self.constants.K_t;
        let end = self.distance_to_peak().map_or(limit, |p| p.min(limit));
        let candidate = self.newton(&leg, self.first_guess(&leg), end);
        match candidate {
            Some(root) if self.is_first_root(&leg, &root) => Ok(Flow::Slides(root)),
            _ => self.march(leg, limit, candidate.map(|root| root.d_lambda)),
        }
    }

    /// Δλ with `σ_n` frozen at its trial value: exact under constant normal stress.
    fn first_guess(&self, leg: &Leg) -> f64 {
        let K_t = self.constants.K_t;
        let hardening = &self.constants.hardening;
        let excess = self.tau - self.mu * self.sigma;
        if leg.branch == Branch::Softening {
            return excess / K_t;
        }
        // Eq. (10) in |τ*| − K_t Δλ − μ σ* = 0 gives K_t Δλ² − q Δλ − r = 0.
        let rise = hardening.mu_p - hardening.mu_0;
        let scale = hardening.slip_scale + self.xi;
        let q = self.tau - K_t * scale - (hardening.mu_0 + rise) * self.sigma;
        let r = scale * excess;
        let root = (q * q + 4.0 * K_t * r).sqrt();
        if q > 0.0 {
            (q + root) / (2.0 * K_t)
        } else {
            2.0 * r / (root - q)
        }
    }

    /// The sample a small step further on, where the curvature is below round-off.
    fn moved(&self, from: &Sample, step: f64) -> Sample {
        let contraction = from.contraction + step * from.contraction_slope;
        Sample {
            d_lambda: from.d_lambda + step,
            mu: from.mu + step * from.mu_slope,
            contraction,
            sigma: self.sigma - self.constants.K_n * contraction,
            residual: from.residual + step * from.residual_slope,
            ..*from
        }
    }

    /// Newton's method on (0, end]; none if it leaves the interval or does not converge.
    #[inline]
    fn newton(&self, leg: &Leg, start: f64, end: f64) -> Option<Sample> {
        let mut d_lambda = start;
        for _ in 0..MAX_NEWTON {
            if !(d_lambda > 0.0 && d_lambda <= end) {
                return None;
            }
            let sample = self.sample(leg, d_lambda);
            let next = d_lambda - sample.residual / sample.residual_slope;
            let step = (next - d_lambda).abs();
            if step <= f64::EPSILON * d_lambda {
                return Some(sample);
            }
            if step <= LAST_STEP * d_lambda && next <= end {
                return Some(self.moved(&sample, next - d_lambda));
            }
            d_lambda = next;
        }
        None
    }

    /// Quick proof that neither another root nor the loss of contact comes before this root. False
    /// where it would take more than a few operations.
    #[inline]
    fn is_first_root(&self, leg: &Leg, root: &Sample) -> bool {
        let Constants {
            K_n,
            K_t,
            ref hardening,
            one_root,
        } = *self.constants;
        let mu_c0 = hardening.mu_c0;
        let (low, high) = (self.mu.min(root.mu), self.mu.max(root.mu));
        let (contracts, dilates) = ((mu_c0 - low).max(0.0), (high - mu_c0).max(0.0));
        if self.keeps_contact(root.d_lambda * contracts) {
            match (leg.branch, &hardening.softening) {
                (Branch::Softening, Some(softening)) => {
                    // |dμ/dξ| is largest where sech z tanh z is, at 1/2.
                    let slope = 0.5 * softening.rate * (softening.mu_pk - softening.mu_r).abs();
                    let travel = root.d_lambda;
                    let sigma = self.sigma.abs() + K_n * travel * contracts.max(dilates);
                    let rate = contracts.max(STABILISATION_BOUND * dilates) + travel * slope;
                    if slope * sigma + K_n * high * rate < K_t {
                        return true;
                    }
                }
                _ if one_root => return true,
                _ => {}
            }
        }
        let bounds = self.bounds(leg, &self.sample(leg, 0.0), root);
        bounds.residual_slope < 0.0 && self.keeps_contact(bounds.contraction_high)
    }

    /// A plastic contraction that leaves the faces in contact at the highest normal stress of the
    /// increment; if it does not, contact is lost for certain.
    pub(crate) fn keeps_contact(&self, contraction: f64) -> bool {
        self.highest >= self.constants.K_n * contraction
    }
}
