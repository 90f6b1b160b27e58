//! Shape functions, and the division of elements.

use super::*;

/// Shape functions are one at their nodes and zero at the others, sum up to one, and have the derivatives of
/// differences; so the map takes the middle of every edge to the middle node.
fn check_shape<const N: usize>(kind: &Kind, reference: &Reference<N>, at: [f64; 2]) {
    let (n, d) = (reference.shape)(at);
    assert_relative_eq!(n.iter().sum::<f64>(), 1.0, epsilon = 1e-15);
    for derivative in d {
        assert_relative_eq!(derivative.iter().sum::<f64>(), 0.0, epsilon = 1e-15);
    }
    assert_eq!(kind.n_nodes(), N);
    for (i, node) in kind.places.iter().enumerate() {
        let (n, _) = (reference.shape)(*node);
        for (j, n) in n.into_iter().enumerate() {
            assert_relative_eq!(n, f64::from(u8::from(i == j)), epsilon = 1e-15);
        }
    }
    for [a, b, middle] in kind.edges {
        let [a, b, middle] = [a, b, middle].map(|node| kind.places[*node]);
        for c in 0..2 {
            assert_relative_eq!(f64::midpoint(a[c], b[c]), middle[c]);
        }
    }
    let h = 1e-6;
    for axis in 0..2 {
        let moved = |by: f64| {
            let mut there = at;
            there[axis] += by;
            (reference.shape)(there).0
        };
        let (ahead, behind) = (moved(h), moved(-h));
        for i in 0..N {
            let difference = (ahead[i] - behind[i]) / (2.0 * h);
            assert_relative_eq!(d[axis][i], difference, epsilon = 1e-9);
        }
    }
}

#[test]
fn shape_functions_sum_to_one_and_derivatives_agree_with_differences() {
    check_shape(&TRI6, &tri6::REFERENCE, [0.3, 0.15]);
    check_shape(&QUAD8, &quad8::REFERENCE, [0.3, -0.7]);
    check_shape(&QUAD9, &quad9::REFERENCE, [0.3, -0.7]);
    assert_eq!(Kind::ALL.map(Kind::n_nodes), [6, 8, 9]);
}

/// The four parts of an element, mapped as its nodes say, cover it: a part's node lies where the map of the whole
/// takes it.
fn check_division<const N: usize>(kind: &Kind, reference: &Reference<N>) {
    let bowed = |[x, y]: [f64; 2]| [x + 0.1 * x * y - 0.05 * y * y, y + 0.07 * x * x];
    let nodes: Vec<[f64; 2]> = kind.places.iter().map(|&at| bowed(at)).collect();
    let map = |at: [f64; 2]| {
        let (n, _) = (reference.shape)(at);
        [0, 1].map(|c| (0..N).map(|i| n[i] * nodes[i][c]).sum::<f64>())
    };
    let mut mesh = crate::mesh::Mesh {
        nodes: nodes.clone(),
        ..Default::default()
    };
    let numbers: Vec<usize> = (0..N).collect();
    let kind = Kind::with_nodes(kind.n_nodes()).unwrap();
    mesh.solids.push(crate::mesh::Solid::new(kind, &numbers, 0));
    let fine = mesh.refined();
    assert_eq!(fine.solids.len(), 4);
    let middle = |a: [f64; 2], b: [f64; 2]| [0, 1].map(|c| f64::midpoint(a[c], b[c]));
    for (k, part) in fine.solids.iter().enumerate() {
        // Corners of the part in the coordinates of the whole.
        let n = kind.n_corners();
        let corner = |j: usize| {
            let at = |i: usize| kind.places[i];
            match (k < n, j) {
                (true, 0) => at(k),
                (true, 1) => at(n + k),
                (true, _) if j == n - 1 => at(n + (k + n - 1) % n),
                (true, _) => [0.0, 0.0],
                (false, _) => at(n + j),
            }
        };
        for (i, &node) in part.nodes().iter().enumerate() {
            let at = match kind.edges.iter().find(|edge| edge[2] == i) {
                None if i < n => corner(i),
                Some([a, b, _]) => middle(corner(*a), corner(*b)),
                None => middle(corner(0), corner(2)),
            };
            let expected = map(at);
            for c in 0..2 {
                assert_relative_eq!(fine.nodes[node][c], expected[c], epsilon = 1e-14);
            }
        }
    }
}

#[test]
fn an_element_is_divided_on_its_own_map() {
    check_division(&TRI6, &tri6::REFERENCE);
    check_division(&QUAD8, &quad8::REFERENCE);
    check_division(&QUAD9, &quad9::REFERENCE);
}

/// Nodes in the middle of a layer, with those on its faces.
#[test]
fn nodes_between_faces() {
    assert_eq!(QUAD8.between_faces(0), [[4, 0, 1], [6, 3, 2]]);
    assert_eq!(QUAD8.between_faces(1), [[7, 0, 3], [5, 1, 2]]);
    assert_eq!(QUAD9.between_faces(0), [[4, 0, 1], [8, 7, 5], [6, 3, 2]]);
    assert_eq!(QUAD9.between_faces(1), [[7, 0, 3], [8, 4, 6], [5, 1, 2]]);
}
