//! Where to go from a sample: the free components that an operator asks for.

use super::Search;
use crate::state::{N_MAX, Step, Vector};
use nalgebra::{SMatrix, SVector};

/// Ratio of singular values below which a direction counts as flat.
pub(super) const FLAT: f64 = 1e-10;

impl Search<'_> {
    /// −(operator + K)⁻¹ r in the free components, of minimum norm where there is no inverse.
    pub(super) fn descent(&self, operator: &[f64], r: &Vector) -> Vector {
        let mut matrix = SMatrix::<f64, N_MAX, N_MAX>::zeros();
        for (a, &i) in self.free[..self.n_free].iter().enumerate() {
            for (b, &j) in self.free[..self.n_free].iter().enumerate() {
                matrix[(a, b)] = operator[i * self.n + j];
            }
            matrix[(a, a)] += self.stiffness[i];
        }
        let by_free = solve(&matrix, r, self.n_free, FLAT * 1e-4 * self.elastic_norm);
        let mut d = [0.0; N_MAX];
        for (k, &i) in self.free[..self.n_free].iter().enumerate() {
            d[i] = -by_free[k];
        }
        d
    }

    /// The end of the step if the law were elastic.
    pub(super) fn elastic_guess(&self, step: &Step<'_>) -> Vector {
        let (goal, start) = (step.goal, step.start);
        let answer = self.answer(start);
        let mut gradient = goal.gradient;
        for &i in &self.free[..self.n_free] {
            gradient[i] = start.gradient[i];
        }
        let mut r = [0.0; N_MAX];
        for (k, &i) in self.free[..self.n_free].iter().enumerate() {
            let spring = self.stiffness[i] * (start.gradient[i] - self.origin[i]);
            let prescribed: f64 = (0..self.n)
                .map(|j| self.elastic[i * self.n + j] * (gradient[j] - start.gradient[j]))
                .sum();
            r[k] = answer[i] + spring - goal.flux[i] + prescribed;
        }
        let d = self.descent(&self.elastic, &r);
        for &i in &self.free[..self.n_free] {
            gradient[i] += d[i];
        }
        gradient
    }

    /// The gradient of `base` moved by a part of d; `None` if rounding leaves it where it is.
    pub(super) fn moved(&self, d: &Vector, fraction: f64) -> Option<Vector> {
        let mut gradient = self.base.point.gradient;
        for &i in &self.free[..self.n_free] {
            gradient[i] += fraction * d[i];
        }
        let moves = gradient
            .iter()
            .zip(&self.base.point.gradient)
            .any(|(a, b)| a.to_bits() != b.to_bits());
        moves.then_some(gradient)
    }
}

/// x with A x = b in the leading m components: by elimination if A is regular, otherwise of minimum
/// norm among the least-squares solutions. Singular values up to `flat` count as zero.
fn solve(a: &SMatrix<f64, N_MAX, N_MAX>, b: &Vector, m: usize, flat: f64) -> Vector {
    macro_rules! sized {
        ($m:literal) => {{
            let a = a.fixed_view::<$m, $m>(0, 0).into_owned();
            let b = SVector::<f64, $m>::from_column_slice(&b[..$m]);
            let lu = a.full_piv_lu();
            let pivots = lu.u().diagonal().abs();
            let x = if pivots.min() > (FLAT * pivots.max()).max(flat) {
                lu.solve(&b)
            } else {
                let svd = a.svd(true, true);
                let threshold = (FLAT * svd.singular_values.max()).max(flat);
                svd.solve(&b, threshold).ok()
            };
            let mut padded = [0.0; N_MAX];
            if let Some(x) = x {
                padded[..$m].copy_from_slice(x.as_slice());
            }
            padded
        }};
    }
    match m {
        1 => sized!(1),
        2 => sized!(2),
        3 => sized!(3),
        4 => sized!(4),
        5 => sized!(5),
        _ => sized!(6),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn singular_matrices_give_the_solution_of_minimum_norm() {
        let mut a = SMatrix::<f64, N_MAX, N_MAX>::zeros();
        for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            a[(i, j)] = 3.0;
        }
        let x = solve(&a, &[6.0, 6.0, 0.0, 0.0, 0.0, 0.0], 2, 0.0);
        assert_relative_eq!(x[0], 1.0, epsilon = 1e-14);
        assert_relative_eq!(x[1], 1.0, epsilon = 1e-14);
    }

    #[test]
    fn a_vanishing_matrix_gives_no_step() {
        let a = SMatrix::<f64, N_MAX, N_MAX>::zeros();
        for m in 1..=N_MAX {
            assert!(
                solve(&a, &[1.0; N_MAX], m, 0.0)
                    .iter()
                    .all(|x| x.abs() == 0.0)
            );
        }
    }
}
