//! Mohr–Coulomb in the elementary tests of soil mechanics.
//!
//! Goal        strength, dilatancy and paths on faces, edges, apex and tension planes.
//! Set-up      triaxial compression and extension, oedometer, simple shear, tension.
//! Law         mohr_coulomb: E = 34 MPa, ν = 0.3 or 0.1, c = 10 kPa, φ = 36.5°, ψ = 12°.
//! Asserts     σ_1 = σ_3 K_p + 2c √K_p; slopes of volume; Davis' strength in simple shear.
//!
//! Strength in simple shear: Davis, E. H. (1968) Theories of plasticity and the failure of soil
//! masses: τ = (σ_n + c cot φ) sin φ cos ψ/(1 − sin φ sin ψ) once the stresses are steady, where
//! lines of no extension are horizontal.

use crate::driver::{Run, follow};
use approx::assert_relative_eq;
use tests::tolerance::DRIVER;

const E: f64 = 34e3;
const C: f64 = 10.0;

struct Angles {
    k_p: f64,
    sin_phi: f64,
    sin_psi: f64,
}

fn angles() -> Angles {
    let (phi, psi) = (36.5_f64.to_radians(), 12_f64.to_radians());
    Angles {
        k_p: (1.0 + phi.sin()) / (1.0 - phi.sin()),
        sin_phi: phi.sin(),
        sin_psi: psi.sin(),
    }
}

fn with(nu: f64, more: &str, rest: &str) -> Run {
    follow(&format!(
        "law = 'mohr_coulomb'\nhypothesis = 'axisymmetric'\n[parameters]\nyoung_modulus = {E}\n\
         poisson_ratio = {nu}\ncohesion = {C}\nfriction_angle = 36.5\ndilatancy_angle = 12\n{more}\
         [initial]\nstress = {{ 11 = -100, 22 = -100, 33 = -100 }}\n{rest}"
    ))
}

fn volume(run: &Run, k: usize) -> f64 {
    run.at(k, "strain_11") + run.at(k, "strain_22") + run.at(k, "strain_33")
}

#[test]
fn drained_triaxial_compression() {
    let run = with(
        0.3,
        "",
        "[[segment]]\nincrements = 40\ncontrol = { 22 = { strain = -0.04 } }",
    );
    let Angles { k_p, sin_psi, .. } = angles();
    let strength = -(100.0 * k_p + 2.0 * C * k_p.sqrt());
    let yields = (strength + 100.0) / E;
    for k in 0..=40 {
        let axial = run.at(k, "strain_22");
        let stress = (-100.0 + E * axial).max(strength);
        assert_relative_eq!(run.at(k, "stress_22"), stress, max_relative = DRIVER);
        assert_relative_eq!(run.at(k, "stress_11"), -100.0, max_relative = DRIVER);
        let elastic = axial.max(yields);
        let dilation = -2.0 * sin_psi / (1.0 - sin_psi) * (axial - elastic);
        assert_relative_eq!(volume(&run, k), 0.4 * elastic + dilation, epsilon = 1e-11);
        // No direction is preferred across the axis.
        assert_relative_eq!(
            run.at(k, "strain_11"),
            run.at(k, "strain_33"),
            epsilon = 1e-12
        );
    }
}

#[test]
fn drained_triaxial_extension() {
    let run = with(
        0.3,
        "",
        "[[segment]]\nincrements = 40\ncontrol = { 22 = { strain = 0.04 } }",
    );
    let Angles { k_p, sin_psi, .. } = angles();
    let strength = -(100.0 - 2.0 * C * k_p.sqrt()) / k_p;
    let yields = (strength + 100.0) / E;
    for k in 0..=40 {
        let axial = run.at(k, "strain_22");
        let stress = (-100.0 + E * axial).min(strength);
        assert_relative_eq!(run.at(k, "stress_22"), stress, max_relative = DRIVER);
        let elastic = axial.min(yields);
        let dilation = 2.0 * sin_psi / (1.0 + sin_psi) * (axial - elastic);
        assert_relative_eq!(volume(&run, k), 0.4 * elastic + dilation, epsilon = 1e-11);
    }
}

#[test]
fn triaxial_compression_under_stress_control_up_to_the_strength() {
    let Angles { k_p, .. } = angles();
    let strength = -(100.0 * k_p + 2.0 * C * k_p.sqrt());
    let run = with(
        0.3,
        "",
        &format!(
            "[[segment]]\nincrements = 5\ncontrol = {{ 22 = {{ stress = {} }} }}",
            strength * (1.0 - 1e-9)
        ),
    );
    assert_relative_eq!(
        run.last("strain_22"),
        (strength + 100.0) / E,
        max_relative = 1e-6
    );
}

#[test]
fn unloading_from_failure_and_reloading_are_elastic() {
    let run = with(
        0.3,
        "",
        "[[segment]]\nincrements = 10\ncontrol = { 22 = { strain = -0.03 } }\n\
         [[segment]]\nincrements = 10\ncontrol = { 22 = { stress = -50 } }\n\
         [[segment]]\nincrements = 10\ncontrol = { 22 = { strain = -0.03 } }",
    );
    let (stress, strain) = (run.at(10, "stress_22"), run.at(10, "strain_22"));
    for k in 10..=30 {
        let elastic = stress + E * (run.at(k, "strain_22") - strain);
        assert_relative_eq!(run.at(k, "stress_22"), elastic, max_relative = 1e-8);
        assert_relative_eq!(
            run.at(k, "plastic_strain"),
            run.at(10, "plastic_strain"),
            max_relative = 1e-8
        );
    }
}

#[test]
fn oedometer_keeps_to_the_surface_after_yield() {
    // ν/(1 − ν) = 0.11 is below 1/K_p = 0.25: the lateral stress falls behind until it yields.
    let nu = 0.1;
    let run = with(
        nu,
        "",
        "[[segment]]\nincrements = 40\n\
         control = { 11 = { strain = 0 }, 33 = { strain = 0 }, 22 = { strain = -0.04 } }",
    );
    let Angles {
        k_p,
        sin_phi,
        sin_psi,
    } = angles();
    let m = E * (1.0 - nu) / ((1.0 + nu) * (1.0 - 2.0 * nu));
    let lambda = m * nu / (1.0 - nu);
    // Rates on the edge: both faces flow at the rate x, so ε_lat^e = −x a_ψ, ε_ax^e = ε_ax + 2x b_ψ,
    // and a_φ σ_lat = b_φ σ_ax.
    let (a, b) = (0.5 * (1.0 + sin_phi), 0.5 * (1.0 - sin_phi));
    let (a_psi, b_psi) = (0.5 * (1.0 + sin_psi), 0.5 * (1.0 - sin_psi));
    let axial = |x: f64| m * (1.0 + 2.0 * x * b_psi) - 2.0 * lambda * x * a_psi;
    let lateral = |x: f64| lambda * (1.0 + 2.0 * x * b_psi) - (lambda + m) * x * a_psi;
    let f = |x: f64| a * lateral(x) - b * axial(x);
    let x = f(0.0) / (f(0.0) - f(1.0));
    // Yield: −σ_ax = −K_p σ_lat + 2c √K_p on the elastic path.
    let yields = (100.0 * (k_p - 1.0) + 2.0 * C * k_p.sqrt()) / -(m - k_p * lambda);
    assert!(yields > -0.03, "the path has to reach the surface");
    for k in 0..=40 {
        let strain = run.at(k, "strain_22");
        let elastic = strain.max(yields);
        let stress = -100.0 + m * elastic + axial(x) * (strain - elastic);
        assert_relative_eq!(run.at(k, "stress_22"), stress, max_relative = DRIVER);
        let stress = -100.0 + lambda * elastic + lateral(x) * (strain - elastic);
        assert_relative_eq!(run.at(k, "stress_11"), stress, max_relative = DRIVER);
    }
    let surface = k_p * run.last("stress_11") - 2.0 * C * k_p.sqrt();
    assert_relative_eq!(run.last("stress_22"), surface, max_relative = DRIVER);
}

#[test]
fn simple_shear_reaches_the_strength_of_davis() {
    let run = follow(&format!(
        "law = 'mohr_coulomb'\nhypothesis = 'plane_strain'\n[parameters]\nyoung_modulus = {E}\n\
         poisson_ratio = 0.3\ncohesion = {C}\nfriction_angle = 36.5\ndilatancy_angle = 12\n\
         [initial]\nstress = {{ 11 = -50, 22 = -100, 33 = -50 }}\n[[segment]]\nincrements = 200\n\
         control = {{ 12 = {{ strain = 0.4 }}, 11 = {{ strain = 0 }} }}"
    ));
    let Angles {
        sin_phi, sin_psi, ..
    } = angles();
    let cos_psi = (1.0 - sin_psi * sin_psi).sqrt();
    let cot_phi = (1.0 - sin_phi * sin_phi).sqrt() / sin_phi;
    let strength = (100.0 + C * cot_phi) * sin_phi * cos_psi / (1.0 - sin_phi * sin_psi);
    // The stresses approach the steady state exponentially.
    assert_relative_eq!(run.last("stress_12"), strength, max_relative = 1e-6);
    let slope = (run.at(200, "strain_22") - run.at(190, "strain_22"))
        / (run.at(200, "strain_12") - run.at(190, "strain_12"));
    assert_relative_eq!(slope, sin_psi / cos_psi, max_relative = 1e-6);
}

#[test]
fn isotropic_extension_ends_at_the_apex() {
    let run = with(
        0.3,
        "",
        "[[segment]]\nincrements = 10\n\
         control = { 11 = { strain = 0.003 }, 22 = { strain = 0.003 }, 33 = { strain = 0.003 } }",
    );
    let apex = C / 36.5_f64.to_radians().tan();
    for component in ["stress_11", "stress_22", "stress_33"] {
        assert_relative_eq!(run.last(component), apex, max_relative = DRIVER);
    }
}

#[test]
fn uniaxial_tension_ends_at_the_tensile_strength() {
    let run = with(
        0.3,
        "tensile_strength = 4\n",
        "[[segment]]\nincrements = 4\n\
         control = { 11 = { stress = 0 }, 22 = { stress = 0 }, 33 = { stress = 0 } }\n\
         [[segment]]\nincrements = 10\ncontrol = { 22 = { strain = 0.003 } }",
    );
    let at_rest = run.at(4, "strain_22");
    for k in 4..=14 {
        let stress = (E * (run.at(k, "strain_22") - at_rest)).min(4.0);
        assert_relative_eq!(run.at(k, "stress_22"), stress, epsilon = 1e-9);
        assert_relative_eq!(run.at(k, "stress_11"), 0.0, epsilon = 1e-9);
    }
}

#[test]
fn confined_tension_keeps_the_lateral_stress_of_the_tension_plane() {
    // From zero stress with no lateral strain: σ_lat = ν/(1 − ν) R_t after the cut-off.
    let run = follow(&format!(
        "law = 'mohr_coulomb'\nhypothesis = 'axisymmetric'\n[parameters]\nyoung_modulus = {E}\n\
         poisson_ratio = 0.3\ncohesion = {C}\nfriction_angle = 36.5\ndilatancy_angle = 12\n\
         tensile_strength = 4\n[[segment]]\nincrements = 10\n\
         control = {{ 11 = {{ strain = 0 }}, 33 = {{ strain = 0 }}, 22 = {{ strain = 0.003 }} }}"
    ));
    assert_relative_eq!(run.last("stress_22"), 4.0, max_relative = DRIVER);
    assert_relative_eq!(
        run.last("stress_11"),
        4.0 * 0.3 / 0.7,
        max_relative = DRIVER
    );
}

#[test]
fn tresca_has_twice_the_cohesion_in_compression_and_once_in_shear() {
    let tresca = |rest: &str| {
        follow(&format!(
            "law = 'mohr_coulomb'\nhypothesis = 'axisymmetric'\n[parameters]\n\
             young_modulus = 34e3\npoisson_ratio = 0.49\ncohesion = 40\nfriction_angle = 0\n\
             dilatancy_angle = 0\n[initial]\nstress = {{ 11 = -100, 22 = -100, 33 = -100 }}\n\
             [[segment]]\nincrements = 20\n{rest}"
        ))
    };
    let run = tresca("control = { 22 = { strain = -0.04 } }");
    let yields = -80.0 / E;
    for k in 0..=20 {
        let strain = run.at(k, "strain_22");
        let stress = (-100.0 + E * strain).max(-180.0);
        assert_relative_eq!(run.at(k, "stress_22"), stress, max_relative = DRIVER);
        // ν = 0.49 elastically, no change of volume in plastic flow.
        let elastic = strain.max(yields);
        assert_relative_eq!(volume(&run, k), 0.02 * elastic, epsilon = 1e-11);
    }
    let run = tresca("control = { 12 = { strain = 0.04 } }");
    for k in 0..=20 {
        let stress = (E / 2.98 * run.at(k, "strain_12")).min(40.0);
        assert_relative_eq!(run.at(k, "stress_12"), stress, epsilon = 1e-7);
    }
}
