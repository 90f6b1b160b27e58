//! Runs: of a case, of a driver, of variants, of studies; with results in folders, checkpoints, and a
//! watch over what laws do to the process.

pub mod calibration;
mod experiment;
#[expect(unsafe_code, reason = "the program's allocator")]
#[cfg(unix)]
pub mod memory;
pub mod point;
pub mod run;
mod run_status;
mod sampling;
pub mod study;
pub mod supervision;
pub mod trade_off;
pub mod variants;

pub use input::Error;
pub use run_status::ending;
