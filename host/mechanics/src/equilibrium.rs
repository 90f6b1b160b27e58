//! Finding equilibrium: Newton iterations within a step, the sparse equations they solve, and the
//! linear part of a model that takes no part in them.

mod condensation;
mod diagnosis;
mod mechanism;
mod newton;

pub use condensation::{CheckedPoints, Held, LinearDomain, Reuse, Standing};
pub use mechanism::Mechanism;
pub use newton::{
    Clock, Costs, Criterion, Culprit, DomainFailure, Guess, Imbalance, Iteration, Iterations,
    Loads, Matrix, Measure, Motion, Newton, Open, PointPlace, Reason, Runaway, Singularity,
    StepFailure, StepSuccess, Symptom, Unmet,
};
pub(crate) use newton::{ROUND_OFF, STILL_SMALL, norm};
