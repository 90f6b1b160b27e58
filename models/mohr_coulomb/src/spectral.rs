//! Principal stresses and the way to their axes and back.
//!
//! The in-plane problem has a closed form: with the centre `m` and the radius `r` of Mohr's circle
//! the principal stresses are `m ± r`. The angle `θ` of the first axis enters only by `cos 2θ` and
//! `sin 2θ`, which are ratios to `r`. The spatial problem is solved by Jacobi rotations, which keep
//! repeated and nearly repeated values accurate and their axes orthonormal.

use nalgebra::{Matrix3, Matrix6, Vector3};

/// Pairs of principal axes, in the order of shear components.
const PAIRS: [[usize; 2]; 3] = [[0, 1], [0, 2], [1, 2]];

/// Mohr's circle of the plane 11 22, and the stress across it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MohrCircle {
    mean: f64,
    /// Half the difference of 11 and 22.
    half: f64,
    shear: f64,
    radius: f64,
    /// Component 33.
    out: f64,
}

/// A stress with components 11 22 33 12 seen from its principal axes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct InPlane {
    /// Principal stresses, largest first.
    pub(crate) stress: Vector3<f64>,
    /// Which of them lie in the plane.
    pub(crate) pair: Pair,
    /// cos 2θ and sin 2θ of the first axis in the plane.
    cos: f64,
    sin: f64,
}

/// Two principal stresses, by their places in descending order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Pair {
    First12,
    Outer13,
    Last23,
}

impl Pair {
    pub(crate) const ALL: [Self; 3] = [Self::First12, Self::Outer13, Self::Last23];

    /// Places of the larger, the smaller, and the one that is not of the pair.
    #[inline]
    pub(crate) const fn places(self) -> [usize; 3] {
        match self {
            Self::First12 => [0, 1, 2],
            Self::Outer13 => [0, 2, 1],
            Self::Last23 => [1, 2, 0],
        }
    }
}

impl MohrCircle {
    /// The circle of a stress whose components start with 11 22 33 12.
    #[inline]
    pub(crate) fn of(stress: &[f64]) -> Self {
        let half = 0.5 * (stress[0] - stress[1]);
        Self {
            mean: 0.5 * (stress[0] + stress[1]),
            half,
            shear: stress[3],
            radius: (half * half + stress[3] * stress[3]).sqrt(),
            out: stress[2],
        }
    }

    /// Largest and smallest principal stress.
    #[inline]
    pub(crate) fn extremes(&self) -> (f64, f64) {
        let (larger, smaller) = (self.mean + self.radius, self.mean - self.radius);
        (self.out.max(larger), self.out.min(smaller))
    }

    /// Principal stresses and axes.
    #[inline]
    pub(crate) fn principal(&self) -> InPlane {
        let (larger, smaller, out) = (self.mean + self.radius, self.mean - self.radius, self.out);
        let (stress, pair) = if out > larger {
            (Vector3::new(out, larger, smaller), Pair::Last23)
        } else if out > smaller {
            (Vector3::new(larger, out, smaller), Pair::Outer13)
        } else {
            (Vector3::new(larger, smaller, out), Pair::First12)
        };
        let (cos, sin) = if self.radius > 0.0 {
            (self.half / self.radius, self.shear / self.radius)
        } else {
            (1.0, 0.0)
        };
        InPlane {
            stress,
            pair,
            cos,
            sin,
        }
    }
}

/// ∂s/∂ε between principal values, seen by the mean and the half difference of the pair in the
/// plane: with u = (1, 1)/2 and v = (1, −1)/2 for that pair, `[uMu, uMv, vMu, vMv, uM₃, vM₃, M₃u,
/// M₃v, M₃₃]`, 3 the axis across the plane.
pub(crate) type InPlaneModuli = [f64; 9];

/// [`InPlaneModuli`] of an operator between sorted principal values.
pub(crate) fn in_plane_moduli(moduli: &Matrix3<f64>, pair: Pair) -> InPlaneModuli {
    let [i, j, k] = pair.places();
    let m = |p, q| moduli[(p, q)];
    let rows = |q| [0.5 * (m(i, q) + m(j, q)), 0.5 * (m(i, q) - m(j, q))];
    let ([u_i, v_i], [u_j, v_j], [u_k, v_k]) = (rows(i), rows(j), rows(k));
    [
        0.5 * (u_i + u_j),
        0.5 * (u_i - u_j),
        0.5 * (v_i + v_j),
        0.5 * (v_i - v_j),
        u_k,
        v_k,
        0.5 * (m(k, i) + m(k, j)),
        0.5 * (m(k, i) - m(k, j)),
        m(k, k),
    ]
}

impl InPlane {
    /// The stress with these principal values in the same axes, 11 22 33 12.
    #[inline]
    pub(crate) fn compose(&self, values: &Vector3<f64>) -> [f64; 4] {
        let [i, j, k] = self.pair.places();
        let mean = 0.5 * (values[i] + values[j]);
        let half = 0.5 * (values[i] - values[j]);
        let turned = self.cos * half;
        [mean + turned, mean - turned, values[k], self.sin * half]
    }

    /// Eq. (11) in the plane, row by row: Tᵀ diag(M, g) T with `shear` = g, written out.
    #[inline]
    pub(crate) fn tangent(&self, moduli: &InPlaneModuli, shear: f64) -> [[f64; 4]; 4] {
        let [uu, uv, vu, vv, u3, v3, m3u, m3v, m33] = *moduli;
        let (c, s) = (self.cos, self.sin);
        let (c_uv, c_vu, c_v3, c_3v) = (c * uv, c * vu, c * v3, c * m3v);
        // v ⊗ v turned, with the shear across it.
        let normal = c * c * vv + s * s * shear;
        let mixed = s * c * (vv - shear);
        let across = s * s * vv + c * c * shear;
        [
            [
                uu + c_uv + c_vu + normal,
                uu - c_uv + c_vu - normal,
                u3 + c_v3,
                s * uv + mixed,
            ],
            [
                uu + c_uv - c_vu - normal,
                uu - c_uv - c_vu + normal,
                u3 - c_v3,
                s * uv - mixed,
            ],
            [m3u + c_3v, m3u - c_3v, m33, s * m3v],
            [s * vu + mixed, s * vu - mixed, s * v3, across],
        ]
    }
}

/// A stress with components 11 22 33 12 13 23 seen from its principal axes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Spatial {
    /// Principal stresses, largest first.
    pub(crate) stress: Vector3<f64>,
    /// Takes strains to the principal axes (rows: the normal strains 1, 2, 3, then shear strains)
    /// and, transposed, stresses back.
    axes: Matrix6<f64>,
}

impl Spatial {
    /// Decomposes a stress.
    pub(crate) fn of(stress: &[f64]) -> Self {
        let (values, vectors) = jacobi(Matrix3::new(
            stress[0], stress[3], stress[4], //
            stress[3], stress[1], stress[5], //
            stress[4], stress[5], stress[2],
        ));
        let product = |p: usize, q: usize, a: usize, b: usize| {
            vectors[(a, p)] * vectors[(b, q)] + vectors[(b, p)] * vectors[(a, q)]
        };
        let axes = Matrix6::from_fn(|row, column| {
            let ([p, q], one_row) = if row < 3 {
                ([row, row], 0.5)
            } else {
                (PAIRS[row - 3], 1.0)
            };
            let [a, b] = if column < 3 {
                [column, column]
            } else {
                PAIRS[column - 3]
            };
            one_row * product(p, q, a, b)
        });
        Self {
            stress: values,
            axes,
        }
    }

    /// The stress with these principal values in the same axes.
    pub(crate) fn compose(&self, values: &Vector3<f64>) -> [f64; 6] {
        std::array::from_fn(|c| (0..3).map(|p| values[p] * self.axes[(p, c)]).sum())
    }

    /// Eq. (11) in space, row by row: Tᵀ diag(M, g₁₂, g₁₃, g₂₃) T.
    pub(crate) fn tangent(&self, moduli: &Matrix3<f64>, shear: [f64; 3]) -> [[f64; 6]; 6] {
        let mut operator = Matrix6::zeros();
        operator.fixed_view_mut::<3, 3>(0, 0).copy_from(moduli);
        for (i, g) in shear.into_iter().enumerate() {
            operator[(3 + i, 3 + i)] = g;
        }
        let tangent = self.axes.tr_mul(&(operator * self.axes));
        tangent.transpose().into()
    }
}

/// Bounds of the largest and the smallest principal stress in space, from the invariants.
#[inline]
pub(crate) fn bounds(stress: &[f64]) -> (f64, f64) {
    let mean = (stress[0] + stress[1] + stress[2]) / 3.0;
    let square = |(i, s): (usize, &f64)| {
        if i < 3 {
            0.5 * (s - mean) * (s - mean)
        } else {
            s * s
        }
    };
    let squares: f64 = stress.iter().enumerate().map(square).sum();
    let reach = (4.0 / 3.0 * squares).sqrt();
    (mean + reach, mean - reach)
}

/// Eigenvalues in descending order and their unit vectors, column by column.
pub(crate) fn jacobi(mut a: Matrix3<f64>) -> (Vector3<f64>, Matrix3<f64>) {
    /// Convergence is quadratic: four or five sweeps in practice.
    const MAX_SWEEPS: usize = 12;
    let negligible = 0.01 * f64::EPSILON * a.amax();
    let mut vectors = Matrix3::identity();
    for _ in 0..MAX_SWEEPS {
        let mut converged = true;
        for [p, q] in PAIRS {
            if a[(p, q)].abs() <= negligible {
                continue;
            }
            converged = false;
            // Tangent of the smaller angle that annuls a_pq.
            let ratio = (a[(q, q)] - a[(p, p)]) / (2.0 * a[(p, q)]);
            let tan = 1.0_f64.copysign(ratio) / (ratio.abs() + (ratio * ratio + 1.0).sqrt());
            let cos = 1.0 / (tan * tan + 1.0).sqrt();
            let sin = tan * cos;
            let shift = tan * a[(p, q)];
            a[(p, p)] -= shift;
            a[(q, q)] += shift;
            a[(p, q)] = 0.0;
            a[(q, p)] = 0.0;
            let r = 3 - p - q;
            let (a_rp, a_rq) = (a[(r, p)], a[(r, q)]);
            a[(r, p)] = cos * a_rp - sin * a_rq;
            a[(r, q)] = sin * a_rp + cos * a_rq;
            a[(p, r)] = a[(r, p)];
            a[(q, r)] = a[(r, q)];
            for k in 0..3 {
                let (v_p, v_q) = (vectors[(k, p)], vectors[(k, q)]);
                vectors[(k, p)] = cos * v_p - sin * v_q;
                vectors[(k, q)] = sin * v_p + cos * v_q;
            }
        }
        if converged {
            break;
        }
    }
    for [p, q] in [[0, 1], [1, 2], [0, 1]] {
        if a[(p, p)] < a[(q, q)] {
            a.swap((p, p), (q, q));
            vectors.swap_columns(p, q);
        }
    }
    (a.diagonal(), vectors)
}
