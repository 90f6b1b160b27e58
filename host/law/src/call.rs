//! Calls of a law and their results: points of a batch before and after an increment.

use crate::Strided;
use abi::status::Outcome;
use serde::{Deserialize, Serialize};

/// Which operator a call computes next to the fluxes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operator {
    /// None.
    None,
    /// The tangent consistent with the update.
    Consistent,
    /// The elastic operator.
    Elastic,
}

/// Where an integration point lies. Laws of the contract do not ask; routines made for other
/// programs do.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Site {
    /// Coordinates.
    pub position: [f64; 2],
    /// Characteristic length of the element.
    pub length: f64,
    /// Element within its group, from 1.
    pub element: u32,
    /// Integration point within the element, from 1.
    pub point: u32,
}

impl Default for Site {
    /// A point by itself.
    fn default() -> Self {
        Self {
            position: [0.0; 2],
            length: 1.0,
            element: 1,
            point: 1,
        }
    }
}

/// Number of the loading step, for routines that ask.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Moment {
    /// Phase, or segment of a driver, from 1.
    pub step: u32,
    /// Increment of it, from 1.
    pub increment: u32,
    /// Time at which it started.
    pub step_start: f64,
    /// How long it takes.
    pub step_length: f64,
    /// Pore water does not leave.
    pub is_undrained: bool,
}

impl Default for Moment {
    /// The first increment of all.
    fn default() -> Self {
        Self {
            step: 1,
            increment: 1,
            step_start: 0.0,
            step_length: 1.0,
            is_undrained: false,
        }
    }
}

/// Points of a batch at the start of an increment, and the gradients at its end.
#[derive(Clone, Copy, Debug)]
pub struct Start<'a> {
    /// Number of points.
    pub n_points: usize,
    /// Gradients at the start, and their place.
    pub gradient: (&'a [f64], Strided),
    /// Gradients at the end, and their place.
    pub gradient_end: (&'a [f64], Strided),
    /// Fluxes at the start, and their place.
    pub flux: (&'a [f64], Strided),
    /// Internal variables at the start, point by point.
    pub state: &'a [f64],
    /// Time at the start.
    pub time: f64,
    /// Time increment.
    pub time_increment: f64,
    /// Numbers of the step and the increment.
    pub moment: Moment,
    /// Coordinates of the points; empty if the law does not ask ([`crate::Law::asks_for_sites`]).
    pub sites: &'a [Site],
}

/// Where the results of a call go.
#[derive(Debug)]
pub struct End<'a> {
    /// Fluxes, and their place.
    pub flux: (&'a mut [f64], Strided),
    /// Internal variables, point by point.
    pub state: &'a mut [f64],
    /// Operators, point by point, row-major; may be empty if none is wanted.
    pub operator: &'a mut [f64],
}

/// Why a batch cannot be used. The outputs are garbage then.
#[derive(Clone, Debug, PartialEq)]
pub struct BatchFailure {
    /// The first of the worst points.
    pub point: usize,
    /// What the law said of it.
    pub outcome: Outcome,
    /// In words; empty if the law gave none.
    pub message: String,
    /// The smallest step factor asked for, if only smaller steps are asked for.
    pub factor: Option<f64>,
    /// The law claimed success, with a result that is not finite.
    pub claims_success: bool,
    /// What the law was asked at the point.
    pub call: Option<Box<PointCall>>,
}

impl BatchFailure {
    /// The worse of two failures of one group: this one if they are alike. If both only ask for smaller
    /// steps, with the smaller one of the two.
    #[must_use]
    pub fn or_worse(self, other: Self) -> Self {
        let severity = |failure: &Self| match failure.outcome {
            Outcome::Ok => 0,
            Outcome::Unreliable => 1,
            Outcome::CutStep => 2,
            Outcome::Argument => 3,
            Outcome::Parameter => 4,
            Outcome::Unsupported => 5,
            Outcome::Domain => 6,
            Outcome::Numeric => 7,
            Outcome::Internal => 8,
            Outcome::Unknown(_) => 9,
        };
        let factor = match (self.factor, other.factor) {
            (Some(a), Some(b)) => Some(a.min(b)),
            _ => None,
        };
        let worse = if severity(&other) > severity(&self) {
            other
        } else {
            self
        };
        Self { factor, ..worse }
    }
}

/// What a call asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Request {
    /// An update, with an operator or none.
    Update(Operator),
    /// Initial internal variables.
    InitialState,
}

/// A call of a law for one point: all that the answer depends on, next to the law and its
/// parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct PointCall {
    /// The request.
    pub request: Request,
    /// Time at the start.
    pub time: f64,
    /// Time increment.
    pub time_increment: f64,
    /// Gradient at the start.
    pub gradient: Vec<f64>,
    /// Gradient at the end.
    pub gradient_end: Vec<f64>,
    /// Flux at the start.
    pub flux: Vec<f64>,
    /// Internal variables at the start.
    pub state: Vec<f64>,
    /// Numbers of the step and the increment.
    pub moment: Moment,
    /// Where the point lies.
    pub site: Site,
}

impl BatchFailure {
    pub(crate) fn of_call(self, call: PointCall) -> Self {
        Self {
            call: Some(Box::new(call)),
            ..self
        }
    }
}

/// A batch that can be used.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BatchSuccess {
    /// Points whose results are valid but inaccurate, and the law's message about them.
    pub unreliable: Option<(usize, String)>,
}
