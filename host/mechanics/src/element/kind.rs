//! Kinds of solid elements. The program knows of a kind only what its [`Kind`] says. A new kind is a file with such
//! a table, and its name in [`Kind::ALL`].

use super::reference::Reference;
use super::solid::Solid;
use super::{Axes, BadShape, Kinematics, QUAD8, QUAD9, Strains, TRI6};
use crate::problem::{Analysis, Integration};
use std::fmt;

/// A kind of solid elements. Nodes are corners counter-clockwise, then the middles of the sides that follow them,
/// then nodes in the inside.
pub struct Kind {
    /// Its name.
    pub name: &'static str,
    /// Places of its nodes in the coordinates (ξ, η) of the element.
    pub places: &'static [[f64; 2]],
    /// Nodes of its edges: first corner, second corner, middle, counter-clockwise.
    pub edges: &'static [[usize; 3]],
    /// Number of this kind in Gmsh's files. Nodes have the same order there.
    pub gmsh: i64,
    /// Number of this kind of cell in VTK's files. Nodes have the same order there.
    pub vtk: u8,
    /// Integration points and strains of an element whose nodes lie at these places. `None`: it does not work with
    /// this integration.
    pub(crate) points: fn(Integration, &[[f64; 2]]) -> Option<Points>,
    /// Points where strains are most accurate.
    pub(crate) best: Points,
    /// Points that integrate squares of strains.
    pub(crate) fine: Points,
    /// How it is divided into four.
    pub(crate) division: fn() -> Division,
    /// Derivatives of (x, y) by ξ and by η at (ξ, η), of an element whose nodes lie at these places.
    pub(crate) tangents: Tangents,
    /// Elements of the kind.
    pub(crate) build: fn(Elements<'_>) -> Result<Box<dyn Kinematics>, BadShape>,
}

/// Derivatives of (x, y) by ξ and by η at a place, from places of nodes.
type Tangents = fn([f64; 2], &[[f64; 2]]) -> [[f64; 2]; 2];

/// Integration points of an element, and its strains there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Points {
    /// How many along ξ and along η; of a triangle, how many in all, and 1.
    pub(crate) along: [usize; 2],
    /// What becomes of the strains.
    pub(crate) strains: Strains,
}

impl Points {
    /// Strains at `xi` times `eta` points.
    pub(crate) const fn at(xi: usize, eta: usize) -> Self {
        Self {
            along: [xi, eta],
            strains: Strains::AtPoints,
        }
    }
}

/// Division of an element into four of its kind.
#[derive(Debug)]
pub(crate) struct Division {
    /// Nodes in the inside: each at a node of the element, and these parts of the ways from there to others.
    pub(crate) inside: Vec<(usize, Vec<(f64, usize)>)>,
    /// Nodes of the four parts: those at the corners in their order, of a triangle then the one in the middle.
    /// A part at a corner begins with it and goes round like the element.
    pub(crate) parts: Vec<Vec<Place>>,
}

/// Position of a node of a part in the whole element.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Place {
    /// At a node of the whole.
    Node(usize),
    /// In the middle of the half of a side (first) at one of its corners (second).
    Half(usize, usize),
    /// At a node in the inside of the [`Division`].
    Inside(usize),
}

/// Elements of one kind that are to be built.
pub(crate) struct Elements<'a> {
    pub(crate) analysis: Analysis,
    /// Coordinates of all nodes, m.
    pub(crate) coordinates: &'a [[f64; 2]],
    /// Nodes of each element.
    pub(crate) nodes: &'a [&'a [usize]],
    /// Axes of each element.
    pub(crate) axes: Vec<Axes>,
    /// Points of each element; all have as many, with the same strains.
    pub(crate) points: &'a (dyn Fn(usize) -> Points + Sync),
}

impl Elements<'_> {
    /// Elements with this reference.
    ///
    /// # Errors
    /// An element whose Jacobian is not positive.
    pub(super) fn of<const N: usize>(
        self,
        reference: &Reference<N>,
    ) -> Result<Box<dyn Kinematics>, BadShape> {
        Ok(Box::new(Solid::of_reference(reference, self)?))
    }
}

impl Kind {
    /// All kinds.
    pub const ALL: [&'static Self; 3] = [&TRI6, &QUAD8, &QUAD9];

    /// Most nodes of an element.
    pub const MOST_NODES: usize = 9;

    /// The kind with this many nodes.
    pub fn with_nodes(n: usize) -> Option<&'static Self> {
        Self::ALL.into_iter().find(|kind| kind.n_nodes() == n)
    }

    /// Number of nodes.
    pub const fn n_nodes(&self) -> usize {
        self.places.len()
    }

    /// Number of corners.
    pub const fn n_corners(&self) -> usize {
        self.edges.len()
    }

    /// Nodes in the middle between two faces, with the nodes on the faces on either side. `across` is the direction
    /// from face to face: 0 for ξ, 1 for η.
    pub(crate) fn between_faces(&self, across: usize) -> Vec<[usize; 3]> {
        let bits = |place: &[f64; 2]| place.map(|x| (x + 0.0).to_bits());
        let at = |place: [f64; 2]| self.places.iter().position(|own| bits(own) == bits(&place));
        let is_between = |place: &&[f64; 2]| place[across] == 0.0;
        let mut between: Vec<[f64; 2]> = self.places.iter().filter(is_between).copied().collect();
        between.sort_by(|a, b| a[1 - across].total_cmp(&b[1 - across]));
        let on_face = |place: [f64; 2], side: f64| {
            let mut face = place;
            face[across] = side;
            at(face)
        };
        let triple =
            |place: [f64; 2]| Some([at(place)?, on_face(place, -1.0)?, on_face(place, 1.0)?]);
        between.into_iter().filter_map(triple).collect()
    }
}

impl fmt::Debug for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name)
    }
}

impl PartialEq for Kind {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

impl Eq for Kind {}
