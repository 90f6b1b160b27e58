//! Laws in other programs, and laws of other programs here. Routes and traps: abi/interoperability.md.
//!
//! What needs other programs is left out unless asked for: `install.sh` beside this file installs
//! them and says how to run these tests.
#![expect(clippy::unwrap_used, reason = "part of the tests")]

mod entries;
mod kratos;
mod mfront;
mod opengeosys;
mod zone;

use std::env;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The library of a law, where the test program was built.
fn library(law: &str) -> PathBuf {
    let program = env::current_exe().unwrap();
    program.with_file_name(format!("lib{law}.so"))
}

/// A file beside this one.
fn beside(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("interoperability")
        .join(name)
}

/// A file of an installed program.
fn installed(name: &str) -> PathBuf {
    let folder = env::var_os("PILUM_INTEROPERABILITY").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../target/interoperability"),
        PathBuf::from,
    );
    let path = folder.join(name);
    assert!(
        path.is_file(),
        "{} is missing: run tests/interoperability/install.sh",
        path.display()
    );
    path
}

/// The last line that a program prints.
fn last_line(command: &mut Command) -> String {
    let output = command.output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let (out, err) = (text(&output.stdout), text(&output.stderr));
    assert!(output.status.success(), "{command:?}\n{out}\n{err}");
    out.lines().last().unwrap_or_default().to_owned()
}

/// Panics unless two numbers differ by at most `tolerance` of the second.
#[track_caller]
fn assert_close(found: f64, expected: f64, tolerance: f64, what: &str) {
    assert!(
        (found - expected).abs() <= tolerance * expected.abs(),
        "{what}: {found}, expected {expected} within {tolerance:e} of it"
    );
}

/// A variant of the case `bonded_pile` on its mesh `m200`: head load in N (in plane strain N/mm), and
/// stresses of the soil by integration point with its position.
struct BondedPile {
    head_force: f64,
    points: Vec<[f64; 6]>,
}

impl BondedPile {
    fn run(changes: &str) -> Self {
        let case = Path::new(env!("CARGO_MANIFEST_DIR")).join("../cases/bonded_pile/case.toml");
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("case.toml");
        let base = toml::Value::from(case.to_str().unwrap());
        std::fs::write(
            &file,
            format!("base = {base}\n{changes}\n[output]\npoints = \"phases\"\n"),
        )
        .unwrap();
        let cases = host::case::Case::load(&file).unwrap();
        let is_m200 = |case: &&host::case::Case| case.variant.as_deref() == Some("m200");
        let case = cases.iter().find(is_m200).unwrap();
        host::run::run(case, folder.path(), &mut tests::case::Silent::default()).unwrap();
        let history = tests::case::table(&folder.path().join("history.csv"));
        let points = tests::case::table(&folder.path().join("points.csv"));
        let columns = ["x", "y", "stress_11", "stress_22", "stress_33", "stress_12"];
        Self {
            head_force: 1000.0 * history.last().unwrap()["q_t"].parse::<f64>().unwrap(),
            points: points
                .iter()
                .filter(|row| row["group"] == "soil")
                .map(|row| columns.map(|column| row[column].parse().unwrap()))
                .collect(),
        }
    }
}
