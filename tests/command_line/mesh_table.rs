//! `pilum mesh`: what a mesh has before a case exists.

use crate::program::{BAD_INPUT, CASE, DONE, JOINT, Outcome, Place, edited};

/// A triangle of 3 nodes beside a quad of 4, in two surfaces; a third one has both. The lower side, and a curve off the
/// mesh. Areas are 1 and 2.
const MESH: &str = r#"$MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
5
2 1 "ground"
2 2 "pile"
2 3 "all"
1 4 "bottom"
1 5 "stray"
$EndPhysicalNames
$Nodes
6
1 0 0 0
2 2 0 0
3 2 1 0
4 0 1 0
5 4 0 0
6 9 9 0
$EndNodes
$Elements
7
1 1 2 4 1 1 2
2 1 2 4 1 2 5
3 1 2 5 1 5 6
11 3 2 1 1 1 2 3 4
12 2 2 2 2 2 5 3
11 3 2 3 1 1 2 3 4
12 2 2 3 2 2 5 3
$EndElements
"#;

fn shown(mesh: &str) -> Outcome {
    let place = Place::new();
    place.write("a.msh", mesh);
    let outcome = place.run(&["mesh", "a.msh"]);
    assert_eq!(place.contents(), ["a.msh"]);
    outcome
}

/// The words of the line that begins with this one.
fn words<'o>(outcome: &'o Outcome, first: &str) -> Vec<&'o str> {
    let mut lines = outcome.stdout.lines().map(str::trim_start);
    let line = lines.find(|line| line.starts_with(first));
    line.unwrap_or_default().split_whitespace().collect()
}

#[test]
fn shows_what_a_mesh_has() {
    let outcome = shown(MESH).ended(DONE);
    let of = |first| words(&outcome, first).join(" ");
    assert_eq!(
        of("elements"),
        "elements 1 triangle of 6 nodes, 1 quad of 8 nodes"
    );
    assert_eq!(of("extent"), "extent, m x 0 to 4, y 0 to 1");
    // A rectangle; a triangle with sin atan(1/2) times 2/√3.
    assert_eq!(of("ground"), "ground 1 2 1.000");
    assert_eq!(of("pile"), "pile 1 1 0.516");
    assert_eq!(of("bottom"), "bottom 2 4 (0, 0), (4, 0)");
    // atan(1/2), at the corner (4, 0); the quad is a rectangle, and has the first right angle.
    let place = "element 12 of `pile` at (2.66667, 0.333333)";
    assert_eq!(of("least angle"), format!("least angle 26.6°, {place}"));
    assert_eq!(
        of("largest angle"),
        "largest angle 90.0°, element 11 of `ground` at (1, 0.5)"
    );
    outcome
        .prints("2 elements are of first order")
        .prints("1 node belongs to no triangle or quad")
        .prints("surfaces `ground` and `all` have 1 element in common")
        .prints("physical curve `stray` has 1 of 1 edges that are no sides");
}

#[test]
fn says_what_is_refused() {
    // A dent: the corner of the quad beyond its diagonal, with a negative Jacobian.
    let dented = shown(&MESH.replace("4 0 1 0\n", "4 1.9 0.1 0\n")).ended(BAD_INPUT);
    dented.shows("1 element is degenerate: the Jacobian is not positive");
    dented.shows("the first is element 11 of `ground`");
    dented.prints("largest angle");

    let left = shown(&MESH.replace("1 0 0 0\n", "1 -1 0 0\n")).ended(DONE);
    let note = "1 node has x < 0, the first at (-1, 0)";
    left.prints(note);

    let solid = shown(&MESH.replace("11 3 2 1 1", "11 4 2 1 1")).ended(BAD_INPUT);
    solid
        .shows("cannot read a.msh")
        .shows("line 26: an element of type 4 is a tetrahedron");
    assert_eq!(solid.stdout, "");

    // Elements that are wrong are said one and all.
    let two = shown(
        &MESH
            .replace("12 2 2 2 2 2 5 3\n", "12 2 2 2 2 2 7 3\n13 2 2 2 2 2 2 3\n")
            .replace("$Elements\n7", "$Elements\n8"),
    )
    .ended(BAD_INPUT);
    two.shows("line 27: element 12 has the node 7, which is not among the nodes")
        .shows("line 28: element 13 has the node 2 twice");

    let nodes = &MESH[MESH.find("$Nodes").unwrap()..MESH.find("$Elements").unwrap()];
    let format = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n";
    let elements = "$Elements\n1\n11 3 2 0 1 1 2 3 4\n$EndElements\n";
    let nameless = shown(&format!("{format}{nodes}{elements}")).ended(BAD_INPUT);
    nameless.shows("no surface has a name");
}

/// A square of two triangles of 6 nodes in a surface, fixed below; the middle of the diagonal is node 9.
const SQUARE: &str = r#"$MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
2
2 1 "ground"
1 2 "bottom"
$EndPhysicalNames
$Nodes
9
1 0 0 0
2 1 0 0
3 1 1 0
4 0 1 0
5 0.5 0 0
6 1 0.5 0
7 0.5 1 0
8 0 0.5 0
9 0.5 0.5 0
$EndNodes
$Elements
3
1 8 2 2 1 1 2 5
2 9 2 1 1 1 2 3 5 6 9
3 9 2 1 1 1 3 4 9 7 8
$EndElements
"#;

#[test]
fn refuses_the_middle_nodes_that_a_run_refuses() {
    let place = Place::new();
    place.write(
        "case.toml",
        r#"analysis = "plane_strain"
mesh.file = "a.msh"
laws.soil = { law = "elastic", parameters = { young_modulus = 1e4, poisson_ratio = 0.3 } }
groups.ground = { formulation = "solid", law = "soil" }
supports = [{ line = "bottom", fixed = ["x", "y"] }]
phase = [{ name = "only", increments = 1 }]
"#,
    );
    // The Jacobian of the lower triangle is 1 − 4d(1 − ξ − η) with the middle of its lower side at (1/2, d), and
    // 1 + 4s(1 − 2ξ − η) with it at (1/2 + s, 0): zero at its first corner for d = 1/4 and s = −1/4, and at the first
    // point of the finest rule, (0.0694, 0.0646), for d = 0.2887 and s = −0.3139.
    for (at, is_good, is_taken, is_noted) in [
        ("0.5 0", true, true, false),
        ("0.3 0", true, true, true),
        ("0.26 0", true, true, true),
        ("0.24 0", false, true, true),
        ("0.187 0", false, true, true),
        ("0.186 0", false, false, true),
        ("0.5 0.2", true, true, false),
        ("0.5 0.24", true, true, false),
        ("0.5 0.26", false, true, true),
        ("0.5 0.288", false, true, true),
        ("0.5 0.289", false, false, true),
        ("0.5 -0.24", true, true, false),
        ("0.5 -0.4", true, true, true),
        ("0.5 -1.2", true, true, true),
    ] {
        place.write(
            "a.msh",
            SQUARE.replace("5 0.5 0 0\n", &format!("5 {at} 0\n")),
        );
        let [mesh, run] = [["mesh", "a.msh"], ["run", "case.toml"]].map(|call| place.run(&call));
        let code = if is_taken { DONE } else { BAD_INPUT };
        assert_eq!(mesh.code, Some(code), "{at}: {}", mesh.stderr);
        assert_eq!(run.code, Some(code), "{at}: {}", run.stderr);
        let note = "1 middle node lies farther than 1/8 of its side";
        assert_eq!(
            mesh.stdout.contains(note),
            is_noted,
            "{at}: {}",
            mesh.stdout
        );
        let row = words(&mesh, "ground").join(" ");
        let least: f64 = row.rsplit(' ').next().unwrap().parse().unwrap();
        assert_eq!(least > 0.0, is_good, "{at}: {row}");
        let note =
            "1 element has a Jacobian that is not positive at a node, the first is element 2";
        for (outcome, is_said) in [
            (&mesh.stdout, !is_good),
            (&run.stderr, !is_good && is_taken),
        ] {
            assert_eq!(outcome.contains(note), is_said, "{at}: {outcome}");
        }
    }
}

#[test]
fn elements_that_lie_on_each_other_are_named() {
    // The second triangle once more, of nodes of its own.
    let nodes = "10 0 0 0\n11 1 1 0\n12 0 1 0\n13 0.5 0.5 0\n14 0.5 1 0\n15 0 0.5 0\n$EndNodes";
    let twice = SQUARE
        .replace("$Nodes\n9", "$Nodes\n15")
        .replace("$EndNodes", nodes)
        .replace("$Elements\n3", "$Elements\n4")
        .replace("$EndElements", "4 9 2 1 1 10 11 12 13 14 15\n$EndElements");
    let outcome = shown(&twice);
    outcome
        .prints("6 nodes are where another one is")
        .prints("elements 3 and 4 lie on each other")
        .prints("`Coherence;`");
}

#[test]
fn shows_and_draws_the_mesh_of_a_case() {
    let place = Place::new();
    place.write("case.toml", edited(JOINT));
    let outcome = place.done(&["mesh", "case.toml", "--draw", "mesh.svg"]);
    let of = |first| words(&outcome, first).join(" ");
    assert_eq!(
        of("elements"),
        "elements 6 quads of 8 nodes, 3 elements without thickness"
    );
    assert_eq!(of("soil"), "soil 6 2 1.000");
    assert_eq!(of("layer"), "layer 3 2 long");
    assert_eq!(of("middle"), "middle 3 2 (0, 0.5), (2, 0.5)");
    assert!(outcome.stdout.ends_with("drawing in mesh.svg\n"));
    let drawing = place.read("mesh.svg");
    assert_eq!(drawing.matches("<polygon").count(), 6);
    for name in ["soil", "layer", "left", "middle", "corner"] {
        assert!(drawing.contains(name), "{name}");
    }

    let variants = format!("{CASE}\n[[variant]]\nname = \"a\"\n[[variant]]\nname = \"b\"\n");
    place.write("case.toml", variants);
    let two = place.refused(&["mesh", ".", "--draw", "two.svg"]);
    two.shows("--draw is for one mesh");
    let one = place.run(&["mesh", ".", "--variant", "b"]);
    one.prints("variant `b`");
    assert!(!one.stdout.contains("variant `a`"), "{}", one.stdout);
}
