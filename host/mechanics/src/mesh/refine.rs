//! Uniform refinement: every element into four of its kind.
//!
//! New nodes lie on the element's own map, which takes the quadratic parts of an element onto
//! themselves: the finer mesh has the very shape of the coarser one, curved sides included.

use super::{Line, Mesh, Shape, Solid};

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

/// Adds the four parts of an element: those at its corners in their order, of a triangle then the one
/// in the middle. A part at a corner begins with it and goes round like the element.
fn divide(solid: &Solid, sides: &[Halves], nodes: &mut Vec<[f64; 2]>, into: &mut Vec<Solid>) {
    let n = solid.n_corners();
    let (corners, middles) = solid.nodes().split_at(n);
    // The middle of the half of a side that has this end.
    let half = |side: usize, end: usize| {
        let Halves { first, middles } = sides[side];
        middles[usize::from(first != end)]
    };
    let place: Vec<[f64; 2]> = solid.nodes().iter().map(|&node| nodes[node]).collect();
    match solid.shape() {
        Shape::Triangle => {
            // Of the inner side across corner k, between the middles of the sides next to it.
            let inner = [0, 1, 2].map(|k| {
                let [before, after, across] = [(k + 2) % 3, k, (k + 1) % 3].map(|s| place[3 + s]);
                let others = [place[(k + 1) % 3], place[(k + 2) % 3]];
                // −1/8 of the corners beside, 1/2 of the middles beside, 1/4 of the one across.
                let parts = [
                    (0.5, before),
                    (0.25, across),
                    (-0.125, others[0]),
                    (-0.125, others[1]),
                ];
                push(nodes, after, &parts)
            });
            for k in 0..3 {
                let before = (k + 2) % 3;
                let part = [
                    corners[k],
                    middles[k],
                    middles[before],
                    half(k, corners[k]),
                    inner[k],
                    half(before, corners[k]),
                ];
                into.push(Solid::triangle(part, solid.group));
            }
            let part = [
                middles[0], middles[1], middles[2], inner[1], inner[2], inner[0],
            ];
            into.push(Solid::triangle(part, solid.group));
        }
        Shape::Quad => {
            let base = place[4];
            let centre = [
                (0.5, place[5]),
                (0.5, place[6]),
                (0.5, place[7]),
                (-0.25, place[0]),
                (-0.25, place[1]),
                (-0.25, place[2]),
                (-0.25, place[3]),
            ];
            let centre = push(nodes, base, &centre);
            // Half way from the middle of side k to the centre.
            let inner = [0, 1, 2, 3].map(|k| {
                let side = |s: usize| place[4 + (k + s) % 4];
                let corner = |s: usize| place[(k + s) % 4];
                let parts = [
                    (0.375, side(1)),
                    (0.25, side(2)),
                    (0.375, side(3)),
                    (-0.1875, corner(0)),
                    (-0.1875, corner(1)),
                    (-0.1875, corner(2)),
                    (-0.1875, corner(3)),
                ];
                push(nodes, side(0), &parts)
            });
            for k in 0..4 {
                let before = (k + 3) % 4;
                let part = [
                    corners[k],
                    middles[k],
                    centre,
                    middles[before],
                    half(k, corners[k]),
                    inner[k],
                    inner[before],
                    half(before, corners[k]),
                ];
                into.push(Solid::quad(part, solid.group));
            }
        }
    }
}

#[cfg(test)]
#[path = "refine/tests.rs"]
mod tests;
