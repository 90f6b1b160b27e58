//! Two bodies in one model that do not touch.
//!
//! Goal        forces in one body do not loosen the tolerances of another.
//! Geometry    two blocks side by side with a wall between them whose sides are fixed.
//! Boundary    each block on a separate base, its outer side free; pressed from above, the first 10¹¹ times as
//!             hard.
//! Law         mohr_coulomb, 10⁹ times as stiff in the first block; elastic in the wall.
//! Asserts     the second block carries and settles as it does alone; many bodies balance together; a body moved as a
//!             whole has no forces; earlier loads do not widen the tolerance.

use crate::setup::{Results, run};
use tests::tolerance::near;

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
supports = [{{ line = "base", fixed = ["x", "y"] }}, {{ line = "left", fixed = ["x", "y"] }}, {{ line = "right", fixed = ["x", "y"] }}]
[mesh]
origin = [0.0, 0.0]
columns = [{{ n = 2, to = 1.0 }}, {{ n = 1, to = 1.1 }}, {{ n = 2, to = 2.1 }}]
rows = [{{ n = 2, to = 1.0 }}]
region = [{{ group = "wall" }}, {{ group = "first", x = [0.0, 1.0] }}, {{ group = "second", x = [1.1, 2.1] }}]
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
wall = {{ formulation = "solid", integration = "full", law = "elastic" }}
first = {{ formulation = "solid", integration = "full", law = "rock" }}
second = {{ formulation = "solid", integration = "full", law = "ground" }}
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

/// Each body may be left with its own residual: the sum of many is no larger than √B of them.
#[test]
fn many_bodies_balance_together() {
    let n = 12;
    let of_all = |part: &dyn Fn(i32, f64) -> String| -> String {
        let parts: Vec<String> = (0..n)
            .map(|body| part(body, 1.5 * f64::from(body)))
            .collect();
        parts.concat()
    };
    let columns = of_all(&|_, x| {
        format!(
            "{{ n = 1, to = {} }}, {{ n = 1, to = {} }}, ",
            x + 1.0,
            x + 1.5
        )
    });
    let regions = of_all(&|_, x| {
        format!(
            "[[mesh.region]]\ngroup = \"ground\"\nx = [{x}, {}]\n",
            x + 1.0
        )
    });
    let lines = of_all(&|body, x| {
        let (right, next) = (x + 1.0, x + 1.5);
        format!(
            "top_{body} = {{ y = 1.0, x = [{x}, {right}] }}\nl_{body} = {{ x = {right} }}\nr_{body} = {{ x = {next} }}\n"
        )
    });
    let supports = of_all(&|body, _| {
        let side = |side: &str| {
            format!("[[supports]]\nline = \"{side}_{body}\"\nfixed = [\"x\", \"y\"]\n")
        };
        side("l") + &side("r")
    });
    let pressure = of_all(&|body, _| format!("{{ line = \"top_{body}\", value = 6.0 }}, "));
    let finished = run(&format!(
        r#"
analysis = "plane_strain"
[mesh]
origin = [0.0, 0.0]
columns = [{columns}]
rows = [{{ n = 2, to = 1.0 }}]
[[mesh.region]]
group = "wall"
{regions}
[mesh.lines]
left = {{ x = 0.0 }}
base = {{ y = 0.0 }}
{lines}
[laws]
elastic = {{ law = "elastic", parameters = {{ young_modulus = 34e3, poisson_ratio = 0.3 }} }}
mc = {{ law = "mohr_coulomb", parameters = {{ young_modulus = 34e3, poisson_ratio = 0.3, cohesion = 1.0, friction_angle = 20.0, dilatancy_angle = 0.0 }} }}
[groups]
wall = {{ formulation = "solid", integration = "full", law = "elastic" }}
ground = {{ formulation = "solid", integration = "full", law = "mc" }}
[[supports]]
line = "base"
fixed = ["x", "y"]
[[supports]]
line = "left"
fixed = ["x", "y"]
{supports}
[[phase]]
name = "press"
increments = 1
pressure = [{pressure}]
[probes]
settlement = {{ line = "top_0", quantity = "displacement_y" }}
[solver]
method = "initial_stress"
equations = "sparse"
force_tolerance = 1e-3
displacement_tolerance = 0.1
"#
    ));
    assert!(finished.last("settlement") < 0.0);
}

/// A body that nothing presses, moved as a whole: no force, whatever it was moved by before.
#[test]
fn a_body_is_moved_as_a_whole_without_force() {
    for law in [
        "{ law = \"elastic\", parameters = { young_modulus = 2.1e8, poisson_ratio = 0.3 } }",
        "{ law = \"mohr_coulomb\", parameters = { young_modulus = 34e3, poisson_ratio = 0.3, cohesion = 1.0, friction_angle = 20.0, dilatancy_angle = 10.0 } }",
    ] {
        for equations in ["auto", "sparse"] {
            let finished = run(&format!(
                r#"
analysis = "plane_strain"
supports = [{{ line = "base", fixed = ["y"] }}]
[mesh]
columns = [{{ n = 3, to = 1.0 }}]
rows = [{{ n = 3, to = 1.0 }}]
region = [{{ group = "block" }}]
lines = {{ base = {{ y = 0.0 }}, top = {{ y = 1.0 }} }}
[laws]
ground = {law}
[groups]
block = {{ formulation = "solid", integration = "full", law = "ground" }}
[[phase]]
name = "one"
increments = 2
displacement = [{{ line = "base", x = 0.001 }}]
[[phase]]
name = "two"
increments = 2
displacement = [{{ line = "base", x = 0.1 }}]
[probes]
force = {{ line = "base", quantity = "reaction_x" }}
top = {{ line = "top", quantity = "displacement_x" }}
[solver]
equations = "{equations}"
"#
            ));
            assert!(
                (finished.last("top") - 0.1).abs() < 1e-12,
                "{law} {equations}"
            );
            // The last bits of displacements of 0.1 m times the stiffness.
            assert!(
                finished.last("force").abs() < 2.1e8 * 0.1 * 1e-12,
                "{law} {equations}"
            );
        }
    }
}

/// A past pressure does not loosen later tolerances.
#[test]
fn earlier_loads_do_not_widen_the_tolerance() {
    let settlement = |before: &str| {
        run(&format!(
            r#"
analysis = "plane_strain"
supports = [{{ line = "base", fixed = ["y"] }}, {{ line = "left", fixed = ["x"] }}, {{ line = "right", fixed = ["x"] }}]
[mesh]
columns = [{{ n = 3, to = 1.0 }}, {{ n = 4, to = 5.0 }}]
rows = [{{ n = 6, to = 4.0 }}]
region = [{{ group = "ground" }}]
lines = {{ base = {{ y = 0.0 }}, left = {{ x = 0.0 }}, right = {{ x = 5.0 }}, top = {{ y = 4.0 }}, strip = {{ y = 4.0, x = [0.0, 1.0] }} }}
[laws]
elastic = {{ law = "elastic", parameters = {{ young_modulus = 34e3, poisson_ratio = 0.3 }} }}
mc = {{ law = "mohr_coulomb", parameters = {{ young_modulus = 34e3, poisson_ratio = 0.3, cohesion = 1.0, friction_angle = 30.0, dilatancy_angle = 0.0 }} }}
[groups]
ground = {{ formulation = "solid", integration = "full", law = "elastic" }}
{before}
[[phase]]
name = "footing"
increments = 4
laws = {{ ground = "mc" }}
reset_displacements = true
pressure = [{{ line = "top", value = 0.0 }}, {{ line = "strip", value = 15.0 }}]
[probes]
s = {{ line = "strip", quantity = "displacement_y" }}
[solver]
method = "initial_stress"
force_tolerance = 1e-3
displacement_tolerance = 1e-3
"#
        ))
        .last("s")
    };
    let alone = settlement("");
    let after = settlement(
        r#"[[phase]]
name = "preload"
increments = 1
pressure = [{ line = "top", value = 1e6 }]
[[phase]]
name = "unload"
increments = 1
pressure = [{ line = "top", value = 0.0 }]"#,
    );
    // Both within the tolerances of 1e-3; the load before was 7e4 times as large.
    near(after / alone, 1.0, 5e-3);
}
