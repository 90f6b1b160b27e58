//! The chamber with a toe halved sixteen times, and with increments fifty times too large.
//!
//! Goal      no silent wrong number at the extremes.
//! Geometry, boundary, laws: cases/chamber_extremes/README.md.
//! Asserts   runs end well, loads that do not depend on the toe's elements, what large increments
//!           cost, warnings of round-off.

use crate::variant::{Run, finished};
use std::sync::Arc;

const CASE: &str = "chamber_extremes";

/// Largest difference from the first, relative to it, at the end of the phase.
fn spread(runs: &[Arc<Run>], probe: &str) -> f64 {
    let ends: Vec<f64> = runs.iter().map(|run| run.end("loading", probe)).collect();
    let from_first = ends.iter().map(|end| (end / ends[0] - 1.0).abs());
    from_first.fold(0.0, f64::max)
}

#[test]
fn a_toe_that_is_halved_sixteen_times_changes_no_load_of_the_shaft() {
    let runs = ["halved_4", "halved_8", "halved_16"].map(|v| finished(CASE, v));
    assert_eq!(runs[2].summary["mesh"]["elements"], 1325);
    for (probe, tolerance) in [
        ("q_t", 5e-4),
        ("tau_shaft", 1e-4),
        ("sigma_n_shaft", 1e-4),
        ("q_p", 1e-2),
    ] {
        let spread = spread(&runs, probe);
        assert!(spread < tolerance, "{probe}: {spread:.1e}");
    }
    // Round-off is said where it is met, and only there; with a toe halved eight times on the boundary of what is
    // condensed.
    for (run, warns) in runs.iter().zip([false, true, true]) {
        let warnings = &run.outcome.as_ref().unwrap().warnings;
        let said = warnings.iter().any(|w| w.contains("below round-off"));
        assert_eq!(said, warns, "{warnings:?}");
    }
}

#[test]
fn plastic_sand_under_such_a_toe_carries_what_it_carries_under_a_coarse_one() {
    let runs = ["plastic_mesh_1", "plastic_halved_16"].map(|v| finished(CASE, v));
    // The coarse toe is too stiff by some percent, as mesh 1 is in elastic sand.
    for (probe, tolerance) in [("q_t", 0.05), ("tau_shaft", 0.02), ("sigma_n_shaft", 0.01)] {
        let spread = spread(&runs, probe);
        assert!(spread < tolerance, "{probe}: {spread:.1e}");
    }
}

#[test]
fn one_increment_for_two_hundred_costs_accuracy_not_the_run() {
    let runs = ["two_hundred_increments", "mesh_1", "one_increment"].map(|v| finished(CASE, v));
    for (probe, tolerance) in [("q_t", 0.015), ("tau_shaft", 0.04), ("sigma_n_shaft", 0.04)] {
        let spread = spread(&runs, probe);
        assert!(spread < tolerance, "{probe}: {spread:.1e}");
        // First order: with fifty the error is smaller by far.
        let fifty = self::spread(&runs[..2], probe);
        assert!(fifty < 0.3 * spread, "{probe}: {fifty:.1e} {spread:.1e}");
    }
}
