//! What the law is known for, by closed forms.

use super::Lead::{Strain, Stress};
use super::{CLAY, DENSE, Path, law};
use crate::HardeningSoil;
use crate::soil::SoilParameters;
use abi::{ContinuumLaw as _, Tangent};
use approx::assert_relative_eq;

const FREE: super::Lead = Stress(0.0);

/// q_f of a minor stress.
fn strength(p: &SoilParameters, s3: f64) -> f64 {
    let phi = p.friction_angle.to_radians();
    (s3 + p.cohesion / phi.tan()) * 2.0 * phi.sin() / (1.0 - phi.sin())
}

/// (σ + c cot φ)/(p_ref + c cot φ) to the power m.
fn scale(p: &SoilParameters, s: f64) -> f64 {
    let apex = p.cohesion / p.friction_angle.to_radians().tan();
    ((s + apex) / (p.p_ref + apex)).powf(p.m)
}

fn overconsolidated(p: SoilParameters) -> SoilParameters {
    SoilParameters { ocr: 20.0, ..p }
}

/// To half the strength, which is below the onset of dilatancy if sin φ ≤ 2/3.
#[test]
fn the_secant_at_half_the_strength_is_e_50() {
    let sand = SoilParameters {
        friction_angle: 40.0,
        dilatancy_angle: 10.0,
        ..DENSE
    };
    for p in [
        sand,
        CLAY,
        SoilParameters { m: 0.0, ..sand },
        SoilParameters { m: 1.0, ..CLAY },
    ] {
        let law = law(overconsolidated(p));
        for s3 in [25.0, 100.0, 400.0] {
            let mut path = Path::new(&law, [s3; 3]);
            let q = 0.5 * strength(&p, s3);
            path.go([Stress(q), FREE, FREE], 20);
            let secant = q / path.strain[0];
            assert_relative_eq!(secant, p.e_50_ref * scale(&p, s3), max_relative = 1e-9);
        }
    }
}

/// Dense and loose Hostun sand, and the clay of a building pit, as the literature gives them.
const HOSTUN_DENSE: SoilParameters = SoilParameters {
    e_50_ref: 37e3,
    e_oed_ref: 29.6e3,
    m: 0.5,
    nu_ur: 0.2,
    friction_angle: 41.0,
    dilatancy_angle: 14.0,
    k_0_nc: 0.34,
    ..DENSE
};
const HOSTUN_LOOSE: SoilParameters = SoilParameters {
    e_50_ref: 20e3,
    e_oed_ref: 16e3,
    e_ur_ref: 60e3,
    m: 0.65,
    friction_angle: 34.0,
    dilatancy_angle: 0.0,
    k_0_nc: 0.44,
    ..HOSTUN_DENSE
};
const PIT_CLAY: SoilParameters = SoilParameters {
    e_50_ref: 4e3,
    e_oed_ref: 3.3e3,
    e_ur_ref: 12e3,
    m: 1.0,
    nu_ur: 0.15,
    cohesion: 1.0,
    friction_angle: 25.0,
    dilatancy_angle: 0.0,
    k_0_nc: 0.5774,
    ..DENSE
};

/// The cap lowers the secant of a normally consolidated soil; the shares are those of an explicit integration of the
/// rate equations that shares no code with the law.
#[test]
fn the_cap_lowers_the_secant_of_normal_consolidation() {
    for (p, expected) in [
        (HOSTUN_DENSE, 0.8956),
        (HOSTUN_LOOSE, 0.8199),
        (PIT_CLAY, 0.7377),
    ] {
        let law = law(p);
        let mut path = Path::new(&law, [100.0; 3]);
        let q = 0.5 * strength(&p, 100.0);
        path.go([Stress(q), FREE, FREE], 100);
        let share = q / path.strain[0] / (p.e_50_ref * scale(&p, 100.0));
        assert_relative_eq!(share, expected, epsilon = 1e-3);
    }
}

#[test]
fn failure_is_at_the_strength_and_dilates_by_psi() {
    for p in [overconsolidated(DENSE), DENSE, overconsolidated(CLAY)] {
        let law = law(p);
        let sin_psi = p.dilatancy_angle.to_radians().sin();
        for s3 in [10.0, 100.0, 400.0] {
            let mut path = Path::new(&law, [s3; 3]);
            path.go([Strain(0.6), FREE, FREE], 60);
            let q = path.stress[0] - path.stress[2];
            assert_relative_eq!(q, strength(&p, path.stress[2]), max_relative = 1e-12);
            let before = path.clone();
            path.go([Strain(0.01), FREE, FREE], 1);
            let volume: f64 = (0..3).map(|i| path.strain[i] - before.strain[i]).sum();
            assert_relative_eq!(
                volume / 0.01,
                -2.0 * sin_psi / (1.0 - sin_psi),
                epsilon = 1e-9,
                max_relative = 1e-9
            );
        }
    }
}

/// From 50 to 400 kPa on the K₀ line, without cohesion: σ₁ = K₀⁻¹ σ₃, and the strain is ∫ dσ₁/E_oed.
#[test]
fn the_oedometer_keeps_its_lateral_stress_and_stiffness() {
    for (p, increments) in [
        (DENSE, 50),
        (DENSE, 400),
        (
            SoilParameters {
                cohesion: 0.0,
                ..CLAY
            },
            200,
        ),
        (SoilParameters { m: 0.0, ..DENSE }, 200),
        (SoilParameters { m: 1.0, ..DENSE }, 200),
        (
            SoilParameters {
                e_50_ref: 12e3,
                e_oed_ref: 16e3,
                e_ur_ref: 60e3,
                k_0_nc: 0.5,
                ..DENSE
            },
            200,
        ),
    ] {
        let law = law(p);
        let (start, end) = (50.0, 400.0);
        let lateral = p.k_0_nc * start;
        let mut path = Path::new(&law, [start, lateral, lateral]);
        let mut before = (start, 0.0);
        for _ in 0..increments {
            path.go(
                [
                    Stress((end - start) / f64::from(increments)),
                    Strain(0.0),
                    Strain(0.0),
                ],
                1,
            );
            assert_relative_eq!(
                path.stress[2] / path.stress[0],
                p.k_0_nc,
                max_relative = 1e-3
            );
            let now = (path.stress[0], path.strain[0]);
            let tangent = (now.0 - before.0) / (now.1 - before.1);
            let middle = 0.5 * (now.0 + before.0);
            assert_relative_eq!(
                tangent,
                p.e_oed_ref * scale(&p, middle),
                max_relative = 2e-3
            );
            before = now;
        }
        let integral = if p.m < 1.0 {
            let power = |x: f64| (x / p.p_ref).powf(1.0 - p.m);
            p.p_ref / p.e_oed_ref * (power(end) - power(start)) / (1.0 - p.m)
        } else {
            p.p_ref / p.e_oed_ref * (end / start).ln()
        };
        assert_relative_eq!(path.strain[0], integral, max_relative = 1e-3);
    }
}

#[test]
fn unloading_follows_e_ur_and_loops_close() {
    let law = law(overconsolidated(DENSE));
    let mut path = Path::new(&law, [100.0; 3]);
    path.go([Stress(250.0), FREE, FREE], 10);
    let top = path.clone();
    for _ in 0..3 {
        path.go([Stress(-200.0), FREE, FREE], 7);
        let secant = -200.0 / (path.strain[0] - top.strain[0]);
        assert_relative_eq!(secant, DENSE.e_ur_ref, max_relative = 1e-9);
        path.go([Stress(200.0), FREE, FREE], 7);
        assert_relative_eq!(path.strain[0], top.strain[0], max_relative = 1e-9);
        assert_relative_eq!(path.state.gamma_ps, top.state.gamma_ps, max_relative = 1e-9);
        assert_relative_eq!(path.state.p_p, top.state.p_p, max_relative = 1e-9);
    }
}

/// The path to the apex of a cohesive soil, and to its tensile strength.
#[test]
fn stretching_ends_at_the_apex_or_the_tensile_strength() {
    let apex = CLAY.cohesion / CLAY.friction_angle.to_radians().tan();
    for (tensile_strength, end) in [(f64::NAN, apex), (2.0, 2.0), (0.0, 0.0)] {
        let law = law(SoilParameters {
            tensile_strength,
            ..CLAY
        });
        let mut path = Path::new(&law, [50.0, 40.0, 30.0]);
        path.go([Strain(-0.2), Strain(-0.24), Strain(-0.3)], 20);
        for i in 0..3 {
            assert_relative_eq!(path.stress[i], -end, epsilon = 1e-9);
        }
        // Tension under a lateral stress of 1 kPa ends at the cut-off or at the strength.
        let mut path = Path::new(&law, [20.0; 3]);
        path.go([Stress(-19.0); 3], 10);
        path.go([Strain(-0.3), FREE, FREE], 30);
        let sin = CLAY.friction_angle.to_radians().sin();
        let k = 2.0 * sin / (1.0 - sin);
        let expected = ((1.0 - apex * k) / (1.0 + k)).max(-end);
        assert_relative_eq!(path.stress[0], expected, epsilon = 1e-6);
    }
}

#[test]
fn the_initial_state_follows_ocr_and_pop() {
    let base = law(DENSE);
    let (M, k_0) = (base.soil.cap.M, DENSE.k_0_nc);
    let on_line = |s1: f64| {
        let (q, p) = (s1 * (1.0 - k_0), s1 * (1.0 + 2.0 * k_0) / 3.0);
        ((q / M).powi(2) + p * p).sqrt()
    };
    let at =
        |p: SoilParameters, s: [f64; 3]| law(p).initial_state(&[-s[1], -s[0], -s[2], 0.0]).unwrap();
    let rest = [200.0, 80.0, 80.0];
    assert_relative_eq!(at(DENSE, rest).p_p, on_line(200.0), max_relative = 1e-12);
    let ocr = SoilParameters { ocr: 3.0, ..DENSE };
    assert_relative_eq!(at(ocr, rest).p_p, on_line(600.0), max_relative = 1e-12);
    let pop = SoilParameters { pop: 50.0, ..DENSE };
    assert_relative_eq!(at(pop, rest).p_p, on_line(250.0), max_relative = 1e-12);
    // A stress beyond the cap of its own consolidation enlarges the cap.
    assert_relative_eq!(at(DENSE, [100.0; 3]).p_p, 100.0, max_relative = 1e-12);
    // γ_ps is that of the shear surface through the stress, by Eq. (3) in its own words.
    let (q, e_i) = (120.0, 2.0 * DENSE.e_50_ref / (2.0 - DENSE.r_f));
    let q_a = strength(&DENSE, 80.0) / DENSE.r_f;
    let gamma = (2.0 / e_i * q / (1.0 - q / q_a) - 2.0 * q / DENSE.e_ur_ref) / scale(&DENSE, 80.0);
    assert_relative_eq!(at(DENSE, rest).gamma_ps, gamma, max_relative = 1e-12);
}

fn refusal(p: SoilParameters) -> String {
    <HardeningSoil as abi::ContinuumLaw>::new(p)
        .unwrap_err()
        .to_string()
}

#[test]
fn refusals_name_the_range() {
    let message = refusal(SoilParameters {
        e_ur_ref: 50e3,
        ..DENSE
    });
    assert!(
        message.starts_with("e_ur_ref: 50000 kPa must exceed"),
        "{message}"
    );
    assert!(message.contains("54545"), "{message}");
    let message = refusal(SoilParameters {
        k_0_nc: 0.25,
        ..DENSE
    });
    assert!(
        message.starts_with("k_0_nc: 0.25 is outside 0.3"),
        "{message}"
    );
    // A dense sand of which only E_50 and angles are known, and the two ways out that the message names.
    let dense = SoilParameters {
        e_oed_ref: f64::NAN,
        e_ur_ref: f64::NAN,
        m: 0.5,
        nu_ur: 0.2,
        dilatancy_angle: 14.0,
        k_0_nc: f64::NAN,
        ..DENSE
    };
    let message = refusal(dense);
    for part in [
        "k_0_nc: 0.33",
        "1 - sin φ",
        "outside 0.3386 to",
        "e_oed_ref",
    ] {
        assert!(message.contains(part), "{message}");
    }
    law(SoilParameters {
        k_0_nc: 0.339,
        ..dense
    });
    law(SoilParameters {
        e_oed_ref: 28.5e3,
        ..dense
    });
    assert!(
        refusal(SoilParameters {
            substeps: 1.5,
            ..DENSE
        })
        .starts_with("substeps: 1.5")
    );
}

#[test]
fn parameters_left_out_follow_others() {
    let given = law(SoilParameters {
        e_oed_ref: 30e3,
        e_ur_ref: 90e3,
        k_0_nc: 0.5,
        friction_angle: 30.0,
        dilatancy_angle: 0.0,
        ..DENSE
    });
    let left_out = law(SoilParameters {
        e_oed_ref: f64::NAN,
        e_ur_ref: f64::NAN,
        k_0_nc: f64::NAN,
        friction_angle: 30.0,
        dilatancy_angle: 0.0,
        ..DENSE
    });
    assert_relative_eq!(given.soil.cap.M, left_out.soil.cap.M, max_relative = 1e-14);
    assert_relative_eq!(given.soil.cap.H, left_out.soil.cap.H, max_relative = 1e-14);
}

/// The same in plane strain components as in space, and in turned axes.
#[test]
fn axes_do_not_matter() {
    let law = law(DENSE);
    let (c, s) = (0.6, 0.8);
    let turn = |t: [f64; 3]| {
        let [xx, yy, xy] = t;
        [
            c * c * xx + s * s * yy - 2.0 * c * s * xy,
            s * s * xx + c * c * yy + 2.0 * c * s * xy,
            c * s * (xx - yy) + (c * c - s * s) * xy,
        ]
    };
    let mut straight = Path::new(&law, [100.0, 70.0, 60.0]);
    let increment = [1e-3, -4e-4, -2e-4, 5e-4, 0.0, 0.0];
    let [xx, yy, xy] = turn([100.0, 60.0, 0.0]);
    let mut turned = straight.clone();
    turned.stress = [xx, 70.0, yy, 0.0, xy, 0.0];
    let [exx, eyy, exy] = turn([1e-3, -2e-4, 0.0]);
    let turned_increment = [exx, -4e-4, eyy, 5e-4 * c, 2.0 * exy, 5e-4 * s];
    for _ in 0..5 {
        let end = straight.try_update(&increment, Tangent::None).unwrap();
        straight.accept(&increment, &end);
        let end = turned.try_update(&turned_increment, Tangent::None).unwrap();
        turned.accept(&turned_increment, &end);
    }
    let [xx, yy, xy] = turn([straight.stress[0], straight.stress[2], straight.stress[4]]);
    assert_relative_eq!(xx, turned.stress[0], max_relative = 1e-10);
    assert_relative_eq!(yy, turned.stress[2], max_relative = 1e-10);
    assert_relative_eq!(xy, turned.stress[4], max_relative = 1e-9);
    assert_relative_eq!(straight.stress[1], turned.stress[1], max_relative = 1e-10);
    assert_relative_eq!(straight.state.p_p, turned.state.p_p, max_relative = 1e-10);
    assert_relative_eq!(
        straight.state.gamma_ps,
        turned.state.gamma_ps,
        max_relative = 1e-9
    );
}
