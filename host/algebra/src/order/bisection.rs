//! Cuts a graph in two sides of about the same weight by few vertices.

use super::graph::Graph;
use super::separator::{SEPARATOR, Separated, refine};
use std::cmp::Reverse;

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

/// Heights of the vertices of a connected graph where it is not known where they lie: from their
/// distances, in edges, from four vertices that are far from each other. In a rectangle these are
/// its corners, and what is nearer to two of them than to the others lies on one side of its middle.
pub(super) fn heights_by_distance(graph: &Graph) -> Vec<Vec<i32>> {
    // Of all that are as far, one with few neighbours, in a corner of the mesh.
    let farthest = |distances: &[i32]| {
        let all = (0..graph.n())
            .max_by_key(|&vertex| (distances[vertex], Reverse(graph.neighbours(vertex).len())));
        all.unwrap_or(0)
    };
    let mut nearest = distances(graph, 0);
    let mut from: Vec<Vec<i32>> = Vec::new();
    for corner in 0..4 {
        let own = distances(graph, farthest(&nearest));
        if corner == 0 {
            nearest.clone_from(&own);
        }
        for (nearest, own) in nearest.iter_mut().zip(&own) {
            *nearest = (*nearest).min(*own);
        }
        from.push(own);
    }
    let combined = |signs: [i32; 4]| -> Vec<i32> {
        let height = |vertex: usize| {
            (0..4)
                .map(|corner| signs[corner] * from[corner][vertex])
                .sum()
        };
        (0..graph.n()).map(height).collect()
    };
    vec![
        combined([1, 1, -1, -1]),
        combined([1, -1, 1, -1]),
        combined([1, -1, -1, 1]),
        combined([1, -1, 0, 0]),
        combined([0, 0, 1, -1]),
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
