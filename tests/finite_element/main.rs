//! Finite-element runs through the law libraries, against closed forms.
#![expect(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "part of the tests"
)]

mod bodies;
mod bonds;
mod condensed;
mod cut_back;
mod cylinder;
mod footing;
mod inclusion;
mod mesh_error;
mod methods;
mod newton;
mod nine_nodes;
mod patch;
mod patch_joint;
mod patch_layer;
mod patch_solid;
mod phases;
mod regularised;
mod relaxation;
mod runaway;
mod sections;
mod setup;
mod sliding_block;
mod snap_back;
mod strain;
mod swap;
mod thick_cylinder;
mod thin_layer;
mod zero_stress;
