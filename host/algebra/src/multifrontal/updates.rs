//! Schur complements that fronts pass to their parents: storage and assembly.
#![expect(
    clippy::inline_always,
    reason = "only what is inlined is compiled for the processor's own vector instructions"
)]

use pulp::{Simd, WithSimd};
use std::ops::Range;

/// Rows that are neighbours in a front and in its parent, all of them pivots there or none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Run {
    /// The first row below the pivots of the front.
    row: u32,
    /// Its position in the parent.
    at: u32,
    len: u32,
}

impl Run {
    fn rows(&self) -> Range<usize> {
        self.row as usize..(self.row + self.len) as usize
    }

    /// Those of its columns that are among these of the parent: where they stand below the pivots of the front,
    /// and in the parent.
    #[inline(always)]
    fn columns(&self, of_parent: &Range<usize>) -> impl Iterator<Item = (usize, usize)> + use<> {
        let (row, at) = (self.row as usize, self.at as usize);
        let first = of_parent.start.max(at);
        let last = of_parent.end.min(at + self.len as usize);
        (first..last).map(move |column| (column - at + row, column))
    }

    /// The part from a row on; empty at the end of the run if nothing is left.
    fn from(&self, row: usize) -> Self {
        let skipped = (row as u32).saturating_sub(self.row).min(self.len);
        Self {
            row: self.row + skipped,
            at: self.at + skipped,
            len: self.len - skipped,
        }
    }
}

/// Appends the runs of rows at these positions of the parent, which has `k` pivots.
pub(super) fn add_runs(places: impl Iterator<Item = u32>, k: usize, runs: &mut Vec<Run>) {
    let start = runs.len();
    for (row, at) in (0..).zip(places) {
        match runs[start..].last_mut() {
            Some(run) if at as usize != k && run.at + run.len == at => run.len += 1,
            _ => runs.push(Run { row, at, len: 1 }),
        }
    }
}

/// An update matrix (`size` × `size`, column-major) and its place in the parent.
#[derive(Clone, Copy)]
pub(super) struct Update<'u> {
    pub(super) values: &'u [f64],
    pub(super) size: usize,
    pub(super) runs: &'u [Run],
    /// The lower half counts.
    pub(super) is_symmetric: bool,
}

/// Adds the updates of the children to the columns of the pivots of their parent (n × k), and to
/// their rows (k × m); to some of the columns, that is.
pub(super) struct OnPivots<'f> {
    pub(super) updates: &'f [Update<'f>],
    /// Which columns of the parent.
    pub(super) columns: Range<usize>,
    /// Values of those that are pivots.
    pub(super) l: &'f mut [f64],
    /// Values of the others, in the rows of the pivots.
    pub(super) u: &'f mut [f64],
    pub(super) n: usize,
    pub(super) k: usize,
}

impl OnPivots<'_> {
    /// The columns before this one, and the others.
    pub(super) fn split(self, column: usize) -> [Self; 2] {
        let Self {
            updates,
            columns,
            l,
            u,
            n,
            k,
        } = self;
        let pivots = |columns: Range<usize>| columns.end.min(k).saturating_sub(columns.start);
        let before = columns.start..column;
        let of_l = pivots(before.clone());
        let (l_before, l) = l.split_at_mut(of_l * n);
        let (u_before, u) = u.split_at_mut(u.len().min((before.len() - of_l) * k));
        let part = |columns, l, u| Self {
            updates,
            columns,
            l,
            u,
            n,
            k,
        };
        [
            part(before, l_before, u_before),
            part(column..columns.end, l, u),
        ]
    }
}

impl WithSimd for OnPivots<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        for update in self.updates {
            update.extend_pivots(&self.columns, (self.l, self.u), (self.n, self.k));
        }
    }
}

/// Adds them to what their parent leaves (m × m); to some of its columns, that is.
pub(super) struct OnRest<'f> {
    pub(super) updates: &'f [Update<'f>],
    pub(super) columns: Range<usize>,
    /// Values of these columns.
    pub(super) target: &'f mut [f64],
    pub(super) m: usize,
    /// Pivots of the parent.
    pub(super) k: usize,
}

impl WithSimd for OnRest<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        for update in self.updates {
            update.extend_rest(&self.columns, self.target, (self.m, self.k));
        }
    }
}

impl Update<'_> {
    /// Adds to the columns (n rows) and rows of the pivots of the parent.
    #[inline(always)]
    fn extend_pivots(
        &self,
        columns: &Range<usize>,
        (l, u): (&mut [f64], &mut [f64]),
        (n, k): (usize, usize),
    ) {
        let inside = self.inside(k);
        let first = columns.start;
        for run in self.runs {
            for (j, column) in run.columns(columns) {
                let source = &self.values[j * self.size..][..self.size];
                if column < k {
                    self.add(self.runs, j, source, &mut l[(column - first) * n..][..n], 0);
                } else if !self.is_symmetric {
                    let target = &mut u[(column - first.max(k)) * k..][..k];
                    self.add(&self.runs[..inside], j, source, target, 0);
                }
            }
        }
    }

    /// Adds to what the parent leaves (m × m), which has `k` pivots.
    #[inline(always)]
    fn extend_rest(&self, columns: &Range<usize>, target: &mut [f64], (m, k): (usize, usize)) {
        let rest = &self.runs[self.inside(k)..];
        let of_parent = columns.start + k..columns.end + k;
        for run in rest {
            for (j, column) in run.columns(&of_parent) {
                let source = &self.values[j * self.size..][..self.size];
                let target = &mut target[(column - of_parent.start) * m..][..m];
                self.add(rest, j, source, target, k);
            }
        }
    }

    /// How many runs are pivots of the parent.
    #[inline(always)]
    fn inside(&self, k: usize) -> usize {
        self.runs.partition_point(|run| (run.at as usize) < k)
    }

    /// Adds column `j` to a column of the parent that begins with row `top`.
    #[inline(always)]
    fn add(&self, runs: &[Run], j: usize, source: &[f64], target: &mut [f64], top: usize) {
        for run in runs {
            let run = if self.is_symmetric { run.from(j) } else { *run };
            let source = &source[run.rows()];
            let target = &mut target[run.at as usize - top..][..source.len()];
            for (target, value) in target.iter_mut().zip(source) {
                *target += value;
            }
        }
    }
}

/// Update matrices that wait for their parents, the last one first.
#[derive(Debug, Default)]
pub(super) struct Pile {
    values: Vec<f64>,
    used: usize,
}

impl Pile {
    /// Room for one more. Its content is undefined.
    pub(super) fn add(&mut self, len: usize) -> &mut [f64] {
        let start = self.used;
        self.used += len;
        if self.values.len() < self.used {
            self.values.resize(self.used, 0.0);
        }
        &mut self.values[start..self.used]
    }

    /// The last ones, `len` numbers together.
    pub(super) fn last(&self, len: usize) -> &[f64] {
        &self.values[self.used - len..self.used]
    }

    pub(super) fn remove(&mut self, len: usize) {
        self.used -= len;
    }

    pub(super) fn clear(&mut self) {
        self.used = 0;
    }
}
