//! Running what may crash, hang or do harm: the bytes of a library and whether they are [trusted](trust), processes that are
//! this program again ([`child`]), laws in worker processes ([`isolate`]), and what is watched while a law is called.

pub mod child;
#[cfg(unix)]
pub mod current_call;
#[cfg(not(unix))]
#[path = "process/current_call/unsupported.rs"]
pub mod current_call;
#[cfg(unix)]
pub mod isolate;
pub(crate) mod library_bytes;
pub mod process_state;
pub(crate) mod stop;
pub(crate) mod trust;
pub(crate) mod vetting;
