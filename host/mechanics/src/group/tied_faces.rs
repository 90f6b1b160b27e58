//! Tied faces: nodes that move as one because the interface between them is inactive.

use super::Group;
use crate::problem::Formulation;
use std::collections::HashSet;

/// Some nodes, and those on the other faces of interfaces that are not there: what acts on one of them acts on all, and
/// their forces are one. Each node once, in ascending order behind the given ones.
pub fn tied_nodes(groups: &[Group], nodes: &[usize]) -> Vec<usize> {
    let gone = groups
        .iter()
        .filter(|group| group.formulation == Formulation::ZeroThickness && !group.is_active);
    let pairs = gone.flat_map(|group| {
        let elements = 0..group.kinematics.n_elements();
        elements.flat_map(|element| {
            let (minus, plus) = group.kinematics.nodes(element).split_at(3);
            minus.iter().zip(plus)
        })
    });
    let mut pairs: Vec<(usize, usize)> = pairs.map(|(&minus, &plus)| (minus, plus)).collect();
    let mut found: HashSet<usize> = nodes.iter().copied().collect();
    let mut more = Vec::new();
    // Where interfaces meet a node has several others.
    loop {
        let before = pairs.len();
        pairs.retain(|&(a, b)| {
            let is_met = found.contains(&a) || found.contains(&b);
            if is_met {
                more.extend([a, b].into_iter().filter(|&node| found.insert(node)));
            }
            !is_met
        });
        if pairs.len() == before {
            break;
        }
    }
    more.sort_unstable();
    nodes.iter().copied().chain(more).collect()
}

impl Group {
    /// Elements with one of these nodes, ascending.
    pub fn elements_at(&self, nodes: &HashSet<usize>) -> impl Iterator<Item = usize> {
        let elements = 0..self.kinematics.n_elements();
        elements.filter(|&e| self.kinematics.nodes(e).iter().any(|n| nodes.contains(n)))
    }
}
