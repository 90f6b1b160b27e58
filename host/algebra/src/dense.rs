//! Dense matrices as L U, with row exchanges.

use crate::Singular;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::lu::partial_pivoting::factor as kernel;
use faer::linalg::triangular_solve as triangular;
use faer::prelude::ReborrowMut;
use faer::{MatMut, MatRef, Par, Spec};

/// Row exchanges, and their inverse.
#[derive(Debug, Default)]
pub(crate) struct Exchanges {
    pub(crate) forward: Vec<usize>,
    inverse: Vec<usize>,
}

/// Largest absolute value, looked for in eight places at once; values that are no numbers do not count.
pub fn largest(values: &[f64]) -> f64 {
    let (eights, rest) = values.as_chunks::<8>();
    let larger = |most: f64, value: f64| if value > most { value } else { most };
    let mut most = [0.0; 8];
    for eight in eights {
        for (most, value) in most.iter_mut().zip(eight) {
            *most = larger(*most, value.abs());
        }
    }
    let all = most.into_iter().chain(rest.iter().map(|value| value.abs()));
    all.fold(0.0, larger)
}

/// Factorises a square matrix in place.
///
/// # Errors
/// [`Singular`]: a pivot vanishes.
pub(crate) fn factorise(
    mut matrix: MatMut<'_, f64>,
    exchanges: &mut Exchanges,
) -> Result<(), Singular> {
    let n = matrix.nrows();
    exchanges.forward.resize(n, 0);
    exchanges.inverse.resize(n, 0);
    let scratch = kernel::lu_in_place_scratch::<usize, f64>(n, n, Par::Seq, Spec::default());
    kernel::lu_in_place(
        matrix.rb_mut(),
        &mut exchanges.forward,
        &mut exchanges.inverse,
        Par::Seq,
        MemStack::new(&mut MemBuffer::new(scratch)),
        Spec::default(),
    );
    let vanishes = |pivot: f64| pivot.abs() < f64::MIN_POSITIVE || !pivot.is_finite();
    if (0..n).any(|i| vanishes(matrix[(i, i)])) {
        return Err(Singular);
    }
    Ok(())
}

/// Solves with the factors (column-major) of a matrix.
pub(crate) fn solve(factors: &[f64], exchanges: &Exchanges, right: &[f64]) -> Vec<f64> {
    let n = right.len();
    let mut x: Vec<f64> = exchanges.forward.iter().map(|&from| right[from]).collect();
    let factors = MatRef::from_column_major_slice(factors, n, n);
    let mut column = MatMut::from_column_major_slice_mut(&mut x, n, 1);
    triangular::solve_unit_lower_triangular_in_place(factors, column.rb_mut(), Par::Seq);
    triangular::solve_upper_triangular_in_place(factors, column, Par::Seq);
    x
}

/// Pivots of [`Factors`] that are smaller than this, as a fraction of the largest entry of the matrix, are taken for what
/// rounding leaves of nothing.
const VANISHING: f64 = 1e-13;

/// A small dense matrix, factorised.
#[derive(Debug)]
pub struct Factors {
    /// L and U, column-major.
    values: Vec<f64>,
    exchanges: Exchanges,
}

impl Factors {
    /// Of a square matrix with `n` rows, column-major.
    ///
    /// # Errors
    /// [`Singular`], but for round-off.
    pub fn new(mut values: Vec<f64>, n: usize) -> Result<Self, Singular> {
        let least = VANISHING * largest(&values);
        let mut exchanges = Exchanges::default();
        let matrix = MatMut::from_column_major_slice_mut(&mut values, n, n);
        factorise(matrix, &mut exchanges)?;
        if (0..n).any(|i| values[i * n + i].abs() < least) {
            return Err(Singular);
        }
        Ok(Self { values, exchanges })
    }

    /// Solves for one right-hand side.
    pub fn solve(&self, right: &[f64]) -> Vec<f64> {
        solve(&self.values, &self.exchanges, right)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_matrices_are_solved_with_and_refused_where_they_are_singular() {
        // Columns (0, 2), (3, 1): rows have to be exchanged.
        let factors = Factors::new(vec![0.0, 2.0, 3.0, 1.0], 2).unwrap();
        let x = factors.solve(&[6.0, 4.0]);
        assert!((x[0] - 1.0).abs() < 1e-15 && (x[1] - 2.0).abs() < 1e-15);
        // Springs of 0.1 and 0.7 between three points that nothing holds.
        let free = vec![0.1, -0.1, 0.0, -0.1, 0.1 + 0.7, -0.7, 0.0, -0.7, 0.7];
        assert!(Factors::new(free.clone(), 3).is_err());
        let mut held = free;
        held[8] += 1e-6;
        assert!(Factors::new(held, 3).is_ok());
    }
}
