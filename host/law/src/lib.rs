//! A library file becomes a law that can be called: searching, checking, opening, describing,
//! building and calling. An [`adapter`] wraps libraries made for other programs. Code that may crash
//! or hang runs in a [`child`] process or in workers ([`isolate`]). The host's `unsafe` code is here.

pub mod adapter;
mod built;
mod call;
#[cfg(unix)]
pub mod calls;
#[cfg(not(unix))]
#[path = "calls/none.rs"]
pub mod calls;
pub mod capsule;
pub mod child;
pub mod custody;
mod description;
mod digest;
mod error;
mod image;
pub mod inspect;
#[cfg(unix)]
pub mod isolate;
mod law;
mod library;
mod opened;
mod opener;
mod pins;
mod search;
mod shear_zone;
mod stop;
mod trust;
pub mod vetting;

pub use abi::Hypothesis;
pub use built::{BuildCause, BuildFailure, BuiltLaw, UsedParameter, Value};
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
pub use opened::{CreateFailure, Library, LoadedLaw};
pub use opener::Opener;
pub use pins::{Pins, lock_path};
pub use search::{Libraries, Origin, Place, SearchPath};
pub use shear_zone::ShearZone;
pub use stop::{GRACE, Stop, Stopped};
pub use trust::Trust;
