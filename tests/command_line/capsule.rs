//! The file that a failed call of a law leaves behind, and its repetition.

use crate::program::{NO_EQUILIBRIUM, PLUGIN_TROUBLE, Place};
use crate::troubled;
use tests::or_skip;
use tests::words::edited;
use tests::words::rows_of;

/// A folder in which a driver has failed.
fn failed(how: &str, arguments: &[&str], code: i32) -> Option<Place> {
    let place = troubled::place("")?;
    place.write("driver.toml", troubled::driver(how));
    let point = ["point", "driver.toml", "--csv", "out.csv"];
    let outcome = place.run(&[&point, arguments].concat()).ended(code);
    outcome.shows("pilum replay out.failure.toml");
    Some(place)
}

#[test]
fn a_failed_driver_leaves_its_call() {
    let place = or_skip!(failed("cut", &[], NO_EQUILIBRIUM));
    let text = place.read("out.failure.toml");
    let capsule: toml::Table = toml::from_str(&text).unwrap();
    assert_eq!(capsule["law"]["id"].as_str(), Some("troubled"));
    assert_eq!(capsule["law"]["version"].as_str(), Some("1.0"));
    assert_eq!(capsule["parameters"]["limit"].as_float(), Some(1e-3));
    assert_eq!(capsule["parameters"]["how"].as_float(), Some(0.0));
    assert_eq!(capsule["outcome"]["status"].as_str(), Some("cut step"));
    let start = &capsule["start"];
    let jump = start["jump"]["t"].as_float().unwrap();
    // The law is followed up to its limit, where the state lies on the elastic line.
    assert!(jump <= 1e-3 && jump > 1e-3 - 1e-9, "{jump}");
    assert_eq!(start["traction"]["n"].as_float(), Some(-100.0));
    assert!((start["traction"]["t"].as_float().unwrap() - 0.25e6 * jump).abs() < 1e-9);
    assert!((start["internal"]["path"].as_float().unwrap() - jump).abs() < 1e-15);
    assert!(capsule["end"]["jump"]["t"].as_float().unwrap() > 1e-3);
    let place_of_failure = capsule["where"]["place"].as_str().unwrap();
    assert!(place_of_failure.starts_with("segment 1, increment 3 of 4"));

    // A later run without failure takes it away.
    place.write(
        "driver.toml",
        troubled::driver("cut").replace("limit = 1.0e-3", "limit = 1.0"),
    );
    place.done(&["point", "driver.toml", "--csv", "out.csv"]);
    assert!(!place.path("out.failure.toml").exists());
}

#[test]
fn a_replay_repeats_the_call_and_finds_the_limit() {
    let place = or_skip!(failed("cut", &[], NO_EQUILIBRIUM));
    // A longer increment, of which half succeeds.
    let text = place.read("out.failure.toml");
    let mut capsule: toml::Table = toml::from_str(&text).unwrap();
    let zero: toml::Table = toml::from_str("n = 0.0\nt = 0.0").unwrap();
    let end: toml::Table = toml::from_str("n = 0.0\nt = 2e-3").unwrap();
    capsule["start"]["jump"] = zero.into();
    capsule["end"]["jump"] = end.into();
    place.write("half.toml", toml::to_string(&capsule).unwrap());
    for arguments in [
        &["replay", "half.toml"][..],
        &["replay", "half.toml", "--in-process"],
    ] {
        let outcome = place.run(arguments).ended(NO_EQUILIBRIUM);
        outcome
            .prints("as recorded: `cut step`")
            .prints("the limit is exceeded")
            .prints("a fraction 0.500000000000 of the increment succeeds")
            .prints("tangent at that fraction of the increment: at most");
    }
    // With another limit the call succeeds, with the values of the elastic line.
    let text = place.read("half.toml");
    place.write("free.toml", text.replace("limit = 0.001", "limit = 1.0"));
    let outcome = place.done(&["replay", "free.toml"]);
    outcome.prints("the call succeeds; it is recorded as `cut step`");
    let line = outcome
        .stdout
        .lines()
        .find(|line| line.contains("traction_n"));
    assert_eq!(line.unwrap().split_whitespace().nth(1), Some("-100.0"));
}

#[test]
fn a_replay_outlives_a_crash() {
    let place = or_skip!(failed("segfault", &["--isolate"], PLUGIN_TROUBLE));
    let outcome = place
        .run(&["replay", "out.failure.toml"])
        .ended(PLUGIN_TROUBLE);
    outcome.prints("as recorded: `internal`: the law crashed: signal 11");
}

#[test]
fn a_failed_run_leaves_its_call() {
    let place = or_skip!(troubled::place(""));
    let outcome = place
        .run_case(troubled::case("domain"))
        .ended(NO_EQUILIBRIUM);
    outcome.shows("pilum replay out/failure.toml");
    let text = place.read("out/failure.toml");
    let capsule: toml::Table = toml::from_str(&text).unwrap();
    let origin = &capsule["where"];
    assert_eq!(origin["phase"].as_str(), Some("push"));
    assert_eq!(origin["increment"].as_integer(), Some(1));
    assert_eq!(origin["group"].as_str(), Some("layer"));
    assert!(
        origin["element"]
            .as_integer()
            .is_some_and(|n| (1..=2).contains(&n))
    );
    assert!(
        origin["point"]
            .as_integer()
            .is_some_and(|n| (1..=9).contains(&n))
    );
    let outcome = place
        .run(&["replay", "out/failure.toml"])
        .ended(NO_EQUILIBRIUM);
    outcome.prints("as recorded: `domain`");
    outcome.prints("group layer, element");
}

#[test]
fn refuses_what_is_no_capsule() {
    let place = Place::new();
    for (text, says) in [("", "missing"), ("version = 1\nlaw = 2\n", "2")] {
        place.write("failure.toml", text);
        let outcome = place.refused(&["replay", "failure.toml"]);
        outcome.shows(says);
    }
    place.refused(&["replay", "missing.toml"]);
}

#[test]
fn what_is_wrong_with_a_capsule_is_marked_in_it() {
    let good = include_str!("../fuzz/corpus/capsule/joint");
    for [edit, at, says] in rows_of(
        "
version = 1\\n => version = 2\\n | 1:11 | of version 2
interface_2d => interface_2e | 6:14 | `interface_2d`?
fluxes and => fluxes und | 27:11 | there is no request
friction_angle => friction_angel | 22:18 | `friction_angle`?
cohesion = 10.0\\n => \\n | 18:2 | `cohesion` is missing
gap = 0.0 => cap = 0.0 | 34: | `gap`?
t = 1e-3 => s = 1e-3 | 37:23 | has no jump `s`
",
    ) {
        let place = Place::new();
        place.write("failure.toml", edited(good, &[edit]));
        let outcome = place.refused(&["replay", "failure.toml"]);
        for text in [at, says] {
            outcome.shows(text);
        }
    }
}
