//! Points of interfaces whose traction breaks off on the way from one trial state to another.
//!
//! The host knows no law, and asks it: a traction that changes over a vanishing part of the way has lost what it
//! carried.

use super::broken_bonds::SLIP;
use crate::group::Group;
use law::Operator;

/// Equal parts of the way that are looked at first, and how often a part is halved.
const PARTS: usize = 16;
const HALVINGS: usize = 32;
/// A traction that changes by less than this share of the largest one on the way does not break off.
const NOTABLE: f64 = 0.01;
/// On ways that are shorter than this share of the increment rounding decides.
const SHORT: f64 = 1e-9;

/// A place on the way, and the traction there.
type Reached = (f64, Vec<f64>);

impl Group {
    /// Whether it is an interface with a bond that may break: at some point its law carries shear without normal stress.
    pub fn may_break(&self) -> bool {
        let is_bonded = |point| {
            let traction = self.tried(point, [0.0, SLIP]);
            traction.is_some_and(|traction| traction[1].abs() > 0.0)
        };
        self.is_active
            && !self.is_linear()
            && self.law.built.law.n_components() == 2
            && (0..self.kinematics.n_points()).any(is_bonded)
    }

    /// Whether it is an interface of which a point that carried traction at the start of the step carries none in the trial
    /// state.
    pub fn opens(&self) -> bool {
        let (n, place) = (self.law.built.law.n_components(), self.flux_place());
        if n != 2 || self.is_linear() {
            return false;
        }
        let carries = |stress: &[f64], point| {
            let traction = place.of_point(stress, point, n);
            traction.iter().any(|t| t.abs() > 0.0)
        };
        let [before, after] = [&self.stress.committed, &self.stress.trial];
        !after.is_empty()
            && (0..self.kinematics.n_points())
                .any(|point| carries(before, point) && !carries(after, point))
    }

    /// Jumps of the trial state, of all points.
    pub fn trial_jumps(&self) -> Vec<f64> {
        self.gradient().trial.clone()
    }

    /// Whether the traction of a point breaks off between these jumps of all points and those of the trial state. The
    /// way takes no time.
    pub fn breaks(&self, point: usize, jumps: &[f64], time: f64) -> bool {
        self.finds_break(point, jumps, time).unwrap_or(false)
    }

    fn finds_break(&self, point: usize, jumps: &[f64], time: f64) -> Option<bool> {
        let own = 2 * point..2 * point + 2;
        let gradient = self.gradient();
        let [start, from, to] = [&gradient.committed[..], jumps, &gradient.trial[..]]
            .map(|jumps| jumps.get(own.clone()));
        let (start, from, to) = (start?, from?, to?);
        let farthest = size(&difference(to, start)).max(size(&difference(from, start)));
        if size(&difference(to, from)) <= SHORT * farthest {
            return None;
        }
        let traction = |s: f64| -> Option<Reached> {
            let jump = [0, 1].map(|c| from[c] + s * (to[c] - from[c]));
            let (traction, _) = self.answer(point, &jump, Operator::None, (time, 0.0))?;
            let is_finite = traction.iter().all(|t| t.is_finite());
            is_finite.then_some((s, traction))
        };
        let (first, middle, last) = (traction(0.0)?, traction(0.5)?, traction(1.0)?);
        let most = [&first, &middle, &last].map(|(_, t)| size(t));
        let least = NOTABLE * most.into_iter().fold(0.0, f64::max);
        // What breaks off leaves the middle off the straight line.
        let straight = [0, 1].map(|c| f64::midpoint(first.1[c], last.1[c]));
        if size(&difference(&middle.1, &straight)) <= 0.25 * least {
            return None;
        }
        let mut before = first;
        for part in 1..=PARTS {
            let after = traction(part as f64 / PARTS as f64)?;
            if is_sudden((&before, &after), least, HALVINGS, &traction) {
                return Some(true);
            }
            before = after;
        }
        None
    }
}

/// Whether a part of a way can be narrowed down to nothing over which the traction still changes by more than `least`.
fn is_sudden(
    (before, after): (&Reached, &Reached),
    least: f64,
    halvings: usize,
    traction: &dyn Fn(f64) -> Option<Reached>,
) -> bool {
    if size(&difference(&after.1, &before.1)) < least {
        return false;
    }
    if halvings == 0 {
        return true;
    }
    traction(f64::midpoint(before.0, after.0)).is_some_and(|middle| {
        is_sudden((before, &middle), least, halvings - 1, traction)
            || is_sudden((&middle, after), least, halvings - 1, traction)
    })
}

fn difference(a: &[f64], b: &[f64]) -> [f64; 2] {
    [a[0] - b[0], a[1] - b[1]]
}

fn size(v: &[f64]) -> f64 {
    f64::hypot(v[0], v[1])
}
