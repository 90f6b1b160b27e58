//! Restraint: the parts of a mesh that move as one, and whether supports hold them.

use crate::joined::Joined;
use crate::mesh::Mesh;
use std::collections::HashSet;

/// Least part of a row that must stand across the others for it to hold something else too.
const INDEPENDENT: f64 = 1e-8;

/// Nodes that elements join, interfaces included.
#[derive(Debug)]
pub(super) struct Part {
    pub(super) nodes: Vec<usize>,
    /// Groups of its elements, each once, in the order of the file.
    pub(super) groups: Vec<usize>,
    /// The middle of its nodes.
    pub(super) centre: [f64; 2],
}

/// A motion without strain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Motion {
    X,
    Y,
    Rotation,
}

/// The parts of a mesh, in the order of their first nodes, of groups that are active. Faces of interfaces
/// that are not are one.
pub(super) fn parts(mesh: &Mesh, is_active: &dyn Fn(usize) -> bool) -> Vec<Part> {
    let mut joined = Joined::new(mesh.nodes.len());
    let mut is_used = vec![false; mesh.nodes.len()];
    for solid in mesh.solids.iter().filter(|solid| is_active(solid.group)) {
        joined.join(solid.nodes().iter().copied());
        solid.nodes().iter().for_each(|&node| is_used[node] = true);
    }
    for joint in &mesh.joints {
        joined.join(joint.minus.into_iter().chain(joint.plus));
    }
    let mut number = vec![usize::MAX; mesh.nodes.len()];
    let mut parts: Vec<Part> = Vec::new();
    for node in (0..mesh.nodes.len()).filter(|&node| is_used[node]) {
        let top = joined.root(node);
        if number[top] == usize::MAX {
            number[top] = parts.len();
            parts.push(Part {
                nodes: Vec::new(),
                groups: Vec::new(),
                centre: [0.0; 2],
            });
        }
        parts[number[top]].nodes.push(node);
    }
    let mut seen = HashSet::new();
    let (solids, joints) = (mesh.solids.iter(), mesh.joints.iter());
    let solids = solids.map(|solid| (solid.nodes()[0], solid.group));
    let joints = joints.map(|joint| (joint.minus[0], joint.group));
    let joints = joints.filter(|&(node, _)| is_used[node]);
    for (node, group) in solids.chain(joints).filter(|(_, group)| is_active(*group)) {
        let part = number[joined.root(node)];
        if seen.insert((part, group)) {
            parts[part].groups.push(group);
        }
    }
    for part in &mut parts {
        let n = part.nodes.len() as f64;
        part.groups.sort_unstable();
        part.centre = [0, 1].map(|c| {
            let nodes = part.nodes.iter();
            nodes.map(|&node| mesh.nodes[node][c]).sum::<f64>() / n
        });
    }
    parts
}

/// The first motion of a part as a rigid body that nothing resists, in the plane or about an axis
/// (where only the one along it is without strain).
pub(super) fn loose(
    mesh: &Mesh,
    part: &Part,
    axisymmetric: bool,
    is_held: impl Fn(usize) -> bool,
) -> Option<Motion> {
    let held = |component: usize| part.nodes.iter().any(|node| is_held(2 * node + component));
    if axisymmetric {
        return (!held(1)).then_some(Motion::Y);
    }
    let size = part.nodes.iter().map(|&node| {
        let [x, y] = mesh.nodes[node];
        (x - part.centre[0]).hypot(y - part.centre[1])
    });
    let size = size.fold(0.0, f64::max);
    // What holds spans the motions (x, y, rotation about the centre); orthogonal so far.
    let mut basis: Vec<[f64; 3]> = Vec::new();
    for &node in &part.nodes {
        let [x, y] = mesh.nodes[node];
        let arm = [(x - part.centre[0]) / size, (y - part.centre[1]) / size];
        for (component, mut row) in [[1.0, 0.0, -arm[1]], [0.0, 1.0, arm[0]]]
            .into_iter()
            .enumerate()
        {
            if basis.len() == 3 || !is_held(2 * node + component) {
                continue;
            }
            for known in &basis {
                let along: f64 = row.iter().zip(known).map(|(a, b)| a * b).sum();
                (0..3).for_each(|i| row[i] -= along * known[i]);
            }
            let length = row.iter().map(|a| a * a).sum::<f64>().sqrt();
            if length > INDEPENDENT {
                basis.push(row.map(|a| a / length));
            }
        }
    }
    match basis.len() {
        3 => None,
        _ if !held(0) => Some(Motion::X),
        _ if !held(1) => Some(Motion::Y),
        _ => Some(Motion::Rotation),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Solid;

    /// Two unit squares of groups 0 and 1, apart.
    fn apart() -> Mesh {
        let mut mesh = Mesh::default();
        for (group, x) in [(0, 0.0), (1, 5.0)] {
            let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
            let middles = [[0.5, 0.0], [1.0, 0.5], [0.5, 1.0], [0.0, 0.5]];
            let first = mesh.nodes.len();
            let all = corners.into_iter().chain(middles);
            mesh.nodes.extend(all.map(|at| [at[0] + x, at[1]]));
            let nodes = std::array::from_fn(|i| first + i);
            mesh.solids.push(Solid::quad(nodes, group));
        }
        mesh
    }

    #[test]
    fn bodies_that_touch_nothing_are_parts_of_their_own() {
        let mesh = apart();
        let parts = parts(&mesh, &|_| true);
        let groups: Vec<_> = parts.iter().map(|part| part.groups.clone()).collect();
        assert_eq!(groups, [[0], [1]]);
        let [x, y] = parts[1].centre;
        assert!(f64::hypot(x - 5.5, y - 0.5) < 1e-12, "{x} {y}");
    }

    #[test]
    fn three_motions_are_to_be_held() {
        let mesh = apart();
        let parts = parts(&mesh, &|_| true);
        // Degrees of freedom of nodes 0 and 1, at (0, 0) and (1, 0).
        let motion = |held: &[usize]| loose(&mesh, &parts[0], false, |dof| held.contains(&dof));
        assert_eq!(motion(&[]), Some(Motion::X));
        assert_eq!(motion(&[0]), Some(Motion::Y));
        assert_eq!(motion(&[1, 3]), Some(Motion::X));
        assert_eq!(motion(&[0, 1]), Some(Motion::Rotation));
        // Two supports in line do not keep a body from turning about where their lines meet.
        assert_eq!(motion(&[0, 2, 1]), Some(Motion::Rotation));
        assert_eq!(motion(&[0, 1, 3]), None);
        let far = |dof: usize| dof < 16;
        assert_eq!(loose(&mesh, &parts[1], false, far), Some(Motion::X));
    }

    #[test]
    fn about_an_axis_only_the_way_along_it_is_to_be_held() {
        let mesh = apart();
        let parts = parts(&mesh, &|_| true);
        let motion = |held: usize| loose(&mesh, &parts[0], true, |dof| dof == held);
        assert_eq!(motion(0), Some(Motion::Y));
        assert_eq!(motion(1), None);
    }
}
