//! Goals that a law cannot meet, however far its free components run.
//!
//! Goal        a flux that is controlled is met, or the increment ends the path with exit code 2.
//! Set-up      fluxes beyond strength, on laws that yield without end and on contacts that are open.
//! Law         mepi, mohr_coulomb, coulomb_joint.
//! Asserts     exit code, message, every row that is written; and that what has a solution still does.

use crate::driver::{Run, attempt, follow};
use approx::assert_relative_eq;
use input::Kind;

const MEPI: &str = "law = 'mepi'\nhypothesis = 'interface_2d'\nparameters = { k_n = 86e3, \
    k_t = 37e3, n = 0.55, mu_0 = 0.27, mu_p = 0.7, mu_c0 = 0.46, a = 0.008, c_0 = 40, t = 0.002, \
    p_0 = 100, sigma_ni = 100 }\n[initial]\ntraction = { n = -100 }\n";

/// Ends with exit code 2 and says this; rows before are as they were asked for.
fn stops(text: &str, goals: &[(&str, &dyn Fn(usize) -> f64)], size: f64, words: &[&str]) -> Run {
    let run = attempt(text);
    let error = run.error();
    assert_eq!(error.exit_code(), 2, "{error}");
    assert_eq!(error.kind(), Kind::NoEquilibrium);
    for word in words {
        assert!(error.to_string().contains(word), "{word}: {error}");
    }
    for (column, goal) in goals {
        for k in 1..=run.increments() {
            let off = run.at(k, column) - goal(k);
            assert!(
                off.abs() <= 1e-9 * size,
                "row {k}: {column} is off by {off:e}"
            );
        }
    }
    run
}

#[test]
fn shear_beyond_the_strength_of_mepi_is_not_met() {
    // 0.7 × 100 kPa is reached by no slip: 65 kPa are the last of 20 increments to 100 below it.
    let run = stops(
        &format!("{MEPI}[[segment]]\nincrements = 20\ncontrol = {{ t = {{ traction = 100 }} }}"),
        &[
            ("traction_t", &|k| 5.0 * k as f64),
            ("traction_n", &|_| -100.0),
        ],
        100.0,
        &["traction `t` is", "kPa at best", "to be 7"],
    );
    assert!(
        (13..=14).contains(&run.increments()),
        "{}",
        run.increments()
    );
    // (μ − μ_0)/(μ_p − μ_0) = ξ/(A t + ξ) at μ = 0.65, and elastic 65 kPa by k_t σ_n^n.
    let slip = 0.38 / 0.05 * 0.008 * 0.002 + 65.0 / (37e3 * 100_f64.powf(0.55));
    assert_relative_eq!(run.at(13, "jump_t"), slip, max_relative = 1e-6);
}

#[test]
fn neither_is_one_that_runs_away_between_two_increments() {
    // 68 kPa of 50 increments to 200 kPa is the last below 70.
    let run = stops(
        &format!(
            "{MEPI}[[segment]]\nincrements = 50\ncontrol = {{ n = {{ traction = -100 }}, \
             t = {{ traction = -200 }} }}"
        ),
        &[
            ("traction_t", &|k| -4.0 * k as f64),
            ("traction_n", &|_| -100.0),
        ],
        100.0,
        &["to be -7.200000000e1 kPa"],
    );
    assert_eq!(run.increments(), 17);
    assert!(run.column("jump_t").iter().all(|jump| jump.abs() < 1e-3));
}

#[test]
fn what_only_the_strength_itself_meets_is_said() {
    // Hyperbolic hardening comes to 70 kPa within a tolerance, and never meets it.
    let run = attempt(&format!(
        "{MEPI}[[segment]]\nincrements = 14\ncontrol = {{ t = {{ traction = 70 }} }}"
    ));
    match &run.result {
        Err(error) => assert_eq!(error.exit_code(), 2, "{error}"),
        Ok(report) => {
            let said = &report.warnings;
            assert!(
                said.iter().any(|w| w.contains("jump `t` has to come to")),
                "{said:?}"
            );
        }
    }
}

#[test]
fn an_open_contact_holds_no_shear() {
    let joint = "law = 'coulomb_joint'\nhypothesis = 'interface_2d'\n[parameters]\n\
        normal_stiffness = 1e6\nshear_stiffness = 4e5\ncohesion = 5\nfriction_angle = 35\n\
        dilatancy_angle = 13.5\n[initial]\ntraction = { n = -100 }\n";
    for jump in ["1e-3", "1e3"] {
        let run = stops(
            &format!(
                "{joint}[[segment]]\nincrements = 4\ncontrol = {{ n = {{ jump = {jump} }} }}\n\
                 [[segment]]\nincrements = 4\ncontrol = {{ n = {{ jump = {jump} }}, \
                 t = {{ traction = 20 }} }}"
            ),
            &[("traction_t", &|_| 0.0)],
            100.0,
            &["traction `t` is 0.0", "to be 5.000000000e0 kPa"],
        );
        assert_eq!(run.increments(), 4);
    }
}

#[test]
fn long_ways_that_are_asked_for_end_as_before() {
    // A slip of 10 m is prescribed: friction is mobilised but for C₀… parts, the rest is kept.
    let run = follow(&format!(
        "{MEPI}[[segment]]\nincrements = 20\ncontrol = {{ t = {{ jump = 10 }} }}"
    ));
    for k in 1..=20 {
        assert_relative_eq!(run.at(k, "traction_n"), -100.0, max_relative = 1e-9);
    }
    assert_relative_eq!(run.last("traction_t"), 70.0, max_relative = 1e-4);
}
