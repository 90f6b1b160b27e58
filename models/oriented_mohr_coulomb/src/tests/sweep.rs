//! Random states over all angles and scales: conditions of the solution, tangent, closest point.

use super::{distance, from_trial, law, rested, tangent_error};
use crate::Parameters;
use crate::return_mapping::Zone;
use walk::Random;

fn parameters(random: &mut Random, scale: f64) -> Parameters {
    let friction_angle: f64 = random.one_of(&[0.0, 1e-6, 1.0, 20.0, 45.0, 70.0, 89.9, 89.999_999]);
    let cohesion = if friction_angle > 0.0 {
        random.one_of(&[0.0, 0.3, 1.0])
    } else {
        1.0
    };
    let apex = cohesion / friction_angle.to_radians().tan();
    let share = random.one_of(&[f64::NAN, f64::NAN, 0.0, 0.3, 0.9, 1.0]);
    Parameters {
        young_modulus: 10_f64.powf(random.between(0.0, 9.0)),
        poisson_ratio: random.one_of(&[-0.9, 0.0, 0.2, 0.35, 0.499]),
        cohesion: cohesion * scale,
        friction_angle,
        dilatancy_angle: friction_angle * random.one_of(&[0.0, 0.4, 1.0]),
        tensile_strength: share * apex.min(3.0) * scale,
    }
}

fn stress(random: &mut Random, scale: f64) -> [f64; 4] {
    std::array::from_fn(|_| random.between(-4.0, 4.0) * scale)
}

/// Sine and cosine of an angle in degrees, the cosine without cancellation near 90°.
fn sin_cos(degrees: f64) -> (f64, f64) {
    (
        degrees.to_radians().sin(),
        (90.0 - degrees).to_radians().sin(),
    )
}

/// The stress is admissible and stays, and the plastic strain is a sum of non-negative multiples
/// of the flow of the active bounds, in 22 and 12 only (Karush, Kuhn, Tucker).
#[test]
fn satisfies_the_conditions_at_all_angles_and_scales() {
    let mut random = Random(1);
    let mut counts = [0; 4];
    for _ in 0..50_000 {
        let scale = 10_f64.powf(random.between(-6.0, 6.0));
        let p = parameters(&mut random, scale);
        let law = law(p);
        let factor = random.one_of(&[0.3, 1.0, 1e3, 1e6]) * scale;
        let trial = stress(&mut random, factor);
        let end = from_trial(&law, trial);
        let context = format!("{p:?} {trial:?} {end:?}");
        assert!(
            end.tangent.iter().flatten().all(|t| t.is_finite()),
            "{context}"
        );

        // Admissible, the yield function scaled by cos φ as in the plane of n and t.
        let [_, n, _, t] = end.stress;
        let (sin, cos) = sin_cos(p.friction_angle);
        let f = t.abs() * cos + n * sin - p.cohesion * cos;
        let size = t.abs().max(n.abs()).max(p.cohesion * cos);
        assert!(f <= 1e-12 * size, "{context}");
        // The strength may be c cot φ, which has its own rounding.
        let strength = p.tensile_strength * (1.0 + 1e-12);
        assert!(strength.is_nan() || n <= strength, "{context}");
        assert_eq!(from_trial(&law, end.stress).stress, end.stress, "{context}");

        // Where it does not move, it is admissible from the start.
        if end.state == rested(trial, [0.0; 4]).state {
            assert!(distance(&end.stress, &trial) <= 1e-15 * factor, "{context}");
            continue;
        }
        let zone = law.facet.return_stress(trial[1], trial[3]).zone;
        counts[zone as usize] += 1;
        let (m, g) = (law.oedometric, law.shear_modulus);
        let (opening, slip) = ((trial[1] - n) / m, (trial[3] - t) / g);
        for i in [0, 2] {
            let elastic = trial[i] - law.lambda * opening;
            assert!(
                (end.stress[i] - elastic).abs() <= 1e-14 * 4.0 * factor,
                "{context}"
            );
        }
        let (sin_psi, cos_psi) = sin_cos(p.dilatancy_angle);
        let tan_psi = sin_psi / cos_psi;
        let tension = opening - slip.abs() * tan_psi;
        // Rounding of the trial stress over the moduli.
        let rounding = 1e-12 * factor * (1.0 / m + tan_psi / g);
        assert!(slip * trial[3] >= 0.0, "{context}");
        match zone {
            Zone::Face => assert!(tension.abs() <= rounding, "{context}"),
            Zone::Corner | Zone::Tension | Zone::Apex => {
                assert!(tension >= -rounding, "{context}");
            }
        }
        let on_line = f.abs() <= 1e-12 * size;
        assert!(on_line || zone == Zone::Tension, "{context}");
    }
    assert!(counts.iter().all(|count| *count > 500), "{counts:?}");
}

#[test]
fn tangent_agrees_with_differences_over_random_states() {
    let mut random = Random(2);
    let mut compared = 0;
    for _ in 0..20_000 {
        let p = parameters(&mut random, 1.0);
        let trial = stress(&mut random, 1.0);
        // Probe 1e-6, rounding 1e-15: 1e-9. Near 90° and without dilatancy ∂t/∂n* is tan φ.
        let amplification = p.friction_angle.to_radians().tan().max(1.0);
        if let Some(worst) = tangent_error(&law(p), trial, 1e-6) {
            assert!(worst < 1e-8 * amplification, "{p:?} {trial:?} {worst}");
            compared += 1;
        }
    }
    assert!(compared > 15_000, "{compared}");
}

/// ψ = φ: (σ* − σ) D⁻¹ (τ − σ) ≤ 0 for every admissible τ in the facet, so the end is the closest
/// point in energy and, for τ = 0, the dissipation is not negative.
#[test]
fn associated_flow_finds_the_closest_point() {
    let mut random = Random(3);
    for _ in 0..5_000 {
        let mut p = parameters(&mut random, 1.0);
        p.dilatancy_angle = p.friction_angle;
        let law = law(p);
        let trial = stress(&mut random, 1.0);
        let end = from_trial(&law, trial).stress;
        let opening = (trial[1] - end[1]) / law.oedometric;
        let slip = (trial[3] - end[3]) / law.shear_modulus;
        let rounding = 1e-13 / law.oedometric.min(law.shear_modulus);
        assert!(opening * end[1] + slip * end[3] >= -rounding);
        for _ in 0..20 {
            let [_, n, _, t] = stress(&mut random, 1.0);
            if law.facet.admits(n, t) {
                assert!(opening * (n - end[1]) + slip * (t - end[3]) <= rounding);
            }
        }
    }
}
