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
