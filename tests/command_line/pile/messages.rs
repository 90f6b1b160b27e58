//! What is wrong or odd about a pile, and where it is written.

use super::{BAR, PILE, rows, run, value};
use crate::program::{BAD_INPUT, DONE, NO_EQUILIBRIUM, Place, refuses_file};
use serde_json::Value;
use std::f64::consts::PI;
use tests::words::has;
use tests::words::{edited, rows_of};

/// Without normal stress, and without strength against tension, its sign in a last bit would decide where the bar holds.
#[test]
fn a_bond_that_begins_without_normal_stress_is_warned_of_where_it_opens() {
    let end = BAR.find("[[phase]]\nname = \"on\"").unwrap();
    let pile = BAR.find("[pile]").unwrap();
    let confined = format!("{}{}", &BAR[..end], &BAR[pile..]);
    let bare = confined.replace("stress_11 = -100.0, stress_33 = -100.0", "stress_33 = 0.0");
    let glued = bare.replace(
        "dilatancy_angle = 0.0 }",
        "dilatancy_angle = 0.0, tensile_strength = 500.0 }",
    );
    let says =
        "interface `bond` began without normal stress, and the bond of its law `bond` breaks";
    // All of the bond is elastic up to a slip of τ/k at the head: P = 2πaτ tanh(βL)/β, β = 0.4/m.
    let expected = 2.0 * PI * 0.0125 * 500.0 * f64::tanh(0.4) / 0.4;
    for text in [&confined, &glued] {
        let place = Place::new();
        let outcome = place.run_case(text);
        outcome.hides("began without normal stress");
        let rows = rows(&place.path("out/history.csv"));
        let head = -value(rows.last().unwrap(), "pile_head_load");
        assert!((head - expected).abs() < 1e-3 * expected, "{head}");
    }
    for increments in ["increments = 2", "increments = 1"] {
        let place = Place::new();
        let outcome = place.run_case(bare.replace("increments = 2", increments));
        outcome.shows(says);
    }
    // A phase in which nothing happens leaves the bond as it was.
    let later = bare.replacen(
        "[[phase]]\n",
        "[[phase]]\nname = \"rest\"\nincrements = 1\n[[phase]]\n",
        1,
    );
    let outcome = Place::new().run_case(later);
    outcome.shows(says);
    // Joined by friction alone it would not have held either.
    let loose = bare.replace("cohesion = 500.0", "cohesion = 0.0");
    let place = Place::new();
    let outcome = place.run_case(loose);
    outcome.hides("began without normal stress");
}

#[test]
fn what_is_no_pile_is_told_where_it_is_written() {
    let run = ["run", "pile.toml", "--out", "out"];
    refuses_file(
        &Place::new(),
        ("pile.toml", PILE),
        &run,
        BAD_INPUT,
        r#"
group = ["top", "foot"] => group = ["top", "fot"]
  [pile]: there is no group `fot`
  pile.toml:
group = ["top", "foot"] => group = "upper"
  `upper` is an interface
  pile.toml:
shaft = ["upper", "lower"] => shaft = ["upper", "lover"]
  there is no group `lover`
  pile.toml:
shaft = ["upper", "lower"] => shaft = ["upper", "soil"]
  `soil` is no interface
  pile.toml:
shaft = ["upper", "lower"] => shaft = []
  `shaft` is an empty list
  pile.toml:
base = "toe"\n => base = "tow"\n
  there is neither a group nor a line `tow`
  pile.toml:
base = "toe"\n => base = "soil"\n
  `soil` is no interface
  pile.toml:
base = "toe"\n => base = "bottom"\n
  `bottom` does not touch the pile's groups
  pile.toml:
base = "toe"\n => base = "inside"\n
  `inside` lies inside the pile's groups
  pile.toml:
head = "head"\n => head = "haed"\n
  there is no line `haed`
  pile.toml:
head = "head"\n => head = "far"\n
  `far` has no edge of the pile's elements: name the line along the top of the pile
  pile.toml:
head = "head"\n => head = "head"\ndiameter = -1.0\n
  diameter
  pile.toml:
[pile] => [probes]\npile_head_load = { line = "head", quantity = "displacement_z" }\n[pile]
  is a column of history.csv already
  pile.toml:
"#,
    );
}

#[test]
fn a_figure_along_the_pile_is_drawn_or_told_what_is_wrong() {
    let figure = |along: &str, x: &str| {
        format!("\n[[figure]]\nname = \"forces\"\nx = \"{x}\"\ny = [\"z\"]\n{along}\n")
    };
    let (place, _) = run(&(PILE.to_owned() + &figure("along_pile = {}", "axial_force")));
    let drawn = place.read("out/forces.svg");
    has(&drawn, "pull, -");
    let without = PILE[..PILE.rfind("[pile]").unwrap()].to_owned();
    for (text, along, x, says) in [
        (
            PILE,
            "along_pile = {}",
            "traction_n",
            "there is no column of pile.csv `traction_n`",
        ),
        (
            PILE,
            "along_pile = {}\npoints = {}",
            "z",
            "over points or along the pile, not both",
        ),
        (&without, "along_pile = {}", "z", "there is no pile"),
    ] {
        let place = Place::new();
        place.write("pile.toml", text.to_owned() + &figure(along, x));
        let outcome = place.run(&["run", "pile.toml"]).ended(BAD_INPUT);
        outcome.shows(says);
    }
}

#[test]
fn what_is_odd_about_a_pile_is_said_before_it_is_loaded() {
    for [edit, says] in rows_of(
        r#"
analysis => analysis | -
shaft = ["upper", "lower"] => shaft = ["upper"] | group `lower` touches the pile between z = -5.0000 and -3.0000 m and is not listed in `shaft`
head = { r = [0.0, 0.4], z = 0.0 } => head = { r = [0.0, 0.2], z = 0.0 } | head line `head` leaves out part of the pile's top, from x = 0.3000 to 0.4000
head = { r = [0.0, 0.4], z = 0.0 } => head = { r = [0.0, 0.4], z = -1.0 } | the pile's groups reach up to z = 0.0000 m, above its head line `head` at -1.0000 m
upper = { r = 0.4, z = [-3.0, 0.0] } => upper = { r = 0.4, z = [-6.0, 0.0] } | elements of shaft `upper` do not touch the pile
"axisymmetric" => "plane_strain" | criteria use its width of 0.4 m; `diameter = 0.8` is the full width
head = "head"\n => head = "head"\ndiameter = 0.8\n | -
displacement = [{ line = "head", z = -0.09 }] => force = [{ line = "head", z = -2e6 }] | phase `push` puts a force of 2000000 kN on the head, 4.0e6 kPa over its section
"#,
    ) {
        let place = Place::new();
        let mut text = edited(PILE, &[edit]);
        if edit.contains("-6.0") {
            let lower = "lower = { formulation = \"zero_thickness\", line = \"lower\", law = \"skin\", active = false }\n";
            text = text
                .replace(lower, "")
                .replace("\"upper\", \"lower\"", "\"upper\"");
            text = text.replace(
                "{ n = 3, to = -5.0 }",
                "{ n = 2, to = -6.0 }, { n = 1, to = -5.0 }",
            );
        }
        place.write("pile.toml", text);
        let outcome = place
            .run(&["run", "pile.toml", "--out", "out", "--dry-run"])
            .ended(DONE);
        if says == "-" {
            outcome.hides("[pile]:");
        } else {
            outcome.shows(says);
        }
    }
}

/// With a coarse tolerance and a method that does not undercut it; with a fine one nothing is printed.
#[test]
fn forces_out_of_balance_are_told_as_a_share_of_the_largest_load() {
    let told = |solver: &str| {
        let place = Place::new();
        place.write("pile.toml", format!("{PILE}[solver]\n{solver}"));
        let outcome = place.done(&["run", "pile.toml", "--out", "out"]);
        let said = format!("{}{}", outcome.stdout, outcome.stderr);
        let line = said
            .lines()
            .find(|line| line.contains("out of balance (phase"));
        (place, line.map(str::to_owned))
    };
    let (_, fine) = told("force_tolerance = 1e-8\n");
    assert_eq!(fine, None);
    let (place, coarse) =
        told("method = \"initial_stress\"\nforce_tolerance = 1e-2\ndisplacement_tolerance = 0.1\n");
    let residual = |phase: &Value| phase["residual_force"].as_f64().unwrap();
    let summary = place.summary();
    let phases = summary["phases"].as_array().unwrap();
    let left = phases.iter().map(residual).fold(0.0, f64::max);
    // 1 % of all forces, of which the weight of the ground is the largest part.
    let weight = PI * 16.0 * 8.0 * 20.0;
    assert!(left > 0.0 && left < 1e-2 * 2.0 * weight, "{left}");
    let history = rows(&place.path("out/history.csv"));
    let in_place = history
        .iter()
        .filter(|row| row["phase"] == "push" || row["phase"] == "pull");
    let loads = in_place.flat_map(|row| {
        ["head", "shaft", "base"].map(|part| value(row, &format!("pile_{part}_load_net")).abs())
    });
    let largest = loads.fold(0.0, f64::max);
    let line = coarse.expect("a line about forces out of balance");
    let share = format!(
        "{:.1} % of its largest load, {largest:.1} kN",
        100.0 * left / largest
    );
    has(&line, format!("{left:.2} kN"));
    has(&line, &share);
    let push = phases.iter().find(|phase| phase["name"] == "push");
    let said = format!("phase `push`</dt><dd>{:.2} kN", residual(push.unwrap()));
    let report = place.read("out/report.html");
    assert!(report.contains(&said), "{said}");
}

/// A foot in clay: a bearing capacity of some 6 c_u = 120 kPa; the shaft slides at 10 kPa from 180 kN on.
#[test]
fn a_pile_that_plunges_slides_and_its_base_yields() {
    let clay = PILE
        .replace("law = \"elastic\", parameters = { young_modulus = 2e4, poisson_ratio = 0.3 }", "law = \"mohr_coulomb\", parameters = { young_modulus = 2e4, poisson_ratio = 0.3, cohesion = 20.0, friction_angle = 0.0, dilatancy_angle = 0.0 }")
        .replace("k_0 = 0.5", "k_0 = 1.0")
        .replace("cohesion = 8.0, friction_angle = 15.0", "cohesion = 10.0, friction_angle = 0.0, tensile_strength = 200.0")
        .replace("displacement = [{ line = \"head\", z = -0.09 }]", "force = [{ line = \"head\", z = -900.0 }]");
    let (text, rest) = clay.split_once("[[phase]]\nname = \"pull\"").unwrap();
    let (_, pile) = rest.split_once("[pile]").unwrap();
    let outcome = Place::new().run_case(format!("{text}[pile]{pile}"));
    outcome
        .ended(NO_EQUILIBRIUM)
        .shows("asks for 900.0: the shaft slides and the base yields;");
}

/// Its own weight moves the pile, and no load its head.
#[test]
fn a_head_without_a_load_has_no_soft_shaft() {
    let stiff = PILE.replace("young_modulus = 2e4", "young_modulus = 2e6");
    let (text, rest) = stiff.split_once("[[phase]]\nname = \"push\"").unwrap();
    let (_, pile) = rest.split_once("[pile]").unwrap();
    let alone = format!("{text}[pile]{pile}");
    Place::new()
        .done_case(alone)
        .hides("elastic slip of the shaft's joints");
}
