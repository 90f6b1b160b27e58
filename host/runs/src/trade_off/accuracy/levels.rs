//! Runs of one case that differ in how finely one thing is divided, and what they tell about the error of
//! the finest.
//!
//! With an error that falls as h^p, h = 1/n, three runs give p and the error of the finest, whatever their n: runs in
//! between may be missing. An error below the difference of the two finest is not claimed: over a gap it would rest on
//! the order alone. Increments must differ in all three for each phase that is not linear: two, one and again one
//! increment in a phase give no more than two runs do.

use crate::experiment::Trial;
use crate::experiment::rows::NOISE;

/// Bounds of the order that is extrapolated with. A larger one is not relied on.
pub(super) const ORDERS: [f64; 2] = [0.3, 1.0];
/// Halvings of the interval that holds the order.
const BISECTIONS: usize = 40;

/// Runs that came to their end, each finer than the one before.
#[derive(Debug, Default)]
pub(super) struct Levels {
    /// How finely each divides, and what came out.
    runs: Vec<(f64, Trial)>,
    /// They differ in their increments.
    by_increments: bool,
}

impl Levels {
    /// Runs that differ in their increments.
    pub(super) fn of_increments() -> Self {
        Self {
            by_increments: true,
            ..Self::default()
        }
    }

    /// Adds a run that is finer than all others.
    pub(super) fn push(&mut self, n: f64, trial: Trial) {
        self.runs.push((n, trial));
    }

    /// How many there are.
    pub(super) fn len(&self) -> usize {
        self.runs.len()
    }

    /// The finest.
    pub(super) fn finest(&self) -> Option<&(f64, Trial)> {
        self.runs.last()
    }

    /// The next finest.
    pub(super) fn next(&self) -> Option<&(f64, Trial)> {
        self.runs.len().checked_sub(2).map(|i| &self.runs[i])
    }

    /// By how much the two finest differ, relative to the largest values.
    pub(super) fn difference(&self) -> Option<f64> {
        let [.., (_, next), (_, finest)] = self.runs.as_slice() else {
            return None;
        };
        let scale = finest.rows.largest();
        Some(next.rows.difference(&finest.rows, &scale))
    }

    /// How many of the three finest cut steps back.
    pub(super) fn cut_back(&self) -> usize {
        let finest = self.runs.iter().rev().take(3);
        finest.filter(|(_, run)| run.counts.cut_backs > 0).count()
    }

    /// The value by which the two finest differ most.
    pub(super) fn worst(&self) -> Option<String> {
        let [.., (_, next), (_, finest)] = self.runs.as_slice() else {
            return None;
        };
        let differences = next.rows.differences(&finest.rows, &finest.rows.largest());
        let named = differences.iter().zip(&finest.rows.names);
        let (most, name) = named.max_by(|(a, _), (b, _)| a.total_cmp(b))?;
        (*most > 0.0).then(|| name.clone())
    }

    /// Estimated relative error of the finest; of only two runs as if it fell with this order.
    pub(super) fn error_of_order(&self, order: f64) -> Option<f64> {
        let [.., (b, _), (c, _)] = self.runs.as_slice() else {
            return None;
        };
        let of_two = || Some(self.difference()? * left([*b, *c], order));
        self.error().or_else(of_two)
    }

    /// Estimated relative error of the finest; none where there are fewer than three.
    pub(super) fn error(&self) -> Option<f64> {
        let (n, differences) = self.three()?;
        let [_, b, c] = n;
        Some(differences[1] * left([b, c], order(n, differences)))
    }

    /// The differences of the three finest, coarse to middle and middle to fine, where they do not fall as those of
    /// an error of any order would: what is refined leads to no limit. Round-off has no order.
    pub(super) fn growth(&self) -> Option<[f64; 2]> {
        let ([a, b, c], [coarse, fine]) = self.three()?;
        // Of order 0: the error grows with the logarithm of n.
        let grows = coarse / fine <= (b / a).ln() / (c / b).ln();
        (grows && fine > NOISE).then_some([coarse, fine])
    }

    /// How finely the three finest divide, and their differences: coarse to middle, middle to fine.
    fn three(&self) -> Option<([f64; 3], [f64; 2])> {
        let [.., (a, coarse), (b, middle), (c, fine)] = self.runs.as_slice() else {
            return None;
        };
        if self.by_increments && !are_apart([coarse, middle, fine]) {
            return None;
        }
        let scale = fine.rows.largest();
        let difference = |(a, b): (&Trial, &Trial)| a.rows.difference(&b.rows, &scale);
        let differences = [(coarse, middle), (middle, fine)].map(difference);
        Some(([*a, *b, *c], differences))
    }

    /// The coarsest with at most this error, else the finest; with its error, as far as that can be told. The
    /// finest has the error `of_finest`.
    pub(super) fn take(
        mut self,
        of_finest: Option<f64>,
        error: f64,
    ) -> Option<(f64, Trial, Option<f64>)> {
        let (_, finest) = self.finest()?;
        let scale = finest.rows.largest();
        let errors: Vec<Option<f64>> = (self.runs.iter())
            .map(|(_, run)| Some(run.rows.difference(&finest.rows, &scale) + of_finest?))
            .collect();
        let is_enough = |found: &Option<f64>| found.is_some_and(|found| found <= error);
        let chosen = errors.iter().position(is_enough);
        let chosen = chosen.unwrap_or(errors.len() - 1);
        let (n, trial) = self.runs.swap_remove(chosen);
        Some((n, trial, errors[chosen]))
    }
}

/// Whether every phase that is not linear in the finest of three runs has more increments from each to the next.
fn are_apart(runs: [&Trial; 3]) -> bool {
    let [coarse, middle, fine] = runs.map(|run| run.rows.stretches.iter().map(Vec::len));
    let linear = runs[2]
        .linear
        .iter()
        .copied()
        .chain(std::iter::repeat(false));
    let mut phases = coarse.zip(middle).zip(fine).zip(linear);
    phases
        .all(|(((coarse, middle), fine), is_linear)| is_linear || coarse < middle && middle < fine)
}

/// The error of the finer of two runs, in parts of their difference; at least all of it.
fn left([coarse, fine]: [f64; 2], order: f64) -> f64 {
    f64::max(1.0 / ((fine / coarse).powf(order) - 1.0), 1.0)
}

/// The order that the differences of three runs, coarse to middle and middle to fine, show within the bounds;
/// the largest where they show none.
fn order([a, b, c]: [f64; 3], [coarse, fine]: [f64; 2]) -> f64 {
    let ratio = coarse / fine;
    // Rises with the order.
    let expected = |order: f64| {
        let [a, b, c] = [a, b, c].map(|n| n.powf(-order));
        (a - b) / (b - c)
    };
    let [mut low, mut high] = ORDERS;
    if ratio.is_nan() || ratio >= expected(high) {
        return high;
    }
    for _ in 0..BISECTIONS {
        let middle = f64::midpoint(low, high);
        if expected(middle) < ratio {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiment::{Counts, Rows};
    use approx::assert_relative_eq;

    fn trial(stretches: Vec<Vec<Vec<f64>>>, linear: Vec<bool>) -> Trial {
        let rows = Rows {
            names: vec!["f".to_owned()],
            stretches,
            zeros: Vec::new(),
        };
        Trial {
            rows,
            seconds: 0.0,
            counts: Counts::default(),
            linear,
        }
    }

    /// Runs to the value 1 with an error n^−p.
    fn levels(order: f64, divisions: &[f64]) -> Levels {
        let mut levels = Levels::default();
        for &n in divisions {
            levels.push(n, trial(vec![vec![vec![1.0 - n.powf(-order)]]], Vec::new()));
        }
        levels
    }

    #[test]
    fn the_error_of_the_finest_is_found_and_over_a_gap_it_is_the_difference() {
        let runs: [(f64, &[f64]); 4] = [
            (1.0, &[4.0, 8.0, 16.0]),
            (0.5, &[4.0, 8.0, 16.0]),
            (0.7, &[4.0, 64.0, 128.0]),
            (0.5, &[4.0, 8.0, 16.0, 128.0]),
        ];
        for (order, divisions) in runs {
            let runs = levels(order, divisions);
            let [.., next, finest] = divisions else {
                panic!()
            };
            let error = |n: f64| n.powf(-order) / (1.0 - finest.powf(-order));
            let difference = error(*next) - error(*finest);
            let found = runs.error().unwrap();
            let expected = error(*finest).max(difference);
            assert_relative_eq!(found, expected, max_relative = 1e-9);
            assert_eq!(difference > error(*finest), divisions.len() == 4);
        }
    }

    #[test]
    fn an_order_above_one_is_not_relied_on_and_one_below_the_bound_neither() {
        // Second order: the error that is left is a third of the difference, and all of it is given.
        let runs = levels(2.0, &[4.0, 8.0, 16.0]);
        assert_relative_eq!(runs.error().unwrap(), runs.difference().unwrap());
        let runs = levels(0.1, &[4.0, 8.0, 16.0]);
        let left = 1.0 / (ORDERS[0].exp2() - 1.0);
        let expected = left * runs.difference().unwrap();
        assert_relative_eq!(runs.error().unwrap(), expected, max_relative = 1e-9);
    }

    #[test]
    fn what_does_not_fall_leads_to_no_limit() {
        let of = |values: [f64; 3]| {
            let mut levels = Levels::default();
            for (n, value) in [1.0, 2.0, 4.0].into_iter().zip(values) {
                levels.push(n, trial(vec![vec![vec![value]]], Vec::new()));
            }
            levels.growth()
        };
        let [coarse, fine] = of([1.0, 1.1, 1.25]).unwrap();
        assert!(coarse < fine);
        assert!(of([1.0, 1.25, 1.5]).is_some());
        assert!(of([1.0, 1.1, 1.19]).is_none());
        assert!(of([1.0, 1.0 + 1e-12, 1.0 + 3e-12]).is_none());
        assert!(levels(0.1, &[4.0, 8.0, 16.0]).growth().is_none());
    }

    /// Runs of two phases of this many increments, the first one linear or not.
    #[test]
    fn a_phase_has_three_increments_or_is_linear_where_an_error_is_told() {
        let of = |increments: [[usize; 2]; 3], is_linear: bool| {
            let mut levels = Levels::of_increments();
            for (n, phases) in [1.0, 2.0, 4.0].into_iter().zip(increments) {
                let stretches = phases.map(|n| vec![vec![1.0]; n]).to_vec();
                levels.push(n, trial(stretches, vec![is_linear, false]));
            }
            levels.error().is_some()
        };
        assert!(of([[1, 2], [2, 4], [4, 8]], false));
        assert!(!of([[1, 2], [1, 4], [2, 8]], false));
        assert!(of([[1, 2], [1, 4], [2, 8]], true));
        assert!(!of([[1, 1], [2, 1], [4, 2]], false));
    }

    #[test]
    fn runs_that_cut_steps_back_are_counted_among_those_that_tell_the_error() {
        let mut runs = levels(1.0, &[4.0, 8.0, 16.0, 32.0]);
        for ((_, run), cut_backs) in runs.runs.iter_mut().zip([3, 0, 2, 1]) {
            run.counts.cut_backs = cut_backs;
        }
        assert_eq!(runs.cut_back(), 2);
    }

    #[test]
    fn two_runs_tell_a_difference_and_no_error() {
        let runs = levels(1.0, &[4.0, 8.0]);
        assert_relative_eq!(runs.difference().unwrap(), 0.125 / 0.875);
        assert_eq!(runs.error(), None);
        assert_relative_eq!(runs.error_of_order(1.0).unwrap(), 0.125 / 0.875);
        let (n, _, error) = runs.take(None, 0.5).unwrap();
        assert_eq!((n.to_bits(), error), (8.0_f64.to_bits(), None));
    }

    #[test]
    fn the_coarsest_that_is_good_enough_is_taken() {
        let runs = || levels(1.0, &[4.0, 8.0, 16.0, 32.0]);
        let (n, _, error) = runs().take(runs().error(), 0.14).unwrap();
        assert_relative_eq!(n, 8.0);
        assert_relative_eq!(
            error.unwrap(),
            0.125 / (1.0 - 1.0 / 32.0),
            max_relative = 1e-9
        );
        let (n, ..) = runs().take(runs().error(), 0.01).unwrap();
        assert_relative_eq!(n, 32.0);
    }
}
