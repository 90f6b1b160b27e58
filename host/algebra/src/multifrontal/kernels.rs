//! Dense work inside a front, and what it leaves to its parent.

use crate::Singular;
use crate::dense::{self, Exchanges};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor as cholesky_kernel;
use faer::linalg::matmul::matmul;
use faer::linalg::matmul::triangular::{BlockStructure, matmul as triangular_matmul};
use faer::linalg::triangular_solve as triangular;
use faer::prelude::{Reborrow, ReborrowMut};
use faer::{Accum, MatMut, MatRef, Par, Spec};
use rayon::prelude::*;

/// Branches with fewer floating-point operations than this are not worth a task of their own.
pub(super) const WORTHWHILE: f64 = 4e6;
/// Columns of an update matrix that are computed as one piece. Fixed, so that the result is the
/// same for any number of threads.
const PIECE: usize = 256;

/// a·b, added up in eight sums that can be worked on at once.
#[inline]
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let (a, of_a) = a.as_chunks::<8>();
    let (b, of_b) = b.as_chunks::<8>();
    let mut sums = [0.0; 8];
    for (a, b) in a.iter().zip(b) {
        for i in 0..8 {
            sums[i] += a[i] * b[i];
        }
    }
    let rest: f64 = of_a.iter().zip(of_b).map(|(a, b)| a * b).sum();
    sums.iter().sum::<f64>() + rest
}

/// Where column j of a packed L of n rows starts.
pub(super) fn packed(n: usize, j: usize) -> usize {
    j * (2 * n + 1 - j) / 2
}

/// Moves the columns of L (n × k) together, without what stands above the diagonal.
pub(super) fn pack(values: &mut Vec<f64>, n: usize, k: usize) {
    for j in 1..k {
        values.copy_within(j * n + j..(j + 1) * n, packed(n, j));
    }
    values.truncate(packed(n, k));
    values.shrink_to_fit();
}

/// update = −L Lᵀ, lower half.
fn leave_square(update: &mut [f64], m: usize, l: MatRef<'_, f64>) {
    let piece = |(number, columns): (usize, &mut [f64])| {
        let start = number * PIECE;
        let width = columns.len() / m;
        let mut target = MatMut::from_column_major_slice_mut(columns, m, width);
        let (mut square, mut rest) = target
            .rb_mut()
            .subrows_mut(start, m - start)
            .split_at_row_mut(width);
        let (of_square, of_rest) = l.subrows(start, m - start).split_at_row(width);
        triangular_matmul(
            square.rb_mut(),
            BlockStructure::TriangularLower,
            Accum::Replace,
            of_square,
            BlockStructure::Rectangular,
            of_square.transpose(),
            BlockStructure::Rectangular,
            -1.0,
            Par::Seq,
        );
        matmul(
            rest.rb_mut(),
            Accum::Replace,
            of_rest,
            of_square.transpose(),
            -1.0,
            Par::Seq,
        );
    };
    in_pieces(update, m, l.ncols(), piece);
}

/// update = −L U.
fn leave_product(update: &mut [f64], l: MatRef<'_, f64>, u: MatRef<'_, f64>) {
    let m = l.nrows();
    let piece = |(number, columns): (usize, &mut [f64])| {
        let width = columns.len() / m;
        let target = MatMut::from_column_major_slice_mut(columns, m, width);
        let right = u.subcols(number * PIECE, width);
        matmul(target, Accum::Replace, l, right, -1.0, Par::Seq);
    };
    in_pieces(update, m, l.ncols(), piece);
}

/// Applies a function to pieces of the columns of an m × m matrix, in parallel where it pays.
fn in_pieces(
    update: &mut [f64],
    m: usize,
    k: usize,
    piece: impl Fn((usize, &mut [f64])) + Send + Sync,
) {
    if m == 0 {
        return;
    }
    if m > PIECE && 2.0 * (m * m) as f64 * k as f64 > WORTHWHILE {
        update
            .par_chunks_mut(PIECE * m)
            .enumerate()
            .with_max_len(1)
            .for_each(piece);
    } else {
        update.chunks_mut(PIECE * m).enumerate().for_each(piece);
    }
}

/// L Lᵀ of the pivots of a front (n × k), and −L Lᵀ of what is below them.
pub(super) fn factorise_symmetric(
    l: &mut [f64],
    n: usize,
    k: usize,
    update: &mut [f64],
) -> Result<(), Singular> {
    let mut lower = MatMut::from_column_major_slice_mut(l, n, k);
    let (mut pivots, mut below) = lower.rb_mut().split_at_row_mut(k);
    let scratch = cholesky_kernel::cholesky_in_place_scratch::<f64>(k, Par::Seq, Spec::default());
    cholesky_kernel::cholesky_in_place(
        pivots.rb_mut(),
        cholesky_kernel::LltRegularization::default(),
        Par::Seq,
        MemStack::new(&mut MemBuffer::new(scratch)),
        Spec::default(),
    )
    .map_err(|_| Singular)?;
    triangular::solve_lower_triangular_in_place(
        pivots.rb(),
        below.rb_mut().transpose_mut(),
        Par::Seq,
    );
    leave_square(update, n - k, below.rb());
    Ok(())
}

/// L U of the pivots of a front, with L below (n × k) and U beside them (k × m), and −L U of these.
pub(super) fn factorise_unsymmetric(
    l: &mut [f64],
    u: &mut [f64],
    n: usize,
    k: usize,
    update: &mut [f64],
    exchanges: &mut Exchanges,
) -> Result<(), Singular> {
    let mut lower = MatMut::from_column_major_slice_mut(l, n, k);
    let (mut pivots, mut below) = lower.rb_mut().split_at_row_mut(k);
    dense::factorise(pivots.rb_mut(), exchanges)?;
    let mut exchanged = vec![0.0; k];
    for column in u.chunks_exact_mut(k) {
        for (value, &from) in exchanged.iter_mut().zip(&exchanges.forward) {
            *value = column[from];
        }
        column.copy_from_slice(&exchanged);
    }
    let mut right = MatMut::from_column_major_slice_mut(u, k, n - k);
    triangular::solve_unit_lower_triangular_in_place(pivots.rb(), right.rb_mut(), Par::Seq);
    triangular::solve_lower_triangular_in_place(
        pivots.rb().transpose(),
        below.rb_mut().transpose_mut(),
        Par::Seq,
    );
    leave_product(update, below.rb(), right.rb());
    Ok(())
}
