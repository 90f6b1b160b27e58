//! The consistent tangent against central differences of the update.

use super::{
    Random, Zone, any_angles, from_trial, handy, law, parameters, principal, principal_values,
    rested, turned,
};
use crate::{MohrCoulomb, Parameters};
use abi::{ContinuumLaw as _, Tangent};
use std::collections::HashMap;

/// The zone of a trial stress; none if admissible.
fn zone<const N: usize>(law: &MohrCoulomb, trial: &[f64; N]) -> Option<Zone> {
    let s = principal_values(trial);
    (!law.pyramid.admits(s[0], s[2])).then(|| law.pyramid.return_stress(&s).zone)
}

/// Largest error of the tangent over the oedometric modulus; none if a probe changes zone.
fn error<const N: usize>(p: &Parameters, trial: [f64; N], probe: f64) -> Option<f64> {
    let law = law(*p);
    let tangent = from_trial(&law, trial).tangent;
    let operator = law.elasticity.operator::<N>();
    let step = probe / operator[0][0];
    let here = zone(&law, &trial);
    let mut worst = 0.0_f64;
    for j in 0..N {
        let probed = |sign: f64| {
            let mut increment = [0.0; N];
            increment[j] = sign * step;
            let moved = law.elasticity.trial_stress(&trial, &increment);
            let end = law
                .update(&rested(trial, increment), Tangent::None)
                .unwrap();
            (zone(&law, &moved) == here).then_some(end.stress)
        };
        let (ahead, behind) = (probed(1.0)?, probed(-1.0)?);
        for i in 0..N {
            let difference = (ahead[i] - behind[i]) / (2.0 * step);
            worst = worst.max((tangent[i][j] - difference).abs() / operator[0][0]);
        }
    }
    Some(worst)
}

/// The trial states of `zones`. A probe of 1e-4 kPa against gaps of 1 kPa truncates at 1e-8; the
/// rounding of 1e-14 kPa in stresses gives 1e-10.
#[test]
fn agrees_with_differences_in_each_zone() {
    let cut = Some(5.0);
    let states = [
        (Zone::Face, None, [0.0, -20.0, -80.0]),
        (Zone::Edge12, None, [0.0, -2.0, -80.0]),
        (Zone::Edge12, None, [-1.0, -1.0, -80.0]),
        (Zone::Edge23, None, [10.0, -38.0, -42.0]),
        (Zone::Edge23, None, [10.0, -40.0, -40.0]),
        (Zone::Apex, None, [40.0, 39.0, 38.0]),
        (Zone::Apex, None, [40.0, 40.0, 40.0]),
        (Zone::TensionPlane, cut, [8.0, 0.0, -1.0]),
        (Zone::TensionPlane, cut, [8.0, 0.0, 0.0]),
        (Zone::TensionEdge, cut, [8.0, 7.0, -1.0]),
        (Zone::TensionEdge, cut, [8.0, 8.0, -1.0]),
        (Zone::TensionCorner, cut, [20.0, 19.0, 18.0]),
        (Zone::FaceAndTension, cut, [15.0, -10.0, -30.0]),
        (Zone::Vertex12, cut, [30.0, 29.0, -40.0]),
        (Zone::Vertex12, cut, [30.0, 30.0, -40.0]),
        (Zone::Vertex23, cut, [40.0, -38.0, -40.0]),
        (Zone::Vertex23, cut, [40.0, -40.0, -40.0]),
    ];
    for (expected, tensile_strength, s) in states {
        let p = handy(tensile_strength);
        for [i, j, k] in [[0, 1, 2], [0, 2, 1], [1, 2, 0]] {
            for angles in [[0.0; 3], [0.4, 0.9, 2.0], [1.5, 0.2, 0.7]] {
                let plane: [f64; 4] = turned([s[i], s[j], s[k]], angles);
                assert_eq!(zone(&law(p), &plane), Some(expected));
                let worst = error(&p, plane, 1e-4).unwrap();
                assert!(worst < 1e-7, "{expected:?} {worst}");
                let space: [f64; 6] = turned([s[i], s[j], s[k]], angles);
                let worst = error(&p, space, 1e-4).unwrap();
                assert!(worst < 1e-7, "{expected:?} {worst}");
            }
        }
    }
}

/// Random parameters and states of size 1: a probe of 1e-5 rounds at 1e-11 and truncates at
/// (1e-5/gap)². States are left out if the probe comes near another zone, or two principal values
/// come within 0.02 but differ.
#[test]
fn agrees_with_differences_over_random_states() {
    let mut random = Random(3);
    let mut compared = HashMap::new();
    for _ in 0..20_000 {
        let p = parameters(&mut random, &[0.0, 1.0, 20.0, 45.0, 70.0, 89.9], 1.0);
        let s = principal(&mut random, 1.0);
        let close = |i: usize, j: usize| {
            let gap = (s[i] - s[j]).abs();
            gap > 0.0 && gap < 0.02
        };
        if close(0, 1) || close(0, 2) || close(1, 2) {
            continue;
        }
        let angles = any_angles(&mut random);
        let plane: [f64; 4] = turned(s, angles);
        let errors = [
            error(&p, plane, 1e-5),
            error::<6>(&p, turned(s, angles), 1e-5),
        ];
        let zone = zone(&law(p), &plane);
        for worst in errors.into_iter().flatten() {
            assert!(worst < 3e-6, "{p:?} {s:?} {zone:?} {worst}");
            *compared.entry(format!("{zone:?}")).or_insert(0) += 1;
        }
    }
    // The ten zones and the elastic range.
    assert_eq!(compared.len(), 11, "{compared:?}");
    assert!(compared.values().all(|count| *count > 50), "{compared:?}");
}

#[test]
fn is_symmetric_for_associated_flow() {
    let mut random = Random(4);
    for _ in 0..2_000 {
        let mut p = parameters(&mut random, &[0.0, 10.0, 35.0, 60.0], 1.0);
        p.dilatancy_angle = p.friction_angle;
        let t = from_trial::<6>(
            &law(p),
            turned(principal(&mut random, 1.0), any_angles(&mut random)),
        )
        .tangent;
        let modulus = law(p).elasticity.operator::<6>()[0][0];
        for i in 0..6 {
            for j in 0..i {
                assert!((t[i][j] - t[j][i]).abs() < 1e-12 * modulus);
            }
        }
    }
}
