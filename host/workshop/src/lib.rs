//! For authors of laws: does a library keep the contract, what is there, a call that failed once more, a
//! project to begin with.

pub mod check;
pub mod laws;
pub mod new_law;
pub mod new_sidecar;
pub mod replay;
mod scratch;

pub use input::Error;

/// A defect of the program, or of the system that it runs on.
fn internal(why: impl std::fmt::Display) -> Error {
    Error::internal(why.to_string())
}
