//! Uniform refinement: every element into four of its kind.
//!
//! New nodes lie on the element's own map, which takes the quadratic parts of an element onto
//! themselves: the finer mesh has the very shape of the coarser one, curved sides included.

use super::{Line, Mesh, Solid};
use crate::element::kind::Place;

/// A side that is halved: its nodes, and the middles of its two halves.
#[derive(Clone, Copy, Debug)]
struct Halves {
    /// The end that the first half has.
    first: usize,
    /// Middle of the half at that end, and of the other one.
    middles: [usize; 2],
}

impl Mesh {
    /// The mesh with every triangle and quad divided into four. Nodes keep their numbers, new ones
    /// come after them; the parts of the element `n` are the elements from `4 n` on. Lines and points
    /// keep their names. Takes time in proportion to the size of the mesh.
    ///
    /// Zero-thickness elements are inserted afterwards: the finer mesh does not contain them.
    #[must_use]
    pub fn refined(&self) -> Self {
        let mut nodes = self.nodes.clone();
        // By the node in its middle, which belongs to no other side.
        let mut halves: Vec<Option<Halves>> = vec![None; self.nodes.len()];
        let mut solids = Vec::with_capacity(4 * self.solids.len());
        for solid in &self.solids {
            let sides = solid.edges().map(|[a, b, middle]| {
                *halves[middle].get_or_insert_with(|| {
                    let [p, q, m] = [a, b, middle].map(|node| self.nodes[node]);
                    let middles = [(p, q), (q, p)].map(|(near, far)| {
                        // Quadratic, a quarter of the way: 3/8, −1/8 and 3/4 of the nodes.
                        push(&mut nodes, m, &[(0.375, near), (-0.125, far)])
                    });
                    Halves { first: a, middles }
                })
            });
            let sides: Vec<Halves> = sides.collect();
            divide(solid, &sides, &mut nodes, &mut solids);
        }
        let mut finer = Self {
            nodes,
            solids,
            joints: Vec::new(),
            lines: indexmap::IndexMap::with_capacity(self.lines.len()),
        };
        let mut known = vec![false; finer.nodes.len()];
        for (name, line) in &self.lines {
            let line = finer.halved(line, &mut known);
            finer.lines.insert(name.clone(), line);
        }
        finer
    }

    /// A line of the coarser mesh in this one, which is finer. `known` is all false, before and
    /// after.
    fn halved(&self, line: &Line, known: &mut [bool]) -> Line {
        if line.edges.is_empty() {
            return line.clone();
        }
        let mut edges = Vec::with_capacity(2 * line.edges.len());
        for &(solid, edge) in &line.edges {
            // The part at a corner has the first half of the side that starts there, and the second
            // half of the one that ends there, which is its last.
            let n_corners = self.solids[4 * solid].n_corners();
            let next = (edge + 1) % n_corners;
            edges.push((4 * solid + edge, 0));
            edges.push((4 * solid + next, n_corners - 1));
        }
        let mut nodes = Vec::new();
        for &edge in &edges {
            for node in self.edge(edge) {
                if !std::mem::replace(&mut known[node], true) {
                    nodes.push(node);
                }
            }
        }
        for &node in &nodes {
            known[node] = false;
        }
        Line { edges, nodes }
    }
}

/// Adds a node at `base` and these parts of the ways from there. If all are at one coordinate, so
/// is the node, to the last bit.
fn push(nodes: &mut Vec<[f64; 2]>, base: [f64; 2], parts: &[(f64, [f64; 2])]) -> usize {
    let at = [0, 1].map(|c| {
        let ways = parts.iter().map(|(part, to)| part * (to[c] - base[c]));
        base[c] + ways.sum::<f64>()
    });
    nodes.push(at);
    nodes.len() - 1
}

/// Adds the four parts of an element.
fn divide(solid: &Solid, sides: &[Halves], nodes: &mut Vec<[f64; 2]>, into: &mut Vec<Solid>) {
    let own = solid.nodes();
    let at: Vec<[f64; 2]> = own.iter().map(|&node| nodes[node]).collect();
    let division = (solid.kind().division)();
    let mut add = |(base, parts): (usize, Vec<(f64, usize)>)| {
        let parts: Vec<(f64, [f64; 2])> = parts.iter().map(|&(part, to)| (part, at[to])).collect();
        push(nodes, at[base], &parts)
    };
    let inside: Vec<usize> = division.inside.into_iter().map(&mut add).collect();
    let number = |place: &Place| match *place {
        Place::Node(node) => own[node],
        Place::Half(side, corner) => {
            let Halves { first, middles } = sides[side];
            middles[usize::from(first != own[corner])]
        }
        Place::Inside(node) => inside[node],
    };
    for part in division.parts {
        let nodes: Vec<usize> = part.iter().map(number).collect();
        into.push(Solid::new(solid.kind(), &nodes, solid.group));
    }
}

#[cfg(test)]
#[path = "refine/tests.rs"]
mod tests;
