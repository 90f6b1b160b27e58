//! Two bodies in one model that do not touch.
//!
//! Goal        what one body carries does not loosen the tolerances of another
//! Geometry    two blocks side by side with a wall between them whose sides are fixed
//! Boundary    each on its own base, its outer side free; pressed from above, the first 10¹¹ times
//!             as hard
//! Law         mohr_coulomb, 10⁹ times as stiff in the first block; elastic in the wall
//! Asserts     the second block carries and settles as it does alone; of one body nothing changes

use crate::setup::{Results, run};

/// The two blocks, or the second alone.
fn blocks(with_first: bool, solver: &str) -> String {
    let (stiffness, cohesion, pressure) = if with_first {
        ("34e12", "1e14", "2.5e11")
    } else {
        ("34e3", "1e5", "0.0")
    };
    format!(
        r#"
analysis = "plane_strain"
[mesh]
origin = [0.0, 0.0]
columns = [{{ n = 2, to = 1.0 }}, {{ n = 1, to = 1.1 }}, {{ n = 2, to = 2.1 }}]
rows = [{{ n = 2, to = 1.0 }}]
[[mesh.region]]
group = "wall"
[[mesh.region]]
group = "first"
x = [0.0, 1.0]
[[mesh.region]]
group = "second"
x = [1.1, 2.1]
[mesh.lines]
base = {{ y = 0.0 }}
left = {{ x = 1.0 }}
right = {{ x = 1.1 }}
first_top = {{ y = 1.0, x = [0.0, 1.0] }}
second_top = {{ y = 1.0, x = [1.1, 2.1] }}
[laws]
elastic = {{ law = "elastic", parameters = {{ young_modulus = 34e3, poisson_ratio = 0.3 }} }}
rock = {{ law = "mohr_coulomb", parameters = {{ young_modulus = {stiffness}, poisson_ratio = 0.3, cohesion = {cohesion}, friction_angle = 20.0, dilatancy_angle = 10.0 }} }}
ground = {{ law = "mohr_coulomb", parameters = {{ young_modulus = 34e3, poisson_ratio = 0.3, cohesion = 1.0, friction_angle = 20.0, dilatancy_angle = 10.0 }} }}
[groups]
wall = {{ formulation = "solid", law = "elastic" }}
first = {{ formulation = "solid", law = "rock" }}
second = {{ formulation = "solid", law = "ground" }}
[[supports]]
line = "base"
fixed = ["x", "y"]
[[supports]]
line = "left"
fixed = ["x", "y"]
[[supports]]
line = "right"
fixed = ["x", "y"]
[[phase]]
name = "press"
increments = 1
pressure = [{{ line = "first_top", value = {pressure} }}, {{ line = "second_top", value = 2.5 }}]
[probes]
settlement = {{ line = "second_top", quantity = "displacement_y" }}
plastic = {{ group = "second", quantity = "plastic_strain", reduce = "max" }}
[solver]
{solver}
"#
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
