//! Stiffness at small strains.

use super::Lead::{Strain, Stress};
use super::{DENSE, Path};
use crate::HardeningSoilSmall;
use crate::small_law::SmallParameters;
use crate::soil::SoilParameters;
use abi::{ContinuumLaw as _, Tangent};
use approx::assert_relative_eq;

const G_0: f64 = 110e3;
const GAMMA_07: f64 = 1.5e-4;

fn law(soil: SoilParameters) -> HardeningSoilSmall {
    let p = SmallParameters {
        soil,
        g_0_ref: G_0,
        gamma_07: GAMMA_07,
    };
    HardeningSoilSmall::new(p).unwrap()
}

/// A soil that stays elastic: stiffness without stress, and a shear surface and a cap far away.
fn elastic(law: &HardeningSoilSmall) -> Path<'_, HardeningSoilSmall> {
    let mut path = Path::new(law, [200.0; 3]);
    path.state.gamma_ps = 10.0;
    path.state.p_p = 1e6;
    path
}

const CONSTANT: SoilParameters = SoilParameters { m: 0.0, ..DENSE };

/// Constant volume, to ε_a − ε_r = γ.
fn shear(gamma: f64) -> [super::Lead; 3] {
    [
        Strain(gamma / 1.5),
        Strain(-gamma / 3.0),
        Strain(-gamma / 3.0),
    ]
}

#[test]
fn the_secant_at_gamma_07_is_0_722_of_the_initial() {
    let law = law(CONSTANT);
    for increments in [1, 7, 50] {
        let mut path = elastic(&law);
        path.go(shear(GAMMA_07), increments);
        let q = path.stress[0] - path.stress[2];
        assert_relative_eq!(q / (2.0 * GAMMA_07) / G_0, 1.0 / 1.385, max_relative = 1e-9);
    }
    // In simple shear γ_hist is √3/2 of the engineering strain.
    let path = elastic(&law);
    let gamma = 2.0 / 3.0_f64.sqrt() * GAMMA_07;
    let end = path
        .try_update(&[0.0, 0.0, 0.0, gamma, 0.0, 0.0], Tangent::None)
        .unwrap();
    assert_relative_eq!(
        -end.stress[3] / gamma / G_0,
        1.0 / 1.385,
        max_relative = 1e-9
    );
}

/// Far strains are those of unloading: the secant from the end of the decay is G_ur.
#[test]
fn the_decay_ends_at_the_modulus_of_unloading() {
    let law = law(CONSTANT);
    let G_ur = DENSE.e_ur_ref / (2.0 * (1.0 + DENSE.nu_ur));
    let end = GAMMA_07 / 0.385 * ((G_0 / G_ur).sqrt() - 1.0);
    let mut path = elastic(&law);
    path.go(shear(end), 3);
    let before = path.stress[0] - path.stress[2];
    path.go(shear(1e-4), 2);
    let change = path.stress[0] - path.stress[2] - before;
    assert_relative_eq!(change / 2e-4, G_ur, max_relative = 1e-9);
}

/// Masing: the branches of a symmetric loop close, and begin with G₀; p_p and γ_ps stay.
#[test]
fn a_reversal_restores_the_stiffness_and_loops_close() {
    let law = law(CONSTANT);
    let mut path = elastic(&law);
    path.go(shear(GAMMA_07), 5);
    let top = path.stress[0] - path.stress[2];
    path.go(shear(-1e-9), 1);
    let little = top - (path.stress[0] - path.stress[2]);
    assert_relative_eq!(little / 2e-9, G_0, max_relative = 1e-4);
    path.go(shear(1e-9 - 2.0 * GAMMA_07), 10);
    assert_relative_eq!(path.stress[0] - path.stress[2], -top, max_relative = 1e-4);
    path.go(shear(2.0 * GAMMA_07), 10);
    assert_relative_eq!(path.stress[0] - path.stress[2], top, max_relative = 1e-4);
    assert_relative_eq!(path.state.gamma_ps, 10.0);
    assert_relative_eq!(path.state.p_p, 1e6);
}

#[test]
fn the_secant_at_half_the_strength_stays_e_50() {
    let law = law(SoilParameters { ocr: 20.0, ..DENSE });
    for (s3, bound) in [(50.0, 0.03), (100.0, 2e-3), (400.0_f64, 0.03)] {
        let mut path = Path::new(&law, [s3; 3]);
        let sin = DENSE.friction_angle.to_radians().sin();
        let q = s3 * sin / (1.0 - sin);
        path.go([Stress(q), Stress(0.0), Stress(0.0)], 200);
        let share = q / path.strain[0] / (DENSE.e_50_ref * (s3 / 100.0).powf(DENSE.m));
        println!("{s3} {share}");
        assert!((share - 1.0).abs() < bound, "{s3}: {share}");
    }
}

/// Where h of Eq. (27) would exceed the range of numbers, soil hardly flows at first.
#[test]
fn a_soil_far_stiffer_in_unloading_begins_elastically() {
    let parameters = SmallParameters {
        soil: SoilParameters {
            e_50_ref: 1.4e3,
            e_oed_ref: f64::NAN,
            e_ur_ref: 2.8e6,
            k_0_nc: 0.76,
            ..DENSE
        },
        g_0_ref: 7e6,
        gamma_07: 6e-4,
    };
    let law = HardeningSoilSmall::new(parameters).unwrap();
    let mut path = Path::new(&law, [100.0; 3]);
    path.state.p_p = 1e6;
    let increment = [1e-7, -5e-8, -5e-8, 0.0, 0.0, 0.0];
    let end = path.try_update(&increment, Tangent::None).unwrap();
    let q = end.stress[1] - end.stress[0];
    // Elastic shear, less the γ_ps of (3) over h: 2q/E_i over 10⁶ is 1.1 % of the strain.
    let plastic = 1.0 - q / (2.0 * 7e6 * 1.5e-7);
    assert!((plastic - 0.011).abs() < 2e-3, "{plastic}");
}

#[test]
fn tangents_are_differences() {
    let law = law(DENSE);
    for s in [[100.0, 100.0, 100.0], [150.0, 100.0, 80.0]] {
        let mut path = Path::new(&law, s);
        let first = [1e-4, -3e-5, -4e-5, 2e-5, 1e-5, 3e-5];
        let end = path.try_update(&first, Tangent::None).unwrap();
        path.accept(&first, &end);
        for increment in [
            [1e-4, -3e-5, -2e-5, 2e-5, 3e-5, 1e-5],
            [-1e-4, 3e-5, 5e-5, 2e-5, -3e-5, 1e-5],
            [1e-3, -2e-4, -3e-4, 1e-4, 2e-4, 3e-4],
        ] {
            let end = path.try_update(&increment, Tangent::Consistent).unwrap();
            let stiffness = path
                .try_update(&increment, Tangent::Elastic)
                .unwrap()
                .tangent[0][0];
            let differences = abi::differences::tangent(&increment, 1e-4, |moved| {
                Ok(path.try_update(moved, Tangent::None)?.stress.map(|s| -s))
            })
            .unwrap();
            for i in 0..6 {
                for j in 0..6 {
                    let off = (end.tangent[i][j] - differences[i][j]).abs() / stiffness;
                    assert!(off < 1e-6, "{s:?} {increment:?} {i} {j} {off:e}");
                }
            }
        }
    }
}

#[test]
fn an_initial_modulus_below_that_of_unloading_is_refused() {
    let p = SmallParameters {
        soil: DENSE,
        g_0_ref: 30e3,
        gamma_07: GAMMA_07,
    };
    let message = HardeningSoilSmall::new(p).unwrap_err().to_string();
    assert!(
        message.starts_with("g_0_ref: 30000 kPa is below G_ur"),
        "{message}"
    );
}
