use super::*;
use std::collections::{BTreeMap, BTreeSet};

/// Cells of size 1, `columns` by `rows`: quads, but triangles where a function of column and row
/// reports it.
struct Grid {
    columns: usize,
    coordinates: Vec<[f64; 2]>,
    elements: Vec<Solid>,
    /// Middles of all edges, by their ends.
    middles: BTreeMap<(usize, usize), usize>,
}

impl Grid {
    fn new(columns: usize, rows: usize, is_cut: impl Fn(usize, usize) -> bool) -> Self {
        let mut grid = Self {
            columns,
            coordinates: Vec::new(),
            elements: Vec::new(),
            middles: BTreeMap::new(),
        };
        for j in 0..=rows {
            for i in 0..=columns {
                grid.coordinates.push([i as f64, j as f64]);
            }
        }
        for j in 0..rows {
            for i in 0..columns {
                let [a, b, c, d] =
                    [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(|at| grid.at(at));
                if is_cut(i, j) {
                    for corners in [[a, b, c], [a, c, d]] {
                        let nodes = grid.with_middles(corners);
                        grid.elements.push(Solid::triangle(nodes, 0));
                    }
                } else {
                    let nodes = grid.with_middles([a, b, c, d]);
                    grid.elements.push(Solid::quad(nodes, 0));
                }
            }
        }
        grid
    }

    /// Quads and triangles like the fields of a chess board.
    fn mixed(columns: usize, rows: usize) -> Self {
        Self::new(columns, rows, |i, j| (i + j) % 2 == 0)
    }

    fn at(&self, (i, j): (usize, usize)) -> usize {
        j * (self.columns + 1) + i
    }

    fn with_middles<const C: usize, const N: usize>(&mut self, corners: [usize; C]) -> [usize; N] {
        std::array::from_fn(|i| {
            if i < C {
                return corners[i];
            }
            let (a, b) = (corners[i - C], corners[(i - C + 1) % C]);
            let next = self.coordinates.len();
            let middle = *self.middles.entry((a.min(b), a.max(b))).or_insert(next);
            if middle == next {
                let [p, q] = [self.coordinates[a], self.coordinates[b]];
                self.coordinates
                    .push([0, 1].map(|c| f64::midpoint(p[c], q[c])));
            }
            middle
        })
    }

    /// Edges along grid points, straight from one to the next.
    fn line(&self, points: &[(usize, usize)]) -> Interface {
        let mut edges = Vec::new();
        for pair in points.windows(2) {
            let [from, to] = [pair[0], pair[1]];
            let step = |a: usize, b: usize| (b as isize - a as isize).signum();
            let (dx, dy) = (step(from.0, to.0), step(from.1, to.1));
            let mut here = from;
            while here != to {
                let next = (here.0.strict_add_signed(dx), here.1.strict_add_signed(dy));
                let (a, b) = (self.at(here), self.at(next));
                edges.push([a, b, self.middles[&(a.min(b), a.max(b))]]);
                here = next;
            }
        }
        Interface {
            edges,
            opens_ends: true,
        }
    }

    /// Splits, and checks what holds whatever the interfaces.
    fn split(&self, interfaces: &[Interface]) -> Outcome {
        let split = split(self.coordinates.len(), &self.elements, interfaces).unwrap();
        let n_edges: usize = interfaces
            .iter()
            .map(|interface| interface.edges.len())
            .sum();
        assert_eq!(split.joints.len(), n_edges);
        // No element's geometry changes: each of its nodes is the one it was, or a copy.
        for (new, old) in split.elements.iter().zip(&self.elements) {
            let originals = new.nodes().iter().map(|&node| split.original[node]);
            assert!(originals.eq(old.nodes().iter().copied()));
        }
        // No node is left over.
        let used: BTreeSet<usize> = split
            .elements
            .iter()
            .flat_map(|e| e.nodes().iter().copied())
            .collect();
        assert_eq!(used.len(), split.original.len());
        // Sides of joints lie upon each other, and are sides of two elements.
        let mut owners: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for (number, element) in split.elements.iter().enumerate() {
            for [_, _, middle] in element.edges() {
                owners.entry(middle).or_default().push(number);
            }
        }
        let declared = interfaces.iter().flat_map(|interface| &interface.edges);
        for (joint, edge) in split.joints.iter().zip(declared) {
            for side in [joint.right, joint.left] {
                assert_eq!(side.map(|node| split.original[node]), *edge);
                assert_eq!(owners[&side[2]].len(), 1);
            }
            let [right, left] = [joint.right, joint.left].map(|side| owners[&side[2]][0]);
            // The two elements have nodes in common only at closed ends.
            let closed = [0, 1].map(|end| joint.right[end] == joint.left[end]);
            let nodes = |element: usize| split.elements[element].nodes().iter().copied();
            let common: BTreeSet<usize> = nodes(right).collect();
            let common: Vec<usize> = nodes(left).filter(|node| common.contains(node)).collect();
            assert_eq!(
                common.len(),
                closed.into_iter().filter(|&closed| closed).count()
            );
            // The right side is on the right: its element's centre lies there.
            let [a, b, _] = edge.map(|node| self.coordinates[node]);
            for (element, sign) in [(right, -1.0), (left, 1.0)] {
                let corners =
                    &self.elements[element].nodes()[..self.elements[element].nodes().len() / 2];
                for &corner in corners {
                    let p = self.coordinates[corner];
                    let cross = (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]);
                    assert!(sign * cross >= 0.0);
                }
            }
        }
        // Edges that are not cut join their elements as before.
        let cut: BTreeSet<usize> = interfaces
            .iter()
            .flat_map(|i| i.edges.iter().map(|edge| edge[2]))
            .collect();
        let mut joined: BTreeMap<usize, Vec<[usize; 3]>> = BTreeMap::new();
        for (new, old) in split.elements.iter().zip(&self.elements) {
            for ([p, q, middle], [_, _, before]) in new.edges().zip(old.edges()) {
                let edge = [p.min(q), p.max(q), middle];
                joined.entry(before).or_default().push(edge);
            }
        }
        for (middle, edges) in joined {
            if !cut.contains(&middle) && edges.len() == 2 {
                assert_eq!(edges[0], edges[1]);
            }
        }
        Outcome {
            copies: split.original.len() - self.coordinates.len(),
            closed: split
                .joints
                .iter()
                .map(|joint| {
                    (0..2)
                        .filter(|&end| joint.right[end] == joint.left[end])
                        .count()
                })
                .sum(),
            characteristic: characteristic(&split.elements),
            split,
        }
    }
}

struct Outcome {
    split: Split,
    /// Nodes that are new.
    copies: usize,
    /// Ends of joints that are closed.
    closed: usize,
    characteristic: isize,
}

/// Vertices − edges + elements: 1 for every part without a hole, one less for each hole.
fn characteristic(elements: &[Solid]) -> isize {
    let (mut corners, mut middles) = (BTreeSet::<usize>::new(), BTreeSet::<usize>::new());
    for element in elements {
        let (of_corners, of_middles) = element.nodes().split_at(element.nodes().len() / 2);
        corners.extend(of_corners);
        middles.extend(of_middles);
    }
    corners.len() as isize - middles.len() as isize + elements.len() as isize
}

/// New nodes, closed ends, and the characteristic.
fn check(grid: &Grid, interfaces: &[Interface], expected: (usize, usize, isize)) {
    let outcome = grid.split(interfaces);
    let found = (outcome.copies, outcome.closed, outcome.characteristic);
    assert_eq!(found, expected);
}

fn grids() -> [Grid; 3] {
    [
        Grid::new(8, 6, |_, _| false),
        Grid::new(8, 6, |_, _| true),
        Grid::mixed(8, 6),
    ]
}

#[test]
fn a_line_through_the_mesh_cuts_it_in_two() {
    for grid in grids() {
        check(&grid, &[grid.line(&[(0, 3), (8, 3)])], (17, 0, 2));
        check(&grid, &[grid.line(&[(5, 6), (5, 0)])], (13, 0, 2));
    }
}

#[test]
fn a_line_that_ends_inside_leaves_its_tip_closed() {
    for grid in grids() {
        check(&grid, &[grid.line(&[(0, 3), (5, 3)])], (10, 1, 1));
        // Both ends inside: a hole without area.
        check(&grid, &[grid.line(&[(2, 3), (5, 3)])], (5, 2, 0));
    }
}

#[test]
fn ends_on_the_boundary_stay_closed_if_asked() {
    for grid in grids() {
        let mut line = grid.line(&[(0, 3), (8, 3)]);
        line.opens_ends = false;
        check(&grid, &[line], (15, 2, 0));
        let mut line = grid.line(&[(0, 3), (5, 3)]);
        line.opens_ends = false;
        check(&grid, &[line], (9, 2, 0));
    }
}

#[test]
fn a_line_may_have_corners() {
    for grid in grids() {
        let line = grid.line(&[(3, 6), (3, 2), (8, 2)]);
        check(&grid, &[line], (2 * 9 + 1, 0, 2));
    }
    // Along diagonals of the triangles, too.
    let grid = Grid::new(6, 6, |_, _| true);
    let line = grid.line(&[(0, 0), (4, 4), (4, 6)]);
    check(&grid, &[line], (2 * 6 + 1, 0, 2));
}

#[test]
fn a_line_that_ends_on_another_makes_three_of_the_node() {
    for grid in grids() {
        let across = grid.line(&[(0, 3), (8, 3)]);
        let stem = grid.line(&[(4, 0), (4, 3)]);
        let expected = (17 + 2 * 3 + 1, 0, 3);
        check(&grid, &[across.clone(), stem.clone()], expected);
        check(&grid, &[stem, across.clone()], expected);
        // The stem ends inside: its tip is closed.
        let short = grid.line(&[(4, 1), (4, 3)]);
        check(&grid, &[across, short], (17 + 2 * 2, 1, 2));
    }
}

#[test]
fn lines_that_cross_make_four_of_the_node() {
    for grid in grids() {
        let across = grid.line(&[(0, 3), (8, 3)]);
        let along = grid.line(&[(4, 0), (4, 6)]);
        check(&grid, &[across, along], (17 + 13 + 1, 0, 4));
    }
}

#[test]
fn a_closed_line_frees_what_is_inside() {
    for grid in grids() {
        let line = grid.line(&[(2, 1), (6, 1), (6, 4), (2, 4), (2, 1)]);
        // A piece, and a mesh with a hole.
        check(&grid, &[line], (28, 0, 1));
    }
}

#[test]
fn a_pile_has_a_shaft_and_a_base() {
    for grid in grids() {
        // Along the axis x = 0, from the surface to its toe: two interfaces that meet at the corner.
        let shaft = grid.line(&[(1, 6), (1, 3)]);
        let base = grid.line(&[(1, 3), (0, 3)]);
        let outcome = grid.split(&[shaft, base]);
        assert_eq!(
            (outcome.copies, outcome.closed, outcome.characteristic),
            (2 * 4 + 1, 0, 2)
        );
        let of_base: Vec<usize> = outcome
            .split
            .joints
            .iter()
            .map(|joint| joint.interface)
            .collect();
        assert_eq!(of_base, [0, 0, 0, 1]);
        // Shaft alone: the toe's corner stays closed.
        check(&grid, &[grid.line(&[(1, 6), (1, 3)])], (6, 1, 1));
    }
}

#[test]
fn the_far_side_lies_towards_increasing_coordinates() {
    let grid = Grid::mixed(4, 4);
    for points in [
        [(0, 2), (4, 2)],
        [(4, 2), (0, 2)],
        [(2, 0), (2, 4)],
        [(2, 4), (2, 0)],
    ] {
        let Outcome { split, .. } = grid.split(&[grid.line(&points)]);
        let coordinates: Vec<[f64; 2]> = split
            .original
            .iter()
            .map(|&node| grid.coordinates[node])
            .collect();
        for joint in &split.joints {
            let centre = |side: [usize; 3]| {
                let element = split
                    .elements
                    .iter()
                    .find(|e| e.nodes().contains(&side[2]))
                    .unwrap();
                let corners = &element.nodes()[..element.nodes().len() / 2];
                let sum: f64 = corners
                    .iter()
                    .map(|&node| coordinates[node].iter().sum::<f64>())
                    .sum();
                sum / corners.len() as f64
            };
            let [near, far] = joint.near_and_far(&coordinates);
            assert!(centre(near) < centre(far));
            for [from, to, _] in [near, far] {
                let sum = |node: usize| coordinates[node].iter().sum::<f64>();
                assert!(sum(from) < sum(to));
            }
        }
    }
}

#[test]
fn edges_that_cannot_be_cut_are_named() {
    let grid = Grid::mixed(4, 4);
    let refused = |interfaces: &[Interface]| {
        let fault = split(grid.coordinates.len(), &grid.elements, interfaces).unwrap_err();
        (fault.interface, fault.edge, fault.reason)
    };
    let line = grid.line(&[(0, 2), (4, 2)]);
    let boundary = grid.line(&[(0, 0), (2, 0)]);
    assert_eq!(
        refused(&[line.clone(), boundary]),
        (1, 0, Reason::OnBoundary)
    );
    let again = grid.line(&[(3, 2), (2, 2)]);
    assert_eq!(refused(&[line.clone(), again]), (1, 0, Reason::TakenBy(0)));
    let mut wrong = line.clone();
    wrong.edges[2][0] = grid.at((0, 0));
    assert_eq!(refused(&[wrong]), (0, 2, Reason::NoEdge));
    let mut wrong = line;
    wrong.edges[1][2] = grid.coordinates.len();
    assert_eq!(refused(&[wrong]), (0, 1, Reason::NoEdge));
    // An element drawn twice.
    let mut elements = grid.elements.clone();
    elements.extend_from_slice(&grid.elements);
    let fault = split(
        grid.coordinates.len(),
        &elements,
        &[grid.line(&[(0, 2), (4, 2)])],
    );
    assert_eq!(fault.unwrap_err().reason, Reason::Overlapping);
}

/// Any set of edges: what [`Grid::split`] checks holds, and the characteristic follows from the
/// counts of nodes and edges that were split.
#[test]
fn any_edges_can_be_cut() {
    let grid = Grid::mixed(7, 7);
    let inside: Vec<[usize; 3]> = {
        let mut owners: BTreeMap<usize, usize> = BTreeMap::new();
        for element in &grid.elements {
            for [_, _, middle] in element.edges() {
                *owners.entry(middle).or_default() += 1;
            }
        }
        let all = grid.middles.iter().map(|(&(a, b), &middle)| [a, b, middle]);
        all.filter(|edge| owners[&edge[2]] == 2).collect()
    };
    let mut state = 1_u64;
    for share in [5, 20, 50, 80, 100] {
        let mut chosen = Interface {
            edges: Vec::new(),
            opens_ends: true,
        };
        for &edge in &inside {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            if (state >> 33) % 100 < share {
                chosen.edges.push(edge);
            }
        }
        let n_cut = chosen.edges.len();
        let outcome = grid.split(&[chosen]);
        // Every cut edge is two, its middle among the copies; the other copies are corners.
        let new_corners = outcome.copies - n_cut;
        assert_eq!(
            outcome.characteristic,
            1 + new_corners as isize - n_cut as isize
        );
        if share == 100 {
            // Every element is alone.
            let all: usize = grid
                .elements
                .iter()
                .map(|element| element.nodes().len())
                .sum();
            assert_eq!(outcome.split.original.len(), all);
            assert_eq!(outcome.characteristic, grid.elements.len() as isize);
        }
    }
}
