//! Parts of a model that do not touch: what one of them carries says nothing of another.

use super::Tie;
use crate::group::Group;
use crate::joined::Joined;

/// A node, or a degree of freedom, that several bodies have in common, or none.
pub const SHARED: u32 = u32::MAX;

/// The bodies of a model: nodes that elements, interfaces or ties connect. If both displacements of
/// a node are prescribed, nothing passes from one side of it to the other.
#[derive(Debug, Default)]
pub struct Bodies {
    /// Body of every node, or [`SHARED`].
    of_node: Vec<u32>,
    /// Body of every element, group by group; that of one without unknowns is [`SHARED`].
    of_element: Vec<Vec<u32>>,
    /// Largest side of every body.
    extents: Vec<f64>,
}

impl Bodies {
    /// Those of these groups on these nodes, where these degrees of freedom are prescribed.
    pub fn new(groups: &[Group], ties: &[Tie], nodes: &[[f64; 2]], prescribed: &[bool]) -> Self {
        let is_held = |node: usize| prescribed[2 * node] && prescribed[2 * node + 1];
        let loose = |group: &Group, element: usize| -> Vec<usize> {
            let nodes = group.kinematics.nodes(element).iter().copied();
            nodes.filter(|&node| !is_held(node)).collect()
        };
        let mut joined = Joined::new(nodes.len());
        for tie in ties {
            let masters = tie.masters.iter().map(|(master, _)| master / 2);
            joined.join([tie.dof / 2].into_iter().chain(masters));
        }
        for group in groups.iter().filter(|group| group.is_active) {
            for element in 0..group.kinematics.n_elements() {
                joined.join(loose(group, element));
            }
        }
        let mut numbers = vec![SHARED; nodes.len()];
        let mut boxes: Vec<[[f64; 2]; 2]> = Vec::new();
        let mut of_node = vec![None; nodes.len()];
        let mut of_element = Vec::new();
        for group in groups {
            let mut bodies = Vec::new();
            if !group.is_active {
                of_element.push(vec![SHARED; group.kinematics.n_elements()]);
                continue;
            }
            for element in 0..group.kinematics.n_elements() {
                let Some(&first) = loose(group, element).first() else {
                    bodies.push(SHARED);
                    continue;
                };
                let root = joined.root(first);
                if numbers[root] == SHARED {
                    numbers[root] = boxes.len() as u32;
                    boxes.push([nodes[first]; 2]);
                }
                let number = numbers[root];
                bodies.push(number);
                let [least, most] = &mut boxes[number as usize];
                for &node in group.kinematics.nodes(element) {
                    *least = [0, 1].map(|c| least[c].min(nodes[node][c]));
                    *most = [0, 1].map(|c| most[c].max(nodes[node][c]));
                    let known = of_node[node].get_or_insert(number);
                    if *known != number {
                        *known = SHARED;
                    }
                }
            }
            of_element.push(bodies);
        }
        let side = |[least, most]: &[[f64; 2]; 2]| (most[0] - least[0]).max(most[1] - least[1]);
        Self {
            of_node: of_node.iter().map(|body| body.unwrap_or(SHARED)).collect(),
            of_element,
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

    /// Body of every element, group by group.
    pub fn of_elements(&self) -> &[Vec<u32>] {
        &self.of_element
    }

    /// Body of each of these degrees of freedom; empty if there is but one.
    pub fn of(&self, dofs: impl Iterator<Item = usize>) -> Vec<u32> {
        if self.n() <= 1 {
            return Vec::new();
        }
        dofs.map(|dof| self.of_node[dof / 2]).collect()
    }
}

/// 2-norms by body of a vector whose entries belong to these bodies, or to none; the norm of the
/// whole vector if there is one body only.
pub fn norms(bodies: &[u32], n: usize, v: &[f64]) -> Vec<f64> {
    if bodies.is_empty() {
        return vec![squares(v).sqrt()];
    }
    let mut sums = vec![0.0; n];
    let mut rest = v;
    // Neighbours are mostly of one body: their sum need not go through memory.
    for run in bodies.chunk_by(|a, b| a == b) {
        let own;
        (own, rest) = rest.split_at(run.len().min(rest.len()));
        if let Some(sum) = sums.get_mut(run[0] as usize) {
            *sum += squares(own);
        }
    }
    sums.iter().map(|sum: &f64| sum.sqrt()).collect()
}

/// Σ v², in eight sums that can be worked on at once.
fn squares(v: &[f64]) -> f64 {
    let (eights, rest) = v.as_chunks::<8>();
    let mut sums = [0.0; 8];
    for eight in eights {
        for (sum, x) in sums.iter_mut().zip(eight) {
            *sum += x * x;
        }
    }
    sums.iter().sum::<f64>() + rest.iter().map(|x| x * x).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn norms_are_those_of_each_body() {
        let v = [3.0, 1e11, 4.0];
        assert_eq!(norms(&[0, 1, 0], 2, &v), [5.0, 1e11]);
        assert_eq!(norms(&[0, SHARED, 0], 2, &v), [5.0, 0.0]);
        assert_eq!(norms(&[], 1, &[3.0, 4.0]), [5.0]);
        // 1² + … + 24² = 4900 = 70², and 25 · 26 · 51 / 6 = 5525.
        let v: Vec<f64> = (1..=25).map(f64::from).collect();
        assert_eq!(norms(&[], 1, &v[..24]), [70.0]);
        assert_eq!(norms(&[1; 25], 2, &v), [0.0, f64::sqrt(5525.0)]);
    }
}
