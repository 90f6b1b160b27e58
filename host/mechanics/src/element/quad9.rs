//! 9-node quads: the 8-node quad and a node in the middle, with all products of quadratic polynomials.

use super::kind::{Division, Kind, Place, Points};
use super::reference::{EDGES_OF_QUAD, Functions, Reference, area_of_quad, line_shape, quad_rule};
use super::solid::Strains;
use crate::problem::Integration;

/// 9-node quads, ξ and η from −1 to 1.
pub static QUAD9: Kind = Kind {
    name: "QUAD9",
    places: &PLACES,
    edges: &EDGES_OF_QUAD,
    gmsh: 10,
    vtk: 28,
    // With 2 × 2 points three motions of the nodes strain nothing. With 3 × 3 and a volume strain that is linear it does
    // not lock (the pair Q2–P1 of incompressible flow).
    points: |integration, _| match integration {
        Integration::Reduced => None,
        Integration::BBar | Integration::Projected => Some(Points {
            along: [3, 3],
            strains: Strains::LinearVolume,
        }),
        _ => Some(Points::at(3, 3)),
    },
    best: Points::at(2, 2),
    fine: Points::at(3, 3),
    division,
    tangents: |at, places| REFERENCE.tangents(at, places),
    build: |elements| elements.of(&REFERENCE),
};

const PLACES: [[f64; 2]; 9] = [
    [-1.0, -1.0],
    [1.0, -1.0],
    [1.0, 1.0],
    [-1.0, 1.0],
    [0.0, -1.0],
    [1.0, 0.0],
    [0.0, 1.0],
    [-1.0, 0.0],
    [0.0, 0.0],
];

pub(super) const REFERENCE: Reference<9> = Reference {
    shape,
    area: |places| area_of_quad(places),
    rule: quad_rule,
    exact: || quad_rule([3, 3]),
    exact_curved: || quad_rule([4, 4]),
    sides: &EDGES_OF_QUAD,
    functions: None,
};

/// Shape functions, and their derivatives by ξ and η: products of those of lines.
fn shape([xi, eta]: [f64; 2]) -> Functions<9> {
    let (along_xi, along_eta) = (line_shape(xi), line_shape(eta));
    // Ends and middle of a line.
    let of = |line: [f64; 3], at: f64| {
        line[if at < 0.0 {
            0
        } else if at > 0.0 {
            1
        } else {
            2
        }]
    };
    let products = |xi: [f64; 3], eta: [f64; 3]| PLACES.map(|[a, b]| of(xi, a) * of(eta, b));
    (
        products(along_xi.0, along_eta.0),
        [
            products(along_xi.1, along_eta.0),
            products(along_xi.0, along_eta.1),
        ],
    )
}

fn division() -> Division {
    use Place::{Half, Inside, Node};
    const CENTRE: usize = 8;
    // On the line from the middle of side k through the centre to that of the side across, a quarter of it: 3/8,
    // 3/4, −1/8.
    let to_centre = |k: usize| (CENTRE, vec![(0.375, 4 + k), (-0.125, 4 + (k + 2) % 4)]);
    // The middle of the part at corner k: products of 3/8, 3/4 and −1/8 along both directions.
    let middle = |k: usize| {
        let corner = |s: usize| (k + s) % 4;
        let side = |s: usize| 4 + (k + s) % 4;
        let parts = vec![
            (9.0 / 64.0, corner(0)),
            (-3.0 / 64.0, corner(1)),
            (1.0 / 64.0, corner(2)),
            (-3.0 / 64.0, corner(3)),
            (18.0 / 64.0, side(0)),
            (-6.0 / 64.0, side(1)),
            (-6.0 / 64.0, side(2)),
            (18.0 / 64.0, side(3)),
        ];
        (CENTRE, parts)
    };
    let at_corner = |k: usize| {
        let before = (k + 3) % 4;
        vec![
            Node(k),
            Node(4 + k),
            Node(CENTRE),
            Node(4 + before),
            Half(k, k),
            Inside(k),
            Inside(before),
            Half(before, k),
            Inside(4 + k),
        ]
    };
    Division {
        inside: (0..4).map(to_centre).chain((0..4).map(middle)).collect(),
        parts: (0..4).map(at_corner).collect(),
    }
}
