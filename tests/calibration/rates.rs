//! Derivatives from the rates that a law gives.
#![expect(clippy::unwrap_used, reason = "part of the tests")]

use crate::{computed, run, run_in, write_points};
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// A joint with dilatancy at constant stiffness, sheared into slip, unloaded in shear by a led traction:
/// every kind of control that interfaces have.
fn driver(parameters: [f64; 4]) -> String {
    let [stiffness, exponent, cohesion, friction] = parameters;
    format!(
        r#"
law = "sensitive_joint"
hypothesis = "interface_2d"
[parameters]
normal_stiffness = 2e5
shear_stiffness = {stiffness:?}
exponent = {exponent:?}
cohesion = {cohesion:?}
friction_angle = {friction:?}
dilatancy_angle = 4.0
[initial]
traction = {{ n = -80.0, t = 5.0 }}
[[segment]]
increments = 12
control = {{ t = {{ jump = 1.0e-3 }}, n = {{ stiffness = 3e4 }} }}
[[segment]]
increments = 8
control = {{ t = {{ traction = 20.0 }} }}
[[segment]]
increments = 6
control = {{ t = {{ jump = 1.6e-3 }}, n = {{ traction = -90.0 }} }}
"#
    )
}

const FREE: [&str; 4] = ["shear_stiffness", "exponent", "cohesion", "friction_angle"];
const VALUES: [f64; 4] = [1e5, 0.5, 3.0, 30.0];

#[test]
fn rates_of_a_law_are_the_derivatives_of_its_curves() {
    let place = TempDir::new().unwrap();
    fs::write(place.path().join("driver.toml"), driver(VALUES)).unwrap();
    // Between rows, whose places do not move with the parameters: jumps are led in the first segment.
    let x: Vec<f64> = (0..12).map(|k| 0.04 + 0.08 * f64::from(k)).collect();
    let columns = ["traction_t", "traction_n", "mu", "jump_n", "plastic_slip"];
    let mut text = "starts = 1\nprofiles = false\n[free]\n".to_owned();
    for (name, value) in FREE.iter().zip(VALUES) {
        text += &format!("{name} = {{ start = {value:?}, scale = \"log\" }}\n");
    }
    text += "[[test]]\nname = \"joint\"\ndriver = \"driver.toml\"\n";
    let mut noise = Vec::new();
    for column in columns {
        let there = first_segment(VALUES, column, &x);
        let scale = there.iter().fold(0.0_f64, |scale, y| scale.max(y.abs()));
        // The search starts at its end: the derivatives that are kept are those at these values.
        let points: Vec<(f64, f64)> = x.iter().copied().zip(there).collect();
        write_points(place.path(), &format!("{column}.csv"), &points);
        text += &format!(
            "[[test.curve]]\nx = \"u_t\"\ny = \"{column}\"\nsegment = 1\nnoise = {scale:?}\n\
             measured = {{ file = \"{column}.csv\", x = \"x\", y = \"y\" }}\n"
        );
        noise.push(scale);
    }
    let file = place.path().join("calibration.toml");
    fs::write(&file, text).unwrap();
    let outcome = run(&file, &[]).unwrap();
    assert!(outcome.tests[0].is_by_law);
    let jacobian = &outcome.stages[0].jacobian;
    let mut worst = 0.0_f64;
    for (p, name) in FREE.iter().enumerate() {
        let step = 1e-6;
        let moved = |sign: f64, column: &str| {
            let mut values = VALUES;
            values[p] *= f64::exp(sign * step);
            first_segment(values, column, &x)
        };
        for (c, column) in columns.iter().enumerate() {
            let (above, below) = (moved(1.0, column), moved(-1.0, column));
            for i in 0..x.len() {
                let difference = (above[i] - below[i]) / (2.0 * step) / noise[c];
                let found = jacobian[(c * x.len() + i, p)];
                let error = (found - difference).abs() / difference.abs().max(1e-3);
                assert!(
                    error < 1e-5,
                    "{column} by {name} at {}: {found} {difference}",
                    x[i]
                );
                worst = worst.max(error);
            }
        }
    }
    println!("largest error {worst:.1e}");
}

/// A parameter is fitted or reported as unseen, however much more the curves respond to another one. Counted in widths
/// of a range that is far too wide, cohesion moves them 10⁵ times as much as the stiffness.
#[test]
fn a_column_beside_a_much_larger_one_is_fitted() {
    let place = TempDir::new().unwrap();
    fs::write(place.path().join("driver.toml"), driver(VALUES)).unwrap();
    let x: Vec<f64> = (0..12).map(|k| 0.04 + 0.08 * f64::from(k)).collect();
    let there = first_segment(VALUES, "traction_t", &x)
        .into_iter()
        .enumerate();
    let disturbed = there.map(|(k, y)| y + if k % 2 == 0 { 0.1 } else { -0.1 });
    let points: Vec<(f64, f64)> = x.iter().copied().zip(disturbed).collect();
    write_points(place.path(), "joint.csv", &points);
    let text = "starts = 1\nprofiles = false\n[free]\nshear_stiffness = { start = 1.2e5 }\n\
                cohesion = { start = 2.0, min = 0.0, max = 1e9, scale = \"linear\" }\n\
                [[test]]\nname = \"joint\"\ndriver = \"driver.toml\"\n[[test.curve]]\nx = \"u_t\"\n\
                y = \"traction_t\"\nsegment = 1\nnoise = 0.1\nmeasured = { file = \"joint.csv\", x = \"x\", y = \"y\" }\n";
    let file = place.path().join("calibration.toml");
    fs::write(&file, text).unwrap();
    let outcome = run(&file, &[]).unwrap();
    assert!(outcome.tests[0].is_by_law);
    for (parameter, truth) in [(0, VALUES[0]), (1, VALUES[2])] {
        let found = outcome.values[parameter];
        assert!(
            (found / truth - 1.0).abs() < 0.05,
            "{found}: {:?}",
            outcome.words
        );
        assert!(outcome.linear_interval(parameter).is_some());
    }
}

/// A stopped calibration leaves its derivatives to the next one, which may count the parameters in another way.
#[test]
fn derivatives_that_were_kept_do_not_depend_on_how_parameters_are_counted() {
    let place = TempDir::new().unwrap();
    fs::write(place.path().join("driver.toml"), driver(VALUES)).unwrap();
    let x: Vec<f64> = (0..12).map(|k| 0.04 + 0.08 * f64::from(k)).collect();
    let there = first_segment(VALUES, "traction_t", &x).into_iter();
    let points: Vec<(f64, f64)> = x.iter().copied().zip(there.map(|y| 1.1 * y)).collect();
    write_points(place.path(), "joint.csv", &points);
    let file = place.path().join("calibration.toml");
    let text = |free: &str| {
        format!(
            "starts = 1\nprofiles = false\n[free]\n{free}\n[[test]]\nname = \"joint\"\ndriver = \"driver.toml\"\n\
             [[test.curve]]\nx = \"u_t\"\ny = \"traction_t\"\nsegment = 1\nnoise = 1.0\n\
             measured = {{ file = \"joint.csv\", x = \"x\", y = \"y\" }}\n"
        )
    };
    // Powers of two: the start is counted, and found again, to the last bit.
    let free = |end: f64| {
        format!(
            "shear_stiffness = {{ start = 65536.0, min = 32768.0, max = {end:?}, scale = \"linear\" }}"
        )
    };
    let [fresh, stopped] = ["fresh", "stopped"].map(|name| place.path().join(name));
    let kept = stopped.join("computations.jsonl");
    let first_derivatives = {
        let kept = kept.clone();
        move || fs::read_to_string(&kept).is_ok_and(|text| text.contains("\"by\":[0]"))
    };
    fs::write(&file, text(&free(98_304.0))).unwrap();
    let stop = law::Stop::asked_by(first_derivatives, |_| ());
    let ended = run_in(&file, &[], &stopped, stop).unwrap_err();
    assert!(ended.kind() == input::Kind::Stopped, "{ended}");
    fs::write(&file, text(&free(557_056.0))).unwrap();
    let way = |folder: &Path| {
        let outcome = run_in(&file, &[], folder, law::Stop::never()).unwrap();
        let stage = &outcome.stages[0];
        let steps = stage.landings[0].iterations;
        (steps, stage.best.clone(), outcome.computations)
    };
    // As if it had never been counted in another way.
    let expected = way(&fresh);
    assert!(expected.0 > 1, "{expected:?}");
    assert_eq!(way(&stopped), expected);
}

/// A column along the first segment.
fn first_segment(values: [f64; 4], column: &str, x: &[f64]) -> Vec<f64> {
    let text = driver(values);
    let first: Vec<&str> = text.split("[[segment]]").take(2).collect();
    computed(&first.join("[[segment]]"), ["u_t", column], x)
}

/// If a flux is prescribed, the horizontal axis itself moves with the parameters.
#[test]
fn rates_follow_through_segments_of_led_flux() {
    let place = TempDir::new().unwrap();
    fs::write(place.path().join("driver.toml"), driver(VALUES)).unwrap();
    let mut text = "starts = 1\nprofiles = false\n[free]\n".to_owned();
    // Not the exponent, which at one pressure counts with the stiffness only.
    for (name, value) in FREE.iter().zip(VALUES).step_by(2) {
        text += &format!(
            "{name} = {{ start = {:?}, scale = \"log\" }}\n",
            1.2 * value
        );
    }
    text += "[[test]]\nname = \"joint\"\ndriver = \"driver.toml\"\n";
    // Slip against shear stress while it is led down, and shear stress against slip afterwards.
    let parts = [
        (2, "traction_t", "u_t"),
        (3, "u_t", "traction_n"),
        (3, "u_t", "traction_t"),
    ];
    for (segment, x, y) in parts {
        let file = format!("{segment}_{y}.csv");
        let points = part(VALUES, segment, [x, y]);
        write_points(place.path(), &file, &points);
        text += &format!(
            "[[test.curve]]\nx = \"{x}\"\ny = \"{y}\"\nsegment = {segment}\nnoise = 0.1\n\
             measured = {{ file = \"{file}\", x = \"x\", y = \"y\" }}\n"
        );
    }
    let file = place.path().join("calibration.toml");
    fs::write(&file, text).unwrap();
    // Exact points of the law itself: its own derivatives lead back to the truth.
    let outcome = run(&file, &[]).unwrap();
    assert!(outcome.tests[0].is_by_law);
    for (found, (name, truth)) in outcome
        .values
        .iter()
        .zip(FREE.iter().zip(VALUES).step_by(2))
    {
        assert!(
            (found / truth - 1.0).abs() < 1e-4,
            "{name}: {found}, {:?}",
            outcome.words
        );
    }
}

/// Points between the ends of a segment.
fn part(values: [f64; 4], segment: usize, columns: [&str; 2]) -> Vec<(f64, f64)> {
    let text = driver(values);
    let driver = tests::driver::of_text(&text).unwrap();
    let names = results::point_figure::drawable(driver.point());
    let [x, y] = columns.map(|name| names.iter().position(|other| other == name).unwrap());
    let mut rows = Vec::new();
    driver
        .run(|row| {
            let values = results::point_figure::drawn(driver.point(), row);
            rows.push((values[x].unwrap(), values[y].unwrap()));
        })
        .unwrap();
    let increments = driver.point().segment_increments();
    let first: usize = increments[..segment - 1].iter().sum();
    rows[first + 1..first + increments[segment - 1]].to_vec()
}
