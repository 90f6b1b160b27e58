//! Least squares within bounds, by the method of Levenberg and Marquardt.
//!
//! Minimises S(u) = Σ r_i(u)² over lower ≤ u ≤ upper. Each step solves the damped problem min ‖r + J
//! δ‖² + λ ‖D δ‖² by QR of the stacked matrix, which keeps the digits that normal equations lose. D
//! has the largest norms that the columns of J have had (Moré 1978), so that units do not matter. The
//! damping λ follows the ratio of the actual to the predicted reduction (Nielsen 1999). A variable at
//! a bound that the gradient points out of is left out of the step; what a step would carry beyond a
//! bound stays on it.

use nalgebra::{DMatrix, DVector};

/// The function that is fitted. `Error` ends the work; `None` says that there is no answer at this place.
pub(super) trait Problem {
    /// Why the work cannot go on.
    type Error;

    /// The residuals at a place.
    ///
    /// # Errors
    /// What ends the work.
    fn residuals(&mut self, u: &[f64]) -> Result<Option<DVector<f64>>, Self::Error>;

    /// Their derivatives at a place where they are `residuals`: a row for each, a column for each
    /// variable.
    ///
    /// # Errors
    /// What ends the work.
    fn jacobian(
        &mut self,
        u: &[f64],
        residuals: &DVector<f64>,
    ) -> Result<Option<DMatrix<f64>>, Self::Error>;
}

/// When to stop.
#[derive(Clone, Copy, Debug)]
pub(super) struct Settings {
    /// Relative reduction of the sum, found and foretold, below which it counts as least; what the
    /// residuals are known to.
    pub(super) reduction: f64,
    /// Relative size of a step below which it counts as nothing.
    pub(super) step: f64,
    /// Cosine of the angle between residuals and every column below which they count as orthogonal.
    pub(super) gradient: f64,
    /// Norm of a column up to which it is nothing but what derivatives are not known to: its variable is left alone.
    pub(super) least: f64,
    /// Most iterations.
    pub(super) iterations: usize,
    /// Longest change of a variable in a step: what is linear near a start says nothing of a plateau far away.
    pub(super) longest: f64,
}

/// How a fit ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// At a minimum, within what was asked for.
    Converged,
    /// No step, however short, makes the sum smaller: residuals or derivatives are not exact enough
    /// to go on, or the sum has a kink there.
    Stalled,
    /// At a place from where every step, however short, leads to where there is no answer.
    Barred,
    /// There is no answer for the derivatives at the last place.
    NoDerivatives,
    /// After as many iterations as were allowed.
    Exhausted,
}

/// What was found.
#[derive(Clone, Debug)]
pub(super) struct Minimum {
    /// Where.
    pub(super) u: Vec<f64>,
    /// The residuals there.
    pub(super) residuals: DVector<f64>,
    /// Their derivatives there; those of the last place where there were any.
    pub(super) jacobian: DMatrix<f64>,
    /// Steps taken.
    pub(super) iterations: usize,
    /// Steps that were shortened because there was no answer at their end.
    pub(super) failures: usize,
    /// How it ended.
    pub(super) end: End,
}

impl Minimum {
    /// Sum of the squared residuals.
    pub(super) fn sum(&self) -> f64 {
        self.residuals.norm_squared()
    }
}

/// Damping of the first step.
const FIRST_DAMPING: f64 = 1e-3;
/// Damping beyond which steps are nothing.
const MOST_DAMPING: f64 = 1e16;
/// Relative difference of two sums that may be of rounding.
const ROUND_OFF: f64 = 1e-13;
/// A step is taken if it reduces the sum by at least this share of what was foretold.
const WORTH_IT: f64 = 1e-4;

/// Looks for a minimum from `start`; `None` if there is no answer at the start, or no derivatives.
///
/// # Errors
/// What ends the work.
pub(super) fn minimise<P: Problem>(
    problem: &mut P,
    start: &[f64],
    bounds: &[[f64; 2]],
    settings: Settings,
) -> Result<Option<Minimum>, P::Error> {
    let mut u: Vec<f64> = clamped(start.iter().copied(), bounds);
    let Some(mut residuals) = problem.residuals(&u)? else {
        return Ok(None);
    };
    let Some(mut jacobian) = problem.jacobian(&u, &residuals)? else {
        return Ok(None);
    };
    let mut scale = vec![0.0_f64; u.len()];
    let (mut damping, mut growth) = (FIRST_DAMPING, 2.0);
    let (mut iterations, mut failures) = (0, 0);
    // Whether a step since the last one that was taken had no answer at its end.
    let mut is_barred = false;
    let mut end = End::Exhausted;
    while iterations < settings.iterations {
        let sum = residuals.norm_squared();
        let free = free(&u, &jacobian, &residuals, bounds, settings.least);
        for (scale, column) in scale.iter_mut().zip(jacobian.column_iter()) {
            *scale = scale.max(column.norm());
        }
        if is_orthogonal(&jacobian, &residuals, &free, settings.gradient) {
            end = End::Converged;
            break;
        }
        let step = step(&jacobian, &residuals, &scale, &free, damping);
        let length = step.iter().fold(0.0, |m: f64, d| m.max(d.abs()));
        let share = (settings.longest / length).min(1.0);
        let step: Vec<f64> = step.iter().map(|d| share * d).collect();
        let target = clamped(u.iter().zip(step.iter()).map(|(u, d)| u + d), bounds);
        let moved = DVector::from_iterator(u.len(), target.iter().zip(&u).map(|(t, u)| t - u));
        let foretold = sum - (&residuals + &jacobian * &moved).norm_squared();
        let there = problem.residuals(&target)?;
        failures += usize::from(there.is_none());
        is_barred |= there.is_none();
        let found = there.as_ref().map(|there| sum - there.norm_squared());
        // What is left of the way to the minimum no sum can tell: such a step is taken for a good one.
        let is_blurred = |found: f64| found.abs() <= ROUND_OFF * sum && foretold <= ROUND_OFF * sum;
        let ratio = found.map_or(-1.0, |found| {
            if is_blurred(found) {
                1.0
            } else {
                found / foretold
            }
        });
        let is_still = |(d, u): (&f64, &f64)| d.abs() <= settings.step * (u.abs() + settings.step);
        let is_small = moved.iter().zip(&u).all(is_still);
        if let Some(there) = there.filter(|_| foretold > 0.0 && ratio > WORTH_IT) {
            iterations += 1;
            let is_least = foretold <= settings.reduction * sum && ratio <= 2.0;
            (u, residuals) = (target, there);
            let Some(derivatives) = problem.jacobian(&u, &residuals)? else {
                end = End::NoDerivatives;
                break;
            };
            jacobian = derivatives;
            damping *= (1.0 - (2.0 * ratio - 1.0).powi(3)).max(1.0 / 3.0);
            growth = 2.0;
            if is_least || is_small {
                end = if is_barred {
                    End::Barred
                } else {
                    End::Converged
                };
                break;
            }
            is_barred = false;
        } else {
            // What is foretold is below what the residuals are known to: there is no better place.
            if foretold <= settings.reduction * sum || is_small {
                end = if is_barred {
                    End::Barred
                } else {
                    End::Converged
                };
                break;
            }
            damping *= growth;
            growth *= 2.0;
            if damping > MOST_DAMPING {
                end = End::Stalled;
                break;
            }
        }
    }
    Ok(Some(Minimum {
        u,
        residuals,
        jacobian,
        iterations,
        failures,
        end,
    }))
}

/// Within the bounds.
fn clamped(u: impl Iterator<Item = f64>, bounds: &[[f64; 2]]) -> Vec<f64> {
    let within = |(u, [lower, upper]): (f64, &[f64; 2])| u.max(*lower).min(*upper);
    u.zip(bounds).map(within).collect()
}

/// The variables that may move: seen by the residuals, and not at a bound that the way down leads out of.
pub(super) fn free(
    u: &[f64],
    jacobian: &DMatrix<f64>,
    residuals: &DVector<f64>,
    bounds: &[[f64; 2]],
    least: f64,
) -> Vec<usize> {
    let may_move = |&i: &usize| {
        let column = jacobian.column(i);
        let gradient = column.dot(residuals);
        let [lower, upper] = bounds[i];
        let is_out = u[i] <= lower && gradient > 0.0 || u[i] >= upper && gradient < 0.0;
        lower < upper && !is_out && column.norm() > least
    };
    (0..u.len()).filter(may_move).collect()
}

fn is_orthogonal(
    jacobian: &DMatrix<f64>,
    residuals: &DVector<f64>,
    free: &[usize],
    cosine: f64,
) -> bool {
    free.iter().all(|&i| {
        let column = jacobian.column(i);
        column.dot(residuals).abs() <= cosine * column.norm() * residuals.norm()
    })
}

/// The damped step of the free variables; 0 of the others.
fn step(
    jacobian: &DMatrix<f64>,
    residuals: &DVector<f64>,
    scale: &[f64],
    free: &[usize],
    damping: f64,
) -> Vec<f64> {
    let (m, n) = (residuals.len(), free.len());
    let scale = |i: usize| if scale[i] > 0.0 { scale[i] } else { 1.0 };
    let stacked = DMatrix::from_fn(m + n, n, |row, k| {
        if row < m {
            jacobian[(row, free[k])] / scale(free[k])
        } else if row - m == k {
            damping.sqrt()
        } else {
            0.0
        }
    });
    let mut right = DVector::zeros(m + n);
    right.rows_mut(0, m).copy_from(&-residuals);
    let qr = stacked.qr();
    qr.q_tr_mul(&mut right);
    let mut step = vec![0.0; jacobian.ncols()];
    // Damping keeps the triangle regular.
    let solved = qr
        .r()
        .solve_upper_triangular(&right.rows(0, n).into_owned());
    for (k, &i) in free.iter().enumerate() {
        step[i] = solved.as_ref().map_or(0.0, |solved| solved[k]) / scale(i);
    }
    step
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::statistics::Covariance;

    impl Default for Settings {
        /// For residuals that are known to round-off.
        fn default() -> Self {
            Self {
                reduction: 1e-22,
                step: 1e-12,
                gradient: 1e-12,
                least: 0.0,
                iterations: 200,
                longest: f64::INFINITY,
            }
        }
    }

    /// A model y = f(x; b) with its derivatives, fitted to points.
    struct Curve {
        points: &'static [(f64, f64)],
        f: fn(f64, &[f64]) -> f64,
        derivatives: fn(f64, &[f64]) -> Vec<f64>,
        /// No answer where this holds.
        fails: fn(&[f64]) -> bool,
    }

    impl Problem for Curve {
        type Error = ();

        fn residuals(&mut self, b: &[f64]) -> Result<Option<DVector<f64>>, ()> {
            let residual = |(y, x): &(f64, f64)| (self.f)(*x, b) - y;
            let all = self.points.iter().map(residual);
            Ok((!(self.fails)(b)).then(|| DVector::from_iterator(self.points.len(), all)))
        }

        fn jacobian(&mut self, b: &[f64], _: &DVector<f64>) -> Result<Option<DMatrix<f64>>, ()> {
            let rows = self
                .points
                .iter()
                .flat_map(|(_, x)| (self.derivatives)(*x, b));
            let rows: Vec<f64> = rows.collect();
            Ok(Some(DMatrix::from_row_slice(
                self.points.len(),
                b.len(),
                &rows,
            )))
        }
    }

    const NEVER: fn(&[f64]) -> bool = |_| false;

    /// NIST StRD, Misra1a (Misra 1978, dental research): (y, x).
    const MISRA1A: [(f64, f64); 14] = [
        (10.07, 77.6),
        (14.73, 114.9),
        (17.94, 141.1),
        (23.93, 190.8),
        (29.61, 239.9),
        (35.18, 289.0),
        (40.02, 332.8),
        (44.82, 378.4),
        (50.76, 434.8),
        (55.05, 477.3),
        (61.01, 536.8),
        (66.40, 593.1),
        (75.47, 689.1),
        (81.78, 760.0),
    ];

    /// NIST StRD, Thurber (1979, electron mobility): (y, x).
    const THURBER: [(f64, f64); 37] = [
        (80.574, -3.067),
        (84.248, -2.981),
        (87.264, -2.921),
        (87.195, -2.912),
        (89.076, -2.840),
        (89.608, -2.797),
        (89.868, -2.702),
        (90.101, -2.699),
        (92.405, -2.633),
        (95.854, -2.481),
        (100.696, -2.363),
        (101.060, -2.322),
        (401.672, -1.501),
        (390.724, -1.460),
        (567.534, -1.274),
        (635.316, -1.212),
        (733.054, -1.100),
        (759.087, -1.046),
        (894.206, -0.915),
        (990.785, -0.714),
        (1090.109, -0.566),
        (1080.914, -0.545),
        (1122.643, -0.400),
        (1178.351, -0.309),
        (1260.531, -0.109),
        (1273.514, -0.103),
        (1288.339, 0.010),
        (1327.543, 0.119),
        (1353.863, 0.377),
        (1414.509, 0.790),
        (1425.208, 0.963),
        (1421.384, 1.006),
        (1442.962, 1.115),
        (1464.350, 1.572),
        (1468.705, 1.841),
        (1447.894, 2.047),
        (1457.628, 2.200),
    ];

    fn misra() -> Curve {
        Curve {
            points: &MISRA1A,
            f: |x, b| b[0] * (1.0 - (-b[1] * x).exp()),
            derivatives: |x, b| {
                let decay = (-b[1] * x).exp();
                vec![1.0 - decay, b[0] * x * decay]
            },
            fails: NEVER,
        }
    }

    fn thurber() -> Curve {
        fn parts(x: f64, b: &[f64]) -> (f64, f64) {
            let above = b[0] + x * (b[1] + x * (b[2] + x * b[3]));
            (above, 1.0 + x * (b[4] + x * (b[5] + x * b[6])))
        }
        Curve {
            points: &THURBER,
            f: |x, b| {
                let (above, below) = parts(x, b);
                above / below
            },
            derivatives: |x, b| {
                let (above, below) = parts(x, b);
                let by_below = -above / (below * below);
                let powers = [1.0, x, x * x, x.powi(3)];
                let mut all: Vec<f64> = powers.iter().map(|p| p / below).collect();
                all.extend(powers[1..].iter().map(|p| by_below * p));
                all
            },
            fails: NEVER,
        }
    }

    const WIDE: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

    /// Eleven digits are certified. A sum of n squares is known to n ε/2, which tells a parameter to
    /// √((n − p) n ε/2) standard deviations at best, 4e-7 here; 1e-7 are asked for, and eight digits; of
    /// standard deviations seven.
    #[track_caller]
    fn hold(curve: &mut Curve, start: &[f64], certified: &[(f64, f64)], sum: f64) {
        let bounds = vec![WIDE; start.len()];
        let found = minimise(curve, start, &bounds, Settings::default());
        let found = found.unwrap().unwrap();
        let degrees = found.residuals.len() - start.len();
        let free: Vec<usize> = (0..start.len()).collect();
        let covariance = Covariance::new(&found.jacobian, &free, 1e-12);
        let variance = found.sum() / degrees as f64;
        assert!((found.sum() / sum - 1.0).abs() < 1e-10, "{}", found.sum());
        for (i, (value, deviation)) in certified.iter().enumerate() {
            let error = (found.u[i] - value).abs();
            let is_exact = error < 1e-7 * deviation && error < 1e-8 * value;
            assert!(is_exact, "b{}: {} {:?}", i + 1, found.u[i], found.end);
            let own = (covariance.variance(i).unwrap() * variance).sqrt();
            assert!((own / deviation - 1.0).abs() < 1e-7, "s{}: {own}", i + 1);
        }
    }

    #[test]
    fn misra1a_has_its_certified_digits() {
        let certified = [
            (2.389_421_291_8e2, 2.707_007_524_1),
            (5.501_564_318_1e-4, 7.266_868_843_6e-6),
        ];
        for start in [[500.0, 1e-4], [250.0, 5e-4]] {
            hold(&mut misra(), &start, &certified, 1.245_513_889_4e-1);
        }
    }

    #[test]
    fn thurber_has_its_certified_digits() {
        let certified = [
            (1.288_139_680_0e3, 4.664_796_334_4),
            (1.491_079_253_5e3, 3.957_115_608_6e1),
            (5.832_383_687_7e2, 2.869_869_610_2e1),
            (7.541_664_429_1e1, 5.567_537_027_0),
            (9.662_950_286_4e-1, 3.133_334_068_7e-2),
            (3.979_728_579_7e-1, 1.498_492_819_8e-2),
            (4.972_729_734_9e-2, 6.584_234_462_3e-3),
        ];
        for start in [
            [1000.0, 1000.0, 400.0, 40.0, 0.7, 0.3, 0.03],
            [1300.0, 1500.0, 500.0, 75.0, 1.0, 0.4, 0.05],
        ] {
            hold(&mut thurber(), &start, &certified, 5.642_708_239_7e3);
        }
    }

    #[test]
    fn units_do_not_matter() {
        // The same problem with the second parameter in another unit takes the same steps.
        let units = |b: &[f64]| [b[0], 1e-6 * b[1]];
        let mut plain = misra();
        let mut scaled = Curve {
            f: |x, b| b[0] * (1.0 - (-1e-6 * b[1] * x).exp()),
            derivatives: |x, b| {
                let decay = (-1e-6 * b[1] * x).exp();
                vec![1.0 - decay, 1e-6 * b[0] * x * decay]
            },
            ..misra()
        };
        let settings = Settings {
            iterations: 5,
            ..Settings::default()
        };
        let bounds = [WIDE; 2];
        let a = minimise(&mut plain, &[500.0, 1e-4], &bounds, settings)
            .unwrap()
            .unwrap();
        let b = minimise(&mut scaled, &[500.0, 100.0], &bounds, settings)
            .unwrap()
            .unwrap();
        for (a, b) in a.u.iter().zip(units(&b.u)) {
            assert!((a / b - 1.0).abs() < 1e-9, "{a} {b}");
        }
    }

    #[test]
    fn a_bound_in_the_way_is_kept_and_the_others_are_best_there() {
        // With b1 ≤ 200 the best b2 is that of a fit of b2 alone.
        let bounds = [[0.0, 200.0], [0.0, 1.0]];
        let both = minimise(&mut misra(), &[100.0, 1e-3], &bounds, Settings::default());
        let both = both.unwrap().unwrap();
        assert_eq!(both.u[0].to_bits(), 200.0_f64.to_bits());
        let bounds = [[200.0, 200.0], [0.0, 1.0]];
        let alone = minimise(&mut misra(), &[200.0, 1e-3], &bounds, Settings::default());
        let alone = alone.unwrap().unwrap();
        assert!(
            (both.u[1] / alone.u[1] - 1.0).abs() < 1e-8,
            "{both:?} {alone:?}"
        );
        let free = free(
            &both.u,
            &both.jacobian,
            &both.residuals,
            &[[0.0, 200.0], [0.0, 1.0]],
            0.0,
        );
        assert_eq!(free, [1]);
    }

    #[test]
    fn places_without_an_answer_shorten_the_step() {
        // Newton's step from 2 goes to 2 − 5 arctan 2 = −3.5.
        let mut curve = Curve {
            points: &[(0.0, 0.0)],
            f: |_, b| b[0].atan(),
            derivatives: |_, b| vec![1.0 / (1.0 + b[0] * b[0])],
            fails: |b| b[0] < -3.0,
        };
        let found = minimise(&mut curve, &[2.0], &[WIDE], Settings::default());
        let found = found.unwrap().unwrap();
        assert!(found.failures > 0);
        assert!(found.u[0].abs() < 1e-6, "{found:?}");
        let start = [100.0, 1e-5];
        // A minimum behind a wall is none.
        let mut walled = Curve {
            fails: |b| b[0] > 150.0,
            ..misra()
        };
        let found = minimise(&mut walled, &start, &[WIDE; 2], Settings::default());
        let found = found.unwrap().unwrap();
        assert_eq!(found.end, End::Barred);
        assert!((found.u[0] - 150.0).abs() < 1.0, "{found:?}");
        let nowhere = Curve {
            fails: |_| true,
            ..misra()
        };
        let found = minimise(&mut { nowhere }, &start, &[WIDE; 2], Settings::default());
        assert!(found.unwrap().is_none());
    }
}
