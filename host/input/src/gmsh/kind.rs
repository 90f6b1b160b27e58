//! Types of elements in Gmsh's numbering.

/// An element that a mesh may have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Point,
    Line,
    Triangle,
    Quad,
}

/// What makes elements of first order into those that are read.
const SECOND_ORDER: &str = "set `Mesh.ElementOrder = 2` and `Mesh.SecondOrderIncomplete = 1` in \
                            Gmsh";

impl Kind {
    /// The type with this number.
    ///
    /// # Errors
    /// What it is instead, and what to do about it.
    pub(super) fn of(number: i64) -> Result<Self, String> {
        let (name, mends) = match number {
            15 => return Ok(Self::Point),
            8 => return Ok(Self::Line),
            9 => return Ok(Self::Triangle),
            16 => return Ok(Self::Quad),
            1 => ("a line of 2 nodes", Some(SECOND_ORDER)),
            2 => ("a triangle of 3 nodes", Some(SECOND_ORDER)),
            3 => ("a quad of 4 nodes", Some(SECOND_ORDER)),
            10 => (
                "a quad of 9 nodes",
                Some("set `Mesh.SecondOrderIncomplete = 1` in Gmsh for quads of 8"),
            ),
            4 | 11 | 29 | 30 | 31 | 71..=75 | 79..=83 | 137 => ("a tetrahedron", None),
            5 | 12 | 17 | 92..=98 | 99..=105 => ("a hexahedron", None),
            6 | 13 | 18 | 90 | 91 | 106..=117 => ("a prism", None),
            7 | 14 | 19 | 118..=131 => ("a pyramid", None),
            26..=28 | 62..=66 => ("a line of higher order", None),
            20..=25 | 42..=46 | 52..=61 => ("a triangle of higher order", None),
            36..=41 | 47..=51 => ("a quad of higher order", None),
            _ => ("unknown", None),
        };
        let mends = mends.map_or_else(
            || {
                "a mesh has triangles of 6 nodes, quads of 8, lines of 3 and points, in a plane"
                    .to_owned()
            },
            str::to_owned,
        );
        Err(format!("an element of type {number} is {name}; {mends}"))
    }

    /// Number of nodes.
    pub(super) fn n_nodes(self) -> usize {
        match self {
            Self::Point => 1,
            Self::Line => 3,
            Self::Triangle => 6,
            Self::Quad => 8,
        }
    }

    /// 0 of a point, 1 of a line, 2 of a triangle or quad.
    pub(super) fn dimension(self) -> u8 {
        match self {
            Self::Point => 0,
            Self::Line => 1,
            Self::Triangle | Self::Quad => 2,
        }
    }
}
