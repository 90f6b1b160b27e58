//! The outer forces on a pile, divided among its head, shaft and base.

use super::Held;
use super::geometry::{Facet, Geometry};
use mechanics::simulation::Snapshot;
use std::collections::{HashMap, HashSet};

/// Upward force that an element of the shaft takes of the pile, and what its own tractions exert.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pressed {
    pub(super) force: f64,
    pub(super) own: f64,
}

/// The outer forces on the pile, divided among head, shaft and base.
pub(super) struct Split<'g> {
    pub(super) head: f64,
    pub(super) shaft: f64,
    pub(super) base: f64,
    /// Upward force of every element of the shaft, in their order.
    pub(super) segments: Vec<Pressed>,
    facets: &'g [Facet],
    /// Node and upward force of all that is neither head, shaft nor base.
    others: Vec<(usize, f64)>,
}

impl<'g> Split<'g> {
    /// `held`: in the order of the shaft's elements.
    pub(super) fn new(
        geometry: &'g Geometry,
        held: &[Held<'g>],
        outer: impl Fn(usize) -> f64,
    ) -> Self {
        let head: HashSet<usize> = geometry.head.iter().copied().collect();
        let base: HashSet<usize> = geometry.base.iter().copied().collect();
        // Of every node of the shaft: what its elements exert, and their area.
        let mut at_nodes: HashMap<usize, [f64; 2]> = HashMap::new();
        for Held { facet, forces } in held {
            for (node, force) in facet.nodes.iter().zip(forces) {
                let at_node = at_nodes.entry(*node).or_default();
                at_node[0] += force;
                at_node[1] += facet.area;
            }
        }
        let segment = |Held { facet, forces }: &Held<'g>| {
            let of_node = |(node, force): (&usize, &f64)| {
                if head.contains(node) || base.contains(node) {
                    return *force;
                }
                // What the elements leave of it is shared by their areas.
                let [sum, area] = at_nodes[node];
                force + (outer(*node) - sum) * facet.area / area
            };
            Pressed {
                force: facet.nodes.iter().zip(forces).map(of_node).sum(),
                own: forces.iter().sum(),
            }
        };
        let segments: Vec<Pressed> = held.iter().map(segment).collect();
        let others: Vec<(usize, f64)> = geometry
            .others
            .iter()
            .map(|&node| (node, outer(node)))
            .collect();
        let left = |node: &usize| outer(*node) - at_nodes.get(node).map_or(0.0, |[sum, _]| *sum);
        let of_base = geometry.base.iter().filter(|node| !head.contains(node));
        Self {
            head: -geometry.head.iter().map(left).sum::<f64>(),
            base: of_base.map(left).sum(),
            shaft: segments.iter().map(|of| of.force).sum::<f64>()
                + others.iter().map(|(_, force)| force).sum::<f64>(),
            segments,
            facets: &geometry.shaft,
            others,
        }
    }

    /// What holds the pile above z, between head and base.
    pub(super) fn above(&self, z: f64, snapshot: &Snapshot<'_>) -> f64 {
        let part = |(facet, pressed): (&Facet, &Pressed)| {
            let [low, high] = facet.z;
            let above = if high > low {
                ((high - z) / (high - low)).clamp(0.0, 1.0)
            } else {
                f64::from(high > z)
            };
            // Stations stand at the ends of elements, but for round-off.
            let above = if above < 1e-9 {
                0.0
            } else if above > 1.0 - 1e-9 {
                1.0
            } else {
                above
            };
            pressed.force * above
        };
        let others = self.others.iter();
        let others = others.filter(|(node, _)| snapshot.mesh.nodes[*node][1] > z);
        self.facets
            .iter()
            .zip(&self.segments)
            .map(part)
            .sum::<f64>()
            + others.map(|(_, force)| force).sum::<f64>()
    }
}
