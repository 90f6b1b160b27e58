//! Separation, re-closure, and contraction that uses up the normal stress.

use super::*;
use approx::{assert_abs_diff_eq, assert_relative_eq};

#[test]
fn opens_and_closes_where_contact_was_lost() {
    let law = mepi(TABLE_4);
    let k_n = Truth::hardening(TABLE_4, 100.0).k_n();
    let mut walker = Walker::new(&law, 100.0);
    for cycle in 0..5 {
        // Sliding shifts the position of contact by the plastic contraction.
        for _ in 0..10 {
            walker.slip(0.0, 1e-4);
        }
        let sigma = walker.sigma();
        let u_n = walker.u[0];
        walker.step([-(sigma / k_n + 2e-3), 0.0]);
        assert_eq!(walker.traction, [0.0; 2]);
        let lost_at = walker.u[0] + walker.state.gap;
        // The slip that relieved τ on the way out has moved it a little.
        let moved = walker.state.plastic_contraction;
        assert_abs_diff_eq!(lost_at, moved - 100.0 / k_n, epsilon = 1e-15);
        assert!((lost_at - (u_n - sigma / k_n)).abs() < 1e-4);
        let open = walker.state;
        walker.step([-1e-3, 5e-3]);
        walker.step([5e-4, -1e-3]);
        assert_eq!(walker.traction, [0.0; 2]);
        assert_eq!(walker.state.plastic_slip, open.plastic_slip);
        assert_eq!(walker.state.sigma_ni, open.sigma_ni);
        assert_abs_diff_eq!(walker.state.gap, open.gap + 5e-4, epsilon = 1e-16);
        // Closing in the middle of an increment without slip: σ_n from the rest of it.
        walker.step([walker.state.gap + 100.0 / k_n, 0.0]);
        assert_relative_eq!(walker.sigma(), 100.0, max_relative = 1e-10);
        assert_eq!(walker.tau(), 0.0);
        assert_eq!(walker.state.gap, 0.0);
        assert_eq!(
            walker.state.plastic_slip, open.plastic_slip,
            "cycle {cycle}"
        );
    }
}

#[test]
fn only_the_part_of_an_increment_after_closure_acts() {
    let law = mepi(TABLE_4);
    let (k_n, k_t) = {
        let truth = Truth::hardening(TABLE_4, 100.0);
        (truth.k_n(), truth.k_t())
    };
    let mut walker = Walker::new(&law, 100.0);
    walker.step([-100.0 / k_n - 3e-5, 0.0]);
    assert_relative_eq!(walker.state.gap, 3e-5, max_relative = 1e-10);
    // Three quarters of the path are spent before contact.
    walker.step([4e-5, 4e-6]);
    assert_relative_eq!(walker.sigma(), 1e-5 * k_n, max_relative = 1e-9);
    assert_relative_eq!(walker.tau(), 1e-6 * k_t, max_relative = 1e-9);
}

#[test]
fn losing_contact_relieves_the_shear_stress_by_slip() {
    // Pure opening: all elastic slip τ/K_t turns into plastic slip, in one increment as in many.
    let law = mepi(TABLE_4);
    let truth = Truth::hardening(TABLE_4, 100.0);
    let mut loaded = Walker::new(&law, 100.0);
    for _ in 0..20 {
        loaded.slip(0.0, 5e-5);
    }
    let expected = loaded.state.plastic_slip + loaded.tau() / truth.k_t();
    for n in [1, 10, 1000] {
        let mut walker = loaded.clone();
        for _ in 0..n {
            walker.step([-2e-4 / f64::from(n), 0.0]);
        }
        assert_eq!(walker.traction, [0.0; 2]);
        assert_relative_eq!(walker.state.plastic_slip, expected, max_relative = 1e-12);
        let relieved = walker.state.plastic_contraction - 100.0 / truth.k_n();
        assert_relative_eq!(
            walker.state.gap,
            relieved - walker.u[0],
            max_relative = 1e-10
        );
    }
}

#[test]
fn dilation_keeps_a_point_in_contact_that_opens_slowly() {
    // Constant normal stress in a dilating interface: the trial stress of a large increment is
    // tensile, the solution is not.
    let p = Common {
        mu_0: 0.6,
        c_0: 0.0,
        ..TABLE_4
    };
    let law = mepi(p);
    let mut walker = Walker::new(&law, 100.0);
    walker.slip(0.0, 0.05);
    assert_relative_eq!(walker.sigma(), 100.0, max_relative = 1e-12);
    assert!(walker.u[0] < -100.0 / Truth::hardening(p, 100.0).k_n());
}

#[test]
fn contraction_at_constant_volume_uses_up_the_normal_stress() {
    // Slow hardening: never beyond the characteristic state before σ_n is gone.
    let p = Common {
        a: 10.0,
        mu_0: 0.0,
        ..TABLE_4
    };
    let law = mepi(p);
    let truth = Truth::hardening(p, 100.0);
    // ∫ (μ_c0 − μ) dξ = σ_ni / K_n.
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..100 {
        let xi = 0.5 * (low + high);
        if truth.sigma(xi, f64::INFINITY) > 0.0 {
            low = xi;
        } else {
            high = xi;
        }
    }
    let mut last = f64::INFINITY;
    for n in [100, 1000, 10_000] {
        let mut walker = Walker::new(&law, 100.0);
        for _ in 0..n {
            walker.step([0.0, 1e-3 / f64::from(n)]);
        }
        assert_eq!(walker.traction, [0.0; 2]);
        assert_eq!(walker.state.gap, 0.0);
        assert_abs_diff_eq!(
            walker.state.plastic_contraction,
            100.0 / truth.k_n(),
            epsilon = 1e-17
        );
        let error = (walker.state.plastic_slip - low).abs() / low;
        assert!(error < 0.3 * last, "{n}: {error}, {last}");
        last = error;
        // Loading in compression works again, with τ from zero.
        walker.step([50.0 / truth.k_n(), 0.0]);
        assert_relative_eq!(walker.sigma(), 50.0, max_relative = 1e-12);
        assert_eq!(walker.tau(), 0.0);
    }
    assert!(last < 1e-3);
}

#[test]
fn an_increment_that_exhausts_contact_ends_there_however_far_it_goes() {
    // The slip of the second increment would reach the dilating range; contact is lost before.
    let p = Common {
        a: 1.0,
        mu_0: 0.0,
        ..TABLE_4
    };
    let law = mepi(p);
    for slip in [1e-3, 1e-1, 10.0] {
        let mut walker = Walker::new(&law, 100.0);
        walker.step([0.0, slip]);
        assert_eq!(walker.traction, [0.0; 2], "{slip}");
        assert_eq!(walker.state.gap, 0.0);
    }
}

#[test]
fn a_tension_carried_in_is_released_as_a_gap() {
    let law = mepi(Common {
        sigma_ni: 100.0,
        ..TABLE_4
    });
    let k_n = Truth::hardening(TABLE_4, 100.0).k_n();
    let mut walker = Walker::new(&law, -5.0);
    walker.step([0.0, 0.0]);
    assert_eq!(walker.traction, [0.0; 2]);
    assert_relative_eq!(walker.state.gap, 5.0 / k_n);
}

#[test]
fn a_tension_carried_in_enters_the_trial_as_it_stands() {
    let law = mepi(Common {
        sigma_ni: 100.0,
        ..TABLE_4
    });
    let truth = Truth::hardening(TABLE_4, 100.0);
    let mut walker = Walker::new(&law, -5.0);
    // Closing by 25 kPa of elastic stress leaves 20 kPa; the slip stays below mu_0 of that.
    let (slip, closing) = (1.0 / truth.k_t(), 25.0 / truth.k_n());
    walker.step([closing, slip]);
    assert_relative_eq!(walker.sigma(), 20.0, max_relative = 1e-12);
    assert_relative_eq!(walker.tau(), 1.0, max_relative = 1e-12);
    assert_eq!(walker.state.gap, 0.0);
}

#[test]
fn starts_only_from_compression_unless_the_initial_stress_is_given() {
    let law = mepi(TABLE_4);
    for traction in [0.0, 1.0] {
        assert!(matches!(
            law.initial_state(&[traction, 0.0]),
            Err(Failure::Domain(_))
        ));
    }
    assert_eq!(law.initial_state(&[-7.0, 3.0]).unwrap().sigma_ni, 7.0);
    let given = mepi(TABLE_2);
    assert_eq!(given.initial_state(&[1.0, 0.0]).unwrap().sigma_ni, 100.0);
}

#[test]
fn refuses_parameters_that_do_not_go_together() {
    let refused = |change: fn(&mut Common)| {
        let mut common = TABLE_4;
        change(&mut common);
        let scheme = IMPLICIT;
        let law = Mepi::new(mepi::Parameters { common, scheme });
        law.unwrap_err().parameter
    };
    assert_eq!(refused(|p| p.mu_0 = 0.8), "mu_0");
    assert_eq!(refused(|p| p.mu_c0 = 0.8), "mu_c0");
    let mut residual = SILICA;
    residual.softening.mu_r = 0.9;
    assert_eq!(MepiSoftening::new(residual).unwrap_err().parameter, "mu_r");
}
