//! The cases in `cases/`, run as a user runs them, against what their READMEs say.
#![allow(clippy::unwrap_used, clippy::panic, reason = "these are tests")]

mod aspect_ratio;
mod bonded_pile;
mod chamber;
mod chamber_confinement;
mod chamber_extremes;
mod chamber_instability;
mod chamber_interface_model;
mod chamber_loading;
mod chamber_mesh;
mod chamber_soil_law;
mod ground;
mod hardening_soil;
mod joint_laws;
mod piles;
mod shear_box;
mod shear_zone;
mod variant;
