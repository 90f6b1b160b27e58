//! Types of elements in Gmsh's numbering.

/// An element that a mesh may have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Point,
    /// Two ends.
    Line2,
    /// Two ends and the middle.
    Line3,
    Triangle3,
    Triangle6,
    Quad4,
    Quad8,
    /// Corners, middles of the sides, and the middle of it all, which the mesh leaves out.
    Quad9,
}

/// Most nodes of an element in a file.
pub(super) const MOST_NODES: usize = 9;

impl Kind {
    /// The type with this number.
    ///
    /// # Errors
    /// The name of another kind, and the kinds that are read.
    pub(super) fn of(number: i64) -> Result<Self, String> {
        let name = match number {
            15 => return Ok(Self::Point),
            1 => return Ok(Self::Line2),
            8 => return Ok(Self::Line3),
            2 => return Ok(Self::Triangle3),
            9 => return Ok(Self::Triangle6),
            3 => return Ok(Self::Quad4),
            16 => return Ok(Self::Quad8),
            10 => return Ok(Self::Quad9),
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
            Self::Line3 | Self::Triangle3 => 3,
            Self::Quad4 => 4,
            Self::Triangle6 => 6,
            Self::Quad8 => 8,
            Self::Quad9 => 9,
        }
    }

    /// Number of those nodes that the mesh takes, the first ones.
    pub(super) fn n_taken(self) -> usize {
        match self {
            Self::Quad9 => 8,
            _ => self.n_nodes(),
        }
    }

    /// Number of corners of a triangle or quad.
    pub(super) fn n_corners(self) -> usize {
        match self {
            Self::Triangle3 | Self::Triangle6 => 3,
            _ => 4,
        }
    }

    /// Whether its sides have no nodes in their middles.
    pub(super) fn is_first_order(self) -> bool {
        matches!(self, Self::Line2 | Self::Triangle3 | Self::Quad4)
    }

    /// 0 of a point, 1 of a line, 2 of a triangle or quad.
    pub(super) fn dimension(self) -> u8 {
        match self {
            Self::Point => 0,
            Self::Line2 | Self::Line3 => 1,
            _ => 2,
        }
    }
}
