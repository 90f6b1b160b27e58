//! Sparse linear equations, solved by `faer`. All that is known of that crate is here.

use crate::assembly::Pattern;
use faer::prelude::Solve;
use faer::sparse::linalg::solvers::{Lu, SymbolicLu};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{ColMut, Par};

/// Largest backward error of an accepted solution.
const BACKWARD_ERROR: f64 = 1e-10;

/// Sparse LU with row pivoting; the analysis of the pattern is done once.
#[derive(Debug)]
pub struct LinearSolver {
    pattern: Pattern,
    symbolic: SymbolicLu<usize>,
    values: Vec<f64>,
    factors: Option<Lu<usize, f64>>,
    /// Numerical factorisations so far.
    pub factorisations: u64,
}

/// The matrix is singular, or so close to it that a solution would be noise.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Singular;

impl LinearSolver {
    /// Analyses a pattern.
    ///
    /// # Errors
    /// [`Singular`] if the pattern alone makes the matrix singular, or memory runs out.
    pub fn new(pattern: &Pattern) -> Result<Self, Singular> {
        // faer's sparse factorisations are slower with threads than without.
        faer::set_global_parallelism(Par::Seq);
        let pattern = pattern.clone();
        let symbolic = SymbolicLu::try_new(symbolic(&pattern)).map_err(|_| Singular)?;
        Ok(Self {
            pattern,
            symbolic,
            values: Vec::new(),
            factors: None,
            factorisations: 0,
        })
    }

    /// Factorises the matrix with these values.
    ///
    /// # Errors
    /// [`Singular`].
    pub fn factorise(&mut self, values: &[f64]) -> Result<(), Singular> {
        self.values.clear();
        self.values.extend_from_slice(values);
        self.factors = None;
        if self.pattern.rows.is_empty() {
            return Ok(());
        }
        let matrix = SparseColMatRef::new(symbolic(&self.pattern), &self.values);
        let factors =
            Lu::try_new_with_symbolic(self.symbolic.clone(), matrix).map_err(|_| Singular)?;
        self.factorisations += 1;
        self.factors = Some(factors);
        Ok(())
    }

    /// Solves for one right-hand side, refines the solution once or twice if that helps, and
    /// checks its backward error.
    ///
    /// # Errors
    /// [`Singular`] if no factors are at hand or the solution is not one.
    pub fn solve(&self, right: &[f64]) -> Result<Vec<f64>, Singular> {
        let mut x = right.to_vec();
        if self.pattern.rows.is_empty() {
            return Ok(x);
        }
        let factors = self.factors.as_ref().ok_or(Singular)?;
        factors.solve_in_place(ColMut::from_slice_mut(&mut x));
        for _ in 0..3 {
            let (mut residual, error) = self.residual(right, &x);
            if !error.is_finite() {
                return Err(Singular);
            }
            if error <= BACKWARD_ERROR {
                return Ok(x);
            }
            factors.solve_in_place(ColMut::from_slice_mut(&mut residual));
            x.iter_mut().zip(&residual).for_each(|(x, r)| *x += r);
        }
        Err(Singular)
    }

    /// b − A x, and the backward error ‖b − A x‖ / (‖A‖‖x‖ + ‖b‖) in maximum norms.
    fn residual(&self, right: &[f64], x: &[f64]) -> (Vec<f64>, f64) {
        let mut residual = right.to_vec();
        let mut row_sums = vec![0.0; right.len()];
        for column in 0..right.len() {
            for at in self.pattern.column_start[column]..self.pattern.column_start[column + 1] {
                let row = self.pattern.rows[at];
                residual[row] -= self.values[at] * x[column];
                row_sums[row] += self.values[at].abs();
            }
        }
        let largest = |v: &[f64]| v.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        let scale = largest(&row_sums) * largest(x) + largest(right);
        let error = if scale > 0.0 {
            largest(&residual) / scale
        } else {
            0.0
        };
        let finite = residual.iter().chain(x).all(|v| v.is_finite());
        (residual, if finite { error } else { f64::NAN })
    }
}

fn symbolic(pattern: &Pattern) -> SymbolicSparseColMatRef<'_, usize> {
    let n = pattern.column_start.len() - 1;
    SymbolicSparseColMatRef::new_checked(n, n, &pattern.column_start, None, &pattern.rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two_by_two() -> Pattern {
        Pattern {
            column_start: vec![0, 2, 4],
            rows: vec![0, 1, 0, 1],
        }
    }

    #[test]
    fn solves_an_unsymmetric_system() {
        let mut solver = LinearSolver::new(&two_by_two()).unwrap();
        // Columns (4, 1), (2, 3).
        solver.factorise(&[4.0, 1.0, 2.0, 3.0]).unwrap();
        let x = solver.solve(&[8.0, 7.0]).unwrap();
        assert!((x[0] - 1.0).abs() < 1e-15 && (x[1] - 2.0).abs() < 1e-15);
    }

    #[test]
    fn refuses_a_singular_system() {
        let mut solver = LinearSolver::new(&two_by_two()).unwrap();
        let refused =
            solver.factorise(&[1.0, 2.0, 2.0, 4.0]).is_err() || solver.solve(&[1.0, 1.0]).is_err();
        assert!(refused);
    }
}
