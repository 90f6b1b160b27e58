//! Dense matrices as L U, with row exchanges.

use crate::{Singular, threads};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::lu::partial_pivoting::factor as kernel;
use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve as triangular;
use faer::prelude::{Reborrow, ReborrowMut};
use faer::{Accum, MatMut, MatRef, Par, Spec};

/// Row exchanges, and their inverse.
#[derive(Debug, Default)]
pub(crate) struct Exchanges {
    pub(crate) forward: Vec<usize>,
    inverse: Vec<usize>,
}

impl Exchanges {
    /// Further ones, among the rows from `start` on.
    fn add(&mut self, start: usize, later: &Self) {
        let rows = &mut self.forward[start..];
        let exchanged: Vec<usize> = later.forward.iter().map(|&from| rows[from]).collect();
        rows.copy_from_slice(&exchanged);
    }

    /// Sets the inverse.
    fn invert(&mut self) {
        self.inverse.resize(self.forward.len(), 0);
        for (to, &from) in self.forward.iter().enumerate() {
            self.inverse[from] = to;
        }
    }
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

/// Matrices with at least this many rows are factorised by blocks of columns. Threads share the
/// update of the columns to the right of a block. Then: the columns of a block, and the number of
/// columns that one thread finishes. Fixed,
/// so that the result is the same for any number of threads.
const LARGE: usize = 256;
const BLOCK: usize = 64;
const LAST: usize = 128;
/// Parts that the columns to the right of a block are shared in.
const PARTS: usize = 4;

/// Factorises a square matrix in place.
///
/// # Errors
/// [`Singular`]: a pivot vanishes.
pub(crate) fn factorise(
    mut matrix: MatMut<'_, f64>,
    exchanges: &mut Exchanges,
) -> Result<(), Singular> {
    let n = matrix.nrows();
    if n < LARGE {
        factorise_columns(matrix.rb_mut(), exchanges);
    } else {
        factorise_by_blocks(matrix.rb_mut(), exchanges);
    }
    let vanishes = |pivot: f64| pivot.abs() < f64::MIN_POSITIVE || !pivot.is_finite();
    if (0..n).any(|i| vanishes(matrix[(i, i)])) {
        return Err(Singular);
    }
    Ok(())
}

/// Factorises a matrix with no more columns than rows.
fn factorise_columns(matrix: MatMut<'_, f64>, exchanges: &mut Exchanges) {
    let (m, n) = (matrix.nrows(), matrix.ncols());
    exchanges.forward.resize(m, 0);
    exchanges.inverse.resize(m, 0);
    let scratch = kernel::lu_in_place_scratch::<usize, f64>(m, n, Par::Seq, Spec::default());
    kernel::lu_in_place(
        matrix,
        &mut exchanges.forward,
        &mut exchanges.inverse,
        Par::Seq,
        MemStack::new(&mut MemBuffer::new(scratch)),
        Spec::default(),
    );
}

/// While the columns to the right of a block are worked on, the next block is factorised, too: seldom is it waited for.
fn factorise_by_blocks(mut matrix: MatMut<'_, f64>, exchanges: &mut Exchanges) {
    let n = matrix.nrows();
    let width_at = |start: usize| {
        if n - start > LAST { BLOCK } else { n - start }
    };
    exchanges.forward.clear();
    exchanges.forward.extend(0..n);
    let mut of_block = Exchanges::default();
    factorise_columns(matrix.rb_mut().subcols_mut(0, width_at(0)), &mut of_block);
    let mut start = 0;
    while start < n {
        let width = width_at(start);
        let below = matrix.rb_mut().subrows_mut(start, n - start);
        let (left, rest) = below.split_at_col_mut(start);
        let (block, rest) = rest.split_at_col_mut(width);
        let (factor, below) = block.rb().split_at_row(width);
        let next = (rest.ncols() > 0).then(|| width_at(start + width));
        let parts = beside(left, rest, next);
        let moves = of_block.forward.iter().copied().enumerate();
        let moves: Vec<(usize, usize)> = moves.filter(|(to, from)| to != from).collect();
        let subtract = |mut columns: MatMut<'_, f64>| {
            exchange(columns.rb_mut(), &moves);
            let (mut above, rest) = columns.split_at_row_mut(width);
            triangular::solve_unit_lower_triangular_in_place(factor, above.rb_mut(), Par::Seq);
            matmul(rest, Accum::Add, below, above.rb(), -1.0, Par::Seq);
        };
        let of_parts = threads::map(parts, |part| match part {
            Beside::Left(columns) => {
                exchange(columns, &moves);
                None
            }
            Beside::Right(columns) => {
                subtract(columns);
                None
            }
            Beside::Next(mut columns) => {
                subtract(columns.rb_mut());
                let mut exchanges = Exchanges::default();
                factorise_columns(columns.split_at_row_mut(width).1, &mut exchanges);
                Some(exchanges)
            }
        });
        exchanges.add(start, &of_block);
        of_block = of_parts.into_iter().flatten().next().unwrap_or_default();
        start += width;
    }
    exchanges.invert();
}

/// Columns to the right of a factorised block.
enum Beside<'m> {
    Left(MatMut<'m, f64>),
    Right(MatMut<'m, f64>),
    /// Those of the block that follows.
    Next(MatMut<'m, f64>),
}

/// Parts of the columns beside a block; the next block, if there is one, of this width. That is most work, what stands
/// left least.
fn beside<'m>(
    left: MatMut<'m, f64>,
    mut rest: MatMut<'m, f64>,
    next: Option<usize>,
) -> Vec<Beside<'m>> {
    let mut parts = Vec::with_capacity(PARTS + 2);
    if let Some(width) = next {
        let next;
        (next, rest) = rest.split_at_col_mut(width);
        parts.push(Beside::Next(next));
    }
    let per_part = rest.ncols().div_ceil(PARTS).next_multiple_of(8);
    while rest.ncols() > 0 {
        let part;
        let width = per_part.min(rest.ncols());
        (part, rest) = rest.split_at_col_mut(width);
        parts.push(Beside::Right(part));
    }
    parts.push(Beside::Left(left));
    parts
}

/// Exchanges rows of some columns: those that move, and where they come from.
fn exchange(columns: MatMut<'_, f64>, moves: &[(usize, usize)]) {
    let mut moved = vec![0.0; moves.len()];
    for mut column in columns.col_iter_mut() {
        for (value, &(_, from)) in moved.iter_mut().zip(moves) {
            *value = column[from];
        }
        for (&value, &(to, _)) in moved.iter().zip(moves) {
            column[to] = value;
        }
    }
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

/// Pivots of [`Factors`] that are smaller than this, as a fraction of the largest entry of the matrix, are taken for
/// what rounding leaves of nothing.
const VANISHING: f64 = 1e-13;

/// A small dense matrix, factorised.
#[derive(Debug)]
pub struct Factors {
    /// L and U, column-major.
    values: Vec<f64>,
    exchanges: Exchanges,
}

impl Factors {
    /// Factorises a square matrix with `n` rows, column-major.
    ///
    /// # Errors
    /// [`Singular`], up to round-off.
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
    use nalgebra::{DMatrix, DVector};

    /// Pivots that have to be looked for in all rows.
    fn unordered(n: usize) -> Vec<f64> {
        (0..n * n)
            .map(|at| f64::sin((0.7 * at as f64).powi(2)))
            .collect()
    }

    fn factors(n: usize, threads: usize) -> (Vec<f64>, Vec<usize>) {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        pool.build().unwrap().install(|| {
            let (mut values, mut exchanges) = (unordered(n), Exchanges::default());
            let matrix = MatMut::from_column_major_slice_mut(&mut values, n, n);
            factorise(matrix, &mut exchanges).unwrap();
            for (to, &from) in exchanges.forward.iter().enumerate() {
                assert_eq!(exchanges.inverse[from], to);
            }
            (values, exchanges.forward)
        })
    }

    #[test]
    fn large_matrices_are_factorised_by_blocks_with_any_number_of_threads() {
        for n in [LARGE - 1, LARGE, LARGE + 41, 2 * LARGE] {
            let (values, forward) = factors(n, 1);
            let of_factors = DMatrix::from_column_slice(n, n, &values);
            let l = of_factors.lower_triangle();
            let l = DMatrix::from_fn(n, n, |i, j| if i == j { 1.0 } else { l[(i, j)] });
            // Of each column the largest entry was taken.
            assert!(l.amax() <= 1.0);
            let matrix = DMatrix::from_column_slice(n, n, &unordered(n));
            let exchanged = matrix.select_rows(&forward);
            let left = l * of_factors.upper_triangle() - exchanged;
            assert!(left.amax() < 1e-11, "{n}: {}", left.amax());
            let right: Vec<f64> = (0..n).map(|i| f64::cos(i as f64)).collect();
            let x = Factors::new(unordered(n), n).unwrap().solve(&right);
            let left = &matrix * DVector::from_vec(x) - DVector::from_vec(right);
            assert!(left.amax() < 1e-9, "{n}: {}", left.amax());
            assert_eq!(factors(n, 3), (values, forward), "{n}");
        }
    }

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
