//! Finding equilibrium: steps from one to the next, Newton iterations within a step, the sparse equations they solve,
//! and the linear part of a model that takes no part in them.

mod condensation;
mod continuation;
mod diagnosis;
mod mechanism;
mod newton;

pub use condensation::{CheckedPoints, Held, LinearDomain, Reuse, Standing};
pub use continuation::{Clock, Measure};
pub use mechanism::Mechanism;
pub use newton::{
    Costs, Criterion, Culprit, DomainFailure, Equations, Guess, Imbalance, Iteration, Iterations,
    LedBy, Loads, Matrix, Motion, Newton, Open, PointPlace, Reason, Runaway, Singularity,
    StepFailure, StepSuccess, Symptom, Unmet,
};
pub(crate) use newton::{ROUND_OFF, STILL_SMALL, norm, reference_of_round_off};
