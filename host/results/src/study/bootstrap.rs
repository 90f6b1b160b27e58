//! Confidence in a number computed from scattered runs: the same number of runs is drawn from them with replacement,
//! many times.
//!
//! Source: B. Efron & R. J. Tibshirani, An introduction to the bootstrap (1993), chapters 12 and 13; of indices of
//! sensitivity G. E. B. Archer, A. Saltelli & I. M. Sobol', J. Stat. Comput. Simul. 58, 99–120 (1997).

use crate::random::Random;

/// Seed of the random numbers: the same runs have the same intervals.
const SEED: u64 = 0;
/// Samples: this many, fewer of many runs, whose intervals are small.
const MOST: usize = 500;
const LEAST: usize = 100;
const WORK: usize = 2_000_000;
/// Probability that an interval leaves out on either side.
const OUTSIDE: f64 = 0.025;

/// Intervals of 95 % of the numbers that `of` computes from drawn runs, given by their places among `n`. Draws without
/// a result are left out. `None` with fewer than `LEAST` samples.
pub(super) fn intervals(
    n: usize,
    numbers: usize,
    mut of: impl FnMut(&[usize]) -> Option<Vec<f64>>,
) -> Vec<Option<[f64; 2]>> {
    let mut random = Random::of(SEED, 0);
    let mut drawn = vec![0; n];
    let mut all: Vec<Vec<f64>> = vec![Vec::new(); numbers];
    for _ in 0..(WORK / n.max(1)).clamp(LEAST, MOST) {
        drawn.fill_with(|| random.below(n));
        for (column, number) in all.iter_mut().zip(of(&drawn).unwrap_or_default()) {
            column.push(number);
        }
    }
    let interval = |mut column: Vec<f64>| {
        column.sort_by(f64::total_cmp);
        let at = |share: f64| column[(share * (column.len() - 1) as f64).round() as usize];
        (column.len() >= LEAST).then(|| [at(OUTSIDE), at(1.0 - OUTSIDE)])
    };
    all.into_iter().map(interval).collect()
}
