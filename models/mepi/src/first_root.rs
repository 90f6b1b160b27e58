//! The first root where it takes a search: intervals of Δλ, over each of which the outcome is proved.

use crate::return_mapping::{Flow, Increment, LAST_STEP, Leg, Sample};
use abi::Failure;

const MAX_BISECTIONS: usize = 250;
const MAX_INTERVALS: usize = 2000;

impl Increment<'_> {
    /// Advances by intervals over each of which the outcome can be proved. `hint` is a root,
    /// perhaps not the first.
    #[cold]
    pub(crate) fn march(
        &self,
        mut leg: Leg,
        limit: f64,
        hint: Option<f64>,
    ) -> Result<Flow, Failure> {
        let mut peak = self.distance_to_peak().filter(|&p| p < limit);
        let mut end = peak.unwrap_or(limit);
        let mut from = self.sample(&leg, 0.0);
        let mut width = hint.unwrap_or(end);
        for _ in 0..MAX_INTERVALS {
            if from.d_lambda >= end {
                let Some(at_peak) = peak.take() else {
                    return Ok(Flow::LosesContact { exhausted: None });
                };
                leg = self.second_leg(&from);
                from = self.sample(&leg, at_peak);
                if from.residual <= 0.0 {
                    return Ok(Flow::StopsAtPeak(from));
                }
                end = limit;
                width = end - from.d_lambda;
            }
            let to = self.sample(&leg, end.min(from.d_lambda + width));
            if to.d_lambda <= from.d_lambda {
                break;
            }
            let bounds = self.bounds(&leg, &from, &to);
            let in_contact = self.keeps_contact(bounds.contraction_high);
            if bounds.residual_slope < 0.0 && in_contact && to.residual <= 0.0 {
                return Ok(Flow::Slides(self.root_between(&leg, from, to)));
            }
            let rootless = bounds.has_no_root(&to);
            if rootless && !self.keeps_contact(to.contraction) {
                let keeps = |x: f64| self.keeps_contact(self.sample(&leg, x).contraction);
                let exhausted = Some(last_that(keeps, from.d_lambda, to.d_lambda));
                return Ok(Flow::LosesContact { exhausted });
            }
            if rootless && in_contact {
                width = 4.0 * (to.d_lambda - from.d_lambda);
                from = to;
            } else {
                width = 0.5 * (to.d_lambda - from.d_lambda);
            }
        }
        Err(Failure::CutStep {
            factor: 0.5,
            reason: "the plastic slip cannot be told from a second solution close by",
        })
    }

    /// The root of g between two samples where it changes sign and falls: Newton's method, kept
    /// inside by bisection.
    fn root_between(&self, leg: &Leg, from: Sample, to: Sample) -> Sample {
        let (mut low, mut high) = (from.d_lambda, to.d_lambda);
        let mut at = to;
        for _ in 0..MAX_BISECTIONS {
            if at.residual > 0.0 {
                low = at.d_lambda;
            } else {
                high = at.d_lambda;
            }
            let newton = at.d_lambda - at.residual / at.residual_slope;
            let step = (newton - at.d_lambda).abs();
            let inside = newton > low && newton < high && step < 0.5 * (high - low);
            let next = if inside {
                newton
            } else {
                low + 0.5 * (high - low)
            };
            if next <= low || next >= high || step <= f64::EPSILON * at.d_lambda {
                break;
            }
            at = self.sample(leg, next);
            if inside && step <= LAST_STEP * next {
                break;
            }
        }
        at
    }
}

/// The last number for which the condition, true at `low` and false at `high`, holds; to the last
/// bit.
pub(crate) fn last_that(holds: impl Fn(f64) -> bool, mut low: f64, mut high: f64) -> f64 {
    for _ in 0..MAX_BISECTIONS {
        let middle = low + 0.5 * (high - low);
        if middle <= low || middle >= high {
            break;
        }
        if holds(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}
