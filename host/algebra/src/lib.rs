//! Sparse linear equations of finite elements: the pattern of a matrix, orders of elimination, and
//! a multifrontal factorisation whose solutions are checked.
//!
//! It knows matrices and right sides, neither elements nor materials. Kernels are `faer`'s.

mod dense;
mod dissection;
mod linear;
mod multifrontal;
mod pattern;

pub use dissection::mesh_lines;
pub use linear::{Block, LinearSolver, Singular};
pub use multifrontal::{Gathered, Kind, Multifrontal};
pub use pattern::Pattern;
