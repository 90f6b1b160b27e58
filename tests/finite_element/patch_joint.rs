//! Patch tests of `zero_thickness`.
//!
//! Goal        a joint between two materials carries constant traction.
//! Geometry    a horizontal or vertical joint from boundary to boundary, or ending inside.
//!
//! ```text
//!   ┌────┬───────┬──┐        ┌────┬───────┬──┐
//!   │    │   2   │  │        │    │       │  │
//!   ╞════╪═══════╪══╡        ╞════╪═══════╡  │
//!   │    │   1   │  │        │    │       │  │
//!   └────┴───────┴──┘        └────┴───────┴──┘
//! ```
//!
//! Boundary    the normal displacement of all four sides: the sum over the laminate, with the jump σ_n/K_n. For
//!             shear a second phase moves one side along the joint while nothing moves across it. A joint that ends
//!             inside is stressed along its line only, so that nothing opens or slides.
//! Law         elastic ground; coulomb_joint and mepi in their elastic range.
//! Asserts     stresses, tractions and jumps of all points, PATCH.

use crate::patch::{Expected, Normal, Patch};
use crate::setup::{Lame, elastic};
use std::fmt::Write;

const INTEGRATION: [&str; 3] = ["nodes", "full", "reduced"];
const K_N: f64 = 3.0e5;
const K_T: f64 = 1.7e5;
/// Grid lines across the joint, and where it is.
const ACROSS: [f64; 5] = [0.0, 0.9, AT, 1.2, 2.5];
const AT: f64 = 1.0;
/// Grid lines along the joint.
const ALONG: [f64; 4] = [0.0, 0.7, 0.8, 3.0];

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

/// Young's modulus and Poisson's ratio on the near and the far side.
type Grounds = [(f64, f64); 2];

/// A patch of two grounds with a joint.
struct JointPatch<'a> {
    analysis: &'a str,
    normal: Normal,
    grounds: Grounds,
    law: &'a str,
    integration: &'a str,
    /// Extent of the joint.
    extent: [f64; 2],
}

impl JointPatch<'_> {
    /// Displacements of the sides: (along the joint at its far end, across it at the far side),
    /// and, in a second phase, of the far side along the joint.
    #[track_caller]
    fn assert(&self, [along, across]: [f64; 2], sliding: Option<f64>, expected: &[Expected]) {
        let Self {
            analysis,
            normal,
            grounds,
            law,
            integration,
            extent: [from, to],
        } = *self;
        let (x, y, [s, n]): (&[f64], &[f64], _) = match normal {
            Normal::X => (&ACROSS, &ALONG, ["y", "x"]),
            Normal::Y => (&ALONG, &ACROSS, ["x", "y"]),
        };
        let lines = format!(
            "joint = {{ {n} = {AT:?}, {s} = [{from:?}, {to:?}] }}\n\
             near = {{ {n} = 0.0 }}\nfar = {{ {n} = 2.5 }}\n\
             start = {{ {s} = 0.0 }}\nend = {{ {s} = 3.0 }}\n"
        );
        let mut phases = format!(
            "[[phase]]\nname = \"strain\"\nincrements = 1\ndisplacement = [\n\
             {{ line = \"near\", {n} = 0.0 }}, {{ line = \"far\", {n} = {across:e} }},\n\
             {{ line = \"start\", {s} = 0.0 }}, {{ line = \"end\", {s} = {along:e} }},\n]\n"
        );
        if let Some(sliding) = sliding {
            // In pure shear the ends carry shear stress: hold them across the joint where they
            // are. They carry no normal stress: let them go along it.
            let _ = write!(
                phases,
                "[[phase]]\nname = \"slide\"\nincrements = 1\nreset_displacements = true\n\
                 free = [{{ line = \"start\", components = [\"{s}\"] }}, \
                 {{ line = \"end\", components = [\"{s}\"] }}]\ndisplacement = [\n\
                 {{ line = \"start\", {n} = 0.0 }}, {{ line = \"end\", {n} = 0.0 }},\n\
                 {{ line = \"near\", {s} = 0.0, {n} = 0.0 }},\n\
                 {{ line = \"far\", {s} = {sliding:e}, {n} = 0.0 }},\n]\n"
            );
        }
        let patch = Patch {
            analysis,
            x,
            y,
            regions: &format!(
                "[[mesh.region]]\ngroup = \"ground_1\"\n\
                 [[mesh.region]]\ngroup = \"ground_2\"\n{n} = [{AT:?}, 2.5]\n"
            ),
            laws: &format!(
                "{}{}{law}",
                elastic("ground_1", grounds[0].0, grounds[0].1),
                elastic("ground_2", grounds[1].0, grounds[1].1)
            ),
            groups: &format!(
                "ground_1 = {{ formulation = \"solid\", integration = \"full\", law = \"ground_1\" }}\n\
                 ground_2 = {{ formulation = \"solid\", integration = \"full\", law = \"ground_2\" }}\n\
                 joint = {{ formulation = \"zero_thickness\", line = \"joint\", \
                 integration = \"{integration}\", law = \"joint\" }}\n"
            ),
            lines: &lines,
            phases: &phases,
        };
        let what = format!("{analysis}, normal {normal:?}, {integration}, {from} to {to}");
        patch.assert(&what, expected);
    }
}

fn pressed(analysis: &str, normal: Normal, law: &str, integration: &str) {
    let grounds = [(20e3, 0.3), (35e3, 0.15)];
    let (s, along) = (-90.0, 0.4e-3);
    let out = if analysis == "axisymmetric" {
        along
    } else {
        0.0
    };
    let [one, two] = grounds.map(|(young, poisson)| {
        let Lame {
            lambda, oedometric, ..
        } = Lame::new(young, poisson);
        let across = (s - lambda * (along + out)) / oedometric;
        let stress = [
            oedometric * along + lambda * (across + out),
            s,
            oedometric * out + lambda * (across + along),
            0.0,
        ];
        (normal.turn_stress(stress), across)
    });
    let far = one.1 * AT + s / K_N + two.1 * (2.5 - AT);
    JointPatch {
        analysis,
        normal,
        grounds,
        law,
        integration,
        extent: [0.0, 3.0],
    }
    .assert(
        [3.0 * along, far],
        None,
        &[
            Expected::stress("ground_1", one.0),
            Expected::stress("ground_2", two.0),
            Expected::interface("joint", [s, 0.0], [s / K_N, 0.0]),
        ],
    );
}

#[test]
fn joint_under_normal_stress() {
    for law in joint_laws() {
        for integration in INTEGRATION {
            for normal in Normal::BOTH {
                pressed("plane_strain", normal, &law, integration);
            }
            pressed("axisymmetric", Normal::Y, &law, integration);
        }
    }
}

#[test]
fn joint_under_normal_and_shear_stress() {
    // Without Poisson's ratio M = E, G = E/2, and nothing presses on the ends.
    let grounds = [(20e3, 0.0), (35e3, 0.0)];
    let (s, t) = (-90.0, 25.0);
    let over = |joint: f64, one: f64, two: f64| 1.0 / joint + AT / one + (2.5 - AT) / two;
    let far = s * over(K_N, grounds[0].0, grounds[1].0);
    let sliding = t * over(K_T, 0.5 * grounds[0].0, 0.5 * grounds[1].0);
    for law in joint_laws() {
        for integration in INTEGRATION {
            for normal in Normal::BOTH {
                let stress = normal.turn_stress([0.0, s, 0.0, t]);
                JointPatch {
                    analysis: "plane_strain",
                    normal,
                    grounds,
                    law: &law,
                    integration,
                    extent: [0.0, 3.0],
                }
                .assert(
                    [0.0, far],
                    Some(sliding),
                    &[
                        Expected::stress("ground_1", stress),
                        Expected::stress("ground_2", stress),
                        Expected::interface("joint", [s, t], [s / K_N, t / K_T]),
                    ],
                );
            }
        }
    }
}

/// A joint that ends inside the ground, in ground that is stressed along it only.
fn ending(analysis: &str, normal: Normal, extent: [f64; 2], law: &str, integration: &str) {
    let (young, poisson) = (20e3, 0.3);
    let s: f64 = -70.0;
    // Strains (along, across); the same across as out of plane around the axis.
    let ([along, across], out_stress) = if analysis == "axisymmetric" {
        ([s / young, -poisson * s / young], 0.0)
    } else {
        let along = s * (1.0 - poisson * poisson) / young;
        ([along, -poisson / (1.0 - poisson) * along], poisson * s)
    };
    let stress = normal.turn_stress([s, 0.0, out_stress, 0.0]);
    JointPatch {
        analysis,
        normal,
        grounds: [(young, poisson); 2],
        law,
        integration,
        extent,
    }
    .assert(
        [3.0 * along, 2.5 * across],
        None,
        &[
            Expected::stress("ground_1", stress),
            Expected::stress("ground_2", stress),
            Expected::interface("joint", [0.0; 2], [0.0; 2]).scaled([s.abs(), s.abs() / K_T]),
        ],
    );
}

#[test]
fn joint_that_ends_inside_the_ground() {
    let [law, _] = joint_laws();
    for integration in INTEGRATION {
        for extent in [[0.8, 3.0], [0.0, 0.8], [0.7, 0.8]] {
            for normal in Normal::BOTH {
                ending("plane_strain", normal, extent, &law, integration);
            }
            ending("axisymmetric", Normal::X, extent, &law, integration);
        }
    }
}
