//! Net loads, rows along the shaft, downdrag, uplift and cycles of a pile.
//!
//! Goal        forces change and reverse as they do by hand.
//! Set-up      the pile of `pile.rs`; a rigid pile of radius 0.25 m in a stiff ring of ground, 10 m, with an elastic,
//!             perfectly plastic joint of stiffness k between them, nothing under its base.
//! Asserts     sums and Simpson's rule to round-off; closed forms of the ring (r = 2πRkL):
//!             pushed, s = P/r; ground that sinks by u z/L: s = u/2 + P/r, neutral plane at z = s L/u,
//!             dragload 2πRk u (L − z)²/(2L), largest force P + dragload.

use crate::pile::{PILE, Row, rows, run, value};
use crate::program::Place;
use serde_json::Value;
use std::f64::consts::PI;
use tests::tolerance::near;
use tests::words::words;

const RADIUS: f64 = 0.25;
const LENGTH: f64 = 10.0;
const STIFFNESS: f64 = 2e4;
/// 2πRkL, kN/m.
const STIFFNESS_OF_SHAFT: f64 = 2.0 * PI * RADIUS * STIFFNESS * LENGTH;

/// A rigid pile in a ring of stiff ground, by its phases; `cohesion` of the joint in kPa.
fn ring(cohesion: f64, phases: &str) -> String {
    format!(
        r#"
analysis = "axisymmetric"
supports = [{{ line = "axis", fixed = ["r"] }}, {{ line = "outer", fixed = ["r"] }}, {{ line = "under", fixed = ["r", "z"] }}]
[mesh]
columns = [{{ n = 1, to = {RADIUS} }}, {{ n = 1, to = 0.5 }}]
rows = [{{ n = 8, to = {LENGTH} }}]
region = [{{ group = "ground" }}, {{ group = "pile", r = [0.0, {RADIUS}] }}]
[mesh.lines]
axis = {{ r = 0.0 }}
wall = {{ r = {RADIUS} }}
outer = {{ r = 0.5 }}
top = {{ r = [{RADIUS}, 0.5], z = {LENGTH} }}
under = {{ r = [{RADIUS}, 0.5], z = 0.0 }}
head = {{ r = [0.0, {RADIUS}], z = {LENGTH} }}
foot = {{ r = [0.0, {RADIUS}], z = 0.0 }}
[laws]
rigid = {{ law = "elastic", parameters = {{ young_modulus = 1e13, poisson_ratio = 0.0 }} }}
steel = {{ law = "elastic", parameters = {{ young_modulus = 1e13, poisson_ratio = 0.0 }} }}
skin = {{ law = "coulomb_joint", parameters = {{ normal_stiffness = 1e6, shear_stiffness = {STIFFNESS}, cohesion = {cohesion}, friction_angle = 0.0, dilatancy_angle = 0.0 }} }}
[groups]
pile = {{ formulation = "solid", law = "steel", initial_stress = {{ stress_11 = -100.0, stress_33 = -100.0 }} }}
ground = {{ formulation = "solid", law = "rigid", initial_stress = {{ stress_11 = -100.0, stress_33 = -100.0 }} }}
skin = {{ formulation = "zero_thickness", line = "wall", law = "skin" }}
{phases}
[pile]
group = "pile"
shaft = "skin"
base = "foot"
head = "head"
"#
    )
}

fn close(found: f64, expected: f64, scale: f64, what: &str) {
    tests::tolerance::close(what, found, expected, scale * (1.0 + expected.abs()));
}

fn of<'r>(table: &'r [Row], place: &Row) -> Vec<&'r Row> {
    let same = |row: &&Row| {
        ["phase", "increment"]
            .iter()
            .all(|key| row[*key] == place[*key])
    };
    table.iter().filter(same).collect()
}

/// Simpson's rule over the rows of elements, three each, with the circumference.
fn by_simpson(rows: &[&Row], column: &str, girth: f64) -> f64 {
    let mut sum = 0.0;
    let mut at = 0;
    while at + 2 < rows.len() {
        let [a, m, b] = [0, 1, 2].map(|i| rows[at + i]);
        let z = |row: &Row| value(row, "z");
        if z(a) <= z(m) {
            // The other side of a change of the law.
            at += 1;
            continue;
        }
        let [a_f, m_f, b_f] = [a, m, b].map(|row| value(row, column));
        sum += (z(a) - z(b)) * (a_f + 4.0 * m_f + b_f) / 6.0;
        at += 2;
    }
    girth * sum
}

#[test]
fn net_loads_are_changes_and_simpson_gives_the_shaft_load() {
    let laws = PILE.replace(
        "[groups]",
        "deep = { law = \"coulomb_joint\", parameters = { normal_stiffness = 1e6, shear_stiffness = 2e5, cohesion = 20.0, friction_angle = 10.0, dilatancy_angle = 0.0 } }\n[groups]",
    );
    let two = laws.replace(
        "line = \"lower\", law = \"skin\"",
        "line = \"lower\", law = \"deep\"",
    );
    for (text, n) in [(PILE, 11), (&two, 12)] {
        let (place, _) = run(text);
        let history = rows(&place.path("out/history.csv"));
        let along = rows(&place.path("out/pile.csv"));
        let parts = ["head", "shaft", "base"];
        let mut from: Option<[f64; 3]> = None;
        let mut last: Option<(String, [f64; 3])> = None;
        for row in &history {
            let phase = row["phase"].as_str();
            let is_first = last.as_ref().is_none_or(|(last, _)| *last != row["phase"]);
            if is_first && matches!(phase, "built" | "push") {
                from = last.map(|(_, loads)| loads);
            }
            let own = of(&along, row);
            assert_eq!(own.len(), n, "{row:?}");
            let girth = 2.0 * PI * 0.4;
            let [head, base] = [own[0], own[n - 1]].map(|row| value(row, "axial_force"));
            let gross = [head, by_simpson(&own, "shaft_friction", girth), base];
            last = Some((phase.to_owned(), gross));
            let Some(from) = &from else {
                for name in ["pile_head_load", "pile_head_load_net", "pile_dragload"] {
                    assert_eq!(row[name], "", "{row:?}");
                }
                assert_eq!(own[0]["axial_force_net"], "", "{row:?}");
                continue;
            };
            let loads = parts.map(|part| value(row, &format!("pile_{part}_load")));
            let scale = 1.0 + loads.iter().map(|load| load.abs()).sum::<f64>();
            for (load, gross) in loads.iter().zip(gross) {
                assert!((load - gross).abs() < 1e-9 * scale, "{gross} in {row:?}");
            }
            let net = parts.map(|part| value(row, &format!("pile_{part}_load_net")));
            for (part, net) in net.iter().enumerate() {
                let change = loads[part] - from[part];
                assert!((net - change).abs() < 1e-9 * scale, "{part} in {row:?}");
            }
            if phase != "built" {
                let left = net[0] - net[1] - net[2];
                assert!(left.abs() < 1e-9 * scale, "{left} in {row:?}");
            }
            let off = by_simpson(&own, "shaft_friction_net", girth) - net[1];
            assert!(off.abs() < 1e-9 * scale, "{off} in {row:?}");
            let ends = [own[0], own[n - 1]].map(|row| value(row, "axial_force_net"));
            assert!((ends[0] - net[0]).abs() < 1e-9 * scale, "{row:?}");
            assert!((ends[1] - net[2]).abs() < 1e-9 * scale, "{row:?}");
        }
        // Where two laws meet, one row on either side.
        let at = of(&along, history.last().unwrap());
        let there = at
            .iter()
            .filter(|row| (value(row, "z") + 3.0).abs() < 1e-12);
        assert_eq!(there.count(), n - 10);
    }
}

#[test]
fn a_rigid_pile_hands_its_load_down_in_proportion() {
    let phases =
        "[[phase]]\nname = \"push\"\nincrements = 4\nforce = [{ line = \"head\", z = -200.0 }]";
    let (place, _) = run(&ring(1e4, phases));
    let history = rows(&place.path("out/history.csv"));
    let along = rows(&place.path("out/pile.csv"));
    for row in &history {
        let load = value(row, "pile_head_load_net");
        close(load, value(row, "pile_head_load"), 1e-12, "from zero");
        close(
            value(row, "pile_settlement"),
            load / STIFFNESS_OF_SHAFT,
            1e-6,
            "settlement",
        );
        assert_eq!(row["pile_neutral_plane"], "", "{row:?}");
        assert!(value(row, "pile_dragload").abs() < 1e-9, "{row:?}");
        close(
            value(row, "pile_max_axial_force"),
            load,
            1e-9,
            "largest force",
        );
        let own = of(&along, row);
        assert_eq!(own.len(), 17);
        for station in own {
            let force = load * value(station, "z") / LENGTH;
            close(value(station, "axial_force"), force, 1e-6, "axial force");
            let friction = load / (2.0 * PI * RADIUS * LENGTH);
            close(value(station, "shaft_friction"), friction, 1e-6, "friction");
        }
    }
}

#[test]
fn ground_that_sinks_drags_a_pile_down_above_its_neutral_plane() {
    let (load, sinks) = (100.0, 0.01);
    let phases = format!(
        "[[phase]]\nname = \"load\"\nincrements = 1\nforce = [{{ line = \"head\", z = -{load} }}]\n\
         [[phase]]\nname = \"drag\"\nincrements = 2\ndisplacement = [{{ line = \"top\", z = -{sinks} }}]"
    );
    let (place, _) = run(&ring(1e4, &phases));
    let history = rows(&place.path("out/history.csv"));
    for row in history.iter().filter(|row| row["phase"] == "drag") {
        let u = sinks * value(row, "increment") / 2.0;
        let s = u / 2.0 + load / STIFFNESS_OF_SHAFT;
        close(value(row, "pile_settlement"), s, 1e-6, "settlement");
        let plane = s * LENGTH / u;
        close(
            value(row, "pile_neutral_plane"),
            plane,
            1e-5,
            "neutral plane",
        );
        let drag = 2.0 * PI * RADIUS * STIFFNESS * u * (LENGTH - plane).powi(2) / (2.0 * LENGTH);
        close(value(row, "pile_dragload"), drag, 1e-5, "dragload");
        close(
            value(row, "pile_max_axial_force"),
            load + drag,
            1e-5,
            "largest force",
        );
    }
}

/// Friction on a sliding shaft has a bend in the element of the neutral plane. The pile has no weight.
#[test]
fn load_and_dragload_are_the_largest_force_of_a_shaft_that_slides() {
    let load = 100.0;
    let phases = format!(
        "[[phase]]\nname = \"load\"\nincrements = 1\nforce = [{{ line = \"head\", z = -{load} }}]\n\
         [[phase]]\nname = \"drag\"\nincrements = 4\ndisplacement = [{{ line = \"top\", z = -0.01 }}]"
    );
    let (place, _) = run(&ring(12.0, &phases));
    let history = rows(&place.path("out/history.csv"));
    let mut dragged = 0;
    for row in history
        .iter()
        .filter(|row| !row["pile_neutral_plane"].is_empty())
    {
        let sum = load + value(row, "pile_dragload");
        close(value(row, "pile_max_axial_force"), sum, 1e-6, "sum");
        dragged += 1;
    }
    assert!(dragged >= 3, "{history:?}");
}

#[test]
fn cycles_are_those_by_hand() {
    // The joint slides at 2 mm: at 10 mm the load is r · 2 mm, and 1 mm back half of it.
    let slides = 2e-3;
    let phases = "[[phase]]\nname = \"cycles\"\nincrements = 28\ncourse = [[0.0, 0.0], [0.357142857142857, 1.0], [0.392857142857143, 0.9], [0.535714285714286, 1.3], [0.571428571428571, 1.2], [0.75, 1.7], [1.0, 1.0]]\ndisplacement = [{ line = \"head\", z = -0.01 }]";
    let (place, _) = run(&ring(STIFFNESS * slides, phases));
    let found = rows(&place.path("out/cycles.csv"));
    let limit = STIFFNESS_OF_SHAFT * slides;
    let expected = [
        [10e-3, 9e-3, limit, limit / 2.0, 9e-3],
        [13e-3, 12e-3, limit, limit / 2.0, 3e-3],
        [17e-3, 10e-3, limit, -limit, -2e-3],
    ];
    assert_eq!(found.len(), expected.len(), "{found:?}");
    for (number, (row, expected)) in found.iter().zip(expected).enumerate() {
        assert_eq!(row["phase"], "cycles");
        assert_eq!(row["cycle"], (number + 1).to_string());
        let [s_max, s_min, max, min, permanent] = expected;
        let names = words("settlement_max settlement_min load_max load_min permanent");
        for (name, expected) in names.into_iter().zip(expected) {
            close(value(row, name), expected, 1e-5, name);
        }
        let stiffness = (max - min) / (s_max - s_min);
        near(value(row, "secant_stiffness") / stiffness, 1.0, 1e-4);
        near(permanent, value(row, "permanent"), 1e-8);
    }
    // A load that only rises has none.
    let phases =
        "[[phase]]\nname = \"push\"\nincrements = 4\nforce = [{ line = \"head\", z = -200.0 }]";
    let (place, _) = run(&ring(1e4, phases));
    assert!(!place.path("out/cycles.csv").exists());
}

fn number(pile: &Value, name: &str) -> f64 {
    pile[name].as_f64().unwrap_or(f64::NAN)
}

#[test]
fn a_pull_has_the_criteria_of_a_push() {
    // 10 % of 0.5 m, and Davisson's line s = Q/(E A/L) + 3.8 mm + D/120; the joint slides at 2 mm.
    let limit = STIFFNESS_OF_SHAFT * 2e-3;
    for (z, kind, other) in [
        (0.06, "uplift", "resistance"),
        (-0.06, "resistance", "uplift"),
    ] {
        let phases = format!(
            "[[phase]]\nname = \"test\"\nincrements = 12\nreset_displacements = true\ndisplacement = [{{ line = \"head\", z = {z} }}]"
        );
        let (place, _) = run(&ring(STIFFNESS * 2e-3, &phases));
        let pile = &place.summary()["pile"];
        for criterion in ["10_percent_diameter", "davisson"] {
            let name = format!("{kind}_{criterion}");
            close(number(pile, &name), limit, 1e-6, &name);
            assert_eq!(pile[format!("{name}_phase")], "test");
            let name = format!("{other}_{criterion}");
            assert!(pile[&name].is_null(), "{pile}");
            assert!(pile[format!("{name}_reason")].is_string(), "{pile}");
        }
        if kind == "resistance" {
            // The same push, and a pull in the same phase.
            let turns = phases.replace(
                "[[phase]]\n",
                "[[phase]]\ncourse = [[0.0, 0.0], [0.5, 1.0], [1.0, -1.0]]\n",
            );
            let (place, _) = run(&ring(STIFFNESS * 2e-3, &turns));
            let both = &place.summary()["pile"];
            assert_eq!(both["phase"], "test", "{both}");
            let [turned, straight] = [both, pile].map(|pile| number(pile, "resistance_chin"));
            close(turned, straight, 0.1, "chin");
            for criterion in ["10_percent_diameter", "davisson"] {
                let of = |part: &str| number(pile, &format!("resistance_{criterion}{part}"));
                close(of("_shaft"), limit, 1e-6, "shaft");
                assert!(of("_base").abs() < 1e-6 * limit, "{pile}");
            }
        }
    }
}

#[test]
fn each_criterion_names_the_last_phase_that_reaches_it() {
    let phases = "[[phase]]\nname = \"first\"\nincrements = 6\nreset_displacements = true\ndisplacement = [{ line = \"head\", z = -0.06 }]\n\
         [[phase]]\nname = \"short\"\nincrements = 3\nreset_displacements = true\ndisplacement = [{ line = \"head\", z = -0.02 }]";
    let (place, _) = run(&ring(STIFFNESS * 2e-3, phases));
    let pile = &place.summary()["pile"];
    assert_eq!(pile["resistance_10_percent_diameter_phase"], "first");
    assert_eq!(pile["resistance_davisson_phase"], "short");
    assert_eq!(pile["phase"], "short");
    // The second test begins with the first one's load on the pile: a load cell shows nothing of it.
    let limit = STIFFNESS_OF_SHAFT * 2e-3;
    close(
        number(pile, "resistance_10_percent_diameter"),
        limit,
        1e-6,
        "first",
    );
    assert!(
        number(pile, "resistance_davisson").abs() < 1e-4 * limit,
        "{pile}"
    );
}

#[test]
fn elastic_slip_of_the_joints_is_told_unless_they_are_the_ground() {
    let phases =
        "[[phase]]\nname = \"push\"\nincrements = 4\nforce = [{ line = \"head\", z = -200.0 }]";
    let text = ring(1e4, phases);
    let says = "elastic slip of the shaft's joints is";
    let place = Place::new();
    let outcome = place.run_case(&text);
    outcome.shows(says).shows("`shear_stiffness`");
    // The same slip along a load transfer curve is that of the ground.
    let curve = text.replace(
        "law = \"coulomb_joint\", parameters = { normal_stiffness = 1e6, shear_stiffness = 20000, cohesion = 10000, friction_angle = 0.0, dilatancy_angle = 0.0 }",
        "law = \"tz_curve\", parameters = { pressuremeter_modulus = 8e3, diameter = 0.5, soil = \"fine\", shaft_friction = 40.0, normal_stiffness = 1e6 }",
    );
    assert_ne!(text, curve);
    let outcome = Place::new().run_case(&curve);
    outcome.hides(says);
}
