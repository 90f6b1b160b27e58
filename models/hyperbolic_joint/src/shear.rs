//! Shear at the normal stress of the end of the increment: unloading, hyperbola, strength.

/// Stiffness and strength at a normal stress.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Interface {
    /// `K_u`, kPa/m.
    pub(crate) unloading: f64,
    /// `dK_u/dσ_n`, 1/m.
    pub(crate) unloading_by_sigma: f64,
    /// `K_i/K_u`.
    pub(crate) loading_share: f64,
    /// `R_f`.
    pub(crate) failure_ratio: f64,
    /// `τ_f`, kPa.
    pub(crate) strength: f64,
    /// `dτ_f/dσ_n`.
    pub(crate) tan_delta: f64,
}

/// The start of the increment, and what shears the interface over it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Start {
    /// τ at the start.
    pub(crate) tau: f64,
    pub(crate) slip: f64,
    /// `S_m` at the start.
    pub(crate) stress_level: f64,
}

/// The end of the increment.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sheared {
    pub(crate) tau: f64,
    pub(crate) stress_level: f64,
    /// ∂τ/∂`[u_t]`, kPa/m.
    pub(crate) by_slip: f64,
    /// `∂τ/∂σ_n`.
    pub(crate) by_sigma: f64,
}

impl Interface {
    /// Carries τ over the increment.
    #[inline]
    pub(crate) fn shear(&self, start: &Start) -> Sheared {
        let Self {
            unloading: k_u,
            unloading_by_sigma: k_u_by_sigma,
            strength,
            ..
        } = *self;
        // Eq. (7).
        let trial = start.tau + k_u * start.slip;
        let trial_by_sigma = k_u_by_sigma * start.slip;
        if strength <= 0.0 {
            // Where the strength vanishes, whatever shear stress there is has mobilised all of it.
            return Sheared {
                tau: 0.0,
                stress_level: if trial == 0.0 {
                    start.stress_level
                } else {
                    1.0
                },
                by_slip: 0.0,
                by_sigma: 0.0,
            };
        }
        // Eq. (6).
        let level = start.stress_level;
        let excess = trial.abs() - level * strength;
        if excess <= 0.0 {
            return Sheared {
                tau: trial,
                stress_level: level,
                by_slip: k_u,
                by_sigma: trial_by_sigma,
            };
        }
        self.loaded(level, excess, 1.0_f64.copysign(trial), trial_by_sigma)
    }

    /// Along the hyperbola from a stress level, Eq. (9): the excess is `K_u` times the slip that is left.
    #[inline]
    fn loaded(&self, level: f64, excess: f64, direction: f64, trial_by_sigma: f64) -> Sheared {
        let Self {
            unloading: k_u,
            loading_share: share,
            failure_ratio: r_f,
            strength,
            tan_delta,
            ..
        } = *self;
        let a = share * excess / strength;
        let still = 1.0 - r_f * level;
        let ratio = 1.0 / (1.0 + r_f * a * still);
        let mobilised = level + a * still * still * ratio;
        // Not a number where a is infinite: the end of every hyperbola.
        if mobilised >= 1.0 || mobilised.is_nan() {
            return Sheared {
                tau: direction * strength,
                stress_level: 1.0,
                by_slip: 0.0,
                by_sigma: direction * tan_delta,
            };
        }
        // 1 − R_f S, whose square is dS/da: differentiating (9).
        let left = still * ratio;
        let a_by_sigma =
            (share * (direction * trial_by_sigma - level * tan_delta) - a * tan_delta) / strength;
        Sheared {
            tau: direction * mobilised * strength,
            stress_level: mobilised,
            by_slip: share * k_u * left * left,
            by_sigma: direction * (tan_delta * mobilised + strength * left * left * a_by_sigma),
        }
    }
}
