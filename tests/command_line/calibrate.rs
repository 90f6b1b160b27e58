//! `pilum calibrate`: what it shows and writes, mistakes in its file, and what becomes of it when it is ended.
#![allow(clippy::unwrap_used, reason = "part of the tests")]

mod mistakes;

use crate::program::{BAD_INPUT, CASE, DONE, Outcome, Place};
use serde_json::Value;
use tests::words::has;
use tests::words::rows_of;
use tests::words::words;

/// Shear stress of a joint of 5e4 kPa/m and tan φ = 0.6 at 100 kPa, with an error of a tenth.
const POINTS: &str = "slip,tau,empty\n0.2,10.1,\n0.4,19.9,\n0.6,30.1,\n0.8,39.9,\n1.0,50.1,\n1.4,59.9,\n1.6,60.1,\n1.8,59.9,\n";

const DRIVER: &str = r#"law = "coulomb_joint"
hypothesis = "interface_2d"
[parameters]
normal_stiffness = 1e6
shear_stiffness = 1e5
cohesion = 0.0
friction_angle = 20.0
dilatancy_angle = 0.0
[initial]
traction = { n = -100.0 }
[[segment]]
increments = 20
control = { t = { jump = 2e-3 } }
[[segment]]
increments = 5
control = { t = { traction = 0.0 } }
"#;

const FILE: &str = r#"title = "A joint"
starts = 2

[free]
shear_stiffness = { min = 1e3, max = 1e7 }
friction_angle = {}

[[test]]
name = "box"
driver = "driver.toml"

[[test.curve]]
x = "u_t"
y = "traction_t"
segment = 1
measured = { file = "box.csv", x = "slip", y = "tau" }
noise = 0.1
"#;

fn place() -> Place {
    let place = Place::new();
    place.write("driver.toml", DRIVER);
    place.write("box.csv", POINTS);
    place.write("joint.toml", FILE);
    place
}

/// The same points with a slack of 0.3 mm. The warning precedes all notes, in the text, the page and the files, and
/// names the points. A fitted offset has an interval, in the text and in the table.
#[test]
fn slack_is_warned_of_everywhere_and_an_offset_is_a_row() {
    let place = place();
    let slack = "slip,tau\n0.1,0.1\n0.2,-0.1\n0.3,0.1\n0.5,10.1\n0.7,19.9\n0.9,30.1\n1.1,39.9\n1.3,50.1\n1.7,59.9\n1.9,60.1\n";
    place.write("box.csv", slack);
    let outcome = place.done(&["calibrate", "joint.toml", "--out", "out"]);
    let says = "residuals are too large for noise";
    let warning = outcome.stdout.find("warning: box, traction_t: ").unwrap();
    assert!(
        outcome.stdout[warning..].contains(says),
        "{}",
        outcome.stdout
    );
    assert!(
        outcome
            .stdout
            .find("note: ")
            .is_none_or(|note| warning < note)
    );
    let read = |name: &str| std::fs::read_to_string(place.path("out").join(name)).unwrap();
    assert!(read("report.html").contains("not to be believed"));
    assert!(read("report.html").contains(says));
    let json: Value = serde_json::from_str(&read("calibration.json")).unwrap();
    assert!(json["warnings"][0].as_str().unwrap().contains(says));
    let far = json["tests"][0]["curves"][0]["beyond_noise"]
        .as_array()
        .unwrap();
    let marked = read("fit.csv")
        .lines()
        .filter(|line| line.ends_with(",true"))
        .count();
    assert!(marked > 0 && marked == far.len(), "{marked}");
    let to = "noise = 0.1\noffset_x = { min = 0.0, max = 1.0 }";
    let outcome = edited(&place, "noise = 0.1", to, &[]).ended(DONE);
    assert!(!outcome.stdout.contains("warning: "), "{}", outcome.stdout);
    outcome.prints("\noffset_x of box, traction_t  ");
    assert!(read("parameters.csv").contains("\n\"offset_x of box, traction_t\",2.9"));
    assert!(!read("report.html").contains("not to be believed"));
    assert!(!read("parameters.toml").contains("offset"));
}

/// The file after an edit.
fn edited(place: &Place, from: &str, to: &str, more: &[&str]) -> Outcome {
    assert!(FILE.contains(from), "{from:?}");
    place.write("joint.toml", FILE.replacen(from, to, 1));
    place.run(&[&["calibrate", "joint.toml", "--out", "out"], more].concat())
}

#[test]
fn finds_what_the_points_were_made_with_and_leaves_it_in_files() {
    let place = place();
    let outcome = place.done(&["calibrate", "joint.toml"]);
    outcome
        .prints("shear_stiffness")
        .prints("95 % interval")
        .prints("[parameters]")
        .prints("results in results/calibrate_joint");
    let folder = place.path("results/calibrate_joint");
    let read = |name: &str| std::fs::read_to_string(folder.join(name)).unwrap();
    let json: Value = serde_json::from_str(&read("calibration.json")).unwrap();
    let parameters = json["parameters"].as_array().unwrap();
    for (parameter, truth) in parameters.iter().zip([5e4, 0.6_f64.atan().to_degrees()]) {
        let [low, high] = [0, 1].map(|end| parameter["interval"][end].as_f64().unwrap());
        assert!(low < truth && truth < high, "{parameter}");
        assert!((high / low - 1.0).abs() < 0.05, "{parameter}");
    }
    // Eight points, two parameters.
    assert_eq!(json["stages"][0]["degrees_of_freedom"], 6);
    for (name, lines) in [
        ("parameters.csv", 3),
        ("fit.csv", 9),
        ("correlations.csv", 2),
        ("starts.csv", 5),
    ] {
        assert_eq!(read(name).lines().count(), lines, "{name}");
    }
    assert!(read("profiles.csv").lines().count() > 8);
    let report = read("report.html");
    for part in ["<svg", "to paste", "Profiles", "correlations"] {
        assert!(report.contains(part), "{part}");
    }
    assert!(folder.join("fit_traction_t_over_u_t.svg").is_file());
    assert!(folder.join("profile_friction_angle.svg").is_file());
    assert!(!folder.join(".trial").exists());
    // The set is one that the driver takes.
    let block = read("parameters.toml");
    let (head, rest) = DRIVER.split_once("[parameters]").unwrap();
    let (_, tail) = rest.split_once("[initial]").unwrap();
    place.write("best.toml", format!("{head}{block}[initial]{tail}"));
    place.done(&["point", "best.toml"]);
}

#[test]
fn variants_and_settings() {
    let place = place();
    let variants =
        format!("{FILE}\n[[variant]]\nname = \"a\"\n[[variant]]\nname = \"b\"\nconfidence = 0.5\n");
    place.write("joint.toml", variants);
    let outcome = place.done(&words("calibrate joint.toml --out out --set starts=1"));
    has(&outcome.stderr, "start 1 of 1");
    let width = |variant: &str| {
        let text =
            std::fs::read_to_string(place.path("out").join(variant).join("calibration.json"));
        let json: Value = serde_json::from_str(&text.unwrap()).unwrap();
        let interval = &json["parameters"][0]["linear_interval"];
        interval[1].as_f64().unwrap() - interval[0].as_f64().unwrap()
    };
    // t(6) is 2.447 at 95 % and 0.718 at 50 %.
    let ratio = width("a") / width("b");
    assert!((ratio / (2.447 / 0.718) - 1.0).abs() < 0.02, "{ratio}");
    let outcome = place.refused(&["calibrate", "joint.toml", "--variant", "c"]);
    outcome.shows("there is no variant `c`");
}

/// What was in the folder before.
#[test]
fn a_folder_with_earlier_results() {
    let place = place();
    let run = ["calibrate", "joint.toml", "--out", "out"];
    place.done(&run);
    assert!(place.path("out/profile_friction_angle.svg").is_file());
    // Figures that this one does not draw are gone.
    place.done(&[&run[..], &["--set", "profiles=false"]].concat());
    assert!(!place.path("out/profile_friction_angle.svg").exists());
    assert!(place.path("out/fit_traction_t_over_u_t.svg").is_file());
    place.write("run/history.csv", "phase,increment\n");
    let outcome = place.refused(&["calibrate", "joint.toml", "--out", "run"]);
    outcome.shows("holds the results of a run");
    assert!(!place.path("run/report.html").exists());
}

/// Points beyond the computed ones are left out, and that is reported.
#[test]
fn points_that_are_not_computed_are_left_out() {
    let place = place();
    place.write("box.csv", format!("{POINTS}2.5,60.0,\n3.0,60.0,\n"));
    let outcome = place.done(&["calibrate", "joint.toml", "--out", "out"]);
    outcome.prints("2 of 10 measured points are left out");
}

/// A law of a case is named by its table.
#[test]
fn parameters_of_cases_need_their_law() {
    let place = place();
    place.write("case.toml", CASE);
    let file = r#"starts = 1
profiles = false
[free]
FREE
[[test]]
name = "push"
case = "case.toml"
[[test.curve]]
x = "settlement"
y = "tau"
phase = "weight"
measured = { file = "push.csv", x = "w", y = "tau" }
noise = 0.1
"#;
    place.write("push.csv", "w,tau\n0.5,1.0\n");
    for [free, says] in rows_of(
        r#"
shear_stiffness = {} | `shear_stiffness` needs `laws`
shear_stiffness = { laws = ["soil"] } | law `elastic` has no parameter `shear_stiffness`
shear_stiffness = { laws = ["skin"] } | no case of a test has a law `skin`
"#,
    ) {
        place.write("push.toml", file.replace("FREE", free));
        let outcome = place.run(&["calibrate", "push.toml"]).ended(BAD_INPUT);
        outcome.shows(says);
        outcome.shows("push.toml:4:");
    }
    let wrong = file.replace("FREE", "young_modulus = { laws = [\"soil\"] }");
    place.write("push.toml", wrong.replace("\"weight\"", "\"wait\""));
    let outcome = place.run(&["calibrate", "push.toml"]);
    outcome.shows("there is no phase `wait`");
}

/// A calibration whose computations take long enough to be ended on the way: its result, and what it is without
/// having been ended.
#[cfg(target_os = "linux")]
fn long() -> Place {
    let place = place();
    place.write(
        "driver.toml",
        DRIVER.replacen("increments = 20", "increments = 20000", 1),
    );
    place
}

#[cfg(target_os = "linux")]
const LONG: [&str; 6] = [
    "calibrate",
    "joint.toml",
    "--out",
    "out",
    "--set",
    "starts=4",
];

/// Everything that was found.
#[cfg(target_os = "linux")]
fn found(place: &Place) -> String {
    place.read("out/calibration.json")
}

/// Starts the calibration, ends it by a signal when it has kept `n` computations, and says how many it then
/// has. `None` if it was done before.
#[cfg(target_os = "linux")]
fn ended(place: &Place, signal: &str, n: usize) -> Option<(Option<i32>, usize, String)> {
    let said = std::fs::File::create(place.path("said")).unwrap();
    let mut command = place.command(&LONG);
    let mut child = command
        .stderr(said)
        .stdout(std::process::Stdio::null())
        .spawn()
        .unwrap();
    let kept = || {
        let text = std::fs::read_to_string(place.path("out/computations.jsonl"));
        text.map_or(0, |text| text.lines().count().saturating_sub(1))
    };
    while kept() < n {
        if child.try_wait().unwrap().is_some() {
            return None;
        }
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    assert!(tests::needs::signal(signal, &child.id().to_string()));
    let code = child.wait().unwrap().code();
    let said = place.read("said");
    (!place.path("out/calibration.json").exists()).then(|| (code, kept(), said))
}

#[cfg(target_os = "linux")]
#[test]
fn a_calibration_that_was_ended_goes_on_with_what_it_has_computed() {
    let undisturbed = long();
    undisturbed.done(&LONG);
    let expected = found(&undisturbed);
    assert!(!undisturbed.path("out/computations.jsonl").exists());
    let place = long();
    let mut before = 0;
    for (signal, more) in [("INT", 5), ("KILL", 7), ("TERM", 9)] {
        let (code, kept, said) = ended(&place, signal, before + more).unwrap();
        if signal != "KILL" {
            assert_eq!(code, Some(130), "{said}");
            assert!(said.contains("computations are kept in out"), "{said}");
            assert!(said.contains("the same command goes on"), "{said}");
        }
        assert!(kept >= before + more, "{signal}: {before} {kept}");
        if before > 0 {
            let taken_over = format!("{before} computations of an earlier call are taken over");
            assert!(said.contains(&taken_over), "{taken_over}: {said}");
        }
        before = kept;
    }
    place.done(&LONG).shows("are taken over");
    // As if nothing had happened, the number of computations included.
    assert_eq!(found(&place), expected);
    assert!(!place.path("out/computations.jsonl").exists());
    assert!(!place.path("out/.trial").exists());
}

#[cfg(target_os = "linux")]
#[test]
fn what_was_computed_of_something_else_is_not_taken_over() {
    let place = long();
    ended(&place, "KILL", 5).unwrap();
    place.write(
        "driver.toml",
        DRIVER.replacen("increments = 20", "increments = 30", 1),
    );
    place.done(&LONG).shows("begun anew");
    let place = long();
    ended(&place, "KILL", 5).unwrap();
    // The noise is no part of it.
    place.write("joint.toml", FILE.replace("noise = 0.1", "noise = 0.2"));
    let outcome = place.run(&LONG);
    outcome.shows("are taken over");
    let place = long();
    ended(&place, "KILL", 5).unwrap();
    let outcome = place.done(&[&LONG[..], &["--anew"]].concat());
    outcome.hides("taken over");
}
