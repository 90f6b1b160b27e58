//! Reference elements: what a kind of element is in its own coordinates. Gauss rules, and the 3-node line.

/// Shape functions at a point, and their derivatives by ξ and η.
pub(super) type Functions<const N: usize> = ([f64; N], [[f64; N]; 2]);

/// An element of N nodes in its own coordinates (ξ, η).
#[derive(Debug)]
pub(super) struct Reference<const N: usize> {
    /// Shape functions at (ξ, η).
    pub(super) shape: fn([f64; 2]) -> Functions<N>,
    /// Area between the corners of an element whose nodes lie here.
    pub(super) area: fn(&[[f64; 2]; N]) -> f64,
    /// A rule that integrates B r σ and N r exactly where σ is linear in the coordinates and the sides are
    /// straight: degree 5 in ξ and in η of quads, 3 of triangles.
    pub(super) exact: fn() -> Vec<RulePoint>,
    /// The same where sides are curved: degree 7 in ξ and in η of quads, 6 of triangles.
    pub(super) exact_curved: fn() -> Vec<RulePoint>,
    /// The rule with these numbers of points along ξ and η ([`Points::along`](super::kind::Points)).
    pub(super) rule: fn([usize; 2]) -> Vec<RulePoint>,
    /// Corners and middle of every side.
    pub(super) sides: &'static [[usize; 3]],
    /// Functions that strains can be projected on.
    pub(super) functions: Option<ProjectedOn>,
}

/// Functions that strains are projected on, one for each point.
#[derive(Debug)]
pub(super) struct ProjectedOn {
    /// The function that is one at the first point and zero at the other points of the law,
    /// evaluated at the second argument.
    pub(super) function: fn([f64; 2], [f64; 2]) -> f64,
    /// Terms of such functions beyond the linear ones, for this many points along ξ and along η.
    pub(super) beyond_linear: fn([usize; 2], [f64; 2]) -> Vec<f64>,
}

impl<const N: usize> Reference<N> {
    /// Whether a side of an element whose nodes lie here has its middle off the middle.
    pub(super) fn is_curved(&self, places: &[[f64; 2]; N]) -> bool {
        let mut sides = self.sides.iter();
        sides.any(|side| off(side.map(|node| places[node])) > STRAIGHT)
    }

    /// Derivatives of (x, y) by ξ and by η at (ξ, η), of an element whose nodes lie here.
    pub(super) fn tangents(&self, at: [f64; 2], places: &[[f64; 2]]) -> [[f64; 2]; 2] {
        let (_, derivatives) = (self.shape)(at);
        derivatives
            .map(|by| [0, 1].map(|c| by.iter().zip(places).map(|(by, place)| by * place[c]).sum()))
    }

    /// Whether the Jacobian of an element whose nodes lie here is positive at the points of its finest rule. A mesh that one
    /// integration can compute, another one can too.
    pub(super) fn is_regular(&self, places: &[[f64; 2]; N]) -> bool {
        let is_curved = self.is_curved(places);
        let rule = if is_curved {
            self.exact_curved
        } else {
            self.exact
        };
        rule().iter().all(|point| {
            let [xi, eta] = self.tangents(point.at, places);
            xi[0] * eta[1] - xi[1] * eta[0] > 0.0
        })
    }
}

/// How far the middle of a side (ends, middle) lies off that of its ends, as a part of its length.
pub(super) fn off([a, b, m]: [[f64; 2]; 3]) -> f64 {
    let off = [0, 1].map(|c| m[c] - f64::midpoint(a[c], b[c]));
    off[0].hypot(off[1]) / (b[0] - a[0]).hypot(b[1] - a[1])
}

/// A side whose middle lies off the middle of its ends by less than this part of it is straight.
const STRAIGHT: f64 = 1e-12;

/// Edges of quads: first corner, second corner, middle.
pub(super) const EDGES_OF_QUAD: [[usize; 3]; 4] = [[0, 1, 4], [1, 2, 5], [2, 3, 6], [3, 0, 7]];

/// Area between the corners of a quad.
pub(super) fn area_of_quad(places: &[[f64; 2]]) -> f64 {
    let [a, b, c, d] = [0, 1, 2, 3].map(|corner| places[corner]);
    0.5 * ((c[0] - a[0]) * (d[1] - b[1]) - (d[0] - b[0]) * (c[1] - a[1])).abs()
}

/// An integration point of the reference element.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct RulePoint {
    pub(super) at: [f64; 2],
    /// Its weight is the product.
    pub(super) weights: [f64; 2],
}

/// The rule with `n_xi` × `n_eta` Gauss points of a quad.
pub(super) fn quad_rule([n_xi, n_eta]: [usize; 2]) -> Vec<RulePoint> {
    let ((xi, w_xi), (eta, w_eta)) = (gauss(n_xi), gauss(n_eta));
    let mut points = Vec::with_capacity(n_xi * n_eta);
    for (&eta, &w_eta) in eta.iter().zip(w_eta) {
        for (&xi, &w_xi) in xi.iter().zip(w_xi) {
            points.push(RulePoint {
                at: [xi, eta],
                weights: [w_xi, w_eta],
            });
        }
    }
    points
}

/// The rule with `n` Gauss points of a triangle: 3, 6 or 7.
pub(super) fn triangle_rule(n: usize) -> Vec<RulePoint> {
    let point = |&(at, weight): &([f64; 2], f64)| RulePoint {
        at,
        weights: [weight, 1.0],
    };
    gauss_triangle(n).iter().map(point).collect()
}

/// The rule with 4 × 4 Gauss points of a square of which one side is drawn together: exact to degree 6.
pub(super) fn collapsed_rule() -> Vec<RulePoint> {
    let (at, weights) = gauss(4);
    let unit = || {
        at.iter()
            .zip(weights)
            .map(|(x, w)| (0.5 * (1.0 + x), 0.5 * w))
    };
    let of_column = |(xi, w): (f64, f64)| {
        unit().map(move |(eta, v)| RulePoint {
            at: [xi, eta * (1.0 - xi)],
            weights: [w, v * (1.0 - xi)],
        })
    };
    unit().flat_map(of_column).collect()
}

/// Points and weights of the Gauss rule with `n` points on (−1, 1); exact to degree 2n − 1.
///
/// # Panics
/// If `n` is not 1 to 4.
#[expect(clippy::panic, reason = "`n` comes from this program's own tables")]
pub fn gauss(n: usize) -> (&'static [f64], &'static [f64]) {
    // √(3/7 ± 2/7 √(6/5)) and (18 ∓ √30)/36.
    const FAR: f64 = 0.861_136_311_594_052_6;
    const NEAR: f64 = 0.339_981_043_584_856_3;
    const W_FAR: f64 = 0.347_854_845_137_453_85;
    const W_NEAR: f64 = 0.652_145_154_862_546_2;
    // 1/√3 and √(3/5).
    match n {
        1 => (&[0.0], &[2.0]),
        2 => (
            &[-0.577_350_269_189_625_8, 0.577_350_269_189_625_8],
            &[1.0, 1.0],
        ),
        3 => (
            &[-0.774_596_669_241_483_4, 0.0, 0.774_596_669_241_483_4],
            &[5.0 / 9.0, 8.0 / 9.0, 5.0 / 9.0],
        ),
        4 => (&[-FAR, -NEAR, NEAR, FAR], &[W_FAR, W_NEAR, W_NEAR, W_FAR]),
        _ => panic!("there is no Gauss rule with {n} points here"),
    }
}

/// Points and weights of the Gauss rule with `n` points on the triangle with corners (0, 0), (1, 0),
/// (0, 1): exact to degree 2 with 3 points, 4 with 6 (Strang & Fix 1973) and 5 with 7 (Radon 1948).
///
/// # Panics
/// If `n` is not 3, 6 or 7.
#[expect(clippy::panic, reason = "`n` comes from this program's own tables")]
pub(super) fn gauss_triangle(n: usize) -> &'static [([f64; 2], f64)] {
    const P: f64 = 0.445_948_490_915_964_9;
    const Q: f64 = 0.091_576_213_509_770_74;
    const W_P: f64 = 0.111_690_794_839_005_74;
    const W_Q: f64 = 0.054_975_871_827_660_935;
    // (6 ± √15)/21 and (155 ± √15)/2400.
    const R: f64 = 0.470_142_064_105_115_1;
    const S: f64 = 0.101_286_507_323_456_34;
    const W_R: f64 = 0.066_197_076_394_253_1;
    const W_S: f64 = 0.062_969_590_272_413_58;
    const THREE: [([f64; 2], f64); 3] = [
        ([1.0 / 6.0, 1.0 / 6.0], 1.0 / 6.0),
        ([2.0 / 3.0, 1.0 / 6.0], 1.0 / 6.0),
        ([1.0 / 6.0, 2.0 / 3.0], 1.0 / 6.0),
    ];
    const SIX: [([f64; 2], f64); 6] = [
        ([P, P], W_P),
        ([1.0 - 2.0 * P, P], W_P),
        ([P, 1.0 - 2.0 * P], W_P),
        ([Q, Q], W_Q),
        ([1.0 - 2.0 * Q, Q], W_Q),
        ([Q, 1.0 - 2.0 * Q], W_Q),
    ];
    const SEVEN: [([f64; 2], f64); 7] = [
        ([1.0 / 3.0, 1.0 / 3.0], 9.0 / 80.0),
        ([R, R], W_R),
        ([1.0 - 2.0 * R, R], W_R),
        ([R, 1.0 - 2.0 * R], W_R),
        ([S, S], W_S),
        ([1.0 - 2.0 * S, S], W_S),
        ([S, 1.0 - 2.0 * S], W_S),
    ];
    match n {
        3 => &THREE,
        6 => &SIX,
        7 => &SEVEN,
        _ => panic!("there is no Gauss rule with {n} points on a triangle here"),
    }
}

/// Shape functions of the 3-node line (ends, middle) at ξ, and their derivatives.
pub fn line_shape(xi: f64) -> ([f64; 3], [f64; 3]) {
    (
        [0.5 * xi * (xi - 1.0), 0.5 * xi * (xi + 1.0), 1.0 - xi * xi],
        [xi - 0.5, xi + 0.5, -2.0 * xi],
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn triangle_rules_are_exact_to_their_degree() {
        let factorial = |n: i32| (1..=n).map(f64::from).product::<f64>();
        for (n, degree) in [(3, 2), (6, 4), (7, 5), (16, 6)] {
            let rule = if n == 16 {
                collapsed_rule()
            } else {
                triangle_rule(n)
            };
            assert_eq!(rule.len(), n);
            let error = |p: i32, q: i32| {
                let term = |point: &RulePoint| {
                    let [x, y] = point.at;
                    point.weights[0] * point.weights[1] * x.powi(p) * y.powi(q)
                };
                let sum: f64 = rule.iter().map(term).sum();
                // ∫ ξ^p η^q = p! q! / (p + q + 2)!
                (sum - factorial(p) * factorial(q) / factorial(p + q + 2)).abs()
            };
            for p in 0..=degree {
                for q in 0..=degree - p {
                    assert!(error(p, q) < 2e-16, "{n}: {p} {q}");
                }
            }
            let beyond = (0..=degree + 1).map(|p| error(p, degree + 1 - p));
            assert!(beyond.fold(0.0, f64::max) > 1e-7, "{n}: no more than that");
        }
    }

    #[test]
    fn gauss_rules_are_exact_to_degree_2n_minus_1() {
        for n in 1..=4 {
            let (points, weights) = gauss(n);
            for degree in 0..2 * n as i32 {
                let sum: f64 = points
                    .iter()
                    .zip(weights)
                    .map(|(x, w)| w * x.powi(degree))
                    .sum();
                let exact = if degree % 2 == 0 {
                    2.0 / f64::from(degree + 1)
                } else {
                    0.0
                };
                assert_relative_eq!(sum, exact, epsilon = 1e-14);
            }
        }
    }
}
