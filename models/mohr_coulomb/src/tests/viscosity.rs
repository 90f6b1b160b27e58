//! Overstress, Eqs. (17) and (18).

use super::{handy, law, rested};
use crate::{MohrCoulomb, Parameters};
use abi::{ContinuumLaw as _, SolidPoint, SolidResponse, Tangent};

/// s.
const TAU: f64 = 20.0;

/// Strains that end on a face, on both edges, at the apex, and turn the axes.
const STRAINS: [[f64; 6]; 5] = [
    [1e-3, 0.0, -2e-3, 4e-4, 0.0, 0.0],
    [1e-3, 1e-3, -4e-3, 0.0, 2e-4, 0.0],
    [2e-3, -2e-3, -2e-3, 0.0, 0.0, 3e-4],
    [2e-3, 2.1e-3, 1.9e-3, 1e-4, 0.0, 0.0],
    [0.0, 0.0, 0.0, 3e-3, 1e-3, 2e-3],
];

fn viscous(relaxation_time: f64) -> MohrCoulomb {
    law(Parameters {
        relaxation_time,
        dilatancy_angle: 10.0,
        ..handy(None)
    })
}

fn in_time(
    law: &MohrCoulomb,
    stress: [f64; 6],
    strain_increment: [f64; 6],
    time_increment: f64,
) -> SolidResponse<6, crate::State> {
    let point = SolidPoint {
        time_increment,
        ..rested(stress, strain_increment)
    };
    law.update(&point, Tangent::Consistent).unwrap()
}

/// At a held strain the overstress falls by 1 + Δt/τ a step, exactly, to what the law without
/// viscosity returns; in many steps that is the exponential of the rate equation.
#[test]
fn an_overstress_relaxes_exponentially() {
    let law = viscous(TAU);
    for strain in STRAINS {
        let rested = in_time(&viscous(0.0), [0.0; 6], strain, 1.0).stress;
        // Too short to relax.
        let start = in_time(&law, [0.0; 6], strain, 1e-12 * TAU).stress;
        let above: f64 = start.iter().zip(rested).map(|(a, b)| (a - b).abs()).sum();
        assert!(above > 5.0, "{above} kPa of overstress");
        let hold = |steps: u32, time: f64| {
            (0..steps).fold(start, |stress, _| {
                in_time(&law, stress, [0.0; 6], time / f64::from(steps)).stress
            })
        };
        for (steps, share, error) in [
            (1, 1.0 / 2.5, 1e-12),
            (7, (1.0 + 1.5 / 7.0_f64).powi(-7), 1e-12),
            (30_000, (-1.5_f64).exp(), 5e-5),
        ] {
            let end = hold(steps, 1.5 * TAU);
            for i in 0..6 {
                let expected = rested[i] + share * (start[i] - rested[i]);
                let off = (end[i] - expected).abs();
                assert!(off < error * above, "{steps} steps: {off}");
            }
        }
    }
}

#[test]
fn the_tangent_is_the_derivative() {
    let law = viscous(TAU);
    for strain in STRAINS {
        for time in [0.1, 20.0, 4e3] {
            let at = in_time(&law, [0.0; 6], strain, time);
            for j in 0..6 {
                let probed = |sign: f64| {
                    let mut strain = strain;
                    strain[j] += sign * 1e-9;
                    in_time(&law, [0.0; 6], strain, time).stress
                };
                let (ahead, behind) = (probed(1.0), probed(-1.0));
                for i in 0..6 {
                    let difference = (ahead[i] - behind[i]) / 2e-9;
                    let off = (at.tangent[i][j] - difference).abs();
                    // λ + 2G = 3e4 kPa.
                    assert!(off < 1e-6 * 3e4, "{i} {j}: {off}");
                }
            }
        }
    }
}

/// Plastic strain is the strain that elasticity does not explain: shear and volume, Eq. (13).
#[test]
fn the_plastic_strain_is_what_is_not_elastic() {
    let law = viscous(TAU);
    for strain in STRAINS {
        let end = in_time(&law, [0.0; 6], strain, 0.3 * TAU);
        let elastic = law.elasticity.trial_stress(&[0.0; 6], &strain);
        let volume: f64 = (0..3).map(|i| elastic[i] - end.stress[i]).sum();
        // Bulk modulus λ + 2G/3.
        let expected = volume / (3.0 * (1e4 + 2e4 / 3.0));
        let off = (end.state.plastic_dilation - expected).abs();
        assert!(off < 1e-15, "{off}");
    }
}

#[test]
fn no_overstress_outlives_a_long_time_and_none_is_the_default() {
    let without = viscous(0.0);
    assert_eq!(handy(None).relaxation_time, 0.0);
    for strain in STRAINS {
        let rested = in_time(&without, [0.0; 6], strain, 1.0);
        let long = in_time(&viscous(TAU), [0.0; 6], strain, 1e14 * TAU);
        let still = in_time(&viscous(TAU), [0.0; 6], strain, 0.0);
        let elastic = without.elasticity.trial_stress(&[0.0; 6], &strain);
        for i in 0..6 {
            assert!((long.stress[i] - rested.stress[i]).abs() < 1e-11);
            assert_eq!(still.stress[i], elastic[i], "at once it is elastic");
        }
    }
}
