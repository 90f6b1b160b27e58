//! Principal stresses and the way to their axes and back.
//!
//! The in-plane problem has a closed form: with the centre `m` and the radius `r` of Mohr's circle
//! the principal stresses are `m ± r`, and all that is needed of the angle `θ` of the first axis
//! is `cos 2θ` and `sin 2θ`, ratios of `r`. The spatial problem is solved by Jacobi rotations,
//! which keep repeated and nearly repeated values accurate and their axes orthonormal.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

/// Pairs of principal axes, in the order of shear components.
const PAIRS: [[usize; 2]; 3] = [[0, 1], [0, 2], [1, 2]];

/// A stress seen from its principal axes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Principal<const N: usize> {
    /// Principal stresses, largest first.
    pub(crate) stress: Vector3<f64>,
    /// Takes strains to the principal axes (rows: the normal strains 1, 2, 3, then shear strains)
    /// and, transposed, stresses back.
    pub(crate) axes: SMatrix<f64, N, N>,
    /// The pair of axes (12, 13, 23 are 0, 1, 2) that each shear row belongs to.
    pub(crate) pairs: [usize; 3],
}

impl<const N: usize> Principal<N> {
    /// Decomposes a stress.
    #[inline]
    pub(crate) fn of(stress: &SVector<f64, N>) -> Self {
        if N == 4 {
            Self::in_plane(stress)
        } else {
            Self::spatial(stress)
        }
    }

    /// Components 11 22 33 12: axis 33 is principal.
    #[inline]
    fn in_plane(stress: &SVector<f64, N>) -> Self {
        let (mean, half, radius) = mohr_circle(stress);
        let (cos, sin) = if radius > 0.0 {
            (half / radius, stress[3] / radius)
        } else {
            (1.0, 0.0)
        };
        let (larger, smaller, out) = (mean + radius, mean - radius, stress[2]);
        // Places of the larger and the smaller in-plane value and of 33 in descending order.
        let ([i, j, k], pair) = if out > larger {
            ([1, 2, 0], 2)
        } else if out > smaller {
            ([0, 2, 1], 1)
        } else {
            ([0, 1, 2], 0)
        };
        let mut values = Vector3::zeros();
        (values[i], values[j], values[k]) = (larger, smaller, out);
        let mut axes = SMatrix::zeros();
        let mut set = |row, columns: [f64; 4]| {
            for (c, value) in columns.into_iter().enumerate() {
                axes[(row, c)] = value;
            }
        };
        let (near, far) = (0.5 * (1.0 + cos), 0.5 * (1.0 - cos));
        set(i, [near, far, 0.0, 0.5 * sin]);
        set(j, [far, near, 0.0, -0.5 * sin]);
        set(k, [0.0, 0.0, 1.0, 0.0]);
        set(3, [-sin, sin, 0.0, cos]);
        Self {
            stress: values,
            axes,
            pairs: [pair; 3],
        }
    }

    /// Components 11 22 33 12 13 23.
    fn spatial(stress: &SVector<f64, N>) -> Self {
        let (values, vectors) = jacobi(Matrix3::new(
            stress[0], stress[3], stress[4], //
            stress[3], stress[1], stress[5], //
            stress[4], stress[5], stress[2],
        ));
        let product = |p: usize, q: usize, a: usize, b: usize| {
            vectors[(a, p)] * vectors[(b, q)] + vectors[(b, p)] * vectors[(a, q)]
        };
        let axes = SMatrix::from_fn(|row, column| {
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
            pairs: [0, 1, 2],
        }
    }

    /// The stress with these principal values in the same axes.
    #[inline]
    pub(crate) fn compose(&self, values: &Vector3<f64>) -> [f64; N] {
        std::array::from_fn(|c| (0..3).map(|p| values[p] * self.axes[(p, c)]).sum())
    }
}

/// Largest and smallest principal stress: exact in the plane, in space bounds from the invariants.
#[inline]
pub(crate) fn extremes<const N: usize>(stress: &SVector<f64, N>) -> (f64, f64) {
    if N == 4 {
        let (mean, _, radius) = mohr_circle(stress);
        (stress[2].max(mean + radius), stress[2].min(mean - radius))
    } else {
        let mean = (stress[0] + stress[1] + stress[2]) / 3.0;
        let squares: f64 = (0..N)
            .map(|i| {
                if i < 3 {
                    0.5 * (stress[i] - mean).powi(2)
                } else {
                    stress[i].powi(2)
                }
            })
            .sum();
        let reach = (4.0 / 3.0 * squares).sqrt();
        (mean + reach, mean - reach)
    }
}

/// Centre, half difference of 11 and 22, and radius of the in-plane circle.
#[inline]
fn mohr_circle<const N: usize>(stress: &SVector<f64, N>) -> (f64, f64, f64) {
    let mean = 0.5 * (stress[0] + stress[1]);
    let half = 0.5 * (stress[0] - stress[1]);
    (mean, half, (half * half + stress[3] * stress[3]).sqrt())
}

/// Eigenvalues in descending order and their unit vectors, column by column.
fn jacobi(mut a: Matrix3<f64>) -> (Vector3<f64>, Matrix3<f64>) {
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
