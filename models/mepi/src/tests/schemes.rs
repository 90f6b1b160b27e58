//! The schemes against quadrature and against each other: order, tolerance, contact, and what they
//! leave alone.

use super::*;

const EXPLICIT: f64 = 1.0;
const ERROR_CONTROLLED: f64 = 2.0;

fn in_steps(substeps: f64) -> SchemeParameters {
    SchemeParameters {
        scheme: EXPLICIT,
        substeps,
        ..IMPLICIT
    }
}

fn within(scheme_tolerance: f64) -> SchemeParameters {
    SchemeParameters {
        scheme: ERROR_CONTROLLED,
        scheme_tolerance,
        ..IMPLICIT
    }
}

fn explicit(substeps: f64) -> Mepi {
    mepi_by(in_steps(substeps), TABLE_4)
}

fn controlled(tolerance: f64) -> Mepi {
    mepi_by(within(tolerance), TABLE_4)
}

/// Slip at constant volume, and the largest relative error of `σ_n`, τ and ξ against quadrature.
fn error_at_constant_volume<L: InterfaceLaw<State = State>>(
    law: &L,
    truth: &Truth,
    u_t: f64,
    increments: u32,
) -> f64 {
    let mut walker = Walker::new(law, truth.sigma_ni);
    for _ in 0..increments {
        walker.step([0.0, u_t / f64::from(increments)]);
    }
    let [xi, sigma, tau] = truth.at_slip(u_t, f64::INFINITY);
    let found = [walker.state.plastic_slip, walker.sigma(), walker.tau()];
    [xi, sigma, tau]
        .iter()
        .zip(found)
        .map(|(expected, found)| (found / expected - 1.0).abs())
        .fold(0.0, f64::max)
}

/// The next increment first corrects the drift of the last one, so increments are worth more than
/// substeps.
#[test]
fn the_drift_does_not_accumulate_over_increments() {
    let truth = Truth::hardening(TABLE_4, 100.0);
    let one = error_at_constant_volume(&explicit(400.0), &truth, 1e-3, 1);
    let many = error_at_constant_volume(&explicit(1.0), &truth, 1e-3, 400);
    assert!(many < one, "{one:e} {many:e}");
}

/// A reversal within one increment and back: against implicit steps, extrapolated to no size.
#[test]
fn error_control_follows_a_reversal() {
    let legs = [[1e-4, 8e-4], [-5e-5, -1.2e-3], [0.0, 9e-4]];
    let end = |law: &Mepi, n: u32| {
        let mut walker = Walker::new(law, 100.0);
        for leg in legs {
            for _ in 0..n {
                walker.step(leg.map(|u| u / f64::from(n)));
            }
        }
        [walker.sigma(), walker.tau()]
    };
    let implicit = mepi(TABLE_4);
    let (one, two) = (end(&implicit, 10_000), end(&implicit, 20_000));
    for tolerance in [1e-4, 1e-6] {
        let found = end(&controlled(tolerance), 1);
        for i in 0..2 {
            let error = (found[i] / (2.0 * two[i] - one[i]) - 1.0).abs();
            assert!(error < 10.0 * tolerance, "{error:e} at {tolerance:e}");
        }
    }
}

#[test]
fn elastic_splits_change_nothing() {
    let implicit = mepi(TABLE_4);
    for law in [explicit(10.0), controlled(1e-6)] {
        let inside = [1e-7, 3e-6];
        let start = Walker::new(&implicit, 100.0);
        let one = start.respond(inside, Tangent::Consistent).unwrap();
        let other = Walker::new(&law, 100.0)
            .respond(inside, Tangent::Consistent)
            .unwrap();
        assert_eq!((one.traction, one.tangent), (other.traction, other.tangent));
        let (mut whole, mut split) = (Walker::new(&law, 100.0), Walker::new(&law, 100.0));
        whole.step([0.0, 2e-4]);
        split.step([0.0, 2e-6]);
        split.step([0.0, 1.98e-4]);
        assert!((whole.tau() / split.tau() - 1.0).abs() < 1e-12);
        assert!((whole.sigma() / split.sigma() - 1.0).abs() < 1e-12);
    }
}

/// Opening while slipping: contact is lost where the implicit scheme loses it with small steps, and
/// comes back.
#[test]
fn contact_is_lost_and_returns() {
    let path = |law: &Mepi, n: u32| {
        let mut walker = Walker::new(law, 100.0);
        let mut ends = Vec::new();
        for leg in [[0.0, 2e-4], [-4e-4, 1e-4], [6e-4, 1e-4]] {
            for _ in 0..n {
                walker.step(leg.map(|u| u / f64::from(n)));
            }
            ends.push((walker.state.gap, walker.sigma(), walker.tau()));
        }
        ends
    };
    let reference = path(&mepi(TABLE_4), 20_000);
    assert!(
        reference[1].0 > 0.0 && reference[2].1 > 0.0,
        "the path opens and closes"
    );
    for (law, tolerance) in [(explicit(1000.0), 2e-2), (controlled(1e-6), 1e-3)] {
        for (found, expected) in path(&law, 1).iter().zip(&reference) {
            assert!(
                (found.0 - expected.0).abs() <= tolerance * reference[1].0,
                "{found:?} {expected:?}"
            );
            assert!(
                (found.1 - expected.1).abs() <= tolerance * 100.0,
                "{found:?} {expected:?}"
            );
            assert!(
                (found.2 - expected.2).abs() <= tolerance * 100.0,
                "{found:?} {expected:?}"
            );
        }
    }
}

/// The tangent is that of a small increment from the end.
#[test]
fn the_tangent_is_the_continuum_one() {
    let law = controlled(1e-7);
    let mut walker = Walker::new(&law, 100.0);
    let leg = [1e-5, 5e-4];
    let tangent = walker.respond(leg, Tangent::Consistent).unwrap().tangent;
    walker.step(leg);
    let small = leg.map(|u| 1e-5 * u);
    let next = walker.respond(small, Tangent::None).unwrap().traction;
    for i in 0..2 {
        let predicted = -tangent[i][0] * small[0] + tangent[i][1] * small[1];
        let found = next[i] - walker.traction[i];
        assert!(
            (predicted - found).abs() < 1e-3 * found.abs().max(1e-4),
            "{predicted} {found}"
        );
    }
}

#[test]
fn an_initial_stress_outside_the_surface_is_returned_to_it() {
    for law in [explicit(10.0), controlled(1e-6)] {
        let mut walker = Walker::new(&law, 100.0);
        walker.traction[1] = 60.0;
        walker.step([0.0, 0.0]);
        let truth = Truth::hardening(TABLE_4, 100.0);
        let strength = truth.mu(walker.state.plastic_slip) * walker.sigma();
        assert!((walker.tau() / strength - 1.0).abs() < 1e-10);
    }
}

#[test]
fn the_published_jump_takes_the_implicit_scheme() {
    let refused = MepiSoftening::new(mepi_softening::Parameters {
        scheme: in_steps(10.0),
        ..published(FONTAINEBLEAU)
    });
    assert_eq!(refused.unwrap_err().parameter, "scheme");
}
