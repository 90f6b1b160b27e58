//! Patch tests of `zero_thickness`.
//!
//! Goal        a joint between two materials carries constant traction
//! Geometry    a horizontal or vertical joint from boundary to boundary, or ending inside
//!
//! ```text
//!   ┌────┬───────┬──┐        ┌────┬───────┬──┐
//!   │    │   2   │  │        │    │       │  │
//!   ╞════╪═══════╪══╡        ╞════╪═══════╡  │
//!   │    │   1   │  │        │    │       │  │
//!   └────┴───────┴──┘        └────┴───────┴──┘
//! ```
//!
//! Boundary    displacements of all boundary nodes. Through joint: a laminate as in
//!             `patch_layer`, with jumps σ_n/K_n, τ/K_t. Ending joint: stress along it only, so
//!             that nothing opens or slides
//! Law         elastic ground; coulomb_joint and mepi in their elastic range
//! Asserts     stresses, tractions and jumps of all points, PATCH

use crate::patch::{Expected, JointLine, Normal, Patch};
use crate::setup::{Lame, elastic};

const INTEGRATION: [&str; 3] = ["nodes", "full", "reduced"];
const K_N: f64 = 3.0e5;
const K_T: f64 = 1.7e5;
const AT: f64 = 1.0;

fn joint_laws() -> [String; 2] {
    [
        format!(
            "joint = {{ law = \"coulomb_joint\", parameters = {{ normal_stiffness = {K_N}, \
             shear_stiffness = {K_T}, cohesion = 1e3, friction_angle = 30.0, \
             dilatancy_angle = 5.0 }} }}"
        ),
        format!(
            "joint = {{ law = \"mepi\", parameters = {{ k_n = {K_N}, k_t = {K_T}, n = 0.0, \
             mu_0 = 0.4, mu_p = 0.7, mu_c0 = 0.46, a = 0.008, c_0 = 40.0, t = 0.002, \
             p_0 = 100.0, sigma_ni = 100.0 }} }}"
        ),
    ]
}

fn group(integration: &str) -> String {
    format!(
        "joint = {{ formulation = \"zero_thickness\", line = \"joint\", \
         integration = \"{integration}\", law = \"joint\" }}\n"
    )
}

fn through(analysis: &str, normal: Normal, law: &str, integration: &str, shear_stress: f64) {
    let grounds = [(20e3, 0.3), (35e3, 0.15)];
    let traction = [-90.0, shear_stress];
    let jump = [traction[0] / K_N, traction[1] / K_T];
    let along = 0.4e-3;
    let out = if analysis == "axisymmetric" {
        along
    } else {
        0.0
    };
    let [one, two] = grounds.map(|(young, poisson)| {
        let Lame {
            lambda,
            shear,
            oedometric,
        } = Lame::new(young, poisson);
        let across = (traction[0] - lambda * (along + out)) / oedometric;
        let stress = [
            oedometric * along + lambda * (across + out),
            traction[0],
            oedometric * out + lambda * (across + along),
            traction[1],
        ];
        (normal.turn_stress(stress), [across, traction[1] / shear])
    });
    let field = |p: [f64; 2], far: bool| {
        let [s, n] = normal.turn(p);
        let (below, above) = (n.min(AT), (n - AT).max(0.0));
        let u = [
            along * s + one.1[1] * below + two.1[1] * above + f64::from(far) * jump[1],
            one.1[0] * below + two.1[0] * above + f64::from(far) * jump[0],
        ];
        normal.turn(u)
    };
    let across_lines = [0.0, 0.9, AT, 1.2, 2.5];
    let along_lines = [0.0, 0.7, 0.8, 3.0];
    let (x, y): (&[f64], &[f64]) = match normal {
        Normal::X => (&across_lines, &along_lines),
        Normal::Y => (&along_lines, &across_lines),
    };
    let key = if normal == Normal::X { "x" } else { "y" };
    let patch = Patch {
        analysis,
        x,
        y,
        regions: &format!(
            "[[mesh.region]]\ngroup = \"ground_1\"\n\
             [[mesh.region]]\ngroup = \"ground_2\"\n{key} = [{AT:?}, 2.5]\n"
        ),
        laws: &format!(
            "{}{}{law}",
            elastic("ground_1", grounds[0].0, grounds[0].1),
            elastic("ground_2", grounds[1].0, grounds[1].1)
        ),
        groups: &format!(
            "ground_1 = {{ formulation = \"solid\", law = \"ground_1\" }}\n\
             ground_2 = {{ formulation = \"solid\", law = \"ground_2\" }}\n{}",
            group(integration)
        ),
        joint: Some(JointLine {
            normal,
            at: AT,
            extent: [0.0, 3.0],
        }),
        field: &field,
    };
    patch.assert(
        &format!("{analysis}, normal {normal:?}, {integration}"),
        &[
            Expected::stress("ground_1", one.0),
            Expected::stress("ground_2", two.0),
            Expected::interface("joint", traction, jump),
        ],
    );
}

#[test]
fn joint_from_boundary_to_boundary() {
    for law in joint_laws() {
        for integration in INTEGRATION {
            for normal in Normal::BOTH {
                through("plane_strain", normal, &law, integration, 25.0);
            }
            through("axisymmetric", Normal::Y, &law, integration, 0.0);
        }
    }
}

/// A joint that ends inside the ground, in ground that is stressed along it only.
fn ending(analysis: &str, normal: Normal, extent: [f64; 2], law: &str, integration: &str) {
    let (young, poisson) = (20e3, 0.3);
    let stress_along = -70.0;
    let along = stress_along / young;
    let Lame {
        lambda,
        shear,
        oedometric,
    } = Lame::new(young, poisson);
    // Strains (along, across, out of plane) without stress across; around the axis strains in
    // the radial direction and out of plane are the same.
    let (strains, out_stress) = if analysis == "axisymmetric" {
        ([along, -poisson * along, -poisson * along], 0.0)
    } else {
        let e = stress_along * (1.0 - poisson * poisson) / young;
        let across = -lambda / oedometric * e;
        ([e, across, 0.0], poisson * stress_along)
    };
    // The strains above are those of this stress.
    let volume: f64 = strains.iter().sum();
    assert!((lambda * volume + 2.0 * shear * strains[1]).abs() < 1e-10);
    let stress = normal.turn_stress([stress_along, 0.0, out_stress, 0.0]);
    let lines = [0.0, 0.9, AT, 1.2, 2.5];
    let patch = Patch {
        analysis,
        x: &lines,
        y: &lines,
        regions: "[[mesh.region]]\ngroup = \"ground\"",
        laws: &format!("{}{law}", elastic("ground", young, poisson)),
        groups: &format!(
            "ground = {{ formulation = \"solid\", law = \"ground\" }}\n{}",
            group(integration)
        ),
        joint: Some(JointLine {
            normal,
            at: AT,
            extent,
        }),
        field: &|p, _| {
            let [s, n] = normal.turn(p);
            normal.turn([strains[0] * s, strains[1] * n])
        },
    };
    patch.assert(
        &format!("{analysis}, normal {normal:?}, {integration}, extent {extent:?}"),
        &[
            Expected::stress("ground", stress),
            Expected::interface("joint", [0.0; 2], [0.0; 2])
                .scaled([stress_along.abs(), stress_along.abs() / K_T]),
        ],
    );
}

#[test]
fn joint_that_ends_inside_the_ground() {
    let [law, _] = joint_laws();
    for integration in INTEGRATION {
        for extent in [[AT, 2.5], [0.0, 1.2], [0.9, 1.2]] {
            for normal in Normal::BOTH {
                ending("plane_strain", normal, extent, &law, integration);
            }
            ending("axisymmetric", Normal::X, extent, &law, integration);
        }
    }
}
