//! Mohr–Coulomb and elasticity at their ends, in the plane and in space.
//!
//! Implicit          every increment against all sets of up to three of the nine planes (Karush, Kuhn,
//!                   Tucker) in the principal axes of the trial stress, in double-double numbers.
//! Other schemes     a path that turns the axes, against extrapolated small steps of that reference.
//! Elasticity        Hooke's law in double-double numbers.

use crate::joint::near;
use crate::matrix::{Family, Verdict};
use crate::oriented::{lame, trial};
use crate::point::{Point, Response, law, reason};
use crate::wide::{Wide, eigen, sin_cos, sqrt, wide};
use abi::Hypothesis;
use tests::words::paths_of;

#[derive(Clone, Copy, Debug)]
pub(crate) struct Parameters {
    pub(crate) e: f64,
    pub(crate) nu: f64,
    pub(crate) cohesion: f64,
    pub(crate) phi: f64,
    pub(crate) psi: f64,
    pub(crate) tensile: Option<f64>,
}

type Vector = [Wide; 3];

/// The nine planes: normal, bound, and what the flow along each takes from the stress and from each
/// yield function.
pub(crate) struct Pyramid {
    p: Parameters,
    normal: Vec<Vector>,
    bound: Vec<Wide>,
    relief: Vec<Vector>,
    work: Vec<Vec<Wide>>,
}

fn dot(a: &Vector, b: &Vector) -> Wide {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

impl Pyramid {
    pub(crate) fn new(p: Parameters) -> Self {
        let [lambda, g, _] = lame(p.e, p.nu);
        let r = lambda / g;
        let face = |angle: f64, i: usize, j: usize| {
            let (sin, cos) = sin_cos(angle);
            let upper = wide(1.0) + sin;
            let mut n = [wide(0.0); 3];
            (n[i], n[j]) = (upper, -(cos * cos / upper));
            n
        };
        let (mut normal, mut flow, mut bound) = (vec![], vec![], vec![]);
        for i in 0..3 {
            for j in (0..3).filter(|j| *j != i) {
                normal.push(face(p.phi, i, j));
                flow.push(face(p.psi, i, j));
                bound.push(wide(2.0 * p.cohesion) * sin_cos(p.phi).1);
            }
            if let Some(tensile) = p.tensile {
                let mut n = [wide(0.0); 3];
                n[i] = wide(1.0);
                normal.push(n);
                flow.push(n);
                bound.push(wide(tensile));
            }
        }
        // The elastic operator over G.
        let relief: Vec<Vector> = flow
            .iter()
            .map(|m: &Vector| m.map(|x| r * (m[0] + m[1] + m[2]) + wide(2.0) * x))
            .collect();
        let work = normal
            .iter()
            .map(|n| relief.iter().map(|d| dot(n, d)).collect())
            .collect();
        Self {
            p,
            normal,
            bound,
            relief,
            work,
        }
    }

    /// The principal stresses that these trial values return to.
    fn principal(&self, s: &Vector) -> Vector {
        let n = self.normal.len();
        let f: Vec<Wide> = (0..n)
            .map(|i| dot(&self.normal[i], s) - self.bound[i])
            .collect();
        if f.iter().all(|f| f.0 <= 0.0) {
            return *s;
        }
        let w = &self.work;
        let scale = s.iter().map(|x| x.0.abs()).fold(self.p.cohesion, f64::max);
        let holds = |set: &[(usize, Wide)]| {
            set.iter().all(|(_, l)| l.0 >= -1e-15 * scale)
                && (0..n).all(|i| {
                    let left = set.iter().fold(f[i], |f, (j, l)| f - w[i][*j] * *l);
                    left.0 <= 1e-20 * scale
                })
        };
        let end = |set: &[(usize, Wide)]| {
            let mut end = *s;
            for (j, l) in set {
                for k in 0..3 {
                    end[k] -= self.relief[*j][k] * *l;
                }
            }
            end
        };
        for i in 0..n {
            let one = [(i, f[i] / w[i][i])];
            if holds(&one) {
                return end(&one);
            }
        }
        let minor = |a: usize, b: usize, c: usize, d: usize| w[a][c] * w[b][d] - w[a][d] * w[b][c];
        for i in 0..n {
            for j in 0..i {
                let det = minor(i, j, i, j);
                if det.0.abs() <= 1e-24 * (w[i][i] * w[j][j]).0 {
                    continue;
                }
                let a = (f[i] * w[j][j] - w[i][j] * f[j]) / det;
                let b = (w[i][i] * f[j] - f[i] * w[j][i]) / det;
                let two = [(i, a), (j, b)];
                if holds(&two) {
                    return end(&two);
                }
            }
        }
        for i in 0..n {
            for j in 0..i {
                for k in 0..j {
                    let cofactors = [minor(j, k, j, k), minor(i, k, j, k), minor(i, j, j, k)];
                    let det =
                        w[i][i] * cofactors[0] - w[j][i] * cofactors[1] + w[k][i] * cofactors[2];
                    if det.0.abs() <= 1e-24 * (w[i][i] * w[j][j] * w[k][k]).0 {
                        continue;
                    }
                    let column = |x: usize, f: &[Wide]| {
                        let m = |r: usize, c: usize| if c == x { f[r] } else { w[r][c] };
                        let two = |r: usize, q: usize| m(r, j) * m(q, k) - m(r, k) * m(q, j);
                        (m(i, i) * two(j, k) - m(j, i) * two(i, k) + m(k, i) * two(i, j)) / det
                    };
                    let mut three = [i, j, k].map(|x| (x, column(x, &f)));
                    // Near 90° three planes are almost parallel: refined.
                    for _ in 0..2 {
                        let left: Vec<Wide> = (0..n)
                            .map(|x| three.iter().fold(f[x], |f, (y, l)| f - w[x][*y] * *l))
                            .collect();
                        three = three.map(|(x, l)| (x, l + column(x, &left)));
                    }
                    if holds(&three) {
                        return end(&three);
                    }
                }
            }
        }
        // Without dilatancy no flow leads to the apex.
        assert!(self.p.psi == 0.0, "the reference has no solution");
        let (sin, cos) = sin_cos(self.p.phi);
        [wide(self.p.cohesion) * cos / sin; 3]
    }

    /// The end of an increment whose trial stress has these components.
    fn end(&self, trial: &[Wide]) -> Vec<Wide> {
        let n = trial.len();
        let (s, axes) = eigen(tensor(trial));
        let end = self.principal(&s);
        PLACES[..n]
            .iter()
            .map(|&(a, b)| (0..3).fold(wide(0.0), |sum, k| sum + axes[a][k] * end[k] * axes[b][k]))
            .collect()
    }

    /// The largest yield function, relative to the largest stress or bound.
    pub(crate) fn excess(&self, stress: &[f64]) -> f64 {
        let all: Vec<Wide> = stress.iter().map(|s| wide(*s)).collect();
        let (s, _) = eigen(tensor(&all));
        let bounded = self.normal.iter().zip(&self.bound).map(|(normal, bound)| {
            let size = s.iter().map(|x| x.0.abs()).fold(bound.0, f64::max);
            (dot(normal, &s) - *bound).0 / size.max(f64::MIN_POSITIVE)
        });
        bounded.fold(f64::NEG_INFINITY, f64::max)
    }

    fn check(
        &self,
        stress: &[f64],
        state: &[f64],
        strain: &[f64],
        found: &Response,
    ) -> Result<(), String> {
        let n = stress.len();
        let (at, reach) = trial(self.p.e, self.p.nu, stress, strain);
        let end = self.end(&at);
        // Decomposition and composition round as often as they multiply.
        let blur = 32.0 * f64::EPSILON * reach;
        let mut spread = 0.0_f64;
        for pattern in [
            [1.0, 1.0, 1.0],
            [1.0, -1.0, 1.0],
            [-1.0, 1.0, 1.0],
            [-1.0, -1.0, -1.0],
        ] {
            let moved: Vec<Wide> = at
                .iter()
                .enumerate()
                .map(|(i, s)| *s + wide(blur * if i < 3 { pattern[i] } else { 0.0 }))
                .collect();
            for (a, b) in self.end(&moved).iter().zip(&end) {
                spread = spread.max((*a - *b).0.abs());
            }
        }
        let largest = end.iter().map(|s| s.0.abs()).fold(0.0, f64::max);
        let tolerance = 1e-10 * largest + 2.0 * spread;
        for i in 0..n {
            near(COMPONENTS[i], found.flux[i], end[i].0, tolerance)?;
        }
        near("F", self.excess(&found.flux).max(0.0), 0.0, 1e-12)?;
        // ε_q and ε_v.
        let [lambda, g, _] = lame(self.p.e, self.p.nu);
        let off: Vec<Wide> = (0..n).map(|i| at[i] - end[i]).collect();
        let sum = off[0] + off[1] + off[2];
        let mut square = wide(0.0);
        for (i, s) in off.iter().enumerate() {
            let e = if i < 3 { *s - sum / wide(3.0) } else { *s };
            square += e * e * wide(if i < 3 { 1.0 } else { 2.0 });
        }
        let shear = (sqrt(square * wide(2.0 / 3.0)) / (wide(2.0) * g)).0;
        let volume = (sum / (wide(3.0) * lambda + wide(2.0) * g)).0;
        let blurred = tolerance + blur;
        let rounding = |s: f64| 1e-9 * s.abs() + 1e-14 * (state[0] + state[1].abs());
        let at_g = 4.0 * blurred / g.0;
        near(
            "ε_q",
            found.state[0] - state[0],
            shear,
            rounding(shear) + at_g,
        )?;
        let at_k = 4.0 * blurred / (wide(3.0) * lambda + wide(2.0) * g).0;
        near(
            "ε_v",
            found.state[1] - state[1],
            volume,
            rounding(volume) + at_k,
        )
    }
}

const COMPONENTS: [&str; 6] = ["σ_11", "σ_22", "σ_33", "σ_12", "σ_13", "σ_23"];
const PLACES: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];

fn tensor(components: &[Wide]) -> [[Wide; 3]; 3] {
    let mut s = [[wide(0.0); 3]; 3];
    for (&(a, b), value) in PLACES.iter().zip(components) {
        s[a][b] = *value;
        s[b][a] = *value;
    }
    s
}

pub(crate) fn build(
    p: &Parameters,
    hypothesis: Hypothesis,
    scheme: &[(&str, f64)],
) -> Result<Point, Verdict> {
    let mut values = vec![
        ("young_modulus", p.e),
        ("poisson_ratio", p.nu),
        ("cohesion", p.cohesion),
        ("friction_angle", p.phi),
        ("dilatancy_angle", p.psi),
        ("tensile_strength", p.tensile.unwrap_or(f64::NAN)),
    ];
    values.extend_from_slice(scheme);
    let law = law("mohr_coulomb", hypothesis, &values).map_err(Verdict::Refused)?;
    let start = [-60.0, -100.0, -60.0, 0.0, 0.0, 0.0];
    Point::new(law, &start[..hypothesis.n_components()])
        .map_err(|why| Verdict::Refused(reason(&why)))
}

/// Cohesion, kPa, and tensile strength as a share of the apex.
pub(crate) const STRENGTHS: [(f64, Option<f64>); 5] = [
    (0.0, None),
    (10.0, None),
    (10.0, Some(0.0)),
    (10.0, Some(0.5)),
    (10.0, Some(1.0)),
];

/// Strains 11 22 33 12 13 23 in units of 100 kPa over a modulus.
const PATHS: &str = "
triaxial | 0.3 -1 0.3 0 0 0; 1 -2 1 0 0 0; -3 5 -3 0 0 0
shear | 0 0 0 1 0.2 -0.1; 0 0 0 2 0.4 0.3; 0 0 0 -5 0 0
to the apex and back | 1 1.1 0.9 0.01 0 0; 0.5 0.5 0.5 0 0 0; -2 -3 -2 0.5 0.1 0
splitting | 2 0 -0.5 0.2 0 0.1; 1 -3 0 0 0 0; -9 0 0 1 1 1
compression | -1 -1 -1 0.1 0 0; -1e3 -1e3 -1e3 1e3 -1e2 10
";

pub(crate) fn families() -> Vec<Family> {
    let mut implicit = Family::new(
        "Mohr–Coulomb, implicit",
        "sets of active planes, double-double",
    );
    let paths = paths_of(PATHS);
    let angles = [0.0, 1e-6, 1e-3, 30.0, 45.0, 60.0, 80.0, 85.0, 89.0];
    let hypotheses = [
        Hypothesis::PlaneStrain,
        Hypothesis::ThreeD,
        Hypothesis::Axisymmetric,
    ];
    for (i, phi) in angles.into_iter().enumerate() {
        for (j, share) in [0.0, 0.5, 1.0].into_iter().enumerate() {
            for (k, nu) in [-0.999, 0.0, 0.3, 0.499_999].into_iter().enumerate() {
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
                    let p = Parameters {
                        e: [1.0, 1e5, 1e12][(i + l) % 3],
                        nu,
                        cohesion,
                        phi,
                        psi: phi * share,
                        // At the apex itself it changes nothing, and nine planes meet.
                        tensile: tension.filter(|t| *t < 1.0).map(|share| share * apex),
                    };
                    let (path, segments) = &paths[(i + j + k + l) % 5];
                    let scale = [1e-2, 1.0, 1e5][(i + 2 * j + k) % 3];
                    let verdict = follow(&p, hypotheses[(j + k + l) % 3], segments, scale);
                    implicit.add(format!("{p:?}: {path} by {scale:e}"), verdict);
                }
            }
        }
    }
    vec![implicit, schemes(), elasticity()]
}

fn modulus(p: &Parameters, component: usize) -> f64 {
    let [_, g, m] = lame(p.e, p.nu);
    if component < 3 { m.0 } else { g.0 }
}

fn follow(p: &Parameters, hypothesis: Hypothesis, path: &[[f64; 6]], scale: f64) -> Verdict {
    let pyramid = Pyramid::new(*p);
    let mut point = match build(p, hypothesis, &[]) {
        Ok(point) => point,
        Err(refused) => return refused,
    };
    for strain in path {
        let increment: Vec<f64> = (0..hypothesis.n_components())
            .map(|i| strain[i] * scale * 100.0 / modulus(p, i))
            .collect();
        let verdict = point.advance(&increment, |stress, state, piece, end| {
            pyramid.check(stress, state, piece, end).map_err(|what| {
                format!(
                    "{what}; from {stress:?} {state:?} by {piece:?} to {:?} {:?}",
                    end.flux, end.state
                )
            })
        });
        if verdict != Verdict::Agrees {
            return verdict;
        }
    }
    Verdict::Agrees
}

/// The stress after `n` equal steps of the reference.
fn steps(pyramid: &Pyramid, start: &[f64], strain: &[f64], n: u32) -> Vec<f64> {
    let p = &pyramid.p;
    let each: Vec<f64> = strain.iter().map(|d| d / f64::from(n)).collect();
    let mut stress = start.to_vec();
    for _ in 0..n {
        let (at, _) = trial(p.e, p.nu, &stress, &each);
        stress = pyramid.end(&at).iter().map(|s| s.0).collect();
    }
    stress
}

/// Backward Euler extrapolated from `n` and 2n steps.
pub(crate) fn extrapolated(pyramid: &Pyramid, start: &[f64], strain: &[f64], n: u32) -> Vec<f64> {
    let one = steps(pyramid, start, strain, n);
    let two = steps(pyramid, start, strain, 2 * n);
    one.iter().zip(&two).map(|(a, b)| 2.0 * b - a).collect()
}

pub(crate) fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f64::max)
}

/// Paths that turn the axes: `error_controlled` within ten times its tolerance of the reference, the
/// error of `explicit` falling with the number of its substeps.
fn schemes() -> Family {
    let mut family = Family::new(
        "Mohr–Coulomb, explicit and error-controlled",
        "extrapolated steps of the same reference",
    );
    for phi in [1.0, 20.0, 35.0, 60.0] {
        for share in [0.0, 0.5, 1.0] {
            for (cohesion, tensile) in [(0.0, None), (5.0, None), (5.0, Some(1.0))] {
                let p = Parameters {
                    e: 1e5,
                    nu: 0.3,
                    cohesion,
                    phi,
                    psi: phi * share,
                    tensile,
                };
                let pyramid = Pyramid::new(p);
                let start = [-60.0, -100.0, -60.0, 0.0];
                let strain = [5e-4, -1e-3, 0.0, 2e-3];
                let truth = extrapolated(&pyramid, &start, &strain, 32);
                let rough = extrapolated(&pyramid, &start, &strain, 16);
                let doubt = distance(&truth, &rough);
                let size = distance(&truth, &[0.0; 4]);
                let run = |scheme: &[(&str, f64)]| -> Result<f64, Verdict> {
                    let mut point = build(&p, Hypothesis::PlaneStrain, scheme)?;
                    match point.advance(&strain, |_, _, _, _| Ok(())) {
                        Verdict::Agrees => Ok(distance(&point.flux, &truth)),
                        other => Err(other),
                    }
                };
                for tolerance in [1e-3, 1e-5] {
                    let error = run(&[("scheme", 2.0), ("scheme_tolerance", tolerance)]);
                    let verdict = match error {
                        Ok(error) if error <= 10.0 * tolerance * size + doubt => Verdict::Agrees,
                        Ok(error) => Verdict::Silent(format!("off by {error:e} ± {doubt:e}")),
                        Err(verdict) => verdict,
                    };
                    family.add(format!("{p:?}: error-controlled, {tolerance:e}"), verdict);
                }
                let explicit = |n: f64| run(&[("scheme", 1.0), ("substeps", n)]);
                let verdict = match (explicit(16.0), explicit(64.0)) {
                    (Ok(a), Ok(b))
                        if b <= 0.4 * a + 2.0 * doubt + 1e-9 * size && a <= 0.2 * size =>
                    {
                        Verdict::Agrees
                    }
                    (Ok(a), Ok(b)) => Verdict::Silent(format!("off by {a:e}, {b:e} ± {doubt:e}")),
                    (Err(verdict), _) | (_, Err(verdict)) => verdict,
                };
                family.add(format!("{p:?}: explicit, 16 and 64"), verdict);
            }
        }
    }
    family
}

fn elasticity() -> Family {
    let mut family = Family::new("elasticity", "Hooke's law, double-double");
    for e in [1e-6, 1.0, 2e8, 1e15] {
        for nu in [-0.999_999_999, -0.5, 0.0, 0.3, 0.499_999_999_9] {
            for hypothesis in [Hypothesis::PlaneStrain, Hypothesis::ThreeD] {
                let n = hypothesis.n_components();
                let values = [("young_modulus", e), ("poisson_ratio", nu)];
                let law = law("elastic", hypothesis, &values).unwrap();
                let mut point =
                    Point::new(law, &[-60.0, -100.0, 1e-3, 5.0, 0.0, 1e6][..n]).unwrap();
                let strain = [1e-3, -2e-3, 5e-9, 1.0, -1e-12, 1e3];
                let verdict = point.advance(&strain[..n], |stress, _, piece, end| {
                    let (at, reach) = trial(e, nu, stress, piece);
                    for i in 0..n {
                        near(
                            COMPONENTS[i],
                            end.flux[i],
                            at[i].0,
                            4.0 * f64::EPSILON * reach,
                        )?;
                    }
                    Ok(())
                });
                family.add(format!("E = {e:e}, ν = {nu}, {n} components"), verdict);
            }
        }
    }
    family
}
