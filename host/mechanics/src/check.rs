//! Checks of a problem before its first increment: what is refused, with the part that does not fit, and what can be
//! computed but is seldom meant.
//!
//! They stand above the model: they may look at elements, groups and ground.

mod compatibility;
pub(crate) mod constraints;
mod groups;
mod ineffective_loads;
mod loads_on_interfaces;
mod mesh;
mod peaks;
mod phases;
pub(crate) mod plausibility;
mod refusal;
mod restraint;
pub(crate) mod sign_check;
mod uncovered_loads;

pub use compatibility::{Compatibility, Incompatibility};
pub use phases::LONGEST;
pub use refusal::{Cause, Item, JointFault, Key, Refusal};

use crate::mesh::{Mesh, Solid};
use crate::problem::Problem;
use std::collections::HashMap;

/// Refuses dangling references, invalid numbers, and changes of inactive parts. Laws are not looked at.
///
/// # Errors
/// The first part that does not fit.
pub(crate) fn problem(problem: &Problem) -> Result<(), Refusal> {
    if let Some((name, value, bounds)) = problem.settings.outside() {
        let cause = Cause::Setting(name, value, bounds);
        return Err(Refusal::new(Item::Problem, cause));
    }
    mesh::check(problem)?;
    groups::refuse_same_names(problem)?;
    let faces = mesh::joints(problem)?;
    groups::check(problem)?;
    phases::check(problem, &faces)?;
    loads_on_interfaces::check(problem)
}

/// For every middle node of an edge, the number of active elements with it.
fn edges_there(mesh: &Mesh, active: &[bool]) -> HashMap<usize, usize> {
    let mut there = HashMap::new();
    let solids = mesh.solids.iter().filter(|solid| active[solid.group]);
    for edge in solids.flat_map(Solid::edges) {
        *there.entry(edge[2]).or_default() += 1;
    }
    there
}

/// For the node in the middle of each face of an interface, that of the opposite face, and the interface's group.
fn opposite_faces(mesh: &Mesh) -> HashMap<usize, (usize, usize)> {
    let faces = mesh.joints.iter().flat_map(|joint| {
        let (minus, plus) = (joint.minus[2], joint.plus[2]);
        [(minus, (plus, joint.group)), (plus, (minus, joint.group))]
    });
    faces.collect()
}
