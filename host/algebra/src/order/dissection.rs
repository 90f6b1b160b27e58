//! Nested dissection of a graph: an order of elimination with little fill where vertices lie
//! anyhow (George 1973; Lipton, Rose & Tarjan 1979).

use super::bisection::{bisect, heights_by_distance};
use super::graph::Graph;
use super::minimum_degree;
use super::separator::SEPARATOR;

/// Parts of so few vertices are not cut any more, but ordered by minimum degree.
const SMALLEST: usize = 200;
/// Parts with more vertices than this get a separate task.
const TASK: usize = 2_000;

/// An order of elimination of some vertices of a graph; the others are eliminated after them or
/// not at all.
pub(super) fn order(graph: &Graph, eliminated: &[u32]) -> Vec<u32> {
    let mut number = vec![u32::MAX; graph.n()];
    let part = graph.part(eliminated, &mut number);
    let (outwards, starts) = part.outwards();
    let vertices: Vec<u32> = outwards.iter().map(|&at| eliminated[at as usize]).collect();
    let mut order = vec![0; vertices.len()];
    for piece in starts.windows(2) {
        let piece = piece[0]..piece[1];
        let mut part = Part {
            graph: graph.part(&vertices[piece.clone()], &mut number),
            vertices: vertices[piece.clone()].to_vec(),
        };
        if part.graph.heights.is_empty() {
            part.graph.heights = heights_by_distance(&part.graph);
        }
        dissect(graph, part, &mut number, &mut order[piece]);
    }
    order
}

/// Some vertices of a graph, and the graph between them.
struct Part {
    graph: Graph,
    vertices: Vec<u32>,
}

/// Writes the vertices of a part in order: one side, the other side, and what separates them.
fn dissect(whole: &Graph, part: Part, number: &mut Vec<u32>, order: &mut [u32]) {
    let Part { graph, vertices } = part;
    if vertices.len() <= SMALLEST {
        minimum_degree::order(whole, &vertices, number, order);
        return;
    }
    let sides = bisect(&graph);
    let of_side = |wanted: u8| -> Vec<u32> {
        let numbered = (0..).zip(&sides);
        let chosen = numbered.filter(|&(_, &side)| side == wanted);
        chosen.map(|(vertex, _)| vertex).collect()
    };
    let (a, b, between) = (of_side(0), of_side(1), of_side(SEPARATOR));
    if a.is_empty() || b.is_empty() {
        // All touch each other, or nearly so: no order is better than another.
        order.copy_from_slice(&vertices);
        return;
    }
    let (of_a, rest) = order.split_at_mut(a.len());
    let (of_b, last) = rest.split_at_mut(b.len());
    for (place, &vertex) in last.iter_mut().zip(&between) {
        *place = vertices[vertex as usize];
    }
    let mut inside = vec![u32::MAX; graph.n()];
    let mut side = |side: &[u32]| Part {
        graph: graph.part(side, &mut inside),
        vertices: side
            .iter()
            .map(|&vertex| vertices[vertex as usize])
            .collect(),
    };
    let (a, b) = (side(&a), side(&b));
    drop(graph);
    if a.vertices.len().min(b.vertices.len()) > TASK {
        let mut of_other = vec![u32::MAX; number.len()];
        rayon::join(
            || dissect(whole, a, number, of_a),
            || dissect(whole, b, &mut of_other, of_b),
        );
    } else {
        dissect(whole, a, number, of_a);
        dissect(whole, b, number, of_b);
    }
}
