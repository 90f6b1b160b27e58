//! The cap: its shape and hardening from stiffness and lateral stress in the oedometer, Eqs. (9) to (14).
//!
//! Compression is positive here.

use crate::rate::Linear;
use crate::return_mapping::Merged;
use crate::soil::{FLOOR, Soil};
use abi::Refusal;

/// The cap's constants.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Cap {
    /// Ratio of its axes, along q over along p.
    pub(crate) M: f64,
    /// Hardening modulus at the reference stress, kPa.
    pub(crate) H: f64,
    /// δ of Eq. (9).
    delta: f64,
}

/// Preconsolidation pressure after hardening, and its derivatives.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hardened {
    pub(crate) p_p: f64,
    pub(crate) by_strain: f64,
    pub(crate) by_start: f64,
}

/// Hardening from one preconsolidation pressure.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Hardening {
    start: f64,
    rest: f64,
    /// Whether m is 1/2.
    is_root: bool,
    /// p_p + c cot φ, kPa; infinite for φ = 0.
    size: f64,
    /// Rate dp_p/dε at the start, kPa, and of its logarithm.
    rate: f64,
    relative: f64,
    /// Whether the rate is that of the floor.
    is_at_floor: bool,
}

impl Hardening {
    /// Eq. (11) over a plastic volume strain of the cap, exactly.
    #[inline]
    pub(crate) fn after(&self, strain: f64) -> Hardened {
        if self.relative == 0.0 {
            return Hardened {
                p_p: self.start + self.rate * strain,
                by_strain: self.rate,
                by_start: 1.0,
            };
        }
        let z = self.relative * strain;
        if self.is_root {
            // A square, without transcendental functions.
            let root = 1.0 + 0.5 * z;
            let power = if root > 0.0 { root } else { f64::NAN };
            return Hardened {
                p_p: self.start + self.size * z * (1.0 + 0.25 * z),
                by_strain: self.rate * power,
                by_start: if self.is_at_floor { 1.0 } else { power },
            };
        }
        let exponent = if self.rest > 1e-9 {
            (self.rest * z).ln_1p() / self.rest
        } else {
            z
        };
        let growth = exponent.exp_m1();
        let power = (1.0 + growth) / (1.0 + self.rest * z);
        Hardened {
            p_p: self.start + self.size * growth,
            by_strain: self.rate * power,
            by_start: if self.is_at_floor { 1.0 } else { power },
        }
    }
}

impl Cap {
    /// M and H of the oedometer, Eqs. (12) to (14); `is_left_out`: the lateral stress is not given.
    ///
    /// # Errors
    /// No cap has this lateral stress.
    pub(crate) fn new(soil: &Soil, E_oed: f64, is_left_out: bool) -> Result<Self, Refusal> {
        let delta = (3.0 + soil.sin_phi) / (3.0 - soil.sin_phi);
        if let Some((M, H)) = shape(soil, E_oed, soil.k_0) {
            return Ok(Self { M, H, delta });
        }
        let Some((low, high)) = range(soil, E_oed) else {
            let reason = format!("{E_oed} kPa leaves no k_0_nc that a cap can have");
            return Err(Refusal::new("e_oed_ref", reason));
        };
        let left_out = if is_left_out {
            " (1 - sin φ, as none is given)"
        } else {
            ""
        };
        let reason = format!(
            "{}{left_out} is outside {low:.4} to {high:.4}, what a cap with these stiffnesses can have: give one in \
             this range; a smaller e_oed_ref widens it",
            soil.k_0
        );
        Err(Refusal::new("k_0_nc", reason))
    }

    /// q̃ of principal stresses in descending order, Eq. (9).
    #[inline]
    pub(crate) fn q<T: Linear>(&self, s: &[T; 3]) -> T {
        s[0] + s[1] * (self.delta - 1.0) - s[2] * self.delta
    }

    /// Gradient of q̃; on an edge the mean of its sides.
    #[inline]
    pub(crate) fn gradient(&self, merged: Merged) -> [f64; 3] {
        let half = 0.5 * self.delta;
        match merged {
            Merged::None => [1.0, self.delta - 1.0, -self.delta],
            Merged::First12 => [half, half, -self.delta],
            Merged::Last23 => [1.0, -0.5, -0.5],
        }
    }

    /// p_p of the cap through a stress, kPa, Eq. (9); tension counts as no pressure.
    #[inline]
    pub(crate) fn size(&self, q: f64, p: f64) -> f64 {
        let (x, y) = (q / self.M, p.max(0.0));
        (x * x + y * y).sqrt()
    }

    /// Hardening of Eq. (11) from this p_p.
    #[inline]
    pub(crate) fn hardening(&self, soil: &Soil, p_p: f64) -> Hardening {
        let (ratio, slope) = soil.ratio(p_p);
        let rate = self.H * soil.raised(ratio);
        let size = ratio * soil.strength / soil.sin_phi;
        Hardening {
            start: p_p,
            rest: soil.rest(),
            is_root: soil.is_root,
            size,
            rate,
            relative: rate / size,
            is_at_floor: slope == 0.0,
        }
    }
}

/// M and H for a lateral stress, Eqs. (12) to (14); none if there is no such cap.
fn shape(soil: &Soil, E_oed: f64, K: f64) -> Option<(f64, f64)> {
    let (s1, s3) = (soil.p_ref, K * soil.p_ref);
    let (q, p) = (s1 - s3, (s1 + 2.0 * s3) / 3.0);
    if q <= 0.0 || q >= soil.q_f(s3).0 {
        return None;
    }
    let (E, _) = soil.stiffness(s3);
    let nu = soil.nu;
    let (_, by_q, by_minor) = soil.gamma(q, s3);
    let rate = (by_q * (1.0 - K) + by_minor * K).max(0.0);
    let [x, ..] = soil.mobilised(q, s3);
    let [u, ..] = soil.dilatancy(x, x);
    let X_1 = 1.0 / E_oed - (1.0 - 2.0 * nu * K) / E - 0.5 * rate * (1.0 - u);
    let X_3 = 0.25 * rate * (1.0 + u) - (K - nu * (1.0 + K)) / E;
    let volume = X_1 + 2.0 * X_3;
    let r = 2.0 * (X_1 - X_3) / (3.0 * volume);
    if volume <= 0.0 || r <= 0.0 {
        return None;
    }
    let M = (q / (p * r)).sqrt();
    let p_p = ((q / M).powi(2) + p * p).sqrt();
    let H = p_p / soil.p_ref / (volume * soil.power(p_p).0);
    (M.is_finite() && H.is_finite()).then_some((M, H))
}

/// The admissible range of the lateral stress nearest to the one asked for.
fn range(soil: &Soil, E_oed: f64) -> Option<(f64, f64)> {
    const PARTS: u32 = 2000;
    const HALVINGS: u32 = 40;
    let admits = |K: f64| shape(soil, E_oed, K).is_some();
    let at = |i: u32| f64::from(i) / f64::from(PARTS);
    let nearest = (1..PARTS)
        .map(at)
        .filter(|&K| admits(K))
        .min_by(|a, b| (a - soil.k_0).abs().total_cmp(&(b - soil.k_0).abs()))?;
    let end = |step: f64| {
        let mut inside = nearest;
        let mut outside = nearest + step;
        while admits(outside) {
            inside = outside;
            outside += step;
        }
        for _ in 0..HALVINGS {
            let middle = 0.5 * (inside + outside);
            if admits(middle) {
                inside = middle;
            } else {
                outside = middle;
            }
        }
        inside
    };
    Some((end(-at(1)), end(at(1))))
}

const _: () = assert!(FLOOR > 0.0, "the rate of hardening would vanish");
