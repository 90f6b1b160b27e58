//! Elements of first order get middles.

use super::*;
use mechanics::element::QUAD9;
use mechanics::mesh::Solid;

/// The model with straight sides.
fn straight() -> Model {
    let mut model = model();
    model.nodes[11].1[0] = 2.0;
    model
}

/// A model with the corners of its elements alone, where `is_first` has their number.
fn without_middles(mut model: Model, is_first: impl Fn(usize) -> bool) -> Model {
    let elements = model.elements.iter_mut().enumerate();
    for (_, (_, _, kind, nodes)) in elements.filter(|(n, _)| is_first(*n)) {
        let (first, n) = match *kind {
            8 => (1, 2),
            9 => (2, 3),
            16 => (3, 4),
            other => (other, 1),
        };
        *kind = first;
        nodes.truncate(n);
    }
    let used = |n: &u64| model.elements.iter().any(|e| e.3.contains(n));
    model.nodes.retain(|(n, _)| used(n));
    model
}

/// Coordinates of a node as bits.
type Bits = [u64; 2];
/// Edges of a line, as numbers of solids and sides.
type Edges = Vec<(usize, usize)>;

/// Coordinates of the nodes of elements and lines.
fn places(mesh: &Mesh) -> (Vec<Vec<Bits>>, Vec<Edges>) {
    let at = |&node: &usize| mesh.nodes[node].map(f64::to_bits);
    let of = |solid: &Solid| solid.nodes().iter().map(at).collect();
    (
        mesh.solids.iter().map(of).collect(),
        mesh.lines.values().map(|line| line.edges.clone()).collect(),
    )
}

const SAID: &str = "3 elements are of first order: the middles of sides get nodes, straight between the corners \
                    (`Mesh.ElementOrder = 2` in Gmsh follows curves)";

/// The same as with the middles that Gmsh puts on straight sides, and every side has one middle.
#[test]
fn middles_are_put_in() {
    let (expected, _) = read(&straight().write(4.1, Bytes::Text), &all()).unwrap();
    for (version, bytes) in FORMATS {
        let model = without_middles(straight(), |_| true);
        let (mesh, notes) = read(&model.write(version, bytes), &all()).unwrap();
        assert_eq!(mesh.nodes.len(), expected.nodes.len());
        assert_eq!(places(&mesh), places(&expected));
        assert_eq!(mesh.lines["corner"].nodes.len(), 1);
        // Those of the file come first.
        assert!(mesh.lines["corner"].nodes[0] < 6);
        assert_eq!(notes[0], SAID);
        assert_eq!(notes.len(), 2, "{notes:?}");
    }
}

/// An element next to others of another order takes the middles that there are, straight or not.
#[test]
fn orders_may_be_mixed() {
    let (expected, _) = read(&model().write(2.2, Bytes::Text), &all()).unwrap();
    // The quad and the line on it; a triangle, whose sides are straight; both; lines alone.
    for own in [&[1, 6][..], &[8], &[1, 3, 6, 8], &[1, 2, 3, 4, 5]] {
        let model = without_middles(model(), |n| own.contains(&n));
        let (mesh, _) = read(&model.write(2.2, Bytes::Little), &all()).unwrap();
        assert_eq!(places(&mesh), places(&expected), "{own:?}");
    }
}

/// The joint along a curve of two nodes is that of three.
#[test]
fn joints_go_along_lines_of_two_nodes() {
    let bytes = straight().write(4.1, Bytes::Text);
    let expected = built_of("three_nodes", CASE, &bytes).unwrap();
    let model = without_middles(straight(), |_| true);
    let found = built_of("two_nodes", CASE, &model.write(2.2, Bytes::Text)).unwrap();
    assert_eq!(found.mesh.nodes.len(), expected.mesh.nodes.len());
    assert_eq!(places(&found.mesh), places(&expected.mesh));
    let at = |built: &Built| {
        let [joint] = built.mesh.joints[..] else {
            panic!("one joint");
        };
        let at = |node: usize| built.mesh.nodes[node].map(f64::to_bits);
        [joint.minus.map(at), joint.plus.map(at)]
    };
    assert_eq!(at(&found), at(&expected));
    let file = found.file.unwrap();
    assert_eq!(file.kept, [0, 1, 2, 3, 4, 5]);
    assert_eq!(file.notes[0].split_once(": ").unwrap().1, SAID);
}

/// A line that goes on along a surface that the case leaves out ends with the case's elements.
#[test]
fn sides_of_what_is_left_out_are_known() {
    for own in [
        &[][..],
        &[6, 7, 8],
        &[1, 2, 3, 4, 5],
        &[1, 2, 3, 4, 5, 6, 7, 8],
    ] {
        let model = without_middles(straight(), |n| own.contains(&n));
        let outcome = read(
            &model.write(2.2, Bytes::Text),
            &wanting(&["left"], &["bottom"]),
        );
        // Lines of three nodes have a middle, and straight sides without one are not theirs.
        if own == [6, 7, 8] {
            let why = outcome.unwrap_err();
            assert!(why.contains("`bottom` is no side"), "{why}");
            continue;
        }
        let (mesh, _) = outcome.unwrap();
        assert_eq!(mesh.lines["bottom"].edges, [(0, 0)], "{own:?}");
    }
    // A line that is no side at all is refused.
    let mut model = without_middles(straight(), |_| true);
    model.elements[2].3[1] = 40;
    let why = read(
        &model.write(2.2, Bytes::Text),
        &wanting(&["left", "right"], &["bottom"]),
    )
    .unwrap_err();
    assert!(
        why.contains("element 3 of the physical curve `bottom` is no side"),
        "{why}"
    );
}

/// Quads of 9 nodes stay so, whichever way they go round.
#[test]
fn quads_of_nine_nodes_keep_the_middle() {
    let (expected, _) = read(&model().write(4.1, Bytes::Text), &all()).unwrap();
    let mut nine = model();
    nine.nodes.insert(0, (7, [0.5, 0.5, 0.0]));
    let quad = &mut nine.elements[6];
    quad.2 = 10;
    quad.3.push(7);
    for clockwise in [false, true] {
        if clockwise {
            let nodes = &mut nine.elements[6].3;
            nodes[1..4].reverse();
            nodes[4..8].reverse();
        }
        for (version, bytes) in FORMATS {
            let (mesh, notes) = read(&nine.write(version, bytes), &all()).unwrap();
            assert_eq!(mesh.lines["bottom"].edges, expected.lines["bottom"].edges);
            assert_eq!(mesh.solids[0].kind(), &QUAD9);
            let at = |mesh: &Mesh, node: usize| {
                let node = mesh.solids[0].nodes()[node];
                mesh.nodes[node].map(f64::to_bits)
            };
            for node in 0..8 {
                assert_eq!(at(&mesh, node), at(&expected, node));
            }
            assert_eq!(at(&mesh, 8), [0.5_f64.to_bits(); 2]);
            assert_eq!(notes.len(), 2, "{notes:?}");
        }
    }
    // That it is there at all is seen to.
    nine.nodes.remove(0);
    let why = read(&nine.write(2.2, Bytes::Text), &all()).unwrap_err();
    assert!(
        why.contains("element 7 has the node 7, which is not among"),
        "{why}"
    );
}

/// Mistakes in elements of first order are reported like others.
#[test]
fn mistakes_are_told() {
    let says = |change: &dyn Fn(&mut Model), says: &str| {
        let mut model = without_middles(straight(), |_| true);
        change(&mut model);
        let why = read(&model.write(2.2, Bytes::Text), &all()).unwrap_err();
        assert!(why.contains(says), "{why}");
    };
    says(
        &|m| m.elements[7].3[1] = 20,
        "element 8 has the node 20 twice",
    );
    says(
        &|m| m.elements[7].3[1] = 55,
        "element 8 has the node 55, which is not among",
    );
    says(
        &|m| m.elements[8].3 = m.elements[7].3.clone(),
        "elements 8 and 9 have the same nodes",
    );
    says(
        &|m| m.elements[8].3 = vec![20, 60, 10],
        "elements 7 and 9 lie on each other",
    );
    says(&|m| m.nodes[4].1[2] = 0.5, "node 50 is at z = 0.5");
}
