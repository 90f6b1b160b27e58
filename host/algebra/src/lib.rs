//! Sparse linear equations of finite elements: the pattern of a matrix, orders of elimination, and
//! a multifrontal factorisation whose solutions are checked.
//!
//! It knows matrices and right sides, neither elements nor materials. Kernels are `faer`'s.

#[cfg(test)]
extern crate self as algebra;
#[cfg(test)]
#[path = "../tests/meshes/mod.rs"]
#[expect(dead_code, reason = "tests of the whole crate use the rest")]
mod meshes;

mod dense;
mod linear;
mod multifrontal;
mod order;
mod pattern;
mod product;
pub mod threads;

pub use dense::{Factors, largest};
pub use linear::{Block, Dense, LastMatrix, LinearSolver, Singular};
pub use multifrontal::{Gathered, Kind, Multifrontal};
pub use order::mesh_lines;
pub use pattern::Pattern;
pub use product::add_product;
