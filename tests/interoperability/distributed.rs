//! Cases in DOLFINx under MPI, with our laws at its points: `cases/distributed`, on one rank and on two.
//!
//! Passed over with a remark where its environment is not installed, also where nothing else may be: it
//! needs Python 3.12, 350 MB and a wheel of Pilum.

use crate::assert_close;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use tests::needs;
use tests::words::rows_of;

/// Forces on one rank and on two, and before and after a stop: what sums in another order leave.
const RANKS: f64 = 1e-9;
/// Forces there and here: both iterate until corrections are 1e-7 of the displacements, and the one
/// after would be about the square of that.
const PROGRAMS: f64 = 1e-9;

fn case() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../cases/distributed")
}

/// Python of the environment, if there is one.
pub(crate) fn python() -> Option<PathBuf> {
    let folder = std::env::var_os("PILUM_DOLFINX").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../target/dolfinx"),
        PathBuf::from,
    );
    let python = folder.join("bin/python");
    if python.is_file() {
        return Some(python);
    }
    needs::passed_over("DOLFINx (cases/distributed/install.sh)");
    None
}

/// `run.py` on this many ranks.
fn on_ranks(python: &Path, ranks: u32, arguments: &[&str], results: &Path) -> Output {
    let mut command = Command::new(python.with_file_name("mpiexec"));
    command.arg("-n").arg(ranks.to_string()).arg(python);
    command.arg("-B").arg(case().join("run.py")).args(arguments);
    command.arg("--results").arg(results);
    command.output().unwrap()
}

/// Iterations and head load (kN) of every increment.
fn run(python: &Path, ranks: u32, arguments: &[&str], results: &Path) -> Vec<(u32, f64)> {
    let output = on_ranks(python, ranks, arguments, results);
    let said = [output.stdout, output.stderr].concat();
    let said = String::from_utf8_lossy(&said);
    assert!(output.status.success(), "{arguments:?}\n{said}");
    let rows = tests::case::table(&results.join("history.csv"));
    let row = |row: &std::collections::BTreeMap<String, String>| {
        let load: f64 = row["pile_head_y"].parse().unwrap();
        (row["iterations"].parse().unwrap(), -load)
    };
    rows.iter().map(row).collect()
}

/// Head loads of a variant by our own program.
fn here(file: &Path, variant: &str) -> Vec<f64> {
    let cases = input::Case::load(file).unwrap();
    let named = |case: &&input::Case| case.variant.as_deref() == Some(variant);
    let case = cases.iter().find(named).unwrap();
    let folder = tempfile::tempdir().unwrap();
    runs::run::run(case, folder.path(), &mut tests::case::Silent::default()).unwrap();
    let rows = tests::case::table(&folder.path().join("history.csv"));
    rows.iter().map(|row| row["q_t"].parse().unwrap()).collect()
}

#[track_caller]
fn assert_loads(found: &[(u32, f64)], expected: &[f64], tolerance: f64) {
    assert_eq!(found.len(), expected.len());
    for (number, ((_, load), expected)) in found.iter().zip(expected).enumerate() {
        assert_close(*load, *expected, tolerance, &format!("row {number}"));
    }
}

fn loads(rows: &[(u32, f64)]) -> Vec<f64> {
    rows.iter().map(|(_, load)| *load).collect()
}

fn iterations(rows: &[(u32, f64)]) -> Vec<u32> {
    rows.iter().map(|(iterations, _)| *iterations).collect()
}

#[test]
fn ranks_agree_with_each_other_and_with_us() {
    let Some(python) = python() else { return };
    let place = tempfile::tempdir().unwrap();
    let base = toml::Value::from(case().join("case.toml").to_str().unwrap());
    let written = |name: &str, changes: &str| {
        let file = place.path().join(name);
        std::fs::write(&file, format!("base = {base}\n{changes}")).unwrap();
        file
    };
    // Another law of interfaces, whose shear hardens, and Gauss points.
    let mepi = written(
        "mepi.toml",
        "[laws.mepi]\nlaw = \"mepi\"\nparameters = { k_n = 0.86e5, k_t = 0.37e5, n = 0.55, mu_0 = 0.27, mu_p = 0.7, \
         mu_c0 = 0.46, a = 0.008, c_0 = 40.0, t = 0.002, p_0 = 100.0, sigma_ni = 100.0 }\n\
         [groups.joint]\nlaw = \"mepi\"\nintegration = \"full\"\n",
    );
    // A second interface, which meets the first at a corner and reaches the axis, or the middle.
    let toe = "[mesh.lines]\ntoe = { z = 0.18, r = [0.0, 0.010] }\n\
               [groups.base]\nformulation = \"zero_thickness\"\nline = \"toe\"\nlaw = \"joint\"\n";
    let corner = written("corner.toml", toe);
    let plane = written("plane.toml", &format!("analysis = \"plane_strain\"\n{toe}"));
    for file in [case().join("case.toml"), mepi, corner, plane] {
        let arguments = [file.to_str().unwrap(), "--variant", "m200"];
        let one = run(&python, 1, &arguments, &place.path().join("one"));
        let two = run(&python, 2, &arguments, &place.path().join("two"));
        assert_loads(&one, &here(&file, "m200"), PROGRAMS);
        assert_loads(&two, &loads(&one), RANKS);
        assert_eq!(iterations(&two), iterations(&one), "{}", file.display());
    }
}

#[test]
fn the_bonded_pile_gives_the_digits_of_other_programs() {
    let Some(python) = python() else { return };
    let bonded = case().join("../bonded_pile/case.toml");
    let place = tempfile::tempdir().unwrap();
    // The load beyond the share of the initial stress, elastic; and in full, kN: abi/interoperability.md.
    let initial = 100.0 * std::f64::consts::PI * 0.01 * 0.01;
    for (variant, expected, spent) in [
        ("m200_elastic", 5.363_843_597_53, None),
        ("m200", 3.930_163_756_58, Some(43)),
    ] {
        let arguments = [bonded.to_str().unwrap(), "--variant", variant];
        let rows = run(&python, 2, &arguments, &place.path().join(variant));
        let (_, load) = *rows.last().unwrap();
        let load = if spent.is_none() {
            load - initial
        } else {
            load
        };
        assert_close(load, expected, 1e-11, variant);
        assert!(spent.is_none_or(|spent| iterations(&rows).iter().sum::<u32>() == spent));
    }
}

#[test]
fn a_run_goes_on_on_other_ranks() {
    let Some(python) = python() else { return };
    let place = tempfile::tempdir().unwrap();
    let folder = case();
    let variant = [folder.to_str().unwrap(), "--variant", "m200"];
    let whole = run(&python, 1, &variant, &place.path().join("whole"));
    let parts = place.path().join("parts");
    let until =
        |ranks, more: &[&'static str]| run(&python, ranks, &[&variant[..], more].concat(), &parts);
    assert_eq!(until(2, &["--stop-after", "2"]).len(), 2);
    assert_eq!(until(2, &["--resume", "--stop-after", "3"]).len(), 3);
    let on = until(1, &["--resume"]);
    assert_loads(&on, &loads(&whole), RANKS);
    assert_eq!(iterations(&on), iterations(&whole));
    // Not with the state of another case.
    let bonded = folder.join("../bonded_pile");
    let other = [
        bonded.to_str().unwrap(),
        "--variant",
        "m200_elastic",
        "--resume",
    ];
    refused(
        &on_ranks(&python, 2, &other, &parts),
        1,
        "its state is that of another case, or of other laws",
    );
}

/// It ends with this exit code and one message that reports it.
#[track_caller]
fn refused(output: &Output, code: i32, message: &str) {
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{said}");
    assert!(said.contains(message), "{message}, but: {said}");
    assert_eq!(said.matches("error: ").count(), 1, "{said}");
    assert!(!said.contains("Traceback"), "{said}");
}

#[test]
fn mistakes_end_all_ranks_with_a_message() {
    let Some(python) = python() else { return };
    let place = tempfile::tempdir().unwrap();
    let base = toml::Value::from(case().join("case.toml").to_str().unwrap());
    // The last one is of a law that cannot start there.
    for [change, code, message] in rows_of(
        r#"
laws.joint.law = "coulomb_joynt" | 3 | error: no library with law `coulomb_joynt`
laws.joint.parameters.frictoin_angle = 3.0 | 1 | no parameter `frictoin_angle`
laws.joint.law = "mohr_coulomb" | 1 | interface_2d
groups.soil.integration = "reduced" | 1 | groups.soil.integration: solids have 3 × 3 points here
groups.soil.unit_weight = 18.0 | 1 | groups.soil.unit_weight: not in a distributed run
[[phase]]\nname = "push"\nincrements = 1\ndisplacement = [{ line = "pile_head", z = -0.3 }] | 2 | increment 1 of 1:
laws.loose = { law = "mepi", parameters = { k_n = 1e5, k_t = 1e5, n = 0.5, mu_0 = 0.2, mu_p = 0.7, mu_c0 = 0.4, a = 0.01, c_0 = 40.0, t = 0.002, p_0 = 100.0 } }\ngroups.joint.law = "loose"\ngroups.soil.initial_stress = { 11 = 0.0 }\ngroups.pile.initial_stress = { 11 = 0.0 } | 3 | rank 0: at (0.01,
"#,
    ) {
        let file = place.path().join("wrong.toml");
        std::fs::write(&file, format!("base = {base}\n{change}\n")).unwrap();
        let arguments = [file.to_str().unwrap(), "--variant", "m200"];
        refused(
            &on_ranks(&python, 2, &arguments, &place.path().join("wrong")),
            code.parse().unwrap(),
            message,
        );
    }
    let folder = case();
    let folder = folder.to_str().unwrap();
    for (arguments, message) in [
        (&[folder, "--variant", "m20"][..], "--variant is `m20`"),
        (&[folder][..], "--variant is missing, there is: m200"),
        (&["nowhere"][..], "nowhere"),
        (&[folder, "--bogus"][..], "unrecognized arguments: --bogus"),
    ] {
        refused(
            &on_ranks(&python, 2, arguments, &place.path().join("wrong")),
            1,
            message,
        );
    }
}

#[test]
fn without_its_environment_it_is_passed_over() {
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.args([
        "--exact",
        "distributed::a_run_goes_on_on_other_ranks",
        "--nocapture",
    ]);
    command
        .env("PILUM_DOLFINX", "nowhere")
        .env(needs::STRICT[0], "1");
    let output = command.output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    let remark = "SKIPPED: DOLFINx (cases/distributed/install.sh) is missing";
    assert!(said.contains(remark), "{said}");
}
