//! Polynomials of second degree through strains at points, by least squares.

use super::{Point, Strain};

/// 1, x, y, x y, x², y².
const TERMS: usize = 6;
/// A term that is this near to a sum of the terms before it, relative to its size, is left out. The points do not
/// determine it, as those of a single row of elements do not determine y².
const DEPENDENT: f64 = 0.02;

/// A polynomial for every component.
#[derive(Clone, Debug)]
pub(super) struct Fit {
    centre: [f64; 2],
    /// Half the extent of the points.
    half: [f64; 2],
    coefficients: [[f64; TERMS]; 4],
}

impl Fit {
    /// Fits to these points.
    pub(super) fn of(points: &[Point]) -> Self {
        let middle = |c: usize| {
            let sum: f64 = points.iter().map(|point| point.at[c]).sum();
            sum / points.len().max(1) as f64
        };
        let centre = [middle(0), middle(1)];
        let half = [0, 1].map(|c| {
            let far = points.iter().map(|point| (point.at[c] - centre[c]).abs());
            let far = far.fold(0.0, f64::max);
            if far > 0.0 { far } else { 1.0 }
        });
        let mut fit = Self {
            centre,
            half,
            coefficients: [[0.0; TERMS]; 4],
        };
        let rows: Vec<[f64; TERMS]> = points.iter().map(|point| fit.terms(point.at)).collect();
        let basis = Basis::of(&rows);
        for (c, coefficients) in fit.coefficients.iter_mut().enumerate() {
            *coefficients = basis.solve(|i| points[i].strain[c]);
        }
        fit
    }

    /// The values at a place.
    pub(super) fn at(&self, at: [f64; 2]) -> Strain {
        let terms = self.terms(at);
        self.coefficients.map(|coefficients| {
            let products = coefficients.iter().zip(terms).map(|(a, b)| a * b);
            products.sum()
        })
    }

    fn terms(&self, at: [f64; 2]) -> [f64; TERMS] {
        let [x, y] = [0, 1].map(|c| (at[c] - self.centre[c]) / self.half[c]);
        [1.0, x, y, x * y, x * x, y * y]
    }
}

/// Columns of terms made orthonormal one after the other: A = Q R.
struct Basis {
    /// Terms that are not left out, with their columns.
    columns: Vec<(usize, Vec<f64>)>,
    r: [[f64; TERMS]; TERMS],
}

impl Basis {
    fn of(rows: &[[f64; TERMS]]) -> Self {
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let mut basis = Self {
            columns: Vec::with_capacity(TERMS),
            r: [[0.0; TERMS]; TERMS],
        };
        for term in 0..TERMS {
            let mut column: Vec<f64> = rows.iter().map(|row| row[term]).collect();
            let size = dot(&column, &column).sqrt();
            for (other, known) in &basis.columns {
                let part = dot(known, &column);
                basis.r[*other][term] = part;
                for (value, known) in column.iter_mut().zip(known) {
                    *value -= part * known;
                }
            }
            let left = dot(&column, &column).sqrt();
            if left > DEPENDENT * size {
                for value in &mut column {
                    *value /= left;
                }
                basis.r[term][term] = left;
                basis.columns.push((term, column));
            }
        }
        basis
    }

    /// Coefficients of the terms; 0 of those that are left out.
    fn solve(&self, value: impl Fn(usize) -> f64) -> [f64; TERMS] {
        let mut coefficients = [0.0; TERMS];
        for (term, column) in self.columns.iter().rev() {
            let product = column.iter().enumerate().map(|(i, q)| q * value(i));
            let known: f64 = (term + 1..TERMS)
                .map(|later| self.r[*term][later] * coefficients[later])
                .sum();
            coefficients[*term] = (product.sum::<f64>() - known) / self.r[*term][*term];
        }
        coefficients
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn point(at: [f64; 2], value: impl Fn([f64; 2]) -> f64) -> Point {
        Point {
            at,
            weight: 1.0,
            strain: [value(at), 0.0, 0.0, 1.0],
        }
    }

    #[test]
    fn a_polynomial_of_second_degree_is_found_again() {
        let exact = |[x, y]: [f64; 2]| 3.0 - x + 2.0 * y + 0.5 * x * y - x * x + 4.0 * y * y;
        let at = |i: usize| [100.0 + (i % 4) as f64, 0.01 * (i / 4) as f64];
        let points: Vec<Point> = (0..16).map(|i| point(at(i), exact)).collect();
        let fit = Fit::of(&points);
        for at in [[100.3, 0.02], [103.0, -0.01]] {
            assert_relative_eq!(fit.at(at)[0], exact(at), max_relative = 1e-9);
            assert_relative_eq!(fit.at(at)[3], 1.0, max_relative = 1e-12);
        }
    }

    #[test]
    fn what_the_points_do_not_tell_is_left_out() {
        // Two rows of points: nothing is known of y².
        let exact = |[x, y]: [f64; 2]| 1.0 + x + y + x * x;
        let at = |i: usize| [(i % 6) as f64, (i / 6) as f64];
        let points: Vec<Point> = (0..12).map(|i| point(at(i), exact)).collect();
        let fit = Fit::of(&points);
        for at in [[2.5, 0.5], [2.5, 3.0]] {
            assert_relative_eq!(fit.at(at)[0], exact(at), max_relative = 1e-12);
        }
        // One point: its value everywhere.
        let fit = Fit::of(&points[..1]);
        assert_relative_eq!(fit.at([7.0, 7.0])[0], 1.0);
    }
}
