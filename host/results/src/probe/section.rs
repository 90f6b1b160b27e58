//! The force of a group on a line inside it: the one that passes through.
//!
//! The internal nodal forces of all elements at a line inside a group cancel. Those of the elements
//! on one side are the force that these elements receive through the line. The side is that of
//! greater coordinates (of a closed line, the inside), so that compression is positive, as at a
//! pile's toe: its elements are on the side of greater z there. Sides are found edge by edge, so
//! the line may have any shape.

use mechanics::mesh::{Line, Mesh};
use std::collections::{HashMap, HashSet, VecDeque};

/// What of a group counts at a line that lies inside it.
#[derive(Debug)]
pub struct Section {
    /// Elements, by their number within the group.
    pub elements: Vec<usize>,
    /// Nodes at which their forces are summed.
    pub nodes: HashSet<usize>,
}

/// A place in the plane; nodes that were doubled share it.
type At = [u64; 2];

/// The part of group `number` that a line inside it cuts off. `None` if the line only follows the
/// group's outline, or touches it.
pub fn section(mesh: &Mesh, line: &Line, number: usize) -> Option<Section> {
    of_solids(mesh, line, number).or_else(|| of_joints(mesh, line, number))
}

fn at(mesh: &Mesh, node: usize) -> At {
    mesh.nodes[node].map(f64::to_bits)
}

fn of_solids(mesh: &Mesh, line: &Line, number: usize) -> Option<Section> {
    let mut sides: HashMap<At, usize> = HashMap::new();
    let own = || {
        let edges = line.edges.iter();
        edges.filter(|(quad, _)| mesh.solids[*quad].group == number)
    };
    for &edge in own() {
        *sides.entry(at(mesh, mesh.edge(edge)[2])).or_default() += 1;
    }
    if sides.values().all(|&count| count < 2) {
        return None;
    }
    let starts = starts(mesh, line);
    // Edges run counter-clockwise, with their element on the left.
    let counted = |&&edge: &&(usize, usize)| {
        let [a, _, middle] = mesh.edge(edge).map(|node| at(mesh, node));
        starts.get(&middle) == Some(&a)
    };
    let edges: Vec<(usize, usize)> = own().filter(counted).copied().collect();
    let other: Vec<(usize, usize)> = own().filter(|edge| !counted(edge)).copied().collect();
    let quads = on_the_side(mesh, number, &edges, &other);
    let of_group = mesh.solids.iter().enumerate();
    let of_group = of_group.filter(|(_, quad)| quad.group == number);
    let elements = of_group
        .enumerate()
        .filter(|(_, (quad, _))| quads.contains(quad))
        .map(|(element, _)| element)
        .collect();
    let nodes = edges.into_iter().flat_map(|edge| mesh.edge(edge)).collect();
    Some(Section { elements, nodes })
}

/// Elements that are reached around a node from those in `queue`, across the edges in `beside`.
fn around(
    mesh: &Mesh,
    node: usize,
    mut queue: Vec<usize>,
    beside: &HashMap<usize, Vec<usize>>,
) -> HashSet<usize> {
    let mut around: HashSet<usize> = queue.iter().copied().collect();
    while let Some(solid) = queue.pop() {
        let own = mesh.solids[solid].edges();
        for [_, _, middle] in own.filter(|[a, b, _]| [a, b].contains(&&node)) {
            for &next in beside.get(&middle).into_iter().flatten() {
                if around.insert(next) {
                    queue.push(next);
                }
            }
        }
    }
    around
}

/// Elements of a group on the side of a line that `edges` belong to; `other` are the edges of the other
/// side. The elements have an edge on the line or, as some triangles, only a node. Around a node at which
/// the line ends within the group the sides are not separate: only elements next to the line count there.
fn on_the_side(
    mesh: &Mesh,
    group: usize,
    edges: &[(usize, usize)],
    other: &[(usize, usize)],
) -> HashSet<usize> {
    let all = edges.iter().chain(other);
    let line: HashSet<usize> = all.map(|&edge| mesh.edge(edge)[2]).collect();
    let ends = |&edge: &(usize, usize)| {
        let [a, b, _] = mesh.edge(edge);
        [a, b]
    };
    let on_line: HashSet<usize> = edges.iter().flat_map(ends).collect();
    // Elements at the nodes of the line, by the middles of their edges that do not follow it.
    let mut beside: HashMap<usize, Vec<usize>> = HashMap::new();
    for (number, solid) in mesh.solids.iter().enumerate() {
        if solid.group == group && solid.corners().iter().any(|node| on_line.contains(node)) {
            for [_, _, middle] in solid
                .edges()
                .filter(|[_, _, middle]| !line.contains(middle))
            {
                beside.entry(middle).or_default().push(number);
            }
        }
    }
    let mut found: HashSet<usize> = edges.iter().map(|(solid, _)| *solid).collect();
    for &node in &on_line {
        let at_node = |edge: &&(usize, usize)| ends(edge).contains(&node);
        let first = edges.iter().filter(at_node).map(|(solid, _)| *solid);
        let around = around(mesh, node, first.collect(), &beside);
        let comes_around = other
            .iter()
            .filter(at_node)
            .any(|(solid, _)| around.contains(solid));
        if !comes_around {
            found.extend(around);
        } else if let Some(&edge) = edges.iter().find(at_node) {
            found.extend(
                around
                    .into_iter()
                    .filter(|&solid| is_beside(mesh, edge, node, solid)),
            );
        }
    }
    found
}

/// Whether an element at an end of an edge lies on the edge's left, and not beyond that end.
fn is_beside(mesh: &Mesh, edge: (usize, usize), end: usize, solid: usize) -> bool {
    let [from, to, _] = mesh.edge(edge);
    let ([x, y], [x_to, y_to]) = (mesh.nodes[from], mesh.nodes[to]);
    let along = [x_to - x, y_to - y];
    let inward = if end == from { 1.0 } else { -1.0 };
    let corners = mesh.solids[solid].corners();
    let n = corners.len() as f64;
    let centre = [0, 1].map(|c| corners.iter().map(|&node| mesh.nodes[node][c]).sum::<f64>() / n);
    let arm = [0, 1].map(|c| centre[c] - mesh.nodes[end][c]);
    let left = along[0] * arm[1] - along[1] * arm[0];
    left > 0.0 && inward * (along[0] * arm[0] + along[1] * arm[1]) > 0.0
}

/// Zero-thickness elements along the line: what they hand on to the side of greater coordinates is
/// what they exert on the other one.
fn of_joints(mesh: &Mesh, line: &Line, number: usize) -> Option<Section> {
    let middles: HashSet<At> = line
        .edges
        .iter()
        .map(|&edge| at(mesh, mesh.edge(edge)[2]))
        .collect();
    let of_group = mesh.joints.iter().filter(|joint| joint.group == number);
    let (elements, nodes): (Vec<usize>, Vec<[usize; 3]>) = of_group
        .enumerate()
        .filter(|(_, joint)| middles.contains(&at(mesh, joint.minus[2])))
        .map(|(element, joint)| (element, joint.minus))
        .unzip();
    (!elements.is_empty()).then(|| Section {
        elements,
        nodes: nodes.into_iter().flatten().collect(),
    })
}

/// For every edge of a line, by its middle, the end at which it starts when the line is followed
/// with the side that counts on its left.
fn starts(mesh: &Mesh, line: &Line) -> HashMap<At, At> {
    let mut edges: Vec<[usize; 3]> = Vec::new();
    let mut seen = HashSet::new();
    for &edge in &line.edges {
        let nodes = mesh.edge(edge);
        if seen.insert(at(mesh, nodes[2])) {
            edges.push(nodes);
        }
    }
    let mut around: HashMap<At, Vec<usize>> = HashMap::new();
    for (number, edge) in edges.iter().enumerate() {
        for &end in &edge[..2] {
            around.entry(at(mesh, end)).or_default().push(number);
        }
    }
    let mut forward: Vec<Option<bool>> = vec![None; edges.len()];
    let mut starts = HashMap::new();
    for first in 0..edges.len() {
        if forward[first].is_some() {
            continue;
        }
        forward[first] = Some(true);
        let mut piece = Vec::new();
        let mut queue = VecDeque::from([first]);
        while let Some(number) = queue.pop_front() {
            let [mut from, mut to, middle] = edges[number];
            if forward[number] == Some(false) {
                (from, to) = (to, from);
            }
            piece.push((from, to, middle));
            for (end, is_exit) in [(at(mesh, to), true), (at(mesh, from), false)] {
                for &next in &around[&end] {
                    if forward[next].is_none() {
                        let enters_at_start = at(mesh, edges[next][0]) == end;
                        forward[next] = Some(enters_at_start == is_exit);
                        queue.push_back(next);
                    }
                }
            }
        }
        let keeps = counts_on_the_left(mesh, &piece);
        for (from, to, middle) in piece {
            let start = if keeps { from } else { to };
            starts.insert(at(mesh, middle), at(mesh, start));
        }
    }
    starts
}

/// Whether the left of a connected line is the side of greater coordinates; of a closed one, its
/// inside.
fn counts_on_the_left(mesh: &Mesh, piece: &[(usize, usize, usize)]) -> bool {
    let (mut left, mut length, mut area) = ([0.0, 0.0], 0.0, 0.0);
    for &(from, to, _) in piece {
        let ([x, y], [x_to, y_to]) = (mesh.nodes[from], mesh.nodes[to]);
        left[0] -= y_to - y;
        left[1] += x_to - x;
        length += (x_to - x).hypot(y_to - y);
        area += x * y_to - x_to * y;
    }
    if left[0].hypot(left[1]) < 1e-9 * length {
        return area > 0.0;
    }
    let [x, y] = left;
    if x.abs() > y.abs() { x > 0.0 } else { y > 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mechanics::mesh::Solid;

    /// A ring of four quads between squares of half-widths 1 and 2, and the square inside, all of
    /// one group.
    fn ring() -> Mesh {
        let mut mesh = Mesh::default();
        let mut node = |x: f64, y: f64| {
            let found = mesh
                .nodes
                .iter()
                .position(|at| f64::hypot(at[0] - x, at[1] - y) < 1e-12);
            found.unwrap_or_else(|| {
                mesh.nodes.push([x, y]);
                mesh.nodes.len() - 1
            })
        };
        let mut quad = |corners: [[f64; 2]; 4]| {
            let middle = |i: usize| {
                let (a, b) = (corners[i], corners[(i + 1) % 4]);
                [f64::midpoint(a[0], b[0]), f64::midpoint(a[1], b[1])]
            };
            let all: Vec<[f64; 2]> = corners.into_iter().chain((0..4).map(middle)).collect();
            let nodes: Vec<usize> = all.into_iter().map(|[x, y]| node(x, y)).collect();
            Solid::quad(nodes.try_into().unwrap(), 0)
        };
        let inner = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
        let mut quads = vec![quad(inner)];
        for i in 0..4 {
            let (a, b) = (inner[i], inner[(i + 1) % 4]);
            let outer = |p: [f64; 2]| [2.0 * p[0], 2.0 * p[1]];
            quads.push(quad([outer(a), outer(b), b, a]));
        }
        mesh.solids = quads;
        mesh
    }

    /// All edges whose middle is in the list.
    fn line(mesh: &Mesh, middles: &[[f64; 2]]) -> Line {
        let all = (0..mesh.solids.len()).flat_map(|q| (0..4).map(move |e| (q, e)));
        let on = |&edge: &(usize, usize)| middles.contains(&mesh.nodes[mesh.edge(edge)[2]]);
        Line {
            edges: all.filter(on).collect(),
            nodes: Vec::new(),
        }
    }

    #[test]
    fn the_side_of_greater_coordinates_counts() {
        let mesh = ring();
        // The right side of the inner square has the right quad beyond it, its left one the square.
        let elements = |middles: &[[f64; 2]]| {
            section(&mesh, &line(&mesh, middles), 0).map(|section| section.elements)
        };
        assert_eq!(elements(&[[1.0, 0.0]]), Some(vec![2]));
        assert_eq!(elements(&[[-1.0, 0.0]]), Some(vec![0]));
        assert_eq!(elements(&[[0.0, 1.0]]), Some(vec![3]));
        assert_eq!(elements(&[[0.0, -1.0]]), Some(vec![0]));
        // A line around a corner has one side all along, wherever it starts.
        assert_eq!(elements(&[[1.0, 0.0], [0.0, 1.0]]), Some(vec![2, 3]));
        assert_eq!(elements(&[[-1.0, 0.0], [0.0, -1.0]]), Some(vec![0]));
        // The outline has no two sides.
        assert_eq!(elements(&[[2.0, 0.0], [0.0, 2.0]]), None);
    }

    /// Triangles of the unit squares of a grid, each divided from its lower left to its upper right.
    fn triangles(n: usize) -> Mesh {
        let mut mesh = Mesh::default();
        let mut node = |x: f64, y: f64| {
            let found = mesh
                .nodes
                .iter()
                .position(|at| at.map(f64::to_bits) == [x, y].map(f64::to_bits));
            found.unwrap_or_else(|| {
                mesh.nodes.push([x, y]);
                mesh.nodes.len() - 1
            })
        };
        let mut solids = Vec::new();
        for (column, row) in (0..n * n).map(|cell| ((cell % n) as f64, (cell / n) as f64)) {
            let at = |x: f64, y: f64| [column + x, row + y];
            let [a, b, c, d] = [at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)];
            for [a, b, c] in [[a, b, c], [a, c, d]] {
                let middle = |a: [f64; 2], b: [f64; 2]| {
                    [f64::midpoint(a[0], b[0]), f64::midpoint(a[1], b[1])]
                };
                let all = [a, b, c, middle(a, b), middle(b, c), middle(c, a)];
                solids.push(Solid::triangle(all.map(|[x, y]| node(x, y)), 0));
            }
        }
        mesh.solids = solids;
        mesh
    }

    #[test]
    fn triangles_around_a_node_of_the_line_count_without_an_edge_on_it() {
        let mesh = triangles(3);
        let of = |middles: &[[f64; 2]]| {
            let all = (0..mesh.solids.len()).flat_map(|s| (0..3).map(move |e| (s, e)));
            let on = |&edge: &(usize, usize)| middles.contains(&mesh.nodes[mesh.edge(edge)[2]]);
            let line = Line {
                edges: all.filter(on).collect(),
                nodes: Vec::new(),
            };
            section(&mesh, &line, 0).unwrap().elements
        };
        // Across the whole: all triangles of the row above that touch the line.
        assert_eq!(
            of(&[[0.5, 1.0], [1.5, 1.0], [2.5, 1.0]]),
            [6, 7, 8, 9, 10, 11]
        );
        // From one side to a node within: there, only what lies beside the line.
        assert_eq!(of(&[[0.5, 1.0]]), [6, 7]);
        // A line across the diagonals.
        let mut right = of(&[[1.0, 0.5], [1.0, 1.5], [1.0, 2.5]]);
        right.sort_unstable();
        assert_eq!(right, [2, 3, 8, 9, 14, 15]);
    }

    #[test]
    fn of_a_closed_line_the_inside_counts() {
        let mesh = ring();
        let closed = [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]];
        let section = section(&mesh, &line(&mesh, &closed), 0).unwrap();
        assert_eq!(section.elements, [0]);
        assert_eq!(section.nodes.len(), 8);
    }
}
