//! Calls of a law and their results. A batch of points goes in as a [`Start`] and comes back in an [`End`], which borrow
//! the arrays of the caller; a [`PointCall`] is the call of one point, kept by value.

use abi::raw::{self, Status};
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

impl Operator {
    /// What the contract calls an update with it.
    pub(crate) fn request(self) -> u32 {
        raw::PILUM_REQ_FLUX
            | match self {
                Self::None => 0,
                Self::Consistent => raw::PILUM_REQ_TANGENT,
                Self::Elastic => raw::PILUM_REQ_ELASTIC,
            }
    }

    /// The one that a request of the contract asks for.
    pub(crate) fn of_request(request: u32) -> Self {
        if request & raw::PILUM_REQ_ELASTIC != 0 {
            Self::Elastic
        } else if request & raw::PILUM_REQ_TANGENT != 0 {
            Self::Consistent
        } else {
            Self::None
        }
    }

    /// Entries of a point of this many components.
    pub(crate) fn n_entries(self, n_components: usize) -> usize {
        match self {
            Self::None => 0,
            Self::Consistent | Self::Elastic => n_components * n_components,
        }
    }
}

/// Values of many points in a slice: component `c` of point `i` is at
/// `offset + i * point + c * component`.
#[derive(Clone, Copy, Debug)]
pub struct Strided {
    /// Position of the first value.
    pub offset: usize,
    /// Stride from point to point.
    pub point: usize,
    /// Stride from component to component.
    pub component: usize,
}

impl Strided {
    /// Points one after the other, `n` components each.
    pub fn rows(n: usize) -> Self {
        Self {
            offset: 0,
            point: n,
            component: 1,
        }
    }

    /// The place of one component of one point.
    #[inline]
    pub(crate) fn at(self, point: usize, component: usize) -> usize {
        self.offset + point * self.point + component * self.component
    }

    /// The components of one point; as many as the slice holds of them.
    pub fn of_point(self, values: &[f64], point: usize, n_components: usize) -> Vec<f64> {
        let at = (0..n_components).map(|c| values.get(self.at(point, c)));
        at.map_while(Option::<&f64>::copied).collect()
    }
}

/// Where an integration point lies. Laws of the contract do not ask; routines made for other
/// programs do.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
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
#[serde(deny_unknown_fields)]
pub struct Moment {
    /// Phase, or segment of a driver, from 1.
    pub step: u32,
    /// Increment of it, from 1.
    pub increment: u32,
    /// Time at which it started.
    #[serde(rename = "start")]
    pub step_start: f64,
    /// How long it takes.
    #[serde(rename = "length", default = "one")]
    pub step_length: f64,
    /// Pore water does not leave.
    #[serde(rename = "undrained", default)]
    pub is_undrained: bool,
}

/// How long a phase or segment takes where nothing is reported of it.
fn one() -> f64 {
    1.0
}

impl Default for Moment {
    /// The first increment of all.
    fn default() -> Self {
        Self {
            step: 1,
            increment: 1,
            step_start: 0.0,
            step_length: one(),
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

impl<'a> Start<'a> {
    /// Points with these fluxes before anything has happened: nothing else is known of them.
    pub(crate) fn of_fluxes(n_points: usize, flux: (&'a [f64], Strided)) -> Self {
        let nothing: (&[f64], Strided) = (&[], Strided::rows(0));
        Self {
            n_points,
            gradient: nothing,
            gradient_end: nothing,
            flux,
            state: &[],
            time: 0.0,
            time_increment: 0.0,
            moment: Moment::default(),
            sites: &[],
        }
    }

    /// Where a point lies.
    pub(crate) fn site(&self, point: usize) -> Site {
        self.sites.get(point).copied().unwrap_or_default()
    }
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

impl<'a> End<'a> {
    /// Room for internal variables alone.
    pub(crate) fn of_state(state: &'a mut [f64]) -> Self {
        Self {
            flux: (&mut [], Strided::rows(0)),
            state,
            operator: &mut [],
        }
    }
}

/// What a law says of each point of a batch. Whoever calls many batches keeps the room from call to call.
#[derive(Debug, Default)]
pub(crate) struct Outcomes {
    /// Status codes.
    pub(crate) status: Vec<Status>,
    /// Fractions of the increment to try next, where a smaller one is asked for.
    pub(crate) factor: Vec<f64>,
}

impl Outcomes {
    /// Makes room for this many points, as it is before a law has written to it.
    pub(crate) fn clear(&mut self, n_points: usize) {
        self.status.clear();
        self.status.resize(n_points, raw::PILUM_E_INTERNAL);
        self.factor.clear();
        self.factor.resize(n_points, f64::NAN);
    }

    /// The same for a new batch.
    pub(crate) fn of(n_points: usize) -> Self {
        let mut outcomes = Self::default();
        outcomes.clear(n_points);
        outcomes
    }
}

/// A batch: what it goes in as, where its results go, and what becomes of its points.
pub(crate) type Batch<'a, 'b> = (&'a Start<'a>, &'a mut End<'b>, &'a mut Outcomes);

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

/// A point at the start of an increment, and its gradient at the end.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PointStart {
    /// Gradient at the start.
    pub gradient0: Vec<f64>,
    /// Gradient at the end.
    pub gradient1: Vec<f64>,
    /// Flux at the start.
    pub flux0: Vec<f64>,
    /// Internal variables at the start.
    pub state0: Vec<f64>,
}

/// A call of a law for one point: all that the answer depends on, next to the law and its
/// parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct PointCall {
    /// The request.
    pub request: Request,
    /// The point.
    pub start: PointStart,
    /// Time at the start.
    pub time: f64,
    /// Time increment.
    pub time_increment: f64,
    /// Numbers of the step and the increment.
    pub moment: Moment,
    /// Where the point lies.
    pub site: Site,
}

impl PointCall {
    /// That of one point of a batch with this many components and internal variables.
    pub(crate) fn of(
        request: Request,
        start: &Start<'_>,
        point: usize,
        (n, n_states): (usize, usize),
    ) -> Self {
        let of_point = |(values, place): (&[f64], Strided)| place.of_point(values, point, n);
        Self {
            request,
            start: PointStart {
                gradient0: of_point(start.gradient),
                gradient1: of_point(start.gradient_end),
                flux0: of_point(start.flux),
                state0: Strided::rows(n_states).of_point(start.state, point, n_states),
            },
            time: start.time,
            time_increment: start.time_increment,
            moment: start.moment,
            site: start.site(point),
        }
    }

    /// The point as a batch.
    pub fn as_start(&self) -> Start<'_> {
        let rows = Strided::rows(self.start.flux0.len());
        Start {
            n_points: 1,
            gradient: (&self.start.gradient0, rows),
            gradient_end: (&self.start.gradient1, rows),
            flux: (&self.start.flux0, rows),
            state: &self.start.state0,
            time: self.time,
            time_increment: self.time_increment,
            moment: self.moment,
            sites: std::slice::from_ref(&self.site),
        }
    }
}

/// Fluxes, internal variables and operators at the end of an increment, point by point.
pub type Updated = (Vec<f64>, Vec<f64>, Vec<f64>);

/// A batch that can be used.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BatchSuccess {
    /// Points whose results are valid but inaccurate, and the law's message about them.
    pub unreliable: Option<(usize, String)>,
}
