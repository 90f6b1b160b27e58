//! Mechanism of a step without equilibrium: the point that gives way where the residual is largest, and how.

use super::newton::PointPlace;
use crate::group::{FailureMode, Group};
use serde::Serialize;
use std::fmt;

/// What gives way.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Mechanism {
    /// The point where most is out of balance.
    #[serde(flatten)]
    pub at: PointPlace,
    /// How it gives way.
    pub how: FailureMode,
    /// At how many points of its group, and of how many.
    #[serde(rename = "points_of")]
    pub points: [usize; 2],
    /// The bond of its group began without normal stress, and the first tension breaks it.
    #[serde(rename = "began_without_normal_stress")]
    pub is_bare: bool,
}

impl fmt::Display for Mechanism {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [points, of] = self.points;
        write!(
            f,
            "what gives way: {}, {}; {points} of {of} points of the group do",
            self.how, self.at
        )?;
        if self.is_bare {
            write!(
                f,
                "; the bond began without normal stress, and breaks at the first tension, however small"
            )?;
        }
        Ok(())
    }
}

/// Jumps of all points of groups, by the group's number.
pub(super) type Jumps = Vec<(usize, Vec<f64>)>;

/// Finds what gives way in the trial state of the groups under iteration. `residual`: by degree of freedom. `before`:
/// jumps of an earlier iterate by group; points whose traction has broken off since are distinguished from others.
pub(super) fn find(
    groups: &[Group],
    includes: impl Fn(usize) -> bool,
    residual: &[f64],
    before: &[(usize, Vec<f64>)],
    time: f64,
) -> Option<Mechanism> {
    let at_node = |&node: &usize| residual[2 * node].hypot(residual[2 * node + 1]);
    let mut worst: Option<(f64, FailureMode, usize, usize, usize)> = None;
    for (number, group) in groups.iter().enumerate() {
        if !includes(number) || group.is_linear() || !group.is_active {
            continue;
        }
        let before = before.iter().find(|(of, _)| *of == number);
        let breaks =
            |point: usize| before.is_some_and(|(_, jumps)| group.breaks(point, jumps, time));
        let n_points = group.kinematics.n_points();
        let how = |point: usize| {
            if breaks(point) {
                return Some(FailureMode::BondBreaks);
            }
            group.gives(point, time)
        };
        let all: Vec<Option<FailureMode>> = (0..n_points).map(how).collect();
        for (point, how) in all.iter().enumerate() {
            let Some(how) = *how else {
                continue;
            };
            let (element, _) = group.kinematics.place_of(point);
            let out = group.kinematics.nodes(element).iter().map(at_node);
            let out = out.fold(0.0, f64::max);
            let is_worse =
                worst.is_none_or(|(most, worst, ..)| out > most || (out >= most && how < worst));
            if is_worse {
                let alike = all.iter().filter(|other| **other == Some(how)).count();
                worst = Some((out, how, number, point, alike));
            }
        }
    }
    let (_, how, number, point, alike) = worst?;
    let group = &groups[number];
    Some(Mechanism {
        at: PointPlace::of(group, point),
        how,
        points: [alike, group.kinematics.n_points()],
        is_bare: group.is_bare(),
    })
}
