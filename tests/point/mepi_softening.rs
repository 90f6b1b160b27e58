//! MEPI with softening in the shear box, with both readings of the peak.
//!
//! Goal        peak, softening and residual friction; the jump of the published reading.
//! Set-up      σ_n = 100 kPa, shear jump to 6 mm.
//! Law         mepi_softening: Fontainebleau sand of Table I of De Gennaro & Frank, u_tp in m.
//! Asserts     τ = μ(ξ) σ_n in closed form; [u_n] and σ_n by quadrature, first order.

use crate::driver::{Run, follow};
use crate::mepi::converges_linearly;
use crate::mepi_truth::{Mepi, Softening};
use approx::assert_relative_eq;
use tests::tolerance::DRIVER;

const U_TP: f64 = 1.4e-3;

fn truth(published: bool) -> Mepi {
    let power = 100_f64.powf(0.55);
    let mut mepi = Mepi {
        k_n: 0.86e5 * power,
        k_t: 0.37e5 * power,
        mu_0: 0.0,
        mu_p: 0.78,
        mu_c0: 0.67,
        slip_scale: 0.00045 * 100.0 * 0.002,
        stabilisation: 0.05 * 100.0 / 0.002,
        softening: None,
    };
    mepi.softening = Some(Softening {
        u_tp: U_TP,
        peak: if published {
            mepi.mu_p
        } else {
            mepi.hardening(U_TP)
        },
        mu_r: 0.7,
        rate: 4.0 / 0.002,
    });
    mepi
}

fn run(published: bool, rest: &str) -> Run {
    let peak = if published {
        "peak = 'published'\n"
    } else {
        ""
    };
    follow(&format!(
        "law = 'mepi_softening'\nhypothesis = 'interface_2d'\n[parameters]\nk_n = 0.86e5\n\
         k_t = 0.37e5\nn = 0.55\nmu_0 = 0\nmu_p = 0.78\nmu_r = 0.7\nmu_c0 = 0.67\na = 0.00045\n\
         a_0 = 4\nc_0 = 0.05\nu_tp = {U_TP}\nt = 0.002\n{peak}[initial]\n\
         traction = {{ n = -100 }}\n{rest}"
    ))
}

#[test]
fn friction_follows_hardening_peak_and_softening() {
    for published in [false, true] {
        let mepi = truth(published);
        let run = run(
            published,
            "[[segment]]\nincrements = 300\ncontrol = { t = { jump = 6e-3 } }",
        );
        for k in (0..=300).step_by(6) {
            let state = mepi.at(run.at(k, "jump_t"), 100.0, 0.0);
            assert_relative_eq!(run.at(k, "plastic_slip"), state.slip, epsilon = 1e-12);
            assert_relative_eq!(run.at(k, "traction_t"), state.tau, epsilon = 1e-6);
            assert_relative_eq!(run.at(k, "traction_n"), -100.0, max_relative = DRIVER);
        }
        // 6 mm are 4.6 mm beyond the peak: 1/cosh(9) of the drop is left.
        assert_relative_eq!(run.last("traction_t"), 70.0, max_relative = 1e-4);
    }
}

#[test]
fn the_two_readings_differ_at_the_peak() {
    let path = "[[segment]]\nincrements = 2000\ncontrol = { t = { jump = 6e-3 } }";
    let highest = |published| {
        let tau = run(published, path).column("traction_t");
        tau.into_iter().fold(0.0, f64::max)
    };
    // (10) has reached 94 % of μ_p at u_tp.
    assert_relative_eq!(
        highest(false),
        100.0 * truth(false).hardening(U_TP),
        max_relative = 1e-4
    );
    assert_relative_eq!(highest(true), 78.0, max_relative = 1e-4);
}

#[test]
fn published_peak_is_elastic_between_the_two_values() {
    let mepi = truth(true);
    let lower = U_TP + 100.0 * mepi.hardening(U_TP) / mepi.k_t;
    let upper = U_TP + 100.0 * mepi.mu_p / mepi.k_t;
    let run = run(
        true,
        &format!(
            "[[segment]]\nincrements = 1\ncontrol = {{ t = {{ jump = {lower} }} }}\n\
             [[segment]]\nincrements = 10\ncontrol = {{ t = {{ jump = {upper} }} }}"
        ),
    );
    for k in 1..=11 {
        let elastic = mepi.k_t * (run.at(k, "jump_t") - U_TP);
        assert_relative_eq!(run.at(k, "traction_t"), elastic, max_relative = 1e-8);
        assert_relative_eq!(run.at(k, "plastic_slip"), U_TP, max_relative = 1e-8);
    }
}

#[test]
fn normal_displacement_converges_to_the_quadrature() {
    for published in [false, true] {
        let truth = -truth(published).at(6e-3, 100.0, 0.0).contraction;
        converges_linearly("jump_n", truth, 400, |n| {
            run(
                published,
                &format!("[[segment]]\nincrements = {n}\ncontrol = {{ t = {{ jump = 6e-3 }} }}"),
            )
            .last("jump_n")
        });
    }
}

#[test]
fn constant_normal_stiffness_converges_to_the_quadrature() {
    let mepi = truth(false);
    for k in [1e5, 1e6] {
        let end = mepi.at(6e-3, 100.0, k * mepi.k_n / (k + mepi.k_n));
        converges_linearly("traction_n", -end.sigma, 400, |n| {
            run(
                false,
                &format!(
                    "[[segment]]\nincrements = {n}\n\
                     control = {{ t = {{ jump = 6e-3 }}, n = {{ stiffness = {k} }} }}"
                ),
            )
            .last("traction_n")
        });
    }
}

#[test]
fn constant_volume_converges_to_the_quadrature() {
    let mepi = truth(false);
    let end = mepi.at(6e-3, 100.0, mepi.k_n);
    let run = |n: usize| {
        let path = format!(
            "[[segment]]\nincrements = {n}\n\
             control = {{ t = {{ jump = 6e-3 }}, n = {{ jump = 0 }} }}"
        );
        run(false, &path)
    };
    converges_linearly("traction_n", -end.sigma, 1600, |n| {
        run(n).last("traction_n")
    });
    converges_linearly("traction_t", end.tau, 1600, |n| run(n).last("traction_t"));
}

#[test]
fn contraction_at_constant_volume_can_use_up_the_normal_stress() {
    // With twice the normal stiffness K_n ∫ β dξ exceeds 100 kPa before the characteristic state.
    let mut mepi = truth(false);
    mepi.k_n *= 2.0;
    assert!(mepi.at(4e-4, 100.0, mepi.k_n).sigma < 0.0);
    let run = follow(&format!(
        "law = 'mepi_softening'\nhypothesis = 'interface_2d'\n[parameters]\nk_n = 1.72e5\n\
         k_t = 0.37e5\nn = 0.55\nmu_0 = 0\nmu_p = 0.78\nmu_r = 0.7\nmu_c0 = 0.67\na = 0.00045\n\
         a_0 = 4\nc_0 = 0.05\nu_tp = {U_TP}\nt = 0.002\n[initial]\ntraction = {{ n = -100 }}\n\
         [[segment]]\nincrements = 400\n\
         control = {{ t = {{ jump = 6e-3 }}, n = {{ jump = 0 }} }}"
    ));
    assert_relative_eq!(run.last("traction_n"), 0.0, epsilon = 1e-9);
    assert_relative_eq!(run.last("traction_t"), 0.0, epsilon = 1e-9);
}

#[test]
fn traction_cannot_exceed_the_peak_but_a_jump_can() {
    let run = crate::driver::attempt(&format!(
        "law = 'mepi_softening'\nhypothesis = 'interface_2d'\n[parameters]\nk_n = 0.86e5\n\
         k_t = 0.37e5\nn = 0.55\nmu_0 = 0\nmu_p = 0.78\nmu_r = 0.7\nmu_c0 = 0.67\na = 0.00045\n\
         a_0 = 4\nc_0 = 0.05\nu_tp = {U_TP}\nt = 0.002\n[initial]\ntraction = {{ n = -100 }}\n\
         [[segment]]\nincrements = 100\ncontrol = {{ t = {{ traction = 100 }} }}"
    ));
    assert_eq!(run.error().exit_code(), 2);
    // 100 μ(u_tp) = 73.29 kPa: 73 increments of 1 kPa.
    let peak = 100.0 * truth(false).hardening(U_TP);
    assert_eq!(run.increments(), peak.floor() as usize);
}

#[test]
fn unloading_after_the_peak_is_elastic_also_under_traction_control() {
    let run = run(
        false,
        "[[segment]]\nincrements = 60\ncontrol = { t = { jump = 3e-3 } }\n\
         [[segment]]\nincrements = 10\ncontrol = { t = { traction = 10 } }",
    );
    let mepi = truth(false);
    for k in 60..=70 {
        let elastic = run.at(60, "traction_t") + mepi.k_t * (run.at(k, "jump_t") - 3e-3);
        assert_relative_eq!(run.at(k, "traction_t"), elastic, epsilon = 1e-6);
        assert_relative_eq!(run.at(k, "plastic_slip"), run.at(60, "plastic_slip"));
    }
}
