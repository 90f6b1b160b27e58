//! What keeps iterations from settling: two iterates compared, point by point.
//!
//! The host knows no law. It sees stresses that are zero in one iterate and not in the next, and
//! tangents that change although the displacements hardly do. Before it calls that a change of
//! contact or of a branch, it holds the tangent of the point against the law's own answers: with a
//! wrong one, points jump about for no other reason.

use super::newton::{Culprit, PointPlace, Symptom, norm};
use crate::group::{Fault, Group};
use crate::problem::Formulation;

/// Smallest relative change of a tangent that is worth a word.
const NOTABLE: f64 = 0.01;

/// Points of a group whose tangents are looked at where none changes.
const SAMPLES: usize = 64;

/// Stresses and tangents of all points of an iterate, group by group.
#[derive(Debug)]
pub(super) struct Snapshot(Vec<Vec<PointState>>);

#[derive(Clone, Debug)]
struct PointState {
    /// The stresses (tractions) that a law answers for.
    stress: Vec<f64>,
    tangent: Vec<f64>,
}

impl Snapshot {
    /// The trial state of the last evaluation.
    pub(super) fn of(groups: &[Group]) -> Self {
        Self(groups.iter().map(|group| states(group).collect()).collect())
    }
}

/// None of a group that is gone or linear: it keeps no iteration from settling.
fn states(group: &Group) -> impl Iterator<Item = PointState> {
    let n = group.kinematics.n_components();
    let state = move |point: usize| {
        let (element, within) = group.kinematics.place_of(point);
        let tangents = group.element_tangents(element);
        let stress = &group.stress.trial[n * point..][..n];
        PointState {
            stress: if group.formulation == Formulation::ThinLayer {
                // Across and along the layer.
                vec![stress[1], stress[3]]
            } else {
                stress.to_vec()
            },
            tangent: tangents[within * n * n..][..n * n].to_vec(),
        }
    };
    let n_points = if group.is_linear() || !group.is_active {
        0
    } else {
        group.kinematics.n_points()
    };
    (0..n_points).map(state)
}

/// How a point differs between two iterates; greater is worse.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
enum Change {
    /// The tangent, relative to the larger one.
    Tangent(f64),
    /// The stress is zero in one of them; its size in the other, in kPa.
    Vanishes(f64),
}

impl Change {
    fn between(a: &PointState, b: &PointState) -> Option<Self> {
        let sizes = (norm(&a.stress), norm(&b.stress));
        if (sizes.0 <= 0.0) != (sizes.1 <= 0.0) {
            return Some(Self::Vanishes(sizes.0.max(sizes.1)));
        }
        let difference: Vec<f64> = a
            .tangent
            .iter()
            .zip(&b.tangent)
            .map(|(a, b)| a - b)
            .collect();
        let relative = norm(&difference)
            / norm(&a.tangent)
                .max(norm(&b.tangent))
                .max(f64::MIN_POSITIVE);
        (relative >= NOTABLE).then_some(Self::Tangent(relative))
    }
}

/// Names the point that differs most between the snapshot and the present iterate, or one whose
/// tangent is wrong; `None` if no point's tangent changes notably. `period`: time at the start of
/// the step, and its increment.
pub(super) fn compare(groups: &[Group], before: &Snapshot, period: (f64, f64)) -> Option<Culprit> {
    let mut changed = 0;
    let mut worst: Option<(Change, &Group, usize)> = None;
    for (group, old) in groups.iter().zip(&before.0) {
        for (point, (old, new)) in old.iter().zip(states(group)).enumerate() {
            let Some(change) = Change::between(old, &new) else {
                continue;
            };
            changed += 1;
            if worst.is_none_or(|(worst, ..)| change > worst) {
                worst = Some((change, group, point));
            }
        }
    }
    let Some((change, group, point)) = worst else {
        return wrong_tangent(groups, period);
    };
    if let Some(fault) = group.tangent_fault(point, period.0, period.1) {
        return Some(culprit(group, point, Symptom::Fault(fault), 0));
    }
    let what = match (change, group.formulation) {
        (Change::Vanishes(_), Formulation::ThinLayer | Formulation::ZeroThickness) => {
            Symptom::Contact
        }
        (Change::Vanishes(_), Formulation::Solid) => Symptom::Cohesion,
        (Change::Tangent(relative), _) => Symptom::Branch(relative),
    };
    Some(culprit(group, point, what, changed - 1))
}

/// What happens at a point.
fn culprit(group: &Group, point: usize, what: Symptom, others: usize) -> Culprit {
    let at = PointPlace::of(group, point);
    Culprit { at, what, others }
}

/// The first of some points whose law has a wrong tangent.
fn wrong_tangent(groups: &[Group], (time, time_increment): (f64, f64)) -> Option<Culprit> {
    let nonlinear = groups.iter().filter(|group| !group.is_linear());
    let points = nonlinear.flat_map(|group| {
        let n = group.kinematics.n_points();
        let some = (0..n).step_by(n.div_ceil(SAMPLES).max(1));
        some.map(move |point| (group, point))
    });
    let mut faults = points.filter_map(|(group, point)| {
        let fault: Fault = group.tangent_fault(point, time, time_increment)?;
        // What a law calls approximate is not wrong for not being exact.
        let is_exact = group.law.built.law.formulation().tangent == law::Tangent::Consistent;
        if !is_exact && matches!(fault, Fault::Tangent(..)) {
            return None;
        }
        Some(culprit(group, point, Symptom::Fault(fault), 0))
    });
    faults.next()
}
