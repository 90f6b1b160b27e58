//! Cuts a graph in two sides of about the same weight by few vertices.

use super::graph::Graph;
use super::separator::{SEPARATOR, Separated, refine};

/// The side of every vertex: 0, 1, or [`SEPARATOR`]. No edge leads from side 0 to side 1.
///
/// The graph is halved across each of the directions in which heights of its vertices are known,
/// every cut is improved, and the best one taken.
pub(super) fn bisect(graph: &Graph) -> Vec<u8> {
    let mut order: Vec<u32> = (0..graph.n() as u32).collect();
    let half = order.len() / 2;
    let mut best: Option<Separated> = None;
    for heights in &graph.heights {
        order.select_nth_unstable_by_key(half, |&vertex| (heights[vertex as usize], vertex));
        let mut sides = vec![0; graph.n()];
        for &vertex in &order[half..] {
            sides[vertex as usize] = 1;
        }
        for &vertex in &order[..half] {
            let mut neighbours = graph.neighbours(vertex as usize).iter();
            if neighbours.any(|&other| sides[other as usize] == 1) {
                sides[vertex as usize] = SEPARATOR;
            }
        }
        let mut separated = Separated::new(graph, sides);
        refine(graph, &mut separated);
        if best
            .as_ref()
            .is_none_or(|best| separated.cost() < best.cost())
        {
            best = Some(separated);
        }
    }
    best.map_or_else(Vec::new, |best| best.sides)
}

/// Heights of the vertices of a connected graph where it is not known where they lie: differences
/// of the distances, in edges, from two vertices that are far from each other, those from two
/// others, and what lies between these two directions.
pub(super) fn heights_by_distance(graph: &Graph) -> Vec<Vec<i32>> {
    let farthest = |distances: &[i32]| {
        let all = distances
            .iter()
            .zip(0..)
            .max_by_key(|&(&distance, _)| distance);
        all.map_or(0, |(_, vertex)| vertex)
    };
    let from = |vertex: usize| distances(graph, vertex);
    let a = from(farthest(&from(0)));
    let b = from(farthest(&a));
    let combined = |p: &[i32], q: &[i32], combine: fn(i32, i32) -> i32| -> Vec<i32> {
        p.iter().zip(q).map(|(&p, &q)| combine(p, q)).collect()
    };
    let c = from(farthest(&combined(&a, &b, i32::min)));
    let d = from(farthest(&c));
    let along = combined(&a, &b, |p, q| p - q);
    let across = combined(&c, &d, |p, q| p - q);
    vec![
        combined(&along, &across, |p, q| p + q),
        combined(&along, &across, |p, q| p - q),
        along,
        across,
    ]
}

/// Distance of every vertex from this one, in edges.
fn distances(graph: &Graph, from: usize) -> Vec<i32> {
    let mut distances = vec![-1; graph.n()];
    distances[from] = 0;
    let (mut queue, mut next) = (vec![from as u32], 0);
    while next < queue.len() {
        let vertex = queue[next] as usize;
        for &neighbour in graph.neighbours(vertex) {
            if distances[neighbour as usize] < 0 {
                distances[neighbour as usize] = distances[vertex] + 1;
                queue.push(neighbour);
            }
        }
        next += 1;
    }
    distances
}
