//! Sparse linear equations: which factorisation, and the check of every solution.

use super::multifrontal::{Kind, Multifrontal};
use crate::assembly::Pattern;
use faer::prelude::Solve;
use faer::sparse::linalg::solvers::{Lu, SymbolicLu};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{ColMut, Par};
use std::sync::Arc;

/// Largest backward error of an accepted solution.
const BACKWARD_ERROR: f64 = 1e-10;

/// Sparse equations of one pattern. A multifrontal factorisation does the work; where its
/// restricted row exchanges lose accuracy, `faer`'s LU with full row exchanges takes over.
#[derive(Debug)]
pub struct LinearSolver {
    pattern: Arc<Pattern>,
    multifrontal: Multifrontal,
    values: Vec<f64>,
    /// The last matrix has been factorised by the multifrontal method.
    factorised: bool,
    row_exchanges: Option<RowExchanges>,
    /// Numerical factorisations so far.
    pub factorisations: u64,
    /// How many of them needed full row exchanges.
    pub fallbacks: u64,
}

/// The other method.
#[derive(Debug)]
struct RowExchanges {
    symbolic: SymbolicLu<u32>,
    factors: Option<Lu<u32, f64>>,
}

/// The matrix is singular, or so close to it that a solution would be noise.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Singular;

impl LinearSolver {
    /// Analyses a pattern. Matrices that are `symmetric` have to be positive definite. `lines` are
    /// the mesh lines on which the unknowns lie, see [`super::mesh_lines`].
    ///
    /// # Errors
    /// [`Singular`] if the pattern alone makes the matrix singular, or memory runs out.
    pub fn new(
        pattern: &Arc<Pattern>,
        symmetric: bool,
        lines: Option<&[[u32; 2]]>,
    ) -> Result<Self, Singular> {
        let kind = if symmetric {
            Kind::Symmetric
        } else {
            Kind::Unsymmetric
        };
        Ok(Self {
            multifrontal: Multifrontal::new(pattern, kind, &vec![false; pattern.n()], lines)?,
            pattern: Arc::clone(pattern),
            values: Vec::new(),
            factorised: false,
            row_exchanges: None,
            factorisations: 0,
            fallbacks: 0,
        })
    }

    /// Factorises the matrix with these values.
    ///
    /// # Errors
    /// [`Singular`].
    pub fn factorise(&mut self, values: Vec<f64>) -> Result<(), Singular> {
        self.values = values;
        if let Some(other) = &mut self.row_exchanges {
            other.factors = None;
        }
        if self.values.is_empty() {
            self.factorised = true;
            return Ok(());
        }
        self.factorisations += 1;
        self.factorised = self.multifrontal.factorise(&self.values).is_ok();
        if self.factorised {
            Ok(())
        } else {
            self.fall_back()
        }
    }

    /// Factorises with full row exchanges.
    fn fall_back(&mut self) -> Result<(), Singular> {
        // faer's sparse factorisations are slower with threads than without.
        faer::set_global_parallelism(Par::Seq);
        self.factorised = false;
        self.fallbacks += 1;
        let other = match &mut self.row_exchanges {
            Some(other) => other,
            none => none.insert(RowExchanges {
                symbolic: SymbolicLu::try_new(symbolic(&self.pattern)).map_err(|_| Singular)?,
                factors: None,
            }),
        };
        let matrix = SparseColMatRef::new(symbolic(&self.pattern), &self.values);
        let factors = Lu::try_new_with_symbolic(other.symbolic.clone(), matrix);
        other.factors = Some(factors.map_err(|_| Singular)?);
        Ok(())
    }

    /// Solves for one right-hand side, refines the solution where that helps, and checks its
    /// backward error.
    ///
    /// # Errors
    /// [`Singular`] if the matrix was never factorised or the solution is not one.
    pub fn solve(&mut self, right: &[f64]) -> Result<Vec<f64>, Singular> {
        if self.factorised {
            if let Ok(x) = self.refined(right) {
                return Ok(x);
            }
            self.fall_back()?;
        }
        self.refined(right)
    }

    fn refined(&self, right: &[f64]) -> Result<Vec<f64>, Singular> {
        let mut x = self.solve_once(right)?;
        for _ in 0..3 {
            let (residual, error) = self.residual(right, &x);
            if !error.is_finite() {
                return Err(Singular);
            }
            if error <= BACKWARD_ERROR {
                return Ok(x);
            }
            let correction = self.solve_once(&residual)?;
            x.iter_mut().zip(&correction).for_each(|(x, r)| *x += r);
        }
        Err(Singular)
    }

    fn solve_once(&self, right: &[f64]) -> Result<Vec<f64>, Singular> {
        if self.factorised {
            let (y, kept) = self.multifrontal.forward(right, None);
            return Ok(self.multifrontal.backward(&y, &kept, None));
        }
        let other = self
            .row_exchanges
            .as_ref()
            .and_then(|other| other.factors.as_ref());
        let mut x = right.to_vec();
        other
            .ok_or(Singular)?
            .solve_in_place(ColMut::from_slice_mut(&mut x));
        Ok(x)
    }

    /// b − A x, and the backward error ‖b − A x‖ / (‖A‖‖x‖ + ‖b‖) in maximum norms.
    fn residual(&self, right: &[f64], x: &[f64]) -> (Vec<f64>, f64) {
        let mut residual = right.to_vec();
        let mut row_sums = vec![0.0; right.len()];
        for column in 0..right.len() {
            for at in self.pattern.places(column) {
                let row = self.pattern.rows[at] as usize;
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

/// The pattern in faer's terms.
fn symbolic(pattern: &Pattern) -> SymbolicSparseColMatRef<'_, u32> {
    let n = pattern.n();
    SymbolicSparseColMatRef::new_checked(n, n, &pattern.column_start, None, &pattern.rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two_by_two() -> Arc<Pattern> {
        Arc::new(Pattern {
            column_start: vec![0, 2, 4],
            rows: vec![0, 1, 0, 1],
        })
    }

    #[test]
    fn solves_an_unsymmetric_system() {
        let mut solver = LinearSolver::new(&two_by_two(), false, None).unwrap();
        // Columns (4, 1), (2, 3).
        solver.factorise(vec![4.0, 1.0, 2.0, 3.0]).unwrap();
        let x = solver.solve(&[8.0, 7.0]).unwrap();
        assert!((x[0] - 1.0).abs() < 1e-15 && (x[1] - 2.0).abs() < 1e-15);
    }

    #[test]
    fn falls_back_to_full_row_exchanges() {
        // A zero on the diagonal, in a pivot block of its own: rows must be exchanged across.
        let n = 60;
        let mut pattern = Pattern {
            column_start: vec![0],
            rows: Vec::new(),
        };
        let mut values = Vec::new();
        for column in 0..n {
            for row in [column ^ 1, column] {
                pattern.rows.push(row as u32);
                values.push(if row == column { 1e-30 } else { 2.0 });
            }
            let start = pattern.rows.len() - 2;
            if column % 2 == 0 {
                pattern.rows.swap(start, start + 1);
                values.swap(start, start + 1);
            }
            pattern.column_start.push(pattern.rows.len() as u32);
        }
        let mut solver = LinearSolver::new(&Arc::new(pattern), false, None).unwrap();
        solver.factorise(values).unwrap();
        let x = solver.solve(&vec![1.0; n]).unwrap();
        assert!(x.iter().all(|x| (x - 0.5).abs() < 1e-15));
    }

    #[test]
    fn refuses_a_singular_system() {
        let mut solver = LinearSolver::new(&two_by_two(), false, None).unwrap();
        let refused = solver.factorise(vec![1.0, 2.0, 2.0, 4.0]).is_err()
            || solver.solve(&[1.0, 1.0]).is_err();
        assert!(refused);
    }
}
