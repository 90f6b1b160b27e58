//! The tangents of a group's points.

use super::Origin;
use crate::group::Group;
use std::ops::Range;

/// Tangents as of the last evaluation that computed them.
#[derive(Debug, Default)]
pub(in crate::group) struct PointTangents {
    /// Tangents of the element, point by point; of a linear law, those of one element only.
    pub(in crate::group) values: Vec<f64>,
    /// Stresses follow strains by one constant matrix.
    pub(in crate::group) are_constant: bool,
    /// Where they come from.
    pub(in crate::group) origin: Origin,
}

impl Group {
    /// Tangents of an element's points as of the last evaluation.
    pub fn element_tangents(&self, element: usize) -> &[f64] {
        let n = self.kinematics.n_components();
        let points = self.kinematics.points_of(element);
        let first = if self.tangents.are_constant {
            0
        } else {
            points.start
        };
        &self.tangents.values[first * n * n..(first + points.len()) * n * n]
    }

    /// Tangents of consecutive elements, at least one, where they differ from point to point.
    pub fn tangents_of(&self, elements: Range<usize>) -> &[f64] {
        let n = self.kinematics.n_components();
        let points_of = |element| self.kinematics.points_of(element);
        let (first, end) = (
            points_of(elements.start).start,
            points_of(elements.end - 1).end,
        );
        &self.tangents.values[first * n * n..end * n * n]
    }

    /// The tangents of every element's points, if they are the same at all of them.
    pub fn constant_tangents(&self) -> Option<&[f64]> {
        self.tangents.are_constant.then_some(&self.tangents.values)
    }

    /// Tangents as of the last evaluation that computed them.
    pub fn tangents(&self) -> &[f64] {
        &self.tangents.values
    }

    /// Puts tangents back that [`Self::tangents`] gave.
    pub fn put_tangents(&mut self, tangents: Vec<f64>) {
        debug_assert_eq!(tangents.len(), self.tangents.values.len());
        self.tangents.values = tangents;
    }

    /// Change of the stresses under displacement increments if the tangents held: D Δε.
    pub fn linear_change(&self, increment: &[f64]) -> Vec<f64> {
        let n = self.kinematics.n_components();
        let mut strain = vec![0.0; self.strain.committed.len()];
        self.kinematics.add_gradients(increment, &mut strain);
        let mut change = vec![0.0; strain.len()];
        let points = strain.chunks_exact(n).zip(change.chunks_exact_mut(n));
        for (point, (strain, change)) in points.enumerate() {
            let (element, within) = self.kinematics.place_of(point);
            let tangent = &self.element_tangents(element)[within * n * n..][..n * n];
            for (change, row) in change.iter_mut().zip(tangent.chunks_exact(n)) {
                *change = row.iter().zip(strain).map(|(d, e)| d * e).sum();
            }
        }
        change
    }
}
