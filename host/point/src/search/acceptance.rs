//! How near the goal is near enough: what ends the iterations of a step, and what an increment has to meet
//! whatever ended them.
//!
//! Tolerances are relative to fluxes and gradients, as far as what the path was given explains
//! them ([`ToleranceScale`](crate::tolerance_scale::Anchor)).

use super::norm::{largest, norm};
use super::{Miss, Search};
use crate::state::{Goal, N_MAX, Point, Step, Vector};

/// Residual against the component's own flux, or against the largest flux where no iteration
/// comes closer.
const RELATIVE_TOLERANCE: f64 = 1e-10;
/// Residuals that summing fluxes and rounding gradients leave behind: a law computes the flux from
/// the difference of two totals, each known to half a unit in the last place.
const ROUND_OFF: f64 = 16.0 * f64::EPSILON;
/// Distance from a goal that is worth a word, relative to the largest flux.
const WORTH_A_WORD: f64 = 1e-6;
/// Iterations spent on coming closer than [`RELATIVE_TOLERANCE`] of the largest flux.
pub(super) const MAX_POLISH: usize = 3;

/// How near the goal a sample is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Verdict {
    Far,
    /// Within the tolerance relative to the largest flux.
    Close,
    /// Within the tolerance relative to each component.
    Tight,
}

impl Search<'_> {
    /// The quantity compared with the goal F.
    pub(super) fn answer(&self, point: &Point) -> Vector {
        match &self.restricted {
            None => point.flux,
            Some((restrictions, from)) => restrictions.answer(from, point),
        }
    }

    /// The flux and the gradient that the tolerances of the trial sample are relative to.
    fn scale_and_reach(&self, step: &Step<'_>, springs: &Vector) -> (f64, f64) {
        let Point { flux, gradient, .. } = &self.trial.point;
        let start_reach = largest(&step.start.gradient[..self.n]);
        let mut found = largest(&flux[..self.n]).max(largest(&step.start.flux[..self.n]));
        let mut asked = 0.0_f64;
        for (spring, &i) in springs.iter().zip(&self.free[..self.n_free]) {
            found = found.max(spring.abs());
            asked = asked.max(step.goal.flux[i].abs());
        }
        // A free component that runs away must not widen its own tolerance: neither in this step
        // nor, by what each lets the next one do, over many.
        let scale = asked.max(self.anchor.flux_of(found));
        let likely = 10.0 * (start_reach + largest(&step.goal.gradient[..self.n]))
            + 1e3 * scale / self.elastic_norm.max(f64::MIN_POSITIVE);
        let reach = start_reach.max(largest(&gradient[..self.n]).min(likely));
        (scale, self.anchor.reach_of(reach))
    }

    /// Residual of the trial sample, and how near it is.
    pub(super) fn assess(&mut self, step: &Step<'_>) {
        let (answer, at_start) = (self.answer(&self.trial.point), self.answer(step.start));
        let mut springs = [0.0; N_MAX];
        for (k, &i) in self.free[..self.n_free].iter().enumerate() {
            springs[k] = self.stiffness[i] * (self.trial.point.gradient[i] - self.origin[i]);
        }
        let (scale, reach) = self.scale_and_reach(step, &springs);
        let sample = &mut self.trial;
        let mut verdict = Verdict::Tight;
        let mut worst = 0.0;
        let mut miss = None;
        for (k, &i) in self.free[..self.n_free].iter().enumerate() {
            let r = answer[i] + springs[k] - step.goal.flux[i];
            let own = step.goal.flux[i].abs().max(at_start[i].abs());
            let own = own.max(f64::abs(springs[k]));
            let floor = ROUND_OFF * (scale + (self.elastic_norm + self.stiffness[i]) * reach);
            let close = RELATIVE_TOLERANCE * scale + floor;
            // Never true of a residual that is not a number.
            let within = |bound: f64| r.abs() <= bound;
            if !within(close) {
                verdict = Verdict::Far;
            } else if verdict == Verdict::Tight && !within(RELATIVE_TOLERANCE * own + floor) {
                verdict = Verdict::Close;
            }
            if r.abs() > worst {
                worst = r.abs();
                miss = Some(Miss {
                    component: i,
                    flux: answer[i],
                    goal: step.goal.flux[i] - springs[k],
                    residual: r,
                    tolerance: close,
                });
            }
            sample.residual[k] = r;
        }
        sample.norm = norm(&sample.residual[..self.n_free]);
        sample.verdict = verdict;
        let first = self.obstacle.miss.is_none();
        if verdict == Verdict::Far && (first || sample.norm < self.obstacle.norm) {
            self.obstacle.miss = miss;
            self.obstacle.norm = sample.norm;
        }
    }

    /// The controlled component of a point that is farthest from its goal, if one is farther than it
    /// may be at the end of an increment: whatever the iterations found.
    pub(crate) fn unmet(&self, point: &Point, goal: &Goal) -> Option<Miss> {
        let answer = self.answer(point);
        let found = largest(&point.flux[..self.n]);
        let missed = self.free[..self.n_free].iter().filter_map(|&i| {
            let spring = self.stiffness[i] * (point.gradient[i] - self.origin[i]);
            let residual = answer[i] + spring - goal.flux[i];
            let tolerance = self.anchor.bound(goal.flux[i], found, ROUND_OFF);
            // Not met, too, if it is not a number.
            let is_met = residual.abs() <= tolerance;
            (!is_met).then_some(Miss {
                component: i,
                flux: answer[i],
                goal: goal.flux[i] - spring,
                residual,
                tolerance,
            })
        });
        missed.max_by(|a, b| a.residual.abs().total_cmp(&b.residual.abs()))
    }

    /// The controlled component of a point that round-off alone keeps from its goal, by more than is worth
    /// a word. [`Self::unmet`] is `None`.
    pub(crate) fn blurred(&self, point: &Point, goal: &Goal) -> Option<Miss> {
        let answer = self.answer(point);
        let found = largest(&point.flux[..self.n]);
        let mut controlled = self.free[..self.n_free].iter();
        controlled.find_map(|&i| {
            let spring = self.stiffness[i] * (point.gradient[i] - self.origin[i]);
            let residual = answer[i] + spring - goal.flux[i];
            let tolerance = WORTH_A_WORD * self.anchor.largest_flux().max(found);
            (residual.abs() > tolerance).then_some(Miss {
                component: i,
                flux: answer[i],
                goal: goal.flux[i] - spring,
                residual,
                tolerance,
            })
        })
    }

    /// The controlled component that went farther than its goal explains.
    pub(crate) fn strayed(&self, point: &Point) -> Option<usize> {
        let mut controlled = self.free[..self.n_free].iter().copied();
        controlled.find(|&i| {
            let gradient = point.gradient[i].abs();
            gradient > self.anchor.reach_of(gradient)
        })
    }
}
