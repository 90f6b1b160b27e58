//! All entries of a law library on the same random paths: `entries.c` says what is compared.

use crate::{beside, last_line, library};
use std::path::PathBuf;
use std::process::Command;
use std::sync::LazyLock;
use tempfile::TempDir;

/// The program, compiled once.
static ENTRIES: LazyLock<(TempDir, PathBuf)> = LazyLock::new(|| {
    let folder = TempDir::new().unwrap();
    let program = folder.path().join("entries");
    let mut compiler = Command::new("cc");
    compiler.args(["-std=c11", "-Wall", "-Wextra", "-Werror", "-o"]);
    compiler.arg(&program).arg(beside("entries.c"));
    last_line(compiler.args(["-ldl", "-lm"]));
    (folder, program)
});

/// Panics if an entry differs from the native one.
fn compare(law: &str, behaviour: &str, flux: f64, step: f64, parameters: &[f64]) {
    let file = match law {
        "mepi_softening" => "mepi",
        "qz_curve" => "tz_curve",
        law => law,
    };
    let mut command = Command::new(&ENTRIES.1);
    command.arg(library(file)).args([law, behaviour]);
    let numbers = [flux, step].into_iter().chain(parameters.iter().copied());
    // What is no number is left out.
    command.args(numbers.map(|number| {
        if number.is_nan() {
            "-".to_owned()
        } else {
            number.to_string()
        }
    }));
    let line = last_line(&mut command);
    assert!(line.ends_with(" 0 differences"), "{line}");
}

#[test]
fn laws_for_solids() {
    let plastic = [34e3, 0.3, 1.0, 36.5, 12.0];
    compare("elastic", "Elastic", -100.0, 1e-3, &plastic[..2]);
    compare("mohr_coulomb", "MohrCoulomb", -100.0, 1e-3, &plastic);
    compare(
        "oriented_mohr_coulomb",
        "OrientedMohrCoulomb",
        -100.0,
        1e-3,
        &plastic,
    );
}

#[test]
fn laws_for_interfaces() {
    let joint = [1e6, 4e5, 1.0, 30.0, 5.0];
    compare("coulomb_joint", "CoulombJoint", -100.0, 1e-4, &joint);
    let critical = [1e6, 4e5, 30.0, 0.96, 1e6, 0.29, 1.1, 3.5, 1e-4, 5e-3, 0.7];
    compare(
        "critical_state_joint",
        "CriticalStateJoint",
        -100.0,
        1e-5,
        &critical,
    );
    let cyclic = [1e6, 4e5, 35.0, 25.0, 5e-3, 2.0, 1e-3];
    compare("cyclic_joint", "CyclicJoint", -100.0, 1e-4, &cyclic);
    let hyperbolic = [1e6, 2e4, 0.6, 0.85, 4.0, 30.0];
    compare(
        "hyperbolic_joint",
        "HyperbolicJoint",
        -100.0,
        1e-4,
        &hyperbolic,
    );
    let mepi = [1e3, 0.4e3, 0.9, 0.2, 0.62, 0.5, 8e-3, 1.5, 2e-3];
    compare("mepi", "Mepi", -100.0, 1e-5, &mepi);
    // P0 and SigmaNi stand between those that must be given.
    let (other, softening) = (f64::NAN, [0.45, 5.0, 2e-4]);
    let mepi = [&mepi[..], &[other, other], &softening[..]].concat();
    compare("mepi_softening", "MepiSoftening", -100.0, 1e-5, &mepi);
    let shaft = [12e3, 0.6, 1.0, 80.0, 1e6];
    compare("tz_curve", "TzCurve", -100.0, 1e-3, &shaft);
    let base = [12e3, 0.6, 0.0, 2e3, 1e5];
    compare("qz_curve", "QzCurve", -100.0, 1e-3, &base);
}
