//! Two bodies in one model that do not touch.
//!
//! Goal        what one body carries does not loosen the tolerances of another
//! Geometry    two blocks side by side, of two elements each, with a gap between them
//! Boundary    each on its own base, free at its sides; pressed from above, the first 10¹¹ times
//!             as hard
//! Law         elastic; mohr_coulomb in the second block
//! Asserts     the second block carries and settles as it does alone; of one body nothing changes

use crate::setup::{Results, run};

/// The two blocks, or the second alone.
fn blocks(with_first: bool, solver: &str) -> String {
    let first = |text: &'static str| if with_first { text } else { "" };
    format!(
        r#"
analysis = "plane_strain"
[mesh]
origin = [0.0, 0.0]
columns = [{{ n = 1, to = 1.0 }}, {{ n = 1, to = 2.0 }}, {{ n = 2, to = 3.0 }}]
rows = [{{ n = 2, to = 1.0 }}]
{}
[[mesh.region]]
group = "second"
x = [2.0, 3.0]
[mesh.lines]
{}
second_base = {{ y = 0.0, x = [2.0, 3.0] }}
second_top = {{ y = 1.0, x = [2.0, 3.0] }}
[laws]
{}
ground = {{ law = "mohr_coulomb", parameters = {{ young_modulus = 34e3, poisson_ratio = 0.3, cohesion = 1.0, friction_angle = 20.0, dilatancy_angle = 10.0 }} }}
[groups]
{}
second = {{ formulation = "solid", law = "ground" }}
{}
[[supports]]
line = "second_base"
fixed = ["x", "y"]
[[phase]]
name = "press"
increments = 1
pressure = [{}{{ line = "second_top", value = 2.5 }}]
[probes]
settlement = {{ line = "second_top", quantity = "displacement_y" }}
plastic = {{ group = "second", quantity = "plastic_strain", reduce = "max" }}
[solver]
{solver}
"#,
        first("[[mesh.region]]\ngroup = \"first\"\nx = [0.0, 1.0]"),
        first("first_base = { y = 0.0, x = [0.0, 1.0] }\nfirst_top = { y = 1.0, x = [0.0, 1.0] }"),
        first("rock = { law = \"mohr_coulomb\", parameters = { young_modulus = 34e12, poisson_ratio = 0.3, cohesion = 1e14, friction_angle = 20.0, dilatancy_angle = 10.0 } }"),
        first("first = { formulation = \"solid\", law = \"rock\" }"),
        first("[[supports]]\nline = \"first_base\"\nfixed = [\"x\", \"y\"]"),
        first("{ line = \"first_top\", value = 2.5e11 }, "),
    )
}

#[test]
fn the_weaker_of_two_bodies_is_as_it_is_alone() {
    for solver in ["", "method = \"newton\"", "method = \"modified_newton\""] {
        let (alone, together) = (run(&blocks(false, solver)), run(&blocks(true, solver)));
        assert!(alone.last("plastic") > 0.0, "it yields");
        for probe in ["settlement", "plastic"] {
            let (alone, together) = (alone.last(probe), together.last(probe));
            // The displacement criterion of 1e-7, in a body of two unknown directions, converges
            // quadratically to much less.
            assert!(
                (together / alone - 1.0).abs() < 1e-7,
                "{solver} {probe}: {together:e} beside the other, {alone:e} alone"
            );
        }
    }
}
