//! Laws that end the process they are called in, in every way there is, or change it: the command
//! ends with exit code 3 and names the place, and every row in equilibrium is kept.
#![cfg(target_os = "linux")]

use crate::program::{DONE, Outcome, PLUGIN_TROUBLE, Place};
use crate::troubled;
use tests::or_skip;

/// A way, and what is reported of it once the law is in a separate process.
const WAYS: [(&str, &str); 6] = [
    ("exit", "ended its process: exit code 0"),
    ("quiet_exit", "ended its process: exit code 0"),
    ("abort", "crashed: signal 6"),
    ("segfault", "crashed: signal 11"),
    ("overflow", "crashed: signal 6"),
    ("jump", "crashed: signal"),
];
/// Routines in other languages that end the process.
const ELSEWHERE: [(&str, &str, &str, &str); 2] = [
    (
        "c++",
        "cpp",
        "extern \"C\" void elsewhere() { throw 1; }\n",
        "crashed: signal 6",
    ),
    (
        "gfortran",
        "f90",
        "subroutine elsewhere() bind(c)\nstop\nend subroutine\n",
        "ended its process: exit code 0",
    ),
];

fn assert_trouble(outcome: &Outcome, says: &[&str], what: &str) {
    let Outcome { code, stderr, .. } = outcome;
    assert_eq!(*code, Some(PLUGIN_TROUBLE), "{what}: {stderr}");
    for text in says {
        outcome.shows(text);
    }
}

/// Runs the case and looks at what is left: the first phase, whole.
fn run_ends_well(place: &Place, how: &str, says: &str) {
    place.write("case.toml", troubled::case(how));
    let outcome = place.run(&["run", "case.toml", "--out", "out"]);
    let at = "phase `push`, increment 1: law `troubled`, group `layer`, element";
    assert_trouble(&outcome, &[at, "point", says, "failure.toml"], how);
    let history = place.read("out/history.csv");
    assert_eq!(history.lines().count(), 3, "{how}: {history}");
    let summary = place.read("out/summary.json");
    assert!(summary.contains("\"plugin trouble\""), "{how}: {summary}");
    for file in ["failure.toml", "report.html"] {
        assert!(place.path("out").join(file).is_file(), "{how}: {file}");
    }
}

/// Runs the driver with its rows in a file and on the standard output, which must be the same.
fn point_ends_well(place: &Place, how: &str, says: &str) {
    place.write("driver.toml", troubled::driver(how));
    let to_file = place.run(&["point", "driver.toml", "--csv", "out.csv"]);
    let at = "segment 1, increment 3 of 4 (3 of the file): law `troubled`";
    assert_trouble(&to_file, &[at, says, "out.failure.toml"], how);
    let rows = place.read("out.csv");
    assert_eq!(rows.lines().count(), 4, "{how}: {rows}");
    let to_output = place.run(&["point", "driver.toml"]);
    assert_trouble(&to_output, &[at, says], how);
    assert_eq!(to_output.stdout, rows, "{how}");
}

#[test]
fn a_law_that_ends_the_process_is_trouble() {
    for (how, says) in WAYS {
        let place = or_skip!(troubled::place(""));
        run_ends_well(&place, how, says);
        point_ends_well(&place, how, says);
    }
}

#[test]
fn so_is_one_in_another_language() {
    for (compiler, ending, routine, says) in ELSEWHERE {
        let place = or_skip!(troubled::place_with(compiler, ending, routine));
        run_ends_well(&place, "elsewhere", says);
        point_ends_well(&place, "elsewhere", says);
    }
}

#[test]
fn so_is_one_that_does_it_as_it_is_given_its_parameters() {
    for how in ["EXIT", "QUIET_EXIT", "SEGFAULT"] {
        let define: &str = match how {
            "EXIT" => "TROUBLE_IN_CREATE=EXIT",
            "QUIET_EXIT" => "TROUBLE_IN_CREATE=QUIET_EXIT",
            _ => "TROUBLE_IN_CREATE=SEGFAULT",
        };
        let place = or_skip!(troubled::place(define));
        place.write("driver.toml", troubled::driver("cut"));
        place.write("case.toml", troubled::case("cut"));
        for arguments in [["point", "driver.toml"], ["run", "case.toml"]] {
            let outcome = place.run(&[&arguments[..], &["--no-probe"]].concat());
            assert_trouble(&outcome, &["law `troubled`", "process"], how);
            assert_eq!(outcome.stdout, "", "{how}");
        }
    }
}

/// The first process had handed out rows before it was ended; none is missing and none comes twice.
#[test]
fn rows_that_were_handed_out_come_once() {
    let place = or_skip!(troubled::place(""));
    let long = |how| {
        let driver = troubled::driver(how).replace("increments = 4", "increments = 4000");
        driver.replace("t = { jump = 2.0e-3 }", "t = { jump = 1.2e-3 }")
    };
    place.write(
        "good.toml",
        long("sleep").replace("limit = 1.0e-3", "limit = 1.0"),
    );
    let good = place.done(&["point", "good.toml"]);
    place.write("driver.toml", long("quiet_exit"));
    let outcome = place.run(&["point", "driver.toml"]);
    assert_trouble(&outcome, &["law `troubled`"], "quiet_exit");
    let n = outcome.stdout.lines().count();
    assert!(n > 3000, "{n} lines");
    assert!(good.stdout.starts_with(&outcome.stdout));
}

/// Both copies come back from the call; only one may go on.
#[test]
fn a_copy_of_the_process_writes_nothing() {
    let place = or_skip!(troubled::place(""));
    place.write("case.toml", troubled::case("fork"));
    let outcome = place.run(&["run", "case.toml", "--out", "out"]);
    let says = [
        "law `troubled`",
        "group `layer`, element",
        "increment 1",
        "(fork)",
    ];
    assert_trouble(&outcome, &says, "run");
    let history = place.read("out/history.csv");
    let mut rows: Vec<&str> = history.lines().collect();
    assert!(rows.len() >= 3, "{history}");
    rows.dedup();
    assert_eq!(rows.len(), history.lines().count(), "{history}");
    let summary = place.read("out/summary.json");
    assert!(summary.contains("\"plugin trouble\""), "{summary}");
    place.write("driver.toml", troubled::driver("fork"));
    let outcome = place.run(&["point", "driver.toml"]);
    assert_trouble(
        &outcome,
        &["law `troubled`", "increment 3", "(fork)"],
        "point",
    );
    let rows: Vec<&str> = outcome.stdout.lines().collect();
    assert!((4..=6).contains(&rows.len()), "{}", outcome.stdout);
}

#[test]
fn a_law_cannot_move_the_results() {
    let place = or_skip!(troubled::place("TROUBLE_IN_CREATE=FOLDER"));
    place.write(
        "case.toml",
        troubled::case("cut").replacen("1.0e-6", "1.0", 1),
    );
    let outcome = place.done(&["run", "case.toml", "--out", "out", "--no-probe"]);
    outcome.shows("working folder");
    assert!(place.path("out/history.csv").is_file());
    assert!(!place.path("elsewhere/out").exists());
    // And in the course of the run, where a driver's figures and rows are to come.
    let place = or_skip!(troubled::place(""));
    place.write("driver.toml", troubled::driver("folder"));
    place.done(&["point", "driver.toml", "--csv", "out.csv"]);
    let rows = place.read("out.csv");
    assert_eq!(rows.lines().count(), 6, "{rows}");
}

#[test]
fn limits_and_locale_are_the_programs() {
    let place = or_skip!(troubled::place("TROUBLE_IN_CREATE=LIMITS"));
    place.write("case.toml", troubled::case("locale"));
    let outcome = place.done(&["run", "case.toml", "--out", "out", "--no-probe"]);
    outcome.shows("limit of file sizes");
    let plain = or_skip!(troubled::place(""));
    plain.write(
        "case.toml",
        troubled::case("locale").replacen("1.0e-6", "1.0", 1),
    );
    plain.done(&["run", "case.toml", "--out", "out"]);
    let [a, b] = [&place, &plain].map(|p| std::fs::read(p.path("out/history.csv")).unwrap());
    assert_eq!(a, b);
}

/// A file that the law opens gets the number of one of the results.
#[test]
fn closed_files_are_not_mistaken_for_others() {
    let place = or_skip!(troubled::place(""));
    place.write("case.toml", troubled::case("descriptors"));
    let outcome = place.run(&["run", "case.toml", "--out", "out"]);
    assert_ne!(outcome.code, Some(DONE), "{}", outcome.stderr);
    outcome.shows("a law has closed it");
    let taken = std::fs::metadata(place.path("taken")).unwrap();
    assert_eq!(taken.len(), 0);
    let history = place.read("out/history.csv");
    assert_eq!(history.lines().count(), 3, "{history}");
    place.write("driver.toml", troubled::driver("descriptors"));
    let outcome = place.run(&["point", "driver.toml", "--csv", "out.csv"]);
    assert_ne!(outcome.code, Some(DONE), "{}", outcome.stderr);
    let taken = std::fs::metadata(place.path("taken")).unwrap();
    assert_eq!(taken.len(), 0);
}

/// What ended one variant says nothing of the next one.
#[test]
fn variants_after_it_are_computed() {
    let place = or_skip!(troubled::place(""));
    let variants = ["cut", "segfault", "locale"].map(|how| {
        format!("[[variant]]\nname = \"{how}\"\n[variant.laws.joint]\nparameters = {{ how = \"{how}\" }}\n")
    });
    let text = troubled::case("cut").replacen("limit = 1.0e-6", "limit = 1.0", 1);
    // The second one alone goes beyond its limit.
    let variants = variants.concat().replacen(
        "how = \"segfault\" }",
        "how = \"segfault\", limit = 1.0e-6 }",
        1,
    );
    place.write("case.toml", format!("{text}\n{variants}"));
    let outcome = place.run(&["run", "case.toml", "--out", "out"]);
    assert_trouble(
        &outcome,
        &["law `troubled`", "crashed: signal 11"],
        "variants",
    );
    for (variant, status) in [
        ("cut", "done"),
        ("segfault", "plugin trouble"),
        ("locale", "done"),
    ] {
        let summary = place.path("out").join(variant).join("summary.json");
        let summary = std::fs::read_to_string(summary).unwrap();
        let status = format!("\"status\": \"{status}\"");
        assert!(summary.contains(&status), "{variant}: {summary}");
    }
}

/// A driver that came through a pipe cannot be followed once more: every row is written at once.
#[test]
fn rows_of_a_driver_from_a_pipe_are_kept() {
    let place = or_skip!(troubled::place(""));
    place.write("driver.toml", troubled::driver("exit"));
    let pipe = "mkfifo pipe; cat driver.toml > pipe & :";
    let outcome = place.run_limited(pipe, &["point", "pipe", "--csv", "out.csv"]);
    assert_trouble(&outcome, &["law `troubled`", "ended itself"], "pipe");
    let rows = place.read("out.csv");
    assert_eq!(rows.lines().count(), 4, "{rows}");
}
