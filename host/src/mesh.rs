//! Nodes, elements and named lines.

mod structured;

use crate::case::CaseFile;
use crate::error::{Error, Source, suggestion};
use indexmap::IndexMap;
use toml::Spanned;

/// An 8-node quad: corners counter-clockwise from the lower left, then the mid-sides bottom,
/// right, top, left.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Quad {
    /// Nodes.
    pub nodes: [usize; 8],
    /// Number of its group.
    pub group: usize,
}

/// Edges of a quad: first corner, second corner, mid-side, counter-clockwise.
pub const EDGES: [[usize; 3]; 4] = [[0, 1, 4], [1, 2, 5], [2, 3, 6], [3, 0, 7]];

/// A zero-thickness element of three double nodes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Joint {
    /// Ends and middle on the side of smaller coordinates.
    pub minus: [usize; 3],
    /// The same on the other side.
    pub plus: [usize; 3],
    /// Number of its group.
    pub group: usize,
}

/// A named line: edges of quads, or a single node.
#[derive(Clone, Debug, Default)]
pub struct Line {
    /// Edges, as number of the quad and number of its edge.
    pub edges: Vec<(usize, usize)>,
    /// Its nodes, each once.
    pub nodes: Vec<usize>,
}

/// A mesh in the plane.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Coordinates, m.
    pub nodes: Vec<[f64; 2]>,
    /// 8-node quads.
    pub quads: Vec<Quad>,
    /// Zero-thickness elements.
    pub joints: Vec<Joint>,
    /// Named lines.
    pub lines: IndexMap<String, Line>,
}

impl Mesh {
    /// The longer side of the rectangle that holds the mesh, in m.
    pub fn longer_side(&self) -> f64 {
        let extent = |c: usize| {
            let at = self.nodes.iter().map(|node| node[c]);
            let ends = at.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], at| {
                [low.min(at), high.max(at)]
            });
            ends[1] - ends[0]
        };
        extent(0).max(extent(1))
    }

    /// Builds the mesh of a case.
    ///
    /// # Errors
    /// [`Error::Input`] at the key that does not fit.
    pub fn build(source: &Source, file: &CaseFile) -> Result<Self, Error> {
        structured::build(source, file)
    }

    /// The line of this name.
    ///
    /// # Errors
    /// [`Error::Input`] with the names there are.
    pub fn line(&self, source: &Source, name: &Spanned<String>) -> Result<&Line, Error> {
        self.lines.get(name.get_ref()).ok_or_else(|| {
            source
                .error(
                    name.span(),
                    format!("there is no line `{}`", name.get_ref()),
                )
                .hint(suggestion(
                    name.get_ref(),
                    self.lines.keys().map(String::as_str).collect::<Vec<_>>(),
                ))
                .into()
        })
    }

    /// Nodes of an edge: first end, second end, middle.
    pub fn edge(&self, (quad, edge): (usize, usize)) -> [usize; 3] {
        EDGES[edge].map(|i| self.quads[quad].nodes[i])
    }
}
