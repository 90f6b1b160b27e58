//! Stages, held-out tests and fixed parameters.
#![expect(clippy::unwrap_used, reason = "part of the tests")]

use crate::{computed, number, run, says, write_points};
use std::fs;
use std::path::PathBuf;
use tempfile::TempDir;
use tests::tolerance::close;

/// A joint that is elastic up to its strength: stiffness from the start of the curve, friction from its end.
fn joint(stiffness: f64, friction: f64, stress: f64) -> String {
    format!(
        "law = \"coulomb_joint\"\nhypothesis = \"interface_2d\"\n[parameters]\nnormal_stiffness = 1e6\n\
         shear_stiffness = {stiffness:?}\ncohesion = 0.0\nfriction_angle = {friction:?}\ndilatancy_angle = 0.0\n\
         [initial]\ntraction = {{ n = {:?} }}\n[[segment]]\nincrements = 50\ncontrol = {{ t = {{ jump = 2e-3 }} }}\n",
        -stress
    )
}

const TRUTH: [f64; 2] = [8e4, 31.0];

fn place() -> (TempDir, PathBuf) {
    let place = TempDir::new().unwrap();
    let x: Vec<f64> = (1..=20).map(|k| 0.097 * f64::from(k)).collect();
    let mut tests = String::new();
    for (stress, predict) in [(100.0, false), (300.0, true)] {
        let driver = format!("driver_{stress}.toml");
        fs::write(place.path().join(&driver), joint(3e4, 20.0, stress)).unwrap();
        let y = computed(
            &joint(TRUTH[0], TRUTH[1], stress),
            ["u_t", "traction_t"],
            &x,
        );
        let points: Vec<(f64, f64)> = x.iter().copied().zip(y).collect();
        write_points(place.path(), &format!("{stress}.csv"), &points);
        // Up to 0.5 mm the joint is elastic.
        write_points(place.path(), &format!("{stress}_start.csv"), &points[..5]);
        tests += &format!(
            "[[test]]\nname = \"{stress}\"\ndriver = \"{driver}\"\npredict = {predict}\n[[test.curve]]\nx = \"u_t\"\n\
             y = \"traction_t\"\nnoise = 1.0\nmeasured = {{ file = \"{stress}.csv\", x = \"x\", y = \"y\" }}\n"
        );
    }
    tests += "[[test]]\nname = \"start\"\ndriver = \"driver_100.toml\"\n[[test.curve]]\nx = \"u_t\"\ny = \"traction_t\"\n\
              noise = 1.0\nmeasured = { file = \"100_start.csv\", x = \"x\", y = \"y\" }\n";
    let file = place.path().join("calibration.toml");
    let free = "[free]\nshear_stiffness = {}\nfriction_angle = {}\n";
    fs::write(&file, format!("starts = 3\n{free}{tests}")).unwrap();
    (place, file)
}

#[test]
fn stages_fit_their_own_parameters_to_their_own_tests() {
    let (place, file) = place();
    let staged = place.path().join("staged.toml");
    let stages = "base = \"calibration.toml\"\n[[stage]]\nname = \"elastic\"\nfree = [\"shear_stiffness\"]\n\
        tests = [\"start\"]\n[[stage]]\nname = \"strength\"\nfree = [\"friction_angle\"]\n";
    fs::write(&staged, stages).unwrap();
    for (file, n) in [(&file, 1), (&staged, 2)] {
        let outcome = run(file, &[]).unwrap();
        assert_eq!(outcome.stages.len(), n);
        for (name, truth) in ["shear_stiffness", "friction_angle"].into_iter().zip(TRUTH) {
            let found = outcome.values[number(&outcome, name)];
            close(format_args!("{n} stages, {name}"), found / truth, 1.0, 1e-5);
        }
    }
    let outcome = run(&staged, &[]).unwrap();
    assert_eq!(outcome.stages[0].group.tests, [2]);
    assert_eq!(outcome.stages[1].group.tests, [0, 2]);
    says(&outcome, "a last stage with all of them");
}

#[test]
fn a_test_that_is_predicted_has_no_part_in_the_fit() {
    let (place, file) = place();
    let before = run(&file, &[]).unwrap();
    assert!(before.tests[1].is_predicted && before.tests[1].curves[0].rms < 1e-3);
    // Other points there change what is said of it, and nothing else.
    write_points(place.path(), "300.csv", &[(0.5, 10.0), (1.5, 20.0)]);
    let after = run(&file, &[]).unwrap();
    assert_eq!(before.values, after.values);
    assert!(after.tests[1].curves[0].rms > 20.0);
    assert!(after.tests[1].curves[0].inside.unwrap() < 0.5);
}

#[test]
fn fixed_parameters_and_the_set_to_paste() {
    let (_place, file) = place();
    let outcome = run(&file, &["fixed.normal_stiffness={ value = 5e5 }"]).unwrap();
    let block: toml::Table = outcome.block.parse().unwrap();
    let value = |id: &str| block["parameters"][id].as_float().unwrap();
    assert!((value("normal_stiffness") - 5e5).abs() < 1e-9);
    assert!((value("shear_stiffness") / TRUTH[0] - 1.0).abs() < 1e-4);
    assert!((value("friction_angle") / TRUTH[1] - 1.0).abs() < 1e-4);
    // All that the law needs is there.
    assert_eq!(
        block["parameters"].as_table().unwrap().len(),
        5,
        "{}",
        outcome.block
    );
}

#[test]
fn the_same_seed_gives_the_same_answer() {
    let (_place, file) = place();
    let [a, b] = [(); 2].map(|()| run(&file, &["seed=5"]).unwrap());
    assert_eq!(a.values, b.values);
    assert_eq!(a.stages[0].landings[2].from, b.stages[0].landings[2].from);
    let other = run(&file, &["seed=6"]).unwrap();
    assert_ne!(
        a.stages[0].landings[2].from,
        other.stages[0].landings[2].from
    );
}
