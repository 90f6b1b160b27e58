//! Plastic slip from the elastic trial to the surface, with its derivatives. Compression and dilation
//! are positive here, and slip in its own direction, as in `LAW.md`.

use crate::{CriticalStateJoint, root};
use abi::Failure;

/// Rounding of a sum, relative to its largest term.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

/// Doublings that lead from any first step to any last one.
const MAX_STEPS: usize = 2000;

/// What flows.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Flow<'a> {
    pub(crate) law: &'a CriticalStateJoint,
    /// `σ_n*`.
    pub(crate) sigma: f64,
    /// s τ*.
    pub(crate) tau: f64,
    /// `η_0 = s α + m`.
    pub(crate) ratio: f64,
    /// Void ratio at the end.
    pub(crate) void_ratio: f64,
}

/// Everything after a plastic slip.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sample {
    pub(crate) sigma: f64,
    /// ∂ψ/∂`σ_n`.
    psi_slope: f64,
    /// μ, ∂μ/∂Δξ, ∂μ/∂ψ.
    pub(crate) mu: f64,
    mu_by_slip: f64,
    mu_by_psi: f64,
    /// v, ∂v/∂Δξ, ∂v/∂ψ.
    dilation: f64,
    dilation_by_slip: f64,
    dilation_by_psi: f64,
}

impl CriticalStateJoint {
    /// ψ of Eq. (4) and its derivative by `σ_n`.
    #[inline]
    pub(crate) fn state_parameter(&self, void_ratio: f64, sigma: f64) -> (f64, f64) {
        let p = &self.parameters;
        if sigma <= 0.0 {
            return (void_ratio - p.critical_void_ratio, 0.0);
        }
        let power = (3.0 * sigma / p.granular_hardness).powf(p.hardness_exponent);
        let critical = p.critical_void_ratio * (-power).exp();
        let slope = if critical > 0.0 {
            critical * p.hardness_exponent * power / sigma
        } else {
            0.0
        };
        (void_ratio - critical, slope)
    }
}

impl Flow<'_> {
    /// Eq. (3), (5), (6) and (8) at a normal stress.
    #[inline]
    fn at(&self, slip: f64, sigma: f64) -> Sample {
        let p = &self.law.parameters;
        let (psi, psi_slope) = self.law.state_parameter(self.void_ratio, sigma);
        let peak = self.law.critical_friction * (-p.peak_exponent * psi).exp();
        let neutral = self.law.critical_friction * (p.dilatancy_exponent * psi).exp();
        let peak_by_psi = -p.peak_exponent * peak;
        let neutral_by_psi = p.dilatancy_exponent * neutral;
        let done = -(-slip / p.hardening_slip).exp_m1();
        let to_go = (self.ratio - peak) * (1.0 - done);
        let mu = peak + to_go;
        // Slip at the friction of the start that leads as far.
        let lag = p.hardening_slip * done;
        let factor = p.dilatancy_factor;
        Sample {
            sigma,
            psi_slope,
            mu,
            mu_by_slip: -to_go / p.hardening_slip,
            mu_by_psi: peak_by_psi * done,
            dilation: factor * ((peak - neutral) * slip + (self.ratio - peak) * lag),
            dilation_by_slip: factor * (mu - neutral),
            dilation_by_psi: factor * ((peak_by_psi - neutral_by_psi) * slip - peak_by_psi * lag),
        }
    }

    /// In balance along the normal, Eq. (1).
    #[inline]
    fn after(&self, slip: f64) -> Sample {
        let k_n = self.law.parameters.normal_stiffness;
        let free = self.at(slip, 0.0);
        let highest = self.sigma + k_n * free.dilation;
        if highest <= 0.0 {
            return Sample {
                sigma: highest,
                ..free
            };
        }
        let noise = ROUNDING * (self.sigma.abs() + (k_n * free.dilation).abs());
        let sigma = root::between(0.0, highest, highest, noise, |sigma| {
            let sample = self.at(slip, sigma);
            let value = sigma - self.sigma - k_n * sample.dilation;
            (value, 1.0 - k_n * sample.dilation_by_psi * sample.psi_slope)
        });
        self.at(slip, sigma)
    }

    /// What the first of Eq. (a) lacks after a slip, and its slope.
    #[inline]
    fn excess(&self, slip: f64, sample: &Sample) -> (f64, f64) {
        let p = &self.law.parameters;
        let (k_n, k_t) = (p.normal_stiffness, p.shear_stiffness);
        let normal = 1.0 - k_n * sample.dilation_by_psi * sample.psi_slope;
        let sigma_slope = k_n * sample.dilation_by_slip / normal;
        let by_sigma = sample.mu + sample.sigma * sample.mu_by_psi * sample.psi_slope;
        (
            k_t * slip + sample.mu * sample.sigma - self.tau,
            k_t + sample.mu_by_slip * sample.sigma + by_sigma * sigma_slope,
        )
    }

    /// Slips on both sides of the first root that steps find, each twice as long as the last; none if
    /// there is none.
    #[inline]
    fn bracket(&self, noise: f64) -> Option<[f64; 2]> {
        let k_t = self.law.parameters.shear_stiffness;
        // While μ < 0 the interface contracts, so that σ_n does not rise above its trial.
        let limit = (self.tau + (-self.ratio).max(0.0) * self.sigma.max(0.0)) / k_t;
        if limit.is_nan() || limit <= 0.0 {
            return None;
        }
        let (value, slope) = self.excess(0.0, &self.after(0.0));
        let newton = -2.0 * value / slope;
        let (mut low, mut high) = (0.0, if newton > 0.0 { newton } else { 1e-3 * limit });
        for _ in 0..MAX_STEPS {
            high = high.min(limit);
            let sample = self.after(high);
            if sample.sigma > 0.0 && self.excess(high, &sample).0 >= -noise {
                return Some([low, high]);
            }
            if high.is_nan() || high >= limit {
                break;
            }
            low = high;
            high *= 2.0;
        }
        None
    }

    /// The end of the slip; none if it leaves no normal stress.
    #[inline]
    pub(crate) fn end(&self) -> Option<Sample> {
        let noise = ROUNDING * (self.tau.abs() + (self.ratio * self.sigma).abs());
        let [low, high] = self.bracket(noise)?;
        let slip = root::between(low, high, low, noise, |slip| {
            self.excess(slip, &self.after(slip))
        });
        Some(self.after(slip)).filter(|end| end.sigma > 0.0)
    }

    /// Eq. (11): ∂(`t_n`, s τ)/∂(`u_n`, s `u_t`) at the end.
    ///
    /// # Errors
    /// A smaller increment is asked for where there is none.
    #[inline]
    pub(crate) fn tangent(&self, end: &Sample) -> Result<[[f64; 2]; 2], Failure> {
        let p = &self.law.parameters;
        let (k_n, k_t) = (p.normal_stiffness, p.shear_stiffness);
        // Residuals (a) by slip and σ_n, then by the void ratio.
        let shear = [
            k_t + end.mu_by_slip * end.sigma,
            end.mu + end.sigma * end.mu_by_psi * end.psi_slope,
        ];
        let normal = [
            -k_n * end.dilation_by_slip,
            1.0 - k_n * end.dilation_by_psi * end.psi_slope,
        ];
        let determinant = shear[0] * normal[1] - shear[1] * normal[0];
        if determinant.is_nan() || determinant <= 0.0 {
            return Err(NO_TANGENT);
        }
        let growth = (1.0 + self.void_ratio) / p.thickness;
        let columns = [
            // Opening: trial of the normal stress, and the void ratio.
            [
                -end.sigma * end.mu_by_psi * growth,
                k_n * (end.dilation_by_psi * growth - 1.0),
            ],
            // Slip: trial of the shear stress.
            [k_t, 0.0],
        ];
        let solved = columns.map(|[a, b]| {
            let slip = (a * normal[1] - shear[1] * b) / determinant;
            let sigma = (shear[0] * b - normal[0] * a) / determinant;
            [slip, sigma]
        });
        let [[slip_n, sigma_n], [slip_t, sigma_t]] = solved;
        Ok([[-sigma_n, -sigma_t], [-k_t * slip_n, k_t * (1.0 - slip_t)]])
    }
}

const NO_TANGENT: Failure = Failure::CutStep {
    factor: f64::NAN,
    reason: "friction and normal stress fade as steeply as the springs let go",
};
