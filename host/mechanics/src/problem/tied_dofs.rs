//! Degrees of freedom that move alike in a phase: faces of interfaces that are not there, nodes of rigid lines.

use super::{Analysis, Problem};
use std::collections::BTreeMap;

/// A node is on the axis of symmetry within this fraction of the mesh's longer side.
const ON_AXIS: f64 = 1e-9;

/// Degrees of freedom that move alike.
#[derive(Default)]
pub(crate) struct TiedDofs {
    root: BTreeMap<usize, usize>,
    /// Those of rigid lines that do not move, since their lines reach the axis of symmetry.
    pub(crate) still: Vec<usize>,
}

impl TiedDofs {
    /// In a phase, by number.
    pub(crate) fn in_phase(problem: &Problem, number: usize) -> Self {
        let mut alike = Self::default();
        let mesh = &problem.mesh;
        let active = problem.active_after(number + 1);
        for joint in mesh.joints.iter().filter(|joint| !active[joint.group]) {
            for (&minus, &plus) in joint.minus.iter().zip(&joint.plus) {
                alike.join_nodes(minus, plus);
            }
        }
        let axis = ON_AXIS * mesh.longer_side();
        let phases = &problem.phases[..=number];
        for line in phases.iter().flat_map(|phase| &phase.rigid) {
            let nodes = mesh.lines.get(line).map(|line| &line.nodes[..]);
            let nodes = nodes.unwrap_or_default();
            let reaches_axis = problem.analysis == Analysis::Axisymmetric
                && nodes.iter().any(|&node| mesh.nodes[node][0] <= axis);
            for pair in nodes.windows(2) {
                alike.join_nodes(pair[0], pair[1]);
            }
            if reaches_axis {
                alike.still.extend(nodes.iter().map(|node| 2 * node));
            }
        }
        alike
    }

    fn find(&mut self, dof: usize) -> usize {
        let above = *self.root.entry(dof).or_insert(dof);
        if above == dof {
            return dof;
        }
        let top = self.find(above);
        self.root.insert(dof, top);
        top
    }

    fn join_nodes(&mut self, a: usize, b: usize) {
        for c in 0..2 {
            let (a, b) = (self.find(2 * a + c), self.find(2 * b + c));
            self.root.insert(a.max(b), a.min(b));
        }
    }

    /// Those of more than one, members ascending.
    pub(crate) fn classes(mut self) -> Vec<Vec<usize>> {
        let dofs: Vec<usize> = self.root.keys().copied().collect();
        let mut classes: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for dof in dofs {
            classes.entry(self.find(dof)).or_default().push(dof);
        }
        classes
            .into_values()
            .filter(|members| members.len() > 1)
            .collect()
    }
}
