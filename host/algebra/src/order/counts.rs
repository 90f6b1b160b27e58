//! Cost of an order of elimination: the operations of the factorisation, from the number of
//! entries in every column of the factors (Gilbert, Ng & Peyton 1994).

use super::graph::Compressed;
use super::places;
use crate::multifrontal::work;

const NONE: u32 = u32::MAX;

/// Floating-point operations of an L U factorisation that eliminates the vertices in this order.
/// Kept ones are not eliminated; their rows count.
pub(super) fn operations(compressed: &Compressed, order: &[u32]) -> f64 {
    let graph = &compressed.graph;
    let n = graph.n();
    let kept = (0..n as u32).filter(|&vertex| compressed.is_kept[vertex as usize]);
    let order: Vec<u32> = order.iter().copied().chain(kept).collect();
    let position = places(&order);
    let neighbours = |at: usize| {
        let of_vertex = graph.neighbours(order[at] as usize).iter();
        of_vertex.map(|&vertex| position[vertex as usize])
    };
    let weight = |at: usize| i64::from(graph.weights[order[at] as usize]);
    let parent = elimination_tree(n, neighbours);
    let post = postorder(&parent);
    let mut counts = own_counts(&parent, &post, neighbours, weight);
    let mut operations = 0.0;
    for &column in &post {
        let at = column as usize;
        let above = parent[at];
        if above != NONE {
            counts[above as usize] += counts[at];
        }
        if !compressed.is_kept[order[at] as usize] {
            operations += work(weight(at) as f64, (counts[at] - weight(at)) as f64);
        }
    }
    operations
}

/// Weights that a column of the factors has more than the columns below it in the tree.
fn own_counts<N: Iterator<Item = u32>>(
    parent: &[u32],
    post: &[u32],
    neighbours: impl Fn(usize) -> N,
    weight: impl Fn(usize) -> i64,
) -> Vec<i64> {
    let n = parent.len();
    // First descendants; a column without any is a leaf.
    let mut first = vec![NONE; n];
    let mut counts = vec![0_i64; n];
    for (k, &column) in (0..).zip(post) {
        if first[column as usize] == NONE {
            counts[column as usize] = weight(column as usize);
        }
        let mut up = column;
        while up != NONE && first[up as usize] == NONE {
            first[up as usize] = k;
            up = parent[up as usize];
        }
    }
    // A row has entries in the columns of a subtree of the tree: counted at its leaves, and taken
    // off again where two branches meet and above its root.
    let mut latest_first = vec![NONE; n];
    let mut latest_leaf = vec![NONE; n];
    let mut ancestor: Vec<u32> = (0..n as u32).collect();
    for &column in post {
        let above = parent[column as usize];
        if above != NONE {
            counts[above as usize] -= weight(column as usize);
        }
        for row in neighbours(column as usize).filter(|&row| row > column) {
            let row = row as usize;
            let latest = latest_first[row];
            if latest != NONE && first[column as usize] <= latest {
                continue;
            }
            latest_first[row] = first[column as usize];
            counts[column as usize] += weight(row);
            let leaf = std::mem::replace(&mut latest_leaf[row], column);
            if leaf != NONE {
                counts[meet(&mut ancestor, leaf) as usize] -= weight(row);
            }
        }
        if above != NONE {
            ancestor[column as usize] = above;
        }
    }
    counts
}

/// Where the branch of a leaf meets what came after it; its ancestors then lead there at once.
fn meet(ancestor: &mut [u32], leaf: u32) -> u32 {
    let mut meet = leaf;
    while ancestor[meet as usize] != meet {
        meet = ancestor[meet as usize];
    }
    let mut up = leaf;
    while up != meet {
        up = std::mem::replace(&mut ancestor[up as usize], meet);
    }
    meet
}

/// Parents in the elimination tree (Liu 1986).
fn elimination_tree<N: Iterator<Item = u32>>(
    n: usize,
    neighbours: impl Fn(usize) -> N,
) -> Vec<u32> {
    let mut parent = vec![NONE; n];
    let mut ancestor = vec![NONE; n];
    for row in 0..n as u32 {
        for column in neighbours(row as usize).filter(|&column| column < row) {
            let mut up = column;
            while up != row {
                let next = std::mem::replace(&mut ancestor[up as usize], row);
                if next == NONE {
                    parent[up as usize] = row;
                    break;
                }
                up = next;
            }
        }
    }
    parent
}

/// Columns with all descendants before them, branches in one piece.
fn postorder(parent: &[u32]) -> Vec<u32> {
    let n = parent.len();
    let (mut child, mut sibling) = (vec![NONE; n], vec![NONE; n]);
    for column in (0..n).rev() {
        let above = parent[column];
        if above != NONE {
            sibling[column] = std::mem::replace(&mut child[above as usize], column as u32);
        }
    }
    let mut order = Vec::with_capacity(n);
    let mut todo = Vec::new();
    for root in (0..n as u32).filter(|&column| parent[column as usize] == NONE) {
        todo.push(root);
        while let Some(&top) = todo.last() {
            let next = std::mem::replace(&mut child[top as usize], NONE);
            if next == NONE {
                order.push(top);
                todo.pop();
            } else {
                // Its siblings follow once it is done.
                child[top as usize] = sibling[next as usize];
                todo.push(next);
            }
        }
    }
    order
}
