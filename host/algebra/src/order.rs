//! Orders of elimination: along mesh lines where nodes lie on a grid, by nested dissection of the
//! graph where they do not, by minimum degree where there are few unknowns.
//!
//! The order with the fewest operations is taken. Any order gives
//! a right factorisation.

mod bisection;
mod counts;
mod dissection;
mod graph;
mod lines;
mod minimum_degree;
mod separator;

pub use lines::mesh_lines;

use crate::{Pattern, Singular};
use graph::Compressed;

/// Unknowns from which on nested dissection is used: as much work as after minimum degree at 10⁴
/// unknowns, a fifth less at 6·10⁵.
const WORTH_DISSECTING: usize = 5_000;
/// An order that replaces mesh lines has to do with this share of their operations: orders that are
/// about as good do not take turns as a mesh changes.
const CLEARLY_LESS: f64 = 0.8;

/// An order of elimination.
pub(crate) enum Order {
    /// Approximate minimum degree.
    MinimumDegree,
    /// Numbers within the eliminated unknowns.
    Given(Vec<u32>),
}

/// Chooses the order of the eliminated unknowns of a pattern, the others being kept. `lines` are
/// the mesh lines on which all unknowns lie.
///
/// # Errors
/// Those of `minimum_degree`.
pub(crate) fn choose(
    pattern: &Pattern,
    eliminated: &[u32],
    lines: Option<&[[u32; 2]]>,
    minimum_degree: impl FnOnce() -> Result<Vec<u32>, Singular>,
) -> Result<Order, Singular> {
    let n = eliminated.len();
    // Chains of unknowns between kept ones: minimum degree would not see those.
    if n < WORTH_DISSECTING && (lines.is_none() || n == pattern.n()) {
        return Ok(Order::MinimumDegree);
    }
    let usual = match lines {
        Some(lines) => {
            let of_eliminated = eliminated.iter().map(|&unknown| lines[unknown as usize]);
            let of_eliminated: Vec<_> = of_eliminated.collect();
            let usual = lines::order(&of_eliminated);
            if lines::are_a_grid(&of_eliminated) {
                return Ok(Order::Given(usual));
            }
            usual
        }
        None => minimum_degree()?,
    };
    let mut kept = vec![true; pattern.n()];
    for &unknown in eliminated {
        kept[unknown as usize] = false;
    }
    let compressed = Compressed::new(pattern, &kept, lines);
    let in_pattern: Vec<u32> = usual.iter().map(|&at| eliminated[at as usize]).collect();
    let of_usual = counts::operations(&compressed, &compressed.vertices_by(&in_pattern));
    let free: Vec<u32> = (0..compressed.graph.n() as u32)
        .filter(|&vertex| !compressed.is_kept[vertex as usize])
        .collect();
    let dissected = dissection::order(&compressed.graph, &free);
    let allowed = if lines.is_some() { CLEARLY_LESS } else { 1.0 } * of_usual;
    if counts::operations(&compressed, &dissected) > allowed {
        return Ok(Order::Given(usual));
    }
    let mut number = vec![0; pattern.n()];
    for (new, &unknown) in (0..).zip(eliminated) {
        number[unknown as usize] = new;
    }
    let unknowns = dissected
        .iter()
        .flat_map(|&vertex| compressed.unknowns(vertex as usize));
    let order = unknowns.map(|&unknown| number[unknown as usize]);
    Ok(Order::Given(order.collect()))
}

/// The place of every number in an order of them.
pub(crate) fn places(order: &[u32]) -> Vec<u32> {
    let mut places = vec![0; order.len()];
    for (at, &number) in (0..).zip(order) {
        places[number as usize] = at;
    }
    places
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::meshes;
    use separator::{SEPARATOR, Separated};

    fn compressed(mesh: &meshes::Mesh) -> Compressed {
        let pattern = mesh.pattern();
        Compressed::new(&pattern, &vec![false; pattern.n()], Some(&mesh.lines()))
    }

    fn chosen(mesh: &meshes::Mesh, with_lines: bool) -> Vec<u32> {
        let (pattern, lines) = (mesh.pattern(), mesh.lines());
        let eliminated: Vec<u32> = (0..pattern.n() as u32).collect();
        let as_they_come = || Ok(eliminated.clone());
        let lines = with_lines.then_some(lines.as_slice());
        match choose(&pattern, &eliminated, lines, as_they_come).unwrap() {
            Order::Given(order) => order,
            Order::MinimumDegree => panic!("too few unknowns"),
        }
    }

    /// Entries of every column of the factors, by elimination of sets.
    fn operations_by_elimination(compressed: &Compressed, order: &[u32]) -> f64 {
        let graph = &compressed.graph;
        let mut near: Vec<std::collections::BTreeSet<u32>> = (0..graph.n())
            .map(|vertex| graph.neighbours(vertex).iter().copied().collect())
            .collect();
        let weight = |vertex: u32| f64::from(graph.weights[vertex as usize]);
        let mut sum = 0.0;
        for &pivot in order {
            let later = std::mem::take(&mut near[pivot as usize]);
            sum += crate::multifrontal::work(
                weight(pivot),
                later.iter().map(|&vertex| weight(vertex)).sum(),
            );
            for &vertex in &later {
                near[vertex as usize].extend(&later);
                near[vertex as usize].remove(&vertex);
                near[vertex as usize].remove(&pivot);
            }
        }
        sum
    }

    #[test]
    fn counts_the_operations_of_any_order() {
        let pattern = meshes::scattered(6).pattern();
        // Nodes of two unknowns, some of which are kept, one alone.
        let kept: Vec<bool> = (0..pattern.n()).map(|i| i % 11 < 2 || i == 100).collect();
        let compressed = Compressed::new(&pattern, &kept, None);
        let free = (0..compressed.graph.n() as u32).filter(|&v| !compressed.is_kept[v as usize]);
        let as_they_come: Vec<u32> = free.collect();
        let backwards: Vec<u32> = as_they_come.iter().rev().copied().collect();
        let dissected = dissection::order(&compressed.graph, &as_they_come);
        for order in [as_they_come, backwards, dissected] {
            let counted = counts::operations(&compressed, &order);
            let exact = operations_by_elimination(&compressed, &order);
            assert!((counted - exact).abs() < 1e-9 * exact, "{counted} {exact}");
        }
    }

    #[test]
    fn unknowns_of_a_node_are_in_one_vertex() {
        let mesh = meshes::scattered(7);
        let compressed = compressed(&mesh);
        // Two sides of a triangle on the boundary: their middles have the same neighbours.
        let n = compressed.graph.n();
        assert!(n <= mesh.positions.len() && 10 * n > 9 * mesh.positions.len());
        for vertex in 0..n {
            for pair in compressed.unknowns(vertex).chunks(2) {
                assert_eq!((pair[0] % 2, pair[1]), (0, pair[0] + 1));
            }
        }
    }

    #[test]
    fn separators_separate_and_are_short() {
        for lines_known in [true, false] {
            let n = 40;
            let mut graph = compressed(&meshes::scattered(n)).graph;
            if !lines_known {
                graph.heights = bisection::heights_by_distance(&graph);
            }
            let sides = bisection::bisect(&graph);
            for vertex in 0..graph.n() {
                let across = 1_u8.wrapping_sub(sides[vertex]);
                let mut neighbours = graph.neighbours(vertex).iter();
                let touches = neighbours.any(|&other| sides[other as usize] == across);
                assert!(sides[vertex] == SEPARATOR || !touches, "{vertex}");
            }
            let separated = Separated::new(&graph, sides);
            let (excess, weight, _) = separated.cost();
            assert_eq!(excess, 0, "no side is too heavy");
            // A line of the grid has 2 n + 1 nodes.
            let line = 2 * (2 * n + 1) as i64;
            assert!(4 * weight <= 5 * line, "{weight} {line}");
        }
    }

    #[test]
    fn refining_never_makes_a_separator_worse() {
        let graph = compressed(&meshes::scattered(12)).graph;
        for start in 0..20 {
            // All within some columns of numbers: many pieces, thick separators.
            let side = |v: usize| [0, 2, 1, 2][(v + start) * (start + 3) / graph.n() % 4];
            let mut sides: Vec<u8> = (0..graph.n()).map(side).collect();
            for vertex in 0..graph.n() {
                let mut neighbours = graph.neighbours(vertex).iter();
                if sides[vertex] == 0 && neighbours.any(|&other| sides[other as usize] == 1) {
                    sides[vertex] = SEPARATOR;
                }
            }
            let mut separated = Separated::new(&graph, sides);
            let before = separated.cost();
            separator::refine(&graph, &mut separated);
            assert!(separated.cost() <= before);
            assert_eq!(
                Separated::new(&graph, separated.sides.clone()).cost(),
                separated.cost(),
                "weights are those of the sides"
            );
            for vertex in (0..graph.n()).filter(|&vertex| separated.sides[vertex] == 0) {
                let neighbours = graph.neighbours(vertex).iter();
                assert!(
                    neighbours
                        .clone()
                        .all(|&other| separated.sides[other as usize] != 1)
                );
            }
        }
    }

    #[test]
    fn minimum_degree_makes_no_fill_on_a_tree() {
        // Vertex i hangs from vertex (i − 1) / 2; the root lies outside of the part.
        let n = 63;
        let parent = |v: usize| (v - 1) / 2;
        let mut near = vec![Vec::new(); n];
        for vertex in 1..n {
            near[vertex].push(parent(vertex) as u32);
            near[parent(vertex)].push(vertex as u32);
        }
        let mut graph = graph::Graph {
            start: vec![0],
            weights: vec![1; n],
            ..graph::Graph::default()
        };
        for near in near {
            graph.neighbours.extend(near);
            graph.start.push(graph.neighbours.len() as u32);
        }
        let part: Vec<u32> = (1..n as u32).collect();
        let mut order = vec![0; part.len()];
        minimum_degree::order(&graph, &part, &mut vec![u32::MAX; n], &mut order);
        let place = |v: usize| order.iter().position(|&o| o as usize == v);
        for vertex in 3..n {
            assert!(place(vertex).unwrap() < place(parent(vertex)).unwrap());
        }
    }

    #[test]
    fn every_unknown_stands_in_the_order_once() {
        for with_lines in [true, false] {
            let mesh = meshes::scattered(30);
            let mut order = chosen(&mesh, with_lines);
            assert!(order.len() > WORTH_DISSECTING);
            order.sort_unstable();
            assert!((0..).zip(&order).all(|(i, &unknown)| i == unknown));
        }
    }

    #[test]
    fn a_grid_keeps_its_lines_and_scattered_nodes_do_not() {
        for (mesh, keeps) in [
            (meshes::grid(40), true),
            (meshes::regular(40), true),
            (meshes::scattered(40), false),
            (meshes::scattered_quads(40), false),
        ] {
            let along_lines = lines::order(&mesh.lines());
            assert_eq!(chosen(&mesh, true) == along_lines, keeps);
        }
    }
}
