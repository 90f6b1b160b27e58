//! Laws with random parameters.

use proptest::prelude::*;

/// Unit of a number: the power of the unit of stress.
type Power = f64;

#[derive(Clone, Debug)]
pub(super) struct Law {
    pub(super) id: &'static str,
    pub(super) hypothesis: &'static str,
    pub(super) parameters: Vec<(&'static str, f64, Power)>,
    /// Its stiffness, kPa (kPa/m).
    pub(super) modulus: f64,
}

/// E, ν, c, (φ, ψ), and the tensile strength as a part of c cot φ.
type Strength = (f64, f64, f64, (f64, f64), Option<f64>);

fn modulus() -> impl Strategy<Value = f64> {
    prop::sample::select(vec![1e3, 34e3, 2e6])
}

fn cohesion() -> impl Strategy<Value = f64> {
    prop_oneof![Just(0.0), Just(1.0), 1.0..60.0_f64]
}

/// Friction and dilatancy.
fn angles() -> impl Strategy<Value = (f64, f64)> {
    prop_oneof![
        1 => Just((0.0, 0.0)),
        3 => (5.0..45.0_f64, prop_oneof![Just(0.0), Just(1.0), 0.0..1.0_f64])
            // Angles below π/2 are taken for radians, and refused.
            .prop_map(|(phi, share)| (phi, if phi * share < 2.0 { 0.0 } else { phi * share })),
    ]
}

fn strength() -> impl Strategy<Value = Strength> {
    let tensile = prop_oneof![2 => Just(None), 1 => Just(Some(0.0)), 1 => Just(Some(0.5))];
    (modulus(), 0.0..0.45_f64, cohesion(), angles(), tensile)
}

fn solid() -> impl Strategy<Value = &'static str> {
    prop::sample::select(vec!["plane_strain", "axisymmetric", "3d"])
}

fn elastic() -> impl Strategy<Value = Law> {
    (solid(), modulus(), 0.0..0.45_f64).prop_map(|(h, e, nu)| Law {
        id: "elastic",
        hypothesis: h,
        parameters: vec![("young_modulus", e, 1.0), ("poisson_ratio", nu, 0.0)],
        modulus: e,
    })
}

fn coulomb(id: &'static str, h: &'static str, strength: Strength) -> Law {
    let (e, nu, c, (phi, psi), tensile) = strength;
    // Without friction cohesion is all there is.
    let c = if phi > 0.0 { c } else { c.max(1.0) };
    let mut parameters = vec![
        ("young_modulus", e, 1.0),
        ("poisson_ratio", nu, 0.0),
        ("cohesion", c, 1.0),
        ("friction_angle", phi, 0.0),
        ("dilatancy_angle", psi, 0.0),
    ];
    // At most c cot φ.
    if let Some(share) = tensile {
        let most = if phi > 0.0 {
            c / phi.to_radians().tan()
        } else {
            c
        };
        parameters.push(("tensile_strength", share * most, 1.0));
    }
    Law {
        id,
        hypothesis: h,
        parameters,
        modulus: e,
    }
}

fn mohr_coulomb() -> impl Strategy<Value = Law> {
    (solid(), strength()).prop_map(|(h, s)| coulomb("mohr_coulomb", h, s))
}

fn oriented() -> impl Strategy<Value = Law> {
    let plane = prop::sample::select(vec!["plane_strain", "axisymmetric"]);
    (plane, strength()).prop_map(|(h, s)| coulomb("oriented_mohr_coulomb", h, s))
}

fn joint() -> impl Strategy<Value = Law> {
    (
        prop::sample::select(vec![1e4, 1e6, 1e9]),
        0.1..10.0_f64,
        cohesion(),
        angles(),
        prop_oneof![Just(0.0), 0.0..1.0_f64],
    )
        .prop_map(|(k, ratio, c, (phi, psi), share)| Law {
            id: "coulomb_joint",
            hypothesis: "interface_2d",
            parameters: vec![
                ("normal_stiffness", k * ratio, 1.0),
                ("shear_stiffness", k, 1.0),
                ("cohesion", c, 1.0),
                ("friction_angle", phi, 0.0),
                ("dilatancy_angle", psi, 0.0),
                (
                    "tensile_strength",
                    share * c / phi.max(1.0).to_radians().tan(),
                    1.0,
                ),
            ],
            modulus: k.max(k * ratio),
        })
}

fn mepi() -> impl Strategy<Value = Law> {
    (
        any::<bool>(),
        prop_oneof![Just(0.0), 0.0..0.4_f64],
        0.45..0.9_f64,
        0.5..1.0_f64,
        -4.0..-2.0_f64,
        prop::sample::select(vec![0.05, 1.0, 40.0]),
    )
        .prop_map(|(softens, mu_0, mu_p, characteristic, a, c_0)| {
            let n = 0.55;
            let mut parameters = vec![
                ("k_n", 86e3, 1.0 - n),
                ("k_t", 37e3, 1.0 - n),
                ("n", n, 0.0),
                ("mu_0", mu_0, 0.0),
                ("mu_p", mu_p, 0.0),
                ("mu_c0", characteristic * mu_p, 0.0),
                ("a", 10_f64.powf(a), 0.0),
                ("c_0", c_0, 0.0),
                ("t", 0.002, 0.0),
                ("p_0", 100.0, 1.0),
                ("sigma_ni", 100.0, 1.0),
            ];
            if softens {
                let residual = mu_0.max(0.8 * mu_p);
                parameters.extend([
                    ("mu_r", residual, 0.0),
                    ("a_0", 4.0, 0.0),
                    ("u_tp", 0.0014, 0.0),
                ]);
            }
            Law {
                id: if softens { "mepi_softening" } else { "mepi" },
                hypothesis: "interface_2d",
                parameters,
                modulus: 86e3 * 100_f64.powf(n),
            }
        })
}

fn hyperbolic() -> impl Strategy<Value = Law> {
    (
        3.0..5.0_f64,
        prop_oneof![Just(0.0), Just(1.0), 0.0..1.2_f64],
        prop_oneof![Just(0.0), Just(1.0), 0.5..1.0_f64],
        5.0..45.0_f64,
        1.0..4.0_f64,
    )
        .prop_map(|(number, n, r_f, delta, unloading)| {
            let number = 10_f64.powf(number);
            Law {
                id: "hyperbolic_joint",
                hypothesis: "interface_2d",
                parameters: vec![
                    ("normal_stiffness", 20.0 * number, 1.0),
                    ("stiffness_number", number, 0.0),
                    ("stiffness_exponent", n, 0.0),
                    ("failure_ratio", r_f, 0.0),
                    // It goes where contact is lost: led to no normal traction, rounding decides.
                    ("adhesion", 0.0, 1.0),
                    ("friction_angle", delta, 0.0),
                    ("unloading_number", number * unloading, 0.0),
                    ("unit_weight_of_water", 9.81, 1.0),
                    ("atmospheric_pressure", 101.325, 1.0),
                ],
                modulus: 40.0 * number,
            }
        })
}

fn cyclic() -> impl Strategy<Value = Law> {
    (
        prop::sample::select(vec![1e4, 1e6, 1e9]),
        0.1..10.0_f64,
        (10.0..45.0_f64, 0.3..1.0_f64),
        prop_oneof![Just(0.0), 2.0..10.0_f64],
        (-4.0..0.0_f64, -4.0..0.0_f64),
    )
        .prop_map(
            |(k, ratio, (peak, share), angle, (friction, contraction))| Law {
                id: "cyclic_joint",
                hypothesis: "interface_2d",
                parameters: vec![
                    ("normal_stiffness", k * ratio, 1.0),
                    ("shear_stiffness", k, 1.0),
                    ("peak_friction_angle", peak, 0.0),
                    ("residual_friction_angle", peak * share, 0.0),
                    ("friction_slip", 10_f64.powf(friction), 0.0),
                    ("contraction_angle", angle, 0.0),
                    ("contraction_slip", 10_f64.powf(contraction), 0.0),
                ],
                modulus: k.max(k * ratio),
            },
        )
}

pub(super) fn law() -> impl Strategy<Value = Law> {
    prop_oneof![
        1 => elastic(),
        5 => mohr_coulomb(),
        2 => oriented(),
        3 => joint(),
        4 => mepi(),
        2 => hyperbolic(),
        2 => cyclic(),
    ]
}
