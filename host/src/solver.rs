//! Finding equilibrium: Newton iterations within a step, and the sparse equations they solve.

mod diagnosis;
mod linear;
mod newton;

pub use linear::{LinearSolver, Singular};
pub use newton::{Costs, Iteration, Loads, Newton, StepFailure, StepSuccess};
