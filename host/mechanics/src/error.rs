//! Errors of a simulation, as data, with their messages.

use crate::check::Refusal;
use crate::equilibrium::StepFailure;
use crate::group::PointFailure;
use crate::model::BuildError;
use crate::problem::Axis;
use crate::settings::Control;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Where in a simulation something happened.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Place {
    /// Phase.
    pub phase: String,
    /// Increment within the phase, from 1.
    pub increment: usize,
}

/// Why a simulation does not go on.
#[derive(Clone, Debug)]
pub enum Error {
    /// A part of the problem does not fit.
    Refused(Box<Refusal>),
    /// A law cannot start from the stress it finds.
    CannotStart(Box<PointFailure>),
    /// The equations of a phase are singular from the start.
    Singular {
        /// The phase.
        phase: String,
    },
    /// No equilibrium was found.
    NoEquilibrium(Box<NoEquilibrium>),
    /// A law failed in a way that no smaller step helps.
    Law {
        /// Where.
        place: Place,
        /// At which point, and why.
        failure: Box<PointFailure>,
        /// It was tried again with steps as small as they may be.
        however_small: bool,
    },
    /// What a law did to the process could not be set right.
    Process {
        /// Where.
        place: Place,
        /// What it did.
        why: String,
    },
    /// Stopped as asked, after a whole increment.
    Interrupted {
        /// The last increment.
        place: Place,
    },
    /// Stopped as asked, within an increment.
    Stopped {
        /// The increment.
        place: Place,
    },
    /// Whoever watches wanted no more.
    Halted,
    /// A state is not one of this problem.
    OtherState(String),
}

/// No equilibrium beyond a state.
#[derive(Clone, Debug)]
pub struct NoEquilibrium {
    /// The increment that could not be finished.
    pub place: Place,
    /// How far the phase came, in increments.
    pub reached: f64,
    /// Increments of the phase.
    pub of: usize,
    /// What the settings let lead its steps.
    pub control: Control,
    /// Under `auto` viscous control led, by short steps, and led no further.
    pub viscous: bool,
    /// The settings allow viscous relaxation or viscous control if iterations stall.
    pub may_move: bool,
    /// The last attempt: reason, both criteria with residuals, the point that failed.
    pub failure: StepFailure,
    /// The displacement that ran away, if one did.
    pub runaway: Option<RunawayAt>,
}

/// A displacement far beyond anything that a step could call forth.
#[derive(Clone, Debug, PartialEq)]
pub struct RunawayAt {
    /// Its direction.
    pub axis: Axis,
    /// Its increment in the step, m.
    pub increment: f64,
    /// Coordinates of the node.
    pub node: [f64; 2],
    /// Groups at the node.
    pub groups: Vec<String>,
}

impl From<Refusal> for Error {
    fn from(refusal: Refusal) -> Self {
        Self::Refused(Box::new(refusal))
    }
}

impl From<BuildError> for Error {
    fn from(error: BuildError) -> Self {
        match error {
            BuildError::Refused(refusal) => Self::Refused(refusal),
            BuildError::CannotStart(failure) => Self::CannotStart(failure),
        }
    }
}

impl Error {
    /// Whether the user stopped the work: nothing is wrong with it.
    pub fn is_stop(&self) -> bool {
        matches!(self, Self::Interrupted { .. } | Self::Stopped { .. })
    }

    /// The point whose law failed, if one did.
    pub fn failed_point(&self) -> Option<&PointFailure> {
        match self {
            Self::CannotStart(failure) | Self::Law { failure, .. } => Some(failure),
            Self::NoEquilibrium(none) => none.failure.failed(),
            _ => None,
        }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "phase `{}`, increment {}", self.phase, self.increment)
    }
}

impl fmt::Display for RunawayAt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let axis = match self.axis {
            Axis::X => "x",
            Axis::Y => "y",
        };
        let [x, y] = self.node;
        let groups: Vec<String> = self.groups.iter().map(|name| format!("`{name}`")).collect();
        write!(
            f,
            "the displacement in {axis} ran away: {:.1e} m in one step at node ({x:.4}, {y:.4}), \
             group {}: a mechanism, which next to nothing resists",
            self.increment,
            groups.join(", ")
        )
    }
}

impl fmt::Display for NoEquilibrium {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            place,
            reached,
            of,
            failure,
            runaway,
            ..
        } = self;
        write!(
            f,
            "{place}: no equilibrium beyond {reached:.4} of {of} increments"
        )?;
        if let Some(mechanism) = &failure.mechanism {
            write!(f, "\n  {mechanism}")?;
        }
        write!(f, "\n  last attempt: {}", failure.reason)?;
        if let Some(runaway) = runaway {
            write!(f, "\n  {runaway}")?;
        }
        if let Some(culprit) = &failure.culprit {
            write!(f, "\n  {culprit}")?;
        }
        Ok(())
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Refused(refusal) => refusal.fmt(f),
            Self::CannotStart(failure) => write!(f, "cannot start: {failure}"),
            Self::Singular { phase } => write!(f, "phase `{phase}`: the equations are singular"),
            Self::NoEquilibrium(none) => none.fmt(f),
            Self::Law {
                place,
                failure,
                however_small,
            } => {
                write!(f, "{place}: {failure}")?;
                if *however_small {
                    write!(f, "\n  however small the step")?;
                }
                Ok(())
            }
            Self::Process { place, why } => write!(f, "{place}: {why}"),
            Self::Interrupted { place } => write!(
                f,
                "{place}: stopped as asked; everything up to here is written"
            ),
            Self::Stopped { place } => write!(
                f,
                "{place}: stopped as asked, within the increment; everything before it is written"
            ),
            Self::Halted => write!(f, "halted by whoever watched"),
            Self::OtherState(why) => write!(f, "{why}"),
        }
    }
}

impl std::error::Error for Error {}
