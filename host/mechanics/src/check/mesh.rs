//! Checks of a mesh: references, shapes, zero-thickness elements.

use super::{Cause, Item, JointFault, Refusal};
use crate::element::Axes;
use crate::ground::beside_joints;
use crate::mesh::{Joint, Solid};
use crate::problem::{Analysis, Formulation, Problem};

/// The two faces of a zero-thickness element are at the same places within this part of its length.
const APART: f64 = 1e-6;
/// A node lies beyond the axis if its radius is less than this fraction of the mesh's longer side below 0.
const BEYOND_AXIS: f64 = 1e-9;

/// Refuses what refers to nothing, elements of another formulation, and elements beyond the axis.
pub(super) fn check(problem: &Problem) -> Result<(), Refusal> {
    let mesh = &problem.mesh;
    let (n, n_groups) = (mesh.nodes.len(), problem.groups.len());
    let refuse = |cause| Err(Refusal::new(Item::Problem, cause));
    let of_elements = mesh.solids.iter().map(|solid| solid.group);
    let of_joints = mesh.joints.iter().map(|joint| joint.group);
    if let Some(group) = of_elements
        .chain(of_joints)
        .find(|&group| group >= n_groups)
    {
        return refuse(Cause::NoGroup(group));
    }
    let solid_nodes = mesh
        .solids
        .iter()
        .flat_map(|solid| solid.nodes().iter().copied());
    let joint_nodes = mesh
        .joints
        .iter()
        .flat_map(|joint| joint.minus.into_iter().chain(joint.plus));
    if solid_nodes.chain(joint_nodes).any(|node| node >= n) {
        return refuse(Cause::OutOfRange("an element"));
    }
    for line in mesh.lines.values() {
        let has_edge = |&(solid, edge): &(usize, usize)| {
            mesh.solids
                .get(solid)
                .is_some_and(|solid| edge < solid.n_corners())
        };
        if !line.edges.iter().all(has_edge) || line.nodes.iter().any(|&node| node >= n) {
            return refuse(Cause::OutOfRange("a line"));
        }
    }
    if mesh.nodes.iter().flatten().any(|at| !at.is_finite()) {
        return refuse(Cause::NotFinite("a coordinate"));
    }
    check_elements(problem)
}

/// Refuses elements of another formulation than their group's, and elements beyond the axis.
fn check_elements(problem: &Problem) -> Result<(), Refusal> {
    let mesh = &problem.mesh;
    let is_joint = |group: usize| problem.groups[group].formulation == Formulation::ZeroThickness;
    let solids = mesh.solids.iter().map(|solid| (solid.group, false));
    let joints = mesh.joints.iter().map(|joint| (joint.group, true));
    if let Some((group, _)) = solids
        .chain(joints)
        .find(|&(group, joint)| is_joint(group) != joint)
    {
        let own = &problem.groups[group];
        let cause = Cause::OtherElements(own.name.clone(), own.formulation);
        return Err(Refusal::new(Item::Group(group), cause));
    }
    if problem.analysis == Analysis::Axisymmetric {
        let least = -BEYOND_AXIS * mesh.longer_side();
        let beyond = |solid: &&Solid| {
            solid
                .nodes()
                .iter()
                .any(|&node| mesh.nodes[node][0] < least)
        };
        if let Some(solid) = mesh.solids.iter().find(beyond) {
            let cause = Cause::BadShape(problem.groups[solid.group].name.clone());
            return Err(Refusal::new(Item::Group(solid.group), cause));
        }
    }
    Ok(())
}

/// A face of a zero-thickness element: its group, the adjacent solid, its middle.
pub(super) struct Face {
    pub(super) interface: usize,
    pub(super) solid: usize,
    pub(super) middle: usize,
}

/// A fault in the shape of a zero-thickness element.
fn joint_fault(problem: &Problem, joint: &Joint) -> Option<JointFault> {
    let place = |node: usize| problem.mesh.nodes[node];
    let apart = |a: usize, b: usize| {
        let ([x_a, y_a], [x_b, y_b]) = (place(a), place(b));
        (x_b - x_a).hypot(y_b - y_a)
    };
    let length = apart(joint.minus[0], joint.minus[1]);
    if length <= 0.0 {
        return Some(JointFault::NoLength);
    }
    let mut pairs = joint.minus.into_iter().zip(joint.plus);
    if pairs.any(|(minus, plus)| apart(minus, plus) > APART * length) {
        return Some(JointFault::Apart);
    }
    let mut radii = joint.minus.into_iter().map(|node| place(node)[0]);
    let on_axis = radii.all(|r| r <= BEYOND_AXIS * length);
    (problem.analysis == Analysis::Axisymmetric && on_axis).then_some(JointFault::OnAxis)
}

/// Refuses invalid zero-thickness elements. Returns the faces with an adjacent solid.
pub(super) fn joints(problem: &Problem) -> Result<Vec<Face>, Refusal> {
    let mesh = &problem.mesh;
    let beside = beside_joints(mesh);
    let mut faces = Vec::new();
    for joint in &mesh.joints {
        let place = |node: usize| mesh.nodes[node];
        let [a, b, middle] = joint.minus;
        let refuse = |fault| {
            let group = problem.groups[joint.group].name.clone();
            let at = place(middle);
            let cause = Cause::BadJoint { group, at, fault };
            Err(Refusal::new(Item::Group(joint.group), cause))
        };
        if let Some(fault) = joint_fault(problem, joint) {
            return refuse(fault);
        }
        let chord = [0, 1].map(|c| place(b)[c] - place(a)[c]);
        let across = Axes::of_facet(chord).across;
        // Close to 45° the last bit of the coordinates says which side is that of the greater ones.
        let is_told = (chord[0].abs() - chord[1].abs()).abs() > APART * chord[0].hypot(chord[1]);
        for (middle, side) in [(joint.minus[2], -1.0), (joint.plus[2], 1.0)] {
            let Some(&solid) = beside.get(&middle) else {
                continue;
            };
            // Edges run counter-clockwise: (−dy, dx) points into the solid.
            let edge = mesh.solids[solid].edges().find(|edge| edge[2] == middle);
            let inward = edge.map(|[a, b, _]| {
                let ([x_a, y_a], [x_b, y_b]) = (place(a), place(b));
                [y_a - y_b, x_b - x_a]
            });
            let towards = inward.map_or(0.0, |[x, y]| x * across[0] + y * across[1]);
            if is_told && side * towards < 0.0 {
                return refuse(JointFault::Turned);
            }
            faces.push(Face {
                interface: joint.group,
                solid: mesh.solids[solid].group,
                middle,
            });
        }
    }
    Ok(faces)
}
