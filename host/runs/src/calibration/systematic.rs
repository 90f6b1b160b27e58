//! Residuals that are not noise: too far off for it, or following each other.
//!
//! If residuals are normal noise, at most one calibration in a hundred is reported to have residuals too far off, and
//! one in a hundred to have some that follow each other. Each of these tests has its part of that level, divided by the
//! points or curves that it is applied to (Bonferroni).
//!
//! - *Too far off*, where the file gives the noise: more than z times it, z the quantile of the normal distribution. In
//!   any case: the generalised extreme studentised deviate (B. Rosner, Technometrics 25, 165–172, 1983), which removes
//!   one residual after the other and estimates the scatter of the rest. It needs at least 15 points.
//! - *Following each other*: the correlation of neighbours r is above z/√n (R. L. Anderson, Ann. Math. Stat. 13, 1–13,
//!   1942); there are too few runs of one sign, or too few runs of points that are too far off and of others (A. Wald &
//!   J. Wolfowitz, Ann. Math. Stat. 11, 147–162, 1940). A fit makes neighbours rather too different than too alike, so
//!   that these levels are kept.

use super::curve::Curve;
use super::fitted::FittedCurve;
use super::statistics::{of_neighbours, two_sided};
use crate::experiment::digits;
use statrs::distribution::{ContinuousCDF, StudentsT};

/// One calibration in this many.
const LEVEL: f64 = 0.01;
/// Least number of points of a curve whose scatter is estimated, and whose order tells something.
const ENOUGH_FOR_SCATTER: usize = 15;
const ENOUGH_IN_ORDER: usize = 10;
/// Most points that are taken away: one in this many.
const AWAY: usize = 4;
/// Residuals smaller than this part of the noise are the last digits of measured values.
const DIGITS: f64 = 1e-3;
/// So many points are named.
const NAMED: usize = 5;

/// Levels for a number of curves and points.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    curves: f64,
    points: f64,
}

/// How residuals of a curve are no noise.
#[derive(Clone, Debug, Default)]
pub struct Systematic {
    /// Points that are too far off, in their order, with computed less measured values over the noise, or over the
    /// scatter of the other points.
    pub far: Vec<(usize, f64)>,
    /// That is over the noise of the file.
    pub is_over_noise: bool,
    /// In what way residuals follow each other.
    pub follow: Vec<Follow>,
}

/// A way in which residuals follow each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Follow {
    /// Neighbours are correlated.
    Correlation(f64),
    /// There are so few runs of one sign, where noise has that many.
    Signs(usize, f64),
    /// Points too far off are neighbours.
    Far,
}

impl Limits {
    /// For these curves.
    pub(super) fn of<'c>(curves: impl Iterator<Item = &'c Curve>) -> Self {
        let (n, points) = curves.fold((0, 0), |(n, points), c| (n + 1, points + c.points.len()));
        Self {
            curves: f64::from(n.max(1)),
            points: points.max(1) as f64,
        }
    }
}

impl Systematic {
    /// Tests a curve with these computed values.
    pub(super) fn of(curve: &Curve, computed: &[f64], limits: Limits) -> Self {
        let pairs = curve.points.iter().zip(computed).zip(&curve.deviations);
        let over_noise: Vec<f64> = pairs.map(|(((_, y), c), d)| (c - y) / d).collect();
        let n = over_noise.len();
        let mean_square = over_noise.iter().map(|r| r * r).sum::<f64>() / n.max(1) as f64;
        if mean_square.sqrt() < DIGITS {
            return Self::default();
        }
        let z = two_sided(1.0 - 0.5 * LEVEL / limits.points, None);
        let beyond: Vec<usize> = (0..n)
            .filter(|&i| curve.is_noise_given && over_noise[i].abs() > z)
            .collect();
        let (outlying, scatter) = outlying(&over_noise, 0.5 * LEVEL / limits.curves);
        let is_over_noise = !beyond.is_empty();
        let unit = if is_over_noise { 1.0 } else { scatter };
        let is_far: Vec<bool> = (0..n)
            .map(|i| beyond.contains(&i) || outlying.contains(&i))
            .collect();
        let far = (0..n).filter(|&i| is_far[i]);
        let far: Vec<(usize, f64)> = far.map(|i| (i, over_noise[i] / unit)).collect();
        let level = LEVEL / 3.0 / limits.curves;
        let mut follow = Vec::new();
        if n >= ENOUGH_IN_ORDER {
            let rho = of_neighbours(&over_noise);
            // One side: what changes its sign at every point is another thing.
            if rho * (n as f64).sqrt() > two_sided(1.0 - 2.0 * level, None) {
                follow.push(Follow::Correlation(rho));
            }
            let signs: Vec<bool> = over_noise.iter().map(|r| *r > 0.0).collect();
            let (found, expected) = (runs(&signs), runs_of_noise(&signs));
            if chance_of_runs(&signs) < level {
                follow.push(Follow::Signs(found, expected));
            }
            if far.len() > 1 && chance_of_runs(&is_far) < level {
                follow.push(Follow::Far);
            }
        }
        Self {
            far,
            is_over_noise,
            follow,
        }
    }

    /// Its findings in words.
    pub(super) fn in_words(&self, test: &str, fitted: &FittedCurve) -> Vec<String> {
        let words = [self.of_far(test, fitted), self.of_neighbours(test, fitted)];
        words.into_iter().flatten().collect()
    }

    /// Residuals too large for noise.
    fn of_far(&self, test: &str, fitted: &FittedCurve) -> Option<String> {
        let Curve { x, y, points, .. } = &fitted.curve;
        (!self.far.is_empty()).then(|| {
            let unit = if self.is_over_noise {
                "the noise that is given"
            } else {
                "the scatter of the other points"
            };
            let most = self.far.iter().map(|(_, t)| t.abs()).fold(0.0, f64::max);
            let named = self.far.iter().take(NAMED);
            let named = named.map(|(i, times)| format!("{} ({times:+.1})", digits(points[*i].0)));
            let more = match self.far.len().saturating_sub(NAMED) {
                0 => String::new(),
                n => format!(", and {n} more (`beyond_noise` in fit.csv)"),
            };
            format!(
                "{test}, {y}: {} of {} residuals are too large for noise, up to {most:.1} times {unit}: at {x} = {}{more}. \
                 These are bad readings, a systematic error (a slack or a wrong zero: `offset_x` and `offset_y` of the curve \
                 look for it), or the law does not follow; values and intervals are not those of the law until it is known which",
                self.far.len(),
                points.len(),
                named.collect::<Vec<_>>().join(", ")
            )
        })
    }

    /// Residuals that follow each other.
    fn of_neighbours(&self, test: &str, fitted: &FittedCurve) -> Option<String> {
        let first = self.follow.first()?;
        let y = &fitted.curve.y;
        let how = self.follow.iter().map(|follow| match follow {
            Follow::Correlation(rho) => format!("correlation of neighbours {rho:.2}"),
            Follow::Signs(found, expected) => {
                format!("{found} runs of one sign, noise has about {expected:.0}")
            }
            Follow::Far => "those too large for noise stand together".to_owned(),
        });
        let rho = fitted.neighbours;
        let factor = ((1.0 + rho) / (1.0 - rho).max(1e-3)).sqrt();
        let factor = match first {
            Follow::Correlation(_) => {
                format!(", by a factor of about {factor:.1} as far as this curve counts")
            }
            _ => String::new(),
        };
        Some(format!(
            "{test}, {y}: residuals follow each other ({}), {}: that is no noise but a systematic error, what the law does not \
             follow, or points that were measured too densely; the intervals are too narrow{factor}",
            how.collect::<Vec<_>>().join("; "),
            self.stretch(fitted)
        ))
    }

    /// The longest stretch of points of one sign; of those too far off if these are what follows.
    fn stretch(&self, fitted: &FittedCurve) -> String {
        let Curve { x, points, .. } = &fitted.curve;
        let of_far = matches!(self.follow[..], [Follow::Far]);
        let all = (0..points.len()).collect::<Vec<_>>();
        let mark = |i: &usize| {
            if of_far {
                usize::from(self.far.iter().any(|(far, _)| far == i))
            } else {
                usize::from(fitted.computed[*i] > points[*i].1)
            }
        };
        let stretches = all.chunk_by(|a, b| mark(a) == mark(b));
        let stretches = stretches.filter(|run| !of_far || mark(&run[0]) == 1);
        let Some([first, .., last]) = stretches.max_by_key(|run| run.len()) else {
            return "in many places".to_owned();
        };
        let [a, b] = [first, last].map(|&i| digits(points[i].0));
        let side = match (of_far, mark(first)) {
            (true, _) => "",
            (false, 1) => ", where all computed values are above the measured ones",
            (false, _) => ", where all computed values are below the measured ones",
        };
        format!("most of all from {x} = {a} to {b}{side}")
    }
}

/// Values that do not belong to the others, by Rosner's test at this level, and the scatter of those that do.
fn outlying(values: &[f64], level: f64) -> (Vec<usize>, f64) {
    let mut left: Vec<usize> = (0..values.len()).collect();
    let n = values.len();
    let scatter = |left: &[usize]| {
        let m = left.len() as f64;
        let mean = left.iter().map(|&i| values[i]).sum::<f64>() / m;
        let squares = left
            .iter()
            .map(|&i| (values[i] - mean).powi(2))
            .sum::<f64>();
        (mean, (squares / (m - 1.0)).sqrt())
    };
    let (mut taken, mut found) = (Vec::new(), 0);
    let most = if n < ENOUGH_FOR_SCATTER { 0 } else { n / AWAY };
    for _ in 0..most {
        let (mean, s) = scatter(&left);
        let off = |i: usize| (values[i] - mean).abs();
        let Some(place) = (0..left.len()).max_by(|&a, &b| off(left[a]).total_cmp(&off(left[b])))
        else {
            break;
        };
        let m = left.len() as f64;
        let Ok(student) = StudentsT::new(0.0, 1.0, m - 2.0) else {
            break;
        };
        let t = student.inverse_cdf(1.0 - 0.5 * level / m);
        let limit = (m - 1.0) * t / ((m - 2.0 + t * t) * m).sqrt();
        let farthest = left.remove(place);
        let is_out = off(farthest) > limit * s;
        taken.push(farthest);
        if is_out {
            found = taken.len();
        }
    }
    taken.truncate(found);
    let others: Vec<usize> = (0..n).filter(|i| !taken.contains(i)).collect();
    (taken, scatter(&others).1)
}

/// How many stretches of equal marks there are.
fn runs(marks: &[bool]) -> usize {
    marks.chunk_by(|a, b| a == b).count()
}

/// How many that are in the mean where their order is random.
fn runs_of_noise(marks: &[bool]) -> f64 {
    let n = marks.len() as f64;
    let a = marks.iter().filter(|mark| **mark).count() as f64;
    1.0 + 2.0 * a * (n - a) / n
}

/// Probability that a random order of these marks has no more stretches: exact, Wald & Wolfowitz. 1 of marks that are all
/// alike.
fn chance_of_runs(marks: &[bool]) -> f64 {
    let a = marks.iter().filter(|mark| **mark).count();
    let b = marks.len() - a;
    if a == 0 || b == 0 {
        return 1.0;
    }
    let ln_choose = |n: usize, k: usize| {
        if k > n {
            return f64::NEG_INFINITY;
        }
        let ln = |n: usize| libm::lgamma(n as f64 + 1.0);
        ln(n) - ln(k) - ln(n - k)
    };
    let all = ln_choose(a + b, a);
    let chance = |stretches: usize| {
        let k = stretches / 2;
        // Orders with k stretches of one mark and `other` of the other one.
        let with = |of: usize, other: usize| {
            if k == 0 || of == 0 || other == 0 {
                return 0.0;
            }
            (ln_choose(a - 1, of - 1) + ln_choose(b - 1, other - 1) - all).exp()
        };
        if stretches.is_multiple_of(2) {
            2.0 * with(k, k)
        } else {
            with(k + 1, k) + with(k, k + 1)
        }
    };
    (2..=runs(marks)).map(chance).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rosner's own example (NIST/SEMATECH e-Handbook, 1.3.5.17.3): 54 values, 5 %, three outliers, whose statistics are
    /// 3.118, 2.942 and 3.179 against 3.158, 3.151 and 3.143.
    #[test]
    fn outliers_of_the_published_example_are_found() {
        let values = [
            -0.25, 0.68, 0.94, 1.15, 1.20, 1.26, 1.26, 1.34, 1.38, 1.43, 1.49, 1.49, 1.55, 1.56,
            1.58, 1.65, 1.69, 1.70, 1.76, 1.77, 1.81, 1.91, 1.94, 1.96, 1.99, 2.06, 2.09, 2.10,
            2.14, 2.15, 2.23, 2.24, 2.26, 2.35, 2.37, 2.40, 2.47, 2.54, 2.62, 2.64, 2.90, 2.92,
            2.92, 2.93, 3.21, 3.26, 3.30, 3.59, 3.68, 4.30, 4.64, 5.34, 5.42, 6.01,
        ];
        let (mut found, _) = outlying(&values, 0.05);
        found.sort_unstable();
        assert_eq!(found, [51, 52, 53]);
    }

    /// All orders of three and of four marks, counted.
    #[test]
    fn chances_of_runs_are_those_of_all_orders() {
        for (a, b) in [(1, 3), (2, 5), (3, 4), (5, 5)] {
            let n = a + b;
            let orders: Vec<Vec<bool>> = (0_u32..1 << n)
                .filter(|bits| bits.count_ones() == a)
                .map(|bits| (0..n).map(|i| bits >> i & 1 == 1).collect())
                .collect();
            for order in &orders {
                let fewer = orders.iter().filter(|other| runs(other) <= runs(order));
                let expected = fewer.count() as f64 / orders.len() as f64;
                let found = chance_of_runs(order);
                assert!(
                    (found - expected).abs() < 1e-12,
                    "{order:?}: {found} {expected}"
                );
            }
            let mean = orders.iter().map(|order| runs(order) as f64).sum::<f64>();
            assert!((runs_of_noise(&orders[0]) - mean / orders.len() as f64).abs() < 1e-12);
        }
    }
}
