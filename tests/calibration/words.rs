//! Parameters that tests do not determine are reported in words.
#![expect(clippy::unwrap_used, reason = "part of the tests")]

use crate::{computed, does_not_say, run, says, write_points};
use runs::calibration::Outcome;
use std::fs;
use tempfile::TempDir;
use tests::tolerance::near;

/// A Coulomb joint at constant normal stress: τ = c + σ_n tan φ after the elastic stage.
const JOINT: &str = "law = \"coulomb_joint\"\nhypothesis = \"interface_2d\"\n[parameters]\nnormal_stiffness = 1e6\n\
    shear_stiffness = 1e5\ncohesion = 5.0\nfriction_angle = 30.0\ndilatancy_angle = 0.0\n[initial]\n\
    traction = { n = -100.0 }\n[[segment]]\nincrements = 40\ncontrol = { t = { jump = 2e-3 } }\n";

/// Fits parameters of the joint to its own curve, disturbed a little.
fn fit(free: &str, more: &str) -> Outcome {
    let place = TempDir::new().unwrap();
    fs::write(place.path().join("driver.toml"), JOINT).unwrap();
    let x: Vec<f64> = (1..=24).map(|k| 0.083 * f64::from(k)).collect();
    let y = computed(JOINT, ["u_t", "traction_t"], &x);
    let disturbed = y
        .iter()
        .enumerate()
        .map(|(i, y)| y + if i % 2 == 0 { 0.3 } else { -0.3 });
    let points: Vec<(f64, f64)> = x.iter().copied().zip(disturbed).collect();
    write_points(place.path(), "box.csv", &points);
    let text = format!(
        "{more}\nstarts = 2\n[free]\n{free}\n[[test]]\nname = \"box\"\ndriver = \"driver.toml\"\n[[test.curve]]\nx = \"u_t\"\n\
         y = \"traction_t\"\nnoise = 0.5\nmeasured = {{ file = \"box.csv\", x = \"x\", y = \"y\" }}\n"
    );
    let file = place.path().join("calibration.toml");
    fs::write(&file, text).unwrap();
    run(&file, &[]).unwrap()
}

#[test]
fn what_nothing_answers_to_is_named_with_the_reason() {
    let outcome = fit("shear_stiffness = {}\nnormal_stiffness = {}", "");
    says(
        &outcome,
        "`normal_stiffness` cannot be identified | in the only test `traction_n` stays constant",
    );
    assert_eq!(outcome.interval(1), None);
    // The other is found all the same.
    near(outcome.values[0] / 1e5, 1.0, 0.02);
    assert!(outcome.interval(0).is_some());
}

#[test]
fn what_moves_only_what_was_not_measured_is_said_to() {
    let outcome = fit(
        "shear_stiffness = {}\ndilatancy_angle = { start = 5.0 }",
        "",
    );
    says(
        &outcome,
        "`dilatancy_angle` cannot be identified | it moves | jump_n | measure",
    );
}

#[test]
fn what_only_counts_together_is_said_to() {
    // At one normal stress cohesion and friction are one strength.
    let outcome = fit("cohesion = {}\nfriction_angle = {}", "");
    says(
        &outcome,
        "`cohesion` and `friction_angle` cannot be told apart",
    );
    assert_eq!(outcome.linear_interval(0), None);
}

#[test]
fn a_bound_in_the_way_is_said() {
    let outcome = fit("friction_angle = { start = 20.0, max = 25.0 }", "");
    says(&outcome, "`friction_angle` ends on its greatest value, 25");
    assert_eq!(outcome.interval(0), None);
}

#[test]
fn noise_that_is_none_is_said() {
    let outcome = fit(
        "shear_stiffness = {}\nfriction_angle = {}",
        "variance = \"given\"",
    );
    does_not_say(&outcome, "times the noise");
    // A law that cannot follow: the strength is held too low.
    let outcome = fit(
        "shear_stiffness = {}",
        "variance = \"given\"\nfixed.friction_angle = { value = 20.0 }",
    );
    says(&outcome, "times the noise that is given");
    says(&outcome, "residuals follow each other");
}
