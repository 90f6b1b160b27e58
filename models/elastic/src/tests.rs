//! Hooke's law against closed forms of laboratory tests.

use crate::{Elastic, Parameters};
use abi::{ContinuumLaw as _, SolidPoint, SolidResponse, Tangent};
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
