//! Against the curve of the source and Masing's rule. Tension and opening positive.
#![expect(
    clippy::float_cmp,
    reason = "zeros and unchanged values are compared bit by bit"
)]

use crate::curve::Ground;
use crate::{QzCurve, TzCurve, qz_curve, tz_curve};
use abi::{InterfaceLaw, Tangent};
use approx::{assert_abs_diff_eq, assert_relative_eq};
use walk::{Walker, random};

const E_M: f64 = 12e3;
const D: f64 = 0.6;
const Q_S: f64 = 80.0;
const Q_B: f64 = 2e3;
const K_N: f64 = 1e6;
const K_T: f64 = 3e5;

fn ground(soil: f64) -> Ground {
    Ground {
        pressuremeter_modulus: E_M,
        diameter: D,
        soil,
    }
}

/// Fine ground is 0, granular 1.
fn shaft(soil: f64) -> TzCurve {
    TzCurve::new(tz_curve::Parameters {
        ground: ground(soil),
        shaft_friction: Q_S,
        normal_stiffness: K_N,
    })
    .unwrap()
}

fn base(soil: f64) -> QzCurve {
    QzCurve::new(qz_curve::Parameters {
        ground: ground(soil),
        base_resistance: Q_B,
        shear_stiffness: K_T,
    })
    .unwrap()
}

/// The curve of the source: first slope, limit, movement.
fn first_loading(k: f64, s: f64, z: f64) -> f64 {
    let bend = s / (2.0 * k);
    if z < bend {
        k * z
    } else {
        (s / 2.0 + k / 5.0 * (z - bend)).min(s)
    }
}

#[test]
fn first_loading_of_the_shaft_is_the_curve_whatever_the_normal_stress() {
    for (soil, factor) in [(0.0, 2.0), (1.0, 0.8)] {
        let law = shaft(soil);
        let k = factor * E_M / D;
        for t_n in [-100.0, 0.0, 50.0] {
            for share in [0.2, 0.5, 0.6, 1.7, 3.0, 5.0] {
                for n in [1, 13] {
                    for sign in [1.0, -1.0] {
                        let z = share * Q_S / k;
                        let end = Walker::new(law, [t_n, 0.0]).walk([1e-5, sign * z], n);
                        let tau = sign * first_loading(k, Q_S, z);
                        assert_relative_eq!(end.traction[1], tau, max_relative = 1e-12);
                        assert_relative_eq!(end.traction[0], t_n + 10.0, max_relative = 1e-12);
                    }
                }
            }
        }
    }
}

#[test]
fn first_loading_of_the_base_is_the_curve() {
    for (soil, factor) in [(0.0, 11.0), (1.0, 4.8)] {
        let law = base(soil);
        let k = factor * E_M / D;
        for share in [0.2, 0.5, 0.6, 1.7, 3.0, 5.0] {
            for n in [1, 13] {
                let z = share * Q_B / k;
                let end = Walker::new(law, [0.0; 2]).walk([-z, 1e-5], n);
                let q = first_loading(k, Q_B, z);
                assert_relative_eq!(end.traction[0], -q, max_relative = 1e-12);
                assert_relative_eq!(end.traction[1], 3.0, max_relative = 1e-12);
            }
        }
    }
}

#[test]
fn reversals_of_the_shaft_follow_the_curve_twice_as_large() {
    let law = shaft(0.0);
    let k = 2.0 * E_M / D;
    let masing = |z: f64| 2.0 * first_loading(k, Q_S, z / 2.0);
    for top in [0.3, 0.9, 2.0, 4.0] {
        let mut walker = Walker::new(law, [-100.0, 0.0]);
        walker.step([0.0, top * Q_S / k]);
        let peak = walker.traction[1];
        for back in [0.4, 0.99, 1.5, 2.5] {
            let z = back * Q_S / k;
            let end = walker.walk([0.0, -z], 3);
            if back >= 2.0 * f64::min(top, 3.0) {
                // Beyond the mirror image of the peak: first loading in the other direction.
                let tau = first_loading(k, Q_S, z - top * Q_S / k);
                assert_relative_eq!(end.traction[1], -tau, max_relative = 1e-12);
                continue;
            }
            let tau = peak - masing(z);
            assert_relative_eq!(end.traction[1], tau, epsilon = 1e-9, max_relative = 1e-12);
            // A closed loop goes on along the curve that it left.
            let mut closed = end.walk([0.0, z], 1);
            assert_relative_eq!(closed.traction[1], peak, max_relative = 1e-12);
            closed.step([0.0, 0.3 * Q_S / k]);
            let further = first_loading(k, Q_S, (top + 0.3) * Q_S / k);
            assert_relative_eq!(closed.traction[1], further, max_relative = 1e-12);
        }
    }
}

#[test]
fn a_base_unloads_along_the_first_slope_opens_and_comes_back() {
    let law = base(1.0);
    let k = 4.8 * E_M / D;
    for top in [0.3, 0.9, 2.0, 4.0] {
        let mut walker = Walker::new(law, [0.0; 2]);
        walker.step([-top * Q_B / k, 0.0]);
        let peak = -walker.traction[0];
        // To a tenth of the pressure.
        let tangent = walker.step([0.9 * peak / k, 1e-5]);
        assert_relative_eq!(tangent[0][0], k, max_relative = 1e-12);
        assert_relative_eq!(walker.traction[0], -0.1 * peak, max_relative = 1e-12);
        let tangent = walker.step([0.1 * peak / k + 2e-3, 1e-5]);
        assert_eq!((walker.traction, tangent), ([0.0; 2], [[0.0; 2]; 2]));
        assert_relative_eq!(walker.state.gap, 2e-3, max_relative = 1e-9);
        walker.step([1e-3, 1.0]);
        // Up to the peak with the first slope, then along the first loading.
        let closed = (peak + 0.3 * Q_B) / k;
        let closed = if top < 0.5 { 0.6 * Q_B / k } else { closed };
        let further = if top < 0.5 { 0.6 } else { top + 0.3 };
        let q = first_loading(k, Q_B, further * Q_B / k);
        walker.step([-3e-3 - closed, 2e-5]);
        assert_relative_eq!(walker.traction[0], -q, max_relative = 1e-9);
        let slip = 2e-5 * closed / (3e-3 + closed);
        assert_relative_eq!(walker.traction[1], K_T * slip, max_relative = 1e-9);
        assert_eq!(walker.state.gap, 0.0);
    }
}

#[test]
fn initial_tractions_count_as_mobilised() {
    let law = shaft(0.0);
    let k = 2.0 * E_M / D;
    for share in [0.3, 0.75] {
        let start = share * Q_S;
        let z: f64 = if share < 0.5 {
            share
        } else {
            0.5 + 5.0 * (share - 0.5)
        };
        let mut walker = Walker::new(law, [0.0, -start]);
        walker.step([0.0, -0.5 * Q_S / k]);
        let tau = first_loading(k, Q_S, (z + 0.5) * Q_S / k);
        assert_relative_eq!(walker.traction[1], -tau, max_relative = 1e-12);
    }
    let mut beyond = Walker::new(law, [0.0, 2.0 * Q_S]);
    beyond.step([0.0; 2]);
    assert_relative_eq!(beyond.traction[1], Q_S, max_relative = 1e-14);
    let law = base(0.0);
    let mut beyond = Walker::new(law, [-2.0 * Q_B, 0.0]);
    beyond.step([0.0; 2]);
    assert_relative_eq!(beyond.traction[0], -Q_B, max_relative = 1e-14);
    let mut pulled = Walker::new(law, [110.0, 0.0]);
    pulled.step([0.0; 2]);
    assert_eq!(pulled.traction, [0.0; 2]);
    assert_relative_eq!(
        pulled.state.gap,
        110.0 / (11.0 * E_M / D),
        max_relative = 1e-14
    );
}

#[test]
fn a_base_pulled_at_the_start_closes_and_follows_first_loading() {
    let law = base(0.0);
    let k = 11.0 * E_M / D;
    for pull in [1.0, 500.0, 1e4] {
        for share in [0.3, 0.6, 1.7, 5.0] {
            let z = share * Q_B / k;
            let closing = -(pull / k + z);
            let q = first_loading(k, Q_B, z);
            for n in [1, 7] {
                let mut walker = Walker::new(law, [pull, 30.0]).walk([closing, 0.0], n);
                assert_relative_eq!(walker.traction[0], -q, max_relative = 1e-9);
                assert_eq!(walker.traction[1], 0.0);
                // A nil increment first changes nothing.
                let mut asked = Walker::new(law, [pull, 30.0]);
                asked.step([0.0; 2]);
                assert_relative_eq!(asked.state.gap, pull / k, max_relative = 1e-14);
                walker = asked.walk([closing, 0.0], n);
                assert_relative_eq!(walker.traction[0], -q, max_relative = 1e-9);
            }
        }
    }
}

#[test]
fn what_exceeds_the_strength_at_the_start_is_lost_before_the_first_movement() {
    let law = shaft(0.0);
    let k = 2.0 * E_M / D;
    for start in [2.0 * Q_S, 1.005 * Q_S, -3.0 * Q_S] {
        let asked = |nil: bool| {
            let mut walker = Walker::new(law, [0.0, start]);
            if nil {
                walker.step([0.0; 2]);
            }
            let back = -0.5 * Q_S / k * start.signum();
            walker.walk([0.0, back], 1).traction[1]
        };
        // From the strength back by half of it along the first slope.
        assert_relative_eq!(
            asked(true),
            0.5 * Q_S * start.signum(),
            max_relative = 1e-12
        );
        assert_relative_eq!(asked(false), asked(true), max_relative = 1e-14);
    }
}

#[test]
fn a_gap_below_nothing_is_refused() {
    let law = base(0.0);
    let mut walker = Walker::new(law, [-100.0, 0.0]);
    walker.state.gap = -1e-3;
    let failure = walker.respond([0.0; 2], Tangent::None).unwrap_err();
    assert!(failure.reason().contains("gap"), "{failure:?}");
}

#[test]
fn huge_increments_end_at_the_limits() {
    let (shaft, base) = (shaft(0.0), base(0.0));
    for z in [1e6, 1e100] {
        let mut walker = Walker::new(shaft, [-100.0, 0.0]);
        walker.step([0.0, -z]);
        assert_relative_eq!(walker.traction[1], -Q_S, max_relative = 1e-14);
        let mut walker = Walker::new(base, [-100.0, 0.0]);
        walker.step([-z, 0.0]);
        assert_relative_eq!(walker.traction[0], -Q_B, max_relative = 1e-14);
        walker.step([z, 0.0]);
        assert_eq!(walker.traction, [0.0; 2]);
    }
}

#[test]
fn the_elastic_operator_has_the_first_slopes() {
    let (shaft, base) = (shaft(1.0), base(1.0));
    for jump in [[0.0, 0.0], [-1.0, 1.0], [1.0, 0.0]] {
        let k = Walker::new(shaft, [0.0; 2])
            .respond(jump, Tangent::Elastic)
            .unwrap()
            .tangent;
        assert_eq!(k, [[K_N, 0.0], [0.0, 0.8 * E_M / D]]);
        let k = Walker::new(base, [0.0; 2])
            .respond(jump, Tangent::Elastic)
            .unwrap()
            .tangent;
        assert_eq!(k, [[4.8 * E_M / D, 0.0], [0.0, K_T]]);
    }
}

#[test]
fn a_smooth_base_carries_no_shear() {
    let law = QzCurve::new(qz_curve::Parameters {
        ground: ground(0.0),
        base_resistance: Q_B,
        shear_stiffness: 0.0,
    })
    .unwrap();
    let mut walker = Walker::new(law, [-100.0, 0.0]);
    let tangent = walker.step([-1e-3, 1.0]);
    assert_eq!((walker.traction[1], tangent[1]), (0.0, [0.0; 2]));
}

/// Within the limits, no plastic work below zero, and the tangent is that of differences, or one of
/// those to the two sides at a corner.
fn walks_at_random<L: InterfaceLaw + Copy>(law: &L, unit: [f64; 2], limits: impl Fn([f64; 2])) {
    let seed = &mut 3;
    let mut compared = 0;
    for _ in 0..300 {
        let mut walker = Walker::new(*law, [-random(seed, 0.0, 50.0), 0.0]);
        for _ in 0..40 {
            let jump = [0, 1].map(|i| random(seed, -2.0, 2.0) * unit[i]);
            let start = walker;
            let tangent = walker.step(jump);
            limits(walker.traction);
            let elastic = start.respond(jump, Tangent::Elastic).unwrap().tangent;
            let work: f64 = (0..2)
                .map(|i| {
                    let stretch = (walker.traction[i] - start.traction[i]) / elastic[i][i];
                    walker.traction[i] * (jump[i] - stretch)
                })
                .sum();
            let scale: f64 = (0..2).map(|i| (walker.traction[i] * jump[i]).abs()).sum();
            assert!(work >= -1e-9 * scale, "{work} of {scale}");
            for j in 0..2 {
                let by = 1e-4 * jump[j];
                let [above, below] = [by, -by].map(|by| {
                    let mut moved = jump;
                    moved[j] += by;
                    start.respond(moved, Tangent::None).unwrap().traction
                });
                for i in 0..2 {
                    let here = walker.traction[i];
                    let [forward, backward] = [above[i] - here, here - below[i]].map(|d| d / by);
                    let size = elastic[0][0] + elastic[1][1];
                    // Re-closure is curved in the opening.
                    if (forward - backward).abs() > 1e-3 * size {
                        continue;
                    }
                    compared += 1;
                    let central = 0.5 * (forward + backward);
                    assert_abs_diff_eq!(central, tangent[i][j], epsilon = 1e-4 * size);
                }
            }
        }
    }
    assert!(compared > 40_000, "{compared}");
}

#[test]
fn random_walks_stay_within_the_limits_and_dissipate() {
    let unit = Q_S / (2.0 * E_M / D);
    walks_at_random(&shaft(0.0), [unit; 2], |[_, tau]| {
        assert!(tau.abs() <= Q_S * (1.0 + 1e-15));
    });
    let unit = Q_B / (11.0 * E_M / D);
    walks_at_random(&base(0.0), [unit; 2], |[t_n, _]| {
        assert!((-Q_B * (1.0 + 1e-15)..=0.0).contains(&t_n));
    });
}
