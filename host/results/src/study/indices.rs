//! Indices of sensitivity: of each parameter the part of a number's variance that it brings alone, and the part that it
//! brings with others.
//!
//! A design for them has N base points of d + 2 successive runs each. The first run has the values of a sample A, the
//! last those of a sample B. Each run between has the values of A but for one parameter, which has that of B. With
//! numbers f about their mean, and the variance V of those of A and B:
//!
//! - first-order index S_i = Σ f_B (f_ABi − f_A)/(N V): A. Saltelli et al., Comput. Phys. Commun. 181, 259–270 (2010),
//!   table 2 (b);
//! - total index T_i = Σ (f_A − f_ABi)²/(2 N V): M. J. W. Jansen, Comput. Phys. Commun. 117, 35–43 (1999).

use super::bootstrap;
use serde::Serialize;

/// A number with its interval of 95 %.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Estimate {
    /// The number.
    pub value: f64,
    /// Its interval, by drawing base points; `None` of fewer than two.
    pub interval: Option<[f64; 2]>,
}

/// The indices of a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Indices {
    /// What it brings alone.
    pub first: Estimate,
    /// What it brings alone and with others.
    pub total: Estimate,
}

/// The indices of this many parameters from numbers by run. A run without a number (`None`) excludes its base point.
/// Nothing where nothing varies.
pub fn indices(numbers: &[Option<f64>], parameters: usize) -> Vec<Indices> {
    let bases = numbers.chunks_exact(parameters + 2);
    let bases = bases.filter_map(|base| base.iter().copied().collect::<Option<Vec<f64>>>());
    let mut bases: Vec<Vec<f64>> = bases.collect();
    let n = bases.len();
    let all = || bases.iter().flatten();
    let mean = all().sum::<f64>() / all().count().max(1) as f64;
    let scale = all().fold(0.0, |most: f64, f| most.max(f.abs()));
    for f in bases.iter_mut().flatten() {
        *f -= mean;
    }
    let least = (1e-12 * scale).powi(2);
    let places: Vec<usize> = (0..n).collect();
    let Some(found) = estimates(&bases, &places, least) else {
        return Vec::new();
    };
    let intervals = bootstrap::intervals(n, found.len(), |drawn| estimates(&bases, drawn, least));
    let estimate = |i: usize| Estimate {
        value: found[i],
        interval: intervals[i].filter(|_| n > 1),
    };
    let of = |i: usize| Indices {
        first: estimate(i),
        total: estimate(parameters + i),
    };
    (0..parameters).map(of).collect()
}

/// First-order indices of all parameters, then total ones, of these base points; `None` where nothing varies by more
/// than `least`.
fn estimates(bases: &[Vec<f64>], places: &[usize], least: f64) -> Option<Vec<f64>> {
    let d = bases.first()?.len() - 2;
    let n = places.len() as f64;
    let (mut sum, mut squares) = (0.0, 0.0);
    let mut found = vec![0.0; 2 * d];
    for &place in places {
        let base = &bases[place];
        let (a, b) = (base[0], base[d + 1]);
        sum += a + b;
        squares += a * a + b * b;
        for i in 0..d {
            let step = base[1 + i] - a;
            found[i] += b * step;
            found[d + i] += 0.5 * step * step;
        }
    }
    let variance = squares / (2.0 * n) - (sum / (2.0 * n)).powi(2);
    for number in &mut found {
        *number /= n * variance;
    }
    (variance > least).then_some(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// y = 2 a + b + a b with a, b = ±1, all values of A and B: variances 4, 1 and 1 add up to 6.
    #[test]
    fn indices_of_all_signs_are_those_of_the_closed_form() {
        let f = |a: f64, b: f64| Some(10.0 + 2.0 * a + b + a * b);
        let signs = [-1.0, 1.0];
        let mut numbers = Vec::new();
        for a in signs {
            for b in signs {
                for c in signs {
                    for d in signs {
                        numbers.extend([f(a, b), f(c, b), f(a, d), f(c, d)]);
                    }
                }
            }
        }
        let found = indices(&numbers, 2);
        let near = |found: f64, expected: f64| assert!((found - expected).abs() < 1e-12);
        near(found[0].first.value, 4.0 / 6.0);
        near(found[0].total.value, 5.0 / 6.0);
        near(found[1].first.value, 1.0 / 6.0);
        near(found[1].total.value, 2.0 / 6.0);
        for estimate in found.iter().flat_map(|of| [of.first, of.total]) {
            let [low, high] = estimate.interval.unwrap();
            assert!(
                low <= estimate.value && estimate.value <= high,
                "{estimate:?}"
            );
        }
        // A run without a number takes its base point with it.
        let mut holed = numbers.clone();
        holed.extend([Some(1e3), None, Some(2.0), Some(3.0)]);
        assert_eq!(indices(&holed, 2), found);
        assert!(indices(&[Some(7.0); 8], 2).is_empty());
        assert!(indices(&[None; 8], 2).is_empty());
    }
}
