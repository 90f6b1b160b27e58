//! Patch tests of `solid`.
//!
//! Goal        constant strain is reproduced by full and reduced integration.
//! Geometry    3 × 4 elements, sizes differing by a factor of 60.
//!
//! ```text
//!   y ┌───┬┬────────┐
//!   │ ├───┼┼────────┤   u = A x on every boundary node
//!   │ ├───┼┼────────┤
//!   │ │   ││        │
//!   └ ├───┼┼────────┤ → x (r)
//!     └───┴┴────────┘
//! ```
//!
//! Boundary    plane strain: u = A x with a full matrix A; axisymmetric: u_r = a r, u_z = b z, with and without the
//!             axis.
//! Law         elastic; mohr_coulomb with a cohesion far from being reached.
//! Asserts     stress of every integration point, PATCH.

use crate::patch::{Expected, Patch, boundary_nodes};
use crate::setup::{Lame, elastic};

const YOUNG: f64 = 20e3;
const POISSON: f64 = 0.3;
const Y: [f64; 5] = [-1.0, 0.0, 0.03, 1.2, 1.7];

fn laws() -> [String; 2] {
    let mohr_coulomb = format!(
        "ground = {{ law = \"mohr_coulomb\", parameters = {{ young_modulus = {YOUNG}, \
         poisson_ratio = {POISSON}, cohesion = 1e4, friction_angle = 30.0, \
         dilatancy_angle = 10.0 }} }}"
    );
    [elastic("ground", YOUNG, POISSON), mohr_coulomb]
}

fn solid(integration: &str) -> String {
    format!(
        "ground = {{ formulation = \"solid\", integration = \"{integration}\", law = \"ground\" }}"
    )
}

const REGION: &str = "[[mesh.region]]\ngroup = \"ground\"";

#[test]
fn plane_strain_under_a_linear_displacement() {
    let a = [[1.0e-3, -2.0e-3], [0.7e-3, -0.4e-3]];
    let Lame {
        lambda,
        shear,
        oedometric,
    } = Lame::new(YOUNG, POISSON);
    let (e_11, e_22, gamma) = (a[0][0], a[1][1], a[0][1] + a[1][0]);
    let stress = [
        oedometric * e_11 + lambda * e_22,
        oedometric * e_22 + lambda * e_11,
        lambda * (e_11 + e_22),
        shear * gamma,
    ];
    let field = |[x, y]: [f64; 2]| [a[0][0] * x + a[0][1] * y, a[1][0] * x + a[1][1] * y];
    let x = [0.0, 1.0, 1.05, 4.0];
    let (lines, phases) = boundary_nodes(&x, &Y, &field);
    for law in laws() {
        for integration in ["full", "reduced"] {
            let patch = Patch {
                analysis: "plane_strain",
                x: &x,
                y: &Y,
                regions: REGION,
                laws: &law,
                groups: &solid(integration),
                lines: &lines,
                phases: &phases,
            };
            patch.assert(integration, &[Expected::stress("ground", stress)]);
        }
    }
}

#[test]
fn axisymmetric_under_a_linear_displacement() {
    let (a, b) = (-0.8e-3, 1.5e-3);
    let Lame {
        lambda,
        shear,
        oedometric,
    } = Lame::new(YOUNG, POISSON);
    let in_plane = 2.0 * (lambda + shear) * a + lambda * b;
    let stress = [in_plane, oedometric * b + 2.0 * lambda * a, in_plane, 0.0];
    for law in laws() {
        for integration in ["full", "reduced"] {
            for r in [[0.0, 1.0, 1.05, 4.0], [0.5, 1.0, 1.05, 4.0]] {
                let (lines, phases) = boundary_nodes(&r, &Y, &|[r, z]| [a * r, b * z]);
                let patch = Patch {
                    analysis: "axisymmetric",
                    x: &r,
                    y: &Y,
                    regions: REGION,
                    laws: &law,
                    groups: &solid(integration),
                    lines: &lines,
                    phases: &phases,
                };
                let what = format!("{integration}, r from {}", r[0]);
                patch.assert(&what, &[Expected::stress("ground", stress)]);
            }
        }
    }
}
