//! Dense matrices times a vector, which every iteration with a condensed domain needs.
#![expect(
    clippy::inline_always,
    reason = "only what is inlined is compiled for the processor's own vector instructions"
)]

use pulp::{Arch, Simd, WithSimd};

/// to += columns · u, column by column: the sums are those of one loop over the columns, to the bit.
/// Columns whose factor is zero are left out.
pub fn add_product<'c>(columns: impl Iterator<Item = &'c [f64]>, u: &[f64], to: &mut [f64]) {
    // Just after a state that is counted from, nothing has moved.
    let moved = columns.zip(u.iter().copied()).filter(|(_, u)| *u != 0.0);
    let columns: Vec<(&[f64], f64)> = moved.collect();
    let columns = &columns[..];
    Arch::new().dispatch(Sums {
        columns,
        forces: to,
    });
}

/// to += K u for a symmetric matrix, column-major, of which the lower half alone is read: what takes long is to
/// fetch it.
pub(crate) fn add_symmetric_product(matrix: &[f64], u: &[f64], to: &mut [f64]) {
    Arch::new().dispatch(SymmetricSums { matrix, u, to });
}

/// Four columns at a time: a force is loaded and stored once for them.
struct Sums<'a> {
    columns: &'a [(&'a [f64], f64)],
    forces: &'a mut [f64],
}

impl WithSimd for Sums<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let (fours, rest) = self.columns.as_chunks::<4>();
        for [(a, ua), (b, ub), (c, uc), (d, ud)] in fours {
            let rows = a.iter().zip(*b).zip(c.iter().zip(*d));
            for (force, ((a, b), (c, d))) in self.forces.iter_mut().zip(rows) {
                *force = (((*force + a * ua) + b * ub) + c * uc) + d * ud;
            }
        }
        for (column, u) in rest {
            for (force, s) in self.forces.iter_mut().zip(*column) {
                *force += s * u;
            }
        }
    }
}

/// Columns that are taken at a time, and rows.
const WIDTH: usize = 4;
const ROWS: usize = 4;

/// Four columns at a time: what they give to the rows below, and what those give to them.
struct SymmetricSums<'a> {
    matrix: &'a [f64],
    u: &'a [f64],
    to: &'a mut [f64],
}

impl WithSimd for SymmetricSums<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { matrix, u, to } = self;
        let n = u.len();
        let mut j = 0;
        while j < n {
            let end = n.min(j + WIDTH);
            // Between the columns themselves.
            for c in j..end {
                for r in j..end {
                    to[r] += matrix[j.max(c.min(r)) * n + c.max(r)] * u[c];
                }
            }
            if end - j == WIDTH {
                let columns = [0, 1, 2, 3].map(|c| &matrix[(j + c) * n + end..(j + c + 1) * n]);
                let factors = [u[j], u[j + 1], u[j + 2], u[j + 3]];
                let sums = both_ways(columns, factors, &u[end..], &mut to[end..]);
                for (to, sum) in to[j..end].iter_mut().zip(sums) {
                    *to += sum;
                }
            }
            j = end;
        }
    }
}

/// to += Σ column · factor, and the products of the columns with `u`.
#[inline(always)]
fn both_ways(
    columns: [&[f64]; WIDTH],
    factors: [f64; WIDTH],
    u: &[f64],
    to: &mut [f64],
) -> [f64; WIDTH] {
    let len = to.len();
    let [a, b, c, d] = columns.map(|column| column[..len].as_chunks::<ROWS>());
    let [fa, fb, fc, fd] = factors;
    let (of_u, rest_of_u) = u[..len].as_chunks::<ROWS>();
    let (of_to, rest_of_to) = to.as_chunks_mut::<ROWS>();
    let mut sums = [[0.0; ROWS]; WIDTH];
    let rows = a.0.iter().zip(b.0).zip(c.0.iter().zip(d.0));
    for (((a, b), (c, d)), (u, to)) in rows.zip(of_u.iter().zip(of_to)) {
        for i in 0..ROWS {
            to[i] = (((to[i] + a[i] * fa) + b[i] * fb) + c[i] * fc) + d[i] * fd;
            sums[0][i] += a[i] * u[i];
            sums[1][i] += b[i] * u[i];
            sums[2][i] += c[i] * u[i];
            sums[3][i] += d[i] * u[i];
        }
    }
    let mut sums = sums.map(|sums| sums.iter().sum::<f64>());
    for (i, (u, to)) in rest_of_u.iter().zip(rest_of_to).enumerate() {
        for (of_column, (sum, factor)) in [a.1, b.1, c.1, d.1]
            .iter()
            .zip(sums.iter_mut().zip(factors))
        {
            *to += of_column[i] * factor;
            *sum += of_column[i] * u;
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_of_a_symmetric_matrix_gives_the_product_of_both() {
        for n in [1, 2, 4, 5, 12, 13, 37, 64] {
            let value = |i: usize| f64::sin(1.0 + 7.3 * i as f64);
            let entry = |i: usize, j: usize| value(i.max(j) * n + i.min(j));
            let lower: Vec<f64> = (0..n * n)
                .map(|at| {
                    let (row, column) = (at % n, at / n);
                    if row >= column {
                        entry(row, column)
                    } else {
                        f64::NAN
                    }
                })
                .collect();
            let u: Vec<f64> = (0..n).map(|i| value(i + 5)).collect();
            let mut to: Vec<f64> = (0..n).map(|i| value(i + 11)).collect();
            let both =
                |(i, start): (usize, &f64)| start + (0..n).map(|j| entry(i, j) * u[j]).sum::<f64>();
            let expected: Vec<f64> = to.iter().enumerate().map(both).collect();
            add_symmetric_product(&lower, &u, &mut to);
            for (found, expected) in to.iter().zip(expected) {
                assert!((found - expected).abs() < 1e-14 * n as f64, "{n}");
            }
        }
    }

    #[test]
    fn sums_are_those_of_a_plain_loop() {
        for n in [1, 3, 4, 7, 8, 13, 37] {
            let value = |i: usize| f64::sin(1.0 + 7.3 * i as f64) * 1e3;
            let matrix: Vec<f64> = (0..n * n).map(value).collect();
            // Some columns are left out.
            let u: Vec<f64> = (0..n)
                .map(|i| if i % 3 == 1 { 0.0 } else { value(i + 5) })
                .collect();
            let mut forces: Vec<f64> = (0..n).map(|i| value(i + 11)).collect();
            let mut plain = forces.clone();
            for (column, u) in matrix.chunks(n).zip(&u) {
                for (force, s) in plain.iter_mut().zip(column) {
                    *force += s * u;
                }
            }
            add_product(matrix.chunks(n), &u, &mut forces);
            let bits = |values: &[f64]| values.iter().map(|v| v.to_bits()).collect::<Vec<u64>>();
            assert_eq!(bits(&forces), bits(&plain), "{n}");
        }
    }
}
