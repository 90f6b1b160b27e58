//! What the two laws share: their common parameters made ready, and the internal variables.

use crate::hardening::{Hardening, Softening};
use abi::substepping::Scheme;
use abi::{Failure, Refusal, Variable};

abi::internal_variables! {
    /// Internal variables of both laws.
    pub struct State {
        /// Plastic slip, accumulated over both directions.
        plastic_slip: Variable::scalar(c"ξ", c"m"),
        /// Initial normal stress, compression positive.
        sigma_ni: Variable::scalar(c"σ_ni", c"kPa"),
        /// Opening since contact was lost; 0 in contact.
        gap: Variable::scalar(c"g", c"m"),
        /// Plastic normal relative displacement, contraction positive.
        plastic_contraction: Variable::scalar(c"[u_n^p]", c"m"),
    }
}

/// The parameters that both laws have, under the paper's names.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Common {
    pub(crate) k_n: f64,
    pub(crate) k_t: f64,
    pub(crate) n: f64,
    pub(crate) mu_0: f64,
    pub(crate) mu_p: f64,
    pub(crate) mu_c0: f64,
    pub(crate) a: f64,
    pub(crate) c_0: f64,
    pub(crate) t: f64,
    pub(crate) p_0: f64,
    pub(crate) sigma_ni: f64,
}

/// The parameters of Eq. (11).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Peak {
    pub(crate) mu_r: f64,
    pub(crate) a_0: f64,
    pub(crate) u_tp: f64,
    pub(crate) published: bool,
}

/// The constants of a point, all of them fixed by `σ_ni`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Constants {
    /// `K_n`.
    pub(crate) normal_stiffness: f64,
    /// `K_t`.
    pub(crate) shear_stiffness: f64,
    /// μ and β.
    pub(crate) hardening: Hardening,
    /// As long as Eq. (10) holds, the scalar equation has one root at most.
    pub(crate) one_root: bool,
}

/// A law of this crate, ready for use.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Interface {
    common: Common,
    peak: Option<Peak>,
    one_root: bool,
    /// Constants of the points whose `σ_ni` is the parameter.
    given: Option<Constants>,
    pub(crate) scheme: Scheme,
}

/// The largest value of (z tanh z − 1)/cosh z, which is 0.25114…
pub(crate) const STABILISATION_BOUND: f64 = 0.2512;

impl Interface {
    /// Checks how the parameters go together.
    pub(crate) fn new(common: Common, peak: Option<Peak>, scheme: Scheme) -> Result<Self, Refusal> {
        let Common {
            mu_0, mu_p, mu_c0, ..
        } = common;
        for (id, value) in [("mu_0", mu_0), ("mu_c0", mu_c0)] {
            if value > mu_p {
                return Err(Refusal::new(id, format!("{value} is above mu_p = {mu_p}")));
            }
        }
        if let Some(Peak { mu_r, .. }) = peak
            && mu_r > mu_p
        {
            return Err(Refusal::new(
                "mu_r",
                format!("{mu_r} is above mu_p = {mu_p}"),
            ));
        }
        if scheme != Scheme::Implicit && peak.is_some_and(|peak| peak.published) {
            let reason = "only `implicit` follows the jump of `peak = \"published\"`";
            return Err(Refusal::new("scheme", reason));
        }
        // Bounds of μ d(Δλ β)/dΔλ before and after the characteristic state, see LAW.md.
        let coupling = (0.25 * mu_c0 * mu_c0).max(STABILISATION_BOUND * mu_p * (mu_p - mu_c0));
        let mut law = Self {
            common,
            peak,
            one_root: common.k_n * coupling < common.k_t,
            given: None,
            scheme,
        };
        if !common.sigma_ni.is_nan() {
            law.given = Some(law.computed_constants(common.sigma_ni));
        }
        Ok(law)
    }

    /// `σ_ni` is the parameter or the initial normal stress.
    pub(crate) fn initial_state(&self, traction: &[f64; 2]) -> Result<State, Failure> {
        let sigma_ni = if self.given.is_some() {
            self.common.sigma_ni
        } else {
            -traction[0]
        };
        if sigma_ni > 0.0 {
            Ok(State {
                plastic_slip: 0.0,
                sigma_ni,
                gap: 0.0,
                plastic_contraction: 0.0,
            })
        } else {
            Err(Failure::Domain(
                "the initial normal stress is not compressive and `sigma_ni` is not given",
            ))
        }
    }

    /// The constants of a point.
    #[inline]
    pub(crate) fn constants(&self, sigma_ni: f64) -> Constants {
        match self.given {
            Some(given) if sigma_ni.to_bits() == self.common.sigma_ni.to_bits() => given,
            _ => self.computed_constants(sigma_ni),
        }
    }

    fn computed_constants(&self, sigma_ni: f64) -> Constants {
        let common = &self.common;
        // Eq. (7).
        let power = if common.n > 0.0 {
            sigma_ni.powf(common.n)
        } else {
            1.0
        };
        let ratio = sigma_ni / common.p_0;
        let mut hardening = Hardening {
            initial: common.mu_0,
            rise: common.mu_p - common.mu_0,
            slip_scale: common.a * ratio * common.t,
            characteristic: common.mu_c0,
            stabilisation_rate: common.c_0 * ratio / common.t,
            softening: None,
        };
        if let Some(peak) = self.peak {
            let reached = peak.u_tp / (hardening.slip_scale + peak.u_tp);
            hardening.softening = Some(Softening {
                start: peak.u_tp,
                peak: if peak.published {
                    common.mu_p
                } else {
                    // Eq. (10) at u_tp.
                    hardening.initial + hardening.rise * reached
                },
                residual: peak.mu_r,
                rate: peak.a_0 / common.t,
                jumps: peak.published,
            });
        }
        Constants {
            normal_stiffness: common.k_n * power,
            shear_stiffness: common.k_t * power,
            hardening,
            one_root: self.one_root,
        }
    }
}
