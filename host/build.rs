//! How the program is linked.
//!
//! Libraries find the utility routines in it that user subroutines of Abaqus call
//! (`law/src/library/abaqus.rs`).
//!
//! It lies at a fixed address: its 39 000 addresses need not be put right each time it starts, which was a
//! quarter of the time of a start (1.8 ms), and a small run starts it twice. Libraries, stack and heap lie
//! where the system likes, as before.

use std::env::var;

const ROUTINES: [&str; 8] = [
    "xit_",
    "stdb_abqerr_",
    "sinv_",
    "sprinc_",
    "sprind_",
    "rotsig_",
    "getjobname_",
    "getoutdir_",
];

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    if var("CARGO_CFG_TARGET_OS").is_ok_and(|os| os == "linux") {
        for routine in ROUTINES {
            println!("cargo::rustc-link-arg-bins=-Wl,--export-dynamic-symbol={routine}");
        }
        if var("CARGO_CFG_TARGET_ENV").is_ok_and(|env| env == "gnu") {
            println!("cargo::rustc-link-arg-bins=-no-pie");
        }
    }
}
