//! Lets libraries find the utility routines in the program that user subroutines of Abaqus call
//! (`law/src/library/abaqus.rs`).

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
    }
}
