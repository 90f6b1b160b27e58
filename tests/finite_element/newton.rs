//! Rate of convergence of the iterations.
//!
//! Goal        full Newton iterations with consistent tangents converge quadratically.
//! Geometry    the chamber of `cases/chamber_mesh1`; a strip footing; a thick cylinder.
//! Boundary    as there.
//! Law         mepi in a thin layer; mohr_coulomb with turning principal axes; mohr_coulomb with fixed axes, which
//!             is piecewise linear.
//! Asserts     from `log.jsonl`: r_(k+1) ≤ C r_k² below r = 1/(3 C), down to the round-off floor; with fixed axes,
//!             the floor at once when the right pieces are found.

use crate::footing::{self, FRICTION, Footing};
use crate::setup::{Finished, Results, run};
use crate::thick_cylinder;
use std::path::Path;

/// Where round-off of the forces ends quadratic convergence.
const FLOOR: f64 = 1e-11;

/// A case with consistent tangents at every iteration.
fn full_newton(text: &str) -> String {
    format!("{text}\n[solver]\nmethod = \"newton\"\n")
}

/// Asserts r_(k+1) ≤ C r_k² (or the floor) wherever C r_k is below 1/3, and that at least `least` pairs are large
/// enough to tell.
fn assert_quadratic(finished: &Finished, phase: &str, increments: usize, c: f64, least: usize) {
    assert_eq!(finished.observer.cut_backs, 0);
    let mut telling = 0;
    for increment in 1..=increments {
        let residuals = finished.residuals(phase, increment);
        assert!(!residuals.is_empty());
        for pair in residuals.windows(2).filter(|pair| c * pair[0] < 1.0 / 3.0) {
            let bound = (c * pair[0] * pair[0]).max(FLOOR);
            assert!(pair[1] <= bound, "increment {increment}: {residuals:?}");
            telling += usize::from(pair[0] > 1e3 * FLOOR && pair[1] > 0.1 * FLOOR);
        }
    }
    assert!(
        telling >= least,
        "only {telling} pairs of residuals tell something"
    );
}

#[test]
fn mepi_in_the_chamber() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../cases/chamber_mesh1/case.toml");
    let text = std::fs::read_to_string(path).unwrap();
    // The first fifth of the case's loading, in increments of the same size.
    let text = text
        .replace("increments = 50", "increments = 10")
        .replace("-0.005", "-0.001");
    let finished = run(&full_newton(&text));
    assert!(
        finished.end_of("loading", "tau_shaft").abs() > 50.0,
        "the shaft does not slide"
    );
    assert_quadratic(&finished, "loading", 10, 1e3, 5);
}

#[test]
fn mohr_coulomb_with_turning_axes() {
    let footing = Footing { n: 4, ..FRICTION };
    let finished = run(&full_newton(&footing::text(footing)));
    assert_quadratic(&finished, "push", FRICTION.increments, 1e3, 5);
}

#[test]
fn mohr_coulomb_with_fixed_axes() {
    let text = thick_cylinder::pressing(50.0, [30.0, 10.0], 8, "full");
    let finished = run(&full_newton(&text));
    let mut plastic = 0;
    for increment in 1..=40 {
        let residuals = finished.residuals("load", increment);
        let [.., before, last] = residuals[..] else {
            continue;
        };
        plastic += 1;
        assert!(
            before > 1e-6 && last < 1e-12,
            "increment {increment}: {residuals:?}"
        );
    }
    assert!(
        plastic >= 5,
        "only {plastic} increments needed an iteration"
    );
}
