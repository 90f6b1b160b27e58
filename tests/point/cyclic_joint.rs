//! Cyclic joint.
//!
//! Goal        degradation at constant normal stiffness, constant stress and constant volume, opening.
//! Set-up      traction −100 kPa normal to the joint, slip between ± 1 mm, or to 10 mm.
//! Law         cyclic_joint: K_n = 1e6 kPa/m, K_t = 4e5 kPa/m, φ_p = 35°, φ_r = 25° over 20 mm, contraction
//!             of 1° over 4 mm.
//! Asserts     σ_n = σ_0 − K_s c(ξ), τ = μ(ξ) σ_n and ξ along the cycles in closed form.
//!
//! With a spring K behind the joint, K_s = K K_n/(K + K_n). Between reversals K_t (u − u_0) = ± (τ − τ_0)
//! + K_t (ξ − ξ_0): an equation in ξ for every jump, solved here by bisection.

use crate::driver::{Run, follow};
use approx::assert_relative_eq;
use std::fmt::Write as _;
use tests::tolerance::DRIVER;

const K_N: f64 = 1e6;
const K_T: f64 = 4e5;
const XI_FRICTION: f64 = 0.02;
const XI_CONTRACTION: f64 = 4e-3;

fn run(rest: &str) -> Run {
    follow(&format!(
        "law = 'cyclic_joint'\nhypothesis = 'interface_2d'\n[parameters]\n\
         normal_stiffness = {K_N}\nshear_stiffness = {K_T}\npeak_friction_angle = 35\n\
         residual_friction_angle = 25\nfriction_slip = {XI_FRICTION}\ncontraction_angle = 1\n\
         contraction_slip = {XI_CONTRACTION}\n[initial]\ntraction = {{ n = -100 }}\n{rest}"
    ))
}

fn friction(xi: f64) -> f64 {
    let [residual, peak] = [25_f64, 35.0].map(|angle| angle.to_radians().tan());
    residual + (peak - residual) * (-xi / XI_FRICTION).exp()
}

fn contraction(xi: f64) -> f64 {
    XI_CONTRACTION * 1_f64.to_radians().tan() * (1.0 - (-xi / XI_CONTRACTION).exp())
}

/// Rows of a path of reversals against a series stiffness `k_s`.
fn follows_closed_form(run: &Run, k_s: f64) {
    let sigma = |xi: f64| 100.0 - k_s * contraction(xi);
    let strength = |xi: f64| friction(xi) * sigma(xi);
    let (mut xi, mut tau, mut u) = (0.0_f64, 0.0_f64, 0.0_f64);
    for k in 0..=run.increments() {
        let jump = run.at(k, "jump_t");
        let sign = 1.0_f64.copysign(jump - u);
        let trial = sign * tau + K_T * (jump - u).abs();
        let mut slipped = 0.0;
        if trial > strength(xi) {
            let (mut low, mut high) = (0.0, trial / K_T);
            for _ in 0..200 {
                let middle = 0.5 * (low + high);
                if trial - K_T * middle > strength(xi + middle) {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            slipped = 0.5 * (low + high);
        }
        xi += slipped;
        tau = sign * (trial - K_T * slipped);
        u = jump;
        assert_relative_eq!(
            run.at(k, "plastic_slip"),
            xi,
            epsilon = 1e-13,
            max_relative = DRIVER
        );
        assert_relative_eq!(run.at(k, "traction_n"), -sigma(xi), max_relative = DRIVER);
        assert_relative_eq!(
            run.at(k, "traction_t"),
            tau,
            epsilon = 1e-8,
            max_relative = DRIVER
        );
        assert_relative_eq!(
            run.at(k, "plastic_contraction"),
            contraction(xi),
            epsilon = 1e-15,
            max_relative = 1e-8
        );
    }
}

/// Slip between ± 1 mm, with the normal control of the text.
fn cycles(n: usize, increments: usize, normal: &str) -> Run {
    let mut rest = String::new();
    for turn in 0..2 * n {
        let jump = if turn % 2 == 0 { "1e-3" } else { "-1e-3" };
        let _ = writeln!(
            rest,
            "[[segment]]\nincrements = {increments}\n\
             control = {{ t = {{ jump = {jump} }}{normal} }}"
        );
    }
    run(&rest)
}

#[test]
fn cycles_at_constant_normal_stiffness_degrade_as_the_closed_form_says() {
    for (n, increments) in [(10, 1), (10, 12)] {
        for k in [1e5, 1e6] {
            let run = cycles(n, increments, &format!(", n = {{ stiffness = {k:e} }}"));
            follows_closed_form(&run, k * K_N / (k + K_N));
            // The shear stress at the end of each cycle only falls.
            let ends: Vec<f64> = (1..=n)
                .map(|cycle| run.at((2 * cycle - 1) * increments, "traction_t"))
                .collect();
            assert!(ends.windows(2).all(|pair| pair[1] < pair[0]), "{ends:?}");
        }
    }
}

#[test]
fn cycles_at_constant_normal_stress_lose_friction_only() {
    follows_closed_form(&cycles(5, 7, ""), 0.0);
}

#[test]
fn cycles_at_constant_volume_lose_most() {
    follows_closed_form(&cycles(10, 7, ", n = { jump = 0 }"), K_N);
}

#[test]
fn opens_without_traction_and_closes_where_contact_was_lost() {
    // 100 kPa are gone after 0.1 mm.
    let run = run(
        "[[segment]]\nincrements = 8\ncontrol = { n = { jump = 4e-4 } }\n\
         [[segment]]\nincrements = 2\ncontrol = { n = { jump = 4e-4 }, t = { jump = 1e-3 } }\n\
         [[segment]]\nincrements = 8\ncontrol = { n = { jump = 0 }, t = { jump = 1e-3 } }",
    );
    for k in 0..=18 {
        let contact = (K_N * run.at(k, "jump_n") - 100.0).min(0.0);
        assert_relative_eq!(run.at(k, "traction_n"), contact, epsilon = 1e-9);
        assert_relative_eq!(run.at(k, "traction_t"), 0.0, epsilon = 1e-9);
        assert_relative_eq!(run.at(k, "plastic_slip"), 0.0, epsilon = 1e-15);
    }
}
