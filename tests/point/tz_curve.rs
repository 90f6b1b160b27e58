//! Load transfer curves of Frank and Zhao.
//!
//! Goal        the curves of shaft and base under the driver, led by movement and by stress.
//! Set-up      shaft at −50 kPa normal to it, slip to 5 mm and back; base pressed by 60 mm, lifted, pressed.
//! Law         tz_curve, qz_curve: E_M = 12 MPa, D = 0.6 m, both soils, q_s = 80 kPa, q_b = 2000 kPa.
//! Asserts     corners and slopes of the source in every row; the movement at which a stress is reached.

use crate::driver::{Run, follow};
use approx::assert_relative_eq;
use tests::tolerance::DRIVER;

const Q_S: f64 = 80.0;
const Q_B: f64 = 2e3;

fn shaft(soil: &str, rest: &str) -> Run {
    follow(&format!(
        "law = 'tz_curve'\nhypothesis = 'interface_2d'\n[parameters]\n\
         pressuremeter_modulus = 12e3\ndiameter = 0.6\nsoil = '{soil}'\nshaft_friction = {Q_S}\n\
         normal_stiffness = 1e6\n[initial]\ntraction = {{ n = -50 }}\n{rest}"
    ))
}

fn base(soil: &str, rest: &str) -> Run {
    follow(&format!(
        "law = 'qz_curve'\nhypothesis = 'interface_2d'\n[parameters]\n\
         pressuremeter_modulus = 12e3\ndiameter = 0.6\nsoil = '{soil}'\nbase_resistance = {Q_B}\n\
         shear_stiffness = 1e5\n{rest}"
    ))
}

/// Slope k to half of the limit, k/5 from there to the limit.
fn curve(k: f64, limit: f64, z: f64) -> f64 {
    (k * z)
        .min(limit / 2.0 + k / 5.0 * (z - limit / (2.0 * k)))
        .min(limit)
}

#[test]
fn the_shaft_follows_its_curve_and_masing() {
    for (soil, k) in [("fine", 40e3), ("granular", 16e3)] {
        for increments in [1, 50] {
            let run = shaft(
                soil,
                &format!(
                    "[[segment]]\nincrements = {increments}\ncontrol = {{ t = {{ jump = 5e-3 }} }}\n\
                     [[segment]]\nincrements = {increments}\ncontrol = {{ t = {{ jump = -5e-3 }} }}"
                ),
            );
            for row in 0..=increments {
                let tau = curve(k, Q_S, run.at(row, "jump_t"));
                assert_relative_eq!(run.at(row, "traction_t"), tau, epsilon = 1e-9);
                assert_relative_eq!(run.at(row, "traction_n"), -50.0, max_relative = DRIVER);
            }
            let top = curve(k, Q_S, 5e-3);
            for row in increments..=2 * increments {
                // Twice as large from the reversal, as far as its mirror image.
                let back = 5e-3 - run.at(row, "jump_t");
                let tau = (top - 2.0 * curve(k, Q_S, back / 2.0)).max(-Q_S);
                assert_relative_eq!(run.at(row, "traction_t"), tau, epsilon = 1e-8);
            }
        }
    }
}

#[test]
fn a_shear_stress_is_reached_at_the_slip_of_the_curve() {
    // Three quarters of the limit: q_s/2k and five times half of that.
    let run = shaft(
        "fine",
        "[[segment]]\nincrements = 9\ncontrol = { t = { traction = 60 } }",
    );
    let slip = 40.0 / 40e3 + 20.0 / 8e3;
    assert_relative_eq!(run.last("jump_t"), slip, max_relative = 1e-8);
}

#[test]
fn the_base_follows_its_curve_lifts_off_and_comes_back() {
    for (soil, k) in [("fine", 220e3), ("granular", 96e3)] {
        let run = base(
            soil,
            "[[segment]]\nincrements = 30\ncontrol = { n = { jump = -0.03 } }\n\
             [[segment]]\nincrements = 30\ncontrol = { n = { jump = 0.03 } }\n\
             [[segment]]\nincrements = 30\ncontrol = { n = { jump = -0.06 } }",
        );
        let peak = curve(k, Q_B, 0.03);
        for row in 0..=90 {
            let z = -run.at(row, "jump_n");
            // Unloading and reloading along k through the peak at 30 mm.
            let line = (peak - k * (0.03 - z)).max(0.0);
            let q = if row <= 30 || z > 0.03 {
                curve(k, Q_B, z)
            } else {
                line
            };
            assert_relative_eq!(run.at(row, "traction_n"), -q, epsilon = 1e-7);
        }
        assert_relative_eq!(run.at(60, "gap"), 0.06 - peak / k, max_relative = DRIVER);
    }
}
