//! The files of this crate as texts, for programs that hand the contract on: `pilum new-law` writes
//! them into projects, which then need nothing else.

/// A path in the crate's folder, and what the file says.
pub type File = (&'static str, &'static str);

macro_rules! file {
    ($path:literal) => {
        ($path, include_str!(concat!("../", $path)))
    };
}

/// The contract in words.
pub const README: &str = include_str!("../README.md");

/// The contract in C.
pub const HEADER: File = file!("include/pilum_law.h");

/// Helpers for one integration point, in C.
pub const POINT_HEADER: File = file!("include/pilum_point.h");

/// Helpers in C++.
pub const CPP_HEADER: File = file!("include/pilum_law.hpp");

/// The contract and its helpers in Fortran.
pub const MODULE: File = file!("include/pilum_law.f90");

/// The symbols of a law's library, for a linker.
pub const EXPORTS: File = file!("include/exports.map");

/// This crate without its optional features, but for its manifest.
pub const CRATE: [File; 17] = [
    file!("README.md"),
    file!("src/lib.rs"),
    file!("src/access.rs"),
    file!("src/descriptor.rs"),
    file!("src/descriptor/formulation.rs"),
    file!("src/differences.rs"),
    file!("src/dual.rs"),
    file!("src/dual/by_duals.rs"),
    file!("src/export.rs"),
    file!("src/export/adapter.rs"),
    file!("src/friction.rs"),
    file!("src/law.rs"),
    file!("src/raw.rs"),
    file!("src/reclosure.rs"),
    file!("src/status.rs"),
    file!("src/substepping.rs"),
    file!("src/version.rs"),
];
