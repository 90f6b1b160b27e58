//! Hooke's law against closed forms of laboratory tests.

use crate::{Elastic, Parameters};
use abi::{ContinuumLaw as _, Parameters as _, SolidPoint, SolidResponse, Tangent};
use approx::assert_relative_eq;

fn law(young_modulus: f64, poisson_ratio: f64) -> Elastic {
    Elastic::new(Parameters {
        young_modulus,
        poisson_ratio,
    })
    .unwrap()
}

fn response<const N: usize>(
    law: &Elastic,
    stress: [f64; N],
    strain_increment: [f64; N],
) -> SolidResponse<N, ()> {
    let point = SolidPoint {
        strain: [0.0; N],
        strain_increment,
        stress,
        state: (),
        time: 0.0,
        time_increment: 1.0,
        step_time: 0.0,
    };
    law.update(&point, Tangent::Consistent).unwrap()
}

/// Uniaxial stress: ε = (1, −ν, −ν) σ/E.
#[test]
fn stretches_under_uniaxial_stress() {
    for nu in [-0.5, 0.0, 0.3, 0.499] {
        let law = law(2e5, nu);
        let strain = [-nu * 1e-3, 1e-3, -nu * 1e-3, 0.0];
        let end = response(&law, [0.0; 4], strain);
        for (stress, expected) in end.stress.into_iter().zip([0.0, 200.0, 0.0, 0.0]) {
            assert_relative_eq!(stress, expected, epsilon = 1e-10);
        }
    }
}

/// Oedometer: σ₂₂ = M ε, M = E(1 − ν)/((1 + ν)(1 − 2ν)), the others ν/(1 − ν) of it.
#[test]
fn presses_sideways_in_the_oedometer() {
    let (e, nu) = (3e4, 0.3);
    let axial = e * (1.0 - nu) / ((1.0 + nu) * (1.0 - 2.0 * nu)) * -1e-3;
    let end = response(&law(e, nu), [0.0; 4], [0.0, -1e-3, 0.0, 0.0]);
    assert_relative_eq!(end.stress[1], axial, max_relative = 1e-14);
    assert_relative_eq!(end.stress[0], axial * nu / (1.0 - nu), max_relative = 1e-14);
    assert_relative_eq!(end.stress[2], axial * nu / (1.0 - nu), max_relative = 1e-14);
}

/// Shear strains are engineering strains: τ = Gγ, each component alone.
#[test]
fn shears_component_by_component() {
    let law = law(25e3, 0.25);
    let end = response(&law, [0.0; 6], [0.0, 0.0, 0.0, 1e-3, 2e-3, 3e-3]);
    for (stress, expected) in end
        .stress
        .into_iter()
        .zip([0.0, 0.0, 0.0, 10.0, 20.0, 30.0])
    {
        assert_relative_eq!(stress, expected, max_relative = 1e-14);
    }
}

#[test]
fn keeps_the_stress_carried_in() {
    let stress = [-100.0, -50.0, -70.0, 5.0];
    let law = law(1e5, 0.2);
    let added = response(&law, [0.0; 4], [1e-3, 2e-3, -1e-3, 4e-3]).stress;
    let end = response(&law, stress, [1e-3, 2e-3, -1e-3, 4e-3]).stress;
    for i in 0..4 {
        assert_relative_eq!(end[i], stress[i] + added[i], max_relative = 1e-14);
    }
    let unchanged = response(&law, stress, [0.0; 4]).stress;
    assert!(
        unchanged
            .iter()
            .zip(&stress)
            .all(|(a, b)| a.to_bits() == b.to_bits())
    );
}

/// The law is linear: its tangent times any increment is the stress increment.
#[test]
fn tangent_times_strain_is_stress() {
    let strain = [1e-3, -2e-3, 5e-4, 3e-3, -1e-3, 2e-3];
    let end = response(&law(7e4, 0.35), [0.0; 6], strain);
    for i in 0..6 {
        let stress: f64 = (0..6).map(|j| end.tangent[i][j] * strain[j]).sum();
        assert_relative_eq!(stress, end.stress[i], max_relative = 1e-13);
        for j in 0..6 {
            assert_relative_eq!(end.tangent[i][j], end.tangent[j][i]);
        }
    }
}

#[test]
fn reads_its_parameters_in_the_declared_order() {
    let p = Parameters::read(&[2e5, 0.3]);
    assert_relative_eq!(p.young_modulus, 2e5);
    assert_relative_eq!(p.poisson_ratio, 0.3);
    assert_eq!(Parameters::TABLE.len(), 2);
}
