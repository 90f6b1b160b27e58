//! Random valid input: whatever a driver or a case asks for within what is allowed ends in results
//! that keep what was asked, or in a message. Seeds are fixed; a seed is one input, on every machine.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "tests panic to fail"
)]

mod cases;
mod drivers;
mod ground;
mod seeds;
