//! Against closed forms and a quadrature of the rates that are derived here. Tension and opening positive.
#![expect(
    clippy::float_cmp,
    reason = "zeros and unchanged values are compared bit by bit"
)]

use super::*;
use approx::{assert_abs_diff_eq, assert_relative_eq};
use walk::{Walker, random};

const K_N: f64 = 2e6;
const K_T: f64 = 5e5;

/// Contracts by a tenth of a millimetre in all.
const SAND: Parameters = Parameters {
    normal_stiffness: K_N,
    shear_stiffness: K_T,
    peak_friction_angle: 35.0,
    residual_friction_angle: 25.0,
    friction_slip: 0.05,
    contraction_angle: 1.0,
    contraction_slip: 6e-3,
};

fn joint(p: Parameters) -> CyclicJoint {
    CyclicJoint::new(p).unwrap()
}

fn tan(degrees: f64) -> f64 {
    degrees.to_radians().tan()
}

/// Eq. (3), written again.
fn friction(p: &Parameters, xi: f64) -> f64 {
    let (peak, residual) = (tan(p.peak_friction_angle), tan(p.residual_friction_angle));
    residual + (peak - residual) * (-xi / p.friction_slip).exp()
}

/// Eq. (4).
fn contraction(p: &Parameters, xi: f64) -> f64 {
    p.contraction_slip * tan(p.contraction_angle) * (1.0 - (-xi / p.contraction_slip).exp())
}

/// Slips against a normal spring: `Δσ_n` = stiffness · `Δ[u_n]`, by bisection.
fn slip(walker: &mut Walker<CyclicJoint>, stiffness: f64, slip: f64) {
    let sigma = -walker.traction[0];
    // Contraction closes the joint by no more than its angle has it.
    let (mut low, mut high) = (-slip.abs() * walker.law.contraction_rate, 0.0);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        let end = walker.respond([middle, slip], Tangent::None).unwrap();
        let residual = -end.traction[0] - (sigma + stiffness * middle);
        if residual > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    walker.step([0.5 * (low + high), slip]);
}

/// σ and ξ of a joint behind a spring, cycled between two slips, by its rates: elastic until
/// `|τ| = μ σ_n`, then `dξ = K_t |du| / (K_t + μ'σ_n − μ K_s β)`, `dσ_n = −K_s β dξ`, with
/// `K_s = K K_n/(K + K_n)`. Classical Runge–Kutta method.
fn cycles(p: &Parameters, stiffness: f64, amplitude: f64, n: u32) -> Vec<[f64; 3]> {
    const STEPS: u32 = 400;
    let k_s = stiffness * p.normal_stiffness / (stiffness + p.normal_stiffness);
    let k_t = p.shear_stiffness;
    let (peak, residual) = (tan(p.peak_friction_angle), tan(p.residual_friction_angle));
    let rates = |[sigma, xi]: [f64; 2]| {
        let slope = -(peak - residual) / p.friction_slip * (-xi / p.friction_slip).exp();
        let beta = tan(p.contraction_angle) * (-xi / p.contraction_slip).exp();
        let flow = k_t / (k_t + slope * sigma - friction(p, xi) * k_s * beta);
        [-k_s * beta * flow, flow]
    };
    let (mut y, mut tau, mut u, mut turns) = ([100.0, 0.0], 0.0_f64, 0.0, Vec::new());
    for turn in 0..2 * n {
        let sign = if turn % 2 == 0 { 1.0 } else { -1.0 };
        let left = (sign * amplitude - u) * sign;
        let elastic = (friction(p, y[1]) * y[0] - sign * tau) / k_t;
        assert!(elastic < left);
        let h = (left - elastic) / f64::from(STEPS);
        for _ in 0..STEPS {
            let add = |y: [f64; 2], k: [f64; 2], by: f64| [y[0] + by * k[0], y[1] + by * k[1]];
            let k1 = rates(y);
            let k2 = rates(add(y, k1, h / 2.0));
            let k3 = rates(add(y, k2, h / 2.0));
            let k4 = rates(add(y, k3, h));
            for i in 0..2 {
                y[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
            }
        }
        tau = sign * friction(p, y[1]) * y[0];
        u = sign * amplitude;
        turns.push([y[0], tau, y[1]]);
    }
    turns
}

#[test]
fn cycles_at_constant_normal_stiffness_follow_the_quadrature_of_the_rates() {
    let (stiffness, amplitude, n) = (1e6, 1e-3, 20);
    let truth = cycles(&SAND, stiffness, amplitude, n);
    for increments in [1, 5] {
        let mut walker = Walker::new(joint(SAND), [-100.0, 0.0]);
        let (mut u, mut last) = (0.0, 100.0);
        for (turn, &[sigma, tau, xi]) in truth.iter().enumerate() {
            let goal = if turn % 2 == 0 { amplitude } else { -amplitude };
            for _ in 0..increments {
                slip(&mut walker, stiffness, (goal - u) / f64::from(increments));
            }
            u = goal;
            assert_relative_eq!(-walker.traction[0], sigma, max_relative = 1e-9);
            assert_relative_eq!(walker.traction[1], tau, max_relative = 1e-9);
            assert_relative_eq!(walker.state.plastic_slip, xi, max_relative = 1e-9);
            let spring = stiffness * K_N / (stiffness + K_N);
            let closed = 100.0 - spring * contraction(&SAND, xi);
            assert_relative_eq!(sigma, closed, max_relative = 1e-10);
            // Degradation: every half cycle leaves less.
            assert!(sigma < last);
            last = sigma;
        }
        // Contraction dies out: the last cycle takes a hundredth of the first.
        let fall = |turn: usize| truth[turn][0] - truth[turn + 2][0];
        assert!(fall(37) < 0.01 * fall(0), "{} {}", fall(37), fall(0));
        assert!(last < 50.0, "{last}");
    }
}

#[test]
fn friction_under_constant_normal_stress_is_that_of_the_slip() {
    // K_t (u − ξ) = μ(ξ) σ; contraction moves the joint and changes nothing.
    for n in [1, 9, 200] {
        for sign in [1.0, -1.0] {
            let mut walker = Walker::new(joint(SAND), [-100.0, 0.0]);
            for _ in 0..n {
                slip(&mut walker, 0.0, sign * 0.02 / f64::from(n));
            }
            let xi = walker.state.plastic_slip;
            assert_relative_eq!(walker.traction[0], -100.0, max_relative = 1e-10);
            let tau = friction(&SAND, xi) * 100.0;
            assert_relative_eq!(walker.traction[1], sign * tau, max_relative = 1e-10);
            assert_relative_eq!(K_T * (0.02 - xi), tau, max_relative = 1e-8);
            let c = walker.state.plastic_contraction;
            assert_relative_eq!(c, contraction(&SAND, xi), max_relative = 1e-10);
        }
    }
}

#[test]
fn one_increment_equals_many_on_a_straight_path_that_slides() {
    let start = [-100.0, 20.0];
    for jump in [[0.0, 3e-3], [0.0, -3e-3], [-2e-5, 1e-2], [1e-5, 2e-3]] {
        let one = Walker::new(joint(SAND), start).walk(jump, 1);
        let many = Walker::new(joint(SAND), start).walk(jump, 5000);
        for i in 0..2 {
            assert_relative_eq!(one.traction[i], many.traction[i], max_relative = 1e-9);
        }
        let (a, b) = (one.state, many.state);
        assert_relative_eq!(a.plastic_slip, b.plastic_slip, max_relative = 1e-9);
        assert_relative_eq!(
            a.plastic_contraction,
            b.plastic_contraction,
            max_relative = 1e-9
        );
    }
}

#[test]
fn without_fading_it_is_coulomb_friction_at_constant_volume() {
    let p = Parameters {
        residual_friction_angle: 35.0,
        contraction_angle: 0.0,
        ..SAND
    };
    let limit = 100.0 * tan(35.0);
    let mut walker = Walker::new(joint(p), [-100.0, 0.0]);
    let mut xi = 0.0;
    let mut tau = 0.0;
    for u in [1e-3, -2e-3, 2e-3, -2e-3] {
        let tangent = walker.step([0.0, u]);
        xi += u.abs() - (limit.copysign(u) - tau).abs() / K_T;
        tau = limit.copysign(u);
        assert_eq!(walker.traction[0], -100.0);
        assert_relative_eq!(walker.traction[1], tau, max_relative = 1e-14);
        assert_relative_eq!(walker.state.plastic_slip, xi, max_relative = 1e-12);
        assert_eq!(tangent[0], [K_N, 0.0]);
        assert_relative_eq!(tangent[1][0], -tau / 100.0 * K_N, max_relative = 1e-12);
        assert_abs_diff_eq!(tangent[1][1], 0.0);
    }
    // Fading that has come to its end is Coulomb friction as well.
    let mut walker = Walker::new(joint(SAND), [-500.0, 0.0]);
    walker.step([0.0, 10.0]);
    let sigma = 500.0 - K_N * 6e-3 * tan(1.0);
    assert_relative_eq!(walker.traction[0], -sigma, max_relative = 1e-12);
    assert_relative_eq!(walker.traction[1], sigma * tan(25.0), max_relative = 1e-12);
}

#[test]
fn contraction_at_constant_volume_uses_up_the_normal_stress() {
    // 100 kPa go with 0.05 mm of contraction, of 0.105 mm that there are.
    let mut walker = Walker::new(joint(SAND), [-100.0, 0.0]);
    let tangent = walker.step([0.0, 0.02]);
    assert_eq!((walker.traction, tangent), ([0.0; 2], [[0.0; 2]; 2]));
    let slip = -6e-3 * (1.0 - 5e-5 / (6e-3 * tan(1.0))).ln();
    assert_relative_eq!(walker.state.plastic_slip, slip, max_relative = 1e-10);
    assert_relative_eq!(walker.state.plastic_contraction, 5e-5, max_relative = 1e-10);
    assert_eq!(walker.state.gap, 0.0);
    // The same in many increments.
    let many = Walker::new(joint(SAND), [-100.0, 0.0]).walk([0.0, 0.02], 1000);
    assert_eq!(many.traction, [0.0; 2]);
    assert_relative_eq!(many.state.plastic_slip, slip, max_relative = 1e-8);
    // Slip alone changes nothing; pressed together it carries.
    let before = walker.state;
    walker.step([0.0, -0.01]);
    assert_eq!((walker.traction, walker.state), ([0.0; 2], before));
    walker.step([-1e-5, 0.0]);
    assert_relative_eq!(walker.traction[0], -20.0, max_relative = 1e-9);
}

#[test]
fn slip_without_contact_wears_nothing_down_whatever_contraction_is_left() {
    let never = Parameters {
        contraction_angle: 0.0,
        ..SAND
    };
    // ξ_c so small that exp(−ξ/ξ_c) is 0 after 10 m.
    let done = Parameters {
        contraction_slip: 1e-6,
        ..SAND
    };
    for (p, slipped) in [(never, 0.0), (done, 10.0)] {
        let mut touching = Walker::new(joint(p), [0.0; 2]);
        touching.state.plastic_slip = slipped;
        let mut apart = Walker::new(joint(p), [-100.0, 0.0]);
        apart.state.plastic_slip = slipped;
        apart.step([100.0 / K_N + 1e-3, 0.0]);
        for mut walker in [touching, apart] {
            let before = walker.state;
            for slip in [0.02, -0.05, 1.0] {
                walker.step([0.0, slip]);
                assert_eq!((walker.traction, walker.state), ([0.0; 2], before));
            }
            // Opening while it slips: nothing has held.
            walker.step([1e-4, 0.3]);
            assert_eq!(walker.state.plastic_slip, slipped);
            // Pressed again it has the friction of before.
            let gap = walker.state.gap;
            walker.step([-gap - 50.0 / K_N, 0.0]);
            walker.step([0.0, 1e-3]);
            let xi = walker.state.plastic_slip;
            assert!(xi - slipped < 1e-3, "{xi}");
            assert_relative_eq!(
                walker.traction[1],
                50.0 * friction(&p, xi),
                max_relative = 1e-6
            );
        }
    }
}

#[test]
fn internal_variables_that_no_path_leads_to_are_refused() {
    type Of = fn(&mut State) -> &mut f64;
    let variables: [(&str, Of); 3] = [
        ("plastic_slip", |s| &mut s.plastic_slip),
        ("plastic_contraction", |s| &mut s.plastic_contraction),
        ("gap", |s| &mut s.gap),
    ];
    for (name, of) in variables {
        let mut walker = Walker::new(joint(SAND), [-100.0, 0.0]);
        *of(&mut walker.state) = -1e-3;
        let failure = walker.respond([0.0; 2], Tangent::None).unwrap_err();
        assert!(failure.reason().starts_with(name), "{failure:?}");
    }
}

#[test]
fn opens_in_tension_and_closes_where_contact_was_lost() {
    let mut walker = Walker::new(joint(SAND), [-100.0, 0.0]);
    walker.step([100.0 / K_N + 3e-5, 0.0]);
    assert_eq!(walker.traction, [0.0; 2]);
    assert_eq!(
        (walker.state.plastic_slip, walker.state.plastic_contraction),
        (0.0, 0.0)
    );
    assert_relative_eq!(walker.state.gap, 3e-5, max_relative = 1e-10);
    let tangent = walker.step([1e-5, 1e-3]);
    assert_eq!((walker.traction, tangent), ([0.0; 2], [[0.0; 2]; 2]));
    // Four fifths of the increment close the gap.
    walker.step([-5e-5, 5e-5]);
    assert_relative_eq!(walker.traction[0], -20.0, max_relative = 1e-8);
    assert_relative_eq!(walker.traction[1], 5.0, max_relative = 1e-8);
    assert_eq!(walker.state.gap, 0.0);
}

#[test]
fn slip_until_contact_is_lost_counts_in_one_increment_as_in_many() {
    for start in [[-100.0, 30.0], [-100.0, 0.0], [-100.0, -60.0]] {
        for jump in [[1e-4, 1e-3], [6e-5, 4e-3], [1e-5, 2e-2], [2e-4, -1e-4]] {
            let one = Walker::new(joint(SAND), start).walk(jump, 1);
            let many = Walker::new(joint(SAND), start).walk(jump, 20_000);
            assert_eq!((one.traction, many.traction), ([0.0; 2], [0.0; 2]));
            let (a, b) = (one.state, many.state);
            // Until slip turns the elastic slip of the start into plastic slip.
            assert_abs_diff_eq!(
                a.plastic_slip,
                b.plastic_slip,
                epsilon = 2e-3 * b.plastic_slip
            );
            let c = b.plastic_contraction;
            assert_abs_diff_eq!(a.plastic_contraction, c, epsilon = 2e-3 * c);
            assert_abs_diff_eq!(a.gap, b.gap, epsilon = 2e-3 * jump[0]);
        }
    }
}

#[test]
fn refuses_friction_that_grows() {
    let p = Parameters {
        residual_friction_angle: 36.0,
        ..SAND
    };
    let refusal = CyclicJoint::new(p).unwrap_err();
    assert_eq!(refusal.parameter, "residual_friction_angle");
}

#[test]
fn the_elastic_operator_is_diagonal_in_every_state() {
    let mut walker = Walker::new(joint(SAND), [-100.0, 0.0]);
    for jump in [[0.0, 1e-5], [0.0, 1e-3], [1e-1, 0.0], [-2e-1, 1e-3]] {
        let end = walker.respond(jump, Tangent::Elastic).unwrap();
        assert_eq!(end.tangent, [[K_N, 0.0], [0.0, K_T]]);
        walker.step(jump);
    }
}

#[test]
fn huge_increments_end_at_the_residual_friction() {
    for slip in [1e3, -1e9, 1e100] {
        let mut walker = Walker::new(joint(SAND), [-500.0, 0.0]);
        walker.step([0.0, slip]);
        let sigma = 500.0 - K_N * 6e-3 * tan(1.0);
        let tau = (sigma * tan(25.0)).copysign(slip);
        assert_relative_eq!(walker.traction[1], tau, max_relative = 1e-12);
        assert_relative_eq!(walker.state.plastic_slip, slip.abs(), max_relative = 1e-6);
    }
}

/// Plastic work of an increment at the tractions of its end.
fn spent(start: &Walker<CyclicJoint>, end: &Walker<CyclicJoint>) -> f64 {
    let slipped = end.state.plastic_slip - start.state.plastic_slip;
    let closed = end.state.plastic_contraction - start.state.plastic_contraction;
    end.traction[1].abs() * slipped - end.traction[0] * closed
}

/// Random joints and walks: admissible, dissipative, the same in a mirror, and the tangent agrees with
/// differences.
#[test]
fn stays_admissible_with_an_exact_tangent_on_random_walks() {
    let seed = &mut 11;
    // Without contact, elastic, sliding; increments that were refused.
    let (mut compared, mut refused) = ([0; 3], 0);
    for _ in 0..1500 {
        let peak = random(seed, 0.0, 60.0);
        let p = Parameters {
            normal_stiffness: 10_f64.powf(random(seed, 0.0, 10.0)),
            shear_stiffness: 10_f64.powf(random(seed, 0.0, 10.0)),
            peak_friction_angle: peak,
            residual_friction_angle: peak * random(seed, 0.0, 1.3).min(1.0),
            friction_slip: 10_f64.powf(random(seed, -6.0, 2.0)),
            contraction_angle: random(seed, -5.0, 20.0).max(0.0),
            contraction_slip: 10_f64.powf(random(seed, -6.0, 2.0)),
        };
        let law = joint(p);
        let mut walker = Walker::new(law, [-random(seed, 0.0, 100.0), 0.0]);
        for _ in 0..30 {
            let jump = [
                random(seed, -150.0, 100.0) / p.normal_stiffness,
                random(seed, -200.0, 200.0) / p.shear_stiffness,
            ];
            let start = walker;
            if start.respond(jump, Tangent::Consistent).is_err() {
                refused += 1;
                continue;
            }
            let tangent = walker.step(jump);
            let mut mirror = start;
            mirror.traction[1] = -start.traction[1];
            mirror.step([jump[0], -jump[1]]);
            assert_eq!(mirror.traction, [walker.traction[0], -walker.traction[1]]);
            assert_eq!(mirror.state, walker.state);

            let [normal, shear] = walker.traction;
            let xi = walker.state.plastic_slip;
            assert!(normal <= 0.0);
            assert!(
                shear.abs() <= -friction(&p, xi) * normal * (1.0 + 1e-12),
                "{walker:?}"
            );
            assert!(xi >= start.state.plastic_slip);
            assert!(walker.state.plastic_contraction >= start.state.plastic_contraction);
            assert!(spent(&start, &walker) >= 0.0, "{start:?} {walker:?}");
            assert!(walker.state.gap == 0.0 || walker.traction == [0.0; 2]);
            // Eq. (6) by itself: what the springs lost is what has flowed.
            if normal < 0.0 && start.state.gap == 0.0 && shear != 0.0 {
                let flowed = xi - start.state.plastic_slip;
                let spring = start.traction[1] + p.shear_stiffness * jump[1]
                    - p.shear_stiffness * flowed * shear.signum();
                let scale = start.traction[1].abs() + (p.shear_stiffness * jump[1]).abs();
                let lost = 1e-10 * scale + 4.0 * f64::EPSILON * p.shear_stiffness * xi;
                assert_abs_diff_eq!(spring, shear, epsilon = lost);
            }
            let kind = |w: &Walker<CyclicJoint>| {
                if w.traction == [0.0; 2] {
                    0
                } else {
                    1 + usize::from(w.state.plastic_slip > start.state.plastic_slip)
                }
            };
            for j in 0..2 {
                let by = jump[j].abs() * 1e-4;
                let Some(ends) = start.around(jump, j, by) else {
                    continue;
                };
                let same = |w: &Walker<CyclicJoint>| {
                    kind(w) == kind(&walker) && w.traction[1] * shear >= 0.0
                };
                // Next to a snap-back the tangent changes over the difference.
                let steep = tangent
                    .iter()
                    .flatten()
                    .any(|k| k.abs() > 1e2 * p.shear_stiffness.max(p.normal_stiffness));
                if steep || !ends.iter().all(same) {
                    continue;
                }
                // Fading faster than the difference is long: no Taylor series over it.
                let slips = ends.map(|w| w.state.plastic_slip);
                let spread = (slips[3] - slips[0]).abs();
                if spread > 1e-2 * p.friction_slip.min(p.contraction_slip) {
                    continue;
                }
                compared[kind(&walker)] += 1;
                let least = [1e2 / jump[j].abs(), 1e-5];
                Walker::assert_column(&ends, by, (tangent, j), least);
            }
        }
    }
    println!("without contact, elastic, sliding: {compared:?}, refused: {refused}");
    assert!(compared.iter().all(|&n| n > 1000), "{compared:?}");
    assert!(refused < 100, "{refused}");
}
