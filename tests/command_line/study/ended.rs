//! Studies whose processes are killed, stopped or started twice.

use super::{column, table};
use crate::program::{DONE, Place, edited};
use std::collections::BTreeMap;
use std::os::unix::process::CommandExt;
use std::process::Stdio;
use std::time::{Duration, Instant};

/// The runs of a study that takes some seconds.
const SLOW: &str = r#"case = "case.toml"
method = "latin_hypercube"
runs = 12
seed = 5

[[parameter]]
name = "cohesion"
key = "laws.joint.parameters.cohesion"
uniform = [2.0, 10.0]

[[parameter]]
name = "friction"
key = "laws.joint.parameters.friction_angle"
normal = { mean = 30.0, deviation = 3.0, min = 20.0, max = 40.0 }
"#;

fn slow() -> Place {
    let place = Place::new();
    let text = edited(&[
        "increments = 2 => increments = 60",
        "increments = 2\ndis => increments = 60\ndis",
        "x = 1e-5 => x = 1e-3",
    ]);
    place.write("case.toml", text);
    place.write("study.toml", SLOW);
    place
}

const ARGUMENTS: [&str; 8] = [
    "study",
    "study.toml",
    "--out",
    "out",
    "--jobs",
    "2",
    "--checkpoint",
    "0",
];

/// States of the runs by their folders.
fn states(place: &Place) -> BTreeMap<String, usize> {
    let mut states = BTreeMap::new();
    if place.path("out/runs.csv").exists() {
        for status in column(&table(place), "status") {
            *states.entry(status.to_owned()).or_default() += 1;
        }
    }
    states
}

/// Descendants of a process, itself the first.
fn family(pid: u32) -> Vec<u32> {
    let mut found = vec![pid];
    let mut at = 0;
    while let Some(pid) = found.get(at) {
        if let Ok(tasks) = std::fs::read_dir(format!("/proc/{pid}/task")) {
            for task in tasks.flatten() {
                let children = std::fs::read_to_string(task.path().join("children"));
                let children = children.unwrap_or_default();
                found.extend(
                    children
                        .split_whitespace()
                        .filter_map(|pid| pid.parse::<u32>().ok()),
                );
            }
        }
        at += 1;
    }
    found
}

/// Any process may be killed at any time: nothing is lost, and nothing computed twice with another
/// result.
#[test]
fn kills_lose_nothing() {
    let undisturbed = slow();
    let started = Instant::now();
    undisturbed.run(&ARGUMENTS).ended(DONE);
    let length = started.elapsed().as_secs_f64();
    let expected = table(&undisturbed);
    assert_eq!(column(&expected, "status"), ["done"; 12]);

    let place = slow();
    let mut on_the_way = 0;
    for kill in 0..24_u32 {
        let share = f64::from(kill.wrapping_mul(2_654_435_769)) / f64::from(u32::MAX);
        let mut child = place.start(&ARGUMENTS);
        std::thread::sleep(Duration::from_secs_f64(0.5 * share * length));
        // The first one of the family, or any other of it.
        let family = family(child.id());
        let victim = family[if kill % 3 == 0 {
            0
        } else {
            kill as usize % family.len()
        }];
        tests::needs::signal("KILL", &victim.to_string());
        if victim == child.id() {
            child.wait().unwrap();
        } else {
            // What is left of the family goes on; then that is ended, too.
            std::thread::sleep(Duration::from_secs_f64(0.1 * length));
            child.kill().unwrap();
            child.wait().unwrap();
        }
        let states = states(&place);
        assert!(
            states.keys().all(|state| !state.contains("trouble")),
            "{states:?}"
        );
        let n_done = states.get("done").copied().unwrap_or(0);
        on_the_way += usize::from((1..12).contains(&n_done));
        if n_done == 12 {
            wait_for_locks(&place);
            std::fs::remove_dir_all(place.path("out")).unwrap();
        }
    }
    assert!(
        on_the_way >= 6,
        "only {on_the_way} kills hit the study on its way"
    );
    wait_for_locks(&place);
    place.run(&ARGUMENTS).ended(DONE);
    assert_eq!(table(&place), expected);
}

/// Processes whose ancestors were killed may take a moment to follow them.
fn wait_for_locks(place: &Place) {
    let since = Instant::now();
    while states(place).contains_key("running") {
        assert!(since.elapsed() < Duration::from_secs(10));
        std::thread::sleep(Duration::from_millis(20));
    }
    if let Ok(lock) = std::fs::File::open(place.path("out/.lock")) {
        lock.lock().unwrap();
    }
}

#[test]
fn ctrl_c_stops_a_study_and_the_same_command_goes_on() {
    let undisturbed = slow();
    undisturbed.run(&ARGUMENTS).ended(DONE);
    let expected = table(&undisturbed);

    let place = slow();
    let said = std::fs::File::create(place.path("said")).unwrap();
    let mut command = place.command(&ARGUMENTS);
    let mut child = command
        .process_group(0)
        .stdout(Stdio::null())
        .stderr(said)
        .spawn()
        .unwrap();
    let since = Instant::now();
    let text = || place.read("said");
    while !text().contains("run ") {
        assert!(since.elapsed() < Duration::from_mins(1), "{}", text());
        std::thread::sleep(Duration::from_millis(5));
    }
    // As a terminal does: to the whole group.
    let group = format!("-{}", child.id());
    assert!(tests::needs::signal("INT", &group));
    let code = child.wait().unwrap().code();
    assert_eq!(code, Some(130), "{}", text());
    assert!(text().contains("have come to an end"), "{}", text());
    let states = states(&place);
    assert!(
        !states.contains_key("running") && !states.contains_key("lost"),
        "{states:?}"
    );
    assert!(states.get("done").copied().unwrap_or(0) < 12, "{states:?}");
    place.run(&ARGUMENTS).ended(DONE);
    assert_eq!(table(&place), expected);
}

#[test]
fn two_processes_do_not_carry_out_one_study() {
    let place = slow();
    let mut first = place.start(&ARGUMENTS);
    let since = Instant::now();
    while !place.path("out/runs.csv").exists() {
        assert!(since.elapsed() < Duration::from_mins(1));
        std::thread::sleep(Duration::from_millis(5));
    }
    let second = place.refused(&ARGUMENTS);
    second.shows("another process carries out this study");
    assert!(first.wait().unwrap().success());
    assert_eq!(states(&place), BTreeMap::from([("done".to_owned(), 12)]));
}
