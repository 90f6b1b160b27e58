//! `--set`: keys over what a file says, from the command line.
#![expect(clippy::unwrap_used, reason = "part of the tests")]

use crate::program::{BAD_INPUT, CASE, DONE, Outcome, Place};
use serde_json::Value;
use tests::words::rows_of;
use tests::words::words;

/// Runs the small case with settings.
fn run(place: &Place, settings: &[&str]) -> Outcome {
    place.write("case.toml", CASE);
    let mut arguments = vec!["run", "case.toml", "--out", "out"];
    for setting in settings {
        arguments.extend(["--set", setting]);
    }
    place.run(&arguments)
}

/// Refuses a setting at a place in it.
fn refused(setting: &str, at: &str, says: &str) {
    let place = Place::new();
    let outcome = run(&place, &[setting]).ended(BAD_INPUT);
    for text in [&format!("--set:{at}"), says, setting] {
        outcome.shows(text);
    }
    assert_eq!(place.contents(), ["case.toml"], "{setting}");
}

fn summary(place: &Place, folder: &str) -> Value {
    let text = std::fs::read_to_string(place.path(folder).join("summary.json")).unwrap();
    serde_json::from_str(&text).unwrap()
}

#[test]
fn settings_override_the_file_and_are_recorded() {
    let place = Place::new();
    let settings = words(
        "laws.joint.parameters.cohesion=20 solver.max_iterations=40 phase.2.increments=3 phase.push.displacement.1.x=2e-5 output.profile=never",
    );
    run(&place, &settings).ended(DONE);
    let set = summary(&place, "out");
    assert_eq!(set["set"], Value::from(settings.clone()));
    assert_eq!(
        set["laws"]["joint (interface_2d)"]["parameters"]["cohesion"],
        20.0
    );
    assert_eq!(set["solver"]["max_iterations"], 40);
    assert_eq!(set["phases"][1]["increments"], 3);
    assert!(!place.path("out").join("profile.csv").exists());
    // The same in the file: the same results, another text.
    let file = CASE
        .replace("cohesion = 10.0", "cohesion = 20.0")
        .replace("max_iterations = 20", "max_iterations = 40")
        .replace("increments = 2\ndisp", "increments = 3\ndisp")
        .replace("x = 1e-5", "x = 2e-5")
        .replace("profile = \"phases\"", "profile = \"never\"");
    place.write("file.toml", file);
    place.done(&["run", "file.toml", "--out", "file"]);
    let history = |folder: &str| std::fs::read(place.path(folder).join("history.csv")).unwrap();
    assert_eq!(history("out"), history("file"));
    let written = summary(&place, "file");
    assert_eq!(written["set"], Value::Array(Vec::new()));
    assert_ne!(written["case_sha256"], set["case_sha256"]);
    // The hash is that of the file's text, whatever is set.
    run(&place, &[]).ended(DONE);
    assert_eq!(summary(&place, "out")["case_sha256"], set["case_sha256"]);
}

#[test]
fn what_does_not_fit_is_said_at_its_place_in_the_setting() {
    for [setting, at, says] in rows_of(
        r#"
solver.max_iteration=40 | 1:8 | did you mean `max_iterations`?
sovler.max_iterations=40 | 1:1 | did you mean `solver`?
solver.max_iterations=many | 1:23 | `max_iterations`: found the text "many", expected a whole number
phase.1.pressure.1.value=true | 1:26 | `value`: expected a number, or values over the height
laws.joint.parameters.friction_angle=95 | 1:38 | `friction_angle`: 95 deg is outside [0, 90)
laws.joint.parameters.cohesoin=1 | 1:23 | did you mean `cohesion`?
laws.jiont.parameters.cohesion=1 | 1:6 | did you mean `joint`? There is: soil, joint
phase.pusch.increments=1 | 1:7 | did you mean `push`? There is: weight, push
phase.3.increments=1 | 1:7 | `phase` has 2 entries
groups.soil.law=rock | 1:17 | there is no law `rock`
output.profile=often | 1:16 | there is no `often`
title=two words | 1:7 | no single word, which stands for a text
laws.joint.parameters.cohesion=1,5 | 1:33 | is a decimal point meant? `1.5`
solver.force_tolerance=nan | 1:24 | nan is no finite number
laws.my joint.parameters.cohesion=1 | 1:1 | --set 'laws."my joint".parameters.cohesion=…'
base=other.toml | 1:1 | `base` cannot be set
solver.max_iterations | 1:1 | expected KEY=VALUE
"#,
    ) {
        refused(setting, at, says);
    }
}

#[test]
fn settings_hold_for_every_variant_and_over_bases() {
    let place = Place::new();
    place.write("base.toml", CASE);
    let variants = "base = \"base.toml\"\nsolver.max_iterations = 25\n\
                    [[variant]]\nname = \"a\"\nlaws.joint.parameters.cohesion = 1.0\n\
                    [[variant]]\nname = \"b\"\n";
    place.write("case.toml", variants);
    place.done(&words("run case.toml --out out --set laws.joint.parameters.cohesion=3 --set solver.max_iterations=30"));
    for variant in ["out/a", "out/b"] {
        let summary = summary(&place, variant);
        let law = &summary["laws"]["joint (interface_2d)"];
        assert_eq!(law["parameters"]["cohesion"], 3.0, "{variant}");
        assert_eq!(summary["solver"]["max_iterations"], 30, "{variant}");
    }
}

#[test]
fn a_run_is_resumed_only_with_its_settings() {
    let place = Place::new();
    run(&place, &["phase.push.increments=3"]).ended(DONE);
    let resumed = |setting: &str| {
        place.run(&[
            "run",
            "case.toml",
            "--out",
            "out",
            "--resume",
            "--set",
            setting,
        ])
    };
    let outcome = resumed("phase.push.increments=3").ended(DONE);
    outcome.shows("done already");
    let outcome = resumed("phase.push.increments=4").ended(BAD_INPUT);
    outcome.shows("other settings");
}

#[test]
fn drivers_and_studies_take_settings() {
    let place = Place::new();
    let driver = "law = \"coulomb_joint\"\nhypothesis = \"interface_2d\"\n\
                  [parameters]\nnormal_stiffness = 1e6\nshear_stiffness = 4e5\n\
                  cohesion = 10.0\nfriction_angle = 0.0\ndilatancy_angle = 0.0\n\
                  [[segment]]\nincrements = 4\ncontrol = { t = { jump = 1e-3 } }\n";
    place.write("driver.toml", driver);
    let strength = |set: &[&str]| {
        place.done(&[&["point", "driver.toml", "--csv", "rows.csv"], set].concat());
        let rows = place.read("rows.csv");
        let (header, last) = (rows.lines().next().unwrap(), rows.lines().last().unwrap());
        let column = header
            .split(',')
            .position(|name| name == "traction_t")
            .unwrap();
        let value: f64 = last.split(',').nth(column).unwrap().parse().unwrap();
        value.abs()
    };
    assert!((strength(&[]) - 10.0).abs() < 1e-9);
    assert!((strength(&["--set", "parameters.cohesion=4"]) - 4.0).abs() < 1e-9);
    let outcome = place.refused(&["point", "driver.toml", "--set", "segment.2.increments=1"]);
    outcome.shows("--set:1:9");
    let outcome = place.refused(&["trade-off", "driver.toml", "--set", "parameters.cohesoin=4"]);
    outcome.shows("did you mean `cohesion`?");
}

#[test]
fn an_initial_stress_of_the_command_line_is_refused_there() {
    let place = Place::new();
    let driver = "law = \"mepi\"\nhypothesis = \"interface_2d\"\nparameters = { k_n = 0.86e5, k_t = \
                  0.37e5, n = 0.55, mu_0 = 0.27, mu_p = 0.7, mu_c0 = 0.46, a = 0.008, c_0 = 40.0, t = \
                  0.002 }\ninitial = { traction = { n = -100.0, t = 0.0 } }\n\
                  segment = [{ increments = 1, control = { t = { jump = 1e-4 } } }]\n";
    place.write("driver.toml", driver);
    place.done(&["point", "driver.toml"]);
    let setting = "initial.traction.n=50";
    let outcome = place.refused(&["point", "driver.toml", "--set", setting]);
    outcome.shows("--set:1:1").shows(setting);
    // In the file it is shown there.
    place.write("driver.toml", driver.replace("n = -100.0", "n = 50.0"));
    let outcome = place.refused(&["point", "driver.toml"]);
    outcome.shows("driver.toml:4:");
}

#[test]
fn a_number_of_increments_is_a_whole_number() {
    let place = Place::new();
    let driver = "law = \"elastic\"\nhypothesis = \"plane_strain\"\nparameters = { young_modulus = 1e4, \
                  poisson_ratio = 0.3 }\nsegment = [{ increments = 2.5, control = { 11 = { strain = 1e-4 } \
                  } }]\n";
    place.write("driver.toml", driver);
    let outcome = place.refused(&["point", "driver.toml"]);
    outcome.shows("expected a whole number");
}
