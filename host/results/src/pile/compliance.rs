//! The part of a pile's settlement that is the elastic slip of its joints, which belongs to no ground.

use super::{Pile, State};
use mechanics::group::Group;
use mechanics::problem::Formulation;

/// A law with these words in its description is a load transfer curve: its slip is that of the ground.
const TRANSFER: &str = "load transfer";

/// Whether the law of an interface is a load transfer curve.
pub(super) fn is_transfer(group: &Group) -> bool {
    let law = group.law.built.law.description();
    law.doc.to_lowercase().contains(TRANSFER)
}

impl Pile {
    /// Elastic slip of the joints under a unit friction, m/kPa, by span; `None` where no joint is, or one whose law is a
    /// load transfer curve or has no elastic operator.
    pub(super) fn compliance(&self, groups: &[Group]) -> Vec<Option<f64>> {
        let of_facet = |number: &usize| -> Option<f64> {
            let facet = &self.geometry.shaft[*number];
            let group = &groups[facet.group];
            let is_joint = group.formulation == Formulation::ZeroThickness;
            if !is_joint || !group.is_active || is_transfer(group) {
                return None;
            }
            let points = group.kinematics.points_of(facet.element);
            let stiffness = points.map(|point| group.elastic_operator(point).map(|d| d[3]));
            let stiffness: Vec<f64> = stiffness.collect::<Option<_>>()?;
            let n = stiffness.len() as f64;
            let mean = stiffness.iter().map(|k| 1.0 / k).sum::<f64>() / n;
            (mean.is_finite() && mean > 0.0).then_some(mean)
        };
        let of_span = |span: &super::rows::Span| -> Option<f64> {
            let all: Vec<f64> = span.facets.iter().map(of_facet).collect::<Option<_>>()?;
            (!all.is_empty()).then(|| all.iter().sum::<f64>() / all.len() as f64)
        };
        self.geometry.spans.iter().map(of_span).collect()
    }

    /// Mean elastic slip along the shaft since the last reset, m, in the direction of the head load.
    pub(super) fn elastic_slip(&self, state: &State, compliance: &[Option<f64>]) -> Option<f64> {
        let geometry = &self.geometry;
        let (mut sum, mut area) = (0.0, 0.0);
        for (row, station) in geometry.rows.iter().zip(&state.stations) {
            for &(span, part) in &row.at {
                let weight = geometry.spans[span].area * [1.0, 4.0, 1.0][part] / 6.0;
                if let (Some(compliance), Some(friction)) =
                    (compliance[span], station.shaft_friction_net)
                {
                    sum += weight * compliance * friction;
                    area += weight;
                }
            }
        }
        (area > 0.0).then(|| sum / area)
    }
}
