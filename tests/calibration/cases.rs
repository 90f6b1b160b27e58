//! The calibrations in `cases/`.

use crate::{holds, number, run};
use tests::place::case;
use tests::tolerance::near;

/// The truth that `measure.py` computes the points with.
const MEPI: [(&str, f64); 5] = [
    ("k_t", 0.37e5),
    ("mu_p", 0.78),
    ("mu_c0", 0.67),
    ("a", 0.00045),
    ("c_0", 0.05),
];

#[test]
fn mepi_from_three_shear_boxes() {
    let outcome = run(&case("calibrate_mepi/calibration.toml"), &[]).unwrap();
    for (name, truth) in MEPI {
        assert!(
            holds(&outcome, name, truth),
            "{name}: {:?}",
            outcome.interval(number(&outcome, name))
        );
    }
    let stage = &outcome.stages[0];
    assert_eq!(stage.n_residuals, 168);
    // χ² with 163 degrees of freedom, within three of its standard deviations √(2/163).
    near(stage.variance, 1.0, 3.0 * (2.0_f64 / 163.0).sqrt());
    // The test that was not fitted is met as well as the others.
    let predicted = &outcome.tests[3];
    assert!(predicted.is_predicted);
    for fitted in &predicted.curves {
        assert!(
            fitted.relative < 1.4,
            "{}: {}",
            fitted.curve.y,
            fitted.relative
        );
        assert!(
            fitted.inside.unwrap() > 0.85,
            "{}: {:?}",
            fitted.curve.y,
            fitted.inside
        );
    }
}

#[test]
fn the_normal_stiffness_is_not_told_by_them() {
    let file = case("calibrate_mepi/unknown.toml");
    let outcome = run(&file, &["starts=1", "profiles=false"]).unwrap();
    let said = |word: &String| {
        word.contains("`k_n` cannot be identified")
            && word.contains("in all tests `traction_n` stays constant")
    };
    assert!(outcome.words.iter().any(said), "{:#?}", outcome.words);
    assert_eq!(outcome.interval(number(&outcome, "k_n")), None);
    for (name, truth) in MEPI {
        let found = outcome.values[number(&outcome, name)];
        assert!((found / truth - 1.0).abs() < 0.05, "{name}: {found}");
    }
}

#[test]
fn a_and_c_0_from_constant_stiffness() {
    let outcome = run(&case("calibrate_stiffness/calibration.toml"), &[]).unwrap();
    for (name, truth) in [("a", 0.00006), ("c_0", 0.05)] {
        assert!(
            holds(&outcome, name, truth),
            "{name}: {:?}",
            outcome.interval(number(&outcome, name))
        );
    }
    assert!(outcome.tests[2].is_predicted);
    assert!(outcome.tests[2].curves[0].relative < 1.4);
}

#[test]
fn the_shaft_of_a_pile_from_its_load_test() {
    let outcome = run(&case("calibrate_pile/calibration.toml"), &[]).unwrap();
    for (name, truth) in [
        ("friction_clay", 22.0),
        ("friction_sand", 27.0),
        ("shear_stiffness", 6e4),
    ] {
        assert!(
            holds(&outcome, name, truth),
            "{name}: {:?}",
            outcome.interval(number(&outcome, name))
        );
    }
    let block: toml::Table = outcome.block.parse().unwrap();
    let sand = &block["laws"]["skin_sand"]["parameters"];
    assert!((sand["friction_angle"].as_float().unwrap() - 27.0).abs() < 0.5);
}

/// Measured: the friction is that of the mean stresses, the contraction what the normal stress loses to the spring.
#[test]
fn friction_and_contraction_of_a_measured_interface() {
    let outcome = run(&case("measured_interface_praai/calibration.toml"), &[]).unwrap();
    let file = case("measured_interface_praai/final_shear.csv");
    let [slip, tau, sigma] = ["slip (mm)", "shear stress (kPa)", "normal stress (kPa)"]
        .map(|name| tests::case::column(&file, name));
    let sum = |values: &[f64]| values.iter().sum::<f64>();
    let friction = (sum(&tau) / sum(&sigma)).atan().to_degrees();
    let found = outcome.values[number(&outcome, "residual_friction_angle")];
    assert!((found - friction).abs() < 1.0, "{found}, {friction}");
    // Means of ten points at either end, as the plot scatters; 1000 kPa/mm.
    let ends = |values: &[f64]| sum(&values[..10]) - sum(&values[values.len() - 10..]);
    let contraction = (ends(&sigma) / -ends(&slip) / 1000.0).atan().to_degrees();
    let found = outcome.values[number(&outcome, "contraction_angle")];
    near(found / contraction, 1.0, 0.1);
}
