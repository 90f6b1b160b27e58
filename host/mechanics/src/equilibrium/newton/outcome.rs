//! Input and outcome of a step, apart from [failures](super::failure).

use super::residual::Balance;
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// Where the iterations of a step start.
#[derive(Clone, Debug)]
pub struct Guess {
    /// Displacement increments, by place.
    pub increment: Vec<f64>,
    /// Fraction of the residual that the first correction will probably leave, as it did in the
    /// last step; `None` if nothing is known.
    pub contraction: Option<f64>,
    /// The last step was a motion of many viscous steps: this one begins with one.
    pub was_motion: bool,
}

/// One iteration, for the log.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Iteration {
    /// Relative residual after it.
    pub residual: f64,
    /// Relative correction; null before the first one.
    pub correction: Option<f64>,
    /// Fraction of the correction that was taken.
    pub step_length: f64,
    /// Share of the elastic stiffness added to the tangent; 0 in a Newton iteration.
    pub viscosity: f64,
}

impl Iteration {
    /// The state before the first correction.
    pub(super) fn first(balance: &Balance) -> Self {
        Self {
            residual: balance.relative,
            correction: None,
            step_length: 1.0,
            viscosity: 0.0,
        }
    }

    /// The state after this fraction of a correction of this relative size.
    pub(super) fn of(balance: &Balance, correction: f64, step_length: f64) -> Self {
        Self {
            residual: balance.relative,
            correction: Some(correction),
            step_length,
            viscosity: 0.0,
        }
    }
}

/// What led a step to equilibrium.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LedBy {
    /// Newton iterations alone.
    Newton,
    /// Regularised corrections, where these got on slowly.
    Regularised,
    /// A viscous motion, where they had come to a standstill.
    Viscous,
}

/// A step that reached equilibrium. The groups' trial state is that of equilibrium.
#[derive(Clone, Debug)]
pub struct StepSuccess {
    /// Displacement increments, by place.
    pub increment: Vec<f64>,
    /// What happened.
    pub iterations: Vec<Iteration>,
    /// Points whose laws call their result inaccurate.
    pub unreliable: Option<String>,
    /// What led to this state.
    pub led_by: LedBy,
    /// Corrections with the matrix of an earlier step led to it.
    pub was_kept: bool,
    /// It took many viscous steps.
    pub was_motion: bool,
    /// Relative residual that had to be taken for round-off, above the tolerance; else 0.
    pub round_off: f64,
    /// Relative residual that is tolerated above the tolerance, where iterations had come to a standstill;
    /// else 0.
    pub tolerated: f64,
    /// What the residual was measured against, by body.
    pub scales: Vec<f64>,
    /// Open corrections and forces if the residual alone decides.
    pub open: Option<Open>,
}

/// What a state leaves open that the residual alone made an equilibrium.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Open {
    /// Relative residual.
    pub residual: f64,
    /// The same as a force: 2-norm over the nodes of a body, in the units of the case.
    pub force: f64,
    /// Last correction, relative to the increment.
    pub correction: f64,
    /// Nodes whose force out of balance is above the force tolerance times the root mean square of the
    /// nodal forces in play.
    pub nodes: usize,
}

impl Open {
    /// The larger of each.
    #[must_use]
    pub fn and(self, other: &Self) -> Self {
        Self {
            residual: self.residual.max(other.residual),
            force: self.force.max(other.force),
            correction: self.correction.max(other.correction),
            nodes: self.nodes.max(other.nodes),
        }
    }
}

/// Seconds by part, and counts.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct Costs {
    /// Laws, with the strains before and the forces after them.
    pub laws: Duration,
    /// Assembly of matrices.
    pub assembly: Duration,
    /// Factorisation and solution.
    pub equations: Duration,
    /// Evaluations of all groups.
    pub evaluations: u64,
    /// Matrices factorised.
    pub factorisations: u64,
}
