//! Results along a path, how far two of them differ, and how far the finest of them is converged.

use super::bits;
use serde::{Deserialize, Serialize};

/// Values along a path.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Rows {
    /// Names of the values.
    pub(crate) names: Vec<String>,
    /// Values by stretch (segment or phase) and increment; NaN where absent.
    #[serde(with = "bits")]
    pub(crate) stretches: Vec<Vec<Vec<f64>>>,
    /// For every value the magnitude up to which it is zero, but for what round-off and the tolerance of equilibrium
    /// leave; none is where absent of these.
    #[serde(with = "bits")]
    pub(crate) zeros: Vec<f64>,
}

impl Rows {
    /// The largest magnitude of every value; 0 of those that are [zero](Self::zeros).
    pub(crate) fn largest(&self) -> Vec<f64> {
        let mut largest = vec![0.0_f64; self.names.len()];
        for row in self.stretches.iter().flatten() {
            for (largest, value) in largest.iter_mut().zip(row) {
                *largest = largest.max(value.abs());
            }
        }
        for (largest, zero) in largest.iter_mut().zip(&self.zeros) {
            if *largest <= *zero {
                *largest = 0.0;
            }
        }
        largest
    }

    /// Names of the values that never differ from zero by more than that.
    pub(crate) fn zero(&self) -> Vec<String> {
        let has_value = |column: usize| {
            let mut rows = self.stretches.iter().flatten();
            rows.any(|row| row[column].is_finite())
        };
        let columns = self.largest().into_iter().zip(&self.names).enumerate();
        let zero = columns.filter(|(column, (largest, _))| *largest <= 0.0 && has_value(*column));
        zero.map(|(_, (_, name))| name.clone()).collect()
    }

    /// The largest difference of every value over the rows that both paths have, relative to
    /// `scale`; 0 where the scale is 0.
    pub(crate) fn differences(&self, other: &Self, scale: &[f64]) -> Vec<f64> {
        let mut differences = vec![0.0_f64; scale.len()];
        for (ours, theirs) in self.stretches.iter().zip(&other.stretches) {
            for (i, j) in common_rows(ours.len(), theirs.len()) {
                for (c, &scale) in scale.iter().enumerate() {
                    let difference = (ours[i][c] - theirs[j][c]).abs() / scale;
                    // A value that one of them does not have is not compared.
                    if difference > differences[c] {
                        differences[c] = difference;
                    }
                }
            }
        }
        let without_scale = |(d, s): (&mut f64, &f64)| {
            if *s <= 0.0 {
                *d = 0.0;
            }
        };
        differences.iter_mut().zip(scale).for_each(without_scale);
        differences
    }

    /// The largest of the [`Self::differences`].
    pub(crate) fn difference(&self, other: &Self, scale: &[f64]) -> f64 {
        worst(&self.differences(other, scale))
    }
}

/// The largest of some errors.
pub(crate) fn worst(errors: &[f64]) -> f64 {
    errors.iter().copied().fold(0.0, f64::max)
}

/// Rows at the same part of a stretch in n and m increments, from 0; the last ones at least.
fn common_rows(n: usize, m: usize) -> impl Iterator<Item = (usize, usize)> {
    let shared = greatest_common_divisor(n, m);
    (1..=shared).map(move |i| (i * (n / shared) - 1, i * (m / shared) - 1))
}

fn greatest_common_divisor(a: usize, b: usize) -> usize {
    if b == 0 {
        a
    } else {
        greatest_common_divisor(b, a % b)
    }
}

/// An uncertainty is never smaller than this.
const ROUND_OFF: f64 = 1e-13;
/// Differences below this come from round-off and from the tolerances of equilibrium; no order can
/// be read from them.
pub(crate) const NOISE: f64 = 1e-9;
/// An order below this counts as this one: the estimate grows without bound towards order 0.
const LEAST_ORDER: f64 = 0.1;

/// How far the finest of three runs, each of half the step of the one before, is converged.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Convergence {
    /// Largest relative difference of the finest and the next finest.
    pub(crate) difference: f64,
    /// Order that the three show; none if the differences are noise, or if there are only two.
    pub(crate) order: Option<f64>,
    /// Relative error of the finest: the difference itself, more where the order is below 1, the
    /// larger of both differences where they are noise.
    pub(crate) uncertainty: f64,
}

impl Convergence {
    /// From the differences coarse to middle, and middle to fine.
    pub(crate) fn of(coarse_to_middle: Option<f64>, middle_to_fine: f64) -> Self {
        let difference = middle_to_fine;
        let order = coarse_to_middle
            .filter(|coarse| *coarse > NOISE && difference > NOISE)
            .map(|coarse| (coarse / difference).log2());
        let uncertainty = match order {
            Some(p) => difference * f64::max(1.0, 1.0 / (p.max(LEAST_ORDER).exp2() - 1.0)),
            // Noise differs from run to run.
            None => coarse_to_middle.map_or(difference, |coarse| {
                if coarse < NOISE {
                    coarse.max(difference)
                } else {
                    difference
                }
            }),
        };
        Self {
            difference,
            order,
            uncertainty: uncertainty.max(ROUND_OFF),
        }
    }

    /// From three runs, coarse to fine.
    pub(crate) fn of_runs([coarse, middle, fine]: [&Rows; 3], scale: &[f64]) -> Self {
        Self::of(
            Some(coarse.difference(middle, scale)),
            middle.difference(fine, scale),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn path(n: usize, f: impl Fn(f64) -> f64) -> Rows {
        let row = |i: usize| vec![f(i as f64 / n as f64)];
        Rows {
            names: vec!["f".to_owned()],
            stretches: vec![(1..=n).map(row).collect()],
            zeros: Vec::new(),
        }
    }

    #[test]
    fn what_is_round_off_of_larger_values_has_no_scale() {
        let noise = |seed: f64| Rows {
            zeros: vec![1e-8],
            ..path(4, |s| 1e-14 * (seed * s).sin())
        };
        let (a, b) = (noise(100.0), noise(300.0));
        assert_eq!(a.zero(), ["f"]);
        assert_relative_eq!(a.difference(&b, &a.largest()), 0.0);
        let small = Rows {
            zeros: vec![1e-8],
            ..path(4, |s| 2e-8 * s)
        };
        assert!(small.zero().is_empty());
        assert_relative_eq!(small.largest()[0], 2e-8);
    }

    #[test]
    fn rows_are_compared_at_the_same_part_of_the_path() {
        let (a, b) = (path(4, |s| s), path(6, |s| s + 0.1 * s));
        // Common parts of 4 and 6 increments: one half and the whole.
        assert_eq!(common_rows(4, 6).collect::<Vec<_>>(), [(1, 2), (3, 5)]);
        assert_relative_eq!(a.difference(&b, &[1.0]), 0.1, epsilon = 1e-15);
        assert_relative_eq!(a.difference(&b, &[2.0]), 0.05, epsilon = 1e-15);
    }

    #[test]
    fn values_without_scale_or_without_value_do_not_count() {
        let (a, b) = (path(2, |_| f64::NAN), path(2, |_| 1.0));
        assert_relative_eq!(a.difference(&b, &[1.0]), 0.0);
        assert_relative_eq!(b.difference(&path(2, |_| 2.0), &[0.0]), 0.0);
    }

    #[test]
    fn the_uncertainty_covers_the_error_of_the_finest_run() {
        for order in [0.5, 1.0, 2.0] {
            // Errors h^p at h = 1/4, 1/8, 1/16: the finest one has 16^-p.
            let error = |n: f64| n.powf(-order);
            let [coarse, middle, fine] = [4.0, 8.0, 16.0].map(error);
            let found = Convergence::of(Some(coarse - middle), middle - fine);
            assert_relative_eq!(found.order.unwrap_or(0.0), order, epsilon = 1e-12);
            assert!(found.uncertainty >= fine * (1.0 - 1e-12), "{found:?}");
        }
    }

    #[test]
    fn round_off_shows_no_order() {
        assert_eq!(Convergence::of(Some(1e-16), 2e-16).order, None);
        assert_eq!(Convergence::of(None, 1e-3).order, None);
    }
}
