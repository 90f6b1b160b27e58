//! The profile of a parameter: the least sum of squares for values next to the best one.

use super::stage::Stage;
use crate::Error;

/// The least sum of squares for values of one parameter next to the best.
#[derive(Clone, Debug, Default)]
pub struct Profile {
    /// Values of the parameter, as the search counts it, ascending, with the sum of squares of the best of
    /// the others; the best one among them.
    pub points: Vec<(f64, f64)>,
    /// How it ends below and above.
    pub sides: [Side; 2],
}

/// How a side of a profile ends. Values are as the search counts.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Side {
    /// It leaves the interval of confidence here.
    Limit(f64),
    /// It reaches the parameter's bound inside the interval.
    Bound,
    /// It stays inside the interval as far as it is worth following: there is no limit.
    Flat(f64),
    /// Inside the interval up to here, and beyond tests cannot be computed.
    Barred(f64),
    /// Inside the interval up to here, and no more points were spent on it.
    Unfinished(f64),
    /// It was not followed.
    #[default]
    Unknown,
}

/// A profile is followed for at most this many points on either side.
const MOST_POINTS: usize = 16;
/// Steps of a profile, in quantiles.
const STEP: f64 = 0.4;
/// On a logarithmic scale or in widths of the range, a profile goes no farther than this.
const FARTHEST: f64 = 12.0;
/// A sum that is lower than the best one by this part of the allowance is a better place.
const BETTER: f64 = 1e-3;

/// The best of the others for a value of the parameter, looked for from a place nearby: that place, with
/// the sum there; `None` where the tests cannot be computed.
pub(super) type Others<'f> = dyn FnMut(f64, &[f64]) -> Result<Option<(Vec<f64>, f64)>, Error> + 'f;

/// Follows the profile of a parameter to either side, until it leaves the interval of confidence; and a
/// better place, if one was met.
///
/// # Errors
/// As [`super::model::Model::computed`].
pub(super) fn follow(
    stage: &Stage,
    place: usize,
    bounds: [f64; 2],
    others: &mut Others<'_>,
) -> Result<(Profile, Option<Vec<f64>>), Error> {
    let mut profile = Profile::default();
    let mut better = None;
    let mut points = [Vec::new(), Vec::new()];
    for side in 0..2 {
        let mut walk = Walk {
            stage,
            place,
            bound: bounds[side],
            sign: if side == 0 { -1.0 } else { 1.0 },
            points: Vec::new(),
            better: None,
        };
        profile.sides[side] = walk.walk(others)?;
        better = better.or(walk.better);
        points[side] = walk.points;
    }
    let [mut below, above] = points;
    below.reverse();
    profile.points = below;
    profile.points.push((stage.best[place], stage.sum));
    profile.points.extend(above);
    Ok((profile, better))
}

/// One side of a profile.
struct Walk<'s> {
    stage: &'s Stage,
    place: usize,
    bound: f64,
    sign: f64,
    points: Vec<(f64, f64)>,
    better: Option<Vec<f64>>,
}

impl Walk<'_> {
    /// The next value, within the bound.
    fn target(&self, value: f64, step: f64) -> f64 {
        let target = value + self.sign * step;
        if self.sign < 0.0 {
            target.max(self.bound)
        } else {
            target.min(self.bound)
        }
    }

    #[expect(clippy::float_cmp, reason = "a value that was brought to its bound")]
    fn walk(&mut self, others: &mut Others<'_>) -> Result<Side, Error> {
        let (stage, place) = (self.stage, self.place);
        let best = stage.best[place];
        let allowance = stage.allowance(place);
        if !allowance.is_finite() || allowance <= 0.0 {
            return Ok(Side::Unknown);
        }
        let error = stage.error(place).filter(|error| *error > 0.0);
        let first = error.map_or(0.05, |error| STEP * stage.quantile * error);
        let first = first.clamp(1e-9, 0.5);
        let (mut near, mut value, mut step) = (stage.best.clone(), best, first);
        let mut root = 0.0;
        let mut is_barred = false;
        for _ in 0..MOST_POINTS {
            if value == self.bound {
                return Ok(Side::Bound);
            }
            let target = self.target(value, step);
            let Some((u, sum)) = others(target, &near)? else {
                // The law cannot follow there: a shorter step may do.
                is_barred = true;
                step *= 0.3;
                if step < 1e-2 * first {
                    break;
                }
                continue;
            };
            is_barred = false;
            let rise = sum - stage.sum;
            if rise < -BETTER * allowance && self.better.is_none() {
                self.better = Some(u.clone());
            }
            self.points.push((target, sum));
            let next = rise.max(0.0).sqrt();
            if rise >= allowance {
                // √ of the rise is nearly straight.
                let part = (allowance.sqrt() - root) / (next - root);
                return Ok(Side::Limit(value + part * (target - value)));
            }
            let slope = (next - root) / (target - value).abs();
            (near, value, root) = (u, target, next);
            if (value - best).abs() > FARTHEST {
                return Ok(Side::Flat(value));
            }
            // The next step is one that takes the root as far again, but no leap.
            let wanted = STEP * allowance.sqrt() / slope.max(1e-12);
            step = wanted.clamp(0.5 * step, 3.0 * step);
        }
        Ok(if value == self.bound {
            Side::Bound
        } else if is_barred {
            Side::Barred(value)
        } else {
            Side::Unfinished(value)
        })
    }
}
