//! A layer that unloads to zero stress, and a model in which nothing is to move.
//!
//! Goal        the end of unloading does not depend on which way up the model is.
//! Geometry    a thin layer between two slabs, in the middle of the left part of a body.
//! Boundary    rollers below and left; head pushed by 0.1 mm and taken back.
//! Law         elastic; mepi in the layer, whose stiffness vanishes with its traction.
//! Asserts     both ways up: no force is left at the end.

use crate::setup::{Results, assert_close, run};

/// The body, or its mirror image in a horizontal plane.
fn body(mirrored: bool) -> String {
    let (down, up) = (1e-4, if mirrored { 1.0 } else { -1.0 });
    let rows = if mirrored {
        "[{ n = 1, to = -0.08336666666666667 }, { n = 1, to = -0.06673333333333334 }, { n = 1, to = -0.050100000000000006 }, { n = 1, to = -0.05 }, { n = 1, to = -0.03333333333333333 }, { n = 1, to = -0.016666666666666666 }, { n = 1, to = 0.0 }]"
    } else {
        "[{ n = 3, to = 0.05 }, { n = 1, to = 0.050100000000000006 }, { n = 3, to = 0.1 }]"
    };
    let (origin, b, i, top) = if mirrored {
        (-0.1, [-0.1, 0.0], [-0.050_100_000_000_000_006, -0.05], -0.1)
    } else {
        (0.0, [0.0, 0.1], [0.05, 0.050_100_000_000_000_006], 0.1)
    };
    format!(
        r#"
analysis = "plane_strain"
supports = [{{ line = "bottom", fixed = ["y"] }}, {{ line = "left", fixed = ["x"] }}]
[mesh]
origin = [5.0, {origin:?}]
columns = [{{ n = 2, to = 5.4 }}, {{ n = 1, to = 5.4001 }}, {{ n = 2, to = 6.0, ratio = 1.0 }}]
rows = {rows}
region = [{{ group = "a" }}, {{ group = "b", x = [5.0, 5.4], y = {b:?} }}, {{ group = "i", x = [5.0, 5.4], y = {i:?} }}]
lines = {{ left = {{ x = 5.0 }}, bottom = {{ y = 0.0 }}, head = {{ y = {top:?}, x = [5.0, 5.4] }} }}
[laws]
sand = {{ law = "elastic", parameters = {{ young_modulus = 34e3, poisson_ratio = 0.3 }} }}
mepi = {{ law = "mepi", parameters = {{ k_n = 86e3, k_t = 37e3, n = 0.55, mu_0 = 0.27, mu_p = 0.7, mu_c0 = 0.46, a = 0.008, c_0 = 40.0, t = 0.002, p_0 = 100.0, sigma_ni = 100.0 }} }}
[groups]
a = {{ formulation = "solid", law = "sand", integration = "reduced" }}
b = {{ formulation = "solid", integration = "full", law = "sand" }}
i = {{ formulation = "thin_layer", law = "mepi", integration = "reduced", normal = "y" }}
[[phase]]
name = "push"
increments = 3
displacement = [{{ line = "head", y = {:?} }}]
[[phase]]
name = "back"
increments = 3
displacement = [{{ line = "head", y = 0.0 }}]
[probes]
head = {{ line = "head", quantity = "reaction_y" }}
"#,
        up * down
    )
}

#[test]
fn both_ways_up_no_force_is_left() {
    let mut pushed = Vec::new();
    for mirrored in [false, true] {
        let finished = run(&body(mirrored));
        let force = finished.end_of("push", "head").abs();
        assert!(force > 1.0, "{force} kN");
        // Residuals of 1e-9 of that may be left.
        assert!(
            finished.last("head").abs() < 1e-8 * force,
            "{mirrored}: {}",
            finished.last("head")
        );
        pushed.push(force);
    }
    assert!((pushed[0] / pushed[1] - 1.0).abs() < 1e-8, "{pushed:?}");
}

/// A pile in sand that yields, under the stress that both have: in equilibrium before anything
/// moves. All motion is round-off.
const NOTHING: &str = r#"
analysis = "axisymmetric"
supports = [{ line = "axis", fixed = ["r"] }, { line = "wall", fixed = ["r"] }, { line = "ends", fixed = ["z"] }, { line = "top", fixed = ["z"] }]
[mesh]
columns = [{ n = 2, to = 0.25 }, { n = 4, to = 4.0 }]
rows = [{ n = 2, to = 1.0 }]
region = [{ group = "sand" }, { group = "pile", r = [0.0, 0.25] }]
[mesh.lines]
axis = { r = 0.0 }
shaft = { r = 0.25 }
wall = { r = 4.0 }
ends = { z = 0.0 }
head = { z = 1.0, r = [0.0, 0.25] }
top = { z = 1.0, r = [0.25, 4.0] }
[laws]
sand = { law = "mohr_coulomb", parameters = { young_modulus = 34e3, poisson_ratio = 0.3, cohesion = 1.0, friction_angle = 35.0, dilatancy_angle = 5.0 } }
concrete = { law = "elastic", parameters = { young_modulus = 30e6, poisson_ratio = 0.2 } }
joint = { law = "coulomb_joint", parameters = { normal_stiffness = 1e6, shear_stiffness = 1e5, cohesion = 0.0, friction_angle = 35.0, dilatancy_angle = 0.0 } }
[groups]
sand = { formulation = "solid", law = "sand", initial_stress = { 11 = -100.0, 22 = -100.0, 33 = -100.0 } }
pile = { formulation = "solid", law = "concrete", initial_stress = { 11 = -100.0, 22 = -100.0, 33 = -100.0 } }
joint = { formulation = "zero_thickness", line = "shaft", law = "joint" }
[[phase]]
name = "nothing"
increments = 3
pressure = [{ line = "head", value = 100.0 }]
[probes]
u = { line = "head", quantity = "displacement_z" }
sigma = { group = "joint", quantity = "traction_n", reduce = "min" }
"#;

/// Residuals of about 2e-16 are left, below tolerances of 1e-9 to 1e-13; corrections are as large as the increment.
#[test]
fn what_does_not_move_is_in_equilibrium_at_any_tolerance() {
    for tolerance in ["1e-9", "1e-12", "1e-13"] {
        for method in ["newton", "modified_newton", "initial_stress"] {
            let solver =
                format!("[solver]\nforce_tolerance = {tolerance}\nmethod = \"{method}\"\n");
            let results = run(&format!("{NOTHING}{solver}"));
            assert_close("u", results.last("u"), 0.0, 1.0, 1e-15);
            assert_close("sigma", results.last("sigma"), -100.0, 1e-12, 100.0);
            assert_eq!(results.observer.warnings.len(), 0, "{solver}");
            let iterations = results.history("iterations");
            assert!(iterations.iter().all(|n| *n <= 1.0), "{iterations:?}");
        }
    }
}
