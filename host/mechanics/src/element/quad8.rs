//! 8-node quads.

use super::shape::{QUAD8, gauss};
use super::solid::RulePoint;
use super::{Axes, BadShape, Solid};
use crate::problem::Analysis;

/// 8-node quads of one group: corners counter-clockwise, then the middles of the sides that follow
/// them.
pub type Quad8 = Solid<8>;

impl Quad8 {
    /// Elements with `rule.0` × `rule.1` Gauss points along their first and second direction
    /// (from node 1 to node 2, from node 1 to node 4), in the given axes.
    ///
    /// # Errors
    /// An element whose Jacobian is not positive.
    pub fn new(
        analysis: Analysis,
        coordinates: &[[f64; 2]],
        nodes: Vec<[usize; 8]>,
        axes: Vec<Axes>,
        rule: impl Fn(usize) -> (usize, usize),
    ) -> Result<Self, BadShape> {
        let points = |element: usize| {
            let (n_xi, n_eta) = rule(element);
            let ((xi, w_xi), (eta, w_eta)) = (gauss(n_xi), gauss(n_eta));
            let mut points = Vec::with_capacity(n_xi * n_eta);
            for (&eta, &w_eta) in eta.iter().zip(w_eta) {
                for (&xi, &w_xi) in xi.iter().zip(w_xi) {
                    points.push(RulePoint {
                        at: [xi, eta],
                        weights: [w_xi, w_eta],
                    });
                }
            }
            points
        };
        Self::of_reference(&QUAD8, analysis, coordinates, nodes, axes, points)
    }
}
