//! Effect of each parameter on a number: its means at several levels of the parameter, over all values
//! of the others.
//!
//! The values of a parameter are its levels if there are few, and in a grid without holes however many there are: there
//! the others have the same values at each of them. Else its runs, in the order of their values, are divided into
//! levels of about as many runs each; runs of one value are of one level. The main effect of a level is the mean of the
//! number over its runs. The share of the variance that the levels explain:
//!
//! - In a grid without holes, where the others have the same values at every level: η², the sum of squares
//!   between levels over the whole one.
//! - In a design for indices of sensitivity: the first-order index ([`super::indices`]).
//! - Else Kelley's ε² = 1 − (n−1)/(n−k) · within/whole, at least 0. It deducts what the scatter of n
//!   runs in k levels explains by chance.
//!
//! The interval of ε² is the basic bootstrap interval: ε² of drawn runs scatters about η² of the runs as ε² of the runs
//! does about the true share. Its upper end is counted from 0 if ε² is negative.
//!
//! Source: Kelley, T. L. (1935), "An unbiased correlation ratio measure", PNAS 21.

use super::bootstrap;
use super::indices::{Estimate, indices};
use serde::Serialize;

/// So many different values of a parameter are levels.
const FEW: usize = 12;

/// Effect of a parameter on a number.
#[derive(Clone, Debug, Serialize)]
pub struct Effect {
    /// Number of the parameter.
    pub parameter: usize,
    /// Its levels, from the lowest.
    pub levels: Vec<Level>,
    /// Share of the variance that the levels explain, 0 to 1; `None` where nothing varies.
    pub share: Option<f64>,
    /// Interval of 95 % of the share; `None` where it does not come of scattered runs.
    pub interval: Option<[f64; 2]>,
    /// Total index of sensitivity, of a design for such.
    pub total: Option<Estimate>,
}

/// How the values of the runs were chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Design {
    /// All combinations.
    Grid,
    /// Base points, for [`indices`].
    Saltelli,
    /// In another way.
    Other,
}

/// A level of a parameter.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Level {
    /// Mean of the parameter's values; the number of the level, from 0, where they are no numbers.
    pub value: f64,
    /// Its runs.
    pub runs: usize,
    /// Mean of the number.
    pub mean: f64,
}

impl Effect {
    /// How far the means of the levels lie apart.
    pub fn range(&self) -> f64 {
        let means = || self.levels.iter().map(|level| level.mean);
        means().fold(f64::MIN, f64::max) - means().fold(f64::MAX, f64::min)
    }
}

/// Effects of all parameters on a number of the runs, the largest first. `parameters`: values by parameter
/// and run, texts as the number of the text; `numbers` by run, `None` for a run without a number that
/// counts. A grid with such runs is incomplete: means at its levels are over different values of the others.
pub fn effects(parameters: &[Vec<f64>], numbers: &[Option<f64>], design: Design) -> Vec<Effect> {
    let is_grid = design == Design::Grid && numbers.iter().all(Option::is_some);
    let mut effects: Vec<Effect> = (0..)
        .zip(parameters)
        .filter_map(|(parameter, values)| {
            let runs = values.iter().zip(numbers);
            let runs = runs.filter_map(|(value, number)| Some((*value, (*number)?)));
            let mut runs: Vec<(f64, f64)> = runs.collect();
            runs.sort_by(|a, b| a.0.total_cmp(&b.0));
            (!runs.is_empty()).then(|| effect(parameter, &runs, is_grid))
        })
        .collect();
    if design == Design::Saltelli {
        let found = indices(numbers, parameters.len());
        for effect in &mut effects {
            let of = found.get(effect.parameter);
            effect.share = of.map(|of| of.first.value);
            effect.interval = of.and_then(|of| of.first.interval);
            effect.total = of.map(|of| of.total);
        }
    }
    effects.sort_by(|a, b| b.range().total_cmp(&a.range()));
    effects
}

/// Runs in levels of about as many each: a value belongs to the level in which the middle of its runs lies.
fn levels_of<'r>(runs: &'r [(f64, f64)], by_value: &[&[(f64, f64)]]) -> Vec<&'r [(f64, f64)]> {
    let n = runs.len();
    let k = ((n as f64).sqrt().round() as usize).clamp(2, 10);
    let (mut levels, mut first, mut end, mut last) = (Vec::new(), 0, 0, 0);
    for of_value in by_value {
        let level = (2 * end + of_value.len()) * k / (2 * n);
        if level > last {
            levels.push(&runs[first..end]);
            (first, last) = (end, level);
        }
        end += of_value.len();
    }
    levels.push(&runs[first..]);
    levels.retain(|level| !level.is_empty());
    levels
}

/// For runs in the order of the parameter's values.
fn effect(parameter: usize, runs: &[(f64, f64)], is_grid: bool) -> Effect {
    let n = runs.len();
    let by_value: Vec<&[(f64, f64)]> = runs
        .chunk_by(|a, b| a.0.to_bits() == b.0.to_bits())
        .collect();
    let groups = if is_grid || by_value.len() <= FEW {
        by_value
    } else {
        levels_of(runs, &by_value)
    };
    let mean = |runs: &[(f64, f64)], of: fn(&(f64, f64)) -> f64| {
        runs.iter().map(of).sum::<f64>() / runs.len() as f64
    };
    let levels: Vec<Level> = groups
        .iter()
        .map(|runs| Level {
            value: mean(runs, |run| run.0),
            runs: runs.len(),
            mean: mean(runs, |run| run.1),
        })
        .collect();
    let whole_mean = mean(runs, |run| run.1);
    let whole: f64 = runs.iter().map(|run| (run.1 - whole_mean).powi(2)).sum();
    let with_levels = groups.iter().zip(&levels);
    let within: f64 = with_levels
        .flat_map(|(runs, level)| runs.iter().map(|run| (run.1 - level.mean).powi(2)))
        .sum();
    let k = levels.len();
    // Round-off is no scatter.
    let scale = runs
        .iter()
        .fold(0.0, |most: f64, run| most.max(run.1.abs()));
    let varies = whole > n as f64 * (1e-12 * scale).powi(2);
    let eta = varies.then_some(1.0 - within / whole);
    let epsilon = eta.and_then(|eta| corrected(eta, n, k));
    let interval = eta.zip(epsilon).filter(|_| !is_grid);
    Effect {
        parameter,
        levels,
        share: if is_grid {
            eta
        } else {
            epsilon.map(|epsilon| epsilon.max(0.0))
        },
        interval: interval.and_then(|shares| interval_of(&groups, whole_mean, shares)),
        total: None,
    }
}

/// ε² of η² between `k` levels of `n` runs.
fn corrected(eta: f64, n: usize, k: usize) -> Option<f64> {
    (n > k).then(|| 1.0 - (n as f64 - 1.0) / (n - k) as f64 * (1.0 - eta))
}

/// The interval of ε², of runs about a mean that have these η² and ε².
fn interval_of(
    groups: &[&[(f64, f64)]],
    mean: f64,
    (eta, epsilon): (f64, f64),
) -> Option<[f64; 2]> {
    let with_level = groups.iter().enumerate();
    let runs: Vec<(usize, f64)> = with_level
        .flat_map(|(level, runs)| runs.iter().map(move |run| (level, run.1 - mean)))
        .collect();
    let n = runs.len();
    let share = |drawn: &[usize]| {
        let mut levels = vec![(0.0, 0.0); groups.len()];
        let (mut sum, mut squares) = (0.0, 0.0);
        for &run in drawn {
            let (level, y) = runs[run];
            levels[level].0 += 1.0;
            levels[level].1 += y;
            sum += y;
            squares += y * y;
        }
        let there = || levels.iter().filter(|(count, _)| *count > 0.0);
        let between: f64 = there().map(|(count, sum)| sum * sum / count).sum();
        let mean_square = sum * sum / n as f64;
        let whole = squares - mean_square;
        let eta = (whole > 0.0).then(|| (between - mean_square) / whole)?;
        corrected(eta, n, there().count()).map(|epsilon| vec![epsilon])
    };
    let [low, high] = bootstrap::intervals(n, 1, share)[0]?;
    // Even runs lead to ε² far below 0, which would leave no room for the share that there is.
    let ends = [epsilon - (high - eta), epsilon.max(0.0) - (low - eta)];
    Some(ends.map(|end| end.clamp(0.0, 1.0)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// y = 3 a + 2 b² on a ∈ {0, 1, 2}, b ∈ {−1, 0, 1, 2}: means over the other parameter in closed form.
    #[test]
    fn main_effects_of_a_grid_are_those_of_the_closed_form() {
        let (mut a, mut b, mut y) = (Vec::new(), Vec::new(), Vec::new());
        for i in 0..3 {
            for j in -1..3 {
                let (x, z) = (f64::from(i), f64::from(j));
                a.push(x);
                b.push(z);
                y.push(Some(3.0 * x + 2.0 * z * z));
            }
        }
        let found = effects(&[a, b], &y, Design::Grid);
        // Mean of 2b² is 2 · 6/4 = 3, that of 3a is 3.
        let of = |parameter: usize| found.iter().find(|e| e.parameter == parameter).unwrap();
        let means =
            |effect: &Effect| -> Vec<f64> { effect.levels.iter().map(|l| l.mean).collect() };
        assert_eq!(means(of(0)), [3.0, 6.0, 9.0]);
        assert_eq!(means(of(1)), [5.0, 3.0, 5.0, 11.0]);
        // b does more: its range is 8, that of a 6.
        assert_eq!(found[0].parameter, 1);
        assert_eq!((found[0].range(), found[1].range()), (8.0, 6.0));
        // Variances: of 3a 9 · 2/3 = 6; of 2b² 4 · (18/4 − (6/4)²) = 9. They add up.
        assert!((of(0).share.unwrap() - 6.0 / 15.0).abs() < 1e-12);
        assert!((of(1).share.unwrap() - 9.0 / 15.0).abs() < 1e-12);
    }

    /// Runs that are no grid: a parameter that does nothing explains nothing, but for chance.
    #[test]
    fn scatter_is_no_effect() {
        let n = 1000;
        let fraction = |x: f64| x - x.floor();
        let golden = |i: usize, by: f64| fraction(i as f64 * by);
        let a: Vec<f64> = (0..n).map(|i| golden(i, 0.754_877_666_246_693)).collect();
        let b: Vec<f64> = (0..n).map(|i| golden(i, 0.569_840_290_998_053)).collect();
        let y: Vec<Option<f64>> = a.iter().map(|a| Some(5.0 * a)).collect();
        let found = effects(&[a, b], &y, Design::Other);
        assert_eq!(found[0].parameter, 0);
        assert_eq!(found[0].levels.len(), 10);
        // Ten levels of a straight line leave (1/10)² of its variance inside them.
        assert!((found[0].share.unwrap() - 0.99).abs() < 2e-3, "{found:?}");
        assert!(found[1].share.unwrap() < 0.01, "{found:?}");
        // Means at the lowest and highest tenth: 5 · 0.05 and 5 · 0.95.
        let levels = &found[0].levels;
        assert!((levels[0].mean - 0.25).abs() < 0.02 && (levels[9].mean - 4.75).abs() < 0.02);
    }

    /// 64 random runs: a explains one half, b nothing. The share of b differs from 0 in one study of twenty at most.
    /// The interval of a's share holds ½ (less what eight levels leave inside them) nine times in ten at least: 275
    /// times of 300, where 285 are nominal.
    #[test]
    fn intervals_of_shares_hold_what_is_there() {
        let mut random = crate::random::Random::of(20_261_127, 0);
        let (mut told, mut held) = (0, 0);
        for _ in 0..300 {
            let mut column = || -> Vec<f64> { (0..64).map(|_| random.fraction()).collect() };
            let (a, b, rest) = (column(), column(), column());
            let y = a
                .iter()
                .zip(&rest)
                .map(|(a, rest)| Some(a + rest))
                .collect::<Vec<_>>();
            let found = effects(&[a, b], &y, Design::Other);
            let interval = |parameter: usize| {
                let of = found.iter().find(|e| e.parameter == parameter).unwrap();
                of.interval.unwrap()
            };
            told += usize::from(interval(1)[0] > 0.0);
            let share = 0.5 * (1.0 - 1.0 / 64.0);
            held += usize::from((interval(0)[0]..=interval(0)[1]).contains(&share));
        }
        println!("{told} told from 0, {held} held of 300");
        assert!(told <= 15 + 12, "{told}");
        assert!(held >= 270, "{held}");
    }

    /// y = a + b on {0, 1, 2, 3}², without the run at (3, 3): η² of a would be what it is between levels of 4, 4,
    /// 4 and 3 runs. With n = 15, k = 4: means of b are 1.5, 1.5, 1.5 and 1, those of a's levels 1.5, 2.5, 3.5, 4.
    #[test]
    fn a_grid_with_a_hole_is_none() {
        let (mut a, mut b, mut y) = (Vec::new(), Vec::new(), Vec::new());
        for i in 0..16 {
            let (x, z) = (f64::from(i / 4), f64::from(i % 4));
            a.push(x);
            b.push(z);
            y.push((i < 15).then_some(x + z));
        }
        let found = effects(&[a, b], &y, Design::Grid);
        let means: Vec<f64> = found[0].levels.iter().map(|level| level.mean).collect();
        assert_eq!(means, [1.5, 2.5, 3.5, 4.0]);
        // Within: 3 · 5 + 2 = 17. Whole: Σ(x + z)² − 15 · 2.8² = 148 − 117.6 = 30.4.
        let share = 1.0 - 14.0 / 11.0 * 17.0 / 30.4;
        assert!((found[0].share.unwrap() - share).abs() < 1e-12, "{found:?}");
    }

    /// y = a on {0 … 19} × {0 … 14}: b does nothing, whatever the number of values, and a everything.
    #[test]
    fn a_large_grid_has_a_level_for_every_value() {
        let (mut a, mut b, mut y) = (Vec::new(), Vec::new(), Vec::new());
        for i in 0..20 {
            for j in 0..15 {
                a.push(f64::from(i));
                b.push(f64::from(j));
                y.push(Some(f64::from(i)));
            }
        }
        let of = |found: &[Effect], parameter: usize| {
            let of = found.iter().find(|e| e.parameter == parameter).unwrap();
            (of.levels.clone(), of.share.unwrap(), of.range())
        };
        let found = effects(&[a.clone(), b.clone()], &y, Design::Grid);
        let (levels, share, _) = of(&found, 0);
        assert!((share - 1.0).abs() < 1e-12, "{share}");
        assert_eq!(levels.len(), 20);
        assert!(levels.iter().all(|level| level.runs == 15));
        let (levels, share, range) = of(&found, 1);
        assert_eq!(levels.len(), 15);
        assert!(share.abs() < 1e-12 && range < 1e-12, "{share} {range}");
        // With a hole it is no grid; the runs of one value stay in one level still.
        y[0] = None;
        let found = effects(&[a, b], &y, Design::Grid);
        let (levels, share, _) = of(&found, 1);
        assert_eq!(levels.iter().map(|level| level.runs).sum::<usize>(), 299);
        assert!(
            levels.iter().all(|level| level.runs % 20 % 19 == 0),
            "{levels:?}"
        );
        assert!(share < 0.01, "{share}");
    }

    #[test]
    fn runs_without_a_number_do_not_count_and_a_constant_has_no_share() {
        let found = effects(
            &[vec![1.0, 2.0, 3.0]],
            &[Some(7.0), None, Some(7.0)],
            Design::Grid,
        );
        let levels: Vec<(f64, usize)> = found[0].levels.iter().map(|l| (l.value, l.runs)).collect();
        assert_eq!(levels, [(1.0, 1), (3.0, 1)]);
        assert_eq!(found[0].share, None);
        assert!(effects(&[vec![1.0]], &[None], Design::Grid).is_empty());
    }
}
