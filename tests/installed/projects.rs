//! What `pilum new-law` writes, by the installed program: built, checked and run as its README says.

use approx::assert_relative_eq;
use std::fs;
use tests::case::column;
use tests::place::{Compilers, Place, are_there};

fn follow(language: &str, compilers: Compilers) {
    if !are_there(compilers) {
        return;
    }
    let place = Place::new();
    place.done("", &format!("pilum new-law slider --language {language}"));
    let guide = fs::read_to_string(place.work().join("slider/README.md")).unwrap();
    let blocks = guide.split("```sh\n").skip(1);
    let commands: Vec<&str> = blocks
        .flat_map(|block| block.split("```").next().unwrap().lines())
        .collect();
    assert_eq!(commands.len(), 6, "{commands:?}");
    for command in commands {
        place.done("slider", command);
    }
    // The joint slides at 100 tan 30°; the blocks are of the installed `elastic`.
    let history = place.work().join("slider/results/slider/history.csv");
    let force = column(&history, "shear_force");
    let strength = 100.0 * 30_f64.to_radians().tan();
    assert_relative_eq!(*force.last().unwrap(), strength, max_relative = 1e-8);
}

#[test]
fn a_law_in_c() {
    follow("c", &[("CC", "cc")]);
}

#[test]
fn a_law_in_cpp() {
    follow("cpp", &[("CXX", "c++")]);
}

#[test]
fn a_law_in_fortran() {
    follow("fortran", &[("FC", "gfortran"), ("CC", "cc")]);
}

/// Cargo has an empty home, so that nothing comes from a registry.
#[test]
fn a_law_in_rust() {
    follow("rust", &[]);
}
