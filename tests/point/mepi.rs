//! MEPI without softening in the shear box.
//!
//! Goal        the three boundary conditions of the interface shear box, reversal, contact.
//! Set-up      σ_n = 100 kPa, shear jump to 2 mm.
//! Law         mepi: Table IV (1) of De Gennaro & Frank, p_0 = σ_ni = 100 kPa.
//! Asserts     τ and ξ in closed form; σ_n and [u_n] by quadrature, first order in the increment.
//!
//! At constant normal stress [u_t] = ξ + μ(ξ) σ_n/K_t is a quadratic in ξ with (10).

use crate::driver::{Run, follow};
use crate::mepi_truth::Mepi;
use approx::assert_relative_eq;
use tests::tolerance::DRIVER;

pub(crate) const PARAMETERS: &str = "[parameters]\nk_n = 0.86e5\nk_t = 0.37e5\nn = 0.55\n\
    mu_0 = 0.27\nmu_p = 0.7\nmu_c0 = 0.46\na = 0.008\nc_0 = 40\nt = 0.002\np_0 = 100\n";

/// Increments of 0.16 µm or less, a hundredth of the slip scale A (σ_ni/p_0) t.
const FINE: usize = 12_800;

fn truth() -> Mepi {
    let power = 100_f64.powf(0.55);
    Mepi {
        k_n: 0.86e5 * power,
        k_t: 0.37e5 * power,
        mu_0: 0.27,
        mu_p: 0.7,
        mu_c0: 0.46,
        slip_scale: 0.008 * 0.002,
        stabilisation: 40.0 / 0.002,
        softening: None,
    }
}

fn run(rest: &str) -> Run {
    follow(&format!(
        "law = 'mepi'\nhypothesis = 'interface_2d'\n{PARAMETERS}[initial]\n\
         traction = {{ n = -100 }}\n{rest}"
    ))
}

/// Plastic slip at a jump under constant normal stress.
fn slip(mepi: &Mepi, jump: f64, sigma: f64) -> f64 {
    // ξ² + p ξ + q = 0.
    let b = mepi.slip_scale;
    let p = b + sigma * mepi.mu_p / mepi.k_t - jump;
    let q = b * (sigma * mepi.mu_0 / mepi.k_t - jump);
    if q >= 0.0 {
        return 0.0;
    }
    // The root without cancellation.
    let root = (p * p - 4.0 * q).sqrt();
    if p > 0.0 {
        -2.0 * q / (p + root)
    } else {
        (root - p) / 2.0
    }
}

#[test]
fn shear_at_constant_normal_stress_is_exact_for_any_increment() {
    let mepi = truth();
    for increments in [1, 7, 200] {
        let run = run(&format!(
            "[[segment]]\nincrements = {increments}\ncontrol = {{ t = {{ jump = 2e-3 }} }}"
        ));
        for k in 0..=increments {
            let xi = slip(&mepi, run.at(k, "jump_t"), 100.0);
            let tau = mepi.k_t * (run.at(k, "jump_t") - xi);
            assert_relative_eq!(
                run.at(k, "plastic_slip"),
                xi,
                epsilon = 1e-15,
                max_relative = 1e-9
            );
            assert_relative_eq!(
                run.at(k, "traction_t"),
                tau,
                epsilon = 1e-8,
                max_relative = 1e-9
            );
            assert_relative_eq!(run.at(k, "traction_n"), -100.0, max_relative = DRIVER);
        }
        assert_relative_eq!(
            mepi.at(2e-3, 100.0, 0.0).tau,
            run.last("traction_t"),
            epsilon = 1e-6
        );
    }
}

/// Ends of runs with n, 2n and 4n increments converge linearly to the truth; their extrapolation is
/// far closer.
pub(crate) fn converges_linearly(what: &str, truth: f64, n: usize, end: impl Fn(usize) -> f64) {
    let ends = [n, 2 * n, 4 * n].map(end);
    let errors = ends.map(|end| end - truth);
    for pair in errors.windows(2) {
        let ratio = pair[0] / pair[1];
        assert!((1.8..2.2).contains(&ratio), "{what}: errors {errors:?}");
    }
    let extrapolated = 2.0 * ends[2] - ends[1];
    assert!(
        (extrapolated - truth).abs() < 0.1 * errors[2].abs(),
        "{what}: {extrapolated} against {truth}, errors {errors:?}"
    );
}

#[test]
fn normal_displacement_at_constant_normal_stress_converges_to_the_quadrature() {
    for jump in [2e-4, 2e-3] {
        let truth = -truth().at(jump, 100.0, 0.0).contraction;
        converges_linearly("jump_n", truth, FINE, |n| {
            run(&format!(
                "[[segment]]\nincrements = {n}\ncontrol = {{ t = {{ jump = {jump} }} }}"
            ))
            .last("jump_n")
        });
    }
}

#[test]
fn constant_volume_converges_to_the_quadrature() {
    let mepi = truth();
    let end = mepi.at(2e-3, 100.0, mepi.k_n);
    let run = |n: usize| {
        run(&format!(
            "[[segment]]\nincrements = {n}\n\
             control = {{ t = {{ jump = 2e-3 }}, n = {{ jump = 0 }} }}"
        ))
    };
    converges_linearly("traction_n", -end.sigma, FINE, |n| {
        run(n).last("traction_n")
    });
    converges_linearly("traction_t", end.tau, FINE, |n| run(n).last("traction_t"));
    // Contraction first, dilation afterwards.
    let normal = run(800).column("traction_n");
    let lowest = normal.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    assert!(
        lowest > -99.5 && normal[800] < -105.0,
        "{lowest} {}",
        normal[800]
    );
}

#[test]
fn constant_normal_stiffness_converges_to_the_quadrature() {
    let mepi = truth();
    for k in [1e5, 1e6] {
        let k_s = k * mepi.k_n / (k + mepi.k_n);
        let end = mepi.at(2e-3, 100.0, k_s);
        let run = |n: usize| {
            run(&format!(
                "[[segment]]\nincrements = {n}\n\
                 control = {{ t = {{ jump = 2e-3 }}, n = {{ stiffness = {k} }} }}"
            ))
        };
        converges_linearly("traction_n", -end.sigma, FINE, |n| {
            run(n).last("traction_n")
        });
        let opening = (end.sigma - 100.0) / k;
        converges_linearly("jump_n", opening, FINE, |n| run(n).last("jump_n"));
        let run = run(50);
        for row in 0..=50 {
            // What the control says, in every row.
            let spring = -100.0 - k * run.at(row, "jump_n");
            assert_relative_eq!(run.at(row, "traction_n"), spring, max_relative = DRIVER);
        }
    }
}

#[test]
fn unloading_and_reloading_are_elastic() {
    let run = run(
        "[[segment]]\nincrements = 20\ncontrol = { t = { jump = 1e-3 } }\n\
         [[segment]]\nincrements = 10\ncontrol = { t = { traction = 0 } }\n\
         [[segment]]\nincrements = 10\ncontrol = { t = { jump = 1e-3 } }\n\
         [[segment]]\nincrements = 20\ncontrol = { t = { jump = 2e-3 } }",
    );
    let mepi = truth();
    let tau = run.at(20, "traction_t");
    for k in 20..=40 {
        let elastic = tau + mepi.k_t * (run.at(k, "jump_t") - 1e-3);
        assert_relative_eq!(run.at(k, "traction_t"), elastic, epsilon = 1e-7);
        assert_relative_eq!(
            run.at(k, "plastic_slip"),
            run.at(20, "plastic_slip"),
            max_relative = 1e-8
        );
    }
    let xi = slip(&mepi, 2e-3, 100.0);
    assert_relative_eq!(run.last("plastic_slip"), xi, max_relative = 1e-8);
}

#[test]
fn slip_counts_in_both_directions() {
    let run = run(
        "[[segment]]\nincrements = 20\ncontrol = { t = { jump = 1e-3 } }\n\
         [[segment]]\nincrements = 20\ncontrol = { t = { jump = -1e-3 } }",
    );
    let mepi = truth();
    let first = slip(&mepi, 1e-3, 100.0);
    // Backwards: u = ξ_1 − (ξ − ξ_1) − μ(ξ) σ/K_t.
    let backwards = |xi: f64| 2.0 * first - xi - mepi.mu(xi) * 100.0 / mepi.k_t;
    let (mut low, mut high) = (first, first + 2e-3);
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if backwards(middle) > -1e-3 {
            low = middle;
        } else {
            high = middle;
        }
    }
    assert_relative_eq!(run.last("plastic_slip"), low, max_relative = 1e-8);
    assert_relative_eq!(
        run.last("traction_t"),
        -100.0 * mepi.mu(low),
        max_relative = 1e-8
    );
}

#[test]
fn opens_without_traction_and_closes_where_contact_was_lost() {
    let k_n = truth().k_n;
    let run = run(
        "[[segment]]\nincrements = 6\ncontrol = { n = { jump = 3e-4 } }\n\
         [[segment]]\nincrements = 6\ncontrol = { n = { jump = 0 } }",
    );
    for k in 0..=12 {
        let contact = (k_n * run.at(k, "jump_n") - 100.0).min(0.0);
        assert_relative_eq!(run.at(k, "traction_n"), contact, epsilon = 1e-9);
    }
}

#[test]
fn the_initial_normal_stress_fixes_the_stiffness() {
    // σ_ni is 50 kPa at this point, not the 100 kPa of the others.
    let run = follow(&format!(
        "law = 'mepi'\nhypothesis = 'interface_2d'\n{PARAMETERS}[initial]\n\
         traction = {{ n = -50 }}\n[[segment]]\nincrements = 1\n\
         control = {{ n = {{ jump = -1e-5 }} }}"
    ));
    let k_n = 0.86e5 * 50_f64.powf(0.55);
    assert_relative_eq!(
        run.last("traction_n"),
        -50.0 - k_n * 1e-5,
        max_relative = 1e-12
    );
    assert_relative_eq!(run.last("sigma_ni"), 50.0);
}

fn by_scheme(scheme: &str, segment: &str) -> Run {
    follow(&format!(
        "law = 'mepi'\nhypothesis = 'interface_2d'\n{PARAMETERS}{scheme}\n[initial]\n\
         traction = {{ n = -100 }}\n[[segment]]\n{segment}"
    ))
}

/// One increment of constant volume: substeps alone carry it to the quadrature.
#[test]
fn explicit_substeps_converge_linearly_and_controlled_ones_meet_their_tolerance() {
    let mepi = truth();
    let end = mepi.at(1e-3, 100.0, mepi.k_n);
    let locked = "increments = 1\ncontrol = { t = { jump = 1e-3 }, n = { jump = 0 } }";
    let errors = |scheme: String| {
        let run = by_scheme(&scheme, locked);
        [
            (run.last("traction_n") + end.sigma).abs() / end.sigma,
            (run.last("traction_t") - end.tau).abs() / end.tau,
            (run.last("plastic_slip") - end.slip).abs() / end.slip,
        ]
    };
    let explicit = [400, 800, 1600].map(|n| errors(format!("scheme = 'explicit'\nsubsteps = {n}")));
    for pair in explicit.windows(2) {
        for (coarse, fine) in pair[0].iter().zip(pair[1]) {
            assert!((1.6..2.5).contains(&(coarse / fine)), "{explicit:?}");
        }
    }
    for tolerance in [1e-4, 1e-6] {
        let scheme = format!("scheme = 'error_controlled'\nscheme_tolerance = {tolerance:e}");
        let largest = errors(scheme).into_iter().fold(0.0, f64::max);
        assert!(largest < 10.0 * tolerance, "{largest:e} at {tolerance:e}");
    }
}

/// The driver finds equilibrium with the continuum tangent, and the dilatancy has no error left of
/// the end-point rule.
#[test]
fn error_control_follows_the_dilatancy_at_constant_normal_stress() {
    let expected = -truth().at(2e-3, 100.0, 0.0).contraction;
    let run = by_scheme(
        "scheme = 'error_controlled'",
        "increments = 200\ncontrol = { t = { jump = 2e-3 } }",
    );
    let jump = run.last("jump_n");
    assert_relative_eq!(jump, expected, max_relative = 1e-4);
    assert_relative_eq!(run.last("traction_n"), -100.0, max_relative = DRIVER);
}

#[test]
fn a_part_of_a_substep_is_refused() {
    let refused = crate::driver::attempt(&format!(
        "law = 'mepi'\nhypothesis = 'interface_2d'\n{PARAMETERS}scheme = 'explicit'\n\
         substeps = 2.5\n[initial]\ntraction = {{ n = -100 }}\n[[segment]]\nincrements = 1\n\
         control = {{ t = {{ jump = 1e-3 }} }}"
    ));
    assert!(
        refused.error().to_string().contains("2.5"),
        "{}",
        refused.error()
    );
}
