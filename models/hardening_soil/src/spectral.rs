//! Principal values and axes of a symmetric tensor in the plane (11 22 33 12) and in space
//! (11 22 33 12 13 23).

use crate::rate::{Linear, Rate};
use std::array;

/// Row and column of a component.
const PLACE: [[usize; 2]; 6] = [[0, 0], [1, 1], [2, 2], [0, 1], [0, 2], [1, 2]];

/// A symmetric tensor seen from its principal axes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Principal<const N: usize> {
    /// Principal values, largest first.
    pub(crate) values: [f64; 3],
    axes: Axes,
}

/// The linear map of tensor components to those in the principal axes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Turn<const N: usize> {
    /// Takes strains to the axes; transposed, stresses back. Rows: normal components in descending
    /// order of the values, then one shear component for each of `pairs`.
    rows: [[f64; N]; N],
}

/// Unit vectors, one a row.
type Axes = [[f64; 3]; 3];

impl<const N: usize> Principal<N> {
    /// Decomposes a tensor, given as stress components.
    #[inline]
    pub(crate) fn of(tensor: &[f64; N]) -> Self {
        // What lies in a plane of space is decomposed as in the plane, to the last digit.
        let (values, axes) = if N == 4 || (tensor[4] == 0.0 && tensor[5] == 0.0) {
            in_plane([tensor[0], tensor[1], tensor[2], tensor[3]])
        } else {
            in_space(array::from_fn(|i| tensor[i]))
        };
        Self { values, axes }
    }

    /// The two axes of a shear component: in the plane the two that lie in it.
    #[inline]
    pub(crate) fn pair(&self, row: usize) -> [usize; 2] {
        if N == 4 {
            let across = (0..3).find(|&i| self.axes[i][2] != 0.0).unwrap_or(2);
            [usize::from(across == 0), if across == 2 { 1 } else { 2 }]
        } else {
            PLACE[row]
        }
    }

    /// The tensor with these principal values in the same axes.
    #[inline]
    pub(crate) fn compose(&self, values: &[f64; 3]) -> [f64; N] {
        array::from_fn(|c| {
            let [a, b] = PLACE[c];
            (0..3)
                .map(|i| values[i] * self.axes[i][a] * self.axes[i][b])
                .sum()
        })
    }

    /// The map to the axes.
    #[inline]
    pub(crate) fn turn(&self) -> Turn<N> {
        Turn {
            rows: array::from_fn(|row| {
                let [p, q] = if row < 3 { [row, row] } else { self.pair(row) };
                let (x, y) = (&self.axes[p], &self.axes[q]);
                array::from_fn(|column| {
                    let [a, b] = PLACE[column];
                    match (row < 3, column < 3) {
                        (true, _) => x[a] * x[b],
                        (false, true) => 2.0 * x[a] * y[a],
                        (false, false) => x[a] * y[b] + x[b] * y[a],
                    }
                })
            }),
        }
    }
}

impl<const N: usize> Turn<N> {
    /// Rate of a component of the strain in the axes.
    #[inline]
    pub(crate) fn strain(&self, row: usize) -> Rate<N> {
        Rate(self.rows[row])
    }

    /// A stress in the axes: normal components, then shear components.
    #[inline]
    pub(crate) fn stress<T: Linear>(&self, stress: &[T; N]) -> [T; N] {
        array::from_fn(|row| {
            let halved = if row < 3 { 1.0 } else { 0.5 };
            total::<T, N>(|c| {
                let twice = if c < 3 { 1.0 } else { 2.0 };
                stress[c] * (self.rows[row][c] * twice * halved)
            })
        })
    }

    /// The normal components alone.
    #[inline]
    pub(crate) fn normal<T: Linear>(&self, stress: &[T; N]) -> [T; 3] {
        array::from_fn(|row| {
            total::<T, N>(|c| stress[c] * (self.rows[row][c] * if c < 3 { 1.0 } else { 2.0 }))
        })
    }

    /// A stress given in the axes.
    #[inline]
    pub(crate) fn back<T: Linear>(&self, stress: &[T; N]) -> [T; N] {
        array::from_fn(|c| total::<T, N>(|row| stress[row] * self.rows[row][c]))
    }
}

/// Sum over all components.
#[inline]
fn total<T: Linear, const N: usize>(of: impl Fn(usize) -> T) -> T {
    (1..N).fold(of(0), |sum, i| sum + of(i))
}

/// Mohr's circle of 11 22 12, and 33.
#[inline]
fn in_plane([xx, yy, out, xy]: [f64; 4]) -> ([f64; 3], Axes) {
    let (mean, half) = (0.5 * (xx + yy), 0.5 * (xx - yy));
    let radius = (half * half + xy * xy).sqrt();
    // Half the angle of the first axis, from the larger of its two expressions.
    let (c, s) = if radius > 0.0 {
        if half >= 0.0 {
            let c = (0.5 * (1.0 + half / radius)).sqrt();
            (c, 0.5 * xy / (radius * c))
        } else {
            let s = (0.5 * (1.0 - half / radius)).sqrt();
            (0.5 * xy / (radius * s), s)
        }
    } else {
        (1.0, 0.0)
    };
    let (first, second, across) = ([c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]);
    let (larger, smaller) = (mean + radius, mean - radius);
    if out > larger {
        ([out, larger, smaller], [across, first, second])
    } else if out > smaller {
        ([larger, out, smaller], [first, across, second])
    } else {
        ([larger, smaller, out], [first, second, across])
    }
}

/// Jacobi rotations, which keep repeated values accurate and axes orthonormal.
fn in_space(t: [f64; 6]) -> ([f64; 3], Axes) {
    /// Convergence is quadratic: four or five sweeps in practice.
    const MAX_SWEEPS: usize = 12;
    let mut a = [[t[0], t[3], t[4]], [t[3], t[1], t[5]], [t[4], t[5], t[2]]];
    let largest = t.iter().fold(0.0_f64, |x, y| x.max(y.abs()));
    let negligible = 0.01 * f64::EPSILON * largest;
    let mut axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for _ in 0..MAX_SWEEPS {
        let mut converged = true;
        for [p, q] in [[0, 1], [0, 2], [1, 2]] {
            if a[p][q].abs() <= negligible {
                continue;
            }
            converged = false;
            // Tangent of the smaller angle that annuls a_pq.
            let ratio = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
            let tan = 1.0_f64.copysign(ratio) / (ratio.abs() + (ratio * ratio + 1.0).sqrt());
            let cos = 1.0 / (tan * tan + 1.0).sqrt();
            let sin = tan * cos;
            let shift = tan * a[p][q];
            a[p][p] -= shift;
            a[q][q] += shift;
            a[p][q] = 0.0;
            a[q][p] = 0.0;
            let r = 3 - p - q;
            let (rp, rq) = (a[r][p], a[r][q]);
            a[r][p] = cos * rp - sin * rq;
            a[r][q] = sin * rp + cos * rq;
            a[p][r] = a[r][p];
            a[q][r] = a[r][q];
            let (x, y) = (axes[p], axes[q]);
            axes[p] = array::from_fn(|k| cos * x[k] - sin * y[k]);
            axes[q] = array::from_fn(|k| sin * x[k] + cos * y[k]);
        }
        if converged {
            break;
        }
    }
    let mut values = [a[0][0], a[1][1], a[2][2]];
    for [p, q] in [[0, 1], [1, 2], [0, 1]] {
        if values[p] < values[q] {
            values.swap(p, q);
            axes.swap(p, q);
        }
    }
    (values, axes)
}
