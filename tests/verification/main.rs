//! The verification manual, `cases/verification`: the program against answers from outside the code.
//!
//! Every closed form is computed here, every case is run as a user runs it. `--nocapture` prints the errors
//! that the tables of the manual have.
#![allow(clippy::unwrap_used, clippy::panic, reason = "these are tests")]

mod elastic;
mod ground;
mod interfaces;
mod plastic;
mod setup;
