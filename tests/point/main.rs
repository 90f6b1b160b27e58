//! Single-point tests: each law, through its library and the point driver, against closed forms
//! and quadratures that do not use the law's code; and the rules of the driver one by one.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "tests panic to fail"
)]
#![allow(clippy::doc_markdown, reason = "the headers hold formulas")]

mod coulomb_joint;
mod critical_state_joint;
mod cyclic_joint;
mod driver;
mod elastic;
mod hyperbolic_joint;
mod input_errors;
mod interface_3d;
mod mepi;
mod mepi_softening;
mod mepi_truth;
mod mohr_coulomb;
mod openers;
mod oriented_mohr_coulomb;
mod rules;
mod runaway;
mod singular;
mod tz_curve;
