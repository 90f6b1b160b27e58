//! Laws in other programs, and laws of other programs here. Routes and traps: abi/interoperability.md.
//!
//! Tests that need OpenGeoSys, Kratos, SALib or CalculiX are skipped with a remark if these are not installed, or
//! fail (`tests::needs`): `install.sh` next to this file installs the first three. Tests that need DOLFINx never fail
//! for lack of it, but are skipped with a remark: `cases/distributed/install.sh` installs it.
#![expect(clippy::unwrap_used, reason = "part of the tests")]

mod distributed;
mod entries;
mod exchange;
mod kratos;
mod mfront;
mod opengeosys;
mod salib;
mod zone;

use std::env;
use std::path::{Path, PathBuf};
use std::process::Command;
use tests::needs::{self, installed, is_there};
use tests::words::rows_of;

/// The library of a law, where the test program was built.
fn library(law: &str) -> PathBuf {
    let program = env::current_exe().unwrap();
    program.with_file_name(format!("lib{law}.so"))
}

/// A file next to this one.
fn beside(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("interoperability")
        .join(name)
}

/// Programs of others, in the folder of `install.sh`.
const OPENGEOSYS: &str = "opengeosys/bin/ogs";
const KRATOS: &str = "kratos/bin/python";

#[test]
fn a_missing_program_is_named() {
    for [test, program] in rows_of(
        "
opengeosys::elastic_gives_our_stresses | opengeosys
mfront::other_behaviours_of_opengeosys_run | opengeosys
kratos::mohr_coulomb_gives_our_head_force | kratos
exchange::opengeosys_gives_our_table | opengeosys
exchange::kratos_gives_our_table | kratos
salib::indices_of_the_ishigami_function_are_those_of_salib | salib
",
    ) {
        let what = format!("{program} (tests/interoperability/install.sh)");
        needs::assert_named(test, &what);
    }
    needs::assert_named("exchange::calculix_gives_our_table", exchange::CALCULIX);
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

/// A residual left by the iteration makes stresses differ by about its size, here by up to twice as
/// much: at the default of 1e-9 that exceeds the tolerance of the comparison.
const SOLVER: &str = "[solver]\nforce_tolerance = 1e-12\ndisplacement_tolerance = 1e-9\n";

impl BondedPile {
    fn run(changes: &str) -> Self {
        let case = Path::new(env!("CARGO_MANIFEST_DIR")).join("../cases/bonded_pile/case.toml");
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("case.toml");
        let base = toml::Value::from(case.to_str().unwrap());
        std::fs::write(
            &file,
            format!("base = {base}\n{changes}\n{SOLVER}[output]\npoints = \"phases\"\n"),
        )
        .unwrap();
        let cases = input::Case::load(&file).unwrap();
        let is_m200 = |case: &&input::Case| case.variant.as_deref() == Some("m200");
        let case = cases.iter().find(is_m200).unwrap();
        runs::run::run(case, folder.path(), &mut tests::case::Silent::default()).unwrap();
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
