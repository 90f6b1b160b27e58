//! Forces through sections, and sums over areas, held against equilibrium.
//!
//! Goal      probes measure what they are named for.
//! Geometry  a column of 3 × 4 unequal quads under an end pressure, standing and lying; a round pile in a ring of
//!           soil with an interface along its whole shaft.
//! Asserts   the force through every section is the end load; through part of one its share. The integral of the
//!           friction is what equilibrium leaves to the shaft. Reactions next to an absent interface are those of
//!           the mesh without it.

use crate::setup::{Results, assert_close, run};
use std::f64::consts::PI;

const EXACT: f64 = 1e-9;

/// A column 1 m by 4 m under 10 kPa at its end, along y or x.
fn column(standing: bool, probes: &str, joint: bool) -> crate::setup::Finished {
    let (long, short) = if standing { ("y", "x") } else { ("x", "y") };
    let parts = [
        "{ n = 1, to = 0.2 }, { n = 2, to = 1.0 }",
        "{ n = 4, to = 4.0, ratio = 1.3 }",
    ];
    let [columns, rows] = if standing {
        parts
    } else {
        [parts[1], parts[0]]
    };
    let foot = "foot";
    let joint = if joint {
        "joint = { formulation = \"zero_thickness\", line = \"cut\", law = \"joint\" }"
    } else {
        ""
    };
    // The second grid line of four lengths 1, 1.3, 1.3², 1.3³ that make 4 m.
    let sum: f64 = (0..4).map(|i| 1.3_f64.powi(i)).sum();
    let cut = 4.0 * 2.3 / sum;
    run(&format!(
        r#"analysis = "plane_strain"
supports = [{{ line = "{foot}", fixed = ["{long}"] }}, {{ line = "side", fixed = ["{short}"] }}]
[mesh]
columns = [{columns}]
rows = [{rows}]
region = [{{ group = "column" }}]
[mesh.lines]
foot = {{ {long} = 0.0 }}
side = {{ {short} = 0.0 }}
head = {{ {long} = 4.0 }}
cut = {{ {long} = {cut:.17} }}
part = {{ {long} = {cut:.17}, {short} = [0.0, 0.2] }}
along = {{ {short} = 0.2 }}
[laws.column]
law = "elastic"
parameters = {{ young_modulus = 1e4, poisson_ratio = 0.3 }}
[laws.joint]
law = "coulomb_joint"
parameters = {{ normal_stiffness = 1e6, shear_stiffness = 4e5, cohesion = 10.0, friction_angle = 30.0, dilatancy_angle = 5.0 }}
[groups]
column = {{ formulation = "solid", integration = "full", law = "column" }}
{joint}
[[phase]]
name = "load"
increments = 1
pressure = [{{ line = "head", value = 10.0 }}]
[probes]
{probes}
"#
    ))
}

#[test]
fn the_force_through_a_section_is_the_load_beyond_it() {
    for (standing, axis) in [(true, "y"), (false, "x")] {
        let probe = |line: &str| {
            format!(
                "{line} = {{ line = \"{line}\", group = \"column\", quantity = \"force_{axis}\" }}\n"
            )
        };
        let probes: String = ["foot", "cut", "part", "head", "along"].map(probe).concat();
        let finished = column(standing, &probes, false);
        let close = |line: &str, expected: f64| {
            finished.ends_at(line, expected, EXACT, 10.0);
        };
        // Through the section, and through a part of it that ends inside; compression positive.
        close("cut", 10.0);
        close("part", 2.0);
        // On the outline, what the nodes there need: the foot pushes up, the head down.
        close("foot", 10.0);
        close("head", -10.0);
        // Nothing passes sideways along the column but its own stress: no shear.
        close("along", 0.0);
    }
}

#[test]
fn bodies_and_the_interface_between_them_pass_on_one_force() {
    for (standing, axis) in [(true, "y"), (false, "x")] {
        let probe = |group: &str| {
            format!(
                "{group} = {{ line = \"cut\", group = \"{group}\", quantity = \"force_{axis}\" }}\n"
            )
        };
        let probes: String = ["column", "joint"].map(probe).concat();
        let finished = column(standing, &probes, true);
        for group in ["column", "joint"] {
            finished.ends_at(group, 10.0, EXACT, 10.0);
        }
    }
}

/// A pile of 0.6 m in a ring of soil, 2 m long, pushed by 1 mm; with an interface or a thin layer
/// along all of its shaft, and elements that grow upward.
fn pile(layer: bool) -> crate::setup::Finished {
    let (columns, group, region) = if layer {
        (
            "{ n = 2, to = 0.3 }, { n = 1, to = 0.31 }, { n = 4, to = 2.0, ratio = 1.5 }",
            "{ formulation = \"thin_layer\", law = \"skin\", integration = \"mean\" }",
            "[[mesh.region]]\ngroup = \"skin\"\nr = [0.3, 0.31]\n",
        )
    } else {
        (
            "{ n = 2, to = 0.3 }, { n = 4, to = 2.0, ratio = 1.5 }",
            "{ formulation = \"zero_thickness\", line = \"shaft\", law = \"skin\" }",
            "",
        )
    };
    run(&format!(
        r#"analysis = "axisymmetric"
supports = [{{ line = "axis", fixed = ["r"] }}, {{ line = "wall", fixed = ["r", "z"] }}, {{ line = "base", fixed = ["z"] }}]
[mesh]
columns = [{columns}]
rows = [{{ n = 6, to = 2.0, ratio = 1.6 }}]
[[mesh.region]]
group = "soil"
[[mesh.region]]
group = "pile"
r = [0.0, 0.3]
{region}
[mesh.lines]
axis = {{ r = 0.0 }}
wall = {{ r = 2.0 }}
shaft = {{ r = 0.3 }}
head = {{ z = 2.0, r = [0.0, 0.3] }}
base = {{ z = 0.0, r = [0.0, 0.3] }}
[laws.soil]
law = "elastic"
parameters = {{ young_modulus = 20e3, poisson_ratio = 0.3 }}
[laws.pile]
law = "elastic"
parameters = {{ young_modulus = 1e5, poisson_ratio = 0.2 }}
[laws.skin]
law = "coulomb_joint"
parameters = {{ normal_stiffness = 1e6, shear_stiffness = 3e5, cohesion = 5.0, friction_angle = 20.0, dilatancy_angle = 0.0 }}
[groups]
soil = {{ formulation = "solid", integration = "full", law = "soil" }}
pile = {{ formulation = "solid", integration = "full", law = "pile" }}
skin = {group}
[[phase]]
name = "push"
increments = 5
displacement = [{{ line = "head", z = -0.001 }}]
[probes]
head = {{ line = "head", quantity = "reaction_z", scale = -1.0 }}
base = {{ line = "base", quantity = "reaction_z" }}
mean = {{ group = "skin", quantity = "traction_t" }}
average = {{ group = "skin", quantity = "traction_t", reduce = "average" }}
integral = {{ group = "skin", quantity = "traction_t", reduce = "integral" }}
volume = {{ group = "pile", quantity = "stress_22", reduce = "integral" }}
stress = {{ group = "pile", quantity = "stress_22", reduce = "average" }}
lower = {{ group = "skin", quantity = "traction_t", reduce = "integral", z = [-0.1, 0.5] }}
upper = {{ group = "skin", quantity = "traction_t", reduce = "integral", z = [0.5, 2.1] }}
edges = {{ group = "skin", quantity = "traction_t", reduce = "integral", z = [0.0, 2.0] }}
"#
    ))
}

#[test]
fn the_integral_of_the_friction_is_what_the_shaft_carries() {
    let finished = pile(false);
    let shaft = finished.last("head") - finished.last("base");
    let (mean, integral) = (finished.last("mean"), finished.last("integral"));
    assert!(shaft > 1.0, "the shaft carries {shaft} kN");
    assert_close("integral", integral, shaft, EXACT, shaft);
    // The whole turn times the length.
    let area = 2.0 * PI * 0.3 * 2.0;
    finished.ends_at("average", integral / area, EXACT, shaft / area);
    // Points are close where elements are small, so their arithmetic mean is another number.
    assert!((mean * area / shaft - 1.0).abs() > 0.01, "{}", mean * area);
    let parts = finished.last("lower") + finished.last("upper");
    assert_close("parts", parts, integral, EXACT, shaft);
    // Extents that end where the shaft does hold the points at its ends.
    assert_close("edges", finished.last("edges"), integral, EXACT, shaft);
    let volume = PI * 0.3 * 0.3 * 2.0;
    let stress = finished.last("stress");
    finished.ends_at("volume", stress * volume, EXACT, stress.abs() * volume);
    assert_eq!(finished.summary()["probe_units"]["integral"], "kN");
}

#[test]
fn so_it_is_of_a_layer() {
    let finished = pile(true);
    let shaft = finished.last("head") - finished.last("base");
    // Strains linear across the layer do exactly the work of its faces' slip.
    assert_close("integral", finished.last("integral"), shaft, EXACT, shaft);
}

/// The end inside the mesh is not doubled: the interface's share there is handed on all the same.
#[test]
fn an_interface_that_ends_inside_hands_on_all_of_its_traction() {
    let finished = run(r#"analysis = "plane_strain"
supports = [{ line = "base", fixed = ["x", "y"] }]
[mesh]
columns = [{ n = 4, to = 1.0 }]
rows = [{ n = 4, to = 1.0 }]
region = [{ group = "block" }]
lines = { base = { y = 0.0 }, top = { y = 1.0 }, half = { y = 0.5, x = [0.0, 0.5] } }
[laws]
elastic = { law = "elastic", parameters = { young_modulus = 34e3, poisson_ratio = 0.0 } }
joint = { law = "coulomb_joint", parameters = { normal_stiffness = 1e7, shear_stiffness = 1e7, cohesion = 1000.0, friction_angle = 30.0, dilatancy_angle = 0.0 } }
[groups]
block = { formulation = "solid", integration = "full", law = "elastic", initial_stress = [0.0, -100.0, 0.0, 0.0] }
joint = { formulation = "zero_thickness", line = "half", integration = "nodes", law = "joint" }
[[phase]]
name = "one"
increments = 1
pressure = [{ line = "top", value = 100.0 }]
[probes]
force = { line = "half", group = "joint", quantity = "force_y" }
traction = { group = "joint", quantity = "traction_n", reduce = "integral" }
"#);
    // 100 kPa on half a metre.
    assert_close("force", finished.last("force"), 50.0, EXACT, 50.0);
    assert_close("traction", finished.last("traction"), -50.0, EXACT, 50.0);
}

/// Two blocks with an absent wall between them. The reaction of a line that ends at the wall is that of one block: on
/// either side, with the blocks to the right or to the left, condensed or not.
#[test]
fn reactions_beside_an_interface_that_is_not_there_are_those_without_it() {
    let case = |side: f64, wall: bool, pushed: &str, equations: &str| {
        let x = |a: f64, b: f64| {
            let (a, b) = (side * a, side * b);
            format!("x = [{:?}, {:?}]", a.min(b), a.max(b))
        };
        let (near, far, whole) = (x(0.0, 1.0), x(1.0, 2.0), x(0.0, 2.0));
        let first = if side > 0.0 { 0.0 } else { -2.0 };
        let joint = if wall {
            "wall = { formulation = \"zero_thickness\", line = \"wall\", law = \"wall\", active = false }"
        } else {
            ""
        };
        format!(
            r#"
analysis = "plane_strain"
supports = [{{ line = "bottom", fixed = ["x", "y"] }}]
[mesh]
origin = [{first:?}, 0.0]
columns = [{{ n = 4, to = {:?} }}]
rows = [{{ n = 2, to = 1.0 }}]
lines.bottom = {{ {whole}, y = 0.0 }}
lines.near = {{ {near}, y = 1.0 }}
lines.far = {{ {far}, y = 1.0 }}
lines.wall = {{ x = {side:?}, y = [0.0, 1.0] }}
[[mesh.region]]
group = "near"
[[mesh.region]]
group = "far"
{far}
[laws]
soil = {{ law = "elastic", parameters = {{ young_modulus = 20e3, poisson_ratio = 0.3 }} }}
wall = {{ law = "coulomb_joint", parameters = {{ normal_stiffness = 1e6, shear_stiffness = 3e5, cohesion = 20.0, friction_angle = 25.0, dilatancy_angle = 1.0 }} }}
[groups]
near = {{ formulation = "solid", law = "soil" }}
far = {{ formulation = "solid", law = "soil" }}
{joint}
[[phase]]
name = "push"
increments = 2
displacement = [{{ line = "{pushed}", y = -0.01 }}]
[probes]
near = {{ line = "near", quantity = "reaction_y" }}
far = {{ line = "far", quantity = "reaction_y" }}
bottom = {{ line = "bottom", quantity = "reaction_y" }}
[solver]
equations = "{equations}"
"#,
            first + 2.0
        )
    };
    for pushed in ["near", "far"] {
        let of = |side, wall, equations| {
            let finished = run(&case(side, wall, pushed, equations));
            ["near", "far", "bottom"].map(|probe| finished.last(probe))
        };
        let expected = of(1.0, false, "sparse");
        for (side, wall, equations) in [
            (-1.0, false, "sparse"),
            (1.0, true, "sparse"),
            (1.0, true, "condensed"),
            (-1.0, true, "condensed"),
        ] {
            let found = of(side, wall, equations);
            for (value, expected_value) in found.into_iter().zip(expected) {
                let what = format!("{pushed} {side} {wall} {equations}");
                assert_close(&what, value, expected_value, 1e-9, expected[2]);
            }
        }
    }
}
