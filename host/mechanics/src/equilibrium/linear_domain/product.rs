//! A dense matrix times a vector, which every iteration needs.
#![expect(
    clippy::inline_always,
    reason = "only what is inlined is compiled for the processor's own vector instructions"
)]

use pulp::{Arch, Simd, WithSimd};

/// forces += columns · u, column by column: the sums are those of one loop over the columns, to the bit.
/// Columns whose factor is zero are left out.
pub(super) fn add_product<'c>(
    columns: impl Iterator<Item = &'c [f64]>,
    u: &[f64],
    forces: &mut [f64],
) {
    // Just after a state that is counted from, nothing has moved.
    let moved = columns.zip(u.iter().copied()).filter(|(_, u)| *u != 0.0);
    let columns: Vec<(&[f64], f64)> = moved.collect();
    let columns = &columns[..];
    Arch::new().dispatch(Sums { columns, forces });
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

#[cfg(test)]
mod tests {
    use super::*;

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
