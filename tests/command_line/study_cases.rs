//! The studies in `cases/`, carried out by the programs that they are written for.
#![cfg(target_os = "linux")]
#![expect(clippy::unwrap_used, reason = "part of the tests")]

use crate::program::Place;
use std::ffi::OsString;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use tests::needs;
use tests::or_skip;

pub(crate) fn case(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../cases")
        .join(name);
    path.canonicalize().unwrap().display().to_string()
}

/// What `pilum study` makes of a study of `cases/`, or one by its path, as a table.
pub(crate) fn by_itself(name: &str) -> String {
    let place = Place::new();
    place.done(&["study", &case(name), "--out", "out"]);
    table(&place)
}

pub(crate) fn table(place: &Place) -> String {
    let outcome = place.done(&["table", "out"]);
    outcome.stdout
}

/// A program with `pilum` on its path, in the folder of a place.
pub(crate) fn with_pilum(place: &Place, program: &str) -> Command {
    let pilum = place.command(&[]);
    let mut path = OsString::from(Path::new(pilum.get_program()).parent().unwrap());
    path.push(":");
    path.push(std::env::var_os("PATH").unwrap_or_default());
    let mut command = Command::new(program);
    command.current_dir(place.path("")).env("PATH", path);
    for (name, value) in pilum.get_envs() {
        if let Some(value) = value {
            command.env(name, value);
        }
    }
    command
}

/// All runs are done, and the table is the one of the study by itself.
fn is_that_of_the_study(place: &Place, name: &str) {
    let written = place.read("out/table.csv");
    assert_eq!(written, by_itself(name));
    assert!(
        written
            .lines()
            .skip(1)
            .all(|row| row.split(',').nth(1) == Some("done")),
        "{written}"
    );
    assert!(place.path("out/report.html").is_file());
}

#[test]
fn gnu_parallel_carries_out_a_study() {
    if tests::needs::output(Command::new("parallel").arg("--version")).is_none() {
        return;
    }
    let place = Place::new();
    let script = format!("{}/run.sh", case("study_parallel"));
    let mut command = with_pilum(&place, "sh");
    let output = command.args([&script, "out"]).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    is_that_of_the_study(&place, "study_parallel");
    // Once more: nothing is left to do.
    let written = || {
        std::fs::metadata(place.path("out/00003/history.csv"))
            .unwrap()
            .modified()
            .unwrap()
    };
    let before = written();
    let mut command = with_pilum(&place, "sh");
    assert!(
        command
            .args([&script, "out"])
            .output()
            .unwrap()
            .status
            .success()
    );
    assert_eq!(written(), before);
}

/// Snakemake on the path, or where `.ci/run` has installed it.
fn snakemake() -> Option<PathBuf> {
    let own = std::env::var_os("PILUM_SNAKEMAKE").map(PathBuf::from);
    let program = own.unwrap_or_else(|| "snakemake".into());
    tests::needs::output(Command::new(&program).arg("--version"))?;
    Some(program)
}

#[test]
fn snakemake_carries_out_a_study() {
    let program = or_skip!(snakemake());
    let place = Place::new();
    let file = format!("{}/Snakefile", case("study_snakemake"));
    let mut command = with_pilum(&place, program.to_str().unwrap());
    command.env("HOME", place.path(""));
    command.args([
        "--snakefile",
        &file,
        "--cores",
        "2",
        "--keep-going",
        "--config",
        "out=out",
    ]);
    let output = command.output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    is_that_of_the_study(&place, "study_snakemake");
}

/// The script of a job array, as a shell runs it for one task after the other.
#[test]
fn tasks_of_a_job_array_carry_out_their_runs() {
    let place = Place::new();
    let script = format!("{}/study.sbatch", case("study_slurm"));
    for task in ["3", "64"] {
        let mut command = with_pilum(&place, "bash");
        command
            .env("STUDY", case("study_slurm"))
            .env("OUT", "out")
            .env("SLURM_ARRAY_TASK_ID", task);
        let output = command.arg(&script).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{said}");
    }
    let states: Vec<String> = table(&place)
        .lines()
        .skip(1)
        .map(|row| row.split(',').nth(1).unwrap().to_owned())
        .collect();
    assert_eq!(states.len(), 64);
    for (number, state) in (1..).zip(&states) {
        let expected = if [3, 64].contains(&number) {
            "done"
        } else {
            "planned"
        };
        assert_eq!(state, expected, "{number}");
    }
}

/// Indices of sensitivity of the chamber's study: SALib, given the outputs of `runs.csv`, finds those of `effects.csv`.
#[test]
fn indices_of_the_chamber_are_those_of_salib() {
    const SALIB: &str = "salib/bin/python";
    if !needs::is_there(SALIB) {
        return;
    }
    let place = Place::new();
    let study = std::fs::read_to_string(Path::new(&case("study_parallel")).join("saltelli.toml"));
    let study = study.unwrap();
    let chamber = format!("{}/chamber.toml", case("study_parallel"));
    let runs = study.lines().find(|line| line.starts_with("runs = "));
    let study = study.replace(runs.unwrap(), "runs = 4");
    place.write("study.toml", study.replace("chamber.toml", &chamber));
    place.done(&["study", "study.toml", "--out", "out"]);
    // The column of a table whose cells have no commas.
    let read = |name: &str| {
        let text = std::fs::read_to_string(place.path("out").join(name)).unwrap();
        let rows = text
            .lines()
            .map(|row| row.split(',').map(str::to_owned).collect());
        let mut rows: Vec<Vec<String>> = rows.collect();
        (rows.remove(0), rows)
    };
    let at = |names: &[String], name: &str| names.iter().position(|other| other == name).unwrap();
    let ((names, runs), (of_effects, effects)) = (read("runs.csv"), read("effects.csv"));
    assert_eq!(runs.len(), 4 * (3 + 2));
    for output in ["q_s", "sigma_n"] {
        let numbers = runs
            .iter()
            .map(|row| row[at(&names, output)].clone() + "\n");
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("interoperability/salib.py");
        let mut command = Command::new(needs::installed(SALIB));
        command.arg(script).args(["given", "3"]);
        let mut child = command
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let numbers: String = numbers.collect();
        child
            .stdin
            .take()
            .unwrap()
            .write_all(numbers.as_bytes())
            .unwrap();
        let said = child.wait_with_output().unwrap().stdout;
        let theirs: serde_json::Value = serde_json::from_slice(&said).unwrap();
        for (i, parameter) in ["mu_p", "a", "E_sand"].into_iter().enumerate() {
            let mut rows = effects.iter();
            let row = rows
                .find(|row| row[0] == output && row[1] == parameter)
                .unwrap();
            for (ours, key) in [("share", "S1"), ("total", "ST")] {
                let found: f64 = row[at(&of_effects, ours)].parse().unwrap();
                let expected = theirs[key][i].as_f64().unwrap();
                let is_close = (found - expected).abs() < 1e-9;
                assert!(is_close, "{output}, {parameter}, {key}: {found} {expected}");
            }
        }
    }
}
