//! From an idea to a finite-element run, in any language: `pilum new-law` with the commands of the
//! README that it writes, one law in four languages, what `pilum laws` says, and the schemas of
//! input files. Compilers that are missing are noted and passed over; where
//! `PILUM_REQUIRE_COMPILERS` or `CI` is set, they are required.
#![allow(clippy::unwrap_used, clippy::panic, reason = "tests panic to fail")]

mod compilers;
mod foreign;
mod guides;
mod laws;
mod names;
mod program;
mod schema;
mod supply_chain;
mod validator;
