//! Nodes, elements and named lines.

mod insert;
mod refine;
mod shape;

pub use insert::{Along, CannotInsert, Reason};

use crate::element::{Kind, QUAD8, TRI6};
use indexmap::IndexMap;

/// A solid element.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Solid {
    /// Those that the kind has not are zero.
    nodes: [usize; Kind::MOST_NODES],
    kind: &'static Kind,
    /// Number of its group.
    pub group: usize,
}

impl Solid {
    /// An element of a kind. It takes the first nodes of `nodes`, in the order of the kind.
    pub fn new(kind: &'static Kind, nodes: &[usize], group: usize) -> Self {
        let mut own = [0; Kind::MOST_NODES];
        own[..kind.n_nodes()].copy_from_slice(&nodes[..kind.n_nodes()]);
        Self {
            nodes: own,
            kind,
            group,
        }
    }

    /// An 8-node quad.
    pub fn quad(nodes: [usize; 8], group: usize) -> Self {
        Self::new(&QUAD8, &nodes, group)
    }

    /// A 6-node triangle.
    pub fn triangle(nodes: [usize; 6], group: usize) -> Self {
        Self::new(&TRI6, &nodes, group)
    }

    /// Its kind.
    pub fn kind(&self) -> &'static Kind {
        self.kind
    }

    /// Number of corners.
    pub fn n_corners(&self) -> usize {
        self.kind.n_corners()
    }

    /// Its nodes: corners counter-clockwise, then the mid-sides that follow them, then those inside.
    pub fn nodes(&self) -> &[usize] {
        &self.nodes[..self.kind.n_nodes()]
    }

    /// Its nodes, to be replaced by others at the same places.
    pub fn nodes_mut(&mut self) -> &mut [usize] {
        &mut self.nodes[..self.kind.n_nodes()]
    }

    /// Its corners.
    pub fn corners(&self) -> &[usize] {
        &self.nodes[..self.n_corners()]
    }

    /// Nodes of its edges: first corner, second corner, mid-side, counter-clockwise.
    pub fn edges(&self) -> impl Iterator<Item = [usize; 3]> + use<'_> {
        let edges = self.kind.edges.iter();
        edges.map(|edge| edge.map(|i| self.nodes[i]))
    }

    /// The same element with its nodes the other way round, from the same first corner.
    #[must_use]
    pub fn reversed(&self) -> Self {
        let n = self.n_corners();
        let mut reversed = *self;
        reversed.nodes[1..n].reverse();
        reversed.nodes[n..2 * n].reverse();
        reversed
    }
}

/// A zero-thickness element of three double nodes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Joint {
    /// Ends and middle on the side of smaller coordinates; from the first end to the second, too,
    /// coordinates grow (both as [`Axes::of_facet`](crate::element::Axes::of_facet) says it).
    pub minus: [usize; 3],
    /// The same on the other side.
    pub plus: [usize; 3],
    /// Number of its group.
    pub group: usize,
}

/// A named line of any course: edges of solids, or a single node.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Line {
    /// Edges, as number of the solid and number of its edge.
    pub edges: Vec<(usize, usize)>,
    /// Its nodes, each once.
    pub nodes: Vec<usize>,
}

/// A mesh in the plane.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Coordinates, m.
    pub nodes: Vec<[f64; 2]>,
    /// Solid elements.
    pub solids: Vec<Solid>,
    /// Zero-thickness elements.
    pub joints: Vec<Joint>,
    /// Named lines.
    pub lines: IndexMap<String, Line>,
}

impl Mesh {
    /// A place moved towards the middle of a solid, by this part of the way.
    pub(crate) fn towards_middle(&self, solid: &Solid, at: [f64; 2], part: f64) -> [f64; 2] {
        let n = solid.n_corners() as f64;
        [0, 1].map(|c| {
            let corners = solid.corners().iter().map(|&node| self.nodes[node][c]);
            at[c] + part * (corners.sum::<f64>() / n - at[c])
        })
    }

    /// Quads between the lines of a grid, row by row from the smallest coordinates. `group` gives the
    /// group of each by its column and row. Both lists rise, m; of a list with less than two there is no
    /// element between them, and no node.
    pub fn grid(x: &[f64], y: &[f64], group: impl Fn(usize, usize) -> usize) -> Self {
        if x.len() < 2 || y.len() < 2 {
            return Self::default();
        }
        let (n_columns, n_rows) = (x.len() - 1, y.len() - 1);
        let with_middles = |grid: &[f64]| -> Vec<f64> {
            let pairs = grid
                .windows(2)
                .flat_map(|w| [w[0], f64::midpoint(w[0], w[1])]);
            pairs.chain([grid[grid.len() - 1]]).collect()
        };
        let (fine_x, fine_y) = (with_middles(x), with_middles(y));
        // Nodes are numbered row by row, mid-sides included.
        let mut number = vec![usize::MAX; fine_x.len() * fine_y.len()];
        let mut mesh = Self::default();
        for (j, &y) in fine_y.iter().enumerate() {
            for (i, &x) in fine_x.iter().enumerate() {
                if i % 2 == 0 || j % 2 == 0 {
                    number[j * fine_x.len() + i] = mesh.nodes.len();
                    mesh.nodes.push([x, y]);
                }
            }
        }
        for row in 0..n_rows {
            for column in 0..n_columns {
                let at = |i: usize, j: usize| number[(2 * row + j) * fine_x.len() + 2 * column + i];
                let corners = [at(0, 0), at(2, 0), at(2, 2), at(0, 2)];
                let [a, b, c, d] = corners;
                let nodes = [a, b, c, d, at(1, 0), at(2, 1), at(1, 2), at(0, 1)];
                mesh.solids.push(Solid::quad(nodes, group(column, row)));
            }
        }
        mesh
    }

    /// The longer side of the rectangle that holds the mesh, in m; 0 without nodes.
    pub fn longer_side(&self) -> f64 {
        let extent = |c: usize| {
            let at = self.nodes.iter().map(|node| node[c]);
            let ends = at.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], at| {
                [low.min(at), high.max(at)]
            });
            ends[1] - ends[0]
        };
        extent(0).max(extent(1)).max(0.0)
    }

    /// Nodes of an edge: first end, second end, middle.
    pub fn edge(&self, (solid, edge): (usize, usize)) -> [usize; 3] {
        let solid = &self.solids[solid];
        solid.kind.edges[edge].map(|i| solid.nodes[i])
    }

    /// Names a line after the edges that are chosen, of all elements in order.
    ///
    /// An edge is chosen by the coordinates of its ends and middle. Inner edges count once.
    pub fn name_line(
        &mut self,
        name: impl Into<String>,
        is_chosen: impl Fn([[f64; 2]; 3]) -> bool,
    ) {
        let mut line = Line::default();
        let mut seen = std::collections::HashSet::new();
        let mut known = std::collections::HashSet::new();
        for (number, solid) in self.solids.iter().enumerate() {
            for (edge, nodes) in solid.edges().enumerate() {
                if is_chosen(nodes.map(|node| self.nodes[node])) && seen.insert(nodes[2]) {
                    line.edges.push((number, edge));
                    let own = nodes.into_iter().filter(|&node| known.insert(node));
                    line.nodes.extend(own);
                }
            }
        }
        self.lines.insert(name.into(), line);
    }
}
