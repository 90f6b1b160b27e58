//! Finding equilibrium: Newton iterations within a step, the sparse equations they solve, and the
//! linear part of a model that takes no part in them.

mod dense;
mod diagnosis;
mod dissection;
mod linear;
mod linear_domain;
mod multifrontal;
mod newton;

pub use dissection::mesh_lines;
pub use linear::{Block, LinearSolver, Singular};
pub use linear_domain::{LinearDomain, LookedAt, Reuse, Standing};
pub use newton::{
    Costs, Criterion, Guess, Iteration, Loads, Matrix, Measure, Newton, Runaway, StepFailure,
    StepSuccess, Unmet,
};
