//! `--isolate`: a law that crashes, ends its process or never returns ends an increment, and not
//! the program.

use crate::program::{NO_EQUILIBRIUM, PLUGIN_TROUBLE, Place, edited};
use crate::troubled;
use tests::or_skip;

const WAYS: [(&str, &str); 4] = [
    ("segfault", "crashed: signal 11"),
    ("abort", "crashed: signal 6"),
    ("exit", "ended its process: exit code 0"),
    ("loop", "did not return within 0.5 s"),
];

#[test]
fn a_run_ends_with_what_had_converged() {
    for (how, says) in WAYS {
        let place = or_skip!(troubled::place(""));
        place.write("case.toml", troubled::case(how));
        let arguments = ["run", "case.toml", "--out", "out", "--isolate=0.5"];
        let outcome = place.run(&arguments).ended(PLUGIN_TROUBLE);
        for text in [
            "phase `push`, increment 1: law `troubled`, group `layer`, element",
            says,
            "failure.toml",
        ] {
            outcome.shows(text);
        }
        let history = place.read("out/history.csv");
        assert_eq!(history.lines().count(), 3, "{how}: {history}");
        let summary = place.read("out/summary.json");
        assert!(summary.contains("\"plugin trouble\""), "{how}: {summary}");
    }
}

/// Two workers would answer in turn, one increment late.
#[test]
#[cfg(target_os = "linux")]
fn a_copy_of_a_worker_does_not_answer_too() {
    let place = or_skip!(troubled::place(""));
    place.write("driver.toml", troubled::driver("fork"));
    let outcome = place
        .run(&["point", "driver.toml", "--csv", "out.csv", "--isolate"])
        .ended(PLUGIN_TROUBLE);
    outcome.shows("made a copy of its process");
    let rows = place.read("out.csv");
    assert_eq!(rows.lines().count(), 4, "{rows}");
}

#[test]
fn a_driver_ends_with_its_rows() {
    for (how, says) in WAYS {
        let place = or_skip!(troubled::place(""));
        place.write("driver.toml", troubled::driver(how));
        let outcome = place
            .run(&["point", "driver.toml", "--csv", "out.csv", "--isolate=0.5"])
            .ended(PLUGIN_TROUBLE);
        outcome.shows(says);
        outcome.shows("segment 1, increment 3 of 4");
        let rows = place.read("out.csv");
        assert_eq!(rows.lines().count(), 4, "{how}: {rows}");
    }
}

/// The layer has more points than one worker is given at a time.
#[test]
fn results_are_the_same_as_in_the_process() {
    let place = Place::new();
    place.write(
        "case.toml",
        edited(&["n = 2, to = 1.0 => n = 130, to = 1.0"]),
    );
    for (out, isolate) in [("here", ""), ("apart", "--isolate")] {
        let mut arguments = vec!["run", "case.toml", "--out", out];
        arguments.extend(Some(isolate).filter(|argument| !argument.is_empty()));
        place.done(&arguments);
    }
    for file in ["history.csv", "profile.csv"] {
        let read = |out| std::fs::read(place.path(&format!("{out}/{file}"))).unwrap();
        assert_eq!(read("here"), read("apart"), "{file}");
    }
}

#[test]
fn refusals_of_laws_are_those_of_the_process() {
    let place = or_skip!(troubled::place(""));
    place.write("driver.toml", troubled::driver("domain"));
    let outcome = place
        .run(&["point", "driver.toml", "--csv", "out.csv", "--isolate"])
        .ended(NO_EQUILIBRIUM);
    outcome.shows("the limit is exceeded");
}

#[test]
fn a_library_that_crashes_when_it_is_opened_is_refused() {
    let place = or_skip!(troubled::place("TROUBLE_AT_ENTRY"));
    place.write("driver.toml", troubled::driver("cut"));
    let outcome = place
        .run(&["point", "driver.toml", "--csv", "out.csv", "--isolate"])
        .ended(PLUGIN_TROUBLE);
    outcome
        .shows("crashed: signal 11")
        .shows("needed by driver.toml:1:7");
}
