//! Dense work inside a front: the updates of its children, and what it leaves to its parent.

use faer::linalg::matmul::matmul;
use faer::linalg::matmul::triangular::{BlockStructure, matmul as triangular_matmul};
use faer::prelude::ReborrowMut;
use faer::{Accum, MatMut, MatRef, Par};
use rayon::prelude::*;
use std::ops::Range;

/// Branches with fewer floating-point operations than this are not worth a task of their own.
pub(super) const WORTHWHILE: f64 = 4e6;
/// Columns of an update matrix that are computed as one piece. Fixed, so that the result is the
/// same for any number of threads.
const PIECE: usize = 256;

/// a·b, added up in eight sums that can be worked on at once.
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

/// Adds a child's update to its parent's front (L: n × k, U: k × m) and update (m × m).
#[expect(clippy::too_many_arguments, reason = "one front, in its three parts")]
pub(super) fn extend(
    relative: &[u32],
    of_child: &[f64],
    k: usize,
    n: usize,
    symmetric: bool,
    l: &mut [f64],
    u: &mut [f64],
    update: &mut [f64],
) {
    let size = relative.len();
    let m = n - k;
    let inside = relative.partition_point(|&at| (at as usize) < k);
    let runs = runs(relative, inside);
    for (j, &column) in relative.iter().enumerate() {
        let source = &of_child[j * size..(j + 1) * size];
        let column = column as usize;
        let first = if symmetric { j } else { 0 };
        if column < k {
            let target = &mut l[column * n..(column + 1) * n];
            add(&runs, first, size, source, target, 0);
        } else {
            let column = column - k;
            if !symmetric {
                let target = &mut u[column * k..(column + 1) * k];
                add(&runs, 0, inside, source, target, 0);
            }
            let target = &mut update[column * m..(column + 1) * m];
            add(&runs, first.max(inside), size, source, target, k);
        }
    }
}

/// Rows that are neighbours in a child and in its parent.
struct Run {
    /// In the child.
    rows: Range<usize>,
    /// Where the first one stands in the parent.
    at: usize,
}

/// The runs of a child's rows; one ends where those that its parent eliminates end.
fn runs(relative: &[u32], inside: usize) -> Vec<Run> {
    let mut runs: Vec<Run> = Vec::new();
    for (row, &at) in relative.iter().enumerate() {
        let at = at as usize;
        match runs.last_mut() {
            Some(run) if row != inside && run.at + run.rows.len() == at => run.rows.end += 1,
            _ => runs.push(Run {
                rows: row..row + 1,
                at,
            }),
        }
    }
    runs
}

/// Adds rows `from..to` of a child's column to its parent's, which begins with row `top`.
fn add(runs: &[Run], from: usize, to: usize, source: &[f64], target: &mut [f64], top: usize) {
    for Run { rows, at } in runs {
        let (start, end) = (rows.start.max(from), rows.end.min(to));
        if start < end {
            let at = at + start - rows.start - top;
            let target = &mut target[at..at + end - start];
            for (target, value) in target.iter_mut().zip(&source[start..end]) {
                *target += value;
            }
        }
    }
}

/// update −= L Lᵀ, lower half.
pub(super) fn subtract_square(update: &mut [f64], m: usize, l: MatRef<'_, f64>) {
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
            Accum::Add,
            of_square,
            BlockStructure::Rectangular,
            of_square.transpose(),
            BlockStructure::Rectangular,
            -1.0,
            Par::Seq,
        );
        matmul(
            rest.rb_mut(),
            Accum::Add,
            of_rest,
            of_square.transpose(),
            -1.0,
            Par::Seq,
        );
    };
    in_pieces(update, m, l.ncols(), piece);
}

/// update −= L U.
pub(super) fn subtract_product(
    update: &mut [f64],
    m: usize,
    l: MatRef<'_, f64>,
    u: MatRef<'_, f64>,
) {
    let piece = |(number, columns): (usize, &mut [f64])| {
        let width = columns.len() / m;
        let target = MatMut::from_column_major_slice_mut(columns, m, width);
        let right = u.subcols(number * PIECE, width);
        matmul(target, Accum::Add, l, right, -1.0, Par::Seq);
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
