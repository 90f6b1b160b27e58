//! What the laws must give, from the equations of the paper by quadrature and bisection.

use super::{Common, SofteningParameters, mepi_softening};

/// Eq. (10), (11), (16), (17) and their integrals, for a point with this initial normal stress.
#[derive(Clone, Copy, Debug)]
pub(super) struct Truth {
    p: Common,
    softening: Option<SofteningParameters>,
    pub(super) sigma_ni: f64,
}

impl Truth {
    pub(super) fn softening(p: mepi_softening::Parameters, sigma_ni: f64) -> Self {
        Self {
            p: p.common,
            softening: Some(p.softening),
            sigma_ni,
        }
    }

    pub(super) fn hardening(p: Common, sigma_ni: f64) -> Self {
        Self {
            p,
            softening: None,
            sigma_ni,
        }
    }

    pub(super) fn k_n(&self) -> f64 {
        self.p.k_n * self.sigma_ni.powf(self.p.n)
    }

    pub(super) fn k_t(&self) -> f64 {
        self.p.k_t * self.sigma_ni.powf(self.p.n)
    }

    pub(super) fn mu(&self, xi: f64) -> f64 {
        let p = &self.p;
        let hardening =
            |xi: f64| p.mu_0 + (p.mu_p - p.mu_0) * xi / (p.a * self.sigma_ni / p.p_0 * p.t + xi);
        match self.softening {
            Some(q) if xi > q.u_tp => {
                let peak = if q.peak > 0.5 {
                    p.mu_p
                } else {
                    hardening(q.u_tp)
                };
                q.mu_r + (peak - q.mu_r) / (q.a_0 / p.t * (xi - q.u_tp)).cosh()
            }
            _ => hardening(xi),
        }
    }

    pub(super) fn mu_c(&self, xi: f64) -> f64 {
        let (p, mu) = (&self.p, self.mu(xi));
        if mu < p.mu_c0 {
            p.mu_c0
        } else {
            let d = 1.0 - 1.0 / (p.c_0 / p.t * self.sigma_ni / p.p_0 * xi).cosh();
            p.mu_c0 + (mu - p.mu_c0) * d
        }
    }

    /// ∫ (`μ_c` − μ) dξ from 0.
    pub(super) fn plastic_contraction(&self, xi: f64) -> f64 {
        let f = |xi: f64| self.mu_c(xi) - self.mu(xi);
        // Integrated piece by piece between the kinks, in the variable that resolves small slips.
        let scale = self.p.a * self.sigma_ni / self.p.p_0 * self.p.t;
        let transformed = |y: f64| f(scale * y.exp_m1()) * scale * y.exp();
        let end = (xi / scale).ln_1p();
        let characteristic = (self.p.mu_c0 - self.p.mu_0) / (self.p.mu_p - self.p.mu_c0);
        let mut kinks = vec![0.0, end];
        if let Some(SofteningParameters { u_tp, .. }) = self.softening {
            let peak = (u_tp / scale).ln_1p();
            // Just beyond, where the published μ has jumped.
            kinks.extend([peak * (1.0 - 1e-15), peak * (1.0 + 1e-15)]);
        }
        kinks.push(characteristic.max(0.0).ln_1p());
        kinks.retain(|&k| k <= end);
        kinks.sort_by(f64::total_cmp);
        kinks
            .windows(2)
            .map(|w| gauss(transformed, w[0], w[1]))
            .sum()
    }

    /// `σ_n` after plastic slip ξ against a normal spring in series with the interface's own.
    pub(super) fn sigma(&self, xi: f64, stiffness: f64) -> f64 {
        let series = if stiffness.is_infinite() {
            self.k_n()
        } else {
            self.k_n() * stiffness / (self.k_n() + stiffness)
        };
        self.sigma_ni - series * self.plastic_contraction(xi)
    }

    /// ξ, `σ_n`, τ at the slip `u_t` on a monotonic path.
    pub(super) fn at_slip(&self, u_t: f64, stiffness: f64) -> [f64; 3] {
        let (mut low, mut high) = (0.0, u_t);
        for _ in 0..80 {
            let xi = 0.5 * (low + high);
            let tau = self.mu(xi) * self.sigma(xi, stiffness);
            if xi + tau / self.k_t() < u_t {
                low = xi;
            } else {
                high = xi;
            }
        }
        let sigma = self.sigma(low, stiffness);
        [low, sigma, self.mu(low) * sigma]
    }
}

/// Composite Gauss-Legendre rule with three points.
fn gauss(f: impl Fn(f64) -> f64, a: f64, b: f64) -> f64 {
    const N: usize = 400;
    let h = (b - a) / N as f64;
    let offset = 0.5 * h * 0.6_f64.sqrt();
    (0..N)
        .map(|i| {
            let middle = a + (i as f64 + 0.5) * h;
            h / 18.0 * (5.0 * (f(middle - offset) + f(middle + offset)) + 8.0 * f(middle))
        })
        .sum()
}
