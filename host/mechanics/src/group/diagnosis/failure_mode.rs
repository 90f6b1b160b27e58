//! How a point gives way in a step, as far as that shows without knowing its law: by what its stress does against what
//! elasticity alone would make of the same motion.

use crate::group::Group;
use crate::problem::Formulation;
use law::Operator;
use serde::Serialize;
use std::fmt;

/// Share of the elastic change of its stress that a point that gives way does not follow.
const GIVES: f64 = 0.5;
/// Elastic changes below this share of the stress say nothing.
const NOTABLE: f64 = 1e-9;

/// How a point gives way, the most telling first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum FailureMode {
    /// The traction of a bond breaks off.
    BondBreaks,
    /// The faces of an interface part, and carry nothing.
    Opens,
    /// The shear traction of an interface does not follow the slip.
    Slides,
    /// The normal traction of an interface does not follow its closure.
    Crushes,
    /// A body carries nothing.
    ComesApart,
    /// The stress of a body does not follow its strain.
    Yields,
}

impl fmt::Display for FailureMode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::BondBreaks => "a bond breaks",
            Self::Opens => "an interface opens",
            Self::Slides => "an interface slides",
            Self::Crushes => "an interface gives way in compression",
            Self::ComesApart => "a body comes apart",
            Self::Yields => "the ground (or another body) yields",
        })
    }
}

impl Group {
    /// How a point gives way between the committed and the trial state. `None` where it follows elasticity.
    pub fn gives(&self, point: usize, time: f64) -> Option<FailureMode> {
        let n = self.law.built.law.n_components();
        let gradient = self.gradient();
        let own = n * point..n * (point + 1);
        let ends = [&gradient.committed, &gradient.trial].map(|values| values.get(own.clone()));
        let [Some(before), Some(after)] = ends else {
            return None;
        };
        if self.stress.trial.is_empty() {
            return None;
        }
        let place = self.flux_place();
        let stress_0 = place.of_point(&self.stress.committed, point, n);
        let stress = place.of_point(&self.stress.trial, point, n);
        let moved: Vec<f64> = after.iter().zip(before).map(|(b, a)| b - a).collect();
        let is_body = self.formulation == Formulation::Solid;
        let carries_nothing = !stress.iter().any(|s| s.abs() > 0.0);
        if carries_nothing && !is_body && n == 2 {
            return (moved[0] > 0.0).then_some(FailureMode::Opens);
        }
        let (_, matrix) = self.answer(point, before, Operator::Elastic, (time, 0.0))?;
        let rows = matrix.chunks_exact(n);
        let elastic = rows.map(|row| row.iter().zip(&moved).map(|(d, e)| d * e).sum());
        let elastic: Vec<f64> = elastic.collect();
        let size = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
        if size(&elastic) <= NOTABLE * size(&stress_0) {
            return None;
        }
        let left = |i: usize| stress[i] - stress_0[i] - elastic[i];
        let lags = |i: usize| left(i).abs() > GIVES * elastic[i].abs();
        if n == 2 {
            let shear = elastic[1].abs() > NOTABLE * size(&stress_0) && lags(1);
            return match (shear, lags(0)) {
                (true, _) => Some(FailureMode::Slides),
                (false, true) => Some(FailureMode::Crushes),
                _ => None,
            };
        }
        let left: Vec<f64> = (0..n).map(left).collect();
        let gives = size(&left) > GIVES * size(&elastic);
        gives.then_some(if carries_nothing {
            FailureMode::ComesApart
        } else {
            FailureMode::Yields
        })
    }

    /// Whether its bond began without normal stress, and the first tension breaks it.
    pub fn is_bare(&self) -> bool {
        self.bond == super::Bond::Bare
    }
}
