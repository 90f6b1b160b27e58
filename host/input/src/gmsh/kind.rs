//! Types of elements in Gmsh's numbering.

use mechanics::element::{Kind as Solid, QUAD8, TRI6};

/// An element that a mesh may have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Point,
    /// Two ends.
    Line2,
    /// Two ends and the middle.
    Line3,
    /// The corners of such a solid element.
    Corners(&'static Solid),
    /// All its nodes.
    Solid(&'static Solid),
}

/// Most nodes of an element in a file.
pub(super) const MOST_NODES: usize = Solid::MOST_NODES;

impl Kind {
    /// The type with this number.
    ///
    /// # Errors
    /// The name of another kind, and the kinds that are read.
    pub(super) fn of(number: i64) -> Result<Self, String> {
        if let Some(solid) = Solid::ALL.into_iter().find(|kind| kind.gmsh == number) {
            return Ok(Self::Solid(solid));
        }
        let name = match number {
            15 => return Ok(Self::Point),
            1 => return Ok(Self::Line2),
            8 => return Ok(Self::Line3),
            2 => return Ok(Self::Corners(&TRI6)),
            3 => return Ok(Self::Corners(&QUAD8)),
            4 | 11 | 29 | 30 | 31 | 71..=75 | 79..=83 | 137 => "a tetrahedron",
            5 | 12 | 17 | 92..=98 | 99..=105 => "a hexahedron",
            6 | 13 | 18 | 90 | 91 | 106..=117 => "a prism",
            7 | 14 | 19 | 118..=131 => "a pyramid",
            26..=28 | 62..=66 => "a line of higher order",
            20..=25 | 42..=46 | 52..=61 => "a triangle of higher order",
            36..=41 | 47..=51 => "a quad of higher order",
            _ => "unknown",
        };
        Err(format!(
            "an element of type {number} is {name}; a mesh has triangles, quads, lines and points, of \
             first or second order, in a plane"
        ))
    }

    /// Number of nodes in the file.
    pub(super) fn n_nodes(self) -> usize {
        match self {
            Self::Point => 1,
            Self::Line2 => 2,
            Self::Line3 => 3,
            Self::Corners(solid) => solid.n_corners(),
            Self::Solid(solid) => solid.n_nodes(),
        }
    }

    /// The solid element that it becomes.
    pub(super) fn solid(self) -> Option<&'static Solid> {
        match self {
            Self::Corners(solid) | Self::Solid(solid) => Some(solid),
            _ => None,
        }
    }

    /// Whether its sides have no nodes in their middles.
    pub(super) fn is_first_order(self) -> bool {
        matches!(self, Self::Line2 | Self::Corners(_))
    }

    /// 0 of a point, 1 of a line, 2 of a triangle or quad.
    pub(super) fn dimension(self) -> u8 {
        match self {
            Self::Point => 0,
            Self::Line2 | Self::Line3 => 1,
            Self::Corners(_) | Self::Solid(_) => 2,
        }
    }
}
