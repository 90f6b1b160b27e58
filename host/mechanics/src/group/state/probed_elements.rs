//! Some elements of a linear group, moved on while the others stay where they are.

use crate::element::Kinematics;
use crate::group::Group;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Strains and stresses of some elements.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Excerpted {
    strain: Vec<f64>,
    stress: Vec<f64>,
}

impl Group {
    /// Some elements alone; `None` if they cannot be had: the law is not linear with one tangent for all, or there
    /// is more to them than strains and stresses.
    pub fn excerpt(&self, elements: &[usize]) -> Option<Box<dyn Kinematics>> {
        let has_more = self.layer.is_some()
            || self.pores.is_some()
            || !self.correction.is_empty()
            || !self.internal.committed.is_empty();
        if !self.tangents.are_constant || has_more {
            return None;
        }
        self.kinematics.only(elements)
    }

    /// Places of elements in the fields of strains and stresses.
    pub(in crate::group) fn places(
        &self,
        elements: &[usize],
    ) -> impl Iterator<Item = Range<usize>> {
        let n = self.kinematics.n_components();
        let points = elements.iter().map(|&e| self.kinematics.points_of(e));
        points.map(move |points| points.start * n..points.end * n)
    }

    /// Strains and stresses of some elements (committed).
    pub fn excerpted(&self, elements: &[usize]) -> Excerpted {
        let of = |values: &[f64]| -> Vec<f64> {
            let places = self.places(elements);
            places.flat_map(|own| values[own].to_vec()).collect()
        };
        Excerpted {
            strain: of(&self.strain.committed),
            stress: of(&self.stress.committed),
        }
    }

    /// Gives some elements other strains and stresses.
    pub fn put_excerpted(&mut self, elements: &[usize], values: &Excerpted) {
        let places: Vec<Range<usize>> = self.places(elements).collect();
        let fields = [
            (&mut self.strain.committed, &values.strain),
            (&mut self.stress.committed, &values.stress),
        ];
        for (to, mut from) in fields.map(|(to, from)| (to, from.as_slice())) {
            for own in &places {
                let (first, rest) = from.split_at(own.len());
                to[own.clone()].copy_from_slice(first);
                from = rest;
            }
        }
    }

    /// Moves some elements on by displacement increments (two per node), with what [`Self::excerpt`] gave of them: σ +=
    /// D Δε. Their nodal forces are added, by degree of freedom.
    pub fn move_excerpt(
        &mut self,
        (elements, kinematics): (&[usize], &dyn Kinematics),
        increment: &[f64],
        forces: &mut [f64],
    ) {
        let n = self.kinematics.n_components();
        let mut moved = self.excerpted(elements);
        let mut strain = vec![0.0; moved.strain.len()];
        kinematics.add_gradients(increment, &mut strain);
        let points = moved.strain.chunks_exact_mut(n).zip(strain.chunks_exact(n));
        for ((own, change), stress) in points.zip(moved.stress.chunks_exact_mut(n)) {
            for (i, stress) in stress.iter_mut().enumerate() {
                let row = &self.tangents.values[i * n..][..n];
                *stress += row.iter().zip(change).map(|(d, e)| d * e).sum::<f64>();
                own[i] += change[i];
            }
        }
        kinematics.add_forces(&moved.stress, forces);
        self.put_excerpted(elements, &moved);
    }
}
