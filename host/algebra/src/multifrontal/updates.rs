//! What fronts leave to their parents: where it waits, and how it is added.
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
    /// Where it stands in the parent.
    at: u32,
    len: u32,
}

impl Run {
    fn rows(&self) -> Range<usize> {
        self.row as usize..(self.row + self.len) as usize
    }

    /// The part from a row on; empty at the end of the run if there is none.
    fn from(&self, row: usize) -> Self {
        let skipped = (row as u32).saturating_sub(self.row).min(self.len);
        Self {
            row: self.row + skipped,
            at: self.at + skipped,
            len: self.len - skipped,
        }
    }
}

/// Appends the runs of rows that stand at these places of the parent, which has `k` pivots.
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
/// their rows (k × m).
pub(super) struct OnPivots<'f> {
    pub(super) updates: &'f [Update<'f>],
    pub(super) l: &'f mut [f64],
    pub(super) u: &'f mut [f64],
    pub(super) k: usize,
}

impl WithSimd for OnPivots<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        for update in self.updates {
            update.extend_pivots(self.l, self.u, self.l.len() / self.k, self.k);
        }
    }
}

/// Adds them to what their parent leaves (m × m).
pub(super) struct OnRest<'f> {
    pub(super) updates: &'f [Update<'f>],
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
            update.extend_rest(self.target, self.m, self.k);
        }
    }
}

impl Update<'_> {
    /// Adds to the columns (n rows) and rows of the pivots of the parent.
    #[inline(always)]
    fn extend_pivots(&self, l: &mut [f64], u: &mut [f64], n: usize, k: usize) {
        let inside = self.inside(k);
        for run in self.runs {
            for (j, column) in run.rows().zip(run.at as usize..) {
                let source = &self.values[j * self.size..][..self.size];
                if column < k {
                    self.add(self.runs, j, source, &mut l[column * n..][..n], 0);
                } else if !self.is_symmetric {
                    let target = &mut u[(column - k) * k..][..k];
                    self.add(&self.runs[..inside], j, source, target, 0);
                }
            }
        }
    }

    /// Adds to what the parent leaves (m × m), which has `k` pivots.
    #[inline(always)]
    fn extend_rest(&self, target: &mut [f64], m: usize, k: usize) {
        let rest = &self.runs[self.inside(k)..];
        for run in rest {
            for (j, column) in run.rows().zip(run.at as usize - k..) {
                let source = &self.values[j * self.size..][..self.size];
                self.add(rest, j, source, &mut target[column * m..][..m], k);
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
    /// Room for one more. What stands in it means nothing.
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
