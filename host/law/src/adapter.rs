//! Laws from libraries that are made for other programs. An adapter stands between such a library
//! and the contract: it describes the laws, and carries one point at a time through the routine.
//!
//! | adapter | library | describes itself |
//! |---|---|---|
//! | [`Adapter::Umat`] | an Abaqus user subroutine `UMAT` | no: a sidecar file does |
//! | [`Adapter::Mfront`] | behaviours of MFront's generic interface | yes, by its symbols |
//! | [`Adapter::Udsm`] | a user-defined soil model of PLAXIS | yes, by functions, which run in a worker |
//!
//! A further adapter is a variant of [`Adapter`], an arm of `open`, a `ForeignLaw` and a
//! `ForeignInstance`.

pub mod conventions;
mod guarded;
mod mfront;
mod sidecar;
mod symbols;
mod udsm;
mod umat;

pub use umat::SYMBOLS as UMAT_SYMBOLS;

use super::description::LawDescription;
use super::library::{Call, CallFailure, Strided};
use super::library_bytes::Image;
use super::{Moment, Site};
use crate::Error;
use abi::Hypothesis;
use abi::raw::{self, Status};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::fmt::Debug;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use text::Source;

/// The program that a library is made for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Adapter {
    /// Abaqus, `SUBROUTINE UMAT`.
    Umat,
    /// MFront's generic interface.
    Mfront,
    /// PLAXIS, `User_Mod`.
    Udsm,
}

impl Adapter {
    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Umat => "umat",
            Self::Mfront => "mfront",
            Self::Udsm => "udsm",
        }
    }
}

/// What becomes of a UMAT that calls routines which nobody supplies.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Externals {
    /// Refuse the library.
    #[default]
    Refuse,
    /// A call ends the worker process and names the routine.
    Trap,
}

impl Externals {
    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Refuse => "refuse",
            Self::Trap => "trap",
        }
    }
}

/// How the stiffness that a routine leaves is in memory.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Order {
    /// By columns, as in Fortran.
    #[default]
    Columns,
    /// By rows, as in C.
    Rows,
}

impl Order {
    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Columns => "columns",
            Self::Rows => "rows",
        }
    }
}

/// What becomes of the files that a UMAT leaves in its working folder.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Scratch {
    /// Removed with the folder.
    #[default]
    Remove,
    /// Kept; the program says where.
    Keep,
}

/// A library that is made for another program, as a file names it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Foreign {
    /// The program it is made for.
    pub adapter: Adapter,
    /// The library.
    pub library: PathBuf,
    /// Its description, if not in the usual place.
    pub sidecar: Option<PathBuf>,
    /// Call it in this process and not in workers.
    pub in_process: bool,
    /// Write the arguments of one call here.
    pub record: Option<PathBuf>,
    /// Not if they are there already.
    pub records_once: bool,
    /// What becomes of routines that it calls and nobody supplies; else the sidecar says it.
    pub externals: Option<Externals>,
    /// What becomes of its scratch files; else the sidecar says it.
    pub scratch: Option<Scratch>,
    /// How a UDSM leaves its stiffness; by columns if nothing is reported.
    pub tangent_order: Option<Order>,
}

impl Foreign {
    /// A UMAT, with nothing said next to its library.
    pub fn umat(library: &Path) -> Self {
        Self {
            adapter: Adapter::Umat,
            library: library.to_owned(),
            sidecar: None,
            in_process: false,
            record: None,
            records_once: false,
            externals: None,
            scratch: None,
            tangent_order: None,
        }
    }
}

/// A law of a foreign library, without parameters yet.
pub(crate) trait ForeignLaw: Debug + Send + Sync {
    /// Whether calls of one material must follow one another.
    fn is_serial(&self) -> bool;

    /// Fixes the parameters (in declared order; NaN: left out). What the library keeps between
    /// calls belongs to this one material.
    ///
    /// # Errors
    /// Status and reason.
    fn create(
        &self,
        hypothesis: Hypothesis,
        parameters: &[f64],
    ) -> Result<Box<dyn ForeignInstance>, CallFailure>;
}

/// A law of a foreign library with its parameters fixed.
pub(crate) trait ForeignInstance: Debug + Send + Sync {
    /// Initial internal variables; `None` if the description says all there is to say.
    fn init_state(&self, _call: Call<'_>) -> Option<(Status, String)> {
        None
    }

    /// Carries the points over the increment. Returns the most severe status and a message.
    fn integrate(&self, call: Call<'_>) -> (Status, String);

    /// Arguments that the routine has overwritten though it is given them to read, those that were
    /// not told before.
    fn take_overwritten(&self) -> Vec<String> {
        Vec::new()
    }

    /// Puts a number between the arguments of calls from now on, in front of that one or everywhere; the usual one if
    /// none exists. In words where that is; `None` if there is no such place.
    fn put_beside(&self, _gap: Option<usize>, _value: Option<f64>) -> Option<String> {
        None
    }
}

/// What a foreign library offers.
#[derive(Debug)]
pub(crate) struct ForeignLaws {
    /// Laws with what builds them.
    pub(crate) laws: Vec<(LawDescription, Arc<dyn ForeignLaw>)>,
    /// SHA-256 of the file that describes them, where the library does not.
    pub(crate) sidecar: Option<String>,
    /// What that file says of routines that nobody supplies, and of scratch files.
    pub(crate) wishes: (Option<Externals>, Option<Scratch>),
}

/// Describes the laws of a foreign library. Nothing of it runs, but for a UDSM's functions.
///
/// # Errors
/// [`Error::Library`] for the library; [`text::Error::Input`] at the place of its description.
pub(crate) fn open(foreign: &Foreign, image: &Image) -> Result<ForeignLaws, Error> {
    match foreign.adapter {
        Adapter::Umat => umat::open(foreign, image),
        Adapter::Mfront => mfront::open(foreign, image),
        Adapter::Udsm => udsm::open(foreign, image),
    }
}

/// The sidecar next to a library, if there is one.
pub fn sidecar_of(library: &Path) -> Option<PathBuf> {
    sidecar::find(library).ok()
}

/// Reads a sidecar by itself.
///
/// # Errors
/// [`text::Error::Input`] at the place that does not fit.
pub fn sidecar(source: &Source) -> Result<LawDescription, Error> {
    Ok(sidecar::Sidecar::of(source)?.law)
}

/// Describes the behaviours in the bytes of a library.
///
/// # Errors
/// It has no readable description.
pub fn behaviours(bytes: &[u8]) -> Result<Vec<LawDescription>, String> {
    mfront::describe(bytes)
}

/// A point at the start of an increment, and the gradient at its end.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PointStart<'a> {
    /// Gradient at the start.
    pub(crate) gradient: &'a [f64],
    /// Gradient at the end.
    pub(crate) gradient_end: &'a [f64],
    /// Flux at the start.
    pub(crate) flux: &'a [f64],
    /// Internal variables at the start.
    pub(crate) state: &'a [f64],
    /// Time at the start.
    pub(crate) time: f64,
    /// Time increment.
    pub(crate) time_increment: f64,
    /// The request: `PILUM_REQ_…`.
    pub(crate) request: u32,
    /// Numbers of step and increment.
    pub(crate) moment: Moment,
    /// Where the point lies.
    pub(crate) site: Site,
}

/// Where the results of a point go; all zero before.
#[derive(Debug)]
pub(crate) struct PointEnd<'a> {
    /// Flux.
    pub(crate) flux: &'a mut [f64],
    /// Internal variables.
    pub(crate) state: &'a mut [f64],
    /// The operator that is asked for, row-major; empty if none is.
    pub(crate) operator: &'a mut [f64],
}

/// Why a point has no results.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Refusal {
    /// `PILUM_CUT_STEP` or an error.
    pub(crate) status: Status,
    /// Fraction of the increment to try next, of `PILUM_CUT_STEP`.
    pub(crate) factor: f64,
    /// Why.
    pub(crate) message: String,
}

impl Refusal {
    /// An error.
    pub(crate) fn error(status: Status, message: impl Into<String>) -> Self {
        Self {
            status,
            factor: f64::NAN,
            message: message.into(),
        }
    }
}

/// DTIME of calls that are no increment: at the start of a law, and for its elastic operator.
const TIME_AT_REST: f64 = 1.0;
/// The same as a share of the phase or segment, of laws that would creep in it.
const MOMENT_AT_REST: f64 = 1e-9;

/// The time increment that a routine is given, which may divide by it: never 0.
pub(crate) fn time_of_call(start: &PointStart<'_>, time_dependent: bool) -> f64 {
    if start.time_increment > 0.0 {
        start.time_increment
    } else if time_dependent {
        MOMENT_AT_REST * start.moment.step_length
    } else {
        TIME_AT_REST
    }
}

/// Carries the points of a batch over the increment, each by itself. A point that fails does not
/// stop the others; the message is that of the first of the worst.
pub(crate) fn each_point(
    call: Call<'_>,
    mut update: impl FnMut(&PointStart<'_>, &mut PointEnd<'_>) -> Result<(), Refusal>,
) -> (Status, String) {
    let (n, n_states) = (call.n_components, call.n_states);
    let wants_operator = call.request & (raw::PILUM_REQ_TANGENT | raw::PILUM_REQ_ELASTIC) != 0;
    let n_operator = if wants_operator { n * n } else { 0 };
    let (mut gradient, mut gradient_end) = (vec![0.0; n], vec![0.0; n]);
    let (mut flux, mut flux_end) = (vec![0.0; n], vec![0.0; n]);
    let mut flux1 = call.flux1;
    let mut worst = (raw::PILUM_OK, String::new());
    for point in 0..call.n_points {
        gather(call.gradient0, point, &mut gradient);
        gather(call.gradient1, point, &mut gradient_end);
        gather(Some(call.flux0), point, &mut flux);
        flux_end.fill(0.0);
        let start = PointStart {
            gradient: &gradient,
            gradient_end: &gradient_end,
            flux: &flux,
            state: &call.state0[point * n_states..][..n_states],
            time: call.time,
            time_increment: call.time_increment,
            request: call.request,
            moment: call.moment,
            site: call.sites.get(point).copied().unwrap_or_default(),
        };
        let mut end = PointEnd {
            flux: &mut flux_end,
            state: &mut call.state1[point * n_states..][..n_states],
            operator: &mut call.tangent[point * n_operator..][..n_operator],
        };
        end.state.fill(0.0);
        end.operator.fill(0.0);
        let status = match update(&start, &mut end) {
            Ok(()) => raw::PILUM_OK,
            Err(refusal) => {
                call.step_factor[point] = refusal.factor;
                let status = abi::status::most_severe(worst.0, refusal.status);
                if status != worst.0 {
                    worst = (status, format!("point {point}: {}", refusal.message));
                }
                refusal.status
            }
        };
        call.status[point] = status;
        if let Some((values, place)) = &mut flux1 {
            let first = place.offset + point * place.point;
            for (c, value) in flux_end.iter().enumerate() {
                values[first + c * place.component] = *value;
            }
        }
    }
    worst
}

fn gather(values: Option<(&[f64], Strided)>, point: usize, out: &mut [f64]) {
    if let Some((values, place)) = values {
        let first = place.offset + point * place.point;
        for (c, value) in out.iter_mut().enumerate() {
            *value = values[first + c * place.component];
        }
    }
}
