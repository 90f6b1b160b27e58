//! Requests to stop, whatever a law does: exit code 130 within a bound, and nothing is lost.
#![cfg(target_os = "linux")]
#![expect(clippy::unwrap_used, clippy::panic, reason = "part of the tests")]

use crate::program::{CASE, JOINT, Place, edited};
use crate::troubled;
use std::os::unix::process::CommandExt;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};
use tests::or_skip;
use tests::words::has;

/// What a shell says of a program that was stopped.
const STOPPED: i32 = 130;
/// A request is answered within one iteration or 2 s; the rest is for a busy machine.
const BOUND: Duration = Duration::from_secs(8);

/// Starts the program in its own group, as a shell does, with its messages in a file.
fn start(place: &Place, arguments: &[&str]) -> Child {
    let said = std::fs::File::create(place.path("said")).unwrap();
    let mut command = place.command(arguments);
    command.process_group(0).stdout(Stdio::null()).stderr(said);
    command.spawn().unwrap()
}

fn said(place: &Place) -> String {
    place.read("said")
}

/// Waits until the program has said this.
fn wait_for(place: &Place, text: &str) {
    let since = Instant::now();
    while !said(place).contains(text) {
        assert!(since.elapsed() < Duration::from_mins(1), "{}", said(place));
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// Sends a signal to a process, or with `-` before its number to its group.
fn send(signal: &str, to: &str) {
    assert!(tests::needs::signal(signal, to), "{signal} to {to}");
}

/// The exit code, which must come in time.
fn code(child: &mut Child, place: &Place) -> Option<i32> {
    let since = Instant::now();
    loop {
        if let Some(status) = child.try_wait().unwrap() {
            return status.code();
        }
        if since.elapsed() > BOUND {
            child.kill().unwrap();
            panic!("still there after {BOUND:?}: {}", said(place));
        }
        std::thread::sleep(Duration::from_millis(10));
    }
}

/// Every point takes 20 ms in the second phase, which is 1000 increments long.
fn slow_case() -> String {
    let text = troubled::case("sleep");
    let (first, second) = text.split_once("name = \"push\"").unwrap();
    let second = second.replacen("increments = 2", "increments = 1000", 1);
    format!("{first}name = \"push\"{second}")
}

#[test]
fn ctrl_c_to_the_whole_group_stops_a_run() {
    for isolate in [&[][..], &["--isolate"]] {
        let place = or_skip!(troubled::place(""));
        place.write("case.toml", slow_case());
        let arguments = [&["run", "case.toml", "--out", "out"], isolate].concat();
        let mut child = start(&place, &arguments);
        wait_for(&place, "phase push: increment 1/");
        send("INT", &format!("-{}", child.id()));
        assert_eq!(code(&mut child, &place), Some(STOPPED), "{}", said(&place));
        assert!(!said(&place).contains("crashed"), "{}", said(&place));
        assert_eq!(place.summary()["status"], "interrupted");
    }
}

/// The law takes the signals for itself; they are the program's all the same.
#[test]
fn stolen_signals_stop_a_run() {
    for signal in ["INT", "TERM"] {
        let place = or_skip!(troubled::place("TROUBLE_IN_CREATE=SIGNALS"));
        place.write("case.toml", slow_case());
        let mut child = start(&place, &["run", "case.toml", "--out", "out", "--no-probe"]);
        wait_for(&place, "phase push: increment 1/");
        send(signal, &format!("-{}", child.id()));
        assert_eq!(code(&mut child, &place), Some(STOPPED), "{}", said(&place));
        assert_eq!(place.summary()["status"], "interrupted");
    }
}

#[test]
fn a_law_that_never_returns_is_stopped() {
    let place = or_skip!(troubled::place(""));
    place.write("case.toml", troubled::case("loop"));
    let mut child = start(&place, &["run", "case.toml", "--out", "out"]);
    wait_for(&place, "phase push");
    std::thread::sleep(Duration::from_millis(300));
    send("TERM", &child.id().to_string());
    assert_eq!(code(&mut child, &place), Some(STOPPED), "{}", said(&place));
    let text = said(&place);
    has(&text, "law `troubled`");
    has(&text, "layer");
    assert_eq!(place.summary()["status"], "interrupted");
    let history = place.read("out/history.csv");
    assert_eq!(history.lines().count(), 3, "{history}");

    place.write("driver.toml", troubled::driver("loop"));
    let mut child = start(&place, &["point", "driver.toml", "--csv", "out.csv"]);
    std::thread::sleep(Duration::from_millis(500));
    send("INT", &child.id().to_string());
    std::thread::sleep(Duration::from_millis(200));
    let again = Instant::now();
    send("INT", &child.id().to_string());
    assert_eq!(code(&mut child, &place), Some(STOPPED), "{}", said(&place));
    assert!(
        again.elapsed() < Duration::from_secs(2),
        "the second request waits"
    );
}

/// A tangent that is wrong by a factor of 10⁵ takes hundreds of thousands of iterations and many cut-backs.
#[test]
fn a_hopeless_increment_is_stopped_within_it() {
    let place = or_skip!(troubled::place("SHEAR_TANGENT=1.0e5"));
    let edits = [
        r#"max_iterations = 20 => max_iterations = 10000\nmethod = "newton"\ntangents = "law""#,
        "limit = 1.0e-6 => limit = 1.0",
    ];
    let edits = [JOINT, &edits].concat();
    let text = tests::words::edited(&troubled::case("cut"), &edits);
    place.write("case.toml", text);
    let mut child = start(&place, &["run", "case.toml", "--out", "out"]);
    wait_for(&place, "phase weight");
    send("TERM", &child.id().to_string());
    assert_eq!(code(&mut child, &place), Some(STOPPED), "{}", said(&place));
    let text = said(&place);
    assert!(text.contains("within the increment"), "{text}");
    let summary = place.summary();
    assert_eq!(summary["status"], "interrupted");
    assert_eq!(summary["stopped_at"]["phase"], "weight");
}

#[test]
fn studies_say_how_far_they_are_and_stop() {
    let place = Place::new();
    let accurate = edited(&[
        "title => accuracy = 1e-6\ntitle",
        "n = 2, to = 1.0 => n = 60, to = 1.0",
        "x = 1e-5 => x = 1e-3",
    ]);
    place.write("accurate.toml", accurate);
    place.write("case.toml", CASE);
    let commands = [
        ("run", "accurate.toml", "run 3"),
        ("trade-off", "case.toml", "left)"),
    ];
    for (command, file, until) in commands {
        let mut child = start(&place, &[command, file, "--out", "out"]);
        wait_for(&place, until);
        send("INT", &format!("-{}", child.id()));
        assert_eq!(code(&mut child, &place), Some(STOPPED), "{}", said(&place));
        let text = said(&place);
        has(&text, "left");
        has(&text, "stopped as asked");
        assert!(!place.path("out/.trial").exists(), "{command}");
    }
}

/// A study that is stopped has a table of the settings that are done, and goes on from there.
#[test]
fn a_stopped_study_has_its_rows_and_goes_on() {
    let place = Place::new();
    place.write("case.toml", edited(crate::trade_off::HARDENING));
    let arguments = ["trade-off", "case.toml", "--out", "out"];
    let stop_after = |arguments: &[&str], until: &str| {
        let mut child = start(&place, arguments);
        wait_for(&place, until);
        send("INT", &format!("-{}", child.id()));
        assert_eq!(code(&mut child, &place), Some(STOPPED), "{}", said(&place));
        let rows = tests::case::table(&place.path("out/trade_off.csv"));
        let measured = rows.into_iter().map(|row| {
            let [setting, error, cost] =
                ["setting", "error", "cpu_seconds"].map(|c| row[c].clone());
            assert!(!error.is_empty() || !row["failure"].is_empty(), "{row:?}");
            (setting, error, cost)
        });
        measured.collect::<Vec<_>>()
    };
    let first = stop_after(&arguments, "increments × 4 (");
    let settings: Vec<&str> = first.iter().map(|(setting, ..)| setting.as_str()).collect();
    for done in ["as in the file", "the file's mesh", "increments × 0.25"] {
        assert!(settings.contains(&done), "{settings:?}");
    }
    has(said(&place), "--resume goes on from there");
    for file in ["trade_off.svg", "trade_off.html", "trials.jsonl"] {
        assert!(place.path("out").join(file).is_file(), "{file}");
    }
    let resumed = [&arguments[..], &["--resume"]].concat();
    // What was done is not done again: its costs are the same to the last digit.
    let second = stop_after(&resumed, "tolerance 1e-4");
    assert!(second.len() > first.len(), "{second:?}");
    for row in &first {
        assert!(second.contains(row), "{row:?} in {second:?}");
    }
    let other = [&resumed[..], &["--set", "solver.max_iterations=21"]].concat();
    let outcome = place.run(&other).ended(1);
    outcome.shows("it belongs to another case");
}

/// The study for an accuracy has a row for every run, and does not repeat them.
#[test]
fn a_stopped_search_for_an_accuracy_goes_on() {
    let place = Place::new();
    // A pile's loads stand for probes.
    place.write(
        "pile.toml",
        format!("accuracy = 0.2\n{}", crate::pile::PILE),
    );
    let mut child = start(&place, &["run", "pile.toml", "--out", "out"]);
    wait_for(&place, "accuracy: run 3");
    send("INT", &format!("-{}", child.id()));
    assert_eq!(code(&mut child, &place), Some(STOPPED), "{}", said(&place));
    let rows = || tests::case::table(&place.path("out/accuracy.csv"));
    let first = rows();
    assert!(first.len() >= 2, "{first:?}");
    place
        .run(&["run", "pile.toml", "--out", "out", "--resume"])
        .ended(0);
    let second = rows();
    assert!(second.len() > first.len(), "{second:?}");
    assert_eq!(second[..first.len()], first);
    assert_eq!(second[0]["setting"], "increments × 0.25");
    // Of three runs on there is an estimate.
    assert!(
        second[2]["error"].parse::<f64>().unwrap() > 0.0,
        "{second:?}"
    );
}

#[test]
fn a_child_does_not_outlive_the_program() {
    let place = or_skip!(troubled::place(""));
    place.write("case.toml", troubled::case("loop"));
    let mut child = start(&place, &["run", "case.toml", "--out", "out"]);
    wait_for(&place, "phase push");
    let children = format!("/proc/{0}/task/{0}/children", child.id());
    let children = std::fs::read_to_string(children).unwrap();
    let pids: Vec<&str> = children.split_whitespace().collect();
    assert!(!pids.is_empty());
    child.kill().unwrap();
    child.wait().unwrap();
    let is_gone = |pid: &&str| {
        let stat = std::fs::read_to_string(format!("/proc/{pid}/stat"));
        stat.is_err() || stat.is_ok_and(|stat| stat.contains(") Z "))
    };
    let gone = (0..200).any(|_| {
        std::thread::sleep(Duration::from_millis(10));
        pids.iter().all(is_gone)
    });
    assert!(gone, "{pids:?}");
}
