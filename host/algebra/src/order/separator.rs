//! Improves a separator by moving its vertices to one side, one after the other (Fiduccia &
//! Mattheyses 1982; for separators Ashcraft & Liu 1998).

use super::graph::Graph;
use std::collections::BinaryHeap;

/// The part of a graph that is in neither side.
pub(super) const SEPARATOR: u8 = 2;
/// Largest share of one side.
const LARGEST_SHARE: f64 = 0.6;
/// Rounds over a separator, at most.
const ROUNDS: u8 = 4;
/// Moves without an improvement that end a round.
const PATIENCE: usize = 30;

/// A graph cut in two.
#[derive(Debug)]
pub(super) struct Separated {
    /// Side of every vertex: 0, 1, or [`SEPARATOR`].
    pub(super) sides: Vec<u8>,
    /// Weights of both sides and of the separator.
    weights: [i64; 3],
}

/// To be compared: too much on one side, weight of the separator, difference of the sides.
type Cost = (i64, i64, i64);

impl Separated {
    pub(super) fn new(graph: &Graph, sides: Vec<u8>) -> Self {
        let mut weights = [0; 3];
        for (&side, &weight) in sides.iter().zip(&graph.weights) {
            weights[usize::from(side)] += i64::from(weight);
        }
        Self { sides, weights }
    }

    pub(super) fn cost(&self) -> Cost {
        let [a, b, separator] = self.weights;
        let largest = (LARGEST_SHARE * (a + b + separator) as f64) as i64;
        ((a.max(b) - largest).max(0), separator, (a - b).abs())
    }

    fn put(&mut self, graph: &Graph, vertex: usize, side: u8) {
        let weight = i64::from(graph.weights[vertex]);
        self.weights[usize::from(self.sides[vertex])] -= weight;
        self.weights[usize::from(side)] += weight;
        self.sides[vertex] = side;
    }

    /// By how much the separator becomes lighter if a vertex leaves it to this side, and its
    /// neighbours on the other side enter it.
    fn gain(&self, graph: &Graph, vertex: usize, side: u8) -> i64 {
        let others = graph.neighbours(vertex).iter();
        let entering = others.filter(|&&other| self.sides[other as usize] == 1 - side);
        let entering: i64 = entering
            .map(|&other| i64::from(graph.weights[other as usize]))
            .sum();
        i64::from(graph.weights[vertex]) - entering
    }
}

/// Improves a separator in rounds as long as they help. In each a vertex moves at most once, also
/// where that makes the separator heavier for a while; the best state of the round is kept.
pub(super) fn refine(graph: &Graph, separated: &mut Separated) {
    let mut moved_in = vec![0_u8; graph.n()];
    for round in 1..=ROUNDS {
        let before = separated.cost();
        improve(graph, separated, &mut moved_in, round);
        if separated.cost() >= before {
            break;
        }
    }
}

fn improve(graph: &Graph, separated: &mut Separated, moved_in: &mut [u8], round: u8) {
    let mut moves: BinaryHeap<(i64, u32, u8)> = BinaryHeap::new();
    for vertex in 0..graph.n() {
        if separated.sides[vertex] == SEPARATOR {
            for side in [0, 1] {
                moves.push((separated.gain(graph, vertex, side), vertex as u32, side));
            }
        }
    }
    let mut since = 0;
    let mut best = separated.cost();
    // What was changed since then: vertices, and where they were.
    let mut changes: Vec<(u32, u8)> = Vec::new();
    while let Some((gain, vertex, side)) = moves.pop() {
        let v = vertex as usize;
        if separated.sides[v] != SEPARATOR || moved_in[v] == round {
            continue;
        }
        // Entries are not taken out when the gain changes, but compared when their turn comes.
        let now = separated.gain(graph, v, side);
        if now < gain {
            moves.push((now, vertex, side));
            continue;
        }
        let (own, other) = (
            separated.weights[usize::from(side)],
            separated.weights[usize::from(1 - side)],
        );
        let total = (own + other + separated.weights[2]) as f64;
        if own >= other && (own + i64::from(graph.weights[v])) as f64 > LARGEST_SHARE * total {
            continue;
        }
        moved_in[v] = round;
        separated.put(graph, v, side);
        changes.push((vertex, SEPARATOR));
        for &neighbour in graph.neighbours(v) {
            let u = neighbour as usize;
            if separated.sides[u] == 1 - side {
                separated.put(graph, u, SEPARATOR);
                changes.push((neighbour, 1 - side));
                if moved_in[u] != round {
                    for side in [0, 1] {
                        moves.push((separated.gain(graph, u, side), neighbour, side));
                    }
                }
                // It no longer enters with its neighbours in the separator.
                for &third in graph.neighbours(u) {
                    let t = third as usize;
                    if separated.sides[t] == SEPARATOR && moved_in[t] != round {
                        moves.push((separated.gain(graph, t, side), third, side));
                    }
                }
            }
        }
        let cost = separated.cost();
        if cost < best {
            best = cost;
            changes.clear();
            since = 0;
        } else {
            since += 1;
            if since > PATIENCE {
                break;
            }
        }
    }
    for (vertex, side) in changes.into_iter().rev() {
        separated.put(graph, vertex as usize, side);
    }
}
