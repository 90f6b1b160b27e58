//! What is printed and written, by runs that end well and by others.

use crate::program::{BAD_INPUT, CASE, DONE, NO_EQUILIBRIUM, Place, edited};
use crate::program::{Edit, JOINT};
use tests::case::table;

/// The upper half slides on the joint: without friction 10 kPa over 2 m resist, and a pressure
/// acts on 0.5 m, so 40 of its 100 kPa can be carried.
fn sliding() -> String {
    let slide: [Edit; 5] = [
        ("friction_angle = 30.0", "friction_angle = 0.0"),
        ("dilatancy_angle = 5.0", "dilatancy_angle = 0.0"),
        (
            "[mesh.lines]",
            "[mesh.lines]\nside = { x = 2.0, y = [0.5, 1.0] }",
        ),
        (
            "displacement = [{ line = \"top\", x = 1e-5 }]",
            "pressure = [{ line = \"side\", value = 100.0 }]",
        ),
        (
            "name = \"push\"\nincrements = 2",
            "name = \"push\"\nincrements = 20",
        ),
    ];
    edited(&[JOINT, &slide].concat())
}

#[test]
fn prints_plain_lines_of_progress_and_one_line_of_result() {
    let place = Place::new();
    let outcome = place.run_case(CASE);
    assert_eq!(outcome.code, Some(DONE), "{}", outcome.stderr);
    assert_eq!(outcome.stdout, "results in out\n");
    assert!(
        !outcome.stderr.contains(['\r', '\u{1b}']),
        "{:?}",
        outcome.stderr
    );
    let lines: Vec<&str> = outcome.stderr.lines().collect();
    let starts = [
        "phase weight: 2 increments",
        "phase weight: increment 1/2, ",
        "phase weight: increment 2/2, ",
        "phase push: 2 increments",
        "phase push: increment 1/2, ",
        "phase push: increment 2/2, ",
    ];
    assert_eq!(lines.len(), starts.len(), "{lines:?}");
    for (line, start) in lines.iter().zip(starts) {
        assert!(line.starts_with(start), "{line:?}, expected {start:?}");
    }
}

#[test]
fn warns_of_unusual_parameters_and_goes_on() {
    let outcome = Place::new().run_case(CASE.replace("1e4", "2e9"));
    assert_eq!(outcome.code, Some(DONE), "{}", outcome.stderr);
    assert!(
        outcome.says(
            "warning: law `elastic`: young_modulus = 2000000000 kPa is outside its usual range"
        ),
        "{}",
        outcome.stderr
    );
    assert_eq!(outcome.stdout, "results in out\n");
}

#[test]
fn keeps_what_was_reached_when_there_is_no_equilibrium() {
    let place = Place::new();
    let outcome = place.run_case(sliding());
    assert_eq!(outcome.code, Some(NO_EQUILIBRIUM), "{}", outcome.stderr);
    assert_eq!(outcome.stdout, "");
    assert!(outcome.says("phase `push`"), "{}", outcome.stderr);
    assert!(outcome.says("no equilibrium"), "{}", outcome.stderr);
    // 40 of 100 kPa are 8 of 20 increments; the last one of them is the limit itself.
    let rows = table(&place.path("out/history.csv"));
    let pushed = rows.iter().filter(|row| row["phase"] == "push").count();
    assert!((7..=8).contains(&pushed), "{pushed} increments");
    let summary = std::fs::read_to_string(place.path("out/summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
    assert_ne!(summary["status"], "done");
}

#[test]
fn leaves_earlier_results_alone_when_the_input_is_bad() {
    let place = Place::new();
    assert_eq!(place.run_case(CASE).code, Some(DONE));
    let read = || std::fs::read_to_string(place.path("out/history.csv")).unwrap();
    let before = read();
    let outcome = place.run_case(CASE.replace("\"traction_t\"", "\"traction_s\""));
    assert_eq!(outcome.code, Some(BAD_INPUT));
    assert_eq!(read(), before);
}
