//! A library file becomes a law that can be called: searching, checking, opening, describing,
//! building and calling. What is made for other programs stands behind an [`adapter`]; what may crash
//! or hang runs in a [`child`] process or in workers ([`isolate`]). The host's `unsafe` code is here.

pub mod adapter;
mod construct;
mod call;
#[cfg(unix)]
pub mod current_call;
#[cfg(not(unix))]
#[path = "calls/none.rs"]
pub mod current_call;
pub mod capsule;
pub mod child;
pub mod process_state;
mod description;
mod digest;
mod error;
mod library_bytes;
pub mod inspect;
#[cfg(unix)]
pub mod isolate;
mod law;
mod library;
mod open_library;
mod opener;
mod expected_hashes;
mod search;
mod shear_zone;
mod stop;
mod trust;
pub mod trial;

pub use abi::Hypothesis;
pub use construct::{BuildCause, BuildFailure, BuiltLaw, UsedParameter, Value};
pub use call::{
    BatchFailure, BatchSuccess, End, Moment, Operator, PointCall, Request, Site, Start,
};
pub use description::{
    Bounds, FormulationDescription, InternalVariable, LawDescription, ParameterDescription,
    Tangent, words,
};
pub use digest::{hexadecimal, hexadecimal_sha256};
pub use error::Error;
pub use law::{Law, TimeDependence};
#[cfg(target_os = "linux")]
pub use library::SharedMemory;
#[doc(hidden)]
pub use library::describe_memory;
pub use library::{Strided, probe};
pub use open_library::{CreateFailure, Library, LoadedLaw};
pub use opener::Opener;
pub use expected_hashes::{Pins, lock_path};
pub use search::{Libraries, Origin, Place, SearchPath};
pub use shear_zone::ShearZone;
pub use stop::{GRACE, Stop, Stopped};
pub use trust::Trust;
