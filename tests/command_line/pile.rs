//! `[pile]`: loads that close, what holds along the shaft, resistances, messages.
#![expect(clippy::unwrap_used, reason = "part of the tests")]

mod messages;

use crate::program::{BAD_INPUT, DONE, Place};
use std::collections::HashMap;
use std::f64::consts::PI;
use std::path::Path;
use tests::tolerance::close;
use tests::tolerance::near;
use tests::words::has;

/// A pile of two groups under ground water, wished in place, loaded and pulled.
pub(crate) const PILE: &str = r#"
analysis = "axisymmetric"
supports = [
  { line = "axis", fixed = ["r"] },
  { line = "far", fixed = ["r"] },
  { line = "bottom", fixed = ["r", "z"] },
]
water = { level = -1.3 }
[mesh]
origin = [0.0, -8.0]
columns = [{ n = 2, to = 0.4 }, { n = 4, to = 4.0, ratio = 1.5 }]
rows = [{ n = 3, to = -5.0 }, { n = 2, to = -3.0 }, { n = 3, to = 0.0 }]
region = [
  { group = "soil" },
  { group = "top", r = [0.0, 0.4], z = [-3.0, 0.0] },
  { group = "foot", r = [0.0, 0.4], z = [-5.0, -3.0] },
]
[mesh.lines]
axis = { r = 0.0 }
far = { r = 4.0 }
bottom = { z = -8.0 }
head = { r = [0.0, 0.4], z = 0.0 }
upper = { r = 0.4, z = [-3.0, 0.0] }
lower = { r = 0.4, z = [-5.0, -3.0] }
base = { r = [0.0, 0.4], z = -5.0 }
inside = { r = [0.0, 0.4], z = -3.0 }
[laws]
ground = { law = "elastic", parameters = { young_modulus = 2e4, poisson_ratio = 0.3 } }
concrete = { law = "elastic", parameters = { young_modulus = 3e7, poisson_ratio = 0.2 } }
skin = { law = "coulomb_joint", parameters = { normal_stiffness = 1e6, shear_stiffness = 2e5, cohesion = 8.0, friction_angle = 15.0, dilatancy_angle = 0.0 } }
[groups]
soil = { formulation = "solid", law = "ground", unit_weight = 17.0, saturated_unit_weight = 20.0, initial_stress = { k_0 = 0.5 } }
top = { formulation = "solid", law = "ground", unit_weight = 17.0, saturated_unit_weight = 20.0, initial_stress = { k_0 = 0.5 } }
foot = { formulation = "solid", law = "ground", unit_weight = 17.0, saturated_unit_weight = 20.0, initial_stress = { k_0 = 0.5 } }
upper = { formulation = "zero_thickness", line = "upper", law = "skin", active = false }
lower = { formulation = "zero_thickness", line = "lower", law = "skin", active = false }
toe = { formulation = "zero_thickness", line = "base", law = "skin", active = false }
[[phase]]
name = "rest"
increments = 1
[[phase]]
name = "built"
increments = 3
laws = { top = "concrete", foot = "concrete" }
unit_weight = { top = 24.0, foot = 24.0 }
activate = ["upper", "lower", "toe"]
[[phase]]
name = "push"
increments = 12
reset_displacements = true
rigid = ["head"]
displacement = [{ line = "head", z = -0.09 }]
[[phase]]
name = "pull"
increments = 4
displacement = [{ line = "head", z = 0.01 }]
[pile]
group = ["top", "foot"]
shaft = ["upper", "lower"]
base = "toe"
head = "head"
"#;

pub(crate) type Row = HashMap<String, String>;

pub(crate) fn rows(path: &Path) -> Vec<Row> {
    let text = std::fs::read_to_string(path).unwrap();
    let mut lines = text.lines().map(|line| line.split(',').map(str::to_owned));
    let names: Vec<String> = lines.next().unwrap().collect();
    lines
        .map(|cells| names.iter().cloned().zip(cells).collect())
        .collect()
}

pub(crate) fn value(row: &Row, name: &str) -> f64 {
    row[name].parse().unwrap()
}

pub(crate) fn run(text: &str) -> (Place, String) {
    let place = Place::new();
    place.write("pile.toml", text);
    let outcome = place.done(&["run", "pile.toml", "--out", "out"]);
    (place, outcome.stdout)
}

/// Head and weight against shaft and base, in every row; the ends of the pile against both. Rows before the interfaces
/// are active have no forces.
fn assert_closes(place: &Place, weight: impl Fn(&Row) -> f64) {
    let stations = rows(&place.path("out/pile.csv"));
    for row in rows(&place.path("out/history.csv")) {
        if row["phase"] == "rest" {
            let mut forces = row.iter().filter(|(name, _)| {
                name.starts_with("pile_") && name.as_str() != "pile_settlement"
            });
            assert!(forces.all(|(_, cell)| cell.is_empty()), "{row:?}");
            continue;
        }
        let load = |part: &str| value(&row, &format!("pile_{part}_load"));
        let (head, shaft, base) = (load("head"), load("shaft"), load("base"));
        let scale = 1.0 + head.abs() + shaft.abs() + base.abs();
        let left = head + weight(&row) - shaft - base;
        assert!(left.abs() < 1e-9 * scale, "{left} in {row:?}");
        let same = |other: &&Row| {
            ["phase", "increment"]
                .iter()
                .all(|key| other[*key] == row[*key])
        };
        let own: Vec<&Row> = stations.iter().filter(same).collect();
        let ends = [own[0], own[own.len() - 1]].map(|station| value(station, "axial_force"));
        assert!((ends[0] - head).abs() < 1e-9 * scale, "{ends:?} in {row:?}");
        assert!((ends[1] - base).abs() < 1e-9 * scale, "{ends:?} in {row:?}");
    }
}

#[test]
fn head_and_weight_are_shaft_and_base() {
    let (place, stdout) = run(PILE);
    let area = PI * 0.16;
    let built = area * 5.0 * 24.0;
    let ground = area * (17.0 * 1.3 + 20.0 * 3.7);
    let weight = |row: &Row| match row["phase"].as_str() {
        "rest" => ground,
        "built" => ground + value(row, "increment") / 3.0 * (built - ground),
        _ => built,
    };
    assert_closes(&place, weight);
    let history = rows(&place.path("out/history.csv"));
    // At rest all of the weight and of the water's pressure passes through the base, none through the
    // shaft: not by the interface's own tractions, which is not there yet.
    let stations = rows(&place.path("out/pile.csv"));
    let base = stations.iter().rfind(|row| row["phase"] == "rest").unwrap();
    near(value(base, "axial_force"), ground, 1e-9 * ground);
    assert_at_rest(&stations, area);
    assert_friction_holds(&stations, area);
    // Pulled: the other way round.
    let last = history.last().unwrap();
    assert!(
        value(last, "pile_head_load") < 0.0 && value(last, "pile_shaft_load") < 0.0,
        "{last:?}"
    );
    assert!(
        (value(last, "pile_settlement") + 0.01).abs() < 1e-12,
        "{last:?}"
    );
    assert_resistances(&place, &stdout, &history, area);
}

/// At rest the stress of the ground alone is in the pile and on its shaft.
fn assert_at_rest(stations: &[Row], area: f64) {
    let at_rest = || stations.iter().filter(|row| row["phase"] == "rest");
    for station in at_rest() {
        let z = value(station, "z");
        let above = if z > -1.3 {
            -17.0 * z
        } else {
            17.0 * 1.3 - 20.0 * (z + 1.3)
        };
        let pore = 9.81 * (-1.3 - z).max(0.0);
        let off = |name: &str, expected: f64| {
            let found = value(station, name);
            assert!(
                (found - expected).abs() < 1e-8 * (1.0 + expected),
                "{name}: {station:?}"
            );
        };
        off("axial_force", area * above);
        // In the element that the water table cuts, stresses have a kink.
        if !(-2.5..=-0.5).contains(&z) {
            off("normal_stress", 0.5 * (above - pore));
        }
        off("shaft_friction", 0.0);
        off("slip", 0.0);
    }
    // The stations are the ends and middles of the shaft's elements.
    let z: Vec<f64> = at_rest().map(|row| value(row, "z")).collect();
    let expected: Vec<f64> = (0..=10).map(|i| -0.5 * f64::from(i)).collect();
    assert!(
        z.iter().zip(&expected).all(|(z, e)| (z - e).abs() < 1e-12),
        "{z:?}"
    );
    assert_eq!(z.len(), expected.len());
}

/// Pushed: friction holds the pile up as far as Coulomb's law lets it, and the axial force falls by it.
fn assert_friction_holds(stations: &[Row], area: f64) {
    let pushed: Vec<&Row> = stations
        .iter()
        .filter(|row| row["phase"] == "push" && row["increment"] == "12")
        .collect();
    for station in &pushed {
        let limit = 8.0 + 15.0_f64.to_radians().tan() * value(station, "normal_stress");
        let friction = value(station, "shaft_friction");
        // At the toe elastic ground leaves the shaft.
        let is_toe = value(station, "z") < -4.9;
        assert!(
            (friction > 0.0 || is_toe) && friction < limit * (1.0 + 1e-9),
            "{station:?}"
        );
        assert!(value(station, "slip") > 0.0, "{station:?}");
    }
    for pair in pushed.windows(2) {
        let [a, b] = [pair[0], pair[1]].map(|row| value(row, "axial_force"));
        let own = area * 24.0 * (value(pair[0], "z") - value(pair[1], "z"));
        assert!(b < a + own, "{pair:?}");
    }
}

/// Resistances are read off the curve of the head.
fn assert_resistances(place: &Place, stdout: &str, history: &[Row], area: f64) {
    // The criterion at 10 % of the base's width, between two increments, printed with its split.
    let pile = &place.summary()["pile"];
    assert!((pile["diameter"].as_f64().unwrap() - 0.8).abs() < 1e-12);
    assert_eq!(pile["phase"], "push");
    let push: Vec<&Row> = history
        .iter()
        .filter(|row| row["phase"] == "push")
        .collect();
    let [a, b] = [push[9], push[10]]
        .map(|row| ["pile_settlement", "pile_head_load"].map(|name| value(row, name)));
    let expected = a[1] + (0.08 - a[0]) / (b[0] - a[0]) * (b[1] - a[1]);
    let found = pile["resistance_10_percent_diameter"].as_f64().unwrap();
    near(found, expected, 1e-9 * expected);
    has(stdout, format!("{found:.1} kN, of it shaft"));
    // Davisson: s = Q L/(E A) + 3.8 mm + D/120, on the straight piece of the curve that it crosses.
    let davisson = pile["resistance_davisson"].as_f64().unwrap();
    let s = (davisson - value(&history[3], "pile_head_load")) * 5.0 / (3e7 * area)
        + 0.0038
        + 0.8 / 120.0;
    let before = push
        .iter()
        .rposition(|row| value(row, "pile_settlement") < s)
        .unwrap();
    let [a, b] = [push[before], push[before + 1]]
        .map(|row| ["pile_settlement", "pile_head_load"].map(|name| value(row, name)));
    let expected = a[1] + (s - a[0]) / (b[0] - a[0]) * (b[1] - a[1]);
    near(davisson, expected, 1e-8 * expected);
}

#[test]
fn what_the_curve_does_not_reach_has_a_reason() {
    let (place, stdout) = run(&PILE.replace("z = -0.09", "z = -0.002"));
    let pile = &place.summary()["pile"];
    for name in ["10_percent_diameter", "davisson"] {
        assert!(pile[format!("resistance_{name}")].is_null(), "{pile}");
        let reason = pile[format!("resistance_{name}_reason")].as_str().unwrap();
        assert!(reason.contains("0.002"), "{reason}");
    }
    has(&stdout, "no resistance at 10 % of the diameter");
}

#[test]
fn both_sides_of_a_pile_in_plane_strain_count() {
    let both = PILE
        .replace("analysis = \"axisymmetric\"", "analysis = \"plane_strain\"")
        .replace("origin = [0.0, -8.0]", "origin = [-4.0, -8.0]")
        .replace("columns = [{ n = 2, to = 0.4 }", "columns = [{ n = 4, to = -0.4, ratio = 0.6666666666666667 }, { n = 2, to = 0.0 }, { n = 2, to = 0.4 }")
        .replace("r = [0.0, 0.4]", "x = [-0.4, 0.4]")
        .replace("axis = { r = 0.0 }", "axis = { x = -4.0 }\nleft = { x = -0.4, z = [-5.0, 0.0] }")
        .replace(
            "toe = {",
            "left = { formulation = \"zero_thickness\", line = \"left\", law = \"skin\", active = false }\ntoe = {",
        )
        .replace("[\"upper\", \"lower\", \"toe\"]", "[\"upper\", \"lower\", \"left\", \"toe\"]")
        .replace("shaft = [\"upper\", \"lower\"]", "shaft = [\"upper\", \"lower\", \"left\"]");
    let (place, _) = run(&both);
    let width = 0.8;
    let built = width * 5.0 * 24.0;
    let ground = width * (17.0 * 1.3 + 20.0 * 3.7);
    assert_closes(&place, |row| match row["phase"].as_str() {
        "rest" => ground,
        "built" => ground + value(row, "increment") / 3.0 * (built - ground),
        _ => built,
    });
    // One side alone, with the symmetry in the middle, is half of it.
    let half = PILE.replace("analysis = \"axisymmetric\"", "analysis = \"plane_strain\"");
    let (one, _) = run(&half);
    let last = |place: &Place| {
        let history = rows(&place.path("out/history.csv"));
        let row = history.iter().rfind(|row| row["phase"] == "push").unwrap();
        ["pile_head_load", "pile_shaft_load", "pile_base_load"].map(|name| value(row, name))
    };
    for (two, one) in last(&place).into_iter().zip(last(&one)) {
        near(two, 2.0 * one, 1e-3 * two.abs());
    }
}

/// An elastic bar of a radius of 12.5 mm in rigid surroundings, 1 m of bond, confined by 100 kPa.
const BAR: &str = r#"
analysis = "axisymmetric"
supports = [
  { line = "outer", fixed = ["r", "z"] },
  { line = "top", fixed = ["r", "z"] },
  { line = "under", fixed = ["r", "z"] },
]
[mesh]
columns = [{ n = 1, to = 0.0125 }, { n = 1, to = 0.05 }]
rows = [{ n = 80, to = 1.0 }]
region = [{ group = "rock" }, { group = "bar", r = [0.0, 0.0125] }]
[mesh.lines]
wall = { r = 0.0125 }
outer = { r = 0.05 }
top = { r = [0.0125, 0.05], z = 1.0 }
under = { r = [0.0125, 0.05], z = 0.0 }
head = { r = [0.0, 0.0125], z = 1.0 }
foot = { r = [0.0, 0.0125], z = 0.0 }
[laws]
steel = { law = "elastic", parameters = { young_modulus = 2e8, poisson_ratio = 0.0 } }
rigid = { law = "elastic", parameters = { young_modulus = 1e13, poisson_ratio = 0.0 } }
bond = { law = "coulomb_joint", parameters = { normal_stiffness = 1e4, shear_stiffness = 2e5, cohesion = 500.0, friction_angle = 0.0, dilatancy_angle = 0.0 } }
[groups]
bar = { formulation = "solid", law = "steel", initial_stress = { stress_11 = -100.0, stress_33 = -100.0 } }
rock = { formulation = "solid", law = "rigid", initial_stress = { stress_11 = -100.0, stress_33 = -100.0 } }
bond = { formulation = "zero_thickness", line = "wall", law = "bond" }
[[phase]]
name = "pull"
increments = 2
displacement = [{ line = "head", z = 0.0025 }]
[[phase]]
name = "on"
increments = 4
displacement = [{ line = "head", z = 0.00264869 }]
[pile]
group = "bar"
shaft = "bond"
base = "foot"
head = "head"
"#;

/// Pull-out of an elastic bar from rigid surroundings, bond elastic to τ at the slip τ/k and level from
/// there. P = 2πaτ (x + tanh β(L − x)/β) where the plastic length is x, at the displacement
/// u = τ/k (1 + βx tanh β(L − x) + β²x²/2), with β² = 2πak/(EA).
#[test]
fn a_bar_is_pulled_out_by_its_shear_lag() {
    let (a, length, modulus, k, tau) = (0.0125, 1.0, 2e8, 2e5, 500.0);
    let beta = f64::sqrt(2.0 * k / (modulus * a));
    let (place, _) = run(BAR);
    assert_closes(&place, |_| 0.0);
    let stations = rows(&place.path("out/pile.csv"));
    for row in rows(&place.path("out/history.csv")) {
        let moved = -value(&row, "pile_settlement");
        // The plastic length by bisection; below τ/k (1 + …) all is elastic.
        let end = |x: f64| {
            let (bx, rest) = (beta * x, (beta * (length - x)).tanh());
            tau / k * (1.0 + bx * rest + bx * bx / 2.0)
        };
        let (mut low, mut high) = (0.0, length);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if end(middle) < moved {
                low = middle;
            } else {
                high = middle;
            }
        }
        let x = low;
        let force = |x: f64| 2.0 * PI * a * tau * (x + (beta * (length - x)).tanh() / beta);
        let expected = if moved < tau / k { f64::NAN } else { force(x) };
        if expected.is_nan() {
            continue;
        }
        let head = value(&row, "pile_head_load");
        assert!(
            (head + expected).abs() < 2e-3 * expected,
            "{head} for {expected}"
        );
        assert!(
            value(&row, "pile_base_load").abs() < 1e-9 * expected,
            "{row:?}"
        );
        let own = stations
            .iter()
            .filter(|s| s["phase"] == row["phase"] && s["increment"] == row["increment"]);
        for station in own {
            let depth = length - value(station, "z");
            let (axial, friction) = (
                value(station, "axial_force"),
                value(station, "shaft_friction"),
            );
            let (n, t) = if depth <= x {
                (expected - 2.0 * PI * a * tau * depth, tau)
            } else {
                let (far, near) = (beta * (length - depth), beta * (length - x));
                let t = tau * far.cosh() / near.cosh();
                (2.0 * PI * a * tau * far.sinh() / near.cosh() / beta, t)
            };
            assert!(
                (axial + n).abs() < 4e-3 * expected,
                "{axial} for {n} at depth {depth}"
            );
            assert!(
                (friction + t).abs() < 1e-2 * tau,
                "{friction} for {t} at depth {depth}"
            );
            assert!(value(station, "slip") <= 0.0, "{station:?}");
        }
    }
}

#[test]
fn a_pile_that_is_not_there_has_no_rows() {
    let text = PILE
        .replace("[[phase]]\nname = \"pull\"", "[[phase]]\nname = \"gone\"")
        .replace(
            "increments = 4\ndisplacement = [{ line = \"head\", z = 0.01 }]",
            "increments = 2\ndeactivate = [\"top\", \"foot\", \"upper\", \"lower\", \"toe\"]\nfree = [{ line = \"head\", components = [\"z\"] }]",
        );
    let (place, _) = run(&text);
    let history = rows(&place.path("out/history.csv"));
    let last = history.last().unwrap();
    assert_eq!(
        (last["phase"].as_str(), last["pile_head_load"].as_str()),
        ("gone", "")
    );
    assert!(
        rows(&place.path("out/pile.csv"))
            .iter()
            .all(|row| row["phase"] != "gone")
    );
}

/// A part of the pile is taken away and its interface is not: this ended in singular equations.
#[test]
fn an_interface_does_not_outlive_its_pile() {
    let place = Place::new();
    let taken = "name = \"push\"\ndeactivate = [\"foot\"]\n";
    place.write("pile.toml", PILE.replace("name = \"push\"\n", taken));
    let outcome = place.refused(&["run", "pile.toml", "--out", "out"]);
    let line = 1
        + PILE
            .lines()
            .position(|line| line == "name = \"push\"")
            .unwrap()
        + 1;
    outcome
        .shows(
            "interface `lower` is active and the ground on one of its sides, group `foot`, is not",
        )
        .shows(format!("pile.toml:{line}:"))
        .shows("`deactivate` has `lower` too");
}

/// A tube holds more outside than inside: its mean friction is that by their girths.
#[test]
fn the_friction_of_a_tube_is_the_mean_by_girth() {
    let (inside, outside) = (10.0, 30.0);
    let text = PILE
        .replace("columns = [{ n = 2, to = 0.4 }", "columns = [{ n = 2, to = 0.2 }, { n = 1, to = 0.4 }")
        .replace("r = [0.0, 0.4]", "r = [0.2, 0.4]")
        .replace("[laws]\n", &format!("inner = {{ r = 0.2, z = [-5.0, 0.0] }}\n[laws]\nrough = {{ law = \"coulomb_joint\", parameters = {{ normal_stiffness = 1e6, shear_stiffness = 2e5, cohesion = {inside}, friction_angle = 0.0, dilatancy_angle = 0.0 }} }}\n"))
        .replace("cohesion = 8.0, friction_angle = 15.0", &format!("cohesion = {outside}, friction_angle = 0.0"))
        .replace(
            "toe = {",
            "inner = { formulation = \"zero_thickness\", line = \"inner\", law = \"rough\", active = false }\ntoe = {",
        )
        .replace("[\"upper\", \"lower\", \"toe\"]", "[\"upper\", \"lower\", \"inner\", \"toe\"]")
        .replace("shaft = [\"upper\", \"lower\"]", "shaft = [\"upper\", \"lower\", \"inner\"]")
        // What is inside stays where it is.
        .replace("line = \"axis\"\nfixed = [\"r\"]", "line = \"axis\"\nfixed = [\"r\", \"z\"]");
    let (place, _) = run(&text);
    let stations = rows(&place.path("out/pile.csv"));
    let last = stations
        .iter()
        .filter(|row| row["phase"] == "push" && row["increment"] == "12");
    // Both sides slide.
    let expected = (0.2 * inside + 0.4 * outside) / 0.6;
    let slides = last.filter(|row| (value(row, "shaft_friction") - expected).abs() < 1e-6);
    assert!(slides.count() >= 3, "{expected}: {stations:?}");
    assert_closes(&place, |row| match row["phase"].as_str() {
        "rest" => PI * 0.12 * (17.0 * 1.3 + 20.0 * 3.7),
        "built" => {
            let ground = PI * 0.12 * (17.0 * 1.3 + 20.0 * 3.7);
            ground + value(row, "increment") / 3.0 * (PI * 0.12 * 5.0 * 24.0 - ground)
        }
        _ => PI * 0.12 * 5.0 * 24.0,
    });
}

/// The picture of the test begins where the test does: at the state that the phase before it left, or
/// at its own zero where settlements are counted again.
#[test]
fn the_curve_of_a_test_begins_where_the_phase_before_it_ended() {
    let (before, rest) = PILE.split_once("[[phase]]\nname = \"pull\"").unwrap();
    let (_, pile) = rest.split_once("[pile]").unwrap();
    let force = "force = [{ line = \"head\", z = -300.0 }]";
    let pushed = format!("{before}[pile]{pile}")
        .replace("displacement = [{ line = \"head\", z = -0.09 }]", force);
    assert!(pushed.contains(force));
    for resets in [true, false] {
        let keep = if resets {
            "reset_displacements = true\n"
        } else {
            ""
        };
        let text = pushed.replace("reset_displacements = true\n", keep);
        let (place, _) = run(&text);
        let history = rows(&place.path("out/history.csv"));
        let before = history.iter().rfind(|row| row["phase"] == "built").unwrap();
        let start = &place.summary()["pile"]["start"];
        let settled = if resets {
            0.0
        } else {
            value(before, "pile_settlement")
        };
        let loads = ["pile_head_load", "pile_shaft_load", "pile_base_load"];
        let expected = std::iter::once(settled).chain(loads.map(|name| value(before, name)));
        for (i, expected) in expected.enumerate() {
            let found = start[i].as_f64().unwrap();
            close(start, found, expected, 1e-9 * expected.abs());
        }
    }
}

/// Earth pressure beyond the ground's strength is refused by a dry run as by a run.
#[test]
fn a_dry_run_asks_the_laws_for_their_strength() {
    let ground =
        "ground = { law = \"elastic\", parameters = { young_modulus = 2e4, poisson_ratio = 0.3 } }";
    let sand = "ground = { law = \"mohr_coulomb\", parameters = { young_modulus = 2e4, poisson_ratio = 0.3, cohesion = 0.0, friction_angle = 30.0, dilatancy_angle = 0.0 } }";
    // Between 1/3 and 3 the ratio is within the strength.
    for (k_0, code) in [("0.5", DONE), ("0.2", BAD_INPUT), ("4.0", BAD_INPUT)] {
        let place = Place::new();
        assert!(PILE.contains(ground));
        let text = PILE
            .replacen(ground, sand, 1)
            .replace("k_0 = 0.5", &format!("k_0 = {k_0}"));
        place.write("pile.toml", text);
        let mut arguments = vec!["run", "pile.toml", "--out", "out"];
        if code == DONE {
            arguments.push("--dry-run");
        }
        let outcome = place.run(&arguments).ended(code);
        if code == BAD_INPUT {
            arguments.push("--dry-run");
            assert_eq!(place.run(&arguments).stderr, outcome.stderr);
            // The run has found it before it wrote anything.
            assert_eq!(place.contents(), ["pile.toml"]);
            outcome
                .shows("outside the strength of law")
                .shows("pile.toml:");
        }
    }
}
