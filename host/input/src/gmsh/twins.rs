//! Nodes that lie at one place and are not one, and elements there that lie on each other.

use super::assemble::NOTHING;
use mechanics::mesh::{Mesh, Solid};
use std::collections::{BTreeMap, HashMap};

/// What is at places of several nodes.
pub(super) struct Twins {
    /// Number of nodes that lie where another one does.
    pub(super) n: usize,
    /// The place of the first one.
    pub(super) first: [f64; 2],
    /// The first two solids, by number, that have a node at such a place and lie on each other.
    pub(super) upon: Option<[usize; 2]>,
}

/// Looks for such nodes; `None` without any.
pub(super) fn twins(mesh: &Mesh) -> Option<Twins> {
    let size = mesh.longer_side();
    let grain = if size > 0.0 { NOTHING * size } else { 1.0 };
    let mut known = HashMap::new();
    let key = |node: &[f64; 2]| node.map(|c| (c / grain).round() as i64);
    let place = |(number, node)| *known.entry(key(node)).or_insert(number);
    let places: Vec<usize> = mesh.nodes.iter().enumerate().map(place).collect();
    let others: Vec<usize> = (0..places.len()).filter(|&n| places[n] != n).collect();
    let first = mesh.nodes[*others.first()?];
    let mut around: BTreeMap<usize, Vec<usize>> = others
        .iter()
        .map(|&node| (places[node], Vec::new()))
        .collect();
    for (number, solid) in mesh.solids.iter().enumerate() {
        for &node in solid.nodes() {
            around
                .entry(places[node])
                .and_modify(|there| there.push(number));
        }
    }
    let mut upon = around.values().filter_map(|there| {
        let pairs = there
            .iter()
            .flat_map(|a| there.iter().map(move |b| [*a, *b]));
        let mut pairs = pairs.filter(|[a, b]| a < b);
        pairs.find(|pair| lie_on_each_other(mesh, pair.map(|number| &mesh.solids[number])))
    });
    Some(Twins {
        n: others.len(),
        first,
        upon: upon.next(),
    })
}

/// Whether the middle of one is inside the other.
fn lie_on_each_other(mesh: &Mesh, [a, b]: [&Solid; 2]) -> bool {
    let is_inside = |inner: &Solid, outer: &Solid| {
        let n = inner.n_corners() as f64;
        let corners = || inner.corners().iter().map(|&node| mesh.nodes[node]);
        let middle = [0, 1].map(|c| corners().map(|at| at[c]).sum::<f64>() / n);
        outer.edges().all(|[from, to, _]| {
            let [from, to] = [from, to].map(|node| mesh.nodes[node]);
            let along = [0, 1].map(|c| to[c] - from[c]);
            along[0] * (middle[1] - from[1]) - along[1] * (middle[0] - from[0]) > 0.0
        })
    };
    is_inside(a, b) || is_inside(b, a)
}
