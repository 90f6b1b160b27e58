//! 8-node quads.

use super::shape::{QUAD8, bent, quad_rule};
use super::solid::Rule;
use super::{Axes, BadShape, Solid, Strains};
use crate::problem::Analysis;

/// 8-node quads of one group: corners counter-clockwise, then the middles of the sides that follow
/// them.
pub type Quad8 = Solid<8>;

impl Quad8 {
    /// Elements with `rule.0` × `rule.1` Gauss points along their first and second direction
    /// (from node 1 to node 2, from node 1 to node 4), in the given axes. Only 2 × 2 points can have
    /// projected strains; with a linear volume strain 3 points along bent sides, too.
    ///
    /// # Errors
    /// An element whose Jacobian is not positive.
    pub fn new(
        analysis: Analysis,
        coordinates: &[[f64; 2]],
        nodes: Vec<[usize; 8]>,
        axes: Vec<Axes>,
        strains: Strains,
        rule: impl Fn(usize) -> (usize, usize) + Sync,
    ) -> Result<Self, BadShape> {
        let rule = |element: usize| {
            let (n_xi, n_eta) = rule(element);
            Rule {
                points: quad_rule(n_xi, n_eta),
                along: [n_xi, n_eta],
                strains,
            }
        };
        Self::of_reference(&QUAD8, analysis, coordinates, nodes, axes, rule)
    }

    /// Whether the first and third side of a quad with these nodes, and the others, are clearly curved.
    pub fn bent(coordinates: &[[f64; 2]], nodes: [usize; 8]) -> [bool; 2] {
        bent(&nodes.map(|node| coordinates[node]))
    }
}
