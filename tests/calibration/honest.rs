//! Intervals say no more than the tests do: of predictions, of stages, of weights, of exact points, of profiles
//! that end early.
//!
//! Standard errors are those of closed forms: a joint is elastic, τ = k u, up to its strength, σ_n tan φ + c.
#![expect(clippy::unwrap_used, reason = "part of the tests")]

use crate::{computed, does_not_say, number, run, says, write_points};
use runs::calibration::{FittedCurve, Open, Outcome};
use std::fs;
use tempfile::TempDir;
use tests::tolerance::near;
use tests::words::has;

fn joint(stress: f64) -> String {
    format!(
        "law = \"coulomb_joint\"\nhypothesis = \"interface_2d\"\n[parameters]\nnormal_stiffness = 1e6\n\
         shear_stiffness = 1e5\ncohesion = 5.0\nfriction_angle = 30.0\ndilatancy_angle = 0.0\n[initial]\n\
         traction = {{ n = {:?} }}\n[[segment]]\nincrements = 40\ncontrol = {{ t = {{ jump = 2e-3 }} }}\n",
        -stress
    )
}

/// A folder with drivers at 100 and 200 kPa and their points, disturbed by ±`by`.
struct Boxes {
    place: TempDir,
    x: Vec<f64>,
}

impl Boxes {
    fn new(by: f64) -> Self {
        Self::scaled(by, 1.0)
    }

    /// Measured values times `scale`.
    fn scaled(by: f64, scale: f64) -> Self {
        let place = TempDir::new().unwrap();
        let x: Vec<f64> = (1..=24).map(|k| 0.083 * f64::from(k)).collect();
        for stress in [100.0, 200.0] {
            fs::write(place.path().join(format!("{stress}.toml")), joint(stress)).unwrap();
            let y = computed(&joint(stress), ["u_t", "traction_t"], &x);
            let errors = [by, -by];
            let disturbed = y
                .iter()
                .zip(errors.iter().cycle())
                .map(|(y, d)| scale * (y + d));
            let points: Vec<(f64, f64)> = x.iter().copied().zip(disturbed).collect();
            write_points(place.path(), &format!("{stress}.csv"), &points);
            // Up to 0.5 mm both are elastic.
            write_points(place.path(), &format!("{stress}_start.csv"), &points[..6]);
        }
        Self { place, x }
    }

    fn fit(&self, free: &str, tests: &[String], more: &str) -> Outcome {
        let file = self.place.path().join("calibration.toml");
        let text = format!("starts = 2\n{more}\n[free]\n{free}\n{}", tests.concat());
        fs::write(&file, text).unwrap();
        run(&file, &[]).unwrap()
    }
}

/// A test of a joint at a stress, with points of a file.
fn test(name: &str, stress: f64, points: &str, more: &str) -> String {
    format!(
        "[[test]]\nname = \"{name}\"\ndriver = \"{stress}.toml\"\n{more}\n[[test.curve]]\nx = \"u_t\"\n\
         y = \"traction_t\"\nnoise = 0.5\nmeasured = {{ file = \"{points}.csv\", x = \"x\", y = \"y\" }}\n"
    )
}

#[test]
fn a_prediction_by_what_is_not_determined_has_no_interval() {
    let boxes = Boxes::new(0.3);
    let tests = [
        test("fitted", 100.0, "100", ""),
        test("same", 100.0, "100", "predict = true"),
        test("other", 200.0, "200", "predict = true"),
    ];
    let free = "shear_stiffness = {}\ncohesion = {}\nfriction_angle = {}";
    let outcome = boxes.fit(free, &tests, "profiles = false");
    // At the stress that was tested the strength is known, whatever it is made of.
    let same = &outcome.tests[1].curves[0];
    assert!(
        same.deviations.iter().all(Option::is_some),
        "{:?}",
        same.deviations
    );
    assert!(same.inside.unwrap() > 0.99);
    // At another one it is not, but the elastic stage is.
    let other = &outcome.tests[2].curves[0];
    for ((x, y), deviation) in other.curve.points.iter().zip(&other.deviations) {
        let is_elastic = *x < 1.2;
        assert_eq!(deviation.is_some(), is_elastic, "{x} {y} {deviation:?}");
    }
    says(
        &outcome,
        "other, traction_t: 10 of 24 points have no interval | `cohesion` and `friction_angle`",
    );
    // With the second test fitted all is determined.
    let tests = [
        test("fitted", 100.0, "100", ""),
        test("second", 200.0, "200", ""),
        test("other", 200.0, "200", "predict = true"),
    ];
    let outcome = boxes.fit(free, &tests, "profiles = false");
    assert!(
        outcome.tests[2].curves[0]
            .deviations
            .iter()
            .all(Option::is_some)
    );
    does_not_say(&outcome, "have no interval");
}

#[test]
fn a_prediction_has_the_errors_of_all_stages() {
    let boxes = Boxes::new(0.3);
    let tests = [
        test("start", 100.0, "100_start", ""),
        test("whole", 100.0, "100", ""),
        test("other", 200.0, "200_start", "predict = true"),
        "[[stage]]\nname = \"elastic\"\nfree = [\"shear_stiffness\"]\ntests = [\"start\"]\n[[stage]]\n\
         name = \"strength\"\nfree = [\"friction_angle\"]\ntests = [\"whole\"]\n"
            .to_owned(),
    ];
    let free = "shear_stiffness = {}\nfriction_angle = {}";
    let outcome = boxes.fit(free, &tests, "variance = \"given\"\nprofiles = false");
    // τ = k u in mm and kPa: var k = σ²/Σ u², from the first stage alone; u var k u and the noise of a new value.
    let squares: f64 = boxes.x[..6].iter().map(|x| x * x).sum();
    let predicted = &outcome.tests[2].curves[0];
    assert_eq!(predicted.deviations.len(), 6);
    for ((x, _), deviation) in predicted.curve.points.iter().zip(&predicted.deviations) {
        let expected = 0.5 * (1.0 + x * x / squares).sqrt();
        near(deviation.unwrap() / expected, 1.0, 1e-4);
    }
}

/// Cohesion is fitted to one test and held in the other: its error is in the friction.
#[test]
fn a_parameter_that_stands_on_an_earlier_one_is_said_to() {
    let boxes = Boxes::new(0.3);
    let stages = "[[stage]]\nname = \"cohesion\"\nfree = [\"cohesion\"]\n[[stage]]\nname = \"friction\"\n\
        free = [\"friction_angle\"]\ntests = [\"second\"]\n";
    let tests = [
        test("first", 100.0, "100", ""),
        test("second", 200.0, "200", ""),
        stages.replace(
            "free = [\"cohesion\"]\n",
            "free = [\"cohesion\"]\ntests = [\"first\"]\n",
        ),
    ];
    let free = "cohesion = {}\nfriction_angle = { start = 29.0 }";
    let outcome = boxes.fit(free, &tests, "variance = \"given\"\nprofiles = false");
    // Of n plastic points c has σ²/n(100); 200 tan φ = τ − c has σ²/n(200) + σ²/n(100), the first alone with c held.
    let n = |stress: f64| {
        let strength = 5.0 + stress * 30.0_f64.to_radians().tan();
        boxes.x.iter().filter(|x| **x * 100.0 > strength).count() as f64
    };
    let ratio = ((1.0 / n(200.0) + 1.0 / n(100.0)) * n(200.0)).sqrt();
    says(
        &outcome,
        &format!("`friction_angle` is | {ratio:.1} times that of its interval"),
    );
}

#[test]
fn weights_are_no_information() {
    let boxes = Boxes::new(0.3);
    let free = "shear_stiffness = {}\nfriction_angle = {}";
    for variance in ["given", "estimated"] {
        let more = format!("variance = \"{variance}\"");
        let of = |weight: &str| {
            let tests = [test("one", 100.0, "100", weight)];
            let outcome = boxes.fit(free, &tests, &more);
            [0, 1].map(|p| {
                let linear = outcome.linear_interval(p).unwrap().ends;
                [outcome.interval(p).unwrap().ends, linear].concat()
            })
        };
        let plain = of("");
        for weight in ["25.0", "1e-14"] {
            let weighed = of(&format!("weight = {weight}"));
            for (a, b) in plain.iter().flatten().zip(weighed.iter().flatten()) {
                let (a, b) = (a.unwrap(), b.unwrap());
                assert!(
                    (a / b - 1.0).abs() < 1e-5,
                    "{variance}, {weight}: {plain:?} {weighed:?}"
                );
            }
        }
    }
    // Two tests of one strength, one of which counts nine times: (9² + 1)/(9 + 1)² of one's variance, not 1/10.
    let tests = [
        test("one", 100.0, "100", "weight = 9.0"),
        test("two", 100.0, "100", ""),
    ];
    let error = |tests: &[String]| {
        let outcome = boxes.fit("friction_angle = {}", tests, "variance = \"given\"");
        let ends = |ends: [Option<f64>; 2]| ends[1].unwrap() - ends[0].unwrap();
        [
            outcome.interval(0).unwrap().ends,
            outcome.linear_interval(0).unwrap().ends,
        ]
        .map(ends)
    };
    let (one, both) = (error(&tests[1..]), error(&tests));
    for (one, both) in one.iter().zip(both) {
        near(both / one / 0.82_f64.sqrt(), 1.0, 0.01);
    }
}

#[test]
fn exact_points_determine_no_more_than_is_computed_exactly() {
    let boxes = Boxes::new(0.0);
    let tests = [test("one", 100.0, "100", "")];
    let free = "shear_stiffness = {}\nfriction_angle = {}\nnormal_stiffness = {}";
    let outcome = boxes.fit(free, &tests, "profiles = false");
    says(
        &outcome,
        "residuals are smaller than what computed values are known to",
    );
    let (stiff, strength) = (
        number(&outcome, "shear_stiffness"),
        number(&outcome, "friction_angle"),
    );
    assert_eq!(outcome.interval(number(&outcome, "normal_stiffness")), None);
    for (parameter, truth) in [(stiff, 1e5), (strength, 30.0)] {
        let [low, high] = outcome
            .interval(parameter)
            .unwrap()
            .ends
            .map(Option::unwrap);
        assert!(low < truth && truth < high, "{low} {high}");
        // Known to 1e-9 of the largest value, not to the last bit.
        assert!((high - low) / truth > 1e-10, "{low} {high}");
    }
}

/// A parameter on its bound has no error: a prediction with it says that it takes the bound for known.
#[test]
fn a_bound_that_a_prediction_takes_for_known_is_said() {
    let boxes = Boxes::new(0.3);
    let tests = [
        test("fitted", 100.0, "100", ""),
        test("other", 200.0, "200", "predict = true"),
        test("start", 200.0, "200_start", "predict = true"),
    ];
    let free = "shear_stiffness = {}\nfriction_angle = { start = 20.0, max = 25.0 }";
    let outcome = boxes.fit(free, &tests, "profiles = false");
    let says_of = |test: &str| {
        let bound = "depends on `friction_angle`, which ended on a bound";
        let mut words = outcome.words.iter();
        words.any(|word| word.starts_with(&format!("{test}:")) && word.contains(bound))
    };
    // The elastic stage does not depend on it.
    assert!(
        says_of("other") && !says_of("start"),
        "{:#?}",
        outcome.words
    );
    let tests = &tests[..2];
    let free = "shear_stiffness = {}\nfriction_angle = {}";
    does_not_say(
        &boxes.fit(free, tests, "profiles = false"),
        "ended on a bound",
    );
}

/// Two names of one parameter with `laws`: what a driver stands for says which of them it has.
#[test]
fn two_names_with_laws_are_parted_by_what_a_driver_stands_for() {
    let boxes = Boxes::new(0.3);
    let free = "upper = { parameter = \"shear_stiffness\", laws = [\"sand\"] }\n\
                lower = { parameter = \"shear_stiffness\", laws = [\"clay\"] }";
    let tests = |of: [&str; 2]| {
        [
            test("sand", 100.0, "100", of[0]),
            test("clay", 200.0, "200", of[1]),
        ]
        .concat()
    };
    let fit = |of: [&str; 2]| {
        let file = boxes.place.path().join("calibration.toml");
        let text = format!(
            "starts = 1\nprofiles = false\n[free]\n{free}\n{}",
            tests(of)
        );
        fs::write(&file, text).unwrap();
        run(&file, &[])
    };
    let refused = fit(["", ""]).unwrap_err();
    has(refused.to_string(), "has two names in test `sand`");
    assert!(refused.help().unwrap().contains("stands_for"));
    let outcome = fit(["stands_for = \"sand\"", "stands_for = \"clay\""]).unwrap();
    for value in &outcome.values {
        assert!((value / 1e5 - 1.0).abs() < 0.02, "{:?}", outcome.values);
    }
    // Each curve moves its own: 24 columns of one, then of the other.
    let jacobian = &outcome.stages[0].jacobian;
    let norm = |first: usize, parameter: usize| jacobian.view((first, parameter), (24, 1)).norm();
    assert!(norm(0, 0) > 1.0 && norm(0, 1) < 1e-12 && norm(24, 0) < 1e-12 && norm(24, 1) > 1.0);
    let unknown = fit(["stands_for = \"sant\"", "stands_for = \"clay\""]).unwrap_err();
    has(unknown.to_string(), "no name belongs to the law `sant`");
    assert!(unknown.help().unwrap().contains("sand"));
}

/// A column pressed down, computed to a hundredth.
const ROUGH: &str = "analysis = \"plane_strain\"\nmesh.columns = [{ n = 1, to = 1.0 }]\nmesh.rows = [{ n = 1, to = 1.0 }]\n\
    mesh.lines = { base = { y = 0.0 }, top = { y = 1.0 } }\nmesh.region = [{ group = \"soil\" }]\n\
    supports = [{ line = \"base\", fixed = [\"x\", \"y\"] }]\nsolver.force_tolerance = 1e-2\n\
    [laws.soil]\nlaw = \"elastic\"\nparameters = { young_modulus = 1e4, poisson_ratio = 0.0 }\n\
    [groups.soil]\nformulation = \"solid\"\nlaw = \"soil\"\n\
    [[phase]]\nname = \"load\"\nincrements = 2\npressure = [{ line = \"top\", value = 100.0 }]\n\
    [probes]\np = { line = \"base\", quantity = \"reaction_y\" }\nw = { line = \"top\", quantity = \"displacement_y\", scale = -1000.0 }\n";

/// Each test is known to its own exactness: a rough case next to a driver makes nothing of that less known.
#[test]
fn a_rough_case_blinds_no_other_test() {
    let boxes = Boxes::new(0.3);
    fs::write(boxes.place.path().join("rough.toml"), ROUGH).unwrap();
    write_points(boxes.place.path(), "rough.csv", &[(2.0, 20.0), (8.0, 80.0)]);
    let rough = "[[test]]\nname = \"rough\"\ncase = \"rough.toml\"\npredict = true\n[[test.curve]]\nx = \"w\"\ny = \"p\"\n\
                 noise = 1.0\nmeasured = { file = \"rough.csv\", x = \"x\", y = \"y\" }\n";
    let free = "shear_stiffness = {}\ncohesion = {}\nfriction_angle = {}";
    let fitted = || vec![test("one", 100.0, "100", ""), test("two", 200.0, "200", "")];
    let more = "profiles = false\ndifference = 1e-4";
    let alone = boxes.fit(free, &fitted(), more);
    let beside = boxes.fit(free, &[fitted(), vec![rough.to_owned()]].concat(), more);
    for parameter in 0..3 {
        let [alone, beside] = [&alone, &beside].map(|o| o.interval(parameter).unwrap().ends);
        assert_eq!(alone, beside);
    }
}

#[test]
fn a_fit_that_is_none_is_said_with_what_to_look_at() {
    let free = "shear_stiffness = {}\nfriction_angle = {}";
    for (scale, why) in [
        (-1.0, "opposite sign"),
        (1000.0, "about 1000 times those computed"),
    ] {
        let boxes = Boxes::scaled(0.3, scale);
        let tests = [test("one", 100.0, "100", "")];
        let outcome = boxes.fit(
            &free.replace("friction_angle = {}", "friction_angle = { max = 60.0 }"),
            &tests,
            "",
        );
        has(&outcome.words[0], "the fit is bad");
        assert!(outcome.words[0].contains(why), "{:#?}", outcome.words);
        does_not_say(&outcome, "cannot be identified");
        assert!(curve(&outcome).explained.unwrap() < 0.5);
    }
    let outcome = Boxes::new(0.3).fit(free, &[test("one", 100.0, "100", "")], "");
    does_not_say(&outcome, "the fit is bad");
    // Residuals of 0.3 and a curve between 8 and 63.
    assert!(curve(&outcome).explained.unwrap() > 0.999);
}

fn curve(outcome: &Outcome) -> &FittedCurve {
    &outcome.tests[0].curves[0]
}

/// Only the elastic part was measured: any strength above it does, and below it the curve is another.
#[test]
fn a_plateau_is_no_parameter_that_cannot_be_identified() {
    // The last point lies above the line: a lower strength does not come nearer to it.
    let boxes = Boxes::new(-0.3);
    let tests = [test("one", 100.0, "100_start", "")];
    let free = "shear_stiffness = {}\nfriction_angle = { start = 50.0 }";
    let outcome = boxes.fit(free, &tests, "profiles = false");
    says(
        &outcome,
        "`friction_angle` is not told: at 50 | a limit at most",
    );
    does_not_say(&outcome, "cannot be identified");
    assert_eq!(outcome.interval(1), None);
}

const MEPI: &str = "law = \"mepi\"\nhypothesis = \"interface_2d\"\n[parameters]\nk_n = 0.86e5\nk_t = 0.37e5\n\
    n = 0.55\nmu_0 = 0.0\nmu_p = 0.68\nmu_c0 = 0.67\na = 0.00045\nc_0 = 0.05\nt = 0.002\n[initial]\n\
    traction = { n = -100.0 }\n[[segment]]\nincrements = 30\ncontrol = { t = { jump = 3.0e-3 } }\n";

/// μ_c0 may not exceed μ_p, and the noise would let it.
#[test]
fn a_profile_that_runs_into_what_cannot_be_computed_has_no_limit_that_is_known() {
    let place = TempDir::new().unwrap();
    fs::write(place.path().join("driver.toml"), MEPI).unwrap();
    let x: Vec<f64> = (1..=12).map(|k| 0.2 * f64::from(k)).collect();
    let y = computed(MEPI, ["u_t", "u_n"], &x);
    let points: Vec<(f64, f64)> = x.iter().copied().zip(y).collect();
    write_points(place.path(), "box.csv", &points);
    let file = place.path().join("calibration.toml");
    let text = "starts = 1\nvariance = \"given\"\n[free]\nmu_c0 = {}\n[[test]]\nname = \"box\"\n\
        driver = \"driver.toml\"\n[[test.curve]]\nx = \"u_t\"\ny = \"u_n\"\nnoise = 0.5\n\
        measured = { file = \"box.csv\", x = \"x\", y = \"y\" }\n";
    fs::write(&file, text).unwrap();
    let outcome = run(&file, &[]).unwrap();
    let interval = outcome.interval(0).unwrap();
    let Open::Barred(up_to) = interval.open[1] else {
        panic!("{interval:?} {:#?}", outcome.words);
    };
    assert!(up_to > 0.66 && up_to <= 0.681, "{up_to}");
    assert_eq!(interval.ends[1], None);
    says(
        &outcome,
        "how far `mu_c0` may go upwards is not known | cannot be computed",
    );
    does_not_say(&outcome, "no limit upwards");
    assert!(outcome.text().contains("(unknown)"), "{}", outcome.text());
}
