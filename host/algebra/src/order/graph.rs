//! The graph of a matrix with its unknowns gathered in vertices.

use crate::Pattern;
use crate::pattern::grouped;

/// An undirected graph without loops.
#[derive(Debug, Default)]
pub(super) struct Graph {
    /// Where the neighbours of every vertex start, and the end.
    pub(super) start: Vec<u32>,
    pub(super) neighbours: Vec<u32>,
    /// By vertex: how many unknowns it stands for.
    pub(super) weights: Vec<u32>,
    /// How far along some directions the vertices lie, by direction.
    pub(super) heights: Vec<Vec<i32>>,
}

impl Graph {
    pub(super) fn n(&self) -> usize {
        self.weights.len()
    }

    pub(super) fn neighbours(&self, vertex: usize) -> &[u32] {
        &self.neighbours[self.start[vertex] as usize..self.start[vertex + 1] as usize]
    }

    /// The graph of some of the vertices, renumbered in this order. `number` has
    /// `u32::MAX` everywhere, and is left like that.
    pub(super) fn part(&self, vertices: &[u32], number: &mut [u32]) -> Self {
        for (new, &vertex) in (0..).zip(vertices) {
            number[vertex as usize] = new;
        }
        let mut part = Self {
            start: Vec::with_capacity(vertices.len() + 1),
            weights: Vec::with_capacity(vertices.len()),
            ..Self::default()
        };
        part.start.push(0);
        for &vertex in vertices {
            for &neighbour in self.neighbours(vertex as usize) {
                let neighbour = number[neighbour as usize];
                if neighbour != u32::MAX {
                    part.neighbours.push(neighbour);
                }
            }
            part.start.push(part.neighbours.len() as u32);
            part.weights.push(self.weights[vertex as usize]);
        }
        for &vertex in vertices {
            number[vertex as usize] = u32::MAX;
        }
        let of_part = |heights: &Vec<i32>| {
            let heights = vertices.iter().map(|&vertex| heights[vertex as usize]);
            heights.collect()
        };
        part.heights = self.heights.iter().map(of_part).collect();
        part
    }

    /// All vertices, component after component, each from its first vertex outwards, so that
    /// vertices with near numbers are near each other; and where components start.
    pub(super) fn outwards(&self) -> (Vec<u32>, Vec<usize>) {
        let mut order: Vec<u32> = Vec::with_capacity(self.n());
        let mut starts = Vec::new();
        let mut is_met = vec![false; self.n()];
        for first in 0..self.n() {
            if is_met[first] {
                continue;
            }
            let mut next = order.len();
            starts.push(next);
            is_met[first] = true;
            order.push(first as u32);
            while next < order.len() {
                for &neighbour in self.neighbours(order[next] as usize) {
                    if !std::mem::replace(&mut is_met[neighbour as usize], true) {
                        order.push(neighbour);
                    }
                }
                next += 1;
            }
        }
        starts.push(order.len());
        (order, starts)
    }
}

/// A pattern's unknowns that have the same neighbours, themselves included, as one vertex: those of
/// one node. Kept ones are never together with others.
#[derive(Debug)]
pub(super) struct Compressed {
    pub(super) graph: Graph,
    /// Unknowns of every vertex, ascending.
    unknowns: Vec<u32>,
    starts: Vec<usize>,
    pub(super) is_kept: Vec<bool>,
}

impl Compressed {
    pub(super) fn new(pattern: &Pattern, kept: &[bool], lines: Option<&[[u32; 2]]>) -> Self {
        let (vertex_of, first) = alike(pattern, kept);
        let pairs = vertex_of.iter().copied().zip(0..);
        let (starts, unknowns) = grouped(first.len(), pairs);
        let weights = starts.windows(2).map(|own| (own[1] - own[0]) as u32);
        let mut graph = Graph {
            start: vec![0],
            weights: weights.collect(),
            ..Graph::default()
        };
        let mut met_from = vec![u32::MAX; first.len()];
        for (vertex, &unknown) in (0..).zip(&first) {
            met_from[vertex as usize] = vertex;
            for &row in pattern.column(unknown as usize) {
                let neighbour = vertex_of[row as usize];
                if std::mem::replace(&mut met_from[neighbour as usize], vertex) != vertex {
                    graph.neighbours.push(neighbour);
                }
            }
            graph.start.push(graph.neighbours.len() as u32);
        }
        if let Some(lines) = lines {
            let along = |axis: usize| {
                let of_vertices = first.iter();
                of_vertices
                    .map(|&unknown| lines[unknown as usize][axis] as i32)
                    .collect()
            };
            graph.heights = vec![along(0), along(1)];
        }
        Self {
            is_kept: first
                .iter()
                .map(|&unknown| kept[unknown as usize])
                .collect(),
            graph,
            unknowns,
            starts,
        }
    }

    /// Unknowns of a vertex.
    pub(super) fn unknowns(&self, vertex: usize) -> &[u32] {
        &self.unknowns[self.starts[vertex]..self.starts[vertex + 1]]
    }

    /// Vertices sorted by the position of their first unknown in an order of unknowns.
    pub(super) fn vertices_by(&self, order: &[u32]) -> Vec<u32> {
        let mut place = vec![u32::MAX; self.unknowns.len()];
        for (at, &unknown) in (0..).zip(order) {
            place[unknown as usize] = at;
        }
        let first = |vertex: usize| {
            let places = self
                .unknowns(vertex)
                .iter()
                .map(|&unknown| place[unknown as usize]);
            places.min().unwrap_or(u32::MAX)
        };
        let mut vertices: Vec<(u32, u32)> = (0..self.graph.n())
            .filter(|&vertex| !self.is_kept[vertex])
            .map(|vertex| (first(vertex), vertex as u32))
            .collect();
        vertices.sort_unstable();
        vertices.into_iter().map(|(_, vertex)| vertex).collect()
    }
}

/// The vertex of every unknown, and the first unknown of every vertex: unknowns with the same neighbours are one,
/// unless one of them is kept.
fn alike(pattern: &Pattern, kept: &[bool]) -> (Vec<u32>, Vec<u32>) {
    let n = pattern.n();
    let mut hashes = Vec::with_capacity(n);
    for unknown in 0..n {
        let rows = pattern.column(unknown);
        let sum = rows
            .iter()
            .fold(0_u64, |sum, &row| sum.wrapping_add(mix(row)));
        hashes.push(sum.wrapping_add(u64::from(kept[unknown])));
    }
    let (mut vertex_of, mut first) = (vec![0_u32; n], Vec::new());
    for unknown in 0..n {
        let rows = pattern.column(unknown);
        // Unknowns with the same neighbours are neighbours.
        let before = rows.iter().take_while(|&&row| (row as usize) < unknown);
        let same = before.copied().find(|&row| {
            let row = row as usize;
            hashes[row] == hashes[unknown]
                && kept[row] == kept[unknown]
                && pattern.column(row) == rows
        });
        vertex_of[unknown] = if let Some(row) = same {
            vertex_of[row as usize]
        } else {
            first.push(unknown as u32);
            first.len() as u32 - 1
        };
    }
    (vertex_of, first)
}

/// Spreads a number over 64 bits (the finaliser of SplitMix64), so that sums tell sets apart.
fn mix(number: u32) -> u64 {
    let x = (u64::from(number) + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}
