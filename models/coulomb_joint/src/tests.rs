//! Zone by zone against closed forms derived here. Tension and opening positive.
#![expect(
    clippy::float_cmp,
    reason = "zeros and unchanged values are compared bit by bit"
)]

use super::*;
use approx::{assert_abs_diff_eq, assert_relative_eq};
use walk::{Walker, random};

const K_N: f64 = 2e6;
const K_T: f64 = 5e5;

fn parameters(c: f64, phi: f64, psi: f64, r_t: f64) -> Parameters {
    Parameters {
        normal_stiffness: K_N,
        shear_stiffness: K_T,
        cohesion: c,
        friction_angle: phi,
        dilatancy_angle: psi,
        tensile_strength: r_t,
    }
}

fn joint(c: f64, phi: f64, psi: f64, r_t: f64) -> CoulombJoint {
    CoulombJoint::new(parameters(c, phi, psi, r_t)).unwrap()
}

fn tan(degrees: f64) -> f64 {
    degrees.to_radians().tan()
}

#[test]
fn is_elastic_inside_the_surface() {
    let mut walker = Walker::new(joint(10.0, 35.0, 10.0, 5.0), [-100.0, 0.0]);
    let tangent = walker.step([1e-5, -4e-5]);
    assert_relative_eq!(walker.traction[0], -80.0, max_relative = 1e-14);
    assert_relative_eq!(walker.traction[1], -20.0, max_relative = 1e-14);
    assert_eq!(tangent, [[K_N, 0.0], [0.0, K_T]]);
    // Tension below the strength is carried.
    walker.step([4.2e-5, 4e-5]);
    assert_relative_eq!(walker.traction[0], 4.0, max_relative = 1e-12);
    assert_eq!(
        walker.state,
        State {
            ..Walker::new(walker.law, [0.0; 2]).state
        }
    );
}

#[test]
fn slides_at_constant_volume_as_the_closed_form_says() {
    // t_n = t_0 − K_n tan ψ ξ, |τ| = c − t_n tan φ, u_t = ξ + |τ|/K_t: linear in ξ.
    for (c, phi, psi) in [
        (0.0, 35.0, 13.5),
        (10.0, 30.0, 30.0),
        (5.0, 35.0, 0.0),
        (7.0, 0.0, 0.0),
    ] {
        for sign in [1.0, -1.0] {
            for n in [1, 7, 100] {
                let u_t = 3e-3;
                let walker = Walker::new(joint(c, phi, psi, 0.0), [-100.0, 0.0]);
                let end = walker.walk([0.0, sign * u_t], n);
                let slip =
                    (u_t - (c + 100.0 * tan(phi)) / K_T) / (1.0 + K_N * tan(psi) * tan(phi) / K_T);
                let normal = -100.0 - K_N * tan(psi) * slip;
                assert_relative_eq!(end.state.plastic_slip, slip, max_relative = 1e-11);
                assert_relative_eq!(end.traction[0], normal, max_relative = 1e-11);
                let shear = sign * (c - normal * tan(phi));
                assert_relative_eq!(end.traction[1], shear, max_relative = 1e-11);
                let dilation = slip * tan(psi);
                assert_relative_eq!(end.state.plastic_opening, dilation, max_relative = 1e-11);
            }
        }
    }
}

#[test]
fn accumulates_slip_over_both_directions() {
    // Perfect plasticity at constant volume without dilatancy: each reversal costs 2 τ_max/K_t.
    let limit = 100.0 * tan(35.0);
    let mut walker = Walker::new(joint(0.0, 35.0, 0.0, 0.0), [-100.0, 0.0]);
    let mut slip = 1e-3 - limit / K_T;
    walker.step([0.0, 1e-3]);
    assert_relative_eq!(walker.traction[1], limit, max_relative = 1e-14);
    for sign in [-1.0, 1.0, -1.0] {
        walker.step([0.0, sign * 2e-3]);
        slip += 2e-3 - 2.0 * limit / K_T;
        assert_relative_eq!(walker.traction[1], sign * limit, max_relative = 1e-14);
        assert_relative_eq!(walker.state.plastic_slip, slip, max_relative = 1e-12);
    }
}

#[test]
fn opens_in_a_brittle_way_at_the_tensile_strength() {
    let mut walker = Walker::new(joint(10.0, 35.0, 0.0, 5.0), [-100.0, 0.0]);
    walker.step([104.9 / K_N, 0.0]);
    assert_relative_eq!(walker.traction[0], 4.9, max_relative = 1e-10);
    let tangent = walker.step([0.2 / K_N, 0.0]);
    assert_eq!(walker.traction, [0.0; 2]);
    assert_eq!(tangent, [[0.0; 2]; 2]);
    assert_eq!(walker.state.broken, 1.0);
    // The gap counts from the position without stress.
    assert_relative_eq!(walker.state.gap, 5.1 / K_N, max_relative = 1e-10);
    // Closed again: neither cohesion nor tensile strength.
    walker.step([-5.1 / K_N - 50.0 / K_N, 0.0]);
    assert_relative_eq!(walker.traction[0], -50.0, max_relative = 1e-10);
    walker.step([0.0, 1e-2]);
    assert_relative_eq!(walker.traction[1], 50.0 * tan(35.0), max_relative = 1e-10);
    walker.step([50.1 / K_N, 0.0]);
    assert_eq!(walker.traction, [0.0; 2]);
}

#[test]
fn only_the_part_of_an_increment_after_closure_acts() {
    let mut walker = Walker::new(joint(0.0, 35.0, 0.0, 0.0), [-100.0, 0.0]);
    walker.step([100.0 / K_N + 3e-5, 0.0]);
    assert_relative_eq!(walker.state.gap, 3e-5, max_relative = 1e-10);
    walker.step([-4e-5, 8e-6]);
    assert_relative_eq!(walker.traction[0], -20.0, max_relative = 1e-9);
    assert_relative_eq!(walker.traction[1], 1.0, max_relative = 1e-9);
    assert_eq!(walker.state.gap, 0.0);
}

#[test]
fn one_increment_equals_many_on_a_straight_path() {
    // Rates are constant in each zone, so backward Euler is exact, opening included.
    let start = [-100.0, 5.0];
    for law in [
        joint(10.0, 35.0, 12.0, 5.0),
        joint(0.0, 35.0, 35.0, 0.0),
        joint(10.0, 0.0, 0.0, 20.0),
        joint(10.0, 60.0, 0.0, 0.0),
    ] {
        for jump in [
            [1e-4, 1e-3],
            [1e-4, -1e-3],
            [2e-4, 1e-4],
            [2e-4, -1e-4],
            [2e-3, 0.0],
            [-1e-4, 1e-3],
            [1e-4, 3e-5],
        ] {
            let one = Walker::new(law, start).walk(jump, 1);
            let many = Walker::new(law, start).walk(jump, 20_000);
            for i in 0..2 {
                assert_abs_diff_eq!(one.traction[i], many.traction[i], epsilon = 1e-6);
            }
            assert_abs_diff_eq!(one.state.gap, many.state.gap, epsilon = 1e-6 * 1e-3);
            let (a, b) = (one.state.plastic_slip, many.state.plastic_slip);
            assert_abs_diff_eq!(a, b, epsilon = 1e-4 * a.max(1e-4));
            assert_eq!(one.state.broken, many.state.broken);
        }
    }
}

#[test]
fn dilation_keeps_a_joint_in_contact_that_opens_slowly() {
    // Constant normal stress: opening = tan ψ · slip; the trial traction is tensile.
    let law = joint(0.0, 35.0, 12.0, 0.0);
    let limit = 100.0 * tan(35.0);
    let slip = 0.05 - limit / K_T;
    let mut walker = Walker::new(law, [-100.0, 0.0]);
    walker.step([slip * tan(12.0), 0.05]);
    assert_relative_eq!(walker.traction[0], -100.0, max_relative = 1e-9);
    assert_relative_eq!(walker.traction[1], limit, max_relative = 1e-9);
}

#[test]
fn the_elastic_operator_is_diagonal_in_every_state() {
    let mut walker = Walker::new(joint(0.0, 35.0, 12.0, 0.0), [-100.0, 0.0]);
    for jump in [[0.0, 1e-5], [0.0, 1e-2], [1e-1, 0.0], [-2e-1, 1e-3]] {
        let tangent = walker.respond(jump, Tangent::Elastic).unwrap().tangent;
        assert_eq!(tangent, [[K_N, 0.0], [0.0, K_T]]);
        walker.step(jump);
    }
}

/// Random joints and walks: admissible, dissipative, and the tangent agrees with differences.
#[test]
fn stays_admissible_with_an_exact_tangent_on_random_walks() {
    let seed = &mut 5;
    let mut compared = [0; 3];
    for _ in 0..1500 {
        let phi = random(seed, 0.0, 89.0) * random(seed, -0.2, 1.0).max(0.0);
        let psi = phi * random(seed, -0.3, 1.0).max(0.0);
        let c = random(seed, -10.0, 20.0).max(0.0);
        let r_t = if phi > 0.0 { 0.9 * c / tan(phi) } else { c } * random(seed, 0.0, 1.0);
        let p = Parameters {
            normal_stiffness: 10_f64.powf(random(seed, 0.0, 12.0)),
            shear_stiffness: 10_f64.powf(random(seed, 0.0, 12.0)),
            ..parameters(c, phi, psi, r_t)
        };
        let law = CoulombJoint::new(p).unwrap();
        let mut walker = Walker::new(law, [-random(seed, 0.0, 100.0), 0.0]);
        let mut dissipation = 0.0;
        for _ in 0..30 {
            let jump = [
                random(seed, -100.0, 100.0) / p.normal_stiffness,
                random(seed, -200.0, 200.0) / p.shear_stiffness,
            ];
            let start = walker;
            let tangent = walker.step(jump);
            let [normal, shear] = walker.traction;
            let open = walker.state.gap > 0.0;
            let (c, r_t) = if walker.state.broken > 0.5 {
                (0.0, 0.0)
            } else {
                (c, r_t)
            };
            let scale = c + (normal * tan(phi)).abs();
            assert!(shear.abs() + normal * tan(phi) - c <= 1e-14 * scale);
            assert!(normal <= r_t);
            assert!(walker.state.plastic_slip >= start.state.plastic_slip);
            let spent = shear.abs() * (walker.state.plastic_slip - start.state.plastic_slip)
                + normal * (walker.state.plastic_opening - start.state.plastic_opening);
            assert!(spent >= -1e-15 * dissipation, "{spent}");
            dissipation += spent;
            assert!(!open || walker.traction == [0.0; 2]);

            // Piecewise linear but for closure: differences are exact within a branch.
            let kind = |w: &Walker<CoulombJoint>| {
                let slid = w.state.plastic_slip > start.state.plastic_slip;
                if w.state.gap > 0.0 {
                    0
                } else {
                    1 + usize::from(slid)
                }
            };
            for j in 0..2 {
                let by = jump[j].abs() * 1e-5;
                let ends = [by, -by].map(|by| {
                    let mut moved = jump;
                    moved[j] += by;
                    let mut end = start;
                    end.step(moved);
                    end
                });
                let same = |w: &Walker<CoulombJoint>| {
                    kind(w) == kind(&walker) && w.traction[1] * walker.traction[1] >= 0.0
                };
                if !ends.iter().all(same) {
                    continue;
                }
                compared[kind(&walker)] += 1;
                for i in 0..2 {
                    let difference = (ends[0].traction[i] - ends[1].traction[i]) / (2.0 * by);
                    let size = tangent[i][j].abs() + 1e2 / jump[j].abs();
                    assert!(
                        (difference - tangent[i][j]).abs() < 1e-6 * size,
                        "({i}, {j}) {difference} {} {start:?} {jump:?}",
                        tangent[i][j]
                    );
                }
            }
        }
    }
    println!("open, elastic, sliding: {compared:?}");
    assert!(compared.iter().all(|&n| n > 1000), "{compared:?}");
}

/// tan φ and the slip until opening keep their digits where the friction line is all but vertical.
#[test]
fn keeps_its_digits_close_to_ninety_degrees() {
    let (c, phi, sigma): (f64, f64, f64) = (10.0, 89.999_999_9, 90.0);
    let tan_phi = 1.0 / (90.0 - phi).to_radians().tan();
    let law = joint(c, phi, 0.0, 0.0);
    let strength = c + sigma * tan_phi;
    let mut walker = Walker::new(law, [-sigma, 0.0]);
    walker.step([0.0, 2.0 * strength / K_T]);
    assert_relative_eq!(walker.traction[1], strength, max_relative = 1e-14);
    // t_n vanishes at 3/10 of the increment, where τ is down to c and would be 80 without slip.
    let mut walker = Walker::new(law, [-sigma, 50.0]);
    walker.step([sigma / 0.3 / K_N, 100.0 / K_T]);
    assert_eq!(walker.traction, [0.0; 2]);
    assert_relative_eq!(walker.state.plastic_slip, 70.0 / K_T, max_relative = 1e-12);
}
