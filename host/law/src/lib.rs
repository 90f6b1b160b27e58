//! A library file becomes a law that can be called: searching, checking, opening, describing,
//! building and calling. An [`adapter`] wraps libraries made for other programs. Code that may crash
//! or hang runs in a [`child`] process or in workers ([`isolate`]). The host's `unsafe` code is here.

pub mod adapter;
mod call;
pub mod capsule;
pub mod child;
mod construct;
#[cfg(unix)]
pub mod current_call;
#[cfg(not(unix))]
#[path = "current_call/unsupported.rs"]
pub mod current_call;
mod description;
mod digest;
mod error;
mod expected_hashes;
pub mod inspect;
#[cfg(unix)]
pub mod isolate;
mod law;
mod library;
mod library_bytes;
mod open_library;
mod opener;
pub mod process_state;
mod search;
mod shear_zone;
mod stop;
pub mod trial;
mod trust;

pub use abi::Hypothesis;
pub use call::{
    BatchFailure, BatchSuccess, End, Moment, Operator, PointCall, Request, Site, Start,
};
pub use construct::{BuildCause, BuildFailure, BuiltLaw, UsedParameter, Value};
pub use description::{
    Bounds, FormulationDescription, InternalVariable, LawDescription, ParameterDescription,
    Tangent, words,
};
pub use digest::{hexadecimal, hexadecimal_sha256};
pub use error::Error;
pub use expected_hashes::{Pins, lock_path};
pub use law::{Law, TimeDependence};
#[cfg(target_os = "linux")]
pub use library::SharedMemory;
#[doc(hidden)]
pub use library::describe_memory;
pub use library::{Strided, probe};
pub use open_library::{CreateFailure, Library, LoadedLaw};
pub use opener::Opener;
pub use search::{Libraries, Origin, Place, SearchPath};
pub use shear_zone::ShearZone;
pub use stop::{GRACE, Stop, Stopped};
pub use trust::Trust;
