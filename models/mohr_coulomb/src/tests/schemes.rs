//! The schemes against each other: order, tolerance, and what they leave alone.

use super::{
    IMPLICIT, Random, any_angles, distance, excess, from_trial, law, parameters, principal, rested,
    size,
};
use crate::spectral::Spatial;
use crate::{MohrCoulomb, Parameters, State};
use abi::substepping::SchemeParameters;
use abi::{ContinuumLaw as _, Failure, SolidPoint, Tangent};

/// Sand of the comparison with other programs.
const SAND: Parameters = Parameters {
    young_modulus: 34e3,
    poisson_ratio: 0.3,
    cohesion: 1.0,
    friction_angle: 36.5,
    dilatancy_angle: 12.0,
    tensile_strength: f64::NAN,
    scheme: IMPLICIT,
    relaxation_time: 0.0,
};

fn in_steps(substeps: f64) -> SchemeParameters {
    SchemeParameters {
        scheme: 1.0,
        substeps,
        ..IMPLICIT
    }
}

fn within(scheme_tolerance: f64) -> SchemeParameters {
    SchemeParameters {
        scheme: 2.0,
        scheme_tolerance,
        ..IMPLICIT
    }
}

fn explicit(substeps: f64) -> MohrCoulomb {
    law(Parameters {
        scheme: in_steps(substeps),
        ..SAND
    })
}

fn controlled(tolerance: f64) -> MohrCoulomb {
    law(Parameters {
        scheme: within(tolerance),
        ..SAND
    })
}

/// Principal stresses at the start, along 11 22 33: axes that shearing turns.
const START: [f64; 3] = [-60.0, -150.0, -60.0];

/// Follows a straight path in equal increments.
fn follow<const N: usize>(
    law: &MohrCoulomb,
    strain: &[f64; N],
    increments: u32,
) -> ([f64; N], State) {
    let mut stress = [0.0; N];
    stress[..3].copy_from_slice(&START);
    let mut point: SolidPoint<N, State> = rested(stress, strain.map(|e| e / f64::from(increments)));
    for _ in 0..increments {
        let end = law.update(&point, Tangent::None).unwrap();
        (point.stress, point.state) = (end.stress, end.state);
    }
    (point.stress, point.state)
}

/// Shearing that turns the axes on a face.
const TURNING: [f64; 4] = [1e-3, -3e-3, 0.0, 8e-3];

/// The same to the triaxial edge: radial and hoop strain are alike, and shear comes to it.
const TO_THE_EDGE: [f64; 4] = [2e-3, -8e-3, 2e-3, 3e-3];

/// The implicit scheme is of first order: twice the result of fine steps less that of steps twice as
/// long is of second.
fn fine<const N: usize>(strain: &[f64; N]) -> [f64; N] {
    let (one, _) = follow(&law(SAND), strain, 20_000);
    let (two, _) = follow(&law(SAND), strain, 40_000);
    std::array::from_fn(|c| 2.0 * two[c] - one[c])
}

#[test]
fn error_control_meets_its_tolerance_in_space() {
    let strain = [1e-3, -4e-3, 2e-3, 5e-3, -3e-3, 2e-3];
    let reference = fine(&strain);
    for tolerance in [1e-3, 1e-5] {
        let (stress, _) = follow(&controlled(tolerance), &strain, 1);
        let error = distance(&stress, &reference) / size(&reference);
        assert!(error < 10.0 * tolerance, "{error:e} at {tolerance:e}");
    }
}

/// If axes and zone do not change, the schemes agree to rounding, plastic
/// strains included.
#[test]
fn without_turning_all_schemes_are_exact() {
    let strain = [2e-3, -9e-3, 1e-3, 0.0];
    let (stress, state) = follow(&law(SAND), &strain, 1);
    for law in [explicit(1.0), explicit(7.0), controlled(1e-6)] {
        let (other, its_state) = follow(&law, &strain, 1);
        assert!(
            distance(&stress, &other) < 1e-11 * size(&stress),
            "{stress:?} {other:?}"
        );
        assert!((state.plastic_strain - its_state.plastic_strain).abs() < 1e-14);
        assert!((state.plastic_dilation - its_state.plastic_dilation).abs() < 1e-14);
    }
}

/// An increment that ends inside the surface is the same by every scheme, bit by bit, and splitting
/// off the elastic part of one that leaves it changes nothing.
#[test]
fn elastic_splits_change_nothing() {
    let inside = [1e-4, -3e-4, 1e-4, 2e-4];
    for other in [explicit(10.0), controlled(1e-6)] {
        assert_eq!(
            follow(&other, &inside, 1).0,
            follow(&law(SAND), &inside, 1).0
        );
        let (whole, _) = follow(&other, &TURNING, 1);
        let mut point: SolidPoint<4, State> = rested(
            [START[0], START[1], START[2], 0.0],
            TURNING.map(|e| 0.01 * e),
        );
        point.stress = other.update(&point, Tangent::None).unwrap().stress;
        point.strain_increment = TURNING.map(|e| 0.99 * e);
        let split = other.update(&point, Tangent::None).unwrap().stress;
        assert!(
            distance(&whole, &split) < 1e-9 * size(&whole),
            "{whole:?} {split:?}"
        );
    }
}

/// The tangent is that of a small increment from the end.
#[test]
fn the_tangent_is_the_continuum_one() {
    for strain in [TURNING, TO_THE_EDGE] {
        let law = controlled(1e-8);
        let mut point: SolidPoint<4, State> = rested([START[0], START[1], START[2], 0.0], strain);
        let end = law.update(&point, Tangent::Consistent).unwrap();
        point.stress = end.stress;
        point.strain_increment = strain.map(|e| 1e-5 * e);
        let next = law.update(&point, Tangent::None).unwrap().stress;
        for i in 0..4 {
            let predicted: f64 = (0..4)
                .map(|j| end.tangent[i][j] * point.strain_increment[j])
                .sum();
            let found = next[i] - end.stress[i];
            assert!(
                (predicted - found).abs() < 1e-3 * 34e3 * 1e-5 * size(&strain),
                "{predicted} {found}"
            );
        }
    }
}

/// Every scheme ends near the surface with finite numbers. The explicit one has no reason to refuse. The
/// other may, if two principal stresses are equal where the flow starts or ends. There the axes turn at a
/// rate without bound, `G γ/(s_i − s_j)`, and the error of a step does not fall with its square. At an
/// apex without stress a relative error has no meaning. If the three stay apart, about `√(‖σ''‖/(2 ‖σ‖
/// ε_s))` steps suffice, far below the 10 000 that it has. So that success is no matter of chance, states
/// are drawn until a hundred have had to succeed, fifty by each scheme at least.
#[test]
fn stands_random_states() {
    let mut random = Random(5);
    let angles = [0.0, 10.0, 36.5, 60.0];
    // By the explicit scheme, under control, and those of the latter that may be refused.
    let (mut explicit, mut apart, mut equal) = (0, 0, [0, 0]);
    for k in 0.. {
        if explicit >= 50 && apart >= 50 {
            break;
        }
        let scale = 10_f64.powf(random.between(-1.0, 3.0));
        let controls = k % 2 == 1;
        let p = Parameters {
            scheme: if controls {
                within(1e-4)
            } else {
                in_steps(10.0)
            },
            ..parameters(&mut random, &angles, scale)
        };
        let stress = super::turned::<6>(principal(&mut random, scale), any_angles(&mut random));
        let increment: [f64; 6] =
            std::array::from_fn(|_| random.between(-3.0, 3.0) * scale / p.young_modulus);
        let start = rested(stress, increment);
        let implicit = law(Parameters {
            scheme: IMPLICIT,
            ..p
        });
        let first = from_trial(&implicit, stress);
        let last = implicit.update(&start, Tangent::None).unwrap();
        let may_refuse = controls && (are_equal(&first.stress) || are_equal(&last.stress));
        let end = match law(p).update(&start, Tangent::Consistent) {
            Ok(end) => end,
            Err(Failure::CutStep { factor, .. }) => {
                assert!(may_refuse, "{k}: {p:?} {start:?}");
                assert!((0.0..1.0).contains(&factor), "{factor}");
                equal[0] += 1;
                continue;
            }
            Err(other) => panic!("{other:?}"),
        };
        let numbers = end.stress.iter().chain(end.tangent.as_flattened());
        assert!(numbers.copied().all(f64::is_finite), "{p:?}");
        if controls {
            assert!(excess(&p, &end.stress) < 1e-12, "{p:?}");
        }
        match (controls, may_refuse) {
            (false, _) => explicit += 1,
            (true, false) => apart += 1,
            (true, true) => equal[1] += 1,
        }
    }
    println!("{explicit} explicit, {apart} apart, with equal ones refused and not: {equal:?}");
}

/// Whether two principal stresses are equal up to rounding.
fn are_equal(stress: &[f64; 6]) -> bool {
    let s = Spatial::of(stress).stress;
    (s[0] - s[1]).min(s[1] - s[2]) <= 1e-9 * s.amax()
}

/// A start outside the surface is no error of a step: it would stay, however small the steps.
#[test]
fn a_stress_from_outside_is_returned_before_the_steps() {
    let outside = [-60.0, -500.0, -60.0, 0.0];
    let law = controlled(1e-6);
    let expected = super::from_trial(&super::law(SAND), outside);
    let end = super::from_trial(&law, outside);
    assert!(distance(&end.stress, &expected.stress) < 1e-12 * size(&outside));
    let off = end.state.plastic_strain / expected.state.plastic_strain - 1.0;
    assert!(off.abs() < 1e-12, "{off:e}");
    let end = law
        .update(&rested(outside, TURNING), Tangent::None)
        .unwrap();
    assert!(excess(&SAND, &end.stress) < 1e-12);
}
