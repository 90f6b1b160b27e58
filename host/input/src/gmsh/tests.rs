//! Files are written here, in every format, from one description.

#[path = "tests/first_order.rs"]
mod first_order;
#[path = "tests/formats.rs"]
mod formats;
#[path = "tests/mistakes.rs"]
mod mistakes;
#[path = "tests/writer.rs"]
mod writer;

use super::*;
use crate::Case;
use crate::mesh::{Built, build};
use mechanics::element::{QUAD8, TRI6};
use std::fmt::Write as _;
use writer::Writer;

/// A part of the geometry: dimension, number, physical groups.
type Entity = (u8, i32, Vec<i32>);

/// Content of a file.
#[derive(Clone)]
struct Model {
    names: Vec<(u8, i32, &'static str)>,
    entities: Vec<Entity>,
    nodes: Vec<(u64, [f64; 3])>,
    /// Dimension and number of the entity, type, nodes.
    elements: Vec<(u8, i32, i32, Vec<u64>)>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Bytes {
    Text,
    Little,
    Big,
}

const FORMATS: [(f64, Bytes); 10] = [
    (4.1, Bytes::Text),
    (4.1, Bytes::Little),
    (4.1, Bytes::Big),
    (2.2, Bytes::Text),
    (2.2, Bytes::Little),
    (2.2, Bytes::Big),
    (4.0, Bytes::Text),
    (4.0, Bytes::Little),
    (4.0, Bytes::Big),
    (2.1, Bytes::Text),
];

/// The square [0, 1]² as a quad, next to it [1, 2] × [0, 1] as two triangles, one of them inside out,
/// with a round right side; a node that belongs to nothing.
fn model() -> Model {
    let places = [
        [0.0, 0.0],
        [1.0, 0.0],
        [1.0, 1.0],
        [0.0, 1.0],
        [2.0, 0.0],
        [2.0, 1.0],
        [0.5, 0.0],
        [1.0, 0.5],
        [0.5, 1.0],
        [0.0, 0.5],
        [1.5, 0.0],
        [2.125, 0.5],
        [1.5, 1.0],
        [1.5, 0.5],
        [5.0, 5.0],
    ];
    let nodes = places.iter().zip(1..);
    Model {
        names: vec![
            (0, 1, "corner"),
            (1, 1, "bottom"),
            (1, 2, "between"),
            (1, 3, "round side"),
            (2, 1, "left"),
            (2, 2, "right"),
        ],
        entities: vec![
            (0, 5, vec![1]),
            (1, 1, vec![1]),
            (1, 2, vec![2]),
            (1, 3, vec![3]),
            (1, 4, vec![]),
            (2, 1, vec![1]),
            (2, 2, vec![2]),
        ],
        nodes: nodes.map(|([x, y], n)| (10 * n, [*x, *y, 0.0])).collect(),
        elements: [
            (0, 5, 15, vec![5]),
            (1, 1, 8, vec![1, 2, 7]),
            (1, 1, 8, vec![2, 5, 11]),
            (1, 2, 8, vec![3, 2, 8]),
            (1, 3, 8, vec![5, 6, 12]),
            (1, 4, 8, vec![4, 1, 10]),
            (2, 1, 16, vec![1, 2, 3, 4, 7, 8, 9, 10]),
            (2, 2, 9, vec![2, 5, 6, 11, 12, 14]),
            (2, 2, 9, vec![2, 3, 6, 8, 13, 14]),
        ]
        .map(|(dimension, entity, kind, nodes)| {
            let nodes: Vec<u64> = nodes.into_iter().map(|n| 10 * n).collect();
            (dimension, entity, kind, nodes)
        })
        .to_vec(),
    }
}

/// Names that a case takes.
fn wanting(groups: &[&'static str], lines: &[&'static str]) -> Wanted<'static> {
    Wanted {
        groups: groups.iter().copied().zip(0..).collect(),
        lines: lines.iter().copied().collect(),
        analysis: Analysis::PlaneStrain,
        scale: 1.0,
        is_case: true,
    }
}

fn read(bytes: &[u8], wanted: &Wanted<'_>) -> Result<(Mesh, Vec<String>), String> {
    let assembled = assemble::assemble(&Contents::read(bytes, false)?, wanted)?;
    Ok((assembled.mesh, assembled.notes))
}

fn all() -> Wanted<'static> {
    wanting(&["left", "right"], &["bottom", "between", "corner"])
}

#[test]
fn all_formats_give_the_same_mesh() {
    let meshes = FORMATS.map(|(version, bytes)| {
        read(&model().write(version, bytes), &all()).unwrap_or_else(|why| {
            panic!("{version} {bytes:?}: {why}");
        })
    });
    for other in &meshes[1..] {
        assert_eq!(*other, meshes[0]);
    }
    let (mesh, notes) = &meshes[0];
    assert_eq!(mesh.nodes.len(), 14);
    let shapes: Vec<_> = mesh.solids.iter().map(|s| (s.kind(), s.group)).collect();
    assert_eq!(shapes, [(&QUAD8, 0), (&TRI6, 1), (&TRI6, 1)]);
    // The one that was inside out, turned.
    assert_eq!(mesh.solids[2].nodes(), [1, 5, 2, 13, 12, 7]);
    let edges = |name: &str| mesh.lines[name].edges.clone();
    assert_eq!(edges("bottom"), [(0, 0), (1, 0)]);
    assert_eq!(edges("between"), [(0, 1), (2, 2)]);
    assert_eq!(edges("round side"), [(1, 1)]);
    assert!(edges("corner").is_empty());
    assert_eq!(mesh.lines["corner"].nodes, [4]);
    assert_eq!(mesh.lines.len(), 4);
    assert_eq!(
        *notes,
        [
            "1 node belongs to no triangle or quad and left out",
            "physical curves and points that the case does not use: `round side`",
        ]
    );
}

#[test]
fn coordinates_are_scaled() {
    let wanted = Wanted {
        scale: 0.001,
        ..all()
    };
    let (mesh, _) = read(&model().write(4.1, Bytes::Little), &wanted).unwrap();
    let scaled = [0.001 * 2.125, 0.001 * 0.5];
    assert_eq!(mesh.nodes[11].map(f64::to_bits), scaled.map(f64::to_bits));
}

/// Cut off anywhere, a file is an error; with a byte changed, it is a mesh or an error. Nothing panics.
#[test]
fn broken_files_are_refused() {
    for (version, bytes) in FORMATS {
        let whole = model().write(version, bytes);
        for length in 0..whole.len() - 1 {
            let cut = read(&whole[..length], &all());
            assert!(cut.is_err(), "{version} {bytes:?}: {length}");
        }
        let mut refused = 0;
        for at in 0..whole.len() {
            for change in [1, 0x10, 0x80, 0xff] {
                let mut broken = whole.clone();
                broken[at] ^= change;
                match read(&broken, &all()) {
                    Ok((mesh, _)) => {
                        let n = mesh.nodes.len();
                        let mut nodes = mesh.solids.iter().flat_map(mechanics::mesh::Solid::nodes);
                        assert!(nodes.all(|&node| node < n));
                    }
                    Err(why) => {
                        assert!(why.contains("line ") || why.contains("byte "), "{why}");
                        refused += 1;
                    }
                }
            }
        }
        assert!(refused > whole.len(), "{version} {bytes:?}: {refused}");
    }
}

#[test]
fn the_axis_is_the_left_end() {
    let wanted = |analysis| Wanted { analysis, ..all() };
    let mut model = model();
    let moved = |model: &mut Model, by: f64| {
        for (_, at) in &mut model.nodes {
            at[0] += by;
        }
    };
    moved(&mut model, -0.5);
    let bytes = model.write(4.1, Bytes::Text);
    assert!(read(&bytes, &wanted(Analysis::PlaneStrain)).is_ok());
    let why = read(&bytes, &wanted(Analysis::Axisymmetric)).unwrap_err();
    assert!(
        why.contains("node 10 is at x = -0.5, across the axis"),
        "{why}"
    );
    // Round-off is no distance.
    moved(&mut model, 0.5 - 1e-16);
    let bytes = model.write(4.1, Bytes::Text);
    let (mesh, _) = read(&bytes, &wanted(Analysis::Axisymmetric)).unwrap();
    assert_eq!(mesh.nodes[0][0].to_bits(), 0.0_f64.to_bits());
}

#[test]
fn what_the_case_does_not_use_is_left_out() {
    for (version, bytes) in FORMATS {
        let bytes = model().write(version, bytes);
        // The bottom is that of the left square alone.
        let (mesh, notes) = read(&bytes, &wanting(&["left"], &["bottom"])).unwrap();
        assert_eq!((mesh.nodes.len(), mesh.solids.len()), (8, 1));
        assert_eq!(mesh.lines["bottom"].edges, [(0, 0)]);
        assert_eq!(
            notes,
            [
                "physical surfaces that are no groups of the case are left out, with their elements: \
                 `right` (2)",
                "1 node belongs to no triangle or quad and left out",
                "physical curves and points that the case does not use: `between`, `round side`, \
                 `corner`",
            ]
        );
        let why = read(&bytes, &wanting(&["left"], &["corner"])).unwrap_err();
        assert!(
            why.contains("no element of the case's groups is at `corner`"),
            "{why}"
        );
    }
}

#[test]
fn an_element_may_be_in_two_surfaces_if_one_is_used() {
    let mut model = model();
    model.names.push((2, 3, "all"));
    model.entities[5].2.push(3);
    model.entities[6].2.push(3);
    for (version, bytes) in FORMATS {
        let bytes = model.write(version, bytes);
        let (mesh, notes) = read(&bytes, &all()).unwrap();
        assert_eq!(mesh.solids.len(), 3);
        assert_eq!(notes.len(), 2, "{notes:?}");
        let (mesh, _) = read(&bytes, &wanting(&["all"], &[])).unwrap();
        assert_eq!(mesh.solids.len(), 3);
        let why = read(&bytes, &wanting(&["left", "all"], &[])).unwrap_err();
        assert!(
            why.contains("is in two groups of the case, `left` and `all`"),
            "{why}"
        );
    }
}

#[test]
fn groups_without_names_are_called_by_their_numbers() {
    let mut model = model();
    model.names.clear();
    for (version, bytes) in FORMATS {
        let bytes = model.write(version, bytes);
        let (mesh, _) = read(&bytes, &wanting(&["1", "2"], &["3"])).unwrap();
        assert_eq!(mesh.solids.len(), 3);
        assert_eq!(mesh.lines["3"].edges, [(1, 1)]);
    }
}

#[test]
fn nodes_upon_each_other_are_told() {
    let mut model = model();
    // The triangles get nodes of their own between the squares.
    for (own, of) in [(160, 20), (170, 30), (180, 80)] {
        let at = model.nodes.iter().find(|node| node.0 == of).unwrap().1;
        model.nodes.push((own, at));
        for (_, _, kind, nodes) in &mut model.elements {
            for node in nodes {
                if *kind == 9 && *node == of {
                    *node = own;
                }
            }
        }
    }
    let bytes = model.write(4.1, Bytes::Text);
    let (_, notes) = read(&bytes, &wanting(&["left", "right"], &[])).unwrap();
    let cracks = "3 nodes are where another one is, first at (1, 0)";
    assert!(
        notes.iter().any(|note| note.starts_with(cracks)),
        "{notes:?}"
    );
}

// --- cases --------------------------------------------------------------------------------------

const CASE: &str = r#"
analysis = "plane_strain"
mesh.file = "part.msh"
laws.any = { law = "elastic" }
groups.left = { formulation = "solid", law = "any" }
groups.right = { formulation = "solid", law = "any" }
groups.joint = { formulation = "zero_thickness", law = "any", line = "between" }
supports = [{ line = "bottom", fixed = ["y"] }, { line = "corner", fixed = ["x"] }]
phase = [{ name = "only", increments = 1 }]
"#;

/// The mesh of a case next to a file.
fn built(name: &str, case: &str) -> Result<Built, String> {
    built_of(name, case, &model().write(4.1, Bytes::Big))
}

fn built_of(name: &str, case: &str, bytes: &[u8]) -> Result<Built, String> {
    let folder = std::env::temp_dir().join(format!("pilum-{}-{name}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("part.msh"), bytes).unwrap();
    let source = Source::new(folder.join("case.toml"), case);
    let case = Case::of(source).unwrap().remove(0);
    let built = build(&case.source, &case.file);
    std::fs::remove_dir_all(&folder).unwrap();
    built.map_err(|error| {
        let mut said = error.to_string();
        if let Error::Text(text::Error::Input(input)) = error {
            let mut input = *input;
            let hint = input.hint_mut().clone().unwrap_or_default();
            write!(said, " | {hint}").unwrap();
        }
        said
    })
}

#[test]
fn a_case_takes_its_mesh_from_a_file() {
    let Built { mesh, file } = built("takes", CASE).unwrap();
    // Through the mesh: both ends of the line come apart.
    assert_eq!(mesh.nodes.len(), 14 + 3);
    assert_eq!(mesh.joints.len(), 1);
    let [near, far] = [mesh.joints[0].minus, mesh.joints[0].plus];
    assert!(
        near.iter()
            .all(|node| mesh.solids[0].nodes().contains(node))
    );
    assert!(far.iter().all(|node| mesh.solids[2].nodes().contains(node)));
    assert!(mesh.nodes[near[0]][1] < mesh.nodes[near[1]][1]);
    // Both nodes at x = 1 are on the bottom, in the order of the coordinates.
    let xs: Vec<f64> = mesh.lines["bottom"]
        .nodes
        .iter()
        .map(|&n| mesh.nodes[n][0])
        .collect();
    assert_eq!(xs, [0.0, 0.5, 1.0, 1.0, 1.5, 2.0]);
    let file = file.unwrap();
    assert_eq!(file.notes.len(), 2);
    assert!(
        file.notes[0].contains("part.msh: 1 node belongs"),
        "{file:?}"
    );
    let closed = CASE.replace(
        "line = \"between\"",
        "line = \"between\", ends = \"joined\"",
    );
    assert_eq!(built("closed", &closed).unwrap().mesh.nodes.len(), 14 + 1);
}

/// On a grid, too: a pile's shaft and base meet at the corner of its toe, and it comes apart wholly.
#[test]
fn lines_may_end_on_one_another() {
    let case = r#"
analysis = "plane_strain"
[mesh]
columns = [{ n = 2, to = 2.0 }]
rows = [{ n = 2, to = 2.0 }]
region = [{ group = "soil" }, { group = "pile", x = [0.0, 1.0], y = [1.0, 2.0] }]
[mesh.lines]
shaft = { x = 1.0, y = [1.0, 2.0] }
base = { y = 1.0, x = [0.0, 1.0] }
head = { y = 2.0, x = [0.0, 1.0] }
toe = { x = 1.0, y = 1.0 }
[laws]
any = { law = "elastic" }
[groups]
soil = { formulation = "solid", law = "any" }
pile = { formulation = "solid", law = "any" }
shaft = { formulation = "zero_thickness", law = "any", line = "shaft" }
base = { formulation = "zero_thickness", law = "any", line = "base" }
[[phase]]
name = "only"
increments = 1
"#;
    let mesh = built("toe", case).unwrap().mesh;
    assert_eq!(mesh.nodes.len(), 21 + 5);
    assert_eq!(mesh.joints.len(), 2);
    let own = |group: usize| {
        let solids = mesh.solids.iter().filter(move |solid| solid.group == group);
        solids
            .flat_map(|solid| solid.nodes().to_vec())
            .collect::<HashSet<_>>()
    };
    assert!(own(0).is_disjoint(&own(1)));
    assert_eq!(mesh.lines["toe"].nodes.len(), 2);
    // The head is the pile's alone.
    assert!(
        mesh.lines["head"]
            .nodes
            .iter()
            .all(|node| own(1).contains(node))
    );
    let one = case.replace("line = \"shaft\"", "line = \"shaft\", ends = \"joined\"");
    assert_eq!(built("one", &one).unwrap().mesh.nodes.len(), 21 + 4);
}
