//! Hyperbolic joint.
//!
//! Goal        hyperbola, strength, reversal, opening and re-closure under the driver.
//! Set-up      traction −100 kPa normal to the joint, or −400 kPa; shear jump to 4 mm.
//! Law         hyperbolic_joint: K_n = 1e7 kPa/m, K = 20 000, n = 0.6, R_f = 0.85, c_a = 4 kPa, δ = 30°,
//!             K_ur = 30 000.
//! Asserts     the hyperbola of Clough and Duncan in every row, at any number of increments.
//!
//! The law neither dilates nor contracts, so a spring behind the joint keeps its force.

use crate::driver::{Run, follow};
use approx::assert_relative_eq;
use tests::tolerance::DRIVER;

const K_N: f64 = 1e7;

fn run(sigma: f64, rest: &str) -> Run {
    follow(&format!(
        "law = 'hyperbolic_joint'\nhypothesis = 'interface_2d'\n[parameters]\n\
         normal_stiffness = {K_N}\nstiffness_number = 2e4\nstiffness_exponent = 0.6\n\
         failure_ratio = 0.85\nadhesion = 4\nfriction_angle = 30\nunloading_number = 3e4\n\
         [initial]\ntraction = {{ n = {} }}\n{rest}",
        -sigma
    ))
}

fn strength(sigma: f64) -> f64 {
    4.0 + sigma * 30_f64.to_radians().tan()
}

/// Stiffness of loading at the start.
fn stiffness(sigma: f64) -> f64 {
    2e4 * 9.81 * (sigma / 101.325).powf(0.6)
}

/// The hyperbola with its cut.
fn hyperbola(sigma: f64, slip: f64) -> f64 {
    let tau_f = strength(sigma);
    (slip / (1.0 / stiffness(sigma) + 0.85 * slip / tau_f)).min(tau_f)
}

#[test]
fn shear_is_the_hyperbola_whatever_holds_the_normal_stress() {
    for sigma in [100.0, 400.0] {
        for normal in [
            "",
            ", n = { jump = 0 }",
            ", n = { stiffness = 4e5 }",
            ", n = { traction = NORMAL }",
        ] {
            let normal = normal.replace("NORMAL", &(-sigma).to_string());
            for increments in [1, 40] {
                let run = run(
                    sigma,
                    &format!(
                        "[[segment]]\nincrements = {increments}\n\
                         control = {{ t = {{ jump = 4e-3 }}{normal} }}"
                    ),
                );
                for k in 0..=increments {
                    let tau = hyperbola(sigma, run.at(k, "jump_t"));
                    assert_relative_eq!(
                        run.at(k, "traction_t"),
                        tau,
                        epsilon = 1e-9,
                        max_relative = DRIVER
                    );
                    assert_relative_eq!(run.at(k, "traction_n"), -sigma, max_relative = DRIVER);
                }
                assert_relative_eq!(run.last("stress_level"), 1.0, max_relative = DRIVER);
            }
        }
    }
}

#[test]
fn shear_stress_can_be_led_along_the_hyperbola_and_back() {
    // Half the strength after the slip τ/(K_i (1 − R_f/2)); back to nothing over τ/K_u.
    let tau = 0.5 * strength(100.0);
    let run = run(
        100.0,
        &format!(
            "[[segment]]\nincrements = 10\ncontrol = {{ t = {{ traction = {tau} }} }}\n\
             [[segment]]\nincrements = 4\ncontrol = {{ t = {{ traction = 0 }} }}"
        ),
    );
    let k_i = stiffness(100.0);
    let slip = tau / (k_i * (1.0 - 0.85 * 0.5));
    assert_relative_eq!(run.at(10, "jump_t"), slip, max_relative = 1e-8);
    let left = slip - tau / (1.5 * k_i);
    assert_relative_eq!(run.at(14, "jump_t"), left, max_relative = 1e-8);
    assert_relative_eq!(run.at(14, "stress_level"), 0.5, max_relative = DRIVER);
}

#[test]
fn reversal_follows_a_line_to_the_same_stress_in_the_other_direction() {
    let run = run(
        100.0,
        "[[segment]]\nincrements = 5\ncontrol = { t = { jump = 2e-4 } }\n\
         [[segment]]\nincrements = 60\ncontrol = { t = { jump = -1e-3 } }",
    );
    let top = hyperbola(100.0, 2e-4);
    let k_u = 1.5 * stiffness(100.0);
    for k in 5..=65 {
        let back = 2e-4 - run.at(k, "jump_t");
        // Beyond −top the hyperbola goes on from the slip of 0.2 mm.
        let further = back - 2.0 * top / k_u;
        let tau = if further < 0.0 {
            top - k_u * back
        } else {
            -hyperbola(100.0, 2e-4 + further)
        };
        assert_relative_eq!(
            run.at(k, "traction_t"),
            tau,
            epsilon = 1e-8,
            max_relative = DRIVER
        );
    }
}

#[test]
fn opens_without_traction_and_closes_without_adhesion() {
    // 100 kPa are gone after 0.01 mm.
    let run = run(
        100.0,
        "[[segment]]\nincrements = 4\ncontrol = { n = { jump = 4e-5 } }\n\
         [[segment]]\nincrements = 2\ncontrol = { n = { jump = 4e-5 }, t = { jump = 1e-3 } }\n\
         [[segment]]\nincrements = 8\ncontrol = { n = { jump = 0 }, t = { jump = 1e-3 } }\n\
         [[segment]]\nincrements = 8\ncontrol = { n = { jump = 0 }, t = { jump = 9e-3 } }",
    );
    for k in 0..=14 {
        let contact = (K_N * run.at(k, "jump_n") - 100.0).min(0.0);
        assert_relative_eq!(run.at(k, "traction_n"), contact, epsilon = 1e-8);
        assert_relative_eq!(run.at(k, "traction_t"), 0.0, epsilon = 1e-9);
    }
    assert_relative_eq!(run.last("broken"), 1.0);
    let tau = 100.0 * 30_f64.to_radians().tan();
    assert_relative_eq!(run.last("traction_t"), tau, max_relative = 1e-8);
}
