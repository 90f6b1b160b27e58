//! Outputs that take nothing, and inputs that never end.
#![cfg(target_os = "linux")]

use crate::program::{BAD_INPUT, CASE, DONE, Outcome, PLUGIN_TROUBLE, Place};
use tests::words::has;

/// Commands that print, with a library, a driver and a capsule at hand.
const PRINT: [&[&str]; 12] = [
    &["--help"],
    &["run", "--help"],
    &["--version"],
    &["schema", "case"],
    &["laws"],
    &["laws", "--json"],
    &["laws", "elastic"],
    &["check", "--list"],
    &["completions", "bash"],
    &["man"],
    &["lock", "case.toml"],
    &["point", "driver.toml"],
];

const DRIVER: &str = r#"law = "elastic"
hypothesis = "3d"
parameters = { young_modulus = 1e4, poisson_ratio = 0.3 }
segment = [{ increments = 2, control = { 11 = { strain = 1e-3 } } }]
"#;

fn place() -> Place {
    let place = Place::new();
    place.write("case.toml", CASE);
    place.write("driver.toml", DRIVER);
    place
}

#[test]
fn a_full_output_is_said_in_a_line() {
    for arguments in PRINT {
        let outcome = place()
            .run_limited("exec > /dev/full", arguments)
            .ended(BAD_INPUT);
        outcome.shows("No space left");
        outcome.hides("panicked");
    }
}

/// Progress that cannot be written is no reason to lose the run, nor to end as if all was well.
#[test]
fn a_full_error_stream_is_exit_1_with_complete_results() {
    let place = place();
    place
        .run_limited("exec 2> /dev/full", &["run", "case.toml", "--out", "out"])
        .ended(BAD_INPUT);
    place.done(&["run", "case.toml", "--out", "expected"]);
    let read = |file: &str| place.read(file);
    assert_eq!(read("out/history.csv"), read("expected/history.csv"));
    assert!(read("out/summary.json").contains("\"status\": \"done\""));
    assert!(place.path("out/report.html").is_file());
}

#[test]
fn a_pipe_that_nobody_reads_any_more_is_no_error() {
    for arguments in PRINT {
        let reader = "mkfifo pipe; (: < pipe) & exec > pipe; wait";
        let Outcome { code, stderr, .. } = place().run_limited(reader, arguments);
        assert_eq!(code, Some(DONE), "{arguments:?}: {stderr}");
        assert!(!stderr.contains("write"), "{arguments:?}: {stderr}");
    }
}

#[test]
fn devices_and_pipes_are_no_libraries() {
    for file in ["/dev/zero", "./pipe"] {
        for command in ["inspect", "check"] {
            let outcome = place()
                .run_limited("mkfifo pipe; ulimit -t 10", &[command, file])
                .ended(BAD_INPUT);
            outcome.shows("expected a file");
        }
    }
}

#[test]
fn devices_and_endless_files_are_no_input() {
    for command in ["run", "point", "lock", "replay"] {
        let outcome = place()
            .run_limited("ulimit -t 10", &[command, "/dev/zero"])
            .ended(BAD_INPUT);
        outcome.shows("it is a device");
        let long = "truncate -s 100G long.toml; ulimit -t 10";
        let outcome = place()
            .run_limited(long, &[command, "long.toml"])
            .ended(BAD_INPUT);
        outcome.shows("longer than 16 MB");
    }
    // Shells write `<(…)` as a pipe.
    let pipe = "mkfifo pipe; cat driver.toml > pipe & :";
    place().run_limited(pipe, &["point", "pipe"]).ended(DONE);
}

/// Whatever the limit, a run out of memory reports how much it needs. Its summary has the status of a
/// stopped run, and the rows written are whole. This holds for libraries tried before and for those
/// tried within the limit.
#[test]
fn memory_that_runs_out_is_said() {
    let case = concat!(env!("CARGO_MANIFEST_DIR"), "/../cases/bonded_pile");
    let arguments = ["run", case, "--variant", "m2k", "--out", "out"];
    let place = Place::new();
    place.done(&[&arguments[..], &["--dry-run"]].concat());
    // In KiB of address space: too little for threads, for files, for the equations. The program itself
    // and the C library take 27 to 38 MB, by how it is optimised; with less it cannot be loaded.
    let limits = [44_000, 48_000, 60_000, 90_000];
    for (limit, is_new) in limits
        .iter()
        .flat_map(|limit| [(limit, false), (limit, true)])
    {
        let place = Place::new();
        let new = if is_new {
            "export XDG_CACHE_HOME=$PWD;"
        } else {
            ""
        };
        let outcome = place.run_limited(&format!("{new} ulimit -v {limit}"), &arguments);
        let said = &outcome.stderr;
        outcome.hides("panicked");
        outcome.hides("internal error");
        if outcome.says("failed to map segment") {
            // Just too little for a library.
            assert_eq!(outcome.code, Some(PLUGIN_TROUBLE), "{limit}: {said}");
            continue;
        }
        assert_eq!(outcome.code, Some(BAD_INPUT), "{limit}: {said}");
        let needed = outcome.says("not enough memory: about");
        let untried = is_new && outcome.says("not enough memory to try library");
        assert!(needed || untried, "{limit}: {said}");
        if let Ok(summary) = std::fs::read_to_string(place.path("out/summary.json")) {
            has(&summary, "\"status\": \"stopped\"");
            assert!(summary.contains("not enough memory"), "{limit}: {said}");
            let history = place.read("out/history.csv");
            assert!(history.ends_with('\n'), "{limit}");
        }
    }
}

/// A library that is new is tried within a limit of the user's that is lower than that of the trial, as batch
/// systems set one.
#[test]
fn a_new_library_is_tried_within_the_limit() {
    let case = concat!(env!("CARGO_MANIFEST_DIR"), "/../cases/chamber_mesh1");
    let place = Place::new();
    let limits = "export XDG_CACHE_HOME=$PWD; ulimit -v 2000000";
    place
        .run_limited(limits, &["run", case, "--dry-run", "--out", "out"])
        .ended(DONE);
    assert!(place.path("pilum/probed").is_dir());
}

/// A quota of files is a full disk, not a signal that ends the program.
#[test]
#[cfg(unix)]
fn a_file_that_may_not_grow_is_said() {
    let place = place();
    place.write("case.toml", CASE);
    let outcome = place
        .run_limited("ulimit -f 1", &["run", "case.toml", "--out", "out"])
        .ended(BAD_INPUT);
    outcome.shows("File too large");
}
