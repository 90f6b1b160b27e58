//! Oriented Mohr–Coulomb at its ends: every increment against all sets of active bounds of the
//! facet (Karush, Kuhn, Tucker), in double-double numbers.

use crate::joint::near;
use crate::matrix::{Family, Verdict};
use crate::mohr_coulomb::STRENGTHS;
use crate::point::{Point, Response, law, reason};
use crate::wide::{Wide, sin_cos, wide};
use abi::Hypothesis;
use tests::words::paths_of;

#[derive(Clone, Copy, Debug)]
struct Oriented {
    e: f64,
    nu: f64,
    cohesion: f64,
    phi: f64,
    psi: f64,
    tensile: Option<f64>,
}

/// λ, G, λ + 2G of Young's modulus and Poisson's ratio.
pub(crate) fn lame(e: f64, nu: f64) -> [Wide; 3] {
    let (one, two) = (wide(1.0), wide(2.0));
    let (e, nu) = (wide(e), wide(nu));
    let lambda = e * nu / ((one + nu) * (one - two * nu));
    let shear = e / (two * (one + nu));
    [lambda, shear, lambda + two * shear]
}

/// Hooke's law in components 11 22 33 12 (13 23), and the largest term of each sum.
pub(crate) fn trial(e: f64, nu: f64, stress: &[f64], strain: &[f64]) -> (Vec<Wide>, f64) {
    let [lambda, shear, _] = lame(e, nu);
    let volume = wide(strain[0]) + wide(strain[1]) + wide(strain[2]);
    let mut reach = 0.0_f64;
    let all = (0..stress.len())
        .map(|i| {
            let terms = if i < 3 {
                [lambda * volume, wide(2.0) * shear * wide(strain[i])]
            } else {
                [wide(0.0), shear * wide(strain[i])]
            };
            let largest = (lambda.0 * strain[0])
                .abs()
                .max((lambda.0 * strain[1]).abs());
            reach = reach
                .max(stress[i].abs())
                .max(terms[1].0.abs())
                .max(largest);
            reach = reach.max((lambda.0 * strain[2]).abs());
            wide(stress[i]) + terms[0] + terms[1]
        })
        .collect();
    (all, reach)
}

impl Oriented {
    /// Normal and shear stress at the end.
    fn facet(&self, n: Wide, t: Wide) -> [Wide; 2] {
        let [_, g, m] = lame(self.e, self.nu);
        let (sin, cos) = sin_cos(self.phi);
        let (sin_psi, cos_psi) = sin_cos(self.psi);
        let c = wide(self.cohesion) * cos;
        // Normal and flow of each bound, and the bound.
        let mut planes = vec![
            ([sin, cos], [sin_psi, cos_psi], c),
            ([sin, -cos], [sin_psi, -cos_psi], c),
        ];
        if let Some(tensile) = self.tensile {
            let up = [wide(1.0), wide(0.0)];
            planes.push((up, up, wide(tensile)));
        }
        let f: Vec<Wide> = planes
            .iter()
            .map(|(a, _, b)| a[0] * n + a[1] * t - *b)
            .collect();
        let scale = n.0.abs().max(t.0.abs()).max(c.0);
        if f.iter().all(|f| f.0 <= 0.0) {
            return [n, t];
        }
        let work = |i: usize, j: usize| {
            let (a, b) = (planes[i].0, planes[j].1);
            a[0] * m * b[0] + a[1] * g * b[1]
        };
        let holds = |set: &[(usize, Wide)]| {
            set.iter().all(|(_, l)| (*l * g).0 >= -1e-15 * scale)
                && (0..planes.len()).all(|i| {
                    let left = set.iter().fold(f[i], |f, (j, l)| f - work(i, *j) * *l);
                    left.0 <= 1e-24 * scale
                })
        };
        let end = |set: &[(usize, Wide)]| {
            set.iter().fold([n, t], |s, (j, l)| {
                let flow = planes[*j].1;
                [s[0] - m * flow[0] * *l, s[1] - g * flow[1] * *l]
            })
        };
        for i in 0..planes.len() {
            let one = [(i, f[i] / work(i, i))];
            if holds(&one) {
                return end(&one);
            }
            for j in 0..i {
                let det = work(i, i) * work(j, j) - work(i, j) * work(j, i);
                if det.0.abs() <= 1e-28 * (work(i, i) * work(j, j)).0.abs() {
                    continue;
                }
                let solve = |a: Wide, b: Wide| {
                    let first = (a * work(j, j) - work(i, j) * b) / det;
                    [first, (work(i, i) * b - a * work(j, i)) / det]
                };
                let mut two = [(i, wide(0.0)), (j, wide(0.0))];
                // Near 0 and 90° the two are almost parallel: refined.
                for _ in 0..3 {
                    let left = |x: usize| two.iter().fold(f[x], |f, (y, l)| f - work(x, *y) * *l);
                    let [a, b] = solve(left(i), left(j));
                    two = [(i, two[0].1 + a), (j, two[1].1 + b)];
                }
                if holds(&two) {
                    return end(&two);
                }
            }
        }
        // Without dilatancy no flow leads to the apex.
        assert!(self.psi == 0.0, "the reference has no solution");
        [c / sin, wide(0.0)]
    }

    fn check(
        &self,
        stress: &[f64],
        state: &[f64],
        strain: &[f64],
        found: &Response,
    ) -> Result<(), String> {
        let [lambda, g, m] = lame(self.e, self.nu);
        let (at, reach) = trial(self.e, self.nu, stress, strain);
        let end = self.facet(at[1], at[3]);
        let opening = (at[1] - end[0]) / m;
        let slip = (at[3] - end[1]) / g;
        let lateral = |i: usize| (at[i] - lambda * opening).0;
        let expected = [lateral(0), end[0].0, lateral(2), end[1].0];
        let blur = 16.0 * f64::EPSILON * reach;
        let mut spread = [0.0_f64; 2];
        for [a, b] in [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]] {
            let moved = self.facet(at[1] + wide(a * blur), at[3] + wide(b * blur));
            for i in 0..2 {
                spread[i] = spread[i].max((moved[i] - end[i]).0.abs());
            }
        }
        // Whether a stress on the surface counts as inside moves it by no more than this.
        let floor = 1e-15 * self.cohesion.max(self.tensile.unwrap_or(0.0)) + 1e-18 * reach;
        let tolerance = |value: f64, spread: f64| 1e-10 * value.abs() + spread + floor;
        near(
            "σ_22",
            found.flux[1],
            expected[1],
            tolerance(expected[1], spread[0]),
        )?;
        near(
            "σ_12",
            found.flux[3],
            expected[3],
            tolerance(expected[3], spread[1]),
        )?;
        let ratio = (lambda / m).0.abs();
        for i in [0, 2] {
            let around = blur + ratio * (spread[0] + blur);
            near(
                "σ_11, σ_33",
                found.flux[i],
                expected[i],
                tolerance(expected[i], around),
            )?;
        }
        // Never outside.
        let (sin, cos) = sin_cos(self.phi);
        let (n, t) = (found.flux[1], found.flux[3].abs());
        let f = wide(t) * cos + wide(n) * sin - wide(self.cohesion) * cos;
        let size = (t * cos.0)
            .max((n * sin.0).abs())
            .max(self.cohesion * cos.0);
        near("F", f.0.max(0.0), 0.0, 1e-12 * size)?;
        let strain = (found.state[0] - state[0], found.state[1] - state[1]);
        let of = |s: f64, k: Wide, before: f64| (s + blur) / k.0 + 1e-14 * before.abs();
        let tolerance = 1e-10 * slip.0.abs() + of(spread[1], g, state[0]);
        near("γ_p", strain.0, slip.0.abs(), tolerance)?;
        let tolerance = 1e-10 * opening.0.abs() + of(spread[0], m, state[1]);
        near("ε_p", strain.1, opening.0, tolerance)
    }
}

/// Strains 11 22 33 12 in units of the strength over E.
const PATHS: &str = "
shear | 0 0 0 0.4; 0 0 0 2; 0 0 0 -5
zero and back | 0 0.9 0 0.3; 0 0.5 0 0.3; 0 -3 0 1
opens | 0.3 3 -0.2 0; 0 1 0 1e-3; -0.5 -9 0 2
compression | -1 -2 -0.5 0.3; 0 -1e3 0 -1e3
";

pub(crate) fn families() -> Vec<Family> {
    let mut family = Family::new(
        "oriented Mohr–Coulomb",
        "sets of active bounds, double-double",
    );
    let paths = paths_of(PATHS);
    let angles = [0.0, 1e-6, 1e-3, 30.0, 45.0, 60.0, 89.0, 89.9999, 89.999_999];
    for (i, phi) in angles.into_iter().enumerate() {
        for (j, share) in [0.0, 0.5, 1.0].into_iter().enumerate() {
            for (k, nu) in [-0.999_999, 0.0, 0.3, 0.499_999_99].into_iter().enumerate() {
                for (l, (cohesion, tension)) in STRENGTHS.into_iter().enumerate() {
                    if phi == 0.0 && cohesion == 0.0 {
                        continue;
                    }
                    let (sin, cos) = sin_cos(phi);
                    let apex = if phi > 1e-3 {
                        (wide(cohesion) * cos / sin).0
                    } else {
                        1e3
                    };
                    let oriented = Oriented {
                        e: [1.0, 1e5, 1e12][(i + l) % 3],
                        nu,
                        cohesion,
                        phi,
                        psi: phi * share,
                        tensile: tension.map(|share| share * apex),
                    };
                    let (path, segments) = &paths[(i + j + k + l) % 4];
                    let scale = [1e-3, 1.0, 1e6][(i + 2 * j + k) % 3];
                    let hypothesis = [Hypothesis::PlaneStrain, Hypothesis::Axisymmetric][j % 2];
                    let verdict = follow(&oriented, hypothesis, segments, scale);
                    family.add(format!("{oriented:?}: {path} by {scale:e}"), verdict);
                }
            }
        }
    }
    vec![family]
}

fn follow(o: &Oriented, hypothesis: Hypothesis, path: &[[f64; 4]], scale: f64) -> Verdict {
    let values = [
        ("young_modulus", o.e),
        ("poisson_ratio", o.nu),
        ("cohesion", o.cohesion),
        ("friction_angle", o.phi),
        ("dilatancy_angle", o.psi),
        ("tensile_strength", o.tensile.unwrap_or(f64::NAN)),
    ];
    let law = match law("oriented_mohr_coulomb", hypothesis, &values) {
        Ok(law) => law,
        Err(why) => return Verdict::Refused(why),
    };
    let mut point = match Point::new(law, &[-60.0, -100.0, -60.0, 0.0]) {
        Ok(point) => point,
        Err(why) => return Verdict::Refused(reason(&why)),
    };
    let [_, g, m] = lame(o.e, o.nu);
    for strain in path {
        let modulus = [m.0, m.0, m.0, g.0];
        let increment: Vec<f64> = (0..4)
            .map(|i| strain[i] * scale * 100.0 / modulus[i])
            .collect();
        let verdict = point.advance(&increment, |stress, state, piece, end| {
            o.check(stress, state, piece, end).map_err(|what| {
                format!("{what}; from {stress:?} {state:?} by {piece:?} to {end:?}")
            })
        });
        if verdict != Verdict::Agrees {
            return verdict;
        }
    }
    Verdict::Agrees
}
