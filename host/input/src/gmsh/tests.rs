//! Files are written here, in every format, from one description.

use super::*;
use crate::Case;
use crate::mesh::{Built, build};
use mechanics::element::{QUAD8, TRI6};
use std::fmt::Write as _;

#[path = "tests/first_order.rs"]
mod first_order;
#[path = "tests/formats.rs"]
mod formats;

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

/// Writes numbers in an encoding.
struct Writer(Vec<u8>, Bytes);

impl Writer {
    fn text(&mut self, text: &str) {
        self.0.extend(text.as_bytes());
    }

    fn int(&mut self, n: i64) {
        match self.1 {
            Bytes::Text => self.text(&format!("{n} ")),
            Bytes::Little => self.0.extend((n as i32).to_le_bytes()),
            Bytes::Big => self.0.extend((n as i32).to_be_bytes()),
        }
    }

    fn size(&mut self, n: u64) {
        match self.1 {
            Bytes::Text => self.text(&format!("{n} ")),
            Bytes::Little => self.0.extend(n.to_le_bytes()),
            Bytes::Big => self.0.extend(n.to_be_bytes()),
        }
    }

    fn reals(&mut self, values: &[f64]) {
        for value in values {
            match self.1 {
                Bytes::Text => self.text(&format!("{value} ")),
                Bytes::Little => self.0.extend(value.to_le_bytes()),
                Bytes::Big => self.0.extend(value.to_be_bytes()),
            }
        }
    }

    fn new_line(&mut self) {
        if self.1 == Bytes::Text {
            self.text("\n");
        }
    }

    fn end(&mut self, name: &str) {
        if self.1 != Bytes::Text {
            self.text("\n");
        }
        self.text(&format!("$End{name}\n"));
    }
}

impl Model {
    fn write(&self, version: f64, bytes: Bytes) -> Vec<u8> {
        let mut w = Writer(Vec::new(), bytes);
        let is_text = bytes == Bytes::Text;
        w.text(&format!(
            "$MeshFormat\n{version} {} 8\n",
            u8::from(!is_text)
        ));
        if !is_text {
            w.int(1);
        }
        w.end("MeshFormat");
        let mut names = format!("$PhysicalNames\n{}\n", self.names.len());
        for (dimension, number, name) in &self.names {
            writeln!(names, "{dimension} {number} \"{name}\"").unwrap();
        }
        w.text(&names);
        w.text("$EndPhysicalNames\n");
        if version >= 4.0 {
            self.write_4(&mut w, version > 4.0);
        } else {
            self.write_2(&mut w);
        }
        w.0
    }

    /// Format 4.1, or 4.0.
    fn write_4(&self, w: &mut Writer, is_new: bool) {
        // The number of a node or element.
        let number = |w: &mut Writer, n: u64| {
            if is_new {
                w.size(n);
            } else {
                w.int(n as i64);
            }
        };
        let entity = |w: &mut Writer, dimension: i64, entity: i64| {
            let both = [dimension, entity];
            w.int(both[usize::from(!is_new)]);
            w.int(both[usize::from(is_new)]);
        };
        w.text("$Entities\n");
        for dimension in 0..4 {
            let own = self.entities.iter().filter(|e| e.0 == dimension);
            w.size(own.count() as u64);
        }
        w.new_line();
        for (dimension, number, groups) in &self.entities {
            w.int((*number).into());
            let is_place = *dimension == 0 && is_new;
            w.reals(&[0.0; 6][..if is_place { 3 } else { 6 }]);
            w.size(groups.len() as u64);
            for group in groups {
                w.int((*group).into());
            }
            if *dimension > 0 {
                w.size(2);
                w.int(1);
                w.int(-2);
            }
            w.new_line();
        }
        w.end("Entities");
        w.text("$Nodes\n");
        // Two blocks, the second of nodes with a parameter.
        let (first, second) = self.nodes.split_at(5);
        for n in &[2, self.nodes.len() as u64, 10, 150][..if is_new { 4 } else { 2 }] {
            w.size(*n);
        }
        w.new_line();
        for (dimension, block) in [(2, first), (1, second)] {
            entity(w, dimension, 1);
            w.int((dimension == 1).into());
            w.size(block.len() as u64);
            w.new_line();
            for (n, _) in block.iter().filter(|_| is_new) {
                number(w, *n);
                w.new_line();
            }
            for (n, at) in block {
                if !is_new {
                    number(w, *n);
                }
                w.reals(at);
                if dimension == 1 {
                    w.reals(&[0.25]);
                }
                w.new_line();
            }
        }
        w.end("Nodes");
        w.text("$Elements\n");
        let n = self.elements.len() as u64;
        for n in &[n, n, 1, n][..if is_new { 4 } else { 2 }] {
            w.size(*n);
        }
        w.new_line();
        for (n, (dimension, own, kind, nodes)) in self.elements.iter().enumerate() {
            entity(w, (*dimension).into(), (*own).into());
            w.int((*kind).into());
            w.size(1);
            w.new_line();
            number(w, n as u64 + 1);
            for node in nodes {
                number(w, *node);
            }
            w.new_line();
        }
        w.end("Elements");
    }

    fn write_2(&self, w: &mut Writer) {
        w.text(&format!("$Nodes\n{}\n", self.nodes.len()));
        for (number, at) in &self.nodes {
            w.int(*number as i64);
            w.reals(at);
            w.new_line();
        }
        w.end("Nodes");
        // An element is written once for each of its groups.
        let mut all = Vec::new();
        for (dimension, entity, kind, nodes) in &self.elements {
            let of = self
                .entities
                .iter()
                .find(|e| (e.0, e.1) == (*dimension, *entity));
            let groups = of.map_or(&[][..], |e| &e.2);
            let or_none = if groups.is_empty() { &[0][..] } else { groups };
            for group in or_none {
                all.push((*kind, *group, *entity, nodes));
            }
        }
        w.text(&format!("$Elements\n{}\n", all.len()));
        for (number, (kind, group, entity, nodes)) in all.into_iter().enumerate() {
            let number = number as i64 + 1;
            if w.1 == Bytes::Text {
                w.int(number);
                w.int(kind.into());
                w.int(2);
            } else {
                w.int(kind.into());
                w.int(1);
                w.int(2);
                w.int(number);
            }
            w.int(group.into());
            w.int(entity.into());
            for node in nodes {
                w.int(*node as i64);
            }
            w.new_line();
        }
        w.end("Elements");
    }
}

/// Names that a case takes.
fn wanting(groups: &[&'static str], lines: &[&'static str]) -> Wanted<'static> {
    Wanted {
        groups: groups.iter().copied().zip(0..).collect(),
        lines: lines.iter().copied().collect(),
        analysis: Analysis::PlaneStrain,
        scale: 1.0,
    }
}

fn read(bytes: &[u8], wanted: &Wanted<'_>) -> Result<(Mesh, Vec<String>), String> {
    let assembled = assemble::assemble(&Contents::read(bytes)?, wanted)?;
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

/// The defect, a part of a file with its replacement, and the error.
type Mistake = (&'static str, &'static str, &'static str, &'static str);

const MISTAKES: [Mistake; 18] = [
    (
        "another format",
        "2.2 0 8",
        "3.0 0 8",
        "line 2: the format has version 3; 4.1, 4.0 and 2.0 to 2.2 are read: `gmsh old.msh -save",
    ),
    (
        "short numbers",
        "2.2 0 8",
        "2.2 0 4",
        "line 2: numbers of 4 bytes",
    ),
    (
        "no numbers",
        "2.2 0 8",
        "2.2 0 eight",
        "line 2: expected the size of numbers, found `eight`",
    ),
    (
        "not a mesh",
        "$MeshFormat",
        "MeshFormat",
        "line 1: a mesh file of Gmsh begins with",
    ),
    (
        "a wrong end",
        "$EndNodes",
        "$EndKnots",
        "expected `$EndNodes`, found `$EndKnots`",
    ),
    (
        "more nodes than said",
        "\n15\n10 0",
        "\n14\n10 0",
        "expected `$EndNodes`, found `150 5 5 0`",
    ),
    (
        "far more nodes",
        "\n15\n10 0",
        "\n999999999999999\n10 0",
        "more than the rest of the file",
    ),
    (
        "a node twice",
        "\n20 1 0 0",
        "\n10 1 0 0",
        "line 16: node 10 comes twice",
    ),
    (
        "no number",
        "\n20 1 0 0",
        "\n20 nan 0 0",
        "line 16: a coordinate of node 20 is NaN",
    ),
    (
        "off the plane",
        "\n20 1 0 0",
        "\n20 1 0 0.5",
        "line 16: node 20 is at z = 0.5: the mesh does",
    ),
    (
        "a missing node",
        "\n50 2 0 0",
        "\n51 2 0 0",
        "has the node 50, which is not among the nodes",
    ),
    (
        "third order",
        "7 16 2",
        "7 36 2",
        "line 39: an element of type 36 is a quad of higher order; a mesh has triangles, quads, lines",
    ),
    (
        "a solid",
        "7 16 2",
        "7 11 2",
        "line 39: an element of type 11 is a tetrahedron",
    ),
    (
        "a node twice in an element",
        "20 50 60 110 120 140",
        "20 50 50 110 120 140",
        "line 40: element 8 has the node 50 twice",
    ),
    (
        "an element twice",
        "9 9 2 2 2 20 30 60 80 130 140",
        "9 9 2 2 2 20 50 60 110 120 140",
        "line 41: elements 8 and 9 have the same nodes",
    ),
    (
        "a middle that is a corner",
        "10 20 30 40 70 80 90 100",
        "10 20 80 40 70 30 90 100",
        "line 39: the middle of a side of element 7 is a corner",
    ),
    (
        "a curve beside the elements",
        "3 8 2 1 1 20 50 110",
        "3 8 2 1 1 20 60 110",
        "line 35: element 3 of the physical curve `bottom` is no side",
    ),
    (
        "a section twice",
        "$PhysicalNames",
        "$Nodes\n0\n$EndNodes\n$PhysicalNames",
        "section `$Nodes` comes twice",
    ),
];

#[test]
fn mistakes_in_text_files_are_told_with_their_line() {
    let text = String::from_utf8(model().write(2.2, Bytes::Text)).unwrap();
    for (what, old, new, says) in MISTAKES {
        assert_eq!(text.matches(old).count(), 1, "{what}: {old}");
        let broken = text.replacen(old, new, 1);
        let why = read(broken.as_bytes(), &all()).unwrap_err();
        assert!(why.contains(says), "{what}: {why}");
    }
}

#[test]
fn binary_files_tell_section_and_byte() {
    let mut bytes = model().write(4.1, Bytes::Little);
    bytes.truncate(bytes.len() - 40);
    let why = read(&bytes, &all()).unwrap_err();
    assert!(
        why.starts_with("$Elements, byte ") && why.ends_with("than the rest of the file can hold"),
        "{why}"
    );
    let mut bytes = model().write(4.1, Bytes::Little);
    let at = bytes
        .windows(4)
        .position(|w| w == 1_i32.to_le_bytes())
        .unwrap();
    bytes[at] = 7;
    let why = read(&bytes, &all()).unwrap_err();
    assert!(why.contains("expected the number 1 in 4 bytes"), "{why}");
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

#[test]
fn a_case_that_does_not_fit_its_file_is_told() {
    let says = |name: &str, old: &str, new: &str, parts: &[&str]| {
        assert_eq!(CASE.matches(old).count(), 1, "{old}");
        let why = built(name, &CASE.replace(old, new)).unwrap_err();
        for part in parts {
            assert!(why.contains(part), "{name}: {why}");
        }
    };
    says(
        "group",
        "groups.right",
        "groups.rihgt",
        &[
            "part.msh has no physical surface `rihgt` | did you mean `right`? There is: left (1 \
             element), right (2 elements)",
        ],
    );
    says(
        "line",
        "\"bottom\"",
        "\"botom\"",
        &[
            "there is no line `botom` | did you mean `bottom`? There is: bottom (2 edges), between \
             (1 edge), round side (1 edge), corner (1 point)",
        ],
    );
    says(
        "none",
        "mesh.file = \"part.msh\"",
        "mesh.scale = 1.0",
        &["`columns` and `rows` of a grid, or a `file`"],
    );
    says(
        "scale",
        "mesh.file = \"part.msh\"",
        "mesh = { file = \"part.msh\", scale = -1.0 }",
        &["`scale` is -1"],
    );
    says(
        "both",
        "laws.any",
        "mesh.origin = [0.0, 0.0]\nlaws.any",
        &["`origin` belongs to a grid"],
    );
    says("missing", "part.msh", "prat.msh", &["cannot read"]);
    says(
        "ends",
        "groups.left = {",
        "groups.left = { ends = \"open\",",
        &["`ends` only belongs to"],
    );
    says(
        "point",
        "line = \"between\"",
        "line = \"corner\"",
        &["group `joint`: the line is a point"],
    );
    says(
        "outline",
        "line = \"between\"",
        "line = \"round side\"",
        &["the line lies on the boundary at (2.125, 0.5)"],
    );
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
