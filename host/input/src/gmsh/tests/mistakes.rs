//! Mistakes in files, and cases that do not fit theirs.

use super::*;

/// The defect; a part of a file with its replacement, `\n` for the end of a line; the error.
const MISTAKES: &str = r"
another format
  2.2 0 8 => 3.0 0 8
  line 2: the format has version 3; 4.1, 4.0 and 2.0 to 2.2 are read: `gmsh old.msh -save
short numbers
  2.2 0 8 => 2.2 0 4
  line 2: numbers of 4 bytes
no numbers
  2.2 0 8 => 2.2 0 eight
  line 2: expected the size of numbers, found `eight`
not a mesh
  $MeshFormat => MeshFormat
  line 1: a mesh file of Gmsh begins with
a wrong end
  $EndNodes => $EndKnots
  expected `$EndNodes`, found `$EndKnots`
more nodes than said
  \n15\n10 0 => \n14\n10 0
  expected `$EndNodes`, found `150 5 5 0`
far more nodes
  \n15\n10 0 => \n999999999999999\n10 0
  more than the rest of the file
a node twice
  \n20 1 0 0 => \n10 1 0 0
  line 16: node 10 comes twice
no number
  \n20 1 0 0 => \n20 nan 0 0
  line 16: a coordinate of node 20 is NaN
off the plane
  \n20 1 0 0 => \n20 1 0 0.5
  line 16: node 20 is at z = 0.5: the mesh does
a missing node
  \n50 2 0 0 => \n51 2 0 0
  has the node 50, which is not among the nodes
third order
  7 16 2 => 7 36 2
  line 39: an element of type 36 is a quad of higher order; a mesh has triangles, quads, lines
a solid
  7 16 2 => 7 11 2
  line 39: an element of type 11 is a tetrahedron
a node twice in an element
  20 50 60 110 120 140 => 20 50 50 110 120 140
  line 40: element 8 has the node 50 twice
an element twice
  9 9 2 2 2 20 30 60 80 130 140 => 9 9 2 2 2 20 50 60 110 120 140
  line 41: elements 8 and 9 have the same nodes
a middle that is a corner
  10 20 30 40 70 80 90 100 => 10 20 80 40 70 30 90 100
  line 39: the middle of a side of element 7 is a corner
a curve beside the elements
  3 8 2 1 1 20 50 110 => 3 8 2 1 1 20 60 110
  line 35: element 3 of the physical curve `bottom` is no side
a section twice
  $PhysicalNames => $Nodes\n0\n$EndNodes\n$PhysicalNames
  section `$Nodes` comes twice
";

#[test]
fn mistakes_in_text_files_are_told_with_their_line() {
    let text = String::from_utf8(model().write(2.2, Bytes::Text)).unwrap();
    let rows: Vec<&str> = MISTAKES.lines().skip(1).map(str::trim).collect();
    for row in rows.chunks(3) {
        let (what, edit, says) = (row[0], row[1].replace("\\n", "\n"), row[2]);
        let (old, new) = edit.split_once(" => ").unwrap();
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
fn a_case_that_does_not_fit_its_file_is_told() {
    let rows = r#"
groups.right => groups.rihgt => part.msh has no physical surface `rihgt` | did you mean `right`? There is: left (1 element), right (2 elements)
"bottom" => "botom" => there is no line `botom` | did you mean `bottom`? There is: bottom (2 edges), between (1 edge), round side (1 edge), corner (1 point)
mesh.file = "part.msh" => mesh.scale = 1.0 => `columns` and `rows` of a grid, or a `file`
mesh.file = "part.msh" => mesh = { file = "part.msh", scale = -1.0 } => `scale` is -1
laws.any => mesh.origin = [0.0, 0.0]\nlaws.any => `origin` belongs to a grid
part.msh => prat.msh => cannot read
groups.left = { => groups.left = { ends = "open", => `ends` only belongs to
line = "between" => line = "corner" => group `joint`: the line is a point
line = "between" => line = "round side" => the line lies on the boundary at (2.125, 0.5)"#;
    for (number, row) in rows.trim().lines().enumerate() {
        let [old, new, says] = row.split(" => ").collect::<Vec<_>>()[..] else {
            unreachable!()
        };
        assert_eq!(CASE.matches(old).count(), 1, "{old}");
        let text = CASE.replace(old, &new.replace("\\n", "\n"));
        let why = built(&format!("row_{number}"), &text).unwrap_err();
        assert!(why.contains(says), "{old}: {why}");
    }
}
