//! A library file becomes a law that can be called. The host's `unsafe` code is here.
//!
//! | room | what it does |
//! |---|---|
//! | `find` | searches, inspects and opens libraries |
//! | `library` | the C boundary: handshake, description, calls |
//! | [`foreign`] | laws from libraries made for other programs |
//! | `process` | what may crash or hang, in a [`child`] process or in workers ([`isolate`]) |
//!
//! # The path of a call
//!
//! 1. A group of elements makes a batch of its points: a [`Start`] with what the law reads and an [`End`] with room for what
//!    it writes (`mechanics/src/group/integrate.rs`).
//! 2. [`Law::integrate`] has it carried, and distrusts the answer: outcomes of all points become one, results must be finite
//!    (`law.rs`; the types of a call are in `call.rs`).
//! 3. The law is an `Instance` (`instance.rs`): one of the contract, a routine behind an adapter, one in a worker process, or
//!    a zone around another one.
//! 4. That of the contract checks that every view lies in its slice, and calls the function of the library
//!    (`library/instance.rs`). The results are in the caller's arrays as it returns.

mod call;
pub mod capsule;
mod construct;
mod description;
mod error;
mod find;
pub mod foreign;
mod instance;
mod law;
mod library;
mod needs;
mod process;
mod shear_zone;
pub mod trial;

pub use abi::Hypothesis;
pub use call::{
    BatchFailure, BatchSuccess, End, Moment, Operator, PointCall, PointStart, Request, Site, Start,
    Strided, Updated,
};
pub use construct::{BuildCause, BuildFailure, BuiltLaw, UsedParameter, Value};
pub use description::{
    Bounds, FormulationDescription, InternalVariable, LawDescription, ParameterDescription,
    Tangent, hypothesis_named, words,
};
pub use error::Error;
pub use find::expected_hashes::{Pins, lock_path};
pub use find::inspect;
pub use find::opened::{Library, LoadedLaw};
pub use find::opener::Opener;
pub use find::search::{Libraries, Origin, Place, SearchPath};
pub use law::{CreateFailure, Law, TimeDependence};
#[cfg(target_os = "linux")]
pub use library::SharedMemory;
#[doc(hidden)]
pub use library::describe_memory;
pub use library::probe;
#[cfg(unix)]
pub use process::isolate;
pub use process::library_bytes::{hexadecimal, hexadecimal_sha256};
pub use process::stop::{GRACE, Stop, Stopped};
pub use process::trust::Trust;
pub use process::{child, current_call, process_state};
pub use shear_zone::ShearZone;
