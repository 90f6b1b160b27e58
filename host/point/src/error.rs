//! What can go wrong on the way, as data: where, with which law, and why. The sentences are in
//! `words`.

use abi::Hypothesis;
use law::BatchFailure;
use std::path::PathBuf;
use thiserror::Error;

/// Position of a point on its path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Before the first increment.
    Start,
    /// On its way.
    Increment {
        /// Number of the segment, from 1.
        segment: usize,
        /// Number of the increment within it, from 1.
        increment: usize,
        /// Increments of the segment.
        of: usize,
        /// Number of the increment through all segments, from 1: that of its row.
        row: usize,
    },
}

/// A defect of a driver.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Misuse {
    /// There is no segment.
    NoSegment,
    /// A number of increments outside 1 to [`MAX_INCREMENTS`](crate::MAX_INCREMENTS), all segments
    /// together.
    Increments(usize),
    /// A time of a segment that is not above 0, or cannot be meant.
    Time(f64),
    /// A value that is not finite.
    NotFinite(f64),
    /// A stiffness below 0, kPa/m.
    NegativeStiffness(f64),
    /// The stiffness of a component that is no traction.
    StiffnessOfSolid,
    /// The strain 33 in plane strain is led elsewhere than to 0.
    OutOfPlane,
    /// Other components, or restrictions, that are for three dimensions.
    ThreeDimensional,
    /// A restriction, counted from 1, that restricts nothing.
    NoRestriction(usize),
    /// Not as many values as there are components or internal variables.
    Length {
        /// Values given.
        given: usize,
        /// Values that there are.
        expected: usize,
    },
}

/// A driver cannot be made, or cannot be followed to its end.
#[derive(Debug, Error)]
pub enum Error {
    /// It is not asked for as it has to be.
    Misuse {
        /// Number of the segment, from 1, if it is one.
        segment: Option<usize>,
        /// The defect.
        misuse: Misuse,
    },
    /// The law cannot start from the initial state.
    InitialState {
        /// Id of the law.
        law: String,
        /// The law's words.
        reason: String,
    },
    /// It went no farther.
    Failure(Box<Failure>),
}

/// Why and where a point went no farther.
#[derive(Clone, Debug)]
pub struct Failure {
    /// Name of the driver, if it has one.
    pub variant: Option<String>,
    /// Where.
    pub place: Place,
    /// Id of the law.
    pub law: String,
    /// Its library.
    pub library: PathBuf,
    /// Its hypothesis.
    pub hypothesis: Hypothesis,
    /// Why.
    pub cause: Cause,
    /// What had been noticed on the way, in sentences.
    pub warnings: Vec<String>,
    /// The elastic operator of the initial state is zero.
    pub is_without_stiffness: bool,
    /// What else the user could do, said by those who know more.
    pub advice: Option<String>,
}

/// Why a point went no farther.
#[derive(Clone, Debug, PartialEq)]
pub enum Cause {
    /// As asked.
    Stopped,
    /// A flux cannot be reached, or the law cannot follow.
    NoEquilibrium(NoEquilibrium),
    /// The library is at fault: it gives no initial internal variables.
    InitialState(BatchFailure),
    /// The library is at fault: no smaller step mends it.
    Law(BatchFailure),
    /// The library is at fault: it fails however small the step.
    LawInSmallSteps(BatchFailure),
}

/// How far a point came, and what is in its way.
#[derive(Clone, Debug, PartialEq)]
pub struct NoEquilibrium {
    /// Fraction of the increment that was reached.
    pub reached: f64,
    /// What missed its goal by most where the point came nearest; `None` where the law follows no
    /// gradient that was tried.
    pub unmet: Option<Unmet>,
    /// The last update that the law refused.
    pub refusal: Option<Box<BatchFailure>>,
}

/// A goal that was not met, in kPa.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unmet {
    /// What was to be met.
    pub criterion: Criterion,
    /// The flux found.
    pub found: f64,
    /// What it was to be.
    pub goal: f64,
    /// The remaining difference.
    pub residual: f64,
    /// What may be left of it.
    pub tolerance: f64,
}

/// What was to be met.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Criterion {
    /// The flux of a component.
    Flux {
        /// The component.
        component: &'static str,
        /// The goal at the end of the increment.
        at_end: f64,
    },
    /// The flux of a component that changes by −stiffness × jump.
    Stiffness {
        /// The component.
        component: &'static str,
    },
    /// A restriction, counted from 1.
    Restriction(usize),
}

impl From<Misuse> for Error {
    fn from(misuse: Misuse) -> Self {
        Self::Misuse {
            segment: None,
            misuse,
        }
    }
}

impl From<Failure> for Error {
    fn from(failure: Failure) -> Self {
        Self::Failure(Box::new(failure))
    }
}

impl Error {
    /// Adds what the user could do, where the way has ended.
    #[must_use]
    pub fn with_hint(mut self, more: &str) -> Self {
        if let Self::Failure(failure) = &mut self {
            failure.advice = Some(match failure.advice.take() {
                Some(advice) => format!("{advice}; {more}"),
                None => more.to_owned(),
            });
        }
        self
    }

    /// The call of the law that no step could do without, if one failed on the way.
    pub fn failed_call(&self) -> Option<(&Failure, &BatchFailure)> {
        let Self::Failure(failure) = self else {
            return None;
        };
        let call = match &failure.cause {
            Cause::Law(call) | Cause::LawInSmallSteps(call) => call,
            Cause::NoEquilibrium(failure) => failure.refusal.as_deref()?,
            Cause::Stopped | Cause::InitialState(_) => return None,
        };
        (failure.place != Place::Start).then_some((&**failure, call))
    }
}
