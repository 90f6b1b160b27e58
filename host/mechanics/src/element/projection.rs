//! Strains that are not those at the points where the law is evaluated.
//!
//! With few points an element follows plastic and incompressible flow without locking. But few points do not integrate
//! terms with the radius exactly: stresses in equilibrium with a weight would leave nodal forces. Therefore each of the
//! law's points q has a function ψ_q, which is one there and zero at the other points. The ψ_q span 1, x, y, and in
//! quads also ξη. With straight sides they are bilinear between the 2 × 2 points of a quad and linear between the 3 of
//! a triangle. The stress of the element is
//!
//! - σ(x) = Σ_q ψ_q(x) σ_q (1)
//!
//! Its nodal forces are integrated with enough points to be exact. The conjugate strains are mean values,
//!
//! - ε_q = ∫ ψ_q B dV u / W_q, W_q = ∫ ψ_q dV (2)
//!
//! so that Σ_q W_q σ_q · ε_q = ∫ σ · B dV u, the virtual work of (1). Every stress that is linear in the coordinates
//! has the form (1), also with curved sides. So weight and earth pressure at rest balance to round-off. In plane
//! strain with straight sides (2) is the strain at the point itself.
//!
//! A quad with four functions has one motion without strains (2). With bent sides, stresses whose directions turn with
//! the side do work in it, and a free wall moves to and fro. Quads therefore have three points along bent sides,
//! functions ξᵃηᵇ to match, and a linear volume strain.

use super::Axes;
use super::reference::RulePoint;
use super::solid::Point;

/// With a pivot below this the points of an element do not distinguish functions of size 1.
const SINGULAR: f64 = 1e-9;

/// Gives points the mean strains (2). `fine`: points of an exact rule; `value`: ψ of a point at one of them. `None` if
/// a point has no volume.
pub(super) fn project<const N: usize>(
    points: &mut [Point<N>],
    fine: &[Point<N>],
    value: impl Fn(usize, usize) -> f64,
) -> Option<()> {
    for (q, point) in points.iter_mut().enumerate() {
        let (mut a, mut b, mut h, mut volume) = ([0.0; N], [0.0; N], [0.0; N], 0.0);
        for (number, at) in fine.iter().enumerate() {
            let w = at.weight * value(q, number);
            volume += w;
            for i in 0..N {
                a[i] += w * at.a[i];
                b[i] += w * at.b[i];
                h[i] += w * at.h[i];
            }
        }
        if volume.is_nan() || volume <= 0.0 {
            return None;
        }
        *point = Point {
            a: a.map(|a| a / volume),
            b: b.map(|b| b / volume),
            h: h.map(|h| h / volume),
            weight: volume,
            position: point.position,
        };
    }
    Some(())
}

/// Values of the cardinal functions (one at their own point, zero at the others) at some places, place by place. They
/// are sums of given functions, one per point, with known values at the points (`own`) and at the places (`fine`).
/// `None` if the points do not distinguish these.
pub(super) fn cardinal(own: &[Vec<f64>], fine: &[Vec<f64>]) -> Option<Vec<Vec<f64>>> {
    let n = own.len();
    // Σ_q ψ_q(x) φ_k(x_q) = φ_k(x): rows k, a column for each point, then one for each place. Coordinates are relative
    // to the first point and scaled by the farthest one.
    let moved = |values: &[f64], k: usize| match k {
        1 | 2 => {
            let away = own.iter().map(|at| (at[k] - own[0][k]).abs());
            (values[k] - own[0][k]) / away.fold(0.0, f64::max)
        }
        _ => values[k],
    };
    let mut rows: Vec<Vec<f64>> = (0..n)
        .map(|k| own.iter().chain(fine).map(|at| moved(at, k)).collect())
        .collect();
    for column in 0..n {
        let size = |row: &usize| rows[*row][column].abs();
        let pivot = (column..n).max_by(|a, b| size(a).total_cmp(&size(b)))?;
        if size(&pivot).is_nan() || size(&pivot) < SINGULAR {
            return None;
        }
        rows.swap(column, pivot);
        let own = rows[column].clone();
        for (number, row) in rows.iter_mut().enumerate() {
            let factor = row[column] / own[column];
            if number == column {
                for value in row {
                    *value /= own[column];
                }
            } else {
                for (value, own) in row.iter_mut().zip(&own) {
                    *value -= factor * own;
                }
            }
        }
    }
    let at = |place: usize| rows.iter().map(|row| row[n + place]).collect();
    Some((0..fine.len()).map(at).collect())
}

/// Gives strains of an element's points the volume strain that is linear in the coordinates and nearest to
/// their own, ε + (ε̂_v − ε_v)/3 in each direction: B̄ with three volume strains an element. A constant one
/// (mean dilatation: Nagtegaal, Parks & Rice 1974) would not carry a pressure that grows with depth.
pub(super) fn linear_volume_strain<const N: usize>(points: &[Point<N>], strains: &mut [f64]) {
    even_out(&Linear::new(points), strains);
}

/// Stresses σ + (p̂ − p), with p the mean normal stress. Their nodal forces by B are those of `stresses` by the B̄
/// above.
pub(super) fn linear_volume_stress<const N: usize>(points: &[Point<N>], stresses: &mut [f64]) {
    even_out(&Linear::new(points), stresses);
}

/// Replaces the trace of each point's tensor by the linear function nearest to all of them.
fn even_out(linear: &Linear, tensors: &mut [f64]) {
    let traces: Vec<f64> = tensors
        .chunks_exact(4)
        .map(|t| t[0] + t[1] + t[2])
        .collect();
    let nearest = linear.nearest(&traces);
    for ((tensor, trace), nearest) in tensors.chunks_exact_mut(4).zip(traces).zip(nearest) {
        let change = (nearest - trace) / 3.0;
        tensor[..3]
            .iter_mut()
            .for_each(|component| *component += change);
    }
}

/// Functions of an element that are linear in the coordinates, by its points.
struct Linear {
    /// Weight, and coordinates from the centre of the weights.
    points: Vec<[f64; 3]>,
    volume: f64,
    /// Second moments xx, xy, yy of the weights, inverted.
    inverse: [f64; 3],
}

impl Linear {
    fn new<const N: usize>(points: &[Point<N>]) -> Self {
        let volume: f64 = points.iter().map(|point| point.weight).sum();
        let centre = [0, 1].map(|c| {
            let moments = points.iter().map(|point| point.weight * point.position[c]);
            moments.sum::<f64>() / volume
        });
        let from_centre = |point: &Point<N>| {
            let [x, y] = point.position;
            [point.weight, x - centre[0], y - centre[1]]
        };
        let points: Vec<[f64; 3]> = points.iter().map(from_centre).collect();
        let moment = |i: usize, j: usize| points.iter().map(|p| p[0] * p[i] * p[j]).sum::<f64>();
        let (xx, xy, yy) = (moment(1, 1), moment(1, 2), moment(2, 2));
        let determinant = xx * yy - xy * xy;
        Self {
            points,
            volume,
            inverse: [yy / determinant, -xy / determinant, xx / determinant],
        }
    }

    /// Values at the points of the linear function that is nearest to these, in the mean over the volume.
    fn nearest(&self, values: &[f64]) -> Vec<f64> {
        let both = || self.points.iter().zip(values);
        let sum = |i: usize| both().map(|(p, v)| p[0] * p[i] * v).sum::<f64>();
        let mean = both().map(|(p, v)| p[0] * v).sum::<f64>() / self.volume;
        let (x, y) = (sum(1), sum(2));
        let [xx, xy, yy] = self.inverse;
        let slope = [xx * x + xy * y, xy * x + yy * y];
        let value = |p: &[f64; 3]| mean + slope[0] * p[1] + slope[1] * p[2];
        self.points.iter().map(value).collect()
    }
}

/// Stiffness of an element with a linear volume strain, row-major: Σ B̄ᵀ D B̄ w. The rows of B̄ are those of B plus a
/// third of the difference between linear and own trace.
pub(super) fn linear_volume_stiffness<const N: usize>(
    points: &[Point<N>],
    axes: &Axes,
    tangent: &[f64],
    out: &mut [f64],
) {
    let rows = |point: &Point<N>| -> [Vec<f64>; 4] {
        let mut b = [0, 1, 2, 3].map(|_| vec![0.0; 2 * N]);
        for i in 0..N {
            for c in 0..2 {
                let (along, across) = (axes.along[c], axes.across[c]);
                b[0][2 * i + c] = point.a[i] * along;
                b[1][2 * i + c] = point.b[i] * across;
                b[3][2 * i + c] = point.b[i] * along + point.a[i] * across;
            }
            b[2][2 * i] = point.h[i];
        }
        b
    };
    let mut of_points: Vec<[Vec<f64>; 4]> = points.iter().map(rows).collect();
    let linear = Linear::new(points);
    for j in 0..2 * N {
        let traces = of_points.iter().map(|b| b[0][j] + b[1][j] + b[2][j]);
        let traces: Vec<f64> = traces.collect();
        let nearest = linear.nearest(&traces);
        for ((b, trace), nearest) in of_points.iter_mut().zip(traces).zip(nearest) {
            let change = (nearest - trace) / 3.0;
            b[..3].iter_mut().for_each(|row| row[j] += change);
        }
    }
    out.fill(0.0);
    for ((b, point), d) in of_points.iter().zip(points).zip(tangent.chunks_exact(16)) {
        for j in 0..2 * N {
            let db: [f64; 4] = std::array::from_fn(|c| {
                point.weight * (0..4).map(|e| d[4 * c + e] * b[e][j]).sum::<f64>()
            });
            for i in 0..2 * N {
                out[2 * N * i + j] += (0..4).map(|c| b[c][i] * db[c]).sum::<f64>();
            }
        }
    }
}

/// At each point of a rule the functions that strains are projected on: linear in the coordinates, and beyond.
pub(super) fn basis<const N: usize, F: IntoIterator<Item = f64>>(
    rule: &[RulePoint],
    points: &[Point<N>],
    beyond_linear: impl Fn([f64; 2]) -> F,
) -> Vec<Vec<f64>> {
    let both = rule.iter().zip(points);
    both.map(|(at, point)| {
        let linear = [1.0, point.position[0], point.position[1]];
        linear.into_iter().chain(beyond_linear(at.at)).collect()
    })
    .collect()
}
