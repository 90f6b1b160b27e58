//! What is found out about a group's points and their law: how they give way, whether tangents are right, and bonds and
//! faces that a user should know of.

mod breaks;
mod broken_bonds;
mod failure_mode;
mod point_tangent;
mod split_faces;
mod tangent_check;

pub(super) use broken_bonds::Bond;
pub use broken_bonds::BrokenBond;
pub use failure_mode::FailureMode;
pub use point_tangent::Fault;
pub use split_faces::GroupSplit;
pub use tangent_check::{Deviation, Notice, Went};
