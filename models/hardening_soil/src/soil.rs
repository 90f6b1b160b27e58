//! Stiffness, strength and dilatancy as functions of principal stresses, Eqs. (1) to (8).
//!
//! Compression is positive here. Lengths along stress axes are in kPa; `at` of a function is a stress
//! of which the stiffness depends by [`Soil::power`].

use crate::cap::Cap;
use abi::friction::{Strength, tan};
use abi::{Parameter, Refusal};

abi::parameters! {
    /// Parameters that both laws have.
    pub struct SoilParameters {
        /// Secant stiffness at half the strength in drained triaxial compression, at a minor stress of p_ref.
        e_50_ref: Parameter::new(c"E_50", c"kPa").above(0.0).usual(1e3, 1e6),
        /// Tangent stiffness of primary loading in the oedometer, at a major stress of p_ref; e_50_ref if left out.
        e_oed_ref: Parameter::new(c"E_oed", c"kPa").above(0.0).usual(1e3, 1e6).optional(),
        /// Young's modulus of unloading and reloading, at a minor stress of p_ref; 3 e_50_ref if left out.
        e_ur_ref: Parameter::new(c"E_ur", c"kPa").above(0.0).usual(3e3, 3e6).optional(),
        /// Exponent of the moduli's dependence on stress.
        m: Parameter::new(c"m", c"-").at_least(0.0).at_most(1.0).default(0.5),
        /// Poisson's ratio of unloading and reloading.
        nu_ur: Parameter::new(c"ν_ur", c"-").at_least(0.0).below(0.5).default(0.2),
        /// Cohesion.
        cohesion: Parameter::new(c"c", c"kPa").at_least(0.0).usual(0.0, 100.0),
        /// Angle of internal friction.
        friction_angle: Parameter::new(c"φ", c"deg").at_least(0.0).below(90.0).usual(15.0, 50.0),
        /// Angle of dilatancy at failure, at most the angle of friction.
        dilatancy_angle: Parameter::new(c"ψ", c"deg").at_least(0.0).below(90.0).usual(0.0, 20.0),
        /// Stress to which the reference moduli belong.
        p_ref: Parameter::new(c"p_ref", c"kPa").above(0.0).default(100.0),
        /// Ratio of the minor to the major stress in normal consolidation without lateral strain; 1 − sin φ if left
        /// out.
        k_0_nc: Parameter::new(c"K_0", c"-").above(0.0).below(1.0).usual(0.3, 0.8).optional(),
        /// Ratio of the strength to the asymptote of the hyperbola.
        r_f: Parameter::new(c"R_f", c"-").above(0.0).below(1.0).usual(0.7, 0.95).default(0.9),
        /// Bound on the largest principal stress, at most c cot φ; none if left out.
        tensile_strength: Parameter::new(c"R_t", c"kPa").at_least(0.0).optional(),
        /// Ratio of the major preconsolidation stress to the major stress, where a calculation starts.
        ocr: Parameter::new(c"OCR", c"-").at_least(1.0).default(1.0),
        /// What the major preconsolidation stress exceeds this by, where a calculation starts.
        pop: Parameter::new(c"POP", c"kPa").at_least(0.0).default(0.0),
        /// Least number of equal steps that an increment is divided into, whole.
        substeps: Parameter::new(c"n_s", c"-").at_least(1.0).at_most(1e3).usual(1.0, 20.0).default(1.0),
        /// Estimated error of a step, relative to the stress, above which it is divided.
        scheme_tolerance: Parameter::new(c"ε_s", c"-")
            .above(0.0)
            .below(1.0)
            .usual(1e-3, 0.5)
            .default(0.05),
    }
}

/// Least value of (σ + c cot φ)/(p_ref + c cot φ) that moduli depend on.
pub(crate) const FLOOR: f64 = 1e-3;

/// What follows from the parameters alone.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Soil {
    pub(crate) sin_phi: f64,
    pub(crate) c_cos_phi: f64,
    pub(crate) sin_psi: f64,
    sin_cv: f64,
    /// Young's modulus of unloading at the reference stress, kPa.
    pub(crate) E_ur: f64,
    pub(crate) nu: f64,
    /// Lamé's constants over Young's modulus.
    pub(crate) lambda: f64,
    pub(crate) G: f64,
    /// 2/E_i and 2/E_ur at the reference stress, 1/kPa.
    pub(crate) a_i: f64,
    pub(crate) a_ur: f64,
    m: f64,
    /// Whether m is 1/2.
    pub(crate) is_root: bool,
    pub(crate) p_ref: f64,
    /// p_ref sin φ + c cos φ, kPa.
    pub(crate) strength: f64,
    /// Slope of the ratio of Eq. (1), 1/kPa, and its value without stress.
    ratio_slope: f64,
    ratio_at_0: f64,
    /// Slope of q_f and its value without stress, kPa.
    q_f_slope: f64,
    q_f_at_0: f64,
    r_f: f64,
    pub(crate) k_0: f64,
    /// Tensile strength, kPa; c cot φ if none cuts the apex off, infinite for φ = 0.
    pub(crate) R_t: f64,
    /// Whether `R_t` cuts the apex off.
    pub(crate) is_cut_off: bool,
    ocr: f64,
    pop: f64,
    pub(crate) substeps: u32,
    pub(crate) tolerance: f64,
    pub(crate) cap: Cap,
}

/// A value and its derivative by the minor stress or by another single argument.
pub(crate) type Slope = (f64, f64);

/// Stress on the hyperbola and its derivatives.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hyperbola {
    pub(crate) q: f64,
    pub(crate) by_gamma: f64,
    pub(crate) by_minor: f64,
}

impl Soil {
    /// Checks how the parameters go together.
    ///
    /// # Errors
    /// Names the parameter to change.
    pub(crate) fn new(p: &SoilParameters) -> Result<Self, Refusal> {
        let or = |value: f64, other: f64| if value.is_nan() { other } else { value };
        let phi = p.friction_angle.to_radians();
        let (sin_phi, cos_phi) = (phi.sin(), (90.0 - p.friction_angle).to_radians().sin());
        let apex = if sin_phi > 0.0 {
            p.cohesion / tan(p.friction_angle)
        } else {
            f64::INFINITY
        };
        let strength = Strength {
            cohesion: p.cohesion,
            friction_angle: p.friction_angle,
            dilatancy_angle: p.dilatancy_angle,
            tensile_strength: p.tensile_strength,
            apex,
        };
        strength.check()?;
        if p.substeps.fract() != 0.0 {
            let reason = format!("{} is not a whole number from 1 on", p.substeps);
            return Err(Refusal::new("substeps", reason));
        }
        let e_i = 2.0 * p.e_50_ref / (2.0 - p.r_f);
        let E_ur = or(p.e_ur_ref, 3.0 * p.e_50_ref);
        if E_ur <= e_i {
            let reason = format!("{E_ur} kPa must exceed e_i = 2 e_50_ref/(2 - r_f) = {e_i} kPa");
            return Err(Refusal::new("e_ur_ref", reason));
        }
        let sin_psi = p.dilatancy_angle.to_radians().sin();
        let nu = p.nu_ur;
        let reference = p.p_ref * sin_phi + p.cohesion * cos_phi;
        let mut soil = Self {
            sin_phi,
            c_cos_phi: p.cohesion * cos_phi,
            sin_psi,
            sin_cv: (sin_phi - sin_psi) / (1.0 - sin_phi * sin_psi),
            E_ur,
            nu,
            lambda: nu / ((1.0 + nu) * (1.0 - 2.0 * nu)),
            G: 0.5 / (1.0 + nu),
            a_i: 2.0 / e_i,
            a_ur: 2.0 / E_ur,
            m: p.m,
            is_root: (p.m - 0.5).abs() < f64::EPSILON,
            p_ref: p.p_ref,
            strength: reference,
            ratio_slope: sin_phi / reference,
            ratio_at_0: p.cohesion * cos_phi / reference,
            q_f_slope: 2.0 * sin_phi / (1.0 - sin_phi),
            q_f_at_0: 2.0 * p.cohesion * cos_phi / (1.0 - sin_phi),
            r_f: p.r_f,
            k_0: or(p.k_0_nc, 1.0 - sin_phi),
            R_t: strength.cut_off().unwrap_or(apex),
            is_cut_off: strength.cut_off().is_some(),
            ocr: p.ocr,
            pop: p.pop,
            substeps: p.substeps as u32,
            tolerance: p.scheme_tolerance,
            cap: Cap::default(),
        };
        soil.cap = Cap::new(&soil, or(p.e_oed_ref, p.e_50_ref), p.k_0_nc.is_nan())?;
        Ok(soil)
    }

    /// (σ + c cot φ)/(p_ref + c cot φ) of a stress and its derivative, 1 for φ = 0, not below the floor.
    #[inline]
    pub(crate) fn ratio(&self, at: f64) -> Slope {
        let ratio = at * self.ratio_slope + self.ratio_at_0;
        if ratio > FLOOR {
            (ratio, self.ratio_slope)
        } else {
            (FLOOR, 0.0)
        }
    }

    /// The ratio to the power m, Eq. (1).
    #[inline]
    pub(crate) fn power(&self, at: f64) -> Slope {
        let (ratio, slope) = self.ratio(at);
        let power = self.raised(ratio);
        (power, self.m * power / ratio * slope)
    }

    /// `x` to the power m.
    #[inline]
    pub(crate) fn raised(&self, x: f64) -> f64 {
        if self.is_root {
            x.sqrt()
        } else {
            x.powf(self.m)
        }
    }

    /// 1 − m.
    #[inline]
    pub(crate) fn rest(&self) -> f64 {
        1.0 - self.m
    }

    /// Young's modulus of unloading, kPa, Eq. (1), and its derivative by the minor stress.
    #[inline]
    pub(crate) fn stiffness(&self, minor: f64) -> Slope {
        let (power, slope) = self.power(minor);
        (self.E_ur * power, self.E_ur * slope)
    }

    /// The strength q_f above a minor stress, kPa, Eq. (4), and its derivative.
    #[inline]
    pub(crate) fn q_f(&self, minor: f64) -> Slope {
        (minor * self.q_f_slope + self.q_f_at_0, self.q_f_slope)
    }

    /// γ_ps whose shear surface goes through q above a minor stress, Eq. (3), with derivatives by q
    /// and by the minor stress. q is at most q_f.
    pub(crate) fn gamma(&self, q: f64, minor: f64) -> (f64, f64, f64) {
        let (power, power_slope) = self.power(minor);
        let (q_f, q_f_slope) = self.q_f(minor);
        let q_a = q_f.max(f64::EPSILON * self.strength) / self.r_f;
        let x = if q > 0.0 {
            (q / q_a).min(self.r_f)
        } else {
            0.0
        };
        let left = 1.0 - x;
        let gamma = (self.a_i * q / left - self.a_ur * q) / power;
        let by_q = (self.a_i / (left * left) - self.a_ur) / power;
        let by_q_a = -self.a_i * x * x / (left * left) / power;
        let by_minor = by_q_a * q_f_slope / self.r_f - gamma * power_slope / power;
        (gamma, by_q, by_minor)
    }

    /// q on the shear surface of a γ_ps above a minor stress, Eq. (3) solved for q.
    #[inline]
    pub(crate) fn hyperbola(&self, gamma: f64, minor: f64) -> Hyperbola {
        let (power, power_slope) = self.power(minor);
        let (q_f, q_f_slope) = self.q_f(minor);
        let least = f64::EPSILON * self.strength;
        let (q_a, q_a_slope) = if q_f > least {
            (q_f / self.r_f, q_f_slope / self.r_f)
        } else {
            (least / self.r_f, 0.0)
        };
        let y = gamma.max(0.0) * power;
        let b = self.a_i - self.a_ur + y / q_a;
        let q = 2.0 * y / (b + (b * b + 4.0 * y * self.a_ur / q_a).sqrt());
        // 1 − q/q_a without cancellation.
        let left = if y > 0.0 {
            self.a_i * q / (y + self.a_ur * q)
        } else {
            1.0
        };
        let steepness = self.a_i - self.a_ur * left * left;
        let by_y = left * left / steepness;
        let x = q / q_a;
        let by_q_a = self.a_i * x * x / steepness;
        Hyperbola {
            q,
            by_gamma: by_y * power,
            by_minor: by_y * gamma.max(0.0) * power_slope + by_q_a * q_a_slope,
        }
    }

    /// sin φ_m and its derivatives by q and by the minor stress, Eq. (6); at most sin φ.
    #[inline]
    pub(crate) fn mobilised(&self, q: f64, minor: f64) -> [f64; 3] {
        let sum = (q + 2.0 * minor) * self.sin_phi + 2.0 * self.c_cos_phi;
        if q <= 0.0 || sum <= 0.0 || q > sum * (1.0 + 1e-9) {
            return [if q <= 0.0 { 0.0 } else { self.sin_phi }, 0.0, 0.0];
        }
        let x = q * self.sin_phi / sum;
        [
            x,
            self.sin_phi * (1.0 - x) / sum,
            -2.0 * self.sin_phi * x / sum,
        ]
    }

    /// sin ψ_m of flow from one sin φ_m to another and its derivatives by them, Eqs. (7) and (8): the mean over
    /// the part with dilatancy, and none over the rest.
    #[inline]
    pub(crate) fn dilatancy(&self, from: f64, to: f64) -> [f64; 3] {
        const STILL: f64 = 0.75;
        let rowe = |x: f64| {
            let below = 1.0 - x * self.sin_cv;
            let u = ((x - self.sin_cv) / below).clamp(0.0, self.sin_psi);
            (u, (1.0 - self.sin_cv * self.sin_cv) / (below * below))
        };
        let least = (STILL * self.sin_phi).max(self.sin_cv);
        let (low, high) = (from.min(to), from.max(to));
        if high <= least {
            return [0.0; 3];
        }
        let (u_high, slope_high) = rowe(high);
        let [u, by_low, by_high] = if low >= least {
            let (u_low, slope_low) = rowe(low);
            [0.5 * (u_low + u_high), 0.5 * slope_low, 0.5 * slope_high]
        } else {
            let mean = 0.5 * (rowe(least).0 + u_high);
            let share = (high - least) / (high - low);
            let by_share = mean / (high - low);
            [
                mean * share,
                by_share * share,
                by_share * (1.0 - share) + 0.5 * slope_high * share,
            ]
        };
        if from <= to {
            [u, by_low, by_high]
        } else {
            [u, by_high, by_low]
        }
    }

    /// p_p and γ_ps where a calculation starts, from principal stresses in descending order, Eqs. (18) and (19).
    pub(crate) fn start(&self, s: &[f64; 3]) -> [f64; 2] {
        let [s1, _, s3] = *s;
        let past = self.ocr * s1 + self.pop;
        let k_0 = self.cap.size(
            (past * (1.0 - self.k_0)).abs(),
            past * (1.0 + 2.0 * self.k_0) / 3.0,
        );
        let now = self.cap.size(self.cap.q(s), s.iter().sum::<f64>() / 3.0);
        let p_p = k_0.max(now).max(FLOOR * self.p_ref);
        let q = (s1 - s3).min(self.q_f(s3).0).max(0.0);
        [p_p, self.gamma(q, s3).0]
    }
}
