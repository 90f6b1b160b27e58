//! Bonds without normal stress that break at the first tension, along the shaft of a pile. An equilibrium is found,
//! with the same head load whatever the increments. Without an equilibrium the end of the run names what gives way, and
//! what helps.
#![expect(clippy::unwrap_used, reason = "part of the tests")]

use crate::program::{DONE, NO_EQUILIBRIUM, Place};
use serde_json::Value;
use std::path::Path;

/// Head load at 1 mm, kN, as one increment of viscous control finds it, in which no viscous step fails.
const LOAD: f64 = -22.198;
/// Other points may break on another way.
const NEAR: f64 = 2e-3;
/// Ways by the same points.
const ALIKE: f64 = 1e-5;

fn place() -> (Place, String) {
    let fixture = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/brittle_bond");
    let read = |name| std::fs::read_to_string(fixture.join(name)).unwrap();
    let place = Place::new();
    place.write("pile.msh", read("pile.msh"));
    (place, read("pile.toml"))
}

fn head_load(place: &Place) -> f64 {
    let rows = tests::case::column(&place.path("out/history.csv"), "R");
    *rows.last().unwrap()
}

#[test]
fn bonds_that_break_at_the_first_tension_lead_to_an_equilibrium() {
    let mut loads = Vec::new();
    for control in ["auto", "viscous"] {
        for increments in [1, 10] {
            let (place, text) = place();
            let increments = format!("increments = {increments}");
            let text = text.replace("increments = 1", &increments);
            let text = format!("solver.control = \"{control}\"\n{text}");
            place.write("case.toml", text);
            let outcome = place.run(&["run", "case.toml", "--out", "out"]);
            let what = format!("{control}, {increments}");
            assert_eq!(outcome.code, Some(DONE), "{what}: {}", outcome.stderr);
            let load = head_load(&place);
            assert!((load / LOAD - 1.0).abs() < NEAR, "{what}: {load}");
            loads.push((control, load));
        }
    }
    let by_default = loads.iter().filter(|(control, _)| *control == "auto");
    let by_default: Vec<f64> = by_default.map(|(_, load)| *load).collect();
    let [one, ten] = by_default[..] else {
        panic!("{loads:?}");
    };
    assert!((one / ten - 1.0).abs() < ALIKE, "{loads:?}");
}

/// By the load alone there is no way on.
#[test]
fn a_bond_that_leaves_no_equilibrium_is_named_with_what_keeps_it() {
    let (place, text) = place();
    place.write("case.toml", format!("solver.control = \"load\"\n{text}"));
    let outcome = place
        .run(&["run", "case.toml", "--out", "out"])
        .ended(NO_EQUILIBRIUM);
    outcome
        .shows("what gives way: a")
        .shows(", group `shaft_")
        .shows("law `coulomb_joint`")
        .shows("the bond began without normal stress")
        .shows("help: the interface starts without normal stress")
        .shows("or a tensile strength");
    let summary = std::fs::read(place.path("out/summary.json")).unwrap();
    let summary: Value = serde_json::from_slice(&summary).unwrap();
    let mechanism = &summary["mechanism"];
    let how = mechanism["how"].as_str().unwrap();
    assert!(["bond_breaks", "opens"].contains(&how), "{mechanism}");
    assert!(mechanism["group"].as_str().unwrap().starts_with("shaft_"));
    assert_eq!(mechanism["position"][0], 0.5);
    assert_eq!(mechanism["began_without_normal_stress"], true);
}
