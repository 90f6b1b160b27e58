//! Nested dissection of a mesh by its own lines: an order of elimination with little fill.
//!
//! A set of unknowns is cut along the mesh line that halves it across its longer side. The unknowns on the line are
//! eliminated after those on both sides, which are not coupled (George 1973). The cuts affect speed only: any order
//! gives a correct factorisation.

use std::cmp::Ordering;

/// Sets that extend over no more mesh lines than this each way are not cut.
const SMALLEST: u32 = 4;
/// Unknowns from which on both sides of a cut are worth a thread each.
const WORTH_SHARING: usize = 10_000;

/// Numbers of the mesh lines through every position, by coordinate: equal coordinates have equal
/// numbers. Corners of 8-node elements have even numbers, their mid-side nodes odd ones.
pub fn mesh_lines(positions: &[[f64; 2]]) -> Vec<[u32; 2]> {
    let mut lines = vec![[0; 2]; positions.len()];
    for axis in 0..2 {
        let mut order: Vec<usize> = (0..positions.len()).collect();
        order.sort_unstable_by(|&a, &b| positions[a][axis].total_cmp(&positions[b][axis]));
        let mut line = 0;
        for pair in 0..order.len() {
            if pair > 0 {
                let step = positions[order[pair]][axis] - positions[order[pair - 1]][axis];
                line += u32::from(step > 0.0);
            }
            lines[order[pair]][axis] = line;
        }
    }
    lines
}

/// Whether the lines are those of a grid, most crossings of which are nodes: of 8-node quads three
/// quarters are. Scattered nodes have separate lines, which separate nothing.
pub(super) fn are_a_grid(lines: &[[u32; 2]]) -> bool {
    let number = |axis: usize| {
        let last = lines.iter().map(|line| line[axis]).max().unwrap_or(0);
        let mut is_met = vec![false; last as usize + 1];
        for line in lines {
            is_met[line[axis] as usize] = true;
        }
        is_met.into_iter().filter(|&is_met| is_met).count()
    };
    // Unknowns come in twos; half of the crossings may be empty.
    number(0).saturating_mul(number(1)) <= lines.len()
}

/// An order of elimination of unknowns that lie on these mesh lines.
pub(super) fn order(lines: &[[u32; 2]]) -> Vec<u32> {
    let all: Vec<u32> = (0..lines.len() as u32).collect();
    let mut order = Vec::with_capacity(all.len());
    dissect(lines, &all, &mut order);
    order
}

/// Appends two sets to the order, which do not touch each other.
fn dissect_both(lines: &[[u32; 2]], sets: [&[u32]; 2], order: &mut Vec<u32>) {
    if sets.iter().any(|set| set.len() < WORTH_SHARING) {
        for set in sets {
            dissect(lines, set, order);
        }
        return;
    }
    let mut of_second = Vec::with_capacity(sets[1].len());
    rayon::join(
        || dissect(lines, sets[0], order),
        || dissect(lines, sets[1], &mut of_second),
    );
    order.append(&mut of_second);
}

/// Appends a set to the order: one side, the other side, and what separates them.
fn dissect(lines: &[[u32; 2]], set: &[u32], order: &mut Vec<u32>) {
    let Some([(low, high), (low_y, high_y)]) = extents(lines, set) else {
        return;
    };
    let ((low, high), axis) = if high_y - low_y > high - low {
        ((low_y, high_y), 1)
    } else {
        ((low, high), 0)
    };
    if high - low <= SMALLEST {
        order.extend_from_slice(set);
        return;
    }
    let line = |unknown: u32| lines[unknown as usize][axis];
    let mut all: Vec<u32> = set.iter().map(|&unknown| line(unknown)).collect();
    let half = all.len() / 2;
    let (_, &mut middle, _) = all.select_nth_unstable(half);
    // An even line, so that no element reaches across it.
    let cut = (middle / 2 * 2).clamp(low + 1, high - 1);
    let part = |wanted: Ordering| -> Vec<u32> {
        let of_set = set.iter().copied();
        of_set
            .filter(|&unknown| line(unknown).cmp(&cut) == wanted)
            .collect()
    };
    let below = part(Ordering::Less);
    let separator = part(Ordering::Equal);
    let above = part(Ordering::Greater);
    // A line without unknowns separates nothing.
    if below.is_empty() || above.is_empty() {
        order.extend(below);
        order.extend(above);
    } else {
        dissect_both(lines, [&below, &above], order);
    }
    order.extend(separator);
}

/// Least and greatest line, by axis.
fn extents(lines: &[[u32; 2]], set: &[u32]) -> Option<[(u32, u32); 2]> {
    let of = |axis: usize| {
        let along = set.iter().map(|&unknown| lines[unknown as usize][axis]);
        Some((along.clone().min()?, along.max()?))
    };
    Some([of(0)?, of(1)?])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cuts_a_strip_in_its_middle() {
        let positions: Vec<[f64; 2]> = (0..33).map(|i| [f64::from(i) * 0.1, 0.0]).collect();
        let lines = mesh_lines(&positions);
        assert_eq!(lines[7], [7, 0]);
        let order = order(&lines);
        assert_eq!(order.len(), 33);
        assert_eq!(*order.last().unwrap(), 16);
        let place = |i: u32| order.iter().position(|&o| o == i).unwrap();
        // One side stands before the other.
        assert!((0..16).map(place).max().unwrap() < (17..33).map(place).min().unwrap());
    }

    #[test]
    fn orders_every_unknown_once() {
        let positions: Vec<[f64; 2]> = (0..500)
            .map(|i| [f64::from(i % 23).sqrt(), f64::from(i / 23)])
            .collect();
        let mut order = order(&mesh_lines(&positions));
        order.sort_unstable();
        assert!(order.into_iter().eq(0..500));
    }
}
