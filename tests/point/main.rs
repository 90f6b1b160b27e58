//! Single-point tests: laws, through their libraries and the point driver, against closed forms that do not use
//! the laws' code; and the rules of the driver one by one. MEPI is held against the quadrature of its rates in
//! `extremes/`, and against its equations in `cases/shear_box.rs`; joints with histories in `cases/joint_laws.rs`.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "tests panic to fail"
)]
#![allow(clippy::doc_markdown, reason = "the headers hold formulas")]

mod coulomb_joint;
mod critical_state_joint;
mod driver;
mod input_errors;
mod interface_3d;
mod mohr_coulomb;
mod openers;
mod rules;
mod runaway;
mod singular;
