//! Mohr–Coulomb on a facet.
//!
//! Goal        simple shear along the facet, at constant normal stress and at constant volume.
//! Set-up      axes of the facet: 11 along, 22 normal; 12 strained, 11 held.
//! Law         oriented_mohr_coulomb: E = 34 MPa, ν = 0.3, c = 3 kPa, φ = 35°, ψ = 13.5°.
//! Asserts     bilinear closed forms in every row.
//!
//! After yield at constant normal stress τ = c + σ_n tan φ and dε_22 = tan ψ dγ. At constant volume
//! G (γ − γ_p) = c + (σ_0 + M tan ψ γ_p) tan φ.

use crate::driver::{Run, follow};
use approx::assert_relative_eq;
use tests::tolerance::DRIVER;

const E: f64 = 34e3;
const NU: f64 = 0.3;
const C: f64 = 3.0;

struct Constants {
    g: f64,
    m: f64,
    phi: f64,
    psi: f64,
}

fn constants() -> Constants {
    Constants {
        g: E / (2.0 * (1.0 + NU)),
        m: E * (1.0 - NU) / ((1.0 + NU) * (1.0 - 2.0 * NU)),
        phi: 35_f64.to_radians().tan(),
        psi: 13.5_f64.to_radians().tan(),
    }
}

fn run(normal: &str) -> Run {
    follow(&format!(
        "law = 'oriented_mohr_coulomb'\nhypothesis = 'plane_strain'\n[parameters]\n\
         young_modulus = {E}\npoisson_ratio = {NU}\ncohesion = {C}\nfriction_angle = 35\n\
         dilatancy_angle = 13.5\n[initial]\nstress = {{ 11 = -60, 22 = -100, 33 = -60 }}\n\
         [[segment]]\nincrements = 30\n\
         control = {{ 12 = {{ strain = 0.03 }}, 11 = {{ strain = 0 }}{normal} }}"
    ))
}

#[test]
fn simple_shear_at_constant_normal_stress() {
    let run = run("");
    let Constants { g, phi, psi, .. } = constants();
    let strength = C + 100.0 * phi;
    for k in 0..=30 {
        let gamma = run.at(k, "strain_12");
        let tau = (g * gamma).min(strength);
        let slip = gamma - tau / g;
        assert_relative_eq!(run.at(k, "stress_12"), tau, max_relative = DRIVER);
        assert_relative_eq!(run.at(k, "stress_22"), -100.0, max_relative = DRIVER);
        assert_relative_eq!(run.at(k, "strain_22"), psi * slip, epsilon = 1e-12);
        assert_relative_eq!(run.at(k, "plastic_strain"), slip, epsilon = 1e-12);
    }
}

#[test]
fn simple_shear_at_constant_volume() {
    let run = run(", 22 = { strain = 0 }");
    let Constants { g, m, phi, psi } = constants();
    for k in 0..=30 {
        let gamma = run.at(k, "strain_12");
        let slip = ((g * gamma - C - 100.0 * phi) / (g + m * phi * psi)).max(0.0);
        assert_relative_eq!(
            run.at(k, "stress_12"),
            g * (gamma - slip),
            max_relative = DRIVER
        );
        let normal = -100.0 - m * psi * slip;
        assert_relative_eq!(run.at(k, "stress_22"), normal, max_relative = DRIVER);
        let along = -60.0 - m * NU / (1.0 - NU) * psi * slip;
        assert_relative_eq!(run.at(k, "stress_11"), along, max_relative = DRIVER);
    }
}

#[test]
fn pulling_the_facet_ends_at_the_apex() {
    let text = format!(
        "law = 'oriented_mohr_coulomb'\nhypothesis = 'plane_strain'\n[parameters]\n\
         young_modulus = {E}\npoisson_ratio = {NU}\ncohesion = {C}\nfriction_angle = 35\n\
         dilatancy_angle = 13.5\n[[segment]]\nincrements = 6\n\
         control = {{ 22 = {{ strain = 0.003 }}, 12 = {{ strain = 0.001 }} }}"
    );
    let run = follow(&text);
    let Constants { phi, .. } = constants();
    assert_relative_eq!(run.last("stress_22"), C / phi, max_relative = DRIVER);
    assert_relative_eq!(run.last("stress_12"), 0.0, epsilon = 1e-9);
    assert_relative_eq!(run.last("stress_11"), 0.0, epsilon = 1e-9);
}
