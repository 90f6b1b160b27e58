//! Critical state joint.
//!
//! Goal        one set of parameters for dense and loose sand: critical state at constant normal stress,
//!             stiffness and volume, peak, loss of contact.
//! Set-up      traction −100 kPa normal to the joint, slip to 0.3 m, void ratios from 0.65 to 0.95.
//! Law         critical_state_joint: K_n = 5e6 kPa/m, K_t = 1e6 kPa/m, φ_cs = 28°, layer of 5 mm.
//! Asserts     τ = tan φ_cs σ_n and e = e_c0 exp(−(3 σ_n/h_s)^n) at the end; with springs of stiffness k the
//!             layer has grown by Δσ_n/k; the largest τ/σ_n is tan φ_cs exp(−n_b ψ) of the ψ there.

use crate::driver::{Run, follow};
use approx::assert_relative_eq;

const FRICTION: f64 = 28.0;

fn run(void_ratio: f64, factor: f64, rest: &str) -> Run {
    follow(&format!(
        "law = 'critical_state_joint'\nhypothesis = 'interface_2d'\n[parameters]\n\
         normal_stiffness = 5e6\nshear_stiffness = 1e6\ncritical_friction_angle = {FRICTION}\n\
         critical_void_ratio = 0.96\ngranular_hardness = 1e6\nhardness_exponent = 0.29\n\
         peak_exponent = 1.1\ndilatancy_exponent = 3.5\nhardening_slip = 3e-4\nthickness = 5e-3\n\
         initial_void_ratio = {void_ratio}\ndilatancy_factor = {factor}\n\
         [initial]\ntraction = {{ n = -100 }}\n{rest}"
    ))
}

fn sheared(normal: &str) -> String {
    format!(
        "[[segment]]\nincrements = 400\ncontrol = {{ t = {{ jump = 4e-3 }}{normal} }}\n\
         [[segment]]\nincrements = 2000\ncontrol = {{ t = {{ jump = 0.3 }}{normal} }}"
    )
}

fn critical_void_ratio(sigma: f64) -> f64 {
    0.96 * (-(3e-6 * sigma).powf(0.29)).exp()
}

fn friction() -> f64 {
    FRICTION.to_radians().tan()
}

/// σ_n and e at the end, where friction is critical and e is that of the stress.
fn critical(run: &Run) -> (f64, f64) {
    let end = run.increments();
    let sigma = -run.at(end, "traction_n");
    assert_relative_eq!(
        run.at(end, "traction_t") / sigma,
        friction(),
        max_relative = 1e-6
    );
    let e = run.at(end, "void_ratio");
    assert_relative_eq!(e, critical_void_ratio(sigma), max_relative = 1e-6);
    (sigma, e)
}

#[test]
fn dense_and_loose_sand_end_alike_at_constant_normal_stress() {
    for void_ratio in [0.65, 0.8, 0.95] {
        let run = run(void_ratio, 1.0, &sheared(""));
        let (sigma, _) = critical(&run);
        assert_relative_eq!(sigma, 100.0, max_relative = 1e-8);
        let ratio = |k| -run.at(k, "traction_t") / run.at(k, "traction_n");
        let rows = 0..=run.increments();
        let peak = rows.max_by(|&a, &b| ratio(a).total_cmp(&ratio(b)));
        let peak = peak.unwrap();
        let psi = run.at(peak, "void_ratio") - critical_void_ratio(100.0);
        // Off by the change of ψ over an increment.
        let expected = friction() * (-1.1 * psi).exp();
        assert_relative_eq!(ratio(peak), expected, max_relative = 2e-3);
        assert!((ratio(peak) > 1.02 * friction()) == (void_ratio < 0.85));
    }
}

#[test]
fn constant_stiffness_ends_on_the_critical_line() {
    for (void_ratio, k) in [(0.7, 1e5), (0.75, 4e5), (0.95, 1e4)] {
        let normal = format!(", n = {{ stiffness = {k:e} }}");
        let (sigma, e) = critical(&run(void_ratio, 1.0, &sheared(&normal)));
        let opened = 5e-3 * ((1.0 + e) / (1.0 + void_ratio)).ln();
        assert_relative_eq!(k * opened, sigma - 100.0, max_relative = 1e-8);
    }
}

#[test]
fn constant_volume_ends_on_the_critical_line() {
    for void_ratio in [0.8, 0.82, 0.84] {
        let run = run(void_ratio, 0.1, &sheared(", n = { jump = 0 }"));
        let (sigma, e) = critical(&run);
        assert_relative_eq!(e, void_ratio, max_relative = 1e-12);
        let expected = 1e6 / 3.0 * (0.96 / void_ratio).ln().powf(1.0 / 0.29);
        assert_relative_eq!(sigma, expected, max_relative = 1e-5);
    }
}

#[test]
fn opens_without_traction_and_closes_where_contact_was_lost() {
    let run = run(
        0.7,
        1.0,
        "[[segment]]\nincrements = 8\ncontrol = { n = { jump = 4e-5 } }\n\
         [[segment]]\nincrements = 8\ncontrol = { n = { jump = 0 } }",
    );
    for k in 0..=16 {
        let contact = (5e6 * run.at(k, "jump_n") - 100.0).min(0.0);
        assert_relative_eq!(run.at(k, "traction_n"), contact, epsilon = 1e-9);
        let e = 1.7 * (run.at(k, "jump_n").min(2e-5) / 5e-3).exp() - 1.0;
        assert_relative_eq!(run.at(k, "void_ratio"), e, max_relative = 1e-12);
    }
}
