//! Random states over all angles and scales: the end is admissible, stays where it is, and does
//! not depend on the axes or on how many components the point has.

use super::{
    Random, any_angles, distance, excess, from_trial, law, parameters, principal, rested, size,
    turned,
};
use crate::Parameters;
use abi::{ContinuumLaw as _, Tangent};

const ANGLES: [f64; 9] = [0.0, 1e-6, 0.1, 5.0, 30.0, 45.0, 75.0, 89.9, 89.999_999_999];

/// Rounding of a return and of the library's principal values.
const ROUND_OFF: f64 = 1e-12;

/// Parameters of any scale and an elastic predictor up to 10⁶ times the strength.
fn extreme(random: &mut Random) -> (Parameters, [f64; 3]) {
    let scale = 10_f64.powf(random.between(-6.0, 6.0));
    let p = parameters(random, &ANGLES, scale);
    let size = random.one_of(&[0.1, 1.0, 10.0, 1e3, 1e6]);
    (p, principal(random, size * scale))
}

fn is_admissible_and_stays<const N: usize>(random: &mut Random) {
    let (p, values) = extreme(random);
    let law = law(p);
    let trial: [f64; N] = turned(values, any_angles(random));
    let end = from_trial(&law, trial);
    assert!(
        excess(&p, &end.stress) < ROUND_OFF,
        "{p:?} {values:?} {end:?}"
    );
    assert!(end.tangent.iter().flatten().all(|t| t.is_finite()));
    assert!(end.state.plastic_strain >= 0.0 && end.state.plastic_strain.is_finite());
    let again = law
        .update(&rested(end.stress, [0.0; N]), Tangent::None)
        .unwrap();
    assert_eq!(again.stress, end.stress, "{p:?} {values:?}");
    assert_eq!(again.state.plastic_strain, 0.0, "{p:?} {values:?}");
    // The same predictor reached by a strain increment.
    let operator = law.elasticity.operator::<N>();
    let strain: [f64; N] = std::array::from_fn(|i| {
        let (e, nu) = (p.young_modulus, p.poisson_ratio);
        let volume = trial[0] + trial[1] + trial[2];
        if i < 3 {
            ((1.0 + nu) * trial[i] - nu * volume) / e
        } else {
            trial[i] / operator[3][3]
        }
    });
    let strained = law
        .update(&rested([0.0; N], strain), Tangent::None)
        .unwrap();
    assert!(excess(&p, &strained.stress) < ROUND_OFF);
}

#[test]
fn ends_on_an_admissible_stress_and_stays_there() {
    let mut random = Random(5);
    for _ in 0..20_000 {
        is_admissible_and_stays::<4>(&mut random);
        is_admissible_and_stays::<6>(&mut random);
    }
}

/// How much the end moves for a unit of rounding in the predictor: near 90° the flow without
/// dilatancy is almost parallel to the surface.
fn amplification(p: &Parameters) -> f64 {
    1.0 / (90.0 - p.friction_angle).to_radians().sin()
}

#[test]
fn in_the_plane_and_in_space_are_the_same() {
    let mut random = Random(6);
    for _ in 0..20_000 {
        let (p, values) = extreme(&mut random);
        let law = law(p);
        let plane: [f64; 4] = turned(values, [random.between(0.0, 6.3), 0.0, 0.0]);
        let [a, b, c, d] = plane;
        let (four, six) = (
            from_trial(&law, plane),
            from_trial(&law, [a, b, c, d, 0.0, 0.0]),
        );
        let tolerance = ROUND_OFF * amplification(&p) * size(&plane);
        let stress: [f64; 4] = std::array::from_fn(|i| six.stress[i]);
        assert!(
            distance(&four.stress, &stress) < tolerance,
            "{p:?} {values:?}"
        );
        assert_eq!(six.stress[4..], [0.0, 0.0]);
    }
}

#[test]
fn does_not_depend_on_the_axes() {
    let mut random = Random(7);
    for _ in 0..20_000 {
        let (p, values) = extreme(&mut random);
        let (law, angles) = (law(p), any_angles(&mut random));
        let straight = from_trial::<6>(&law, turned(values, [0.0; 3]));
        let [a, b, c, ..] = straight.stress;
        let expected: [f64; 6] = turned([a, b, c], angles);
        let end = from_trial::<6>(&law, turned(values, angles));
        let tolerance = ROUND_OFF * amplification(&p) * size(&values);
        assert!(
            distance(&end.stress, &expected) < tolerance,
            "{p:?} {values:?}"
        );
    }
}

/// Elastic predictors far outside, step by step: stress, strains and tangents stay finite.
#[test]
fn survives_a_long_path_of_huge_increments() {
    let mut random = Random(8);
    for e in [1.0, 1e9] {
        for friction_angle in ANGLES {
            let p = Parameters {
                young_modulus: e,
                poisson_ratio: 0.3,
                cohesion: 1.0,
                friction_angle,
                dilatancy_angle: 0.0,
                tensile_strength: f64::NAN,
                scheme: super::IMPLICIT,
                relaxation_time: 0.0,
            };
            let law = law(p);
            let mut point = rested([0.0; 4], [0.0; 4]);
            for _ in 0..1_000 {
                point.strain_increment = std::array::from_fn(|_| random.between(-1e3, 1e3) / e);
                let end = law.update(&point, Tangent::Consistent).unwrap();
                assert!(excess(&p, &end.stress) < ROUND_OFF);
                assert!(end.state.plastic_strain.is_finite());
                (point.stress, point.state) = (end.stress, end.state);
            }
        }
    }
}

/// φ = 0 and a predictor whose rounding exceeds the strength: gaps of the face return are then
/// noise, and no apex may be found. The end is on the surface to its own rounding.
#[test]
fn tresca_stands_any_predictor() {
    let mut random = Random(9);
    let p = Parameters {
        young_modulus: 1e4,
        poisson_ratio: 0.3,
        cohesion: 1.0,
        friction_angle: 0.0,
        dilatancy_angle: 0.0,
        tensile_strength: f64::NAN,
        scheme: super::IMPLICIT,
        relaxation_time: 0.0,
    };
    let law = law(p);
    for _ in 0..10_000 {
        let reach = 10_f64.powf(random.between(0.0, 20.0));
        let trial: [f64; 4] = turned([reach, -reach, 0.0], any_angles(&mut random));
        let nudged = trial.map(|s| s * (1.0 + random.between(-4.0, 4.0) * f64::EPSILON));
        let end = from_trial(&law, nudged);
        assert!(excess(&p, &end.stress) < ROUND_OFF, "{trial:?} {end:?}");
        assert!(end.tangent.iter().flatten().all(|t| t.is_finite()));
        let sheared = from_trial(&law, [0.0, 0.0, 0.0, reach + 1.0]);
        assert!(excess(&p, &sheared.stress) < ROUND_OFF);
        assert!(distance(&sheared.stress, &[0.0, 0.0, 0.0, 1.0]) <= f64::EPSILON * reach);
    }
}
