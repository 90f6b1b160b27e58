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

    /// Whether a vertex does not make a side too heavy, or the side is the lighter one.
    fn has_room(&self, graph: &Graph, vertex: usize, side: u8) -> bool {
        let [own, other] = [side, 1 - side].map(|side| self.weights[usize::from(side)]);
        let total = (own + other + self.weights[2]) as f64;
        let new = (own + i64::from(graph.weights[vertex])) as f64;
        own < other || new <= LARGEST_SHARE * total
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

/// One round of moves.
struct Round<'a> {
    graph: &'a Graph,
    separated: &'a mut Separated,
    /// The round in which each vertex has moved, if it has.
    moved_in: &'a mut [u8],
    number: u8,
    /// By gain: vertices, and the side they move to. Entries are not taken out when the gain changes, but
    /// compared when their turn comes.
    moves: BinaryHeap<(i64, u32, u8)>,
    /// What was changed since the best state: vertices, and where they were.
    changes: Vec<(u32, u8)>,
}

impl Round<'_> {
    /// Offers a vertex of the separator to these sides.
    fn offer(&mut self, vertex: usize, sides: &[u8]) {
        for &side in sides {
            let gain = self.separated.gain(self.graph, vertex, side);
            self.moves.push((gain, vertex as u32, side));
        }
    }

    /// The vertex whose move gains most, and its side.
    fn best(&mut self) -> Option<(usize, u8)> {
        while let Some((gain, vertex, side)) = self.moves.pop() {
            let v = vertex as usize;
            if self.separated.sides[v] != SEPARATOR || self.moved_in[v] == self.number {
                continue;
            }
            let now = self.separated.gain(self.graph, v, side);
            if now < gain {
                self.moves.push((now, vertex, side));
            } else if self.separated.has_room(self.graph, v, side) {
                return Some((v, side));
            }
        }
        None
    }

    /// Moves a vertex; its neighbours on the other side enter the separator.
    fn carry_out(&mut self, vertex: usize, side: u8) {
        let graph = self.graph;
        self.moved_in[vertex] = self.number;
        self.separated.put(graph, vertex, side);
        self.changes.push((vertex as u32, SEPARATOR));
        for &neighbour in graph.neighbours(vertex) {
            let u = neighbour as usize;
            if self.separated.sides[u] != 1 - side {
                continue;
            }
            self.separated.put(graph, u, SEPARATOR);
            self.changes.push((neighbour, 1 - side));
            if self.moved_in[u] != self.number {
                self.offer(u, &[0, 1]);
            }
            // It no longer enters with its neighbours in the separator.
            for &third in graph.neighbours(u) {
                let t = third as usize;
                if self.separated.sides[t] == SEPARATOR && self.moved_in[t] != self.number {
                    self.offer(t, &[side]);
                }
            }
        }
    }
}

fn improve(graph: &Graph, separated: &mut Separated, moved_in: &mut [u8], number: u8) {
    let mut round = Round {
        graph,
        separated,
        moved_in,
        number,
        moves: BinaryHeap::new(),
        changes: Vec::new(),
    };
    for vertex in 0..graph.n() {
        if round.separated.sides[vertex] == SEPARATOR {
            round.offer(vertex, &[0, 1]);
        }
    }
    let mut since = 0;
    let mut best = round.separated.cost();
    while let Some((vertex, side)) = round.best() {
        round.carry_out(vertex, side);
        let cost = round.separated.cost();
        if cost < best {
            best = cost;
            round.changes.clear();
            since = 0;
        } else {
            since += 1;
            if since > PATIENCE {
                break;
            }
        }
    }
    for (vertex, side) in round.changes.into_iter().rev() {
        round.separated.put(graph, vertex as usize, side);
    }
}
