//! Parts of a model that do not touch: what one of them carries says nothing of another.

use super::Tie;
use crate::group::Group;

/// The bodies of a model: nodes that elements, interfaces or ties connect.
#[derive(Debug, Default)]
pub struct Bodies {
    /// Body of every node.
    of_node: Vec<u32>,
    /// Largest side of every body.
    extents: Vec<f64>,
}

impl Bodies {
    /// Those of these groups on these nodes.
    pub fn new(groups: &[Group], ties: &[Tie], nodes: &[[f64; 2]]) -> Self {
        let mut joined = Joined::new(nodes.len());
        for group in groups {
            for element in 0..group.kinematics.n_elements() {
                if let [first, others @ ..] = group.kinematics.nodes(element) {
                    others.iter().for_each(|&node| joined.join(*first, node));
                }
            }
        }
        for tie in ties {
            for (master, _) in tie.masters {
                joined.join(tie.dof / 2, master / 2);
            }
        }
        let mut in_use = vec![false; nodes.len()];
        for group in groups {
            for element in 0..group.kinematics.n_elements() {
                for &node in group.kinematics.nodes(element) {
                    in_use[node] = true;
                }
            }
        }
        // Nodes of no element belong to the first body.
        let mut numbers = vec![None; nodes.len()];
        let mut of_node = vec![0; nodes.len()];
        let mut boxes: Vec<[[f64; 2]; 2]> = Vec::new();
        for node in (0..nodes.len()).filter(|&node| in_use[node]) {
            let root = joined.root(node);
            let number = *numbers[root].get_or_insert_with(|| {
                boxes.push([nodes[node]; 2]);
                boxes.len() - 1
            });
            let [least, most] = &mut boxes[number];
            for c in 0..2 {
                least[c] = least[c].min(nodes[node][c]);
                most[c] = most[c].max(nodes[node][c]);
            }
            of_node[node] = number as u32;
        }
        let side = |[least, most]: &[[f64; 2]; 2]| (most[0] - least[0]).max(most[1] - least[1]);
        Self {
            of_node,
            extents: boxes.iter().map(side).collect(),
        }
    }

    /// How many there are.
    pub fn n(&self) -> usize {
        self.extents.len()
    }

    /// Largest side of every body.
    pub fn extents(&self) -> &[f64] {
        &self.extents
    }

    /// Body of each of these degrees of freedom; empty if there is but one.
    pub fn of(&self, dofs: impl Iterator<Item = usize>) -> Vec<u32> {
        if self.n() <= 1 {
            return Vec::new();
        }
        dofs.map(|dof| self.of_node[dof / 2]).collect()
    }
}

/// Sets that grow together.
struct Joined(Vec<usize>);

impl Joined {
    fn new(n: usize) -> Self {
        Self((0..n).collect())
    }

    fn root(&mut self, mut node: usize) -> usize {
        while self.0[node] != node {
            self.0[node] = self.0[self.0[node]];
            node = self.0[node];
        }
        node
    }

    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b)] = a.min(b);
    }
}

/// 2-norms by body of a vector whose entries belong to these bodies; of all of it where no bodies
/// are told apart.
pub fn norms(bodies: &[u32], n: usize, v: &[f64]) -> Vec<f64> {
    if bodies.is_empty() {
        return vec![v.iter().map(|x| x * x).sum::<f64>().sqrt()];
    }
    let mut sums = vec![0.0; n];
    for (&body, x) in bodies.iter().zip(v) {
        sums[body as usize] += x * x;
    }
    sums.iter().map(|sum: &f64| sum.sqrt()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn norms_are_those_of_each_body() {
        let v = [3.0, 1e11, 4.0];
        assert_eq!(norms(&[0, 1, 0], 2, &v), [5.0, 1e11]);
        assert_eq!(norms(&[], 1, &[3.0, 4.0]), [5.0]);
    }

    #[test]
    fn what_is_joined_by_way_of_others_is_one() {
        let mut joined = Joined::new(5);
        joined.join(0, 3);
        joined.join(4, 3);
        let roots: Vec<usize> = (0..5).map(|node| joined.root(node)).collect();
        assert_eq!(roots, [0, 1, 2, 0, 0]);
    }
}
