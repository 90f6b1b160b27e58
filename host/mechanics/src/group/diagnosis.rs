//! Diagnosis of a group: failure modes of its points, wrong tangents of its law, broken bonds and open faces.

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
