//! How a call is made, and what it leaves behind.

use super::{BATCH_BYTES, Fence, PointStart};
use crate::call::{Moment, Site};
use abi::raw::Status;
use serde::{Deserialize, Serialize};

/// How the values of several points are in memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Order {
    /// Point by point.
    Points,
    /// Component by component.
    Components,
    /// With gaps between components and between points.
    Spread,
    /// Inputs only once, for all points; outputs point by point.
    Uniform,
}

impl Order {
    /// How, for messages.
    pub fn words(self) -> &'static str {
        match self {
            Self::Points => "which stands point by point",
            Self::Components => "which stands component by component",
            Self::Spread => "which stands with gaps",
            Self::Uniform => "whose inputs stand once for all points",
        }
    }
}

/// Results of a law for a point.
#[derive(Clone, Debug)]
pub struct PointEnd {
    /// Outcome; [`NO_OUTCOME`](super::NO_OUTCOME) where none was written or none could be.
    pub status: Status,
    /// Step factor.
    pub step_factor: f64,
    /// Flux.
    pub flux: Vec<f64>,
    /// Internal variables.
    pub state: Vec<f64>,
    /// Operator, row by row; empty if none was requested.
    pub tangent: Vec<f64>,
}

/// All that one call has left behind.
#[derive(Clone, Debug)]
pub struct Answer {
    /// What the call returned.
    pub status: Status,
    /// The whole message buffer.
    pub message: Vec<u8>,
    /// The points.
    pub points: Vec<PointEnd>,
    /// Something was written between the cells of an output.
    pub stray: bool,
}

impl Answer {
    /// The message up to its NUL; `None` without a NUL.
    pub fn text(&self) -> Option<String> {
        terminated(&self.message)
    }
}

pub(super) fn terminated(buffer: &[u8]) -> Option<String> {
    let end = buffer.iter().position(|&byte| byte == 0)?;
    Some(String::from_utf8_lossy(&buffer[..end]).into_owned())
}

/// The form of a call.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Form {
    /// Requests.
    pub request: u32,
    /// Layout of all arrays.
    pub order: Order,
    /// What lies next to inputs.
    pub around_inputs: Fence,
    /// What lies next to outputs.
    pub around_outputs: Fence,
    /// Writing to an input ends the process.
    pub inputs_locked: bool,
    /// Hand over `status` and `step_factor`.
    pub outcomes: bool,
    /// Size of the message buffer; none: null.
    pub message: Option<usize>,
    /// Size of the batch struct, in bytes.
    pub batch_bytes: usize,
    /// Number of the first point.
    pub first_point: u64,
    /// Time at which the increment begins, in all and in its step.
    pub time: f64,
    /// Length of the increment in time.
    pub time_increment: f64,
    /// Numbers of step and increment for a routine; by default those of [`Form::when`].
    pub moment: Option<Moment>,
    /// Coordinates of the points for a routine.
    pub site: Option<Site>,
    /// Ask for the consistent tangent even of a law that declares none; else its elastic operator
    /// is in, as in a run.
    pub verbatim: bool,
}

impl Form {
    /// An ordinary call with these requests, whose arrays have room to spare around them.
    pub fn of(request: u32) -> Self {
        Self {
            request,
            order: Order::Points,
            around_inputs: Fence::Far,
            around_outputs: Fence::Far,
            inputs_locked: false,
            outcomes: true,
            message: Some(512),
            batch_bytes: BATCH_BYTES,
            first_point: 0,
            time: 0.0,
            time_increment: 1.0,
            moment: None,
            site: None,
            verbatim: false,
        }
    }

    /// At what time an increment begins, and which one it is: as in a run the first one of all for a point whose
    /// gradient is zero, else one like the second.
    pub fn when(&self, start: &PointStart) -> (f64, Moment) {
        if let Some(moment) = self.moment {
            return (self.time, moment);
        }
        if start.gradient0.iter().all(|value| *value == 0.0) {
            return (self.time, Moment::default());
        }
        let second = Moment {
            increment: 2,
            ..Moment::default()
        };
        (self.time + self.time_increment, second)
    }
}
