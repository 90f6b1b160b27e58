//! From an idea to a finite-element run, in any language: `pilum new-law` with the commands of the README that it
//! writes, and one law in four languages. Also the output of `pilum laws`, the schemas of input files, and the pages of
//! `host/docs`, which are followed and compared. Tests that need a missing compiler are skipped with a remark, or fail
//! where nothing may be skipped (`tests::needs`). Tests that CI leaves out are listed.
#![allow(clippy::unwrap_used, clippy::panic, reason = "tests panic to fail")]

mod cam_clay;
mod compilers;
mod decisions;
mod foreign;
mod guides;
mod helpers;
mod laws;
mod names;
mod on_request;
mod pages;
mod program;
mod prose;
mod rates;
mod reference;
mod rooms;
mod schema;
mod supply_chain;
mod tangents;
mod validator;
