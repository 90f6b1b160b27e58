//! Grids, regions and lines that do not fit together.

use crate::program::{BAD_INPUT, JOINT, Place, edited, refuses, refuses_in};
use tests::words::rows_of;

#[test]
fn refuses_impossible_grids() {
    refuses(
        r#"
a thousand million columns
  { n = 1, to = 2.0 } => ^{ n = 1000000000, to = 2.0 }
  `n` is 1000000000, expected 1 to 4000000
too many elements
  columns = [ => columns = ^[
  n = 1, to = 2.0 => n = 3000000, to = 2.0
  3000002 columns × 2 rows
  at most 4000000 elements
no columns
  columns = [\n  { n = 1, to = 1.0 },\n  { n = 1, to = 1.01 },\n  { n = 1, to = 2.0 },\n] => columns = ^[]
  `columns` is empty
zero columns
  { n = 1, to = 2.0 } => ^{ n = 0, to = 2.0 }
  `n` is 0
backwards
  { n = 1, to = 2.0 } => ^{ n = 1, to = 0.5 }
  `to` is 0.5, expected more than 1.01
negative ratio
  { n = 1, to = 2.0 } => ^{ n = 1, to = 2.0, ratio = -1.0 }
  `ratio` is -1, expected a positive number
a ratio that leaves nothing
  { n = 1, to = 2.0 } => ^{ n = 9, to = 2.0, ratio = 1e99 }
  leaves parts of no size
beyond the moon
  { n = 1, to = 2.0 } => ^{ n = 1, to = 1e300 }
  `to` is 1e300, expected at most 1e9 m
a column of no width
  columns = [ => columns = ^[
  to = 1.01 => to = 1.0000000001
  between 1.0 and 1.0000000001 are thinner
across the axis
  "plane_strain" => "axisymmetric"
  columns => origin = ^[-1.0, 0.0]\ncolumns
  the mesh starts at r = -1, across the axis
"#,
    );
}

#[test]
fn refuses_regions_off_the_grid() {
    refuses(
        r#"
an end between grid lines
  x = [1.0, 1.01] => x = ^[1.0, 1.02]
  region of group `layer`: 1.02 is no grid line, the nearest is 1.01
ends the wrong way round
  x = [1.0, 1.01] => x = ^[1.01, 1.0]
  region of group `layer`: its extent is empty, expected [smaller, larger]
an element without a region
  group = "soil" => group = "soil"\nx = [0.0, 1.0]
  group = "layer" => group = ^"layer"
  the element at (1.505000, 0.250000) belongs to no region
a group without elements
  group = "layer"\nx = [1.0, 1.01] => group = "soil"
  [groups.layer] => [groups.^layer]
  no element belongs to group `layer`
"#,
    );
}

#[test]
fn refuses_lines_that_match_nothing_or_only_in_part() {
    refuses(
        "
between grid lines
  left = { x = 0.0 } => left = ^{ x = 0.3 }
  line `left`: 0.3 is no grid line, the nearest is 0
an end between grid lines
  left = { x = 0.0 } => left = ^{ x = 0.0, y = [0.0, 0.7] }
  line `left`: 0.7 is no grid line, the nearest is 0.5
an end outside
  left = { x = 0.0 } => left = ^{ x = 0.0, y = [0.0, 9.0] }
  line `left`: 9 is no grid line, the nearest is 1
ends the wrong way round
  left = { x = 0.0 } => left = ^{ x = 0.0, y = [1.0, 0.0] }
  line `left`: its extent is empty, expected [smaller, larger]
no position
  left = { x = 0.0 } => left = ^{ y = [0.0, 1.0] }
  line `left`: one coordinate must be a number
nothing
  left = { x = 0.0 } => left = ^{}
  line `left`: one coordinate
a point without a node
  left = { x = 0.0 } => left = ^{ x = 0.3, y = 0.2 }
  line `left`: there is no node at this point
",
    );
}

/// Mistakes in the case whose joint lies along the middle.
fn refuses_joints(mistakes: &str) {
    refuses_in(&edited(JOINT), BAD_INPUT, mistakes);
}

#[test]
fn refuses_joints_where_none_can_be() {
    refuses_joints(
        r#"
no line
  line = "middle"\n =>
  [groups.layer] => [groups.^layer]
  group `layer` needs a `line`
an unknown line
  line = "middle"\n => line = ^"midle"\n
  there is no line `midle`
  did you mean `middle`?
the boundary
  line = "middle"\n => line = ^"top"\n
  group `layer`: the line lies on the boundary
a point
  line = "middle"\n => line = ^"corner"\n
  group `layer`: the line is a point
where another group is
  [mesh.lines] => [mesh.lines]\nhalf = { y = 0.5, x = [0.0, 1.0] }
  [[supports]] => [groups.more]\nformulation = "zero_thickness"\nline = ^"half"\nlaw = "joint"\n\n[[supports]]
  group `more`: the line has elements of group `layer` already
a region
  group = "soil" => group = "soil"\n[[mesh.region]]\ngroup = ^"layer"
  `zero_thickness` group is inserted along a line
a direction
  line = "middle"\n => line = "middle"\nnormal = ^"x"\n
  `normal` does not go with the formulation `zero_thickness`
points of a layer
  line = "middle"\n => line = "middle"\nintegration = ^"mean"\n
  `integration` does not go with the formulation `zero_thickness`
"#,
    );
}

#[test]
fn refuses_keys_of_other_formulations() {
    refuses(
        r#"
earth pressure of a layer
  "thin_layer"\n => "thin_layer"\ninitial_stress = ^{ k_0 = 0.5 }\n
  earth pressure at rest (`k_0`, `ocr`, …) is that of `solid` groups, not of the formulation `thin_layer`
  give its stresses
line of a solid
  "solid"\n => "solid"\nline = ^"top"\n
  `line` only belongs to the formulation `zero_thickness`
points of a joint in a solid
  "solid"\nintegration = "full"\n => "solid"\nintegration = ^"nodes"\n
  `integration` does not go with the formulation `solid`
a layer as thick as long
  to = 1.01 => to = 1.5
  x = [1.0, 1.01] => x = [1.0, 1.5]
  [groups.layer] => [groups.^layer]
  which way is across the layer?
  say `normal
"#,
    );
}

const ROW: &str = "[mesh.lines]\nwest = { y = 0.5, x = [0.0, 1.0] }\n\
    centre = { y = 0.5, x = [1.0, 1.01] }\neast = { y = 0.5, x = [1.01, 2.0] }\n\
    stub = { x = 1.01, y = [0.5, 1.0] }";

const CROSS: &str = "[mesh.lines]\nupright = { x = 1.0 }\nwest = { y = 0.5, x = [0.0, 1.0] }\n\
    east = { y = 0.5, x = [1.0, 2.0] }\nsouth = { x = 1.0, y = [0.0, 0.5] }\n\
    north = { x = 1.0, y = [0.5, 1.0] }";

/// The case with more lines, and joints along these of them, in this order: what its top settles.
fn settlement(more_lines: &str, lines: &[&str]) -> Vec<f64> {
    let group = |line: &&str| {
        format!(
            "[groups.{line}]\nformulation = \"zero_thickness\"\nline = \"{line}\"\n\
             law = \"joint\"\n"
        )
    };
    let more: String = lines[1..].iter().map(group).collect();
    let text = edited(JOINT)
        .replace("[mesh.lines]", more_lines)
        .replace("line = \"middle\"\n", &format!("line = \"{}\"\n", lines[0]))
        .replace("[[supports]]", &format!("{more}\n[[supports]]"))
        .replace("tau = { group = \"layer\"", "tau = { group = \"soil\"")
        .replace("\"traction_t\"", "\"stress_12\"");
    let place = Place::new();
    place.done_case(text);
    tests::case::column(&place.path("out/history.csv"), "settlement")
}

/// A line that ends on one of three that go on from one another, before or after it: the bodies
/// come apart in the same way whatever the order of the groups.
#[test]
fn joints_may_end_on_one_another() {
    let one = settlement(ROW, &["middle", "stub"]);
    let without = settlement(ROW, &["middle"]);
    assert!(
        one.iter()
            .zip(&without)
            .any(|(a, b)| (a / b - 1.0).abs() > 1e-6)
    );
    for lines in [
        &["stub", "middle"][..],
        &["stub", "west", "centre", "east"],
        &["west", "centre", "stub", "east"],
    ] {
        for (other, one) in settlement(ROW, lines).iter().zip(&one) {
            approx::assert_relative_eq!(other, one, max_relative = 1e-6);
        }
    }
}

/// The joint of the case in one group, and in three that go on from one another: the same answer.
#[test]
fn joints_may_go_on_from_one_another() {
    let one = settlement(ROW, &["middle"]);
    for parts in [["west", "centre", "east"], ["centre", "east", "west"]] {
        for (parts, one) in settlement(ROW, &parts).iter().zip(&one) {
            approx::assert_relative_eq!(parts, one, max_relative = 1e-9);
        }
    }
}

/// The joint of the case and one across it, in any order of their groups, each in one group or in
/// two that go on from one another where they cross: the same answer.
#[test]
fn joints_may_cross() {
    let one = settlement(CROSS, &["middle", "upright"]);
    for other in [
        &["upright", "middle"][..],
        &["upright", "west", "east"],
        &["west", "upright", "east"],
        &["east", "west", "upright"],
        &["west", "south", "east", "north"],
    ] {
        for (one, other) in one.iter().zip(&settlement(CROSS, other)) {
            approx::assert_relative_eq!(one, other, max_relative = 1e-6);
        }
    }
}

/// Two blocks of 1 m by 0.5 m, the upper one in a hollow of this depth, as Gmsh writes them.
fn blocks(depth: f64) -> String {
    format!(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n5\n1 1 \"bottom\"\n1 2 \"between\"\n\
         1 3 \"top\"\n2 4 \"soil\"\n0 5 \"corner\"\n$EndPhysicalNames\n$Nodes\n13\n1 0 0 0\n\
         2 1 0 0\n3 1 0.5 0\n4 0 0.5 0\n5 1 1 0\n6 0 1 0\n7 0.5 0 0\n8 1 0.25 0\n9 0.5 {} 0\n\
         10 0 0.25 0\n11 1 0.75 0\n12 0.5 1 0\n13 0 0.75 0\n$EndNodes\n$Elements\n6\n\
         1 8 2 1 1 1 2 7\n2 8 2 2 2 3 4 9\n3 8 2 3 3 6 5 12\n4 16 2 4 1 1 2 3 4 7 8 9 10\n\
         5 16 2 4 2 4 3 5 6 9 11 12 13\n6 15 2 5 2 2\n$EndElements\n",
        0.5 - depth
    )
}

/// Blocks with a joint between them, pressed and pushed.
fn two_blocks(mesh: &str) -> String {
    format!(
        "analysis = \"plane_strain\"\n{mesh}\n\
         [laws.soil]\nlaw = \"elastic\"\n\
         parameters = {{ young_modulus = 1e4, poisson_ratio = 0.3 }}\n\
         [laws.joint]\nlaw = \"coulomb_joint\"\n[laws.joint.parameters]\n\
         normal_stiffness = 1e6\nshear_stiffness = 4e5\ncohesion = 10.0\nfriction_angle = 30.0\n\
         dilatancy_angle = 5.0\n\
         [groups]\nsoil = {{ formulation = \"solid\", integration = \"full\", law = \"soil\" }}\n\
         joint = {{ formulation = \"zero_thickness\", law = \"joint\", line = \"between\" }}\n\
         [[supports]]\nline = \"bottom\"\nfixed = [\"x\", \"y\"]\n\
         [[phase]]\nname = \"press\"\nincrements = 2\n\
         pressure = [{{ line = \"top\", value = 10.0 }}]\n\
         [[phase]]\nname = \"push\"\nincrements = 4\n\
         displacement = [{{ line = \"top\", x = 2e-3 }}]\n\
         [probes]\n\
         settlement = {{ line = \"top\", quantity = \"displacement_y\" }}\n\
         push = {{ line = \"top\", quantity = \"reaction_x\" }}\n\
         tau = {{ group = \"joint\", quantity = \"traction_t\", reduce = \"integral\" }}\n"
    )
}

/// A mesh from a file gives the same results as that grid; names that the case does not use are
/// reported once.
#[test]
fn a_mesh_from_a_file_is_that_of_the_grid() {
    const GRID: &str = "mesh.columns = [{ n = 1, to = 1.0 }]\nmesh.rows = [{ n = 2, to = 1.0 }]\n\
        mesh.region = [{ group = \"soil\" }]\nmesh.lines = { bottom = { y = 0.0 }, \
        between = { y = 0.5 }, top = { y = 1.0 } }";
    let place = Place::new();
    let history = |mesh: &str| {
        let outcome = place.done_case(two_blocks(mesh));
        let columns = ["settlement", "push", "tau"];
        let values = columns.map(|c| tests::case::column(&place.path("out/history.csv"), c));
        (values.concat(), outcome.stderr)
    };
    place.write("blocks.msh", blocks(0.0));
    let (grid, _) = history(GRID);
    let (file, said) = history("mesh.file = \"blocks.msh\"");
    for (file, grid) in file.iter().zip(&grid) {
        approx::assert_relative_eq!(file, grid, epsilon = 1e-13, max_relative = 1e-11);
    }
    let unused = "blocks.msh: physical curves and points that the case does not use: `corner`";
    assert_eq!(said.matches("the case does not use").count(), 1, "{said}");
    assert!(said.replace('\n', " ").contains(unused), "{said}");
    // With the ends of lines that Windows writes.
    place.write("blocks.msh", blocks(0.0).replace('\n', "\r\n"));
    let (again, _) = history("mesh = { file = \"blocks.msh\", scale = 1.0 }");
    assert_eq!(again, file);
    // The joint follows its curve.
    place.write("blocks.msh", blocks(0.01));
    let (hollow, _) = history("mesh.file = \"blocks.msh\"");
    assert!((hollow[0] / grid[0] - 1.0).abs() > 1e-5, "{hollow:?}");
}

/// Mistakes in a mesh's file are reported with their line, and the exit code is that of bad input.
#[test]
fn refuses_mesh_files_that_are_wrong() {
    let place = Place::new();
    for [old, new, says] in rows_of(
        "
8 1 0.25 0 | 8 1 0.25 0.1 | line 21: node 8 is at z = 0.1
5 16 2 4 2 | 5 36 2 4 2 | line 34: an element of type 36 is a quad of higher order
$EndNodes | $EndKnots | line 27: expected `$EndNodes`
",
    ) {
        assert_eq!(blocks(0.0).matches(old).count(), 1, "{old}");
        place.write("blocks.msh", blocks(0.0).replace(old, new));
        let outcome = place.refused_case(two_blocks("mesh.file = \"blocks.msh\""));
        outcome.shows(says).shows("cannot read blocks.msh");
    }
    let outcome = place.refused_case(two_blocks("mesh.file = \"none.msh\""));
    outcome
        .shows("cannot read none.msh: ")
        .shows("mesh.file = \"none.msh\"");
}

/// The mesh of the tutorial's pile, and the same one without the nodes in the middles of its sides.
#[expect(
    clippy::unwrap_used,
    clippy::format_push_string,
    reason = "part of the tests"
)]
fn pile_meshes() -> [String; 2] {
    const FILE: &str = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../host/docs/tutorial/my_pile.msh"
    );
    let second = std::fs::read_to_string(FILE).unwrap();
    let (head, elements) = second.split_once("$Elements\n").unwrap();
    let mut first = head.to_owned() + "$Elements\n";
    let mut lines = elements.lines();
    first += &format!("{}\n", lines.next().unwrap());
    while let Some(line) = lines.next().filter(|line| !line.starts_with('$')) {
        let words: Vec<&str> = line.split_whitespace().collect();
        let (kind, n) = match words[2] {
            "8" => ("1", 2),
            "9" => ("2", 3),
            other => (other, 1),
        };
        first += &format!("{} {} {kind} {}\n", words[0], words[1], words[3]);
        for _ in 0..words[3].parse().unwrap() {
            let words: Vec<&str> = lines.next().unwrap().split_whitespace().collect();
            first += &format!("{}\n", words[..=n].join(" "));
        }
    }
    first += "$EndElements\n";
    [second, first]
}

/// A mesh of first order gets its middles where Gmsh puts them on straight sides: the pile, with interfaces along
/// lines of two nodes, settles as on that of second order.
#[test]
fn a_pile_on_a_mesh_of_first_order_is_that_of_second_order() {
    const CASE: &str = r#"
analysis = "axisymmetric"
mesh.file = "pile.msh"
laws.soil = { law = "mohr_coulomb", parameters = { young_modulus = 12e3, poisson_ratio = 0.3, cohesion = 10.0, friction_angle = 23.0, dilatancy_angle = 0.0 } }
laws.concrete = { law = "elastic", parameters = { young_modulus = 30e6, poisson_ratio = 0.2 } }
laws.skin = { law = "coulomb_joint", parameters = { normal_stiffness = 1e6, shear_stiffness = 1e5, cohesion = 0.0, friction_angle = 28.0, dilatancy_angle = 0.0 } }
groups.pile = { formulation = "solid", law = "concrete", unit_weight = 19.0, initial_stress = { k_0 = 0.6 } }
groups.clay = { formulation = "solid", law = "soil", unit_weight = 19.0, initial_stress = { k_0 = 0.6 } }
groups.sand = { formulation = "solid", law = "soil", unit_weight = 19.0, initial_stress = { k_0 = 0.6 } }
groups.upper = { formulation = "zero_thickness", line = "shaft_clay", law = "skin" }
groups.lower = { formulation = "zero_thickness", line = "shaft_sand", law = "skin" }
groups.base = { formulation = "zero_thickness", line = "base", law = "skin" }
supports = [{ line = "axis", fixed = ["r"] }, { line = "far", fixed = ["r"] }, { line = "bottom", fixed = ["r", "z"] }]
phase = [{ name = "test", increments = 3, rigid = ["head"], force = [{ line = "head", z = -600.0 }] }]
[probes]
settlement = { line = "head", quantity = "displacement_z", scale = -1000.0 }
shaft = { group = "lower", quantity = "traction_t", reduce = "integral" }
base = { group = "base", quantity = "traction_n", reduce = "integral" }
"#;
    let place = Place::new();
    let mut is_first = false;
    let [second, first] = pile_meshes().map(|mesh| {
        place.write("pile.msh", mesh);
        let outcome = place.done_case(CASE);
        let said = "597 elements are of first order";
        assert_eq!(outcome.says(said), is_first, "{}", outcome.stderr);
        is_first = true;
        let columns = ["settlement", "shaft", "base"];
        columns
            .map(|c| tests::case::column(&place.path("out/history.csv"), c))
            .concat()
    });
    for (first, second) in first.iter().zip(&second) {
        approx::assert_relative_eq!(first, second, epsilon = 1e-9, max_relative = 1e-9);
    }
}

/// Blocks under a uniform stress: nothing moves, whatever the course of the joint between them.
#[test]
fn a_uniform_stress_passes_a_curved_joint() {
    let place = Place::new();
    place.write("blocks.msh", blocks(0.1));
    let initial = "initial_stress = { 11 = -10.0, 22 = -10.0, 33 = -10.0 }";
    let case = two_blocks("mesh.file = \"blocks.msh\"")
        .replace("law = \"soil\" }", &format!("law = \"soil\", {initial} }}"))
        .replace(
            "[[supports]]",
            "[[supports]]\nline = \"left\"\nfixed = [\"x\"]\n[[supports]]\nline = \"right\"\n\
             fixed = [\"x\"]\n[[supports]]",
        );
    // What the other tests push sideways is held here.
    let end = case.find("[[phase]]\nname = \"push\"").unwrap();
    let case = case[..end].to_owned()
        + "[probes]\nmoves = { line = \"between\", quantity = \"displacement_y\", \
           reduce = \"min\" }\n";
    let sides = "6 15 2 5 2 2\n7 8 2 6 1 2 3 8\n8 8 2 6 1 3 5 11\n9 8 2 7 1 1 4 10\n\
                 10 8 2 7 1 4 6 13\n";
    let mesh = blocks(0.1)
        .replace(
            "$PhysicalNames\n5\n",
            "$PhysicalNames\n7\n1 6 \"right\"\n1 7 \"left\"\n",
        )
        .replace("$Elements\n6\n", "$Elements\n10\n")
        .replace("6 15 2 5 2 2\n", sides);
    place.write("blocks.msh", mesh);
    place.done_case(case);
    for moves in tests::case::column(&place.path("out/history.csv"), "moves") {
        approx::assert_relative_eq!(moves, 0.0, epsilon = 1e-15);
    }
}
