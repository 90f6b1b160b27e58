//! 8-node quads.

use super::kind::{Division, Kind, Place, Points};
use super::reference::{
    EDGES_OF_QUAD, Functions, ProjectedOn, Reference, area_of_quad, off, quad_rule,
};
use super::solid::Strains;
use crate::problem::Integration;

/// 8-node quads, ξ and η from −1 to 1.
pub static QUAD8: Kind = Kind {
    name: "QUAD8",
    places: &PLACES,
    edges: &EDGES_OF_QUAD,
    gmsh: 16,
    vtk: 23,
    points: |integration, places| Some(points(integration, places)),
    best: Points::at(2, 2),
    fine: Points::at(3, 3),
    division,
    tangents: |at, places| REFERENCE.tangents(at, places),
    build: |elements| elements.of(&REFERENCE),
};

const PLACES: [[f64; 2]; 8] = [
    [-1.0, -1.0],
    [1.0, -1.0],
    [1.0, 1.0],
    [-1.0, 1.0],
    [0.0, -1.0],
    [1.0, 0.0],
    [0.0, 1.0],
    [-1.0, 0.0],
];

/// A side whose middle lies off by less turns by less than 5°: two points follow it within 10⁻⁴ (a ring's
/// displacements).
const BENT: f64 = 1e-2;

pub(super) const REFERENCE: Reference<8> = Reference {
    shape,
    area: |places| area_of_quad(places),
    rule: quad_rule,
    exact: || quad_rule([3, 3]),
    exact_curved: || quad_rule([4, 4]),
    sides: &EDGES_OF_QUAD,
    functions: Some(ProjectedOn {
        // Bilinear between the 2 × 2 points at ±1/√3.
        function: |[a, b], [xi, eta]| 0.25 * (1.0 + 3.0 * a * xi) * (1.0 + 3.0 * b * eta),
        beyond_linear: |[n_xi, n_eta], [xi, eta]| {
            let all = (0..n_xi).flat_map(|a| (0..n_eta).map(move |b| (a, b)));
            let beyond = all.filter(|(a, b)| a + b > 1);
            beyond
                .map(|(a, b)| xi.powi(a as i32) * eta.powi(b as i32))
                .collect()
        },
    }),
};

fn points(integration: Integration, places: &[[f64; 2]]) -> Points {
    let linear_volume = |along| Points {
        along,
        strains: Strains::LinearVolume,
    };
    match integration {
        Integration::BBar => linear_volume([3, 3]),
        Integration::Reduced => Points::at(2, 2),
        Integration::Projected => {
            let bent = bent(places);
            Points {
                along: bent.map(|bent| if bent { 3 } else { 2 }),
                strains: if bent == [false; 2] {
                    Strains::Projected
                } else {
                    Strains::ProjectedLinearVolume
                },
            }
        }
        _ => Points::at(3, 3),
    }
}

/// Whether the first and third side, and the others, turn too much to be followed by two points along them.
pub(super) fn bent(places: &[[f64; 2]]) -> [bool; 2] {
    let is_bent = |side: usize| off(EDGES_OF_QUAD[side].map(|node| places[node])) > BENT;
    [0, 1].map(|first| is_bent(first) || is_bent(first + 2))
}

/// Shape functions, and their derivatives by ξ and η.
fn shape([xi, eta]: [f64; 2]) -> Functions<8> {
    let mut n = [0.0; 8];
    let mut d = [[0.0; 8]; 2];
    for (i, [a, b]) in PLACES.into_iter().take(4).enumerate() {
        let (x, y) = (a * xi, b * eta);
        n[i] = 0.25 * (1.0 + x) * (1.0 + y) * (x + y - 1.0);
        d[0][i] = 0.25 * a * (1.0 + y) * (2.0 * x + y);
        d[1][i] = 0.25 * b * (1.0 + x) * (x + 2.0 * y);
    }
    for (i, b) in [(4, -1.0), (6, 1.0)] {
        n[i] = 0.5 * (1.0 - xi * xi) * (1.0 + b * eta);
        d[0][i] = -xi * (1.0 + b * eta);
        d[1][i] = 0.5 * b * (1.0 - xi * xi);
    }
    for (i, a) in [(5, 1.0), (7, -1.0)] {
        n[i] = 0.5 * (1.0 - eta * eta) * (1.0 + a * xi);
        d[0][i] = 0.5 * a * (1.0 - eta * eta);
        d[1][i] = -eta * (1.0 + a * xi);
    }
    (n, d)
}

fn division() -> Division {
    use Place::{Half, Inside, Node};
    let corners = |part: f64| (0..4).map(move |k| (part, k));
    let centre = [(0.5, 5), (0.5, 6), (0.5, 7)].into_iter();
    let centre = (4, centre.chain(corners(-0.25)).collect());
    // Half way from the middle of side k to the centre.
    let inside = |k: usize| {
        let side = |s: usize| 4 + (k + s) % 4;
        let corner = |s: usize| (-0.1875, (k + s) % 4);
        let sides = [(0.375, side(1)), (0.25, side(2)), (0.375, side(3))];
        (
            side(0),
            sides.into_iter().chain((0..4).map(corner)).collect(),
        )
    };
    let at_corner = |k: usize| {
        let before = (k + 3) % 4;
        vec![
            Node(k),
            Node(4 + k),
            Inside(0),
            Node(4 + before),
            Half(k, k),
            Inside(1 + k),
            Inside(1 + before),
            Half(before, k),
        ]
    };
    Division {
        inside: [centre].into_iter().chain((0..4).map(inside)).collect(),
        parts: (0..4).map(at_corner).collect(),
    }
}
