//! From an idea to a finite-element run, in any language: `pilum new-law` with the commands of the
//! README that it writes, one law in four languages, what `pilum laws` says, the schemas of input
//! files, and the pages of `host/docs`, which are followed and compared. What needs a compiler that is missing is passed over with a
//! remark, or fails where nothing may be passed over (`tests::needs`). What CI leaves out is listed.
#![allow(clippy::unwrap_used, clippy::panic, reason = "tests panic to fail")]

mod cam_clay;
mod compilers;
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
