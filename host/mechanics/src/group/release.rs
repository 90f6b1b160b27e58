//! Points of interfaces whose traction breaks off on the way from one trial state to another; and points that are
//! committed before all others, in the middle of a step.
//!
//! The host knows no law, and asks it: a traction that changes over a vanishing part of the way has lost what it carried.

use super::Group;
use law::Operator;

/// Equal parts of the way that are looked at first, and how often a part is halved.
const PARTS: usize = 16;
const HALVINGS: usize = 32;
/// A traction that changes by less than this share of the largest one on the way does not break off.
const NOTABLE: f64 = 0.01;
/// So far beyond, as a share of what is left of the way, the point counts as broken: rounding does not lead back.
const BEYOND: f64 = 1e-3;
/// Ways that are shorter than this share of the increment differ by rounding.
const SHORT: f64 = 1e-12;

/// A traction that breaks off between two trial states.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Break {
    /// The point.
    pub point: usize,
    /// Share of the way from the first state to the second one: the point has just broken.
    pub at: f64,
    /// It breaks on the way, and not on the way back.
    pub onward: bool,
}

impl Break {
    /// Share of the way on which it is broken.
    pub fn share(&self) -> f64 {
        if self.onward { 1.0 - self.at } else { self.at }
    }
}

/// A place on the way, and the traction there.
type Reached = (f64, Vec<f64>);

impl Group {
    /// Jumps of the trial state.
    pub fn trial_jumps(&self) -> Vec<f64> {
        self.gradient().trial.clone()
    }

    /// Whether it is an interface whose law may break.
    pub fn may_break(&self) -> bool {
        self.is_active && !self.is_linear() && self.law.built.law.n_components() == 2
    }

    /// Points whose traction breaks off between these jumps of all points. The way there takes no time.
    pub fn breaks(&self, [from, to]: [&[f64]; 2], time: f64) -> Vec<Break> {
        let points = 0..self.kinematics.n_points();
        points
            .filter_map(|point| {
                let of_point = |jumps: &[f64]| jumps.get(2 * point..2 * point + 2)?.try_into().ok();
                let ends: [[f64; 2]; 2] = [of_point(from)?, of_point(to)?];
                let (at, onward) = self.break_of(point, ends, time)?;
                Some(Break { point, at, onward })
            })
            .collect()
    }

    /// Where the traction of a point breaks off, and whether on the way or on the way back.
    fn break_of(&self, point: usize, [from, to]: [[f64; 2]; 2], time: f64) -> Option<(f64, bool)> {
        let committed = self.gradient().committed.get(2 * point..2 * point + 2)?;
        let length = size(&difference(&to, &from));
        let farthest = size(&difference(&to, committed)).max(size(&difference(&from, committed)));
        if length <= SHORT * farthest {
            return None;
        }
        let traction = |s: f64| -> Option<Reached> {
            let jump = [0, 1].map(|c| from[c] + s * (to[c] - from[c]));
            let (traction, _) = self.answer(point, &jump, Operator::None, (time, 0.0))?;
            traction
                .iter()
                .all(|t| t.is_finite())
                .then_some((s, traction))
        };
        let (first, middle, last) = (traction(0.0)?, traction(0.5)?, traction(1.0)?);
        let most = [&first, &middle, &last].map(|(_, t)| size(t));
        let least = NOTABLE * most.into_iter().fold(0.0, f64::max);
        let straight = [0, 1].map(|c| f64::midpoint(first.1[c], last.1[c]));
        // A break off the middle leaves the middle off the straight line.
        if size(&difference(&middle.1, &straight)) <= 0.25 * least {
            return None;
        }
        let mut before = first;
        for part in 1..=PARTS {
            let after = traction(part as f64 / PARTS as f64)?;
            if let Some((before, after)) = narrowed((&before, &after), least, HALVINGS, &traction) {
                let onward = size(&after.1) <= size(&before.1);
                let (at, end) = if onward {
                    (after.0, 1.0)
                } else {
                    (before.0, 0.0)
                };
                return Some((at + BEYOND * (end - at), onward));
            }
            before = after;
        }
        None
    }

    /// Commits the trial state of some points alone: they have gone ahead in the step, and their increments count from
    /// there. All others stay where they are.
    pub fn release(&mut self, points: &[usize]) {
        let n_points = self.kinematics.n_points();
        let n = self.kinematics.n_components();
        for &point in points {
            for c in n * point..n * (point + 1) {
                self.ahead
                    .push((c, self.strain.trial[c] - self.strain.committed[c]));
            }
        }
        for field in self.fields() {
            let n = field.committed.len() / n_points;
            for point in points {
                let own = n * point..n * (point + 1);
                field.committed[own.clone()].copy_from_slice(&field.trial[own]);
            }
        }
    }

    /// Takes from the trial strains what points that went ahead have done before the state that they are committed in.
    pub(super) fn count_from_ahead(&mut self) {
        for &(component, ahead) in &self.ahead {
            self.strain.trial[component] -= ahead;
        }
    }
}

/// The first part of a way, narrowed down to nothing, over which a traction changes by more than `least`.
fn narrowed(
    (before, after): (&Reached, &Reached),
    least: f64,
    halvings: usize,
    traction: &dyn Fn(f64) -> Option<Reached>,
) -> Option<(Reached, Reached)> {
    if size(&difference(&after.1, &before.1)) < least {
        return None;
    }
    if halvings == 0 {
        return Some((before.clone(), after.clone()));
    }
    let middle = traction(f64::midpoint(before.0, after.0))?;
    narrowed((before, &middle), least, halvings - 1, traction)
        .or_else(|| narrowed((&middle, after), least, halvings - 1, traction))
}

fn difference(a: &[f64], b: &[f64]) -> [f64; 2] {
    [a[0] - b[0], a[1] - b[1]]
}

fn size(v: &[f64]) -> f64 {
    f64::hypot(v[0], v[1])
}
