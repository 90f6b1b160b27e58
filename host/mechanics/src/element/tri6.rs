//! 6-node triangles.

use super::shape::{TRI6, triangle_rule};
use super::solid::Rule;
use super::{Axes, BadShape, Solid, Strains};
use crate::problem::Analysis;

/// 6-node triangles of one group: corners counter-clockwise, then the middles of the sides that
/// follow them.
pub type Tri6 = Solid<6>;

impl Tri6 {
    /// Elements with 3, 6 or 7 Gauss points, in the given axes. Only 3 points can have projected strains.
    ///
    /// # Errors
    /// An element whose Jacobian is not positive.
    pub fn new(
        analysis: Analysis,
        coordinates: &[[f64; 2]],
        nodes: Vec<[usize; 6]>,
        axes: Vec<Axes>,
        strains: Strains,
        n_points: usize,
    ) -> Result<Self, BadShape> {
        let rule = |_: usize| Rule {
            points: triangle_rule(n_points),
            along: [0; 2],
            strains,
        };
        Self::of_reference(&TRI6, analysis, coordinates, nodes, axes, rule)
    }
}
