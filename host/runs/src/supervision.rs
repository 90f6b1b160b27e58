//! A law may end the process that calls it, in many ways: `exit`, a crash, a copy by `fork`. So a
//! child, a copy made before the program has any thread, does the work, and the program watches. Shared
//! memory holds what the child calls, what it has handed out and how it means to end. If a child
//! disappears without announcing its end, a law ended it. Then the same is done once more with laws in
//! separate processes ([`law::isolate`]), which names the point.
//!
//! The watcher takes the signals. Those of the terminal do not reach the child and its children,
//! which see a request to stop in the memory. A child that does not answer is ended.

#[cfg(target_os = "linux")]
mod child;
#[cfg(not(target_os = "linux"))]
#[path = "supervision/unsupported.rs"]
mod child;
#[cfg(target_os = "linux")]
mod page;
#[cfg(target_os = "linux")]
mod parent;
#[cfg(target_os = "linux")]
mod signals;

#[cfg(not(target_os = "linux"))]
pub use child::supervise;
pub use child::{begin_run, case_begun, end, end_run, is_again, stdout, stop, was_begun};
#[cfg(target_os = "linux")]
pub use parent::supervise;

/// Set to anything, the program does all in one process, for debuggers and profilers.
pub const ALONE: &str = "PILUM_UNSUPERVISED";
/// Message after a request to stop.
pub const STOPPING: &str = "stopping after this increment; once more to stop at once";
