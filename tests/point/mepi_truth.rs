//! Answers of MEPI in the shear box, by quadrature of its rate equations.
//!
//! Compression and contraction positive. In monotonic shear ξ is the plastic slip, and with a spring
//! of stiffness K behind the interface everything follows from ξ alone:
//!
//! - Contraction of the flow: I(ξ) = ∫ (μ_c − μ) dξ, Eq. (14), (16), (17).
//! - Normal stress: σ_n = σ_0 − K_s I(ξ), K_s = K K_n/(K + K_n): 0 at constant normal stress, K_n at
//!   constant volume.
//! - Shear: τ = μ(ξ) σ_n, Eq. (9), and [u_t] = ξ + τ/K_t, Eq. (6).

/// Constants of one point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mepi {
    pub(crate) k_n: f64,
    pub(crate) k_t: f64,
    pub(crate) mu_0: f64,
    pub(crate) mu_p: f64,
    pub(crate) mu_c0: f64,
    /// A (σ_ni/p_0) t.
    pub(crate) slip_scale: f64,
    /// C_0 (σ_ni/p_0)/t.
    pub(crate) stabilisation: f64,
    pub(crate) softening: Option<Softening>,
}

/// Constants of Eq. (11).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Softening {
    pub(crate) u_tp: f64,
    /// Value from which (11) starts.
    pub(crate) peak: f64,
    pub(crate) mu_r: f64,
    /// A_0/t.
    pub(crate) rate: f64,
}

/// A point of the path.
#[derive(Clone, Copy, Debug)]
pub(crate) struct State {
    pub(crate) slip: f64,
    pub(crate) sigma: f64,
    pub(crate) tau: f64,
    /// Contraction I.
    pub(crate) contraction: f64,
}

impl Mepi {
    /// μ(ξ), Eq. (10), (11).
    pub(crate) fn mu(&self, xi: f64) -> f64 {
        match self.softening {
            Some(s) if xi > s.u_tp => s.mu_r + (s.peak - s.mu_r) / (s.rate * (xi - s.u_tp)).cosh(),
            _ => self.hardening(xi),
        }
    }

    /// Eq. (10).
    pub(crate) fn hardening(&self, xi: f64) -> f64 {
        self.mu_0 + (self.mu_p - self.mu_0) * xi / (self.slip_scale + xi)
    }

    fn beta(&self, xi: f64) -> f64 {
        let mu = self.mu(xi);
        if mu < self.mu_c0 {
            self.mu_c0 - mu
        } else {
            (self.mu_c0 - mu) / (self.stabilisation * xi).cosh()
        }
    }

    /// I(ξ), by Gauss' rule on panels that do not straddle a kink.
    fn contraction(&self, xi: f64) -> f64 {
        let mut breaks = vec![0.0, xi];
        if self.mu_c0 > self.mu_0 {
            let rise = (self.mu_c0 - self.mu_0) / (self.mu_p - self.mu_0);
            breaks.push(self.slip_scale * rise / (1.0 - rise));
        }
        if let Some(s) = self.softening {
            breaks.push(s.u_tp);
            // Where (11) falls below μ_c0.
            if s.peak > self.mu_c0 && self.mu_c0 > s.mu_r {
                let ratio = (s.peak - s.mu_r) / (self.mu_c0 - s.mu_r);
                breaks.push(s.u_tp + ratio.acosh() / s.rate);
            }
        }
        breaks.retain(|b| *b <= xi);
        breaks.sort_by(f64::total_cmp);
        breaks
            .windows(2)
            .map(|ends| self.integral(ends[0], ends[1]))
            .sum()
    }

    /// ∫ β dξ with ξ = B (eˣ − 1), so that panels are small where μ changes fast.
    fn integral(&self, from: f64, to: f64) -> f64 {
        const PANELS: usize = 100;
        let b = self.slip_scale;
        let (x0, x1) = ((from / b).ln_1p(), (to / b).ln_1p());
        let h = (x1 - x0) / PANELS as f64;
        let node = 0.6_f64.sqrt() / 2.0;
        (0..PANELS)
            .map(|panel| {
                let middle = x0 + (panel as f64 + 0.5) * h;
                [(-node, 5.0), (0.0, 8.0), (node, 5.0)]
                    .iter()
                    .map(|(offset, weight)| {
                        let x = middle + offset * h;
                        weight / 18.0 * h * b * x.exp() * self.beta(b * x.exp_m1())
                    })
                    .sum::<f64>()
            })
            .sum()
    }

    fn at_slip(&self, slip: f64, sigma_0: f64, k_s: f64) -> State {
        let contraction = self.contraction(slip);
        let sigma = sigma_0 - k_s * contraction;
        State {
            slip,
            sigma,
            tau: self.mu(slip) * sigma,
            contraction,
        }
    }

    /// The state at a shear displacement, by bisection over ξ. If μ jumps up at u_tp, the response is
    /// elastic between the two values.
    pub(crate) fn at(&self, jump: f64, sigma_0: f64, k_s: f64) -> State {
        let (mut low, mut high) = (0.0, jump);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            let state = self.at_slip(middle, sigma_0, k_s);
            if middle + state.tau / self.k_t <= jump {
                low = middle;
            } else {
                high = middle;
            }
        }
        let state = self.at_slip(low, sigma_0, k_s);
        State {
            tau: self.k_t * (jump - low),
            ..state
        }
    }
}
