//! Laws from libraries that are made for other programs. An adapter stands between such a library
//! and the contract: it describes the laws, and carries one point at a time through the routine.
//!
//! | adapter | library | describes itself |
//! |---|---|---|
//! | [`Adapter::Umat`] | an Abaqus user subroutine `UMAT` | no: a sidecar file does |
//! | [`Adapter::Mfront`] | behaviours of MFront's generic interface | yes, by its symbols |
//! | [`Adapter::Udsm`] | a user-defined soil model of PLAXIS | yes, by functions, which run in a worker |
//!
//! Shared by all of them: `each_point`, which carries a batch through a routine for one point, and for routines that take
//! bare addresses the `guarded` arguments. A further adapter is a variant of [`Adapter`], an arm of `open`, and a `Source`
//! with its `Instance`.

mod guarded;
mod mfront;
mod sidecar;
mod symbols;
mod udsm;
mod umat;

pub use umat::SYMBOLS as UMAT_SYMBOLS;

use crate::Error;
use crate::call::{Batch, End, Start, Strided};
use crate::description::{LawDescription, is_false};
use crate::instance::{Answer, Source as LawSource};
use crate::process::library_bytes::Image;
use abi::raw::{self, Status};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
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
    #[serde(default)]
    pub in_process: bool,
    /// Write the arguments of one call here.
    pub record: Option<PathBuf>,
    /// Not if they are there already.
    #[serde(default, skip_serializing_if = "is_false")]
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

    /// The same library at this path as a capsule has it: called in this process, once. A file holds paths as texts.
    pub(crate) fn of_capsule(&self, library: &Path) -> Self {
        let text = |path: &Path| PathBuf::from(path.to_string_lossy().into_owned());
        Self {
            library: text(library),
            sidecar: self.sidecar.as_deref().map(text),
            in_process: true,
            record: None,
            records_once: false,
            scratch: None,
            ..self.clone()
        }
    }
}

/// What a foreign library offers.
#[derive(Debug, Default)]
pub(crate) struct ForeignLaws {
    /// Laws with what builds them.
    pub(crate) laws: Vec<(LawDescription, Arc<dyn LawSource>)>,
    /// SHA-256 of the file that describes them, where the library does not.
    pub(crate) sidecar: Option<String>,
    /// What that file says of routines that nobody supplies, and of scratch files.
    pub(crate) wishes: (Option<Externals>, Option<Scratch>),
}

/// Why a foreign library cannot be opened.
#[derive(Debug)]
pub(crate) enum Fault {
    /// A defect of the library, in words that stand behind its name.
    Library(String),
    /// A defect that has its own place, such as a line of a sidecar.
    Other(Error),
}

impl From<String> for Fault {
    fn from(why: String) -> Self {
        Self::Library(why)
    }
}

impl From<Error> for Fault {
    fn from(error: Error) -> Self {
        Self::Other(error)
    }
}

/// Describes the laws of a foreign library. Nothing of it runs, but for a UDSM's functions.
///
/// # Errors
/// The defect of the library, or of its description at its place.
pub(crate) fn open(foreign: &Foreign, image: &Image) -> Result<ForeignLaws, Fault> {
    match foreign.adapter {
        Adapter::Umat => Ok(umat::open(foreign, image)?),
        Adapter::Mfront => Ok(mfront::open(foreign, image)?),
        Adapter::Udsm => Ok(udsm::open(foreign, image)?),
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
pub(crate) fn time_of_call(start: &Start<'_>, time_dependent: bool) -> f64 {
    if start.time_increment > 0.0 {
        start.time_increment
    } else if time_dependent {
        MOMENT_AT_REST * start.moment.step_length
    } else {
        TIME_AT_REST
    }
}

/// Carries the points of a batch over the increment, each by itself: `update` has a start and an end of one point, whose
/// values stand one after the other, and those of the end are zero before. A point that fails does not stop the others;
/// the message is that of the first of the worst.
pub(crate) fn each_point(
    (n, n_states, n_operator): (usize, usize, usize),
    (start, end, outcomes): Batch<'_, '_>,
    mut update: impl FnMut(&Start<'_>, &mut End<'_>) -> Result<(), Refusal>,
) -> Answer {
    let rows = Strided::rows(n);
    let [mut gradient, mut gradient_end, mut flux, mut flux_end] = [(); 4].map(|()| vec![0.0; n]);
    let mut worst = (raw::PILUM_OK, String::new());
    for point in 0..start.n_points {
        gather(start.gradient, point, &mut gradient);
        gather(start.gradient_end, point, &mut gradient_end);
        gather(start.flux, point, &mut flux);
        flux_end.fill(0.0);
        let sites = [start.site(point)];
        let one = Start {
            n_points: 1,
            gradient: (&gradient, rows),
            gradient_end: (&gradient_end, rows),
            flux: (&flux, rows),
            state: match start.state {
                [] => &[],
                all => &all[point * n_states..][..n_states],
            },
            sites: &sites,
            ..*start
        };
        let mut its_end = End {
            flux: (&mut flux_end, rows),
            state: &mut end.state[point * n_states..][..n_states],
            operator: &mut end.operator[point * n_operator..][..n_operator],
        };
        its_end.state.fill(0.0);
        its_end.operator.fill(0.0);
        outcomes.status[point] = match update(&one, &mut its_end) {
            Ok(()) => raw::PILUM_OK,
            Err(refusal) => {
                outcomes.factor[point] = refusal.factor;
                let status = abi::status::most_severe(worst.0, refusal.status);
                if status != worst.0 {
                    worst = (status, format!("point {point}: {}", refusal.message));
                }
                refusal.status
            }
        };
        scatter(&flux_end, point, &mut end.flux);
    }
    worst
}

/// Values of a point to their place, if there is one.
fn scatter(values: &[f64], point: usize, (all, place): &mut (&mut [f64], Strided)) {
    if !all.is_empty() {
        for (c, value) in values.iter().enumerate() {
            all[place.at(point, c)] = *value;
        }
    }
}

/// The values of a point; nothing where there are none.
fn gather((values, place): (&[f64], Strided), point: usize, out: &mut [f64]) {
    if !values.is_empty() {
        for (c, value) in out.iter_mut().enumerate() {
            *value = values[place.at(point, c)];
        }
    }
}
