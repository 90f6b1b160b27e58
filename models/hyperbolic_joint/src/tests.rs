//! Zone by zone against closed forms and a quadrature of the rates. Tension and opening positive.
#![expect(
    clippy::float_cmp,
    reason = "zeros and unchanged values are compared bit by bit"
)]

use super::*;
use approx::assert_relative_eq;
use walk::{Walker, random};

const K_N: f64 = 2e6;

/// Clough and Duncan's order of magnitude for sand and concrete, with adhesion.
const SAND: Parameters = Parameters {
    normal_stiffness: K_N,
    stiffness_number: 2e4,
    stiffness_exponent: 0.6,
    failure_ratio: 0.85,
    adhesion: 4.0,
    friction_angle: 30.0,
    unloading_number: 3e4,
    unit_weight_of_water: 9.81,
    atmospheric_pressure: 101.325,
};

fn joint(p: Parameters) -> HyperbolicJoint {
    HyperbolicJoint::new(p).unwrap()
}

/// Equations (2) to (4), written again.
fn k_i(p: &Parameters, sigma: f64) -> f64 {
    p.stiffness_number
        * p.unit_weight_of_water
        * (sigma / p.atmospheric_pressure).powf(p.stiffness_exponent)
}

fn k_u(p: &Parameters, sigma: f64) -> f64 {
    k_i(p, sigma) * p.unloading_number / p.stiffness_number
}

fn strength(p: &Parameters, sigma: f64) -> f64 {
    p.adhesion + sigma * p.friction_angle.to_radians().tan()
}

/// The hyperbola of the source with its cut, from the origin.
fn hyperbola(p: &Parameters, sigma: f64, slip: f64) -> f64 {
    let tau_f = strength(p, sigma);
    (slip / (1.0 / k_i(p, sigma) + p.failure_ratio * slip / tau_f)).min(tau_f)
}

#[test]
fn shear_at_constant_normal_stress_is_the_hyperbola_for_any_increment() {
    for r_f in [0.0, 0.85, 1.0] {
        for n in [1, 7, 300] {
            for (sigma, slip) in [(20.0, 1e-4), (100.0, 3e-4), (100.0, 5e-2), (400.0, 1e-3)] {
                for sign in [1.0, -1.0] {
                    let p = Parameters {
                        failure_ratio: r_f,
                        ..SAND
                    };
                    let end = Walker::new(joint(p), [-sigma, 0.0]).walk([0.0, sign * slip], n);
                    let tau = sign * hyperbola(&p, sigma, slip);
                    assert_relative_eq!(end.traction[1], tau, max_relative = 1e-12);
                    assert_eq!(end.traction[0], -sigma);
                    let level = tau.abs() / strength(&p, sigma);
                    assert_relative_eq!(end.state.stress_level, level, max_relative = 1e-12);
                }
            }
        }
    }
}

#[test]
fn the_strength_is_reached_after_the_slip_of_the_cut_hyperbola() {
    let sigma = 100.0;
    let tau_f = strength(&SAND, sigma);
    let slip = tau_f / (k_i(&SAND, sigma) * (1.0 - SAND.failure_ratio));
    let walker = Walker::new(joint(SAND), [-sigma, 0.0]);
    let before = walker.walk([0.0, slip * 0.999_999], 1);
    assert!(before.traction[1] < tau_f && before.traction[1] > 0.999_999 * tau_f);
    let mut after = walker.walk([0.0, slip * 1.000_001], 1);
    assert_relative_eq!(after.traction[1], tau_f, max_relative = 1e-14);
    let tangent = after.step([0.0, 1e-3]);
    assert_eq!(tangent[1][1], 0.0);
    assert_relative_eq!(after.traction[1], tau_f, max_relative = 1e-14);
}

#[test]
fn unloading_reversal_and_reloading_follow_the_line_until_the_level_that_was_reached() {
    let sigma = 100.0;
    let (k_i, k_u, tau_f) = (k_i(&SAND, sigma), k_u(&SAND, sigma), strength(&SAND, sigma));
    let mut walker = Walker::new(joint(SAND), [-sigma, 0.0]);
    walker.step([0.0, 2e-4]);
    let top = hyperbola(&SAND, sigma, 2e-4);
    assert_relative_eq!(walker.traction[1], top, max_relative = 1e-12);
    // Down and up again: the same line, the same top, the same hyperbola beyond.
    let down = 0.7 * top / k_u;
    let tangent = walker.step([0.0, -down]);
    assert_relative_eq!(tangent[1][1], k_u, max_relative = 1e-12);
    assert_relative_eq!(walker.traction[1], 0.3 * top, max_relative = 1e-12);
    walker.step([0.0, down + 1e-4]);
    assert_relative_eq!(
        walker.traction[1],
        hyperbola(&SAND, sigma, 3e-4),
        max_relative = 1e-12
    );
    // Reversal: a line to minus the top, then the hyperbola from its level.
    let top = walker.traction[1];
    walker.step([0.0, -2.0 * top / k_u]);
    assert_relative_eq!(walker.traction[1], -top, max_relative = 1e-12);
    let tangent = walker.step([0.0, -1e-4]);
    let tau = hyperbola(&SAND, sigma, 4e-4);
    assert_relative_eq!(walker.traction[1], -tau, max_relative = 1e-12);
    let slope = k_i * (1.0 - SAND.failure_ratio * tau / tau_f).powi(2);
    assert_relative_eq!(tangent[1][1], slope, max_relative = 1e-12);
}

/// The rates (8) with σ_n linear in the slip, by the classical Runge–Kutta method.
fn quadrature(p: &Parameters, start: [f64; 2], d_sigma: f64, slip: f64, n: u32) -> f64 {
    let [sigma_0, mut tau] = start;
    let rate = |x: f64, tau: f64| {
        let sigma = sigma_0 + x * d_sigma;
        let level = tau / strength(p, sigma);
        let k_t = k_i(p, sigma) * (1.0 - p.failure_ratio * level).powi(2);
        let tan_delta = p.friction_angle.to_radians().tan();
        k_t * slip + (1.0 - k_t / k_u(p, sigma)) * level * tan_delta * d_sigma
    };
    let h = 1.0 / f64::from(n);
    for i in 0..n {
        let x = f64::from(i) * h;
        let k1 = rate(x, tau);
        let k2 = rate(x + h / 2.0, tau + h / 2.0 * k1);
        let k3 = rate(x + h / 2.0, tau + h / 2.0 * k2);
        let k4 = rate(x + h, tau + h * k3);
        tau += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
    }
    tau
}

/// Normal stress that falls or rises, with slip and without: all of it is loading.
#[test]
fn with_normal_stress_that_changes_increments_converge_to_the_quadrature_linearly() {
    for (d_sigma, slip) in [(-40.0, 2e-4), (60.0, 4e-4), (-40.0, 0.0)] {
        let start = [100.0, 20.0];
        let truth = quadrature(&SAND, start, d_sigma, slip, 4000);
        let errors = [100, 200, 400].map(|n| {
            let walker = Walker::new(joint(SAND), [-start[0], start[1]]);
            let end = walker.walk([-d_sigma / K_N, slip], n);
            let level = end.traction[1] / strength(&SAND, start[0] + d_sigma);
            assert!(level < 1.0 && level > start[1] / strength(&SAND, start[0]));
            assert_relative_eq!(end.state.stress_level, level, max_relative = 1e-12);
            end.traction[1] - truth
        });
        for pair in errors.windows(2) {
            let ratio = pair[0] / pair[1];
            assert!((1.9..2.1).contains(&ratio), "{errors:?}");
        }
        assert!(errors[2].abs() < 2e-3 * truth, "{errors:?} of {truth}");
    }
}

#[test]
fn under_more_normal_stress_shear_is_stiff_until_the_level_is_reached_again() {
    let mut walker = Walker::new(joint(SAND), [-100.0, 0.0]);
    walker.step([0.0, 2e-4]);
    let tau = walker.traction[1];
    let level = walker.state.stress_level;
    walker.step([-100.0 / K_N, 0.0]);
    assert_eq!(walker.traction[1], tau);
    assert_eq!(walker.state.stress_level, level);
    let (k_u, tau_f) = (k_u(&SAND, 200.0), strength(&SAND, 200.0));
    let stiff = (level * tau_f - tau) / k_u;
    let tangent = walker.step([0.0, 0.99 * stiff]);
    assert_relative_eq!(tangent[1][1], k_u, max_relative = 1e-12);
    assert_eq!(walker.state.stress_level, level);
    // Beyond it, the hyperbola from that level: as if its slip from the origin had been made.
    let slip = level * tau_f / (k_i(&SAND, 200.0) * (1.0 - SAND.failure_ratio * level));
    walker.step([0.0, 0.01 * stiff + 1e-4]);
    let tau = hyperbola(&SAND, 200.0, slip + 1e-4);
    assert_relative_eq!(walker.traction[1], tau, max_relative = 1e-12);
}

#[test]
fn a_mobilised_strength_falls_with_the_normal_stress() {
    let mut walker = Walker::new(joint(SAND), [-100.0, 0.0]);
    walker.step([0.0, -1e-2]);
    for sigma in [70.0, 20.0, 1.0] {
        walker.step([(-sigma - walker.traction[0]) / K_N, 0.0]);
        let expected = strength(&SAND, sigma);
        assert_relative_eq!(walker.traction[1], -expected, max_relative = 1e-12);
        assert_eq!(walker.state.stress_level, 1.0);
    }
}

#[test]
fn an_interface_closes_where_it_opened_without_adhesion() {
    let p = Parameters {
        adhesion: 0.0,
        ..SAND
    };
    for sheared in [true, false] {
        let mut walker = Walker::new(joint(SAND), [-100.0, 0.0]);
        if sheared {
            walker.step([0.0, 1e-2]);
        }
        let tangent = walker.step([100.0 / K_N + 3e-5, 0.0]);
        assert_eq!((walker.traction, tangent), ([0.0; 2], [[0.0; 2]; 2]));
        let level = f64::from(u8::from(sheared));
        assert_eq!(
            (walker.state.stress_level, walker.state.broken),
            (level, 1.0)
        );
        assert_relative_eq!(walker.state.gap, 3e-5, max_relative = 1e-10);
        // Three quarters of the increment close the gap; the slip of the rest is on the line of reloading, or on
        // the hyperbola if nothing had been mobilised.
        walker.step([-4e-5, 4e-5]);
        let sigma = 1e-5 * K_N;
        let tau = if sheared {
            k_u(&p, sigma) * 1e-5
        } else {
            hyperbola(&p, sigma, 1e-5)
        };
        assert_relative_eq!(walker.traction[0], -sigma, max_relative = 1e-9);
        assert_relative_eq!(walker.traction[1], tau, max_relative = 1e-9);
        assert_eq!(walker.state.gap, 0.0);
        walker.step([-2e-5, 0.1]);
        assert_relative_eq!(
            walker.traction[1],
            strength(&p, 3.0 * sigma),
            max_relative = 1e-9
        );
    }
}

/// Without adhesion it makes no difference on which side of zero the normal stress ends.
#[test]
fn a_hair_of_opening_is_like_a_hair_of_contact() {
    let p = Parameters {
        adhesion: 0.0,
        ..SAND
    };
    let ends = [-1e-13, 1e-13].map(|sigma| {
        let mut walker = Walker::new(joint(p), [-20.0, 0.0]);
        walker.step([0.0, 3e-5]);
        walker.step([(20.0 + sigma) / K_N, 1e-5]);
        assert_eq!(walker.state.gap > 0.0, sigma > 0.0);
        walker.step([-2e-5, 5e-5]);
        walker.traction
    });
    assert_relative_eq!(ends[0][0], ends[1][0], max_relative = 1e-10);
    assert_relative_eq!(ends[0][1], ends[1][1], max_relative = 1e-10);
}

#[test]
fn without_normal_stress_there_is_no_stiffness_and_only_the_adhesion() {
    // n > 0: no stiffness. n = 0: stiffness, and adhesion is all the strength.
    let mut walker = Walker::new(joint(SAND), [0.0; 2]);
    let tangent = walker.step([0.0, 1e-2]);
    assert_eq!((walker.traction, tangent[1]), ([0.0; 2], [0.0; 2]));
    let constant = Parameters {
        stiffness_exponent: 0.0,
        ..SAND
    };
    let mut walker = Walker::new(joint(constant), [0.0; 2]);
    walker.step([0.0, 1e-2]);
    assert_relative_eq!(walker.traction[1], SAND.adhesion, max_relative = 1e-14);
    let smooth = Parameters {
        adhesion: 0.0,
        ..constant
    };
    let mut walker = Walker::new(joint(smooth), [0.0; 2]);
    walker.step([0.0, 1e-2]);
    assert_eq!(walker.traction, [0.0; 2]);
    // Pressed together it is an interface again, whose strength slip has mobilised.
    walker.step([-1e-5, 1e-4]);
    let tau = strength(&smooth, 20.0);
    assert_relative_eq!(walker.traction[1], tau, max_relative = 1e-12);
}

#[test]
fn an_initial_shear_stress_counts_as_mobilised() {
    let sigma = 100.0;
    let slip = 1.5e-4;
    let tau = hyperbola(&SAND, sigma, slip);
    let mut walker = Walker::new(joint(SAND), [-sigma, tau]);
    walker.step([0.0, 1e-4]);
    let further = hyperbola(&SAND, sigma, slip + 1e-4);
    assert_relative_eq!(walker.traction[1], further, max_relative = 1e-12);
    let mut beyond = Walker::new(joint(SAND), [-sigma, -200.0]);
    beyond.step([0.0; 2]);
    assert_relative_eq!(
        beyond.traction[1],
        -strength(&SAND, sigma),
        max_relative = 1e-14
    );
}

#[test]
fn huge_increments_end_at_the_strength() {
    for r_f in [0.0, 0.85, 1.0] {
        let p = Parameters {
            failure_ratio: r_f,
            ..SAND
        };
        for slip in [1e6, -1e200, 1e300] {
            let mut walker = Walker::new(joint(p), [-100.0, 0.0]);
            let tangent = walker.step([0.0, slip]);
            let tau = strength(&p, 100.0).copysign(slip);
            assert_relative_eq!(walker.traction[1], tau, max_relative = 1e-6);
            assert!(tangent.iter().flatten().all(|k| k.is_finite()));
        }
    }
}

#[test]
fn refuses_parameters_that_do_not_go_together() {
    let refused = |p| HyperbolicJoint::new(p).unwrap_err().parameter;
    let soft = Parameters {
        unloading_number: 1.9e4,
        ..SAND
    };
    assert_eq!(refused(soft), "unloading_number");
    let none = Parameters {
        adhesion: 0.0,
        friction_angle: 0.0,
        ..SAND
    };
    assert_eq!(refused(none), "adhesion");
    // Left out, it is that of loading.
    let left_out = Parameters {
        unloading_number: f64::NAN,
        ..SAND
    };
    assert_eq!(joint(left_out).loading_share, 1.0);
}

#[test]
fn the_elastic_operator_is_that_of_unloading() {
    let mut walker = Walker::new(joint(SAND), [-100.0, 0.0]);
    for jump in [[0.0, 1e-5], [-2e-5, 1e-2], [1e-1, 0.0], [-2e-1, 1e-3]] {
        let end = walker.respond(jump, Tangent::Elastic).unwrap();
        let k_u = k_u(&SAND, -end.traction[0]);
        assert_eq!((end.tangent[0], end.tangent[1][0]), ([K_N, 0.0], 0.0));
        assert_relative_eq!(end.tangent[1][1], k_u, max_relative = 1e-12);
        walker.step(jump);
    }
}

#[test]
fn an_open_interface_has_no_elastic_shear_whatever_the_exponent() {
    for stiffness_exponent in [0.0, 0.5] {
        let law = joint(Parameters {
            stiffness_exponent,
            ..SAND
        });
        let mut walker = Walker::new(law, [-100.0, 0.0]);
        walker.step([1e-1, 0.0]);
        let open = walker.respond([1e-3, 1e-3], Tangent::Elastic).unwrap();
        assert_eq!(open.tangent, [[K_N, 0.0], [0.0, 0.0]]);
        let closed = walker.respond([-2e-1, 0.0], Tangent::Elastic).unwrap();
        assert!(closed.tangent[1][1] > 0.0);
    }
}

#[test]
fn internal_variables_that_no_path_leads_to_are_refused() {
    type Make = fn(&mut State);
    let faults: [(&str, Make); 5] = [
        ("stress_level", |s| s.stress_level = -0.1),
        ("stress_level", |s| s.stress_level = 1.1),
        ("gap", |s| s.gap = -1e-3),
        ("broken", |s| s.broken = 0.5),
        ("broken", |s| s.broken = -1.0),
    ];
    for (name, make) in faults {
        let mut walker = Walker::new(joint(SAND), [-100.0, 0.0]);
        make(&mut walker.state);
        let failure = walker.respond([0.0; 2], Tangent::None).unwrap_err();
        assert!(failure.reason().starts_with(name), "{failure:?}");
    }
}

/// Random interfaces and walks: admissible, the same in a mirror, and the tangent agrees with differences.
#[test]
fn stays_admissible_with_an_exact_tangent_on_random_walks() {
    let seed = &mut 7;
    // Open, unloading, hyperbola, strength.
    let mut compared = [0; 4];
    for _ in 0..1000 {
        let number = 10_f64.powf(random(seed, 2.0, 5.0));
        let p = Parameters {
            normal_stiffness: 10_f64.powf(random(seed, 3.0, 8.0)),
            stiffness_number: number,
            stiffness_exponent: random(seed, -0.3, 1.2).max(0.0),
            failure_ratio: random(seed, -0.2, 1.2).clamp(0.0, 1.0),
            adhesion: random(seed, -10.0, 20.0).max(0.0),
            friction_angle: random(seed, 1.0, 60.0),
            unloading_number: number * random(seed, 0.5, 4.0).max(1.0),
            ..SAND
        };
        let law = joint(p);
        let mut walker = Walker::new(law, [-random(seed, 1.0, 200.0), 0.0]);
        for _ in 0..25 {
            let jump = [
                random(seed, -100.0, 90.0) / p.normal_stiffness,
                random(seed, -100.0, 100.0) / k_i(&p, 100.0),
            ];
            let start = walker;
            let tangent = walker.step(jump);
            let mut mirror = start;
            mirror.traction[1] = -start.traction[1];
            mirror.step([jump[0], -jump[1]]);
            assert_eq!(mirror.traction, [walker.traction[0], -walker.traction[1]]);
            assert_eq!(mirror.state, walker.state);

            let adhesion = if walker.state.broken > 0.5 {
                0.0
            } else {
                p.adhesion
            };
            let tau_f =
                |w: &Walker<HyperbolicJoint>| adhesion - w.traction[0] * tan(p.friction_angle);
            assert!(walker.traction[0] <= 0.0);
            assert!(walker.traction[1].abs() <= tau_f(&walker) * (1.0 + 1e-14));
            assert!((0.0..=1.0).contains(&walker.state.stress_level));
            assert!(walker.state.gap == 0.0 || walker.traction == [0.0; 2]);
            let zone = |w: &Walker<HyperbolicJoint>| {
                if w.state.gap > 0.0 {
                    0
                } else if w.state.stress_level >= 1.0
                    && w.traction[1].abs() >= tau_f(w) * (1.0 - 1e-12)
                {
                    3
                } else if w.traction[1].abs() >= w.state.stress_level * tau_f(w) * (1.0 - 1e-12) {
                    2
                } else {
                    1
                }
            };
            for j in 0..2 {
                // Fourth-order differences, where all five points are in one zone.
                let by = jump[j].abs() * 1e-3;
                let ends = start.around(jump, j, by).unwrap();
                let smooth = |w: &Walker<HyperbolicJoint>| {
                    zone(w) == zone(&walker) && w.traction[1] * walker.traction[1] >= 0.0
                };
                // Close to σ_n = 0 powers of it have no Taylor series over the step.
                let far = -walker.traction[0] > 0.02 * p.normal_stiffness * jump[0].abs();
                if !(far || walker.state.gap > 0.0) || !ends.iter().all(smooth) {
                    continue;
                }
                compared[zone(&walker)] += 1;
                let least = [100.0 / jump[j].abs(), 1e-6];
                Walker::assert_column(&ends, by, (tangent, j), least);
            }
        }
    }
    println!("open, unloading, hyperbola, strength: {compared:?}");
    assert!(compared.iter().all(|&n| n > 500), "{compared:?}");
}
