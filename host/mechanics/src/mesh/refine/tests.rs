use super::*;
use std::collections::BTreeMap;

/// A quad next to a triangle: the unit square [0, 1]² and the triangle to its right with the tip
/// (2, 0). `bulge` moves the middle of the quad's left side, of the common side and of the
/// triangle's long side.
fn mixed(bulge: f64) -> Mesh {
    let nodes = vec![
        [0.0, 0.0],
        [1.0, 0.0],
        [1.0, 1.0],
        [0.0, 1.0],
        [2.0, 0.0],
        [0.5, 0.0],
        [1.0 + bulge, 0.5],
        [0.5, 1.0],
        [-bulge, 0.5],
        [1.5, 0.0],
        [1.5 + bulge, 0.5 + bulge],
    ];
    let mut mesh = Mesh {
        nodes,
        solids: vec![
            Solid::quad([0, 1, 2, 3, 5, 6, 7, 8], 0),
            Solid::triangle([1, 4, 2, 9, 10, 6], 1),
        ],
        ..Mesh::default()
    };
    // Inner edges count on both sides, as on grids.
    for (name, edges) in [
        ("bottom", vec![(0, 0), (1, 0)]),
        ("between", vec![(0, 1), (1, 2)]),
        ("long", vec![(1, 1)]),
    ] {
        let nodes = edges.iter().flat_map(|&edge| mesh.edge(edge));
        let mut nodes: Vec<usize> = nodes.collect();
        nodes.sort_unstable();
        nodes.dedup();
        mesh.lines.insert(name.to_owned(), Line { edges, nodes });
    }
    let tip = Line {
        edges: Vec::new(),
        nodes: vec![4],
    };
    mesh.lines.insert("tip".to_owned(), tip);
    mesh
}

/// Area inside the quadratic sides of an element: ½ ∮ x dy − y dx, exact by two Gauss points a side.
fn area(mesh: &Mesh, solid: &Solid) -> f64 {
    let side = |[a, b, m]: [usize; 3]| -> f64 {
        let [a, b, m] = [a, b, m].map(|node| mesh.nodes[node]);
        [-1.0_f64, 1.0]
            .map(|sign| {
                let xi = sign / 3.0_f64.sqrt();
                let n = [0.5 * xi * (xi - 1.0), 0.5 * xi * (xi + 1.0), 1.0 - xi * xi];
                let d = [xi - 0.5, xi + 0.5, -2.0 * xi];
                let at = |w: [f64; 3], c: usize| w[0] * a[c] + w[1] * b[c] + w[2] * m[c];
                0.5 * (at(n, 0) * at(d, 1) - at(n, 1) * at(d, 0))
            })
            .iter()
            .sum()
    };
    solid.edges().map(side).sum()
}

/// Length of a line by Gauss points, each edge once.
fn length(mesh: &Mesh, name: &str) -> f64 {
    let (points, weights) = crate::element::gauss(3);
    let mut sides = BTreeMap::new();
    for &edge in &mesh.lines[name].edges {
        let nodes = mesh.edge(edge);
        sides.insert(nodes[2], nodes.map(|node| mesh.nodes[node]));
    }
    let of = |[a, b, m]: &[[f64; 2]; 3]| -> f64 {
        let parts = points.iter().zip(weights).map(|(&xi, weight)| {
            let d = [xi - 0.5, xi + 0.5, -2.0 * xi];
            let at = |c: usize| d[0] * a[c] + d[1] * b[c] + d[2] * m[c];
            weight * at(0).hypot(at(1))
        });
        parts.sum()
    };
    sides.values().map(of).sum()
}

/// Elements by the middles of their sides: every side has the same two ends wherever it is.
fn check_conformity(mesh: &Mesh) {
    let mut sides: BTreeMap<usize, Vec<[usize; 2]>> = BTreeMap::new();
    let mut is_corner = vec![false; mesh.nodes.len()];
    let mut is_used = vec![false; mesh.nodes.len()];
    for solid in &mesh.solids {
        for [a, b, middle] in solid.edges() {
            sides.entry(middle).or_default().push([a, b]);
            is_corner[a] = true;
        }
        for &node in solid.nodes() {
            is_used[node] = true;
        }
    }
    assert!(is_used.iter().all(|used| *used));
    for (middle, sides) in sides {
        assert!(!is_corner[middle]);
        match sides.as_slice() {
            [_] => {}
            [[a, b], [c, d]] => assert_eq!([a, b], [d, c]),
            more => panic!("{more:?}"),
        }
    }
    // No two nodes at one place.
    let places = mesh.nodes.iter().map(|at| at.map(f64::to_bits));
    let places: std::collections::BTreeSet<_> = places.collect();
    assert_eq!(places.len(), mesh.nodes.len());
}

#[test]
fn area_groups_and_lines_stay() {
    for bulge in [0.0, 0.1] {
        let coarse = mixed(bulge);
        let mut fine = coarse.clone();
        for n in 1..=3 {
            fine = fine.refined();
            check_conformity(&fine);
            assert_eq!(fine.solids.len(), 2 << (2 * n));
            for group in 0..2 {
                let areas = |mesh: &Mesh| -> f64 {
                    let own = mesh.solids.iter().filter(|solid| solid.group == group);
                    own.map(|solid| area(mesh, solid)).sum()
                };
                let (coarse, fine) = (areas(&coarse), areas(&fine));
                assert!((coarse - fine).abs() < 1e-14 * coarse, "{coarse} {fine}");
            }
            assert!(fine.solids.iter().all(|solid| area(&fine, solid) > 0.0));
            for (name, edges) in [("bottom", 2), ("between", 2), ("long", 1)] {
                assert_eq!(fine.lines[name].edges.len(), edges << n);
            }
            let length_is = |name: &str, truth: f64, tolerance: f64| {
                let error = (length(&fine, name) / truth - 1.0).abs();
                assert!(error < tolerance, "{name}: {error:e}");
            };
            length_is("bottom", 2.0, 1e-14);
            // A parabola over a chord c with the rise h, in closed form.
            let parabola = |c: f64, h: f64| {
                if h == 0.0 {
                    return c;
                }
                let s = (c * c + 16.0 * h * h).sqrt();
                0.5 * s + c * c / (8.0 * h) * ((4.0 * h + s) / c).ln()
            };
            // The quadrature's error goes down with the sixth power of the size.
            let quadrature = f64::max(1e-14, 1e-3 / 64.0_f64.powi(n));
            length_is("between", parabola(1.0, bulge), quadrature);
            length_is(
                "long",
                parabola(2.0_f64.sqrt(), bulge * 2.0_f64.sqrt()),
                quadrature,
            );
            assert_eq!(fine.lines["tip"], coarse.lines["tip"]);
            assert_eq!(
                fine.nodes[4].map(f64::to_bits),
                [2.0_f64, 0.0].map(f64::to_bits)
            );
        }
        // On the bottom all is at y = 0 exactly, in the order of the sides.
        let bottom = &fine.lines["bottom"].nodes;
        assert_eq!(bottom.len(), 2 * (2 << 3) + 1);
        assert!(bottom.iter().all(|&node| fine.nodes[node][1] == 0.0));
        let between = &fine.lines["between"].nodes;
        assert_eq!(between.len(), 2 * 8 + 1);
        // x = 1 + 4 b y (1 − y) there, the parabola through its three nodes.
        for &node in between {
            let [x, y] = fine.nodes[node];
            assert!((x - 1.0 - 4.0 * bulge * y * (1.0 - y)).abs() < 1e-15);
        }
    }
}

/// A grid that is divided is the grid of half the size, but for the numbers of its nodes.
#[test]
fn a_grid_becomes_the_finer_grid() {
    let places = |mesh: &Mesh| {
        let elements = mesh.solids.iter().map(|solid| {
            let nodes = solid.nodes().iter();
            let mut nodes: Vec<_> = nodes
                .map(|&node| mesh.nodes[node].map(f64::to_bits))
                .collect();
            nodes.sort_unstable();
            nodes
        });
        let mut elements: Vec<_> = elements.collect();
        elements.sort_unstable();
        elements
    };
    let coarse = Mesh::grid(&[0.0, 1.0, 4.0], &[-2.0, 0.0], |column, _| column);
    let fine = Mesh::grid(
        &[0.0, 0.5, 1.0, 2.5, 4.0],
        &[-2.0, -1.0, 0.0],
        |column, _| column / 2,
    );
    let refined = coarse.refined();
    check_conformity(&refined);
    assert_eq!(places(&refined), places(&fine));
}
