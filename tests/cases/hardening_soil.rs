//! Hardening soil at one point and in piles.
//!
//! Goal      closed forms of laboratory tests; piles beside those in Mohr–Coulomb ground; one overconsolidation.
//! Geometry, boundary, laws: `cases/hardening_soil_tests`, `cases/hardening_piles`.
//! Asserts   strains of the triaxial test and of the oedometer; settlements as measured; `p_p` of the ground.

use crate::variant::{Run, assert_close, finished};
use input::Case;
use tempfile::TempDir;
use tests::case::column;
use tests::place::case;
use tests::tolerance::near;
use tests::words::has;

/// Strain and stress along the axis in a driver.
fn axial(driver: &str, variant: Option<&str>) -> [Vec<f64>; 2] {
    let folder = TempDir::new().unwrap();
    let csv = folder.path().join("rows.csv");
    let driver = case("hardening_soil_tests").join(driver);
    tests::driver::run(&driver, variant, Some(&csv), |_| ()).unwrap();
    ["strain_22", "stress_22"].map(|name| column(&csv, name))
}

fn closed(file: &str) -> [Vec<f64>; 2] {
    let file = case("hardening_soil_tests").join(file);
    ["axial strain", "axial stress"].map(|name| column(&file, name))
}

/// y at x in rows of falling x, between them.
fn at(x: &[f64], y: &[f64], wanted: f64) -> f64 {
    let after = x.iter().position(|&x| x <= wanted).unwrap().max(1);
    let part = (wanted - x[after - 1]) / (x[after] - x[after - 1]);
    y[after - 1] + part * (y[after] - y[after - 1])
}

/// Stresses at the strains of the closed form; chords of increments of 0.1 % lie below the curve.
#[test]
fn triaxial_tests_follow_the_hyperbola_to_the_strength() {
    let [strains, stresses] = closed("closed_triaxial.csv");
    for (number, variant) in ["50_kPa", "100_kPa", "300_kPa"].iter().enumerate() {
        let [strain, stress] = axial("triaxial.toml", Some(variant));
        for i in 8 * number..8 * number + 8 {
            let wanted = strains[i].max(*strain.last().unwrap());
            let found = at(&strain, &stress, wanted);
            let most = if i % 8 == 0 { 0.04 } else { 6e-3 };
            assert_close(found, stresses[i], most, variant);
        }
    }
}

/// Loading to 200 kPa, unloading to 80, loading to 400.
#[test]
fn the_oedometer_follows_its_moduli() {
    let [strains, stresses] = closed("closed_oedometer.csv");
    let [strain, stress] = axial("oedometer.toml", None);
    for (i, (&wanted, &closed)) in stresses.iter().zip(&strains).enumerate().skip(1) {
        let rows = if i < 6 {
            0..41
        } else if i < 10 {
            61..101
        } else {
            41..61
        };
        let (mut x, mut y) = (stress[rows.clone()].to_vec(), strain[rows].to_vec());
        if i >= 10 {
            x.reverse();
            y.reverse();
        }
        let found = at(&x, &y, wanted * (1.0 - 1e-12));
        assert_close(found, closed, 1e-3, "oedometer");
    }
}

/// Settlement of the head at a load, m, between increments.
fn settlement(run: &Run, load: f64) -> f64 {
    let [loads, settlements] = ["pile_head_load", "pile_settlement"].map(|name| {
        let mut values = run.probe("load test", name);
        values.insert(0, 0.0);
        values
    });
    let negative: Vec<f64> = loads.iter().map(|load| -load).collect();
    at(&negative, &settlements, -load)
}

/// The ground is stiffer than Mohr–Coulomb's while strains are small; the shaft, by its joints, carries the same.
#[test]
fn a_bored_pile_settles_less_under_its_working_load() {
    let [mohr, hardening] =
        ["mohr_coulomb", "hardening_soil"].map(|v| finished("hardening_piles/bored.toml", v));
    let [of_mohr, of_hardening] = [&mohr, &hardening].map(|run| settlement(run, 1000.0));
    assert_close(of_mohr, 3.9e-3, 0.02, "Mohr–Coulomb");
    assert_close(of_hardening, 3.24e-3, 0.02, "hardening soil");
    let [of_mohr, of_hardening] =
        [&mohr, &hardening].map(|run| run.end("load test", "pile_shaft_load"));
    assert_close(of_hardening, of_mohr, 0.05, "shaft");
}

/// From half of the last load on, without a fitted parameter.
#[test]
fn a_measured_pile_settles_as_hardening_soil_predicts() {
    let file = case("measured_pile_oneill/load_test.csv");
    let [loads, measured] = ["load (kN)", "settlement (mm)"].map(|name| column(&file, name));
    let half = 0.5 * loads.last().unwrap();
    let run = finished("hardening_piles/measured.toml", "hardening_soil");
    for (&load, &measured) in loads.iter().zip(&measured) {
        if load >= half {
            assert_close(1e3 * settlement(&run, load), measured, 0.08, "settlement");
        }
    }
}

/// A column of ground without weight under a surcharge, with `ocr` given to the stress at rest.
const GROUND: &str = r#"
title = "Overconsolidated ground"
analysis = "plane_strain"
mesh = { columns = [{ n = 1, to = 1.0 }], rows = [{ n = 1, to = 1.0 }], lines = { bottom = { y = 0.0 } }, region = [{ group = "sand" }] }
laws.sand = { law = "hardening_soil", parameters = { e_50_ref = 30e3, cohesion = 0.0, friction_angle = 30.0, dilatancy_angle = 0.0 } }
groups.sand = { formulation = "solid", law = "sand", initial_stress = { friction_angle = 30.0, ocr = 2.0, pop = 10.0, poisson_ratio = 0.2, surcharge = 100.0 } }
supports = [{ line = "bottom", fixed = ["x", "y"] }]
phase = [{ name = "rest", increments = 1 }]
"#;

#[test]
fn the_ground_hands_its_overconsolidation_to_the_law() {
    let folder = TempDir::new().unwrap();
    let file = folder.path().join("case.toml");
    std::fs::write(&file, GROUND).unwrap();
    let posed = Case::load(&file).unwrap()[0].pose().unwrap();
    let law = &posed.problem.groups[0].material.built;
    let value = |id: &str| {
        law.parameters
            .iter()
            .find(|used| used.id == id)
            .unwrap()
            .value
    };
    for (name, given) in [("ocr", 2.0), ("pop", 10.0)] {
        near(value(name), given, 1e-12);
    }
    // Formula (21) of the law: σ_1c = 2 · 100 + 10 kPa, and the cap through (σ_1c, K_0 σ_1c, K_0 σ_1c).
    let stress = [-80.0, -100.0, -80.0, 0.0];
    let start = law
        .law
        .initial_state(1, (&stress, law::Strided::rows(4)))
        .unwrap();
    let [p_p, m] = [start[0], start[2]];
    let expected = ((105.0 / m).powi(2) + 140.0_f64.powi(2)).sqrt();
    assert_close(p_p, expected, 1e-12, "p_p");
    // The same twice is no fault, another is.
    for (own, fits) in [("2.0", true), ("3.0", false)] {
        let own = format!("parameters = {{ ocr = {own}, ");
        std::fs::write(&file, GROUND.replace("parameters = { ", &own)).unwrap();
        match Case::load(&file).unwrap()[0].pose() {
            Ok(_) => assert!(fits),
            Err(error) => {
                assert!(!fits);
                let message = error.to_string();
                has(&message, "are one value, and here they differ");
            }
        }
    }
}
