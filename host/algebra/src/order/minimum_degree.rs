//! Minimum degree for small parts of a graph, which sees what lies around them.

use super::graph::Graph;

/// Appends some vertices to an order, at each step one with the least weight of uneliminated
/// neighbours. Vertices around the part count as neighbours that are eliminated later.
///
/// Neighbourhoods are sets of bits, so the part has to be small. `number` has `u32::MAX`
/// everywhere, and is left like that.
pub(super) fn order(graph: &Graph, part: &[u32], number: &mut [u32], order: &mut [u32]) {
    let n = part.len();
    let all = with_neighbours(graph, part, number);
    let words = all.len().div_ceil(64);
    let mut near = vec![0_u64; n * words];
    for (row, &vertex) in near.chunks_exact_mut(words.max(1)).zip(part) {
        for &neighbour in graph.neighbours(vertex as usize) {
            let new = number[neighbour as usize] as usize;
            row[new / 64] |= 1 << (new % 64);
        }
    }
    let weights: Vec<u32> = all
        .iter()
        .map(|&vertex| graph.weights[vertex as usize])
        .collect();
    for &vertex in &all {
        number[vertex as usize] = u32::MAX;
    }
    let degree = |row: &[u64]| members(row).map(|member| weights[member]).sum::<u32>();
    let mut degrees: Vec<u32> = near.chunks_exact(words.max(1)).map(degree).collect();
    let mut pivot_row = vec![0_u64; words];
    for place in order.iter_mut() {
        let Some(pivot) = (0..n).min_by_key(|&vertex| degrees[vertex]) else {
            return;
        };
        *place = part[pivot];
        degrees[pivot] = u32::MAX;
        pivot_row.copy_from_slice(&near[pivot * words..(pivot + 1) * words]);
        // Its neighbours become neighbours of each other.
        for vertex in members(&pivot_row).filter(|&vertex| vertex < n) {
            let row = &mut near[vertex * words..(vertex + 1) * words];
            for (own, new) in row.iter_mut().zip(&pivot_row) {
                *own |= new;
            }
            for gone in [vertex, pivot] {
                row[gone / 64] &= !(1 << (gone % 64));
            }
            degrees[vertex] = degree(row);
        }
    }
}

/// The vertices of a part, and then those around it, numbered in this order.
fn with_neighbours(graph: &Graph, part: &[u32], number: &mut [u32]) -> Vec<u32> {
    let mut all = part.to_vec();
    for (new, &vertex) in (0..).zip(part) {
        number[vertex as usize] = new;
    }
    for &vertex in part {
        for &neighbour in graph.neighbours(vertex as usize) {
            let new = &mut number[neighbour as usize];
            if *new == u32::MAX {
                *new = all.len() as u32;
                all.push(neighbour);
            }
        }
    }
    all
}

/// Numbers of the bits that are set.
fn members(row: &[u64]) -> impl Iterator<Item = usize> {
    (0..).zip(row).flat_map(|(word, &bits)| {
        let mut left = bits;
        std::iter::from_fn(move || {
            (left != 0).then(|| {
                let bit = left.trailing_zeros() as usize;
                left &= left - 1;
                64 * word + bit
            })
        })
    })
}
