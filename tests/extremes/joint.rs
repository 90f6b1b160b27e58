//! The Coulomb joint at its ends: every increment against backward Euler by cases, in double-double
//! numbers, and the flow until it opens against its rates, event by event.
//!
//! Tension and opening positive, t = t* − Δλ (K_n tan ψ, K_t sign τ).

use crate::matrix::{Family, Verdict};
use crate::point::{Point, Response, law, reason};
use crate::wide::{Wide, sin_cos, wide};
use abi::Hypothesis;
use tests::words::paths_of;

#[derive(Clone, Copy, Debug)]
struct Joint {
    k_n: f64,
    k_t: f64,
    cohesion: f64,
    phi: f64,
    psi: f64,
    tensile: f64,
}

/// ξ, plastic opening, gap, broken.
const GAP: usize = 2;
const BROKEN: usize = 3;

/// |τ| in a double.
fn magnitude(tau: Wide) -> Wide {
    wide(tau.0.abs() + if tau.0 < 0.0 { -tau.1 } else { tau.1 })
}

fn tan(angle: f64) -> Wide {
    let (sin, cos) = sin_cos(angle);
    sin / cos
}

impl Joint {
    /// Whether an increment from ξ may end open, after this plastic slip and with this gap.
    fn is_open(
        &self,
        xi: f64,
        end: &Response,
        [slip, gap]: [Wide; 2],
        scale: f64,
    ) -> Result<(), String> {
        near("t_n", end.flux[0], 0.0, 0.0)?;
        near("τ", end.flux[1], 0.0, 0.0)?;
        near("broken", end.state[BROKEN], 1.0, 0.0)?;
        near("gap", end.state[GAP], gap.0, 1e-11 * scale)?;
        let tolerance = 1e-9 * slip.0.abs() + 1e-11 * scale.min(1.0) * self.k_n / self.k_t;
        near("Δξ", end.state[0] - xi, slip.0, tolerance + 1e-14 * xi)
    }

    /// Whether an increment may end so.
    fn check(
        &self,
        flux: &[f64],
        state: &[f64],
        increment: &[f64],
        end: &Response,
    ) -> Result<(), String> {
        let (k_n, k_t) = (wide(self.k_n), wide(self.k_t));
        let (tan_phi, tan_psi) = (tan(self.phi), tan(self.psi));
        let [mut opening, mut slip] = [wide(increment[0]), wide(increment[1])];
        let mut start = [wide(flux[0]), wide(flux[1])];
        let mut broken = state[BROKEN] > 0.5;
        let gap = wide(state[GAP]);
        let open = |slip, gap, scale| self.is_open(state[0], end, [slip, gap], scale);
        if gap.0 > 0.0 {
            let left = gap + opening;
            if left.0 >= 0.0 {
                return open(wide(0.0), left, gap.0.max(increment[0].abs()));
            }
            slip *= wide(1.0) + gap / opening;
            opening = left;
            start = [wide(0.0); 2];
            broken = true;
        }
        let (c, r_t) = if broken {
            (wide(0.0), wide(0.0))
        } else {
            (wide(self.cohesion), wide(self.tensile))
        };
        let trial = [start[0] + k_n * opening, start[1] + k_t * slip];
        // Closing takes the gap from the increment, and the slip before it from the slip.
        let sizes = [
            start[0].0.abs().max((self.k_n * increment[0]).abs()),
            start[1].0.abs().max((self.k_t * increment[1]).abs()),
        ];
        // Rounding of the trial traction, and what the flow makes of it.
        let blur = sizes.map(|size| 16.0 * f64::EPSILON * size);
        let tau = magnitude(trial[1]);
        let excess = tau + trial[0] * tan_phi - c;
        let resistance = k_t + k_n * tan_phi * tan_psi;
        let excess_blur = blur[1] + blur[0] * tan_phi.0 + 16.0 * f64::EPSILON * c.0;
        let rate_n = (k_n * tan_psi / resistance).0;
        let elastic = excess.0 <= excess_blur && trial[0].0 <= r_t.0 + blur[0];
        let d_lambda = if excess.0 > 0.0 {
            excess / resistance
        } else {
            wide(0.0)
        };
        let returned = trial[0] - k_n * tan_psi * d_lambda;
        let strength = c - returned * tan_phi;
        // Δ of the normal traction that the rounding of the trial traction makes.
        let end_blur = (blur[0] * (self.k_t / resistance.0) + rate_n * blur[1])
            + TOLERANCE * returned.0.abs()
            + 16.0 * f64::EPSILON * (k_n * tan_psi * d_lambda).0.abs();
        let contact = || {
            let expected = if excess.0 > 0.0 {
                [returned.0, strength.0.copysign(trial[1].0)]
            } else {
                [trial[0].0, trial[1].0]
            };
            let end_blur = if excess.0 > excess_blur {
                end_blur
            } else {
                end_blur + blur[0]
            };
            near("t_n", end.flux[0], expected[0], end_blur)?;
            let shear_blur =
                (end_blur * tan_phi.0).min(excess_blur + self.k_t * 1e-14 * d_lambda.0) + blur[1];
            near(
                "τ",
                end.flux[1],
                expected[1],
                shear_blur + TOLERANCE * expected[1].abs(),
            )?;
            // Never outside: F ≤ 0 to rounding.
            let f = wide(end.flux[1].abs()) + wide(end.flux[0]) * tan_phi - c;
            let size = end.flux[1].abs() + (end.flux[0] * tan_phi.0).abs() + c.0;
            near("F", f.0.max(0.0), 0.0, 1e-12 * size)?;
            near("gap", end.state[GAP], 0.0, 0.0)?;
            let tolerance = TOLERANCE * d_lambda.0 + excess_blur / resistance.0 + 1e-14 * state[0];
            near("Δξ", end.state[0] - state[0], d_lambda.0, tolerance)
        };
        let opens = returned.0 > r_t.0 || strength.0 < 0.0;
        let margin = end_blur + 16.0 * f64::EPSILON * r_t.0;
        let certain = (returned.0 - r_t.0).abs() > margin
            && strength.0.abs() > margin * tan_phi.0.max(1e-300)
            && !(elastic && excess.0 > -excess_blur);
        let found_open = end.flux == [0.0, 0.0] && end.state[BROKEN] > 0.5;
        if (certain && opens && !elastic) || (!certain && found_open) {
            let slip = self.slip_until_open(start, [k_n * opening, k_t * slip], [c, r_t]);
            let left = start[0] / k_n + opening - tan_psi * slip;
            let left = if left.0 > 0.0 { left } else { wide(0.0) };
            let scale = sizes[0] / self.k_n + (tan_psi * slip).0;
            return open(slip, left, scale);
        }
        contact()
    }

    /// Plastic slip until t_n reaches the tensile strength, by the rates of each stretch.
    fn slip_until_open(&self, start: [Wide; 2], rates: [Wide; 2], strength: [Wide; 2]) -> Wide {
        let (tan_phi, tan_psi) = (tan(self.phi), tan(self.psi));
        let (k_n, k_t) = (wide(self.k_n), wide(self.k_t));
        let [c, r_t] = strength;
        // Times at which each bound is reached elastically.
        let zero = wide(0.0);
        let mut first = (f64::INFINITY, zero, zero);
        for sign in [1.0, -1.0] {
            let sign = wide(sign);
            let f = sign * start[1] + start[0] * tan_phi - c;
            let rate = sign * rates[1] + rates[0] * tan_phi;
            if rate.0 > 0.0 {
                let at = if f.0 >= 0.0 { zero } else { -f / rate };
                if at.0 < first.0 {
                    first = (at.0, at, rate);
                }
            }
        }
        let opening = if start[0].0 >= r_t.0 || rates[0].0 <= 0.0 {
            0.0
        } else {
            ((r_t - start[0]) / rates[0]).0
        };
        if opening <= first.0 {
            return zero;
        }
        let (_, at, growth) = first;
        let slip_rate = growth / (k_t + k_n * tan_phi * tan_psi);
        let normal_rate = rates[0] - k_n * tan_psi * slip_rate;
        let left = r_t - start[0] - at * rates[0];
        if normal_rate.0 > 0.0 && left.0 > 0.0 {
            slip_rate * left / normal_rate
        } else {
            zero
        }
    }
}

/// Relative, of the end of an increment.
const TOLERANCE: f64 = 1e-10;

pub(crate) fn near(what: &str, found: f64, expected: f64, tolerance: f64) -> Result<(), String> {
    if (found - expected).abs() <= tolerance {
        return Ok(());
    }
    Err(format!(
        "{what} {found:e}, expected {expected:e} ± {tolerance:.1e}"
    ))
}

/// Opening and slip of each increment, in units of the strength over the stiffnesses.
const PATHS: &str = "
shear | 0 0.5; 0 1; 0 -3; 0 2
zero and back | -1 0.2; 0.9 0.2; 0.2 0.1; 3 1; -2 0.3; -3 1
opens sliding | 0.5 1.5; 2 1.5; -9 2
compression | -1 0; -10 5; -1e3 -1e3
barely open | 1 0; 1e-9 1e-9; -1e-9 0.1; -1e-6 1; -1 1
";

pub(crate) fn families() -> Vec<Family> {
    let mut family = Family::new("Coulomb joint", "cases and events, double-double");
    let paths = paths_of(PATHS);
    let angles = [
        0.0,
        1e-9,
        1e-3,
        30.0,
        45.0,
        60.0,
        89.0,
        89.9999,
        89.999_999_9,
    ];
    for (i, phi) in angles.into_iter().enumerate() {
        for (j, share) in [0.0, 0.5, 1.0].into_iter().enumerate() {
            for (k, ratio) in [1e-8, 1.0, 1e8].into_iter().enumerate() {
                for (l, strength) in [[0.0, 0.0], [10.0, 0.0], [10.0, 0.5], [10.0, 1.0]]
                    .into_iter()
                    .enumerate()
                {
                    let [cohesion, tension] = strength;
                    let (sin, cos) = sin_cos(phi);
                    let apex = (wide(cohesion) * cos / sin).0;
                    let apex = if phi > 0.0 { apex } else { 1e3 };
                    let joint = Joint {
                        k_n: 1e6 * ratio,
                        k_t: 1e6,
                        cohesion,
                        phi,
                        psi: phi * share,
                        tensile: tension * apex,
                    };
                    let (path, segments) = &paths[(i + j + k + l) % 5];
                    let scale = [1e-3, 1.0, 1e6][(i + 2 * j + k) % 3];
                    let verdict = follow(&joint, segments, scale);
                    family.add(format!("{joint:?}: {path} by {scale:e}"), verdict);
                }
            }
        }
    }
    vec![family]
}

fn follow(joint: &Joint, path: &[[f64; 2]], scale: f64) -> Verdict {
    let values = [
        ("normal_stiffness", joint.k_n),
        ("shear_stiffness", joint.k_t),
        ("cohesion", joint.cohesion),
        ("friction_angle", joint.phi),
        ("dilatancy_angle", joint.psi),
        ("tensile_strength", joint.tensile),
    ];
    let law = match law("coulomb_joint", Hypothesis::Interface2d, &values) {
        Ok(law) => law,
        Err(why) => return Verdict::Refused(why),
    };
    let sigma = 100.0;
    let mut point = match Point::new(law, &[-sigma, 0.0]) {
        Ok(point) => point,
        Err(why) => return Verdict::Refused(reason(&why)),
    };
    for [opening, slip] in path {
        let increment = [
            opening * scale * sigma / joint.k_n,
            slip * scale * sigma / joint.k_t,
        ];
        let verdict = point.advance(&increment, |flux, state, piece, end| {
            joint
                .check(flux, state, piece, end)
                .map_err(|what| format!("{what}; from {flux:?} {state:?} by {piece:?} to {end:?}"))
        });
        if verdict != Verdict::Agrees {
            return verdict;
        }
    }
    Verdict::Agrees
}
