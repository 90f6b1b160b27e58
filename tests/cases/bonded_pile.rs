//! A bonded elastic pile pushed into confined Mohr–Coulomb soil.
//!
//! Goal      the head load that other programs find, in no more iterations.
//! Geometry, boundary, laws: cases/bonded_pile/README.md.
//! Asserts   elastic head load to 8 digits; plastic one within the rounding of the others' surface;
//!           Newton iterations; no cut-back.

use crate::variant::{assert_close, finished};
use std::f64::consts::PI;

const CASE: &str = "bonded_pile";
/// Load on the head from the initial stress alone, kN.
const INITIAL: f64 = 100.0 * PI * 0.01 * 0.01;

#[test]
fn elastic_head_load() {
    // OpenGeoSys and Kratos on the same mesh, without initial stress: 5363.8436 N.
    let run = finished(CASE, "m200_elastic");
    assert_close(
        run.end("push", "q_t") - INITIAL,
        5.363_843_6,
        1e-8,
        "elastic head load",
    );
}

#[test]
fn plastic_head_load() {
    // OpenGeoSys with a Mohr–Coulomb surface whose edges and apex are rounded inward by up to 1 %
    // of the strength, initial stress included; and its Newton iterations over ten steps.
    for (variant, load, iterations) in [("m200", 3.9360, 47), ("m2k", 3.871_76, 68)] {
        let run = finished(CASE, variant);
        assert_close(run.end("push", "q_t"), load, 2e-3, variant);
        let push = &run.summary["phases"][0];
        assert_eq!(push["increments"], 10);
        assert_eq!(push["cut_backs"], 0);
        let spent = push["iterations"].as_u64().unwrap();
        assert!(spent <= iterations, "{variant}: {spent} iterations");
    }
}
