//! What the two laws share: their common parameters made ready, and the internal variables.

use crate::hardening::{Hardening, Softening};
use abi::substepping::Scheme;
use abi::{Failure, Parameter, Refusal, Variable};

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

abi::parameters! {
    /// The parameters that both laws have, in the letters of the paper.
    pub struct Common {
        /// Normal stiffness at a normal stress of 1 kPa.
        k_n: Parameter::new(c"k_n", c"kPa^(1-N)/m").above(0.0).usual(1e2, 1e9),
        /// Shear stiffness at a normal stress of 1 kPa.
        k_t: Parameter::new(c"k_t", c"kPa^(1-N)/m").above(0.0).usual(1e2, 1e9),
        /// Exponent of the normal stress in the stiffnesses.
        n: Parameter::new(c"N", c"-").at_least(0.0).at_most(2.0).usual(0.0, 1.0),
        /// Friction coefficient at the end of the elastic range.
        mu_0: Parameter::new(c"μ_0", c"-").at_least(0.0).usual(0.0, 1.0),
        /// Friction coefficient at failure.
        mu_p: Parameter::new(c"μ_p", c"-").above(0.0).usual(0.1, 1.5),
        /// Friction coefficient at the characteristic state, where contraction turns to dilation.
        mu_c0: Parameter::new(c"μ_c0", c"-").at_least(0.0).usual(0.1, 1.5),
        /// Slip that hardening takes; larger is softer.
        a: Parameter::new(c"A", c"-").above(0.0).usual(1e-5, 1e-1),
        /// Rate at which dilation dies out.
        c_0: Parameter::new(c"C_0", c"-").at_least(0.0).usual(1e-3, 1e2),
        /// Thickness of the interface, its internal length.
        t: Parameter::new(c"t", c"m").above(0.0).usual(1e-5, 1e-1),
        /// Reference pressure.
        p_0: Parameter::new(c"p_0", c"kPa").above(0.0).usual(1.0, 1e3).default(1.0),
        /// Initial normal stress, compression positive; taken from the initial state if left out.
        sigma_ni: Parameter::new(c"σ_ni", c"kPa").above(0.0).usual(1e-1, 1e5).optional(),
    }
}

abi::parameters! {
    /// The parameters of Eq. (11).
    pub struct SofteningParameters {
        /// Residual friction coefficient.
        mu_r: Parameter::new(c"μ_r", c"-").at_least(0.0).usual(0.1, 1.5),
        /// Rate of softening.
        a_0: Parameter::new(c"A_0", c"-").at_least(0.0).usual(1.0, 20.0),
        /// Plastic slip at the peak.
        u_tp: Parameter::new(c"u_tp", c"m").at_least(0.0).usual(1e-5, 1e-1),
        /// How softening starts: from the friction reached at the peak, or at μ_p with a jump.
        peak: Parameter::new(c"peak", c"-")
            .one_of(abi::choices!(c"continuous", c"published"))
            .default(0.0),
    }
}

impl SofteningParameters {
    /// (11) starts at `μ_p`, as printed.
    pub(crate) fn is_published(&self) -> bool {
        self.peak > 0.5
    }
}

/// The constants of a point, all of them fixed by `σ_ni`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Constants {
    /// `K_n`, `K_t`, Eq. (7).
    pub(crate) K_n: f64,
    pub(crate) K_t: f64,
    /// μ and β.
    pub(crate) hardening: Hardening,
    /// As long as Eq. (10) holds, the scalar equation has one root at most.
    pub(crate) one_root: bool,
}

/// A law of this crate, ready for use.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Interface {
    common: Common,
    softening: Option<SofteningParameters>,
    one_root: bool,
    /// Constants of the points whose `σ_ni` is the parameter.
    given: Option<Constants>,
    pub(crate) scheme: Scheme,
}

/// The largest value of (z tanh z − 1)/cosh z, which is 0.25114…
pub(crate) const STABILISATION_BOUND: f64 = 0.2512;

impl Interface {
    /// Checks how the parameters go together.
    pub(crate) fn new(
        common: Common,
        softening: Option<SofteningParameters>,
        scheme: Scheme,
    ) -> Result<Self, Refusal> {
        let Common {
            mu_0, mu_p, mu_c0, ..
        } = common;
        for (id, value) in [("mu_0", mu_0), ("mu_c0", mu_c0)] {
            if value > mu_p {
                return Err(Refusal::new(id, format!("{value} is above mu_p = {mu_p}")));
            }
        }
        if let Some(SofteningParameters { mu_r, .. }) = softening
            && mu_r > mu_p
        {
            return Err(Refusal::new(
                "mu_r",
                format!("{mu_r} is above mu_p = {mu_p}"),
            ));
        }
        if scheme != Scheme::Implicit && softening.is_some_and(|p| p.is_published()) {
            let reason = "only `implicit` follows the jump of `peak = \"published\"`";
            return Err(Refusal::new("scheme", reason));
        }
        // Bounds of μ d(Δλ β)/dΔλ before and after the characteristic state, see LAW.md.
        let coupling = (0.25 * mu_c0 * mu_c0).max(STABILISATION_BOUND * mu_p * (mu_p - mu_c0));
        let mut law = Self {
            common,
            softening,
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
        let Common {
            k_n,
            k_t,
            n,
            mu_0,
            mu_p,
            mu_c0,
            a,
            c_0,
            t,
            p_0,
            ..
        } = self.common;
        // Eq. (7).
        let power = if n > 0.0 { sigma_ni.powf(n) } else { 1.0 };
        let ratio = sigma_ni / p_0;
        let slip_scale = a * ratio * t;
        let softening = self.softening.map(|p| Softening {
            u_tp: p.u_tp,
            mu_pk: if p.is_published() {
                mu_p
            } else {
                // Eq. (10) at u_tp.
                mu_0 + (mu_p - mu_0) * (p.u_tp / (slip_scale + p.u_tp))
            },
            mu_r: p.mu_r,
            rate: p.a_0 / t,
            jumps: p.is_published(),
        });
        Constants {
            K_n: k_n * power,
            K_t: k_t * power,
            hardening: Hardening {
                mu_0,
                mu_p,
                slip_scale,
                mu_c0,
                stabilisation_rate: c_0 * ratio / t,
                softening,
            },
            one_root: self.one_root,
        }
    }
}
