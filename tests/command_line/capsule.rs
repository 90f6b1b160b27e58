//! The file that a failed call of a law leaves behind, and its repetition.

use crate::program::{BAD_INPUT, DONE, NO_EQUILIBRIUM, PLUGIN_TROUBLE, Place};
use crate::troubled;

/// A folder in which a driver has failed.
fn failed(how: &str, arguments: &[&str], code: i32) -> Option<Place> {
    let place = troubled::place("")?;
    place.write("driver.toml", troubled::driver(how));
    let point = ["point", "driver.toml", "--csv", "out.csv"];
    let outcome = place.run(&[&point, arguments].concat());
    assert_eq!(outcome.code, Some(code), "{}", outcome.stderr);
    assert!(
        outcome.says("pilum replay out.failure.toml"),
        "{}",
        outcome.stderr
    );
    Some(place)
}

#[test]
fn a_failed_driver_leaves_its_call() {
    let Some(place) = failed("cut", &[], NO_EQUILIBRIUM) else {
        return;
    };
    let text = std::fs::read_to_string(place.path("out.failure.toml")).unwrap();
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
    let outcome = place.run(&["point", "driver.toml", "--csv", "out.csv"]);
    assert_eq!(outcome.code, Some(DONE), "{}", outcome.stderr);
    assert!(!place.path("out.failure.toml").exists());
}

#[test]
fn a_replay_repeats_the_call_and_finds_the_limit() {
    let Some(place) = failed("cut", &[], NO_EQUILIBRIUM) else {
        return;
    };
    // A longer increment, of which half succeeds.
    let text = std::fs::read_to_string(place.path("out.failure.toml")).unwrap();
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
        let outcome = place.run(arguments);
        assert_eq!(outcome.code, Some(NO_EQUILIBRIUM), "{}", outcome.stderr);
        for text in [
            "as recorded: `cut step`",
            "the limit is exceeded",
            "a fraction 0.500000000000 of the increment succeeds",
            "tangent at that fraction of the increment: at most",
        ] {
            assert!(
                outcome.stdout.contains(text),
                "{text:?}\n{}",
                outcome.stdout
            );
        }
    }
    // With another limit the call succeeds, with the values of the elastic line.
    let text = std::fs::read_to_string(place.path("half.toml")).unwrap();
    place.write("free.toml", text.replace("limit = 0.001", "limit = 1.0"));
    let outcome = place.run(&["replay", "free.toml"]);
    assert_eq!(
        outcome.code,
        Some(DONE),
        "{}\n{}",
        outcome.stdout,
        outcome.stderr
    );
    assert!(
        outcome
            .stdout
            .contains("the call succeeds; it is recorded as `cut step`")
    );
    let line = outcome
        .stdout
        .lines()
        .find(|line| line.contains("traction_n"));
    assert_eq!(line.unwrap().split_whitespace().nth(1), Some("-100.0"));
}

#[test]
fn a_replay_outlives_a_crash() {
    let Some(place) = failed("segfault", &["--isolate"], PLUGIN_TROUBLE) else {
        return;
    };
    let outcome = place.run(&["replay", "out.failure.toml"]);
    assert_eq!(outcome.code, Some(PLUGIN_TROUBLE), "{}", outcome.stderr);
    assert!(
        outcome
            .stdout
            .contains("as recorded: `internal`: the law crashed: signal 11"),
        "{}",
        outcome.stdout
    );
}

#[test]
fn a_failed_run_leaves_its_call() {
    let Some(place) = troubled::place("") else {
        return;
    };
    let outcome = place.run_case(troubled::case("domain"));
    assert_eq!(outcome.code, Some(NO_EQUILIBRIUM), "{}", outcome.stderr);
    assert!(
        outcome.says("pilum replay out/failure.toml"),
        "{}",
        outcome.stderr
    );
    let text = std::fs::read_to_string(place.path("out/failure.toml")).unwrap();
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
    let outcome = place.run(&["replay", "out/failure.toml"]);
    assert_eq!(outcome.code, Some(NO_EQUILIBRIUM), "{}", outcome.stderr);
    assert!(
        outcome.stdout.contains("as recorded: `domain`"),
        "{}",
        outcome.stdout
    );
    assert!(
        outcome.stdout.contains("group layer, element"),
        "{}",
        outcome.stdout
    );
}

#[test]
fn refuses_what_is_no_capsule() {
    let place = Place::new();
    for (text, says) in [("", "missing"), ("version = 1\nlaw = 2\n", "2")] {
        place.write("failure.toml", text);
        let outcome = place.run(&["replay", "failure.toml"]);
        assert_eq!(outcome.code, Some(BAD_INPUT), "{}", outcome.stderr);
        assert!(outcome.says(says), "{text:?}: {}", outcome.stderr);
    }
    assert_eq!(place.run(&["replay", "missing.toml"]).code, Some(BAD_INPUT));
}

#[test]
fn what_is_wrong_with_a_capsule_is_marked_in_it() {
    let good = include_str!("../fuzz/corpus/capsule/joint");
    for (from, to, says) in [
        (
            "version = 1\n",
            "version = 2\n",
            &["1:11", "of version 2"][..],
        ),
        ("interface_2d", "interface_2e", &["6:14", "`interface_2d`?"]),
        (
            "fluxes and",
            "fluxes und",
            &["27:11", "there is no request"],
        ),
        (
            "friction_angle",
            "friction_angel",
            &["22:18", "`friction_angle`?"],
        ),
        ("cohesion = 10.0\n", "", &["18:2", "`cohesion` is missing"]),
        ("gap = 0.0", "cap = 0.0", &["34:", "`gap`?"]),
        ("t = 1e-3", "s = 1e-3", &["37:23", "has no jump `s`"]),
    ] {
        assert!(good.contains(from), "{from:?}");
        let place = Place::new();
        place.write("failure.toml", good.replacen(from, to, 1));
        let outcome = place.run(&["replay", "failure.toml"]);
        assert_eq!(outcome.code, Some(BAD_INPUT), "{}", outcome.stderr);
        for text in says {
            assert!(outcome.says(text), "{to:?}, {text:?}: {}", outcome.stderr);
        }
    }
}
