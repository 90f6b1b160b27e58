//! The return against an independent solution: all nine planes of the surface, in principal
//! stresses of any order, and every set of up to three active ones. A stress solves the problem
//! if σ = σ\* − D Σ λᵢ mᵢ with λᵢ ≥ 0, active fᵢ = 0 and all f ≤ 0 (Karush, Kuhn, Tucker).

use super::{Pyramid, Random, Returned, Zone, law};
use crate::{MohrCoulomb, Parameters};
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use std::collections::HashMap;

struct Plane {
    normal: Vector3<f64>,
    flow: Vector3<f64>,
    bound: f64,
}

fn planes(p: &Parameters) -> Vec<Plane> {
    let (phi, psi) = (
        p.friction_angle.to_radians(),
        p.dilatancy_angle.to_radians(),
    );
    let mut planes = vec![];
    for i in 0..3 {
        for j in (0..3).filter(|j| *j != i) {
            let face = |angle: f64| {
                let mut n = Vector3::zeros();
                (n[i], n[j]) = (1.0 + angle.sin(), angle.sin() - 1.0);
                n
            };
            planes.push(Plane {
                normal: face(phi),
                flow: face(psi),
                bound: 2.0 * p.cohesion * phi.cos(),
            });
        }
        if !p.tensile_strength.is_nan() {
            let n = Vector3::ith(i, 1.0);
            planes.push(Plane {
                normal: n,
                flow: n,
                bound: p.tensile_strength,
            });
        }
    }
    planes
}

/// Every stress that satisfies the conditions.
fn solutions(p: &Parameters, trial: &Vector3<f64>) -> Vec<Vector3<f64>> {
    let nu = p.poisson_ratio;
    // The elastic operator over 2G; multipliers only need their sign.
    let d = Matrix3::identity() + Matrix3::from_element(nu / (1.0 - 2.0 * nu));
    let planes = planes(p);
    let tolerance = 1e-9 * trial.amax().max(p.cohesion);
    let mut found = vec![];
    let n = planes.len();
    for set in (0..1_usize << n).filter(|set| (1..=3).contains(&set.count_ones())) {
        let active: Vec<&Plane> = (0..n)
            .filter(|i| set >> i & 1 == 1)
            .map(|i| &planes[i])
            .collect();
        let m = active.len();
        let matrix = DMatrix::from_fn(m, m, |i, j| active[i].normal.dot(&(d * active[j].flow)));
        let f = DVector::from_fn(m, |i, _| active[i].normal.dot(trial) - active[i].bound);
        if matrix.determinant().abs() < 1e-9 {
            continue;
        }
        let Some(multipliers) = matrix.lu().solve(&f) else {
            continue;
        };
        let mut end = *trial;
        for (plane, multiplier) in active.iter().zip(&multipliers) {
            end -= d * plane.flow * *multiplier;
        }
        if multipliers.iter().all(|l| *l >= -tolerance)
            && planes
                .iter()
                .all(|q| q.normal.dot(&end) <= q.bound + tolerance)
        {
            found.push(end);
        }
    }
    found
}

fn parameters(random: &mut Random) -> Parameters {
    random.parameters(&[0.0, 1.0, 10.0, 30.0, 45.0, 60.0], 1.0)
}

fn sorted(mut s: [f64; 3]) -> Vector3<f64> {
    s.sort_by(|a, b| b.total_cmp(a));
    s.into()
}

fn returned(law: &MohrCoulomb, trial: &Vector3<f64>) -> Option<Returned> {
    let pyramid: &Pyramid = &law.pyramid;
    (!pyramid.admits(trial[0], trial[2])).then(|| pyramid.return_stress(trial))
}

#[test]
fn satisfies_the_conditions_and_no_other_stress_does() {
    let mut random = Random(1);
    let mut zones = HashMap::new();
    for _ in 0..20_000 {
        let p = parameters(&mut random);
        let trial = sorted(random.principal(1.0));
        let Some(end) = returned(&law(p), &trial) else {
            continue;
        };
        *zones.entry(format!("{:?}", end.zone)).or_insert(0) += 1;
        let solutions = solutions(&p, &trial);
        if solutions.is_empty() {
            // Without dilatancy no flow leads to the apex; its zone is what no other reaches.
            assert_eq!(end.zone, Zone::Apex, "{p:?} {trial}");
            assert!(p.dilatancy_angle <= 0.0 && trial.sum() >= end.stress.sum());
        }
        for solution in solutions {
            let off = (solution - end.stress).amax();
            // Determinants down to 1e-9 are solved: the reference has lost up to nine digits.
            assert!(
                off < 1e-6 * trial.amax().max(1.0),
                "{p:?} {trial} {end:?} {solution}"
            );
        }
    }
    assert_eq!(zones.len(), 10, "{zones:?}");
    assert!(zones.values().all(|count| *count > 50), "{zones:?}");
}

/// ψ = φ: (σ\* − σ) : D⁻¹ (τ − σ) ≤ 0 for every admissible τ, so σ is the closest point in energy
/// and, for τ = 0, the dissipation is not negative.
#[test]
fn associated_flow_finds_the_closest_point() {
    let mut random = Random(2);
    for _ in 0..2_000 {
        let mut p = parameters(&mut random);
        p.dilatancy_angle = p.friction_angle;
        let law = law(p);
        let nu = p.poisson_ratio;
        let compliance = Matrix3::identity() * (1.0 + nu) - Matrix3::from_element(nu);
        let trial = sorted(random.principal(1.0));
        let Some(end) = returned(&law, &trial) else {
            continue;
        };
        let plastic_strain = compliance * (trial - end.stress);
        let scale = trial.amax().max(p.cohesion).powi(2);
        assert!(plastic_strain.dot(&end.stress) >= -1e-13 * scale);
        for _ in 0..50 {
            let other = Vector3::from(random.principal(1.0));
            if law.pyramid.admits(other.max(), other.min()) {
                let scale = scale.max(other.amax().powi(2));
                assert!(plastic_strain.dot(&(other - end.stress)) <= 1e-13 * scale);
            }
        }
    }
}
