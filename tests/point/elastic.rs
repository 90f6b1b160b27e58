//! Isotropic elasticity at a point.
//!
//! Goal        moduli and Poisson effects of the elementary tests.
//! Set-up      one point, mixed control, increments from an initial stress.
//! Law         elastic: E = 34 MPa, ν = 0.3.
//! Asserts     E, ν, M, G and plane strain against Hooke's law, in every row.

use crate::driver::{Run, follow};
use approx::assert_relative_eq;
use tests::tolerance::DRIVER;

const E: f64 = 34e3;
const NU: f64 = 0.3;

fn run(hypothesis: &str, rest: &str) -> Run {
    follow(&format!(
        "law = 'elastic'\nhypothesis = '{hypothesis}'\n[parameters]\nyoung_modulus = {E}\n\
         poisson_ratio = {NU}\n{rest}"
    ))
}

#[test]
fn oedometer_has_the_oedometric_modulus() {
    let run = run(
        "axisymmetric",
        "[initial]\nstress = { 11 = -50, 22 = -100, 33 = -50 }\n[[segment]]\nincrements = 5\n\
         control = { 11 = { strain = 0 }, 33 = { strain = 0 }, 22 = { strain = -0.01 } }",
    );
    let m = E * (1.0 - NU) / ((1.0 + NU) * (1.0 - 2.0 * NU));
    for k in 0..=5 {
        let strain = run.at(k, "strain_22");
        assert_relative_eq!(
            run.at(k, "stress_22"),
            -100.0 + m * strain,
            max_relative = DRIVER
        );
        let lateral = -50.0 + m * NU / (1.0 - NU) * strain;
        assert_relative_eq!(run.at(k, "stress_11"), lateral, max_relative = DRIVER);
        assert_relative_eq!(run.at(k, "stress_33"), lateral, max_relative = DRIVER);
    }
}

#[test]
fn triaxial_test_has_youngs_modulus_and_poissons_ratio() {
    for hypothesis in ["axisymmetric", "3d"] {
        let run = run(
            hypothesis,
            "[initial]\nstress = { 11 = -100, 22 = -100, 33 = -100 }\n[[segment]]\n\
             increments = 4\ncontrol = { 22 = { stress = -440 } }",
        );
        for k in 0..=4 {
            let axial = (run.at(k, "stress_22") + 100.0) / E;
            assert_relative_eq!(run.at(k, "strain_22"), axial, max_relative = DRIVER);
            for lateral in ["strain_11", "strain_33"] {
                assert_relative_eq!(run.at(k, lateral), -NU * axial, max_relative = DRIVER);
            }
            assert_relative_eq!(run.at(k, "strain_12"), 0.0, epsilon = 1e-18);
        }
    }
}

#[test]
fn simple_shear_has_the_shear_modulus_in_each_plane() {
    let g = E / (2.0 * (1.0 + NU));
    for component in ["12", "13", "23"] {
        let run = run(
            "3d",
            &format!(
                "[[segment]]\nincrements = 3\ncontrol = {{ {component} = {{ strain = 0.003 }} }}"
            ),
        );
        for k in 0..=3 {
            let gamma = run.at(k, &format!("strain_{component}"));
            let tau = run.at(k, &format!("stress_{component}"));
            assert_relative_eq!(tau, g * gamma, max_relative = 1e-14);
        }
    }
}

#[test]
fn plane_strain_compression_has_the_plane_modulus() {
    let run = run(
        "plane_strain",
        "[[segment]]\nincrements = 3\ncontrol = { 22 = { stress = -300 } }",
    );
    for k in 0..=3 {
        let axial = run.at(k, "stress_22");
        let plane = E / (1.0 - NU * NU);
        assert_relative_eq!(run.at(k, "strain_22"), axial / plane, max_relative = DRIVER);
        let lateral = -NU * (1.0 + NU) / E * axial;
        assert_relative_eq!(run.at(k, "strain_11"), lateral, max_relative = DRIVER);
        assert_relative_eq!(run.at(k, "stress_33"), NU * axial, max_relative = DRIVER);
        assert_relative_eq!(run.at(k, "stress_11"), 0.0, epsilon = DRIVER);
    }
}
