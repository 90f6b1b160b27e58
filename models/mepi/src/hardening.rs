//! Friction μ and contraction rate β = `μ_c` − μ of one point as functions of the plastic slip ξ,
//! with their derivatives: Eq. (10), (11), (16), (17).
//!
//! Letters are those of the paper. Products of them without overflow:
//!
//! | product | here | |
//! |---|---|---|
//! | A (σ_ni/p_0) t | `slip_scale` | slip at which half of the rise of Eq. (10) is done |
//! | C_0 (σ_ni/p_0) / t | `stabilisation_rate` | rate of Eq. (17) |
//! | A_0 / t | `rate` | rate of Eq. (11) |

/// A function of ξ: value and derivative.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Jet {
    pub(crate) value: f64,
    pub(crate) slope: f64,
}

/// Which expression of μ holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Branch {
    /// Eq. (10).
    Hardening,
    /// Eq. (11).
    Softening,
}

/// Constants of Eq. (11) at one point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Softening {
    /// Plastic slip where Eq. (11) takes over.
    pub(crate) u_tp: f64,
    /// Friction from which it starts, and the residual one.
    pub(crate) mu_pk: f64,
    pub(crate) mu_r: f64,
    /// `A_0` / t.
    pub(crate) rate: f64,
    /// μ jumps to `μ_pk` at `u_tp`.
    pub(crate) jumps: bool,
}

/// Constants of the friction and the flow at one point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hardening {
    /// Friction at the end of the elastic range, at failure, at the characteristic state.
    pub(crate) mu_0: f64,
    pub(crate) mu_p: f64,
    pub(crate) mu_c0: f64,
    /// A (`σ_ni/p_0`) t.
    pub(crate) slip_scale: f64,
    /// `C_0` (`σ_ni/p_0`) / t.
    pub(crate) stabilisation_rate: f64,
    /// Eq. (11), if the law has it.
    pub(crate) softening: Option<Softening>,
}

impl Hardening {
    /// The expression of μ that holds from ξ on.
    pub(crate) fn branch(&self, xi: f64) -> Branch {
        match self.softening {
            Some(softening) if xi >= softening.u_tp => Branch::Softening,
            _ => Branch::Hardening,
        }
    }

    /// μ(ξ).
    #[inline]
    pub(crate) fn friction(&self, branch: Branch, xi: f64) -> Jet {
        if let (Branch::Softening, Some(softening)) = (branch, &self.softening) {
            // Eq. (11).
            let (sech, tanh) = sech_tanh(softening.rate * (xi - softening.u_tp));
            let drop = (softening.mu_pk - softening.mu_r) * sech;
            Jet {
                value: softening.mu_r + drop,
                slope: -drop * softening.rate * tanh,
            }
        } else {
            // Eq. (10).
            let inverse = (self.slip_scale + xi).recip();
            let rise = self.mu_p - self.mu_0;
            Jet {
                value: self.mu_0 + rise * (xi * inverse),
                slope: rise * (self.slip_scale * inverse) * inverse,
            }
        }
    }

    /// β(ξ) = `μ_c` − μ: contraction positive, dilation negative.
    #[inline]
    pub(crate) fn contraction_rate(&self, friction: Jet, xi: f64) -> Jet {
        let beyond = friction.value - self.mu_c0;
        if beyond < 0.0 {
            // Before the characteristic state μ_c = μ_c0.
            Jet {
                value: -beyond,
                slope: -friction.slope,
            }
        } else {
            // Eq. (16) with D of Eq. (17): μ_c − μ = −(μ − μ_c0)(1 − D).
            let (sech, tanh) = self.stabilisation(xi);
            Jet {
                value: -beyond * sech,
                slope: sech * (beyond * self.stabilisation_rate * tanh - friction.slope),
            }
        }
    }

    /// 1 − D(ξ) = 1/cosh z of Eq. (17), and tanh z.
    #[inline]
    pub(crate) fn stabilisation(&self, xi: f64) -> (f64, f64) {
        sech_tanh(self.stabilisation_rate * xi)
    }
}

/// 1/cosh z and tanh z for z ≥ 0, of any size.
#[inline]
pub(crate) fn sech_tanh(z: f64) -> (f64, f64) {
    let e = (-z).exp();
    let inverse = (1.0 + e * e).recip();
    (2.0 * e * inverse, (1.0 - e * e) * inverse)
}
