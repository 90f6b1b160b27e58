//! Each return zone by hand; random states in `sweep`.
#![expect(
    clippy::float_cmp,
    reason = "what must not change is compared bit for bit"
)]

mod sweep;

use crate::return_mapping::Zone;
use crate::{OrientedMohrCoulomb, Parameters, State};
use abi::{ContinuumLaw as _, SolidPoint, SolidResponse, Tangent};
use approx::assert_relative_eq;

/// E = 25e3 kPa and ν = 1/4: λ = G = 1e4 kPa, M = 3e4 kPa; φ = 45°, ψ = 0, c = 10 kPa: the
/// yield function is |t| + n − 10.
fn handy(tensile_strength: Option<f64>) -> Parameters {
    Parameters {
        young_modulus: 25e3,
        poisson_ratio: 0.25,
        cohesion: 10.0,
        friction_angle: 45.0,
        dilatancy_angle: 0.0,
        tensile_strength: tensile_strength.unwrap_or(f64::NAN),
    }
}

fn law(p: Parameters) -> OrientedMohrCoulomb {
    OrientedMohrCoulomb::new(p).unwrap()
}

fn rested(stress: [f64; 4], strain_increment: [f64; 4]) -> SolidPoint<4, State> {
    SolidPoint {
        strain: [0.0; 4],
        strain_increment,
        stress,
        state: State {
            plastic_strain: 0.0,
            plastic_dilation: 0.0,
        },
        time: 0.0,
        time_increment: 1.0,
        step_time: 0.0,
    }
}

/// The update from a stress that plays the trial stress.
fn from_trial(law: &OrientedMohrCoulomb, trial: [f64; 4]) -> SolidResponse<4, State> {
    law.update(&rested(trial, [0.0; 4]), Tangent::Consistent)
        .unwrap()
}

fn distance(a: &[f64; 4], b: &[f64; 4]) -> f64 {
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f64::max)
}

/// Both signs of the shear stress. `expected` holds the stress and the plastic strains γ and ε.
fn check(p: Parameters, zone: Zone, trial: [f64; 4], expected: [f64; 4], plastic: [f64; 2]) {
    let law = law(p);
    assert_eq!(law.facet.return_stress(trial[1], trial[3]).zone, zone);
    for sign in [1.0, -1.0] {
        let mirror = |s: [f64; 4]| [s[0], s[1], s[2], sign * s[3]];
        let end = from_trial(&law, mirror(trial));
        assert!(distance(&end.stress, &mirror(expected)) < 1e-13);
        assert_relative_eq!(end.state.plastic_strain, plastic[0], epsilon = 1e-17);
        assert_relative_eq!(end.state.plastic_dilation, plastic[1], epsilon = 1e-17);
        let worst = tangent_error(&law, mirror(trial), 1e-3).unwrap();
        // The return is linear in each zone: only rounding, 1e-14 kPa over 1e-3 kPa.
        assert!(worst < 1e-10, "{zone:?} {worst}");
    }
}

/// Largest error of the tangent over M; none if a probe (kPa) changes zone.
fn tangent_error(law: &OrientedMohrCoulomb, trial: [f64; 4], probe: f64) -> Option<f64> {
    let zone = |s: &[f64; 4]| {
        (!law.facet.admits(s[1], s[3])).then(|| {
            let end = law.facet.return_stress(s[1], s[3]);
            (end.zone, s[3] > 0.0)
        })
    };
    let here = zone(&trial);
    let tangent = from_trial(law, trial).tangent;
    let operator = law.elastic_operator::<4>();
    let step = probe / law.oedometric;
    let mut worst = 0.0_f64;
    for j in 0..4 {
        let probed = |sign: f64| {
            let mut increment = [0.0; 4];
            increment[j] = sign * step;
            let moved = std::array::from_fn(|i| trial[i] + operator[i][j] * increment[j]);
            let end = law
                .update(&rested(trial, increment), Tangent::None)
                .unwrap();
            (zone(&moved) == here).then_some(end.stress)
        };
        let (ahead, behind) = (probed(1.0)?, probed(-1.0)?);
        for i in 0..4 {
            let difference = (ahead[i] - behind[i]) / (2.0 * step);
            worst = worst.max((tangent[i][j] - difference).abs() / law.oedometric);
        }
    }
    Some(worst)
}

#[test]
fn stays_elastic_inside() {
    let law = law(handy(Some(5.0)));
    let point = rested([-20.0, -30.0, -25.0, 3.0], [1e-4, 2e-4, 0.0, -1e-4]);
    let end = law.update(&point, Tangent::Consistent).unwrap();
    // Volumetric strain 3e-4: λ tr Δε = 3 kPa, 2GΔε = (2, 4, 0) kPa, GΔγ = −1 kPa.
    assert!(distance(&end.stress, &[-15.0, -23.0, -22.0, 2.0]) < 1e-13);
    assert_eq!(end.state, point.state);
    assert_eq!(end.tangent, law.elastic_operator());
}

/// Stresses along the layer and out of plane are free of the criterion.
#[test]
fn knows_only_its_facet() {
    let trial = [500.0, -30.0, -900.0, 3.0];
    assert_eq!(from_trial(&law(handy(None)), trial).stress, trial);
}

/// F = 50 − 20 − 10 = 20; without dilatancy the normal stress stays.
#[test]
fn slides_at_constant_normal_stress() {
    let (trial, end) = ([-5.0, -20.0, -7.0, 50.0], [-5.0, -20.0, -7.0, 30.0]);
    check(handy(None), Zone::Face, trial, end, [20.0 / 1e4, 0.0]);
}

/// tan ψ = 1: H = G + M = 4e4 kPa, slip = 20 kPa/H = 5e-4 = opening; t loses 5, n loses 15, the
/// others λ × 5e-4 = 5 kPa.
#[test]
fn dilates_by_the_slip_times_tan_psi() {
    let mut p = handy(None);
    p.dilatancy_angle = 45.0;
    let (trial, end) = ([-5.0, -20.0, -7.0, 50.0], [-10.0, -35.0, -12.0, 45.0]);
    check(p, Zone::Face, trial, end, [5e-4, 5e-4]);
}

/// n loses 12 kPa = 4e-4 M; the others λ × 4e-4 = 4 kPa.
#[test]
fn returns_to_the_apex() {
    let (trial, end) = ([0.0, 22.0, 1.0, 6.0], [-4.0, 10.0, -3.0, 0.0]);
    check(handy(None), Zone::Apex, trial, end, [6e-4, 4e-4]);
}

/// n loses 3 kPa = 1e-4 M; the others λ × 1e-4 = 1 kPa; the shear stress stays.
#[test]
fn opens_at_the_tensile_strength() {
    let (trial, end) = ([0.0, 8.0, 1.0, 4.0], [-1.0, 5.0, 0.0, 4.0]);
    check(handy(Some(5.0)), Zone::Tension, trial, end, [0.0, 1e-4]);
}

/// At n = 5 the shear strength is 5.
#[test]
fn slides_and_opens_at_the_corner() {
    let (trial, end) = ([0.0, 8.0, 1.0, 9.0], [-1.0, 5.0, 0.0, 5.0]);
    check(handy(Some(5.0)), Zone::Corner, trial, end, [4e-4, 1e-4]);
}

/// φ = 0: the shear strength is c whatever the normal stress.
#[test]
fn without_friction_there_is_no_apex() {
    let mut p = handy(None);
    p.friction_angle = 0.0;
    for normal in [-1e6, 0.0, 1e6] {
        let end = from_trial(&law(p), [0.0, normal, 0.0, -30.0]);
        assert_eq!(end.stress, [0.0, normal, 0.0, -10.0]);
    }
}

#[test]
fn refuses_what_does_not_go_together() {
    let refusal = |change: fn(&mut Parameters)| {
        let mut p = handy(None);
        change(&mut p);
        OrientedMohrCoulomb::new(p).unwrap_err().to_string()
    };
    assert_eq!(
        refusal(|p| p.dilatancy_angle = 46.0),
        "dilatancy_angle: 46 deg exceeds the friction angle of 45 deg"
    );
    assert!(refusal(|p| p.tensile_strength = 10.1).starts_with("tensile_strength: 10.1 kPa"));
    assert!(
        refusal(|p| (p.friction_angle, p.cohesion) = (0.0, 0.0)).starts_with("cohesion: 0 kPa")
    );
}

#[test]
fn an_overflow_is_a_failure() {
    let point = rested([0.0; 4], [0.0, 1e305, 0.0, 0.0]);
    assert!(law(handy(None)).update(&point, Tangent::None).is_err());
}
