//! Regularised corrections (`regularisation`), where Newton iterations alternate between pieces of a law.
//!
//! Goal        a pile pushed in sand that does not dilate finds equilibrium by regularised corrections.
//! Geometry    a pile of 1 m by 10 m in sand of 15 by 20 m, axisymmetric, 299 quads.
//! Boundary    rollers; the head is pushed by 0.1 m.
//! Law         mohr_coulomb with φ = 36°, ψ = 0; coulomb_joint at shaft and base.
//! Asserts     regularised corrections lead there, but for one step at most: no tolerated residual. The load is the same to
//!             1.5 % in 10, 20 and 40 increments and with a tolerance a tenth as large, and to 1e-6 in another unit of
//!             stress. A pressure that the shaft cannot carry has no equilibrium, however long it is looked for; nor has
//!             a block that is pushed beyond its friction.

use crate::setup::{Finished, Results, fail, run};
use std::f64::consts::PI;

/// The pile; stresses in units of `unit` kPa.
fn pile(increments: usize, unit: f64, tolerance: f64) -> String {
    let [e_sand, e_pile, k_n, k_s] = [60e3, 30e6, 1e6, 3e5].map(|value| value / unit);
    let [cohesion, weight] = [1.0, 18.0].map(|value| value / unit);
    format!(
        r#"
title = "pile in sand"
analysis = "axisymmetric"
supports = [{{ line = "axis", fixed = ["r"] }}, {{ line = "far", fixed = ["r"] }}, {{ line = "bottom", fixed = ["r", "z"] }}]
[mesh]
origin = [0.0, -20.0]
columns = [{{ n = 2, to = 0.5 }}, {{ n = 4, to = 1.5, ratio = 1.4 }}, {{ n = 7, to = 15.0, ratio = 1.5 }}]
rows = [{{ n = 6, to = -12.0, ratio = 0.7 }}, {{ n = 5, to = -10.0, ratio = 0.8 }}, {{ n = 12, to = 0.0, ratio = 1.05 }}]
lines.axis = {{ r = 0.0 }}
lines.far = {{ r = 15.0 }}
lines.bottom = {{ z = -20.0 }}
lines.head = {{ r = [0.0, 0.5], z = 0.0 }}
lines.shaft = {{ r = 0.5, z = [-10.0, 0.0] }}
lines.base = {{ r = [0.0, 0.5], z = -10.0 }}
region = [{{ group = "sand" }}, {{ group = "pile", r = [0.0, 0.5], z = [-10.0, 0.0] }}]
[laws]
sand = {{ law = "mohr_coulomb", parameters = {{ young_modulus = {e_sand}, poisson_ratio = 0.3, cohesion = {cohesion}, friction_angle = 36.0, dilatancy_angle = 0.0 }} }}
concrete = {{ law = "elastic", parameters = {{ young_modulus = {e_pile}, poisson_ratio = 0.2 }} }}
skin = {{ law = "coulomb_joint", parameters = {{ normal_stiffness = {k_n}, shear_stiffness = {k_s}, cohesion = 0.0, friction_angle = 30.0, dilatancy_angle = 0.0 }} }}
[groups]
sand = {{ formulation = "solid", law = "sand", unit_weight = {weight}, initial_stress = {{ k_0 = 0.5 }} }}
pile = {{ formulation = "solid", law = "sand", unit_weight = {weight}, initial_stress = {{ k_0 = 0.5 }} }}
shaft = {{ formulation = "zero_thickness", line = "shaft", law = "skin", active = false }}
base = {{ formulation = "zero_thickness", line = "base", law = "skin", active = false }}
[[phase]]
name = "ground"
increments = 1
[[phase]]
name = "pile"
increments = 2
laws = {{ pile = "concrete" }}
activate = ["shaft", "base"]
[[phase]]
name = "test"
increments = {increments}
reset_displacements = true
displacement = [{{ line = "head", z = -0.1 }}]
[solver]
force_tolerance = {tolerance}
displacement_tolerance = 1e-2
[probes]
head = {{ line = "head", quantity = "reaction_z", scale = -1.0 }}
"#
    )
}

/// Regularised corrections were needed, and enough in all steps but one.
fn assert_regularised(finished: &Finished) {
    let iterations = finished.events("iteration");
    let regularised = iterations.iter().filter(|e| e["viscosity"] == 0.1).count();
    assert!(regularised > 20, "{regularised}");
    let phase = &finished.summary()["phases"][2];
    let steps = |kind: &str| phase[kind].as_u64().unwrap();
    assert!(steps("regularised_steps") >= 1, "{phase}");
    assert!(steps("relaxed_steps") <= 1, "{phase}");
    assert_eq!(steps("viscous_steps") + steps("tolerated_steps"), 0);
}

#[test]
fn the_load_of_a_pile_does_not_depend_on_increments_tolerances_and_units() {
    let finished = run(&pile(20, 1.0, 1e-5));
    assert_regularised(&finished);
    let load = finished.last("head");
    for other in [
        pile(10, 1.0, 1e-5),
        pile(40, 1.0, 1e-5),
        pile(20, 1.0, 1e-6),
    ] {
        let other = run(&other).last("head");
        assert!((other / load - 1.0).abs() < 0.015, "{other} {load}");
    }
    let pascal = run(&pile(20, 1e-3, 1e-5)).last("head");
    assert!((1e-3 * pascal / load - 1.0).abs() < 1e-6, "{pascal} {load}");
}

#[test]
fn what_a_shaft_cannot_carry_is_no_equilibrium() {
    // The slice of a pile, an interface with cohesion alone, and a pressure beyond it.
    let (radius, height, cohesion) = (0.25, 1.0, 10.0);
    let limit = 2.0 * PI * radius * height * cohesion / (PI * radius * radius);
    let text = format!(
        r#"
title = "slice"
analysis = "axisymmetric"
supports = [{{ line = "axis", fixed = ["r"] }}, {{ line = "far", fixed = ["r", "z"] }}]
[mesh]
columns = [{{ n = 1, to = 0.25 }}, {{ n = 4, to = 2.0, ratio = 1.6 }}]
rows = [{{ n = 4, to = 1.0 }}]
lines.axis = {{ r = 0.0 }}
lines.far = {{ r = 2.0 }}
lines.head = {{ r = [0.0, 0.25], z = 1.0 }}
lines.shaft = {{ r = 0.25 }}
region = [{{ group = "soil" }}, {{ group = "pile", r = [0.0, 0.25] }}]
[laws]
soil = {{ law = "elastic", parameters = {{ young_modulus = 20e3, poisson_ratio = 0.3 }} }}
concrete = {{ law = "elastic", parameters = {{ young_modulus = 30e6, poisson_ratio = 0.2 }} }}
skin = {{ law = "coulomb_joint", parameters = {{ normal_stiffness = 1e6, shear_stiffness = 1e5, cohesion = {cohesion}, friction_angle = 0.0, dilatancy_angle = 0.0 }} }}
[groups]
soil = {{ formulation = "solid", law = "soil", initial_stress = {{ stress_11 = -100.0, stress_22 = -100.0, stress_33 = -100.0 }} }}
pile = {{ formulation = "solid", law = "concrete" }}
shaft = {{ formulation = "zero_thickness", line = "shaft", law = "skin" }}
[[phase]]
name = "push"
increments = 10
pressure = [{{ line = "head", value = {} }}]
[probes]
head = {{ line = "head", quantity = "displacement_z" }}
"#,
        1.25 * limit
    );
    let failed = fail(&text);
    let reached = failed.summary()["stopped_at"]["load_factor"]
        .as_f64()
        .unwrap();
    assert!((reached * 1.25 - 1.0).abs() < 5e-3, "{reached}");
}

/// A block of 2 m under 50 kPa on a joint of φ = 25° slides at 100 tan φ. A residual within a loose tolerance is no reason
/// to let it slide away.
#[test]
fn a_block_pushed_beyond_its_friction_is_in_no_equilibrium() {
    let limit = 2.0 * 50.0 * 25.0_f64.to_radians().tan();
    for (beyond, increments) in [(1.0005, 10), (1.002, 40), (1.01, 10)] {
        let text = format!(
            r#"
title = "block"
analysis = "plane_strain"
supports = [{{ line = "left", fixed = ["x"] }}, {{ line = "right", fixed = ["x"] }}, {{ line = "bottom", fixed = ["x", "y"] }}]
[mesh]
origin = [-1.0, 0.0]
columns = [{{ n = 6, to = 1.0 }}]
rows = [{{ n = 4, to = 3.0, ratio = 0.75 }}, {{ n = 4, to = 4.0 }}]
lines.left = {{ x = -1.0, y = [0.0, 3.0] }}
lines.right = {{ x = 1.0, y = [0.0, 3.0] }}
lines.bottom = {{ y = 0.0 }}
lines.joint = {{ y = 3.0 }}
lines.top = {{ y = 4.0 }}
region = [{{ group = "soil" }}, {{ group = "block", y = [3.0, 4.0] }}]
[laws]
soil = {{ law = "elastic", parameters = {{ young_modulus = 50e3, poisson_ratio = 0.3 }} }}
concrete = {{ law = "elastic", parameters = {{ young_modulus = 10e6, poisson_ratio = 0.2 }} }}
skin = {{ law = "coulomb_joint", parameters = {{ normal_stiffness = 1e6, shear_stiffness = 1e5, cohesion = 0.0, friction_angle = 25.0, dilatancy_angle = 0.0 }} }}
[groups]
soil = {{ formulation = "solid", law = "soil" }}
block = {{ formulation = "solid", law = "concrete" }}
joint = {{ formulation = "zero_thickness", line = "joint", law = "skin" }}
[[phase]]
name = "press"
increments = 1
pressure = [{{ line = "top", value = 50.0 }}]
[[phase]]
name = "push"
increments = {increments}
force = [{{ line = "top", x = {} }}]
[solver]
force_tolerance = 1e-4
displacement_tolerance = 1e-2
"#,
            beyond * limit
        );
        let failed = fail(&text);
        let reached = failed.summary()["stopped_at"]["load_factor"].as_f64();
        let reached = beyond * reached.unwrap();
        assert!((reached - 1.0).abs() < 1e-3, "{beyond}: {reached}");
    }
}
