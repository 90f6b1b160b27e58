//! Laws at the ends of their ranges, through their libraries: a driven matrix held against
//! references in higher precision and quadratures, properties of random states, a long soak.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "tests panic to fail"
)]
#![allow(clippy::doc_markdown, reason = "the headers hold formulas")]

mod garbage;
mod joint;
mod matrix;
mod mepi_paths;
mod mepi_step;
mod mohr_coulomb;
mod oriented;
mod point;
mod properties;
mod quadrature;
mod soak;
mod thin_layer;
mod wide;
