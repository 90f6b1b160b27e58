//! 6-node triangles.

use super::kind::{Division, Kind, Place, Points};
use super::reference::{Functions, ProjectedOn, Reference, collapsed_rule, triangle_rule};
use super::solid::Strains;
use crate::problem::Integration;

/// 6-node triangles, with corners (0, 0), (1, 0), (0, 1).
pub static TRI6: Kind = Kind {
    name: "TRI6",
    places: &PLACES,
    edges: &EDGES,
    gmsh: 9,
    vtk: 22,
    points: |integration, _| {
        Some(match integration {
            Integration::BBar => Points {
                along: [6, 1],
                strains: Strains::LinearVolume,
            },
            Integration::Reduced => Points::at(3, 1),
            _ => Points {
                along: [3, 1],
                strains: Strains::Projected,
            },
        })
    },
    best: Points::at(3, 1),
    fine: Points::at(7, 1),
    division,
    tangents: |at, places| REFERENCE.tangents(at, places),
    build: |elements| elements.of(&REFERENCE),
};

const PLACES: [[f64; 2]; 6] = [
    [0.0, 0.0],
    [1.0, 0.0],
    [0.0, 1.0],
    [0.5, 0.0],
    [0.5, 0.5],
    [0.0, 0.5],
];

const EDGES: [[usize; 3]; 3] = [[0, 1, 3], [1, 2, 4], [2, 0, 5]];

pub(super) const REFERENCE: Reference<6> = Reference {
    shape,
    area: |&[a, b, c, ..]| {
        0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])).abs()
    },
    rule: |[n, _]| triangle_rule(n),
    exact: || triangle_rule(6),
    exact_curved: collapsed_rule,
    sides: &EDGES,
    functions: Some(ProjectedOn {
        // Linear between the points with area coordinates (2/3, 1/6, 1/6).
        function: |a, at| {
            let area = |[xi, eta]: [f64; 2]| [1.0 - xi - eta, xi, eta];
            let products = area(a).into_iter().zip(area(at)).map(|(a, b)| a * b);
            4.0 * products.sum::<f64>() - 1.0
        },
        beyond_linear: |_, _| Vec::new(),
    }),
};

/// Shape functions, and their derivatives by ξ and η.
fn shape([xi, eta]: [f64; 2]) -> Functions<6> {
    // Area coordinates, and their derivatives.
    let l = [1.0 - xi - eta, xi, eta];
    let d = [[-1.0, 1.0, 0.0], [-1.0, 0.0, 1.0]];
    let next = |i: usize| (i + 1) % 3;
    let n = std::array::from_fn(|i| match i {
        0..3 => l[i] * (2.0 * l[i] - 1.0),
        _ => 4.0 * l[i - 3] * l[next(i - 3)],
    });
    let derivative = |d: [f64; 3]| {
        std::array::from_fn(|i| match i {
            0..3 => (4.0 * l[i] - 1.0) * d[i],
            _ => 4.0 * (d[i - 3] * l[next(i - 3)] + l[i - 3] * d[next(i - 3)]),
        })
    };
    (n, d.map(derivative))
}

fn division() -> Division {
    use Place::{Half, Inside, Node};
    // In the middle of the inner side across corner k, between the middles of the sides next to it: −1/8 of the
    // corners beside, 1/2 of the middles beside, 1/4 of the one across.
    let inside = |k: usize| {
        let [before, across] = [3 + (k + 2) % 3, 3 + (k + 1) % 3];
        let others = [(k + 1) % 3, (k + 2) % 3];
        let parts = vec![
            (0.5, before),
            (0.25, across),
            (-0.125, others[0]),
            (-0.125, others[1]),
        ];
        (3 + k, parts)
    };
    let at_corner = |k: usize| {
        let before = (k + 2) % 3;
        vec![
            Node(k),
            Node(3 + k),
            Node(3 + before),
            Half(k, k),
            Inside(k),
            Half(before, k),
        ]
    };
    let middle = vec![Node(3), Node(4), Node(5), Inside(1), Inside(2), Inside(0)];
    Division {
        inside: (0..3).map(inside).collect(),
        parts: (0..3).map(at_corner).chain([middle]).collect(),
    }
}
