//! Dense work inside a front, and what it leaves to its parent.

use super::Kind;
use crate::dense::{self, Exchanges};
use crate::{Singular, threads};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor as cholesky_kernel;
use faer::linalg::matmul::matmul;
use faer::linalg::matmul::triangular::{BlockStructure, matmul as triangular_matmul};
use faer::linalg::triangular_solve as triangular;
use faer::prelude::{Reborrow, ReborrowMut};
use faer::{Accum, MatMut, MatRef, Par, Spec};
use std::ops::Range;

/// Branches with fewer floating-point operations than this are not worth a separate task.
pub(super) const WORTHWHILE: f64 = 4e6;
/// Columns of an update matrix that are computed as one piece, or two where they are shared among threads. Fixed,
/// so that the result is the same for any number of them.
const PIECE: usize = 256;
/// Columns that are not parted.
const FEW: usize = 64;

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

/// update = −L Lᵀ, lower half; `add` adds to some of its columns.
pub(super) fn leave_square(
    update: &mut [f64],
    l: MatRef<'_, f64>,
    add: impl Fn(Range<usize>, &mut [f64]) + Sync,
) {
    let m = l.nrows();
    let piece = |columns: Range<usize>, values: &mut [f64]| {
        let (start, width) = (columns.start, columns.len());
        let mut target = MatMut::from_column_major_slice_mut(&mut *values, m, width);
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
        add(columns, values);
    };
    in_pieces(update, m, l.ncols(), piece);
}

/// update = −L U; `add` adds to some of its columns.
pub(super) fn leave_product(
    update: &mut [f64],
    l: MatRef<'_, f64>,
    u: MatRef<'_, f64>,
    add: impl Fn(Range<usize>, &mut [f64]) + Sync,
) {
    let m = l.nrows();
    let piece = |columns: Range<usize>, values: &mut [f64]| {
        let target = MatMut::from_column_major_slice_mut(&mut *values, m, columns.len());
        let right = u.subcols(columns.start, columns.len());
        matmul(target, Accum::Replace, l, right, -1.0, Par::Seq);
        add(columns, values);
    };
    in_pieces(update, m, l.ncols(), piece);
}

/// Applies a function to pieces of the columns of an m × m matrix, in parallel where it pays.
fn in_pieces(
    update: &mut [f64],
    m: usize,
    k: usize,
    piece: impl Fn(Range<usize>, &mut [f64]) + Sync,
) {
    let blocks = (0..m)
        .step_by(PIECE)
        .map(|start| start..m.min(start + PIECE));
    let mut rest = update;
    let mut own = |columns: Range<usize>| {
        let values;
        (values, rest) = std::mem::take(&mut rest).split_at_mut(columns.len() * m);
        (columns, values)
    };
    if 2.0 * (m * m) as f64 * k as f64 > WORTHWHILE {
        let halves = blocks.flat_map(|block| {
            let middle = block.start + half(block.len());
            [block.start..middle, middle..block.end]
        });
        let pieces = halves.filter(|columns| !columns.is_empty()).map(own);
        threads::each(pieces, |(columns, values)| piece(columns, values));
    } else {
        for block in blocks {
            let (columns, values) = own(block);
            piece(columns, values);
        }
    }
}

/// Splits `n` columns into parts; one part if they are few. A column alone would be left to another kernel, with other
/// last bits.
pub(super) fn half(n: usize) -> usize {
    if n < FEW {
        n
    } else {
        (n / 2).next_multiple_of(8)
    }
}

/// L Lᵀ of the pivots of a front (n × k), with L below them.
pub(super) fn factorise_symmetric(l: &mut [f64], n: usize, k: usize) -> Result<(), Singular> {
    let mut lower = MatMut::from_column_major_slice_mut(l, n, k);
    let (mut pivots, below) = lower.rb_mut().split_at_row_mut(k);
    let scratch = cholesky_kernel::cholesky_in_place_scratch::<f64>(k, Par::Seq, Spec::default());
    cholesky_kernel::cholesky_in_place(
        pivots.rb_mut(),
        cholesky_kernel::LltRegularization::default(),
        Par::Seq,
        MemStack::new(&mut MemBuffer::new(scratch)),
        Spec::default(),
    )
    .map_err(|_| Singular)?;
    solve_beside(pivots.rb(), Kind::Symmetric, (below, &mut []), &[]);
    Ok(())
}

/// L U of the pivots of a front, with L below (n × k) and U to the right (k × m).
pub(super) fn factorise_unsymmetric(
    l: &mut [f64],
    u: &mut [f64],
    n: usize,
    k: usize,
    exchanges: &mut Exchanges,
) -> Result<(), Singular> {
    let mut lower = MatMut::from_column_major_slice_mut(l, n, k);
    let (mut pivots, below) = lower.rb_mut().split_at_row_mut(k);
    dense::factorise(pivots.rb_mut(), exchanges)?;
    solve_beside(
        pivots.rb(),
        Kind::Unsymmetric,
        (below, u),
        &exchanges.forward,
    );
    Ok(())
}

/// The blocks below the pivots of a front, or to their right.
enum Side<'v> {
    Below(MatMut<'v, f64>),
    Right(&'v mut [f64]),
}

/// L below (m × k) and U to the right (k × m) of the factorised pivots, in parallel if that is faster.
fn solve_beside(
    pivots: MatRef<'_, f64>,
    kind: Kind,
    (below, right): (MatMut<'_, f64>, &mut [f64]),
    exchanges: &[usize],
) {
    let (m, k) = (below.nrows(), pivots.nrows());
    let is_shared = 2.0 * (k * k) as f64 * m as f64 > WORTHWHILE;
    let middle = if is_shared { half(m) } else { m };
    let (upper, lower) = below.split_at_row_mut(middle);
    let (left, right) = right.split_at_mut(right.len().min(middle * k));
    let parts = [
        Side::Below(upper),
        Side::Right(left),
        Side::Below(lower),
        Side::Right(right),
    ];
    let solve = |side| match side {
        Side::Below(rows) => {
            let (factor, columns) = match kind {
                Kind::Symmetric => (pivots, rows.transpose_mut()),
                Kind::Unsymmetric => (pivots.transpose(), rows.transpose_mut()),
            };
            triangular::solve_lower_triangular_in_place(factor, columns, Par::Seq);
        }
        Side::Right(columns) => {
            let mut exchanged = vec![0.0; k];
            for column in columns.chunks_exact_mut(k) {
                for (value, &from) in exchanged.iter_mut().zip(exchanges) {
                    *value = column[from];
                }
                column.copy_from_slice(&exchanged);
            }
            let m = columns.len() / k;
            let columns = MatMut::from_column_major_slice_mut(columns, k, m);
            triangular::solve_unit_lower_triangular_in_place(pivots, columns, Par::Seq);
        }
    };
    let has_values = |side: &Side<'_>| match side {
        Side::Below(rows) => rows.nrows() > 0,
        Side::Right(columns) => !columns.is_empty(),
    };
    let parts = parts.into_iter().filter(has_values);
    if is_shared {
        threads::each(parts, solve);
    } else {
        parts.for_each(solve);
    }
}
