//! One test per return zone: the stress by hand, in the plane with each principal value out of
//! plane in turn, and in space.
//!
//! Parameters of `handy`: with λ = G, φ = 30° and ψ = 0 the face takes Δ (1, 0, −1) away, the edge
//! s₁ = s₂ Δ (1/2, 1/2, −1), the edge s₂ = s₃ Δ (1, −1/2, −1/2). With a tensile strength of 5 kPa
//! the pyramid meets the cut-off at s₃ = (3.75 − 10)/0.25 = −25 kPa.

use super::{Zone, distance, excess, from_trial, handy, law, rested, size, turned};
use crate::spectral::Spatial;
use abi::{ContinuumLaw as _, Tangent};
use approx::assert_relative_eq;
use nalgebra::Vector3;

fn check(zone: Zone, tensile_strength: Option<f64>, trial: [f64; 3], expected: [f64; 3]) {
    let p = handy(tensile_strength);
    let law = law(p);
    let end = law.pyramid.return_stress(&Vector3::from(trial));
    assert_eq!(end.zone, zone);
    assert!(distance(&end.stress.into(), &expected) < 1e-12 * size(&trial));
    for order in [[0, 1, 2], [0, 2, 1], [1, 2, 0]] {
        let (trial, expected) = (order.map(|i| trial[i]), order.map(|i| expected[i]));
        for angle in [0.0, 0.4, 1.5, 2.6] {
            compare::<4>(&law, &p, trial, expected, [angle, 0.0, 0.0]);
            compare::<6>(&law, &p, trial, expected, [angle, 0.9, 2.0]);
        }
    }
}

fn cut(zone: Zone, trial: [f64; 3], expected: [f64; 3]) {
    check(zone, Some(5.0), trial, expected);
}

fn compare<const N: usize>(
    law: &crate::MohrCoulomb,
    p: &crate::Parameters,
    trial: [f64; 3],
    expected: [f64; 3],
    angles: [f64; 3],
) {
    let end = from_trial(law, turned::<N>(trial, angles));
    assert!(distance(&end.stress, &turned(expected, angles)) < 1e-12 * size(&trial));
    assert!(excess(p, &end.stress).abs() < 1e-12);

    // Eq. (13): plastic volumetric strain = lost mean stress/K, K = λ + 2/3 G; the shear strain
    // from the lost deviator/2G.
    let lost: [f64; 3] = std::array::from_fn(|i| trial[i] - expected[i]);
    let mean = lost.iter().sum::<f64>() / 3.0;
    let deviator = lost.iter().map(|s| (s - mean).powi(2)).sum::<f64>();
    assert_relative_eq!(
        end.state.plastic_dilation,
        mean / (1e4 * 5.0 / 3.0),
        epsilon = 1e-14
    );
    assert_relative_eq!(
        end.state.plastic_strain,
        (2.0 / 3.0 * deviator).sqrt() / 2e4,
        epsilon = 1e-14
    );
}

#[test]
fn stays_elastic_inside() {
    for strength in [None, Some(5.0)] {
        let law = law(handy(strength));
        let point = rested([-20.0, -30.0, -25.0, 3.0], [1e-4, 2e-4, 0.0, -1e-4]);
        let end = law.update(&point, Tangent::Consistent).unwrap();
        // Volumetric strain 3e-4: λ tr Δε = 3 kPa, 2GΔε = (2, 4, 0) kPa, GΔγ = −1 kPa.
        assert!(distance(&end.stress, &[-15.0, -23.0, -22.0, 2.0]) < 1e-13);
        assert_eq!(end.state, point.state);
        let elastic = law.update(&point, Tangent::Elastic).unwrap();
        assert_eq!(end.tangent, elastic.tangent);
        assert_eq!(end.tangent[0], [3e4, 1e4, 1e4, 0.0]);
        assert_eq!(end.tangent[3], [0.0, 0.0, 0.0, 1e4]);
    }
}

/// f = 0 + 20 − 10 = 10 = Δ.
#[test]
fn returns_to_the_face() {
    check(Zone::Face, None, [0.0, -20.0, -80.0], [-10.0, -20.0, -70.0]);
}

/// Mean of the pair −1: f = −0.75 + 20 − 10 = 9.25, Δ = 9.25/0.625 = 14.8.
#[test]
fn returns_to_the_edge_of_triaxial_compression() {
    check(Zone::Edge12, None, [0.0, -2.0, -80.0], [-8.4, -8.4, -65.2]);
}

/// Mean of the pair −40: f = 7.5 + 10 − 10 = 7.5, Δ = 7.5/0.875 = 60/7.
#[test]
fn returns_to_the_edge_of_triaxial_extension() {
    let end = [10.0 / 7.0, -250.0 / 7.0, -250.0 / 7.0];
    check(Zone::Edge23, None, [10.0, -38.0, -42.0], end);
}

/// Without dilatancy the face and the edges keep the mean stress: all beyond the apex's goes there.
#[test]
fn returns_to_the_apex() {
    check(Zone::Apex, None, [40.0, 39.0, 38.0], [20.0; 3]);
    check(Zone::Apex, None, [90.0, 0.0, -29.0], [20.0; 3]);
    check(Zone::Apex, None, [40.0; 3], [20.0; 3]);
}

/// ν/(1 − ν) = 1/3 of the 3 kPa that s₁ loses.
#[test]
fn returns_to_the_tension_plane() {
    cut(Zone::TensionPlane, [8.0, 0.0, -1.0], [5.0, -1.0, -2.0]);
    cut(Zone::TensionPlane, [8.0, 0.0, 0.0], [5.0, -1.0, -1.0]);
}

/// ν = 1/4 of the 5 kPa that s₁ and s₂ lose together.
#[test]
fn returns_to_the_tension_edge() {
    cut(Zone::TensionEdge, [8.0, 7.0, -1.0], [5.0, 5.0, -2.25]);
    cut(Zone::TensionEdge, [8.0, 8.0, -1.0], [5.0, 5.0, -2.5]);
}

/// On the tension edge s₃ would be 18 − 29/4 > 5.
#[test]
fn returns_to_the_tension_corner() {
    cut(Zone::TensionCorner, [20.0, 19.0, 18.0], [5.0; 3]);
    cut(Zone::TensionCorner, [9.0; 3], [5.0; 3]);
}

/// s₁ loses 10 and s₃ gains 5: s₂ loses (10 − 5)/4.
#[test]
fn returns_to_face_and_tension() {
    let end = [5.0, -11.25, -25.0];
    cut(Zone::FaceAndTension, [15.0, -10.0, -30.0], end);
}

/// The edge alone would end at s₁ = 29.5 − 35.4/2 = 11.8; s₂ between face and cut-off at 26.5.
#[test]
fn returns_to_the_vertex_on_the_compression_edge() {
    cut(Zone::Vertex12, [30.0, 29.0, -40.0], [5.0, 5.0, -25.0]);
    cut(Zone::Vertex12, [30.0, 30.0, -40.0], [5.0, 5.0, -25.0]);
}

/// The edge alone would end at s₁ = 40 − 34 = 6; s₂ between face and cut-off at −43.
#[test]
fn returns_to_the_vertex_on_the_extension_edge() {
    cut(Zone::Vertex23, [40.0, -38.0, -40.0], [5.0, -25.0, -25.0]);
    cut(Zone::Vertex23, [40.0, -40.0, -40.0], [5.0, -25.0, -25.0]);
}

/// φ = 0: s₁ − s₃ = 2c wherever the mean stress is.
#[test]
fn tresca_has_no_apex() {
    let mut p = handy(None);
    (p.friction_angle, p.cohesion) = (0.0, 10.0);
    let tresca = law(p);
    for mean in [-1e6, 0.0, 1e6] {
        let end = from_trial(&tresca, [mean + 30.0, mean - 30.0, mean, 0.0]);
        assert!(distance(&end.stress, &[mean + 10.0, mean - 10.0, mean, 0.0]) < 1e-9);
        let end = from_trial(&tresca, [mean + 30.0, mean + 30.0, mean - 60.0, 0.0]);
        // Mean of the three is kept: s₁ = mean + 20/3.
        let s1 = mean + 20.0 / 3.0;
        assert!(distance(&end.stress, &[s1, s1, s1 - 20.0, 0.0]) < 1e-9);
    }
    p.tensile_strength = 4.0;
    let end = from_trial(&law(p), [60.0, 55.0, -40.0, 0.0]);
    assert!(distance(&end.stress, &[4.0, 4.0, -16.0, 0.0]) < 1e-13);
}

#[test]
fn a_cut_off_at_the_apex_changes_nothing() {
    let (with, without) = (law(handy(Some(20.0))), law(handy(None)));
    for trial in [
        [40.0, 39.0, 38.0, 0.0],
        [10.0, -38.0, -42.0, 1.0],
        [30.0, -5.0, 0.0, 9.0],
    ] {
        assert_eq!(
            from_trial(&with, trial).stress,
            from_trial(&without, trial).stress
        );
    }
}

#[test]
fn repeated_values_have_orthonormal_axes() {
    for values in [
        [3.0, 3.0, 3.0],
        [3.0, 3.0, -1.0],
        [3.0, -1.0, -1.0],
        [0.0; 3],
    ] {
        for nudge in [0.0, 1e-300, 1e-16, 1e-12, 1e-8] {
            let mut stress: [f64; 6] = turned(values, [0.3, 1.1, 2.0]);
            stress[4] += nudge;
            let principal = Spatial::of(&stress);
            let back = principal.compose(&principal.stress);
            assert!(distance(&back, &stress) < 4e-15);
            assert!(distance(&principal.stress.into(), &values) < 2.0 * nudge + 4e-15);
        }
    }
}

#[test]
fn refuses_what_does_not_go_together() {
    let refusal = |change: fn(&mut crate::Parameters)| {
        let mut p = handy(None);
        change(&mut p);
        crate::MohrCoulomb::new(p).unwrap_err().to_string()
    };
    assert_eq!(
        refusal(|p| p.dilatancy_angle = 31.0),
        "dilatancy_angle: 31 deg exceeds the friction angle of 30 deg"
    );
    assert!(refusal(|p| p.tensile_strength = 20.1).starts_with("tensile_strength: 20.1 kPa"));
    assert!(
        refusal(|p| (p.friction_angle, p.cohesion) = (0.0, 0.0)).starts_with("cohesion: 0 kPa")
    );
}

#[test]
fn an_overflow_is_a_failure() {
    let law = law(handy(None));
    let point = rested([0.0; 4], [1e305, -1e305, 0.0, 0.0]);
    assert!(law.update(&point, Tangent::None).is_err());
}
