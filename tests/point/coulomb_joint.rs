//! Coulomb joint with constant dilatancy.
//!
//! Goal        sliding under the boundary conditions of the shear box, opening, re-closure.
//! Set-up      traction −100 kPa normal to the joint, shear jump to 4 mm.
//! Law         coulomb_joint: K_n = 1e6 kPa/m, K_t = 4e5 kPa/m, c = 5 kPa, φ = 35°, ψ = 13.5°.
//! Asserts     piecewise linear closed forms in every row.
//!
//! With a spring K behind the joint, σ_n = σ_0 + K_s tan ψ ξ, K_s = K K_n/(K + K_n). Slip ξ follows from
//! K_t (u − ξ) = c + σ_n tan φ: ξ = (K_t u − c − σ_0 tan φ)/(K_t + K_s tan φ tan ψ).

use crate::driver::{Run, follow};
use approx::assert_relative_eq;
use tests::tolerance::DRIVER;

const K_N: f64 = 1e6;
const K_T: f64 = 4e5;
const C: f64 = 5.0;

fn tangents() -> (f64, f64) {
    (35_f64.to_radians().tan(), 13.5_f64.to_radians().tan())
}

fn run(rest: &str) -> Run {
    follow(&format!(
        "law = 'coulomb_joint'\nhypothesis = 'interface_2d'\n[parameters]\n\
         normal_stiffness = {K_N}\nshear_stiffness = {K_T}\ncohesion = {C}\nfriction_angle = 35\n\
         dilatancy_angle = 13.5\n[initial]\ntraction = {{ n = -100 }}\n{rest}"
    ))
}

/// Rows of a test with a spring of series stiffness `k_s` = K K_n/(K + K_n).
fn follows_closed_form(run: &Run, k_s: f64) {
    let (phi, psi) = tangents();
    for k in 0..=run.increments() {
        let u = run.at(k, "jump_t");
        let slip = ((K_T * u - C - 100.0 * phi) / (K_T + k_s * phi * psi)).max(0.0);
        let sigma = 100.0 + k_s * psi * slip;
        let tau = K_T * (u - slip);
        assert_relative_eq!(
            run.at(k, "plastic_slip"),
            slip,
            epsilon = 1e-15,
            max_relative = DRIVER
        );
        assert_relative_eq!(run.at(k, "traction_n"), -sigma, max_relative = DRIVER);
        assert_relative_eq!(
            run.at(k, "traction_t"),
            tau,
            epsilon = 1e-9,
            max_relative = DRIVER
        );
        let opening = psi * slip - (sigma - 100.0) / K_N;
        assert_relative_eq!(
            run.at(k, "jump_n"),
            opening,
            epsilon = 1e-14,
            max_relative = DRIVER
        );
    }
}

#[test]
fn constant_volume() {
    let run =
        run("[[segment]]\nincrements = 40\ncontrol = { t = { jump = 4e-3 }, n = { jump = 0 } }");
    follows_closed_form(&run, K_N);
}

#[test]
fn constant_normal_stiffness() {
    for k in [0.0, 1.0, 1e5, 1e6, 1e9, 1e14] {
        let run = run(&format!(
            "[[segment]]\nincrements = 40\n\
             control = {{ t = {{ jump = 4e-3 }}, n = {{ stiffness = {k:e} }} }}"
        ));
        follows_closed_form(&run, k * K_N / (k + K_N));
    }
}

#[test]
fn reversal_is_elastic_until_the_strength_in_the_other_direction() {
    let run = run(
        "[[segment]]\nincrements = 10\ncontrol = { t = { jump = 1e-3 } }\n\
         [[segment]]\nincrements = 50\ncontrol = { t = { jump = -1e-3 } }",
    );
    let (phi, _) = tangents();
    let strength = C + 100.0 * phi;
    for k in 10..=60 {
        let elastic = strength - K_T * (1e-3 - run.at(k, "jump_t"));
        let tau = elastic.max(-strength);
        assert_relative_eq!(
            run.at(k, "traction_t"),
            tau,
            epsilon = 1e-9,
            max_relative = DRIVER
        );
    }
}

#[test]
fn opens_without_traction_and_closes_where_contact_was_lost() {
    // 100 kPa are gone after 100/K_n = 0.1 mm.
    let run = run(
        "[[segment]]\nincrements = 8\ncontrol = { n = { jump = 4e-4 } }\n\
         [[segment]]\nincrements = 2\ncontrol = { n = { jump = 4e-4 }, t = { jump = 1e-3 } }\n\
         [[segment]]\nincrements = 8\ncontrol = { n = { jump = 0 }, t = { jump = 1e-3 } }",
    );
    for k in 0..=18 {
        let contact = (K_N * run.at(k, "jump_n") - 100.0).min(0.0);
        assert_relative_eq!(run.at(k, "traction_n"), contact, epsilon = 1e-9);
        assert_relative_eq!(run.at(k, "traction_t"), 0.0, epsilon = 1e-9);
    }
}

#[test]
fn traction_control_reaches_contact_across_an_open_gap() {
    // Over the gap the tangent is zero; contact is at 0.1 mm, and −50 kPa 0.05 mm beyond.
    for opening in ["2e-4", "1e-2", "1"] {
        let run = run(&format!(
            "[[segment]]\nincrements = 1\ncontrol = {{ n = {{ jump = {opening} }} }}\n\
             [[segment]]\nincrements = 2\ncontrol = {{ n = {{ traction = -50 }} }}"
        ));
        assert_relative_eq!(run.at(1, "traction_n"), 0.0, epsilon = 1e-12);
        assert_relative_eq!(run.at(2, "traction_n"), -25.0, max_relative = DRIVER);
        assert_relative_eq!(run.at(3, "jump_n"), 5e-5, max_relative = 1e-7);
    }
}
