//! 6-node triangles.

use super::shape::{TRI6, gauss_triangle};
use super::solid::RulePoint;
use super::{Axes, BadShape, Solid};
use crate::problem::Analysis;

/// 6-node triangles of one group: corners counter-clockwise, then the middles of the sides that
/// follow them.
pub type Tri6 = Solid<6>;

impl Tri6 {
    /// Elements with 3, 6 or 7 Gauss points, in the given axes.
    ///
    /// # Errors
    /// An element whose Jacobian is not positive.
    pub fn new(
        analysis: Analysis,
        coordinates: &[[f64; 2]],
        nodes: Vec<[usize; 6]>,
        axes: Vec<Axes>,
        n_points: usize,
    ) -> Result<Self, BadShape> {
        let points = |_: usize| {
            let rule = gauss_triangle(n_points).iter();
            let point = |&([xi, eta], weight): &([f64; 2], f64)| RulePoint {
                at: [xi, eta],
                weights: [weight, 1.0],
            };
            rule.map(point).collect()
        };
        Self::of_reference(&TRI6, analysis, coordinates, nodes, axes, points)
    }
}
