//! Triangular solutions inside a front. Columns are taken four at a time, which costs a quarter of the
//! passes over the right-hand side; every entry takes them in the order of single columns, so that the
//! bits are the same.
#![expect(
    clippy::inline_always,
    reason = "only what is inlined is compiled for the processor's own vector instructions"
)]

use super::Kind;
use super::kernels::{dot, packed};
use pulp::{Simd, WithSimd};

/// Columns that are taken at a time.
const WIDTH: usize = 4;

/// Eliminates the `k` pivots of a front from its right-hand side `own`.
pub(super) struct Down<'f> {
    pub(super) kind: Kind,
    pub(super) values: &'f [f64],
    pub(super) own: &'f mut [f64],
    pub(super) k: usize,
}

impl WithSimd for Down<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self {
            kind,
            values,
            own,
            k,
        } = self;
        let n = own.len();
        let column = |j: usize| {
            let start = match kind {
                Kind::Symmetric => packed(n, j),
                Kind::Unsymmetric => j * n + j,
            };
            &values[start..start + n - j]
        };
        let mut j = 0;
        while j < k {
            let width = WIDTH.min(k - j);
            let (pivots, below) = own[j..].split_at_mut(width);
            for c in 0..width {
                let column = column(j + c);
                if kind == Kind::Symmetric {
                    pivots[c] /= column[0];
                }
                let x = pivots[c];
                for (value, l) in pivots[c + 1..].iter_mut().zip(&column[1..]) {
                    *value -= l * x;
                }
            }
            if width == WIDTH {
                let columns = [0, 1, 2, 3].map(|c| &column(j + c)[WIDTH - c..]);
                subtract(below, columns, [pivots[0], pivots[1], pivots[2], pivots[3]]);
            } else {
                for (c, &x) in pivots.iter().enumerate() {
                    subtract_one(below, &column(j + c)[width - c..], x);
                }
            }
            j += width;
        }
    }
}

/// Finds the pivots `own` of a front from the values of the rows below them.
pub(super) struct Up<'f> {
    pub(super) kind: Kind,
    pub(super) values: &'f [f64],
    pub(super) own: &'f mut [f64],
    pub(super) below: &'f [f64],
}

impl WithSimd for Up<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let k = self.own.len();
        let n = k + self.below.len();
        match self.kind {
            Kind::Symmetric => {
                let mut end = k;
                while end > 0 {
                    let start = end - WIDTH.min(end);
                    let column = |j: usize| &self.values[packed(n, j)..packed(n, j + 1)];
                    let below = |j: usize| &column(j)[k - j..];
                    let mut from_below = [0.0; WIDTH];
                    if end - start == WIDTH {
                        from_below = dots([0, 1, 2, 3].map(|c| below(start + c)), self.below);
                    } else {
                        for (from_below, j) in from_below.iter_mut().zip(start..end) {
                            *from_below = dot(below(j), self.below);
                        }
                    }
                    for j in (start..end).rev() {
                        let from_own = dot(&column(j)[1..k - j], &self.own[j + 1..]);
                        let left = self.own[j] - from_below[j - start] - from_own;
                        self.own[j] = left / column(j)[0];
                    }
                    end = start;
                }
            }
            Kind::Unsymmetric => {
                let (l, u) = self.values.split_at(n * k);
                subtract_product(self.own, u, self.below);
                solve_upper(self.own, l, n);
            }
        }
    }
}

/// Products of four vectors with another one, each the same to the bit as [`dot`].
#[inline(always)]
fn dots(of: [&[f64]; WIDTH], b: &[f64]) -> [f64; WIDTH] {
    let (eights, rest) = b.as_chunks::<8>();
    let of = of.map(|a| a[..b.len()].as_chunks::<8>());
    let [p, q, r, s] = of.map(|(a, _)| &a[..eights.len()]);
    let mut sums = [[0.0; 8]; WIDTH];
    for (at, b) in eights.iter().enumerate() {
        for (sums, a) in sums.iter_mut().zip([&p[at], &q[at], &r[at], &s[at]]) {
            for i in 0..8 {
                sums[i] += a[i] * b[i];
            }
        }
    }
    let mut next = of.iter();
    sums.map(|sums| {
        let of_rest = next.next().map_or(&[][..], |(_, rest)| *rest);
        let of_rest: f64 = of_rest.iter().zip(rest).map(|(a, b)| a * b).sum();
        sums.iter().sum::<f64>() + of_rest
    })
}

/// own -= U below, U by columns.
#[inline(always)]
fn subtract_product(own: &mut [f64], u: &[f64], below: &[f64]) {
    let k = own.len();
    let (fours, rest) = below.as_chunks::<WIDTH>();
    let (of_fours, of_rest) = u.split_at(WIDTH * fours.len() * k);
    for (columns, x) in of_fours.chunks_exact(WIDTH * k).zip(fours) {
        let columns = [0, 1, 2, 3].map(|c| &columns[c * k..(c + 1) * k]);
        subtract(own, columns, *x);
    }
    for (column, &x) in of_rest.chunks_exact(k).zip(rest) {
        subtract_one(own, column, x);
    }
}

/// U x = own, with U above the diagonal of the n × k columns.
#[inline(always)]
fn solve_upper(own: &mut [f64], columns: &[f64], n: usize) {
    let mut end = own.len();
    while end > 0 {
        let width = WIDTH.min(end);
        let start = end - width;
        let column = |j: usize| &columns[j * n..j * n + end];
        let (above, pivots) = own[..end].split_at_mut(start);
        for c in (0..width).rev() {
            let column = &column(start + c)[start..];
            pivots[c] /= column[c];
            let x = pivots[c];
            for (value, u) in pivots[..c].iter_mut().zip(column) {
                *value -= u * x;
            }
        }
        if width == WIDTH {
            let columns = [3, 2, 1, 0].map(|c| &column(start + c)[..start]);
            subtract(above, columns, [pivots[3], pivots[2], pivots[1], pivots[0]]);
        } else {
            for (c, &x) in pivots.iter().enumerate().rev() {
                subtract_one(above, &column(start + c)[..start], x);
            }
        }
        end = start;
    }
}

/// Subtracts multiples of columns, the first one first.
#[inline(always)]
fn subtract(values: &mut [f64], columns: [&[f64]; WIDTH], x: [f64; WIDTH]) {
    let len = values.len();
    let [a, b, c, d] = columns.map(|column| &column[..len]);
    for i in 0..len {
        values[i] = (((values[i] - a[i] * x[0]) - b[i] * x[1]) - c[i] * x[2]) - d[i] * x[3];
    }
}

#[inline(always)]
fn subtract_one(values: &mut [f64], column: &[f64], x: f64) {
    for (value, column) in values.iter_mut().zip(column) {
        *value -= column * x;
    }
}
