//! Faces that stand apart as another law takes over.

use crate::group::Group;
use crate::problem::Material;
use std::fmt;

/// Faces of an interface that stand apart, or touch without stress, as another law takes over, which
/// is not told of gaps.
#[derive(Clone, Debug, PartialEq)]
pub struct GroupSplit {
    /// Name of the group.
    pub group: String,
    /// Names of the two laws in the case file.
    pub laws: [String; 2],
    /// Points without stress, and all of the group.
    pub points: [usize; 2],
    /// Coordinates of the first of them.
    pub position: [f64; 2],
    /// Largest normal jump among them, m, since the law before took over.
    pub opening: f64,
}

impl fmt::Display for GroupSplit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            group,
            laws: [from, to],
            points: [points, all],
            position: [x, y],
            opening,
        } = self;
        write!(
            f,
            "interface `{group}` carries nothing at {points} of {all} points, the first at ({x:.4}, \
             {y:.4}), where law `{to}` takes over from `{from}`"
        )?;
        if *opening > 0.0 {
            write!(f, ", open by up to {opening:.3e} m")?;
        }
        write!(
            f,
            ": a law that starts is not told of gaps, so that faces which stand apart are in contact \
             again as soon as they approach"
        )
    }
}

impl Group {
    /// Points of an interface that have moved and carry nothing.
    pub(in crate::group) fn parted(&self, law: &Material) -> Option<GroupSplit> {
        let old = &self.law.built.law;
        if !self.is_active || old.n_components() != 2 {
            return None;
        }
        let place = self.flux_place();
        let jumps = match &self.layer {
            Some(layer) => &layer.jump.committed,
            None => &self.strain.committed,
        };
        let is_parted = |point: usize| {
            let first = place.offset + point * place.point;
            let carried = [0, 1].map(|c| self.stress.committed[first + c * place.component]);
            let jump = &jumps[2 * point..][..2];
            carried.iter().all(|t| *t == 0.0) && jump.iter().any(|u| *u != 0.0)
        };
        let all = self.kinematics.n_points();
        let points: Vec<usize> = (0..all).filter(|&point| is_parted(point)).collect();
        let first = *points.first()?;
        let widest = points.iter().map(|&point| jumps[2 * point]);
        Some(GroupSplit {
            group: self.name.clone(),
            laws: [self.law.name.clone(), law.name.clone()],
            points: [points.len(), all],
            position: self.kinematics.position(first),
            opening: widest.fold(f64::NEG_INFINITY, f64::max),
        })
    }
}
