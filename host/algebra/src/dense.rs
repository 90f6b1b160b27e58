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
