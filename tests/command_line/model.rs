//! Ground under water on a mesh of quads and triangles: what tables, probes and reports say of it, and what
//! a dry run shows of it before.
#![allow(
    clippy::unwrap_used,
    clippy::float_cmp,
    reason = "part of the tests; nodes at one place have equal bits"
)]

use crate::program::Place;
use std::fmt::Write as _;
use tests::case::{column, table};
use tests::words::edited;
use tests::words::rows_of;

/// Ground 2 m wide and 3 m deep as Gmsh writes it: quads to the left of a line in the middle, triangles to
/// the right of it.
fn ground() -> String {
    const NAMES: [(usize, &str); 9] = [
        (2, "left"),
        (2, "right"),
        (1, "bottom"),
        (1, "top"),
        (1, "west"),
        (1, "east"),
        (1, "cut"),
        (1, "between"),
        (0, "corner"),
    ];
    let mut nodes: Vec<[f64; 2]> = Vec::new();
    let mut elements: Vec<(usize, usize, Vec<usize>)> = Vec::new();
    let mut add = |kind: usize, name: &str, corners: &[[f64; 2]]| {
        let mut node = |at: [f64; 2]| {
            let found = nodes.iter().position(|other| *other == at);
            1 + found.unwrap_or_else(|| {
                nodes.push(at);
                nodes.len() - 1
            })
        };
        let n = corners.len();
        let sides = match n {
            1 => 0,
            2 => 1,
            n => n,
        };
        let mut all: Vec<usize> = corners.iter().map(|at| node(*at)).collect();
        let middle = |i: usize| {
            let (a, b) = (corners[i], corners[(i + 1) % n]);
            [f64::midpoint(a[0], b[0]), f64::midpoint(a[1], b[1])]
        };
        all.extend((0..sides).map(|i| node(middle(i))));
        let tag = 1 + NAMES.iter().position(|(_, other)| *other == name).unwrap();
        elements.push((kind, tag, all));
    };
    for row in [0.0, 1.0, 2.0] {
        add(
            16,
            "left",
            &[[0.0, row], [1.0, row], [1.0, row + 1.0], [0.0, row + 1.0]],
        );
        add(9, "right", &[[1.0, row], [2.0, row], [2.0, row + 1.0]]);
        add(
            9,
            "right",
            &[[1.0, row], [2.0, row + 1.0], [1.0, row + 1.0]],
        );
        for (name, x) in [("west", 0.0), ("between", 1.0), ("east", 2.0)] {
            add(8, name, &[[x, row], [x, row + 1.0]]);
        }
    }
    for (name, y) in [("bottom", 0.0), ("cut", 1.0), ("top", 3.0)] {
        for x in [0.0, 1.0] {
            add(8, name, &[[x, y], [x + 1.0, y]]);
        }
    }
    add(15, "corner", &[[0.0, 3.0]]);
    let mut text = format!(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n{}\n",
        NAMES.len()
    );
    for (tag, (dimension, name)) in (1..).zip(NAMES) {
        let _ = writeln!(text, "{dimension} {tag} \"{name}\"");
    }
    let _ = writeln!(text, "$EndPhysicalNames\n$Nodes\n{}", nodes.len());
    for (number, [x, y]) in (1..).zip(&nodes) {
        let _ = writeln!(text, "{number} {x} {y} 0");
    }
    let _ = writeln!(text, "$EndNodes\n$Elements\n{}", elements.len());
    for (number, (kind, tag, nodes)) in (1..).zip(&elements) {
        let nodes: Vec<String> = nodes.iter().map(ToString::to_string).collect();
        let _ = writeln!(text, "{number} {kind} 2 {tag} {tag} {}", nodes.join(" "));
    }
    text + "$EndElements\n"
}

const CASE: &str = r#"title = "Ground under water"
analysis = "plane_strain"
supports = [
  { line = "bottom", fixed = ["x", "y"] },
  { line = "west", fixed = ["x"] },
  { line = "east", fixed = ["x"] },
]
mesh = { file = "ground.msh" }
water = { level = 2.0 }

[laws.soil]
law = "elastic"
parameters = { young_modulus = 1e4, poisson_ratio = 0.3 }
[laws.joint]
law = "coulomb_joint"
parameters = { normal_stiffness = 1e6, shear_stiffness = 4e5, cohesion = 10.0, friction_angle = 30.0, dilatancy_angle = 0.0 }

[groups]
left = { formulation = "solid", law = "soil", unit_weight = 18.0, saturated_unit_weight = 20.0, initial_stress = { k_0 = 0.5 } }
right = { formulation = "solid", law = "soil", unit_weight = 18.0, saturated_unit_weight = 20.0, initial_stress = { k_0 = 0.5 } }
joint = { formulation = "zero_thickness", line = "between", law = "joint", active = false }


[[phase]]
name = "ground"
increments = 1
[[phase]]
name = "parted"
increments = 2
activate = ["joint"]
[[phase]]
name = "dug"
increments = 1
deactivate = ["left", "joint"]

[probes]
of_left = { line = "cut", group = "left", quantity = "force_y" }
of_right = { line = "cut", group = "right", quantity = "force_y" }
surface = { line = "top", group = "right", quantity = "force_y" }
weight = { line = "bottom", quantity = "reaction_y" }
water = { group = "left", quantity = "pore_pressure", reduce = "average" }
deepest = { group = "right", quantity = "pore_pressure", reduce = "max" }
water_volume = { group = "right", quantity = "pore_pressure", reduce = "integral" }
total = { group = "right", quantity = "total_stress_22", reduce = "average" }
effective = { group = "right", quantity = "stress_22", reduce = "average" }
excess = { group = "right", quantity = "excess_pore_pressure" }
faces = { group = "joint", quantity = "pore_pressure", reduce = "average" }
pressed = { group = "joint", quantity = "traction_n", reduce = "integral" }
corner = { line = "corner", quantity = "displacement_y" }

[output]
points = "phases"
profile = "phases"
fields = "phases"
"#;

fn place() -> Place {
    let place = Place::new();
    place.write("ground.msh", ground());
    place
}

fn close(value: f64, expected: f64, what: &str) {
    tests::tolerance::close(what, value, expected, 1e-6 * expected.abs().max(1.0));
}

#[test]
fn ground_under_water_is_what_it_is_by_hand() {
    let place = place();
    place.done_case(CASE).shows("phase ground: at rest within ");
    let history = place.path("out/history.csv");
    let first = |name: &str| column(&history, name)[0];
    // 1 m of 18 and 1 m of 20 kN/m³ above the line, through quads and through triangles.
    close(first("of_left"), 38.0, "of_left");
    close(first("of_right"), 38.0, "of_right");
    close(first("surface"), 0.0, "surface");
    close(first("weight"), 2.0 * (18.0 + 40.0), "weight");
    close(first("water"), 9.81 * 2.0 / 3.0, "water");
    close(first("water_volume"), 9.81 * 2.0, "water_volume");
    close(first("total"), -(9.0 + 36.0 + 40.0) / 3.0, "total");
    close(
        first("effective"),
        first("total") + 9.81 * 2.0 / 3.0,
        "effective",
    );
    close(first("excess"), 0.0, "excess");
    assert!((15.0..19.62).contains(&first("deepest")));
    // What is not there has no values: the joint before it comes, the left part after it has gone.
    let cells = |name: &str| -> Vec<String> {
        table(&history)
            .iter()
            .map(|row| row[name].clone())
            .collect()
    };
    assert_eq!(
        cells("faces")
            .iter()
            .map(String::is_empty)
            .collect::<Vec<_>>(),
        [true, false, false, true]
    );
    assert_eq!(
        cells("water")
            .iter()
            .map(String::is_empty)
            .collect::<Vec<_>>(),
        [false, false, false, true]
    );
    assert_eq!(
        cells("of_left")
            .iter()
            .map(String::is_empty)
            .collect::<Vec<_>>(),
        [false, false, false, true]
    );
    // Whole from the first increment on.
    close(first("faces"), 9.81 * 2.0 / 3.0, "faces");
    // K_0 σ'_v on the joint.
    close(first("pressed"), -0.5 * (85.0 - 9.81 * 2.0), "pressed");
}

#[test]
fn tables_and_fields_know_the_water_and_what_is_there() {
    let place = place();
    place.done_case(CASE);
    let points = table(&place.path("out/points.csv"));
    for row in &points {
        let value = |name: &str| -> f64 { row[name].parse().unwrap() };
        let pressure = value("pore_pressure") + value("excess_pore_pressure");
        for component in ["11", "22", "33"] {
            let total = value(&format!("stress_{component}")) - pressure;
            close(
                value(&format!("total_stress_{component}")),
                total,
                component,
            );
        }
        close(value("total_stress_12"), value("stress_12"), "12");
        close(
            value("pore_pressure"),
            9.81 * (2.0 - value("y")).max(0.0),
            "pore_pressure",
        );
    }
    let has = |phase: &str, group: &str, rows: &[std::collections::BTreeMap<String, String>]| {
        rows.iter()
            .any(|row| row["phase"] == phase && row["group"] == group)
    };
    assert!(has("parted", "left", &points) && !has("dug", "left", &points));
    let profile = table(&place.path("out/profile.csv"));
    assert!(!has("ground", "joint", &profile) && has("parted", "joint", &profile));
    assert!(
        profile
            .iter()
            .any(|row| row["pore_pressure"].parse::<f64>().unwrap() > 9.0)
    );
    let fields = |number: usize| {
        let name = format!("out/fields_{number:05}.vtu");
        place.read(&name)
    };
    let array = |text: &str, name: &str| -> Vec<f64> {
        let (_, rest) = text.split_once(&format!("Name=\"{name}\"")).unwrap();
        let (_, rest) = rest.split_once('>').unwrap();
        let (values, _) = rest.split_once('<').unwrap();
        values
            .split_whitespace()
            .map(|value| value.parse().unwrap())
            .collect()
    };
    // Three quads, six triangles, three elements of the joint.
    let (before, after) = (array(&fields(0), "active"), array(&fields(2), "active"));
    assert_eq!(before, [[1.0; 9].as_slice(), &[0.0; 3]].concat());
    assert_eq!(after, [[0.0; 3].as_slice(), &[1.0; 6], &[0.0; 3]].concat());
    assert!(
        array(&fields(2), "stress_22")[..3]
            .iter()
            .all(|value| *value == 0.0)
    );
    assert!(
        array(&fields(2), "pore_pressure")[3..9]
            .iter()
            .any(|value| *value > 9.0)
    );
    // The report shows triangles, and knows what is not there.
    let report = place.read("out/report.html");
    assert!(report.contains("id=\"contour\"") && report.contains("\"inactive\":[2]"));
    assert!(!report.contains("left out</li>"), "something was left out");
    let summary = place.summary();
    assert!(summary["phases"][0]["at_rest"].as_f64().unwrap() < 1e-9);
    assert!(summary["phases"][1]["at_rest"].is_null());
    assert_eq!(summary["probe_units"]["total"], "kPa");
}

#[test]
fn quantities_of_the_water_are_suggested_where_there_is_some() {
    let place = place();
    let outcome = place.refused_case(CASE.replacen("\"pore_pressure\"", "\"pore_presure\"", 1));
    outcome.shows("did you mean `pore_pressure`?");
    let outcome = place.refused_case(CASE.replacen("water = { level = 2.0 }\n", "", 1));
    outcome.shows("there is no water in the case");
}

/// Nothing would be left to compute: that was a run without rows.
#[test]
fn a_phase_without_groups_is_refused() {
    let taken = "deactivate = [\"left\", \"joint\"]";
    let everything = CASE.replace(taken, "deactivate = [\"left\", \"right\", \"joint\"]");
    let never_there = CASE.replace("initial_stress = { k_0 = 0.5 }", "active = false");
    for (case, phase) in [(everything, "dug"), (never_there, "ground")] {
        let place = place();
        let outcome = place.refused_case(&case);
        let says = format!("no group is active in phase `{phase}`");
        outcome.shows(&says).shows("case.toml:");
    }
}

#[test]
fn a_dry_run_shows_the_model_and_computes_nothing() {
    let place = place();
    place.write("case.toml", CASE);
    let dry = ["run", "case.toml", "--out", "out", "--dry-run"];
    place.done(&dry);
    let files = |folder: &str| -> Vec<String> {
        let entries = std::fs::read_dir(place.path(folder)).unwrap();
        entries
            .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
            .collect()
    };
    assert_eq!(files("out"), ["report.html"]);
    let report = place.read("out/report.html");
    for text in [
        "Ground under water",
        "dry run: nothing computed",
        "\"pore_pressure\"",
        "\"stress_22\"",
        "\"name\":\"cut\"",
        "not active",
    ] {
        assert!(report.contains(text), "{text}");
    }
    // A run takes the folder over; a dry run leaves its results as they are.
    place.done_case(CASE);
    let history = std::fs::read(place.path("out/history.csv")).unwrap();
    let report = std::fs::read(place.path("out/report.html")).unwrap();
    place.refused(&dry).shows("out holds the results of a run");
    assert_eq!(
        std::fs::read(place.path("out/history.csv")).unwrap(),
        history
    );
    assert_eq!(
        std::fs::read(place.path("out/report.html")).unwrap(),
        report
    );
}

#[test]
fn a_dry_run_finds_what_a_run_would_refuse_and_leaves_nothing() {
    let place = place();
    for [old, new, says] in rows_of(
        r#"
line = "bottom" | line = "botom" | there is no line `botom`
friction_angle = 30.0 | friction_angle = 95.0 | friction_angle
quantity = "force_y" | quantity = "force_q" | force_q
"#,
    ) {
        place.write("case.toml", CASE.replacen(old, new, 1));
        let outcome = place.refused(&["run", "case.toml", "--out", "none", "--dry-run"]);
        outcome.shows(says);
        assert!(!place.path("none").exists());
    }
}

#[test]
fn a_dry_run_of_variants_reports_each() {
    let place = place();
    let variants =
        "\n[[variant]]\nname = \"low\"\nwater.level = 1.0\n[[variant]]\nname = \"high\"\n";
    place.write("case.toml", CASE.to_owned() + variants);
    place.done(&["run", "case.toml", "--out", "out", "--dry-run"]);
    for (variant, level) in [("low", "1 m"), ("high", "2 m")] {
        let report = place.path(&format!("out/{variant}/report.html"));
        let report = std::fs::read_to_string(report).unwrap();
        assert!(report.contains(&format!("<td>{level}</td>")), "{variant}");
    }
}

#[test]
fn laws_that_no_group_takes_are_noted() {
    let spare = "[laws.spare]\nlaw = \"elastic\"\nparameters = { young_modulus = 1e4, poisson_ratio = 0.3 }\n\n[laws.soil]";
    let text = crate::program::CASE.replacen("[laws.soil]", spare, 1);
    let note = "no group takes the laws `spare` of [laws]";
    let place = Place::new();
    place.done_case(&text).shows(note);
    // A file may be the base of others, which take them.
    place.write("more.toml", "base = \"case.toml\"\n");
    let outcome = place.run(&["run", "more.toml", "--out", "out"]);
    outcome.hides("no group takes");
    let taken = format!(
        "{text}\n[[phase]]\nname = \"later\"\nincrements = 1\nlaws = {{ soil = \"spare\" }}\n"
    );
    let outcome = place.run_case(taken);
    outcome.hides("no group takes");
}

/// Warnings of a run of the case with another law that nothing takes, and of a dry run.
fn said_of_spare(place: &Place, law: &str) -> [Vec<String>; 2] {
    let spare = format!("[laws.spare]\n{law}\n\n[laws.soil]");
    let text = crate::program::CASE.replacen("[laws.soil]", &spare, 1);
    place.write("case.toml", text);
    [("run", "--checkpoint=0"), ("dry", "--dry-run")]
        .map(|(out, option)| said(place, "case.toml", out, option))
}

fn said(place: &Place, file: &str, out: &str, option: &str) -> Vec<String> {
    drop(std::fs::remove_dir_all(place.path(out)));
    let outcome = place.done(&["run", file, "--out", out, option]);
    let lines = outcome.stderr.lines();
    let of_spare = lines.filter(|line| line.contains("law `spare` of [laws]"));
    of_spare.map(str::to_owned).collect()
}

#[test]
fn what_is_wrong_with_laws_that_nothing_takes_is_a_warning() {
    let place = Place::new();
    let right = "law = \"elastic\"\nparameters = { young_modulus = 1e4, poisson_ratio = 0.3 }";
    for looked in said_of_spare(&place, right) {
        assert!(looked.is_empty(), "{looked:?}");
    }
    // What a run says, of laws that it knows anyway, and a dry run of all.
    for [edit, line, says, kind] in rows_of(
        r#"
young_modulus => young_module | 29 | did you mean `young_modulus`? | run
0.3 => 0.7 | 29 | 0.7 is outside (-1, 0.5) | run
, poisson_ratio = 0.3 =>  | 28 | needs parameter `poisson_ratio` | run
0.3 } => 0.3 }\ninitial = { gap = 1.0 } | 30 | has no internal variable `gap` | run
elastic => coulomb_joint | 29 | `coulomb_joint` has no parameter `young_modulus` | run
1e4 => { z = [[0, 1e4], [1, -2e4]] } | 29 | -20000 kPa is outside | dry run
elastic => elastc | 28 | did you mean `elastic`? | dry run
elastic"\nparameters = { young_modulus = 1e4, poisson_ratio = 0.3 => mohr_coulomb"\nparameters = { young_modulus = 1e4, poisson_ratio = 0.7 | 29 | 0.7 is outside | dry run
0.3 } => 0.3 }\nadapter = "umat"\nlibrary = "none.so" | 31 | there is no file | dry run
"#,
    ) {
        let in_run = kind == "run";
        let law = edited(right, &[edit]);
        let [run, dry] = said_of_spare(&place, &law);
        assert_eq!(run.len(), usize::from(in_run), "{law}\n{run:?}");
        assert_eq!(dry.len(), 1, "{law}\n{dry:?}");
        for said in run.iter().chain(&dry) {
            assert!(said.contains(says), "{says}\n{said}");
            assert!(said.contains(&format!("case.toml:{line}:")), "{said}");
        }
    }
}

/// A law is looked at as a whole where its file is: another file may complete it, and a zone its filler.
#[test]
fn laws_that_others_complete_may_lack_parameters() {
    let place = Place::new();
    let lacks = "law = \"elastic\"\nparameters = { young_modulus = 1e4 }";
    let [_, alone] = said_of_spare(&place, lacks);
    assert_eq!(alone.len(), 1);
    place.write("more.toml", "base = \"case.toml\"\n");
    assert!(said(&place, "more.toml", "dry", "--dry-run").is_empty());
    place.write(
        "more.toml",
        "base = \"case.toml\"\nlaws.spare.parameters.poisson_ratio = 0.7\n",
    );
    let wrong = said(&place, "more.toml", "dry", "--dry-run");
    assert!(
        wrong.len() == 1 && wrong[0].contains("more.toml:2:"),
        "{wrong:?}"
    );
    let zone = "\n\n[laws.zone]\nadapter = \"shear_zone\"\nlaw = \"spare\"\nthickness = 0.01\n\
                parameters = { poisson_ratio = 0.3 }";
    let [_, filler] = said_of_spare(&place, &format!("{lacks}{zone}"));
    assert!(filler.is_empty(), "{filler:?}");
}

#[test]
fn a_report_of_a_folder_without_results_says_what_is_missing() {
    let place = Place::new();
    std::fs::create_dir(place.path("empty")).unwrap();
    for (folder, says) in [
        ("empty", "empty has no results of a run (`history.csv`)"),
        ("nowhere", "nowhere is no folder"),
    ] {
        let outcome = place.refused(&["report", folder]);
        outcome.shows(says).shows("pilum run");
    }
}
