//! Against closed forms and a quadrature of the rates that are derived here. Tension and opening positive.
#![expect(
    clippy::float_cmp,
    reason = "zeros and unchanged values are compared bit by bit"
)]

mod random_walks;

use super::*;
use approx::{assert_abs_diff_eq, assert_relative_eq};

/// A sand under 100 kPa: critical at a void ratio of 0.87.
const SAND: Parameters = Parameters {
    normal_stiffness: 5e6,
    shear_stiffness: 2e6,
    critical_friction_angle: 28.0,
    critical_void_ratio: 0.96,
    granular_hardness: 1e6,
    hardness_exponent: 0.29,
    peak_exponent: 1.1,
    dilatancy_exponent: 3.5,
    hardening_slip: 3e-4,
    thickness: 5e-3,
    initial_void_ratio: 0.7,
    dilatancy_factor: 1.0,
    elastic_range: 0.02,
};

fn joint(p: Parameters) -> CriticalStateJoint {
    CriticalStateJoint::new(p).unwrap()
}

fn of_void_ratio(initial_void_ratio: f64) -> Parameters {
    Parameters {
        initial_void_ratio,
        ..SAND
    }
}

/// M.
fn critical_friction(p: &Parameters) -> f64 {
    p.critical_friction_angle.to_radians().tan()
}

/// Eq. (4), written again.
fn critical_void_ratio(p: &Parameters, sigma: f64) -> f64 {
    p.critical_void_ratio
        * (-(3.0 * sigma.max(0.0) / p.granular_hardness).powf(p.hardness_exponent)).exp()
}

/// Eq. (5): `M_b`, `M_d`.
fn lines(p: &Parameters, psi: f64) -> [f64; 2] {
    let m = critical_friction(p);
    [
        m * (-p.peak_exponent * psi).exp(),
        m * (p.dilatancy_exponent * psi).exp(),
    ]
}

type Walker = walk::Walker<CriticalStateJoint>;

fn begin(p: Parameters, traction: [f64; 2]) -> Walker {
    Walker::new(joint(p), traction)
}

fn slip_in(mut walker: Walker, stiffness: f64, slip: f64, n: u32) -> Walker {
    for _ in 0..n {
        walker.slip(stiffness, slip / f64::from(n));
    }
    walker
}

fn ratio(walker: &Walker) -> f64 {
    -walker.traction[1] / walker.traction[0]
}

fn psi(walker: &Walker) -> f64 {
    let p = &walker.law.parameters;
    walker.state.void_ratio - critical_void_ratio(p, -walker.traction[0])
}

#[test]
fn the_peak_and_its_dilation_are_those_of_the_state() {
    for void_ratio in [0.6, 0.7, 0.8] {
        let mut walker = begin(of_void_ratio(void_ratio), [-100.0, 0.0]);
        let (mut peak, mut rate) = (walker, 0.0);
        for _ in 0..1000 {
            let before = walker;
            walker.slip(0.0, 2e-6);
            if ratio(&walker) > ratio(&peak) {
                peak = walker;
                rate = (walker.jump[0] - before.jump[0]) / 2e-6;
            }
        }
        assert!(ratio(&peak) > 1.01 * ratio(&walker));
        let [friction, neutral] = lines(&SAND, psi(&peak));
        // Off by the change of ψ over an increment, 2e-6 m · 0.5/5e-3 m.
        assert_relative_eq!(ratio(&peak), friction, max_relative = 1e-3);
        assert_relative_eq!(rate, friction - neutral, max_relative = 2e-3);
    }
}

/// In a thick layer ψ stays as it is, and (6) and (8) are closed forms for any increment.
#[test]
fn a_thick_layer_hardens_and_dilates_as_the_closed_form_says() {
    for (void_ratio, n) in [(0.7, 1), (0.7, 40), (0.95, 7)] {
        let p = Parameters {
            thickness: 1e9,
            dilatancy_factor: 0.6,
            ..of_void_ratio(void_ratio)
        };
        let [peak, neutral] = lines(&p, void_ratio - critical_void_ratio(&p, 100.0));
        let walker = slip_in(begin(p, [-100.0, 0.0]), 0.0, 2e-3, n);
        let xi = 2e-3 - walker.traction[1] / p.shear_stiffness;
        let left = (-xi / p.hardening_slip).exp();
        let mu = peak + (p.elastic_range - peak) * left;
        assert_relative_eq!(ratio(&walker), mu, max_relative = 1e-9);
        let lag = p.hardening_slip * (1.0 - left);
        let v = 0.6 * ((peak - neutral) * xi + (p.elastic_range - peak) * lag);
        assert_relative_eq!(walker.jump[0], v, max_relative = 1e-8);
    }
}

/// The rates behind a spring K: elastic until `s τ = (s α + m) σ_n`, then `dη = (M_b − η) dξ/ξ_h`,
/// `dσ_n = K_s A (η − M_d) dξ`, `K_s = K K_n/(K + K_n)`, `d[u_n] = K_s/K A (η − M_d) dξ`, by the
/// classical Runge–Kutta method. Returns `σ_n`, τ, e at each reversal.
fn quadrature(p: &Parameters, stiffness: f64, reversals: &[f64]) -> Vec<[f64; 3]> {
    const STEPS: u32 = 2000;
    // At constant volume nothing moves.
    let (k_s, moves) = if stiffness.is_infinite() {
        (p.normal_stiffness, 0.0)
    } else {
        let sum = stiffness + p.normal_stiffness;
        (
            stiffness * p.normal_stiffness / sum,
            p.normal_stiffness / sum,
        )
    };
    let k_t = p.shear_stiffness;
    let rates = |[sigma, eta, e]: [f64; 3]| {
        let [peak, neutral] = lines(p, e - critical_void_ratio(p, sigma));
        let hardening = (peak - eta) / p.hardening_slip;
        let dilation = p.dilatancy_factor * (eta - neutral);
        let flow = k_t / (k_t + hardening * sigma + eta * k_s * dilation);
        [
            flow * k_s * dilation,
            flow * hardening,
            flow * moves * dilation * (1.0 + e) / p.thickness,
        ]
    };
    let (mut y, mut tau, mut alpha, mut u) = ([100.0, 0.0, p.initial_void_ratio], 0.0, 0.0, 0.0);
    let mut ends = Vec::new();
    for goal in reversals {
        let sign = 1.0_f64.copysign(goal - u);
        y[1] = sign * alpha + p.elastic_range;
        let h = (sign * (goal - u) - (y[1] * y[0] - sign * tau) / k_t) / f64::from(STEPS);
        assert!(h > 0.0);
        for _ in 0..STEPS {
            let add = |k: [f64; 3], by: f64| [0, 1, 2].map(|i| y[i] + by * k[i]);
            let k1 = rates(y);
            let k2 = rates(add(k1, h / 2.0));
            let k3 = rates(add(k2, h / 2.0));
            let k4 = rates(add(k3, h));
            for i in 0..3 {
                y[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
            }
        }
        (u, tau) = (*goal, sign * y[1] * y[0]);
        alpha = sign * (y[1] - p.elastic_range);
        ends.push([y[0], tau, y[2]]);
    }
    ends
}

/// The largest relative distance of the law from the quadrature, in increments of 1/n.
fn distance(p: &Parameters, stiffness: f64, reversals: &[f64], n: u32) -> f64 {
    let mut walker = begin(*p, [-100.0, 0.0]);
    let mut largest = 0.0_f64;
    for (goal, truth) in reversals.iter().zip(quadrature(p, stiffness, reversals)) {
        let slip = goal - walker.jump[1];
        if stiffness.is_infinite() {
            for _ in 0..n {
                walker.step([0.0, slip / f64::from(n)]);
            }
        } else {
            walker = slip_in(walker, stiffness, slip, n);
        }
        let [normal, shear] = walker.traction;
        let found = [-normal, shear, walker.state.void_ratio];
        for i in 0..3 {
            largest = largest.max((found[i] / truth[i] - 1.0).abs());
        }
    }
    largest
}

/// ψ is that of the end of an increment, so that the error is of first order in it.
#[test]
fn monotonic_and_cyclic_paths_follow_the_quadrature_of_the_rates() {
    let dense = of_void_ratio(0.7);
    let weak = |void_ratio| Parameters {
        dilatancy_factor: 0.05,
        ..of_void_ratio(void_ratio)
    };
    let cycles = [2e-3, 1.2e-3, 2e-3, 1.2e-3, 4e-3];
    for (p, stiffness, reversals) in [
        (dense, 0.0, &[4e-3][..]),
        (dense, 0.0, &cycles),
        (of_void_ratio(0.98), 0.0, &cycles),
        (dense, 1e6, &[4e-3]),
        (weak(0.75), 1e6, &cycles),
        (weak(0.98), 1e5, &cycles),
        (weak(0.7), f64::INFINITY, &cycles),
    ] {
        let [coarse, fine] = [100, 200].map(|n| distance(&p, stiffness, reversals, n));
        println!(
            "{} {stiffness}: {coarse:.2e} {fine:.2e}",
            p.initial_void_ratio
        );
        assert!(fine < 5e-3, "{fine}");
        assert!(
            coarse / fine > 1.8 && coarse / fine < 2.3,
            "{coarse} {fine}"
        );
    }
}

/// One set of parameters: friction and dilation grow with density and fall with stress.
#[test]
fn density_and_stress_move_the_peak() {
    let peak = |void_ratio, sigma: f64| {
        let mut walker = begin(of_void_ratio(void_ratio), [-sigma, 0.0]);
        let mut peak = 0.0_f64;
        for _ in 0..200 {
            walker.slip(0.0, 2e-5);
            peak = peak.max(ratio(&walker));
        }
        peak
    };
    let m = critical_friction(&SAND);
    assert!(peak(0.65, 100.0) > peak(0.75, 100.0) && peak(0.75, 100.0) > 1.01 * m);
    assert!(peak(0.7, 50.0) > peak(0.7, 500.0));
    // Friction lags behind the state, and passes M by little.
    assert!(peak(0.95, 100.0) < 1.005 * m);
}

#[test]
fn opens_in_tension_and_closes_where_contact_was_lost() {
    let mut walker = begin(SAND, [-100.0, 0.0]);
    walker.step([100.0 / 5e6 + 3e-5, 0.0]);
    assert_eq!(walker.traction, [0.0; 2]);
    assert_relative_eq!(walker.state.gap, 3e-5, max_relative = 1e-10);
    // The springs have let the layer grow; the gap is none of it.
    let e = 1.7 * (2e-5_f64 / 5e-3).exp() - 1.0;
    assert_relative_eq!(walker.state.void_ratio, e, max_relative = 1e-12);
    let tangent = walker.step([1e-5, 1e-3]);
    assert_eq!((walker.traction, tangent), ([0.0; 2], [[0.0; 2]; 2]));
    // Four fifths of the increment close the gap.
    walker.step([-5e-5, 1e-6]);
    assert_relative_eq!(walker.traction[0], -50.0, max_relative = 1e-8);
    assert_relative_eq!(walker.traction[1], 0.4, max_relative = 1e-6);
    assert_eq!(walker.state.gap, 0.0);
    // Back at 100 kPa the layer is as dense as it was.
    walker.step([-1e-5, 0.0]);
    assert_relative_eq!(walker.state.void_ratio, 0.7, max_relative = 1e-8);
}

#[test]
fn faces_that_touch_without_stress_do_not_slip() {
    // Loose sand at constant volume contracts until nothing is left.
    let mut walker = begin(of_void_ratio(1.0), [-100.0, 0.0]);
    for _ in 0..100 {
        walker.step([0.0, 1e-4]);
    }
    assert_eq!(walker.traction, [0.0; 2]);
    assert_eq!(
        (walker.state.gap, walker.state.back_stress_ratio),
        (0.0, 0.0)
    );
    let before = walker.state;
    for slip in [-0.01, 1.0] {
        let tangent = walker.step([0.0, slip]);
        assert_eq!((walker.traction, tangent), ([0.0; 2], [[0.0; 2]; 2]));
        assert_eq!(walker.state, before);
    }
    walker.step([-1e-5, 0.0]);
    assert_relative_eq!(walker.traction[0], -50.0, max_relative = 1e-9);
}

/// Under a penalty, dilation lifts the faces by more than the springs had been pressed together.
#[test]
fn a_trial_in_tension_does_not_open_what_dilation_presses() {
    let p = Parameters {
        normal_stiffness: 1e9,
        shear_stiffness: 1e9,
        ..SAND
    };
    let mut walker = begin(p, [-100.0, 0.0]);
    for _ in 0..40 {
        walker.slip(0.0, 1e-4);
        assert_relative_eq!(walker.traction[0], -100.0, max_relative = 1e-6);
    }
    assert!(walker.jump[0] > 2e-4);
}

#[test]
fn a_sheared_initial_state_lies_on_the_surface() {
    for (ratio, alpha) in [(0.4, 0.38), (-0.4, -0.38), (0.01, 0.0), (1.5, 1.48)] {
        let mut walker = begin(SAND, [-100.0, 100.0 * ratio]);
        assert_abs_diff_eq!(walker.state.back_stress_ratio, alpha, epsilon = 1e-14);
        let before = walker;
        walker.step([0.0; 2]);
        assert_eq!(
            (walker.traction, walker.state),
            (before.traction, before.state)
        );
    }
    // Without pressure there is no ratio.
    for traction in [[0.0, 5.0], [3.0, 5.0]] {
        let mut walker = begin(SAND, traction);
        walker.step([0.0; 2]);
        assert_eq!(walker.traction, [0.0; 2]);
    }
}

#[test]
fn refuses_what_does_not_go_together() {
    let p = Parameters {
        elastic_range: 0.6,
        ..SAND
    };
    assert_eq!(
        CriticalStateJoint::new(p).unwrap_err().parameter,
        "elastic_range"
    );
    let mut walker = begin(SAND, [-100.0, 0.0]);
    walker.state.gap = -1e-3;
    let failure = walker.respond([0.0; 2], Tangent::None).unwrap_err();
    assert!(failure.reason().starts_with("gap"), "{failure:?}");
    walker.state = State {
        gap: 0.0,
        void_ratio: -1.1,
        ..walker.state
    };
    let failure = walker.respond([0.0; 2], Tangent::None).unwrap_err();
    assert!(failure.reason().starts_with("void_ratio"), "{failure:?}");
}

#[test]
fn the_elastic_operator_is_diagonal_in_every_state() {
    let mut walker = begin(SAND, [-100.0, 0.0]);
    for jump in [[0.0, 1e-6], [0.0, 1e-3], [1e-1, 0.0], [-2e-1, 1e-3]] {
        let end = walker.respond(jump, Tangent::Elastic).unwrap();
        assert_eq!(end.tangent, [[5e6, 0.0], [0.0, 2e6]]);
        walker.step(jump);
    }
}
