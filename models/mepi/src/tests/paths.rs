//! Monotonic and reversed paths against closed forms and quadrature.

use super::*;
use approx::assert_relative_eq;

/// Slips to `u_t` in `n` increments.
fn walk<L: InterfaceLaw<State = State>>(
    law: &L,
    sigma: f64,
    stiffness: f64,
    u_t: f64,
    n: usize,
) -> Walker<'_, L> {
    let mut walker = Walker::new(law, sigma);
    for _ in 0..n {
        if stiffness.is_infinite() {
            walker.step([0.0, u_t / n as f64]);
        } else {
            walker.slip(stiffness, u_t / n as f64);
        }
    }
    walker
}

#[test]
fn reaches_the_closed_form_in_one_increment_under_constant_normal_stress() {
    for sigma in [20.0, 100.0, 300.0] {
        for u_t in [1e-5, 2e-4, 1e-3, 5e-3, 5e-2] {
            let law = mepi(TABLE_4);
            let truth = Truth::hardening(TABLE_4, sigma);
            let [xi, _, tau] = truth.at_slip(u_t, 0.0);
            let end = walk(&law, sigma, 0.0, u_t, 1);
            if truth.k_t() * u_t > TABLE_4.mu_0 * sigma {
                assert_relative_eq!(end.tau(), tau, max_relative = 1e-12);
                assert_relative_eq!(end.state.plastic_slip, xi, max_relative = 1e-10);
            }
            for p in [FONTAINEBLEAU, SILICA] {
                let law = softening(p);
                let truth = Truth::softening(p, sigma);
                let [xi, _, tau] = truth.at_slip(u_t, 0.0);
                let end = walk(&law, sigma, 0.0, u_t, 1);
                assert_relative_eq!(end.tau(), tau, max_relative = 1e-11);
                assert_relative_eq!(end.state.plastic_slip, xi, max_relative = 1e-10);
            }
        }
    }
}

/// Errors of `σ_n`, τ and `[u_n]` against quadrature fall at first order, and extrapolation gains.
fn converges<L: InterfaceLaw<State = State>>(
    law: &L,
    truth: Truth,
    stiffness: f64,
    u_t: f64,
    tolerance: f64,
) {
    let sigma = truth.sigma_ni;
    let [xi, sigma_end, tau_end] = truth.at_slip(u_t, stiffness);
    // σ_n = K_n ([u_n] − [u_n^p]) + σ_ni.
    let u_n = truth.plastic_contraction(xi) + (sigma_end - sigma) / truth.k_n();
    let expected = [sigma_end, tau_end, u_n];
    let results = [1000, 2000, 4000].map(|n| {
        let end = walk(law, sigma, stiffness, u_t, n);
        [end.sigma(), end.tau(), end.u[0]]
    });
    for i in 0..3 {
        let scale = if i < 2 { sigma } else { u_t };
        let errors = results.map(|r| (r[i] - expected[i]) / scale);
        let extrapolated = (2.0 * results[2][i] - results[1][i] - expected[i]) / scale;
        println!("component {i}: errors {errors:?}, extrapolated {extrapolated:e}");
        assert!(errors[2].abs() < tolerance, "{i}: {errors:?}");
        if errors[2].abs() > 1e-10 {
            let rate = (errors[1] / errors[2]).log2();
            assert!((rate - 1.0).abs() < 0.15, "{i}: rate {rate}, {errors:?}");
            assert!(
                extrapolated.abs() < 0.15 * errors[2].abs(),
                "{i}: extrapolated {extrapolated:e}, {errors:?}"
            );
        }
    }
}

fn hardens(p: Common, stiffness: f64, slip: f64, tolerance: f64) {
    let truth = Truth::hardening(p, 100.0);
    converges(&mepi(p), truth, stiffness, slip, tolerance);
}

fn softens(p: mepi_softening::Parameters, stiffness: f64, slip: f64, tolerance: f64) {
    let truth = Truth::softening(p, 100.0);
    converges(&softening(p), truth, stiffness, slip, tolerance);
}

#[test]
fn follows_the_integral_of_the_dilatancy_under_constant_normal_stress() {
    hardens(TABLE_4, 0.0, 2e-3, 1e-3);
    hardens(TABLE_2, 0.0, 2e-4, 1e-3);
    for p in [FONTAINEBLEAU, SILICA] {
        softens(p, 0.0, 5e-3, 1e-3);
    }
}

#[test]
fn follows_the_integral_of_the_dilatancy_at_constant_volume() {
    let locked = f64::INFINITY;
    hardens(TABLE_4, locked, 1e-3, 2e-2);
    hardens(TABLE_2, locked, 5e-4, 2e-2);
    for p in [FONTAINEBLEAU, SILICA] {
        softens(p, locked, 4e-4, 2e-2);
    }
}

#[test]
fn follows_the_integral_of_the_dilatancy_against_a_normal_spring() {
    for stiffness in [1e4, 1e6] {
        hardens(TABLE_4, stiffness, 2e-3, 2e-2);
        for p in [FONTAINEBLEAU, SILICA] {
            softens(p, stiffness, 3e-3, 2e-2);
        }
    }
}

/// The sequence that the paper describes for Table II at constant volume (Fig. 5b):
/// `σ_n = σ_ni − K_n ∫ β dξ`, with β falling from `μ_c0` through zero at the characteristic state to its
/// strongest dilation, and back to nothing. Backward Euler takes β at the end of each increment. Over a
/// range in which β is monotonic that is off by the increment times the change of β at most.
#[test]
fn contracts_then_dilates_then_stabilises() {
    let (law, truth) = (mepi(TABLE_2), Truth::hardening(TABLE_2, 100.0));
    let Common {
        mu_p,
        mu_c0,
        a,
        c_0,
        t,
        p_0,
        ..
    } = TABLE_2;
    let (n, du) = (40_000, 1e-7);
    let mut walker = Walker::new(&law, 100.0);
    let mut history = vec![];
    let mut longest = 0.0_f64;
    for _ in 0..n {
        let before = walker.state.plastic_slip;
        walker.step([0.0, du]);
        longest = longest.max(walker.state.plastic_slip - before);
        history.push((walker.state.plastic_slip, walker.sigma()));
    }
    // Eq. (10) with μ_0 = 0 is μ_c0 at this slip, where σ_n is lowest: ∫ μ dξ has a closed form.
    let scale = a * 100.0 / p_0 * t;
    let turn = scale * mu_c0 / (mu_p - mu_c0);
    let contraction = mu_c0 * turn - mu_p * (turn - scale * (turn / scale).ln_1p());
    let expected = 100.0 - truth.k_n() * contraction;
    let off = truth.k_n() * longest * mu_c0;
    let sigmas = history.iter().map(|(_, sigma)| *sigma);
    let lowest = sigmas.fold(f64::INFINITY, f64::min);
    assert!((lowest - expected).abs() < off, "{lowest} {expected} {off}");
    assert!(expected + off < 99.5, "{expected} {off}");
    // β never leaves (μ_c0 − μ_p, μ_c0): it goes down that range once and back up to zero.
    let (xi, sigma) = history[n - 1];
    let expected = truth.sigma(xi, f64::INFINITY);
    let off = truth.k_n() * longest * (mu_c0 + 2.0 * (mu_p - mu_c0));
    assert!((sigma - expected).abs() < off, "{sigma} {expected} {off}");
    assert!(expected - off > 101.0, "{expected} {off}");
    // From a slip ξ on, |β| ≤ (μ_p − μ_c0)/cosh z ≤ 2 (μ_p − μ_c0) exp(−z) with the z of Eq. (17) can
    // still change σ_n by its integral; every increment rounds σ_n once.
    let (xi, quarter_before) = history[n - n / 4];
    let rate = c_0 * 100.0 / p_0 / t;
    let left = truth.k_n() * 2.0 * (mu_p - mu_c0) * (-rate * xi).exp() / rate;
    let rounding = 0.25 * n as f64 * f64::EPSILON * sigma;
    assert!((sigma - quarter_before).abs() <= left + rounding);
}

#[test]
fn unloads_and_reloads_elastically() {
    let law = mepi(TABLE_4);
    let mut walker = walk(&law, 100.0, 0.0, 1e-3, 50);
    let top = walker.clone();
    let k_t = Truth::hardening(TABLE_4, 100.0).k_t();
    for direction in [-1.0, 1.0] {
        for _ in 0..10 {
            walker.step([0.0, direction * 1e-5]);
        }
        if direction < 0.0 {
            assert_relative_eq!(walker.tau(), top.tau() - 1e-4 * k_t, max_relative = 1e-12);
        }
    }
    assert_relative_eq!(walker.tau(), top.tau(), max_relative = 1e-12);
    // Back on the surface to round-off: no more than round-off of slip.
    assert!((walker.state.plastic_slip - top.state.plastic_slip).abs() < 1e-16);
}

#[test]
fn accumulates_slip_over_both_directions() {
    // ξ = path length − elastic part, under constant normal stress: two reversals in three steps.
    let law = mepi(TABLE_4);
    let truth = Truth::hardening(TABLE_4, 100.0);
    let mut walker = Walker::new(&law, 100.0);
    let (mut xi, mut tau) = (0.0, 0.0);
    for (i, du) in [2e-3, -3e-3, 4e-3_f64].into_iter().enumerate() {
        walker.slip(0.0, du);
        // |Δu_t| = Δξ + |Δτ| / K_t with |τ| = σ_n μ(ξ) at both ends.
        let (mut low, mut high) = (xi, xi + du.abs());
        for _ in 0..100 {
            let middle = 0.5 * (low + high);
            let d_tau = 100.0 * truth.mu(middle) + tau;
            if middle - xi + d_tau / truth.k_t() < du.abs() {
                low = middle;
            } else {
                high = middle;
            }
        }
        (xi, tau) = (low, 100.0 * truth.mu(low));
        let sign = if i % 2 == 0 { 1.0 } else { -1.0 };
        assert_relative_eq!(walker.state.plastic_slip, xi, max_relative = 1e-12);
        assert_relative_eq!(walker.tau(), sign * tau, max_relative = 1e-12);
    }
}

#[test]
fn splitting_an_elastic_step_changes_nothing() {
    let law = mepi(TABLE_4);
    let mut one = Walker::new(&law, 100.0);
    let mut many = Walker::new(&law, 100.0);
    one.step([1e-5, 3e-5]);
    for _ in 0..100 {
        many.step([1e-7, 3e-7]);
    }
    assert_relative_eq!(one.sigma(), many.sigma(), max_relative = 1e-13);
    assert_relative_eq!(one.tau(), many.tau(), max_relative = 1e-13);
    assert_eq!(one.state, many.state);
}

#[test]
fn returns_an_initial_state_outside_the_surface() {
    let law = mepi(TABLE_4);
    let mut walker = Walker::new(&law, 100.0);
    walker.traction = [-100.0, 90.0];
    walker.step([0.0, 0.0]);
    let mu = Truth::hardening(TABLE_4, 100.0).mu(walker.state.plastic_slip);
    assert!(walker.state.plastic_slip > 0.0);
    assert_relative_eq!(walker.tau(), mu * walker.sigma(), max_relative = 1e-14);
}

#[test]
fn stops_at_the_published_peak_and_waits_for_the_new_friction() {
    for p in [FONTAINEBLEAU, SILICA].map(published) {
        let (law, sigma) = (softening(p), 100.0);
        let truth = Truth::softening(p, sigma);
        let mut walker = Walker::new(&law, sigma);
        let mut waited = 0;
        let mut highest = 0.0_f64;
        for _ in 0..20_000 {
            let before = walker.state.plastic_slip;
            walker.slip(0.0, 2.5e-7);
            highest = highest.max(walker.tau());
            let xi = walker.state.plastic_slip;
            if before > 0.0 && xi == before {
                assert_eq!(xi, p.softening.u_tp);
                assert!(walker.tau() <= p.common.mu_p * sigma * (1.0 + 1e-12));
                waited += 1;
            } else if xi != p.softening.u_tp {
                let expected = truth.mu(xi) * walker.sigma();
                assert_relative_eq!(walker.tau(), expected, max_relative = 1e-12);
            }
        }
        let jump = p.common.mu_p - truth.mu(p.softening.u_tp);
        let expected = jump * sigma / truth.k_t() / 2.5e-7;
        assert!(
            (f64::from(waited) - expected).abs() < 2.0,
            "{waited}, {expected}"
        );
        assert!(highest > 0.999 * p.common.mu_p * sigma, "{highest}");
    }
}

#[test]
fn one_increment_across_the_published_peak_ends_on_the_softening_branch() {
    for p in [FONTAINEBLEAU, SILICA].map(published) {
        let law = softening(p);
        let truth = Truth::softening(p, 100.0);
        let [xi, _, tau] = truth.at_slip(5e-3, 0.0);
        let end = walk(&law, 100.0, 0.0, 5e-3, 1);
        assert_relative_eq!(end.state.plastic_slip, xi, max_relative = 1e-10);
        assert_relative_eq!(end.tau(), tau, max_relative = 1e-11);
        converges(&law, truth, 0.0, 5e-3, 1e-3);
    }
}

#[test]
fn never_gains_energy() {
    for stiffness in [0.0, 1e5, f64::INFINITY] {
        let law = softening(SILICA);
        let mut walker = Walker::new(&law, 100.0);
        let mut spent = 0.0;
        for i in 0..3000 {
            let du = if (i / 500) % 2 == 0 { 2e-6 } else { -2e-6 };
            if stiffness.is_infinite() {
                walker.step([0.0, du]);
            } else {
                walker.slip(stiffness, du);
            }
            assert!(walker.dissipation >= spent, "increment {i}");
            spent = walker.dissipation;
        }
        assert!(spent > 0.0);
    }
}
