//! Input without meaning: every law refuses it, whatever it is asked.
//!
//! Parameters   NaN, infinities and values outside their bounds, one at a time
//! Calls        NaN, infinities and numbers whose products overflow, in each component of increment,
//!              flux and internal variables

use crate::matrix::{Family, Verdict};
use crate::point::{Point, law, reason};
use abi::Hypothesis;
use law::Operator;

/// A law with parameters that make sense, and a flux to start from.
struct Sound {
    id: &'static str,
    hypothesis: Hypothesis,
    values: &'static [(&'static str, f64)],
    flux: &'static [f64],
    /// Moduli, in whose units an increment is huge.
    moduli: &'static [f64],
}

const SOUND: [Sound; 7] = [
    Sound {
        id: "elastic",
        hypothesis: Hypothesis::PlaneStrain,
        values: &[("young_modulus", 1e5), ("poisson_ratio", 0.3)],
        flux: &[-60.0, -100.0, -60.0, 0.0],
        moduli: &[1e5; 4],
    },
    Sound {
        id: "mohr_coulomb",
        hypothesis: Hypothesis::ThreeD,
        values: MOHR_COULOMB,
        flux: &[-60.0, -100.0, -60.0, 0.0, 0.0, 0.0],
        moduli: &[1e5; 6],
    },
    Sound {
        id: "mohr_coulomb",
        hypothesis: Hypothesis::Axisymmetric,
        values: MOHR_COULOMB,
        flux: &[-60.0, -100.0, -60.0, 0.0],
        moduli: &[1e5; 4],
    },
    Sound {
        id: "oriented_mohr_coulomb",
        hypothesis: Hypothesis::PlaneStrain,
        values: MOHR_COULOMB,
        flux: &[-60.0, -100.0, -60.0, 0.0],
        moduli: &[1e5; 4],
    },
    Sound {
        id: "coulomb_joint",
        hypothesis: Hypothesis::Interface2d,
        values: &[
            ("normal_stiffness", 1e6),
            ("shear_stiffness", 1e6),
            ("cohesion", 10.0),
            ("friction_angle", 30.0),
            ("dilatancy_angle", 0.0),
            ("tensile_strength", 5.0),
        ],
        flux: &[-100.0, 0.0],
        moduli: &[1e6; 2],
    },
    Sound {
        id: "mepi",
        hypothesis: Hypothesis::Interface2d,
        values: MEPI,
        flux: &[-100.0, 0.0],
        moduli: &[1e6; 2],
    },
    Sound {
        id: "mepi_softening",
        hypothesis: Hypothesis::Interface2d,
        values: MEPI_SOFTENING,
        flux: &[-100.0, 0.0],
        moduli: &[1e6; 2],
    },
];

const MOHR_COULOMB: &[(&str, f64)] = &[
    ("young_modulus", 1e5),
    ("poisson_ratio", 0.3),
    ("cohesion", 10.0),
    ("friction_angle", 30.0),
    ("dilatancy_angle", 10.0),
    ("tensile_strength", 5.0),
];

const MEPI: &[(&str, f64)] = &[
    ("k_n", 0.86e5),
    ("k_t", 0.37e5),
    ("n", 0.55),
    ("mu_0", 0.27),
    ("mu_p", 0.7),
    ("mu_c0", 0.46),
    ("a", 0.008),
    ("c_0", 40.0),
    ("t", 0.002),
    ("p_0", 100.0),
    ("sigma_ni", 100.0),
];

const MEPI_SOFTENING: &[(&str, f64)] = &[
    ("k_n", 0.86e5),
    ("k_t", 0.37e5),
    ("n", 0.55),
    ("mu_0", 0.0),
    ("mu_p", 0.78),
    ("mu_c0", 0.67),
    ("a", 0.000_45),
    ("c_0", 0.05),
    ("t", 0.002),
    ("p_0", 1.0),
    ("sigma_ni", 100.0),
    ("mu_r", 0.7),
    ("a_0", 4.0),
    ("u_tp", 1.4e-3),
];

const NONE: [f64; 3] = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY];

pub(crate) fn families() -> Vec<Family> {
    let mut family = Family::new("input without meaning", "refusal with a reason");
    family.meaningful = false;
    for sound in &SOUND {
        parameters(sound, &mut family);
        calls(sound, &mut family);
    }
    vec![family]
}

fn parameters(sound: &Sound, family: &mut Family) {
    let described = law(sound.id, sound.hypothesis, sound.values).unwrap();
    for p in &described.description().parameters {
        let mut values = NONE.to_vec();
        let outside = |value: f64| {
            if p.bounds.contain(value) {
                None
            } else {
                Some(value)
            }
        };
        let below = p.bounds.lower - if p.bounds.open_lower { 0.0 } else { 1e-9 };
        let above = p.bounds.upper + if p.bounds.open_upper { 0.0 } else { 1e-9 };
        values.extend([below, above].into_iter().filter_map(outside));
        for value in values {
            // Left out, which is no error of an optional parameter or one with a default.
            if value.is_nan() && (p.optional || p.default.is_some()) {
                continue;
            }
            let mut changed = sound.values.to_vec();
            changed.push((&p.id, value));
            let verdict = match law(sound.id, sound.hypothesis, &changed) {
                Ok(_) => Verdict::Agrees,
                Err(why) if why.is_empty() => Verdict::Silent("no reason".to_owned()),
                Err(_) => Verdict::Refused("a parameter".to_owned()),
            };
            family.add(format!("{}: {} = {value}", sound.id, p.id), verdict);
        }
    }
}

fn calls(sound: &Sound, family: &mut Family) {
    let point = || {
        let law = law(sound.id, sound.hypothesis, sound.values).unwrap();
        Point::new(law, sound.flux).unwrap()
    };
    let n = sound.flux.len();
    let n_states = point().state.len();
    let mut add = |what: String, mut point: Point, increment: Vec<f64>| {
        for operator in [Operator::None, Operator::Elastic, Operator::Consistent] {
            let verdict = match point.respond(&increment, operator) {
                Ok(end) => Verdict::Silent(format!("{end:?}")),
                Err(why) if why.message.is_empty() => Verdict::Silent("no reason".to_owned()),
                Err(why) => Verdict::Refused(reason(&why)),
            };
            family.add(format!("{}: {what}, {operator:?}", sound.id), verdict);
        }
        point.state.clear();
    };
    for i in 0..n {
        for bad in NONE {
            let mut increment = vec![0.0; n];
            increment[i] = bad;
            add(format!("increment {i} = {bad}"), point(), increment);
            let mut at = point();
            at.flux[i] = bad;
            add(format!("flux {i} = {bad}"), at, vec![0.0; n]);
        }
        // The elastic predictor is beyond the range of numbers.
        for sign in [1.0, -1.0] {
            let mut increment = vec![0.0; n];
            increment[i] = sign * 1e306 / sound.moduli[i] * 1e5;
            add(
                format!("increment {i} = {sign:+}e311/K"),
                point(),
                increment,
            );
        }
    }
    for i in 0..n_states {
        for bad in NONE {
            let mut at = point();
            at.state[i] = bad;
            add(format!("internal variable {i} = {bad}"), at, vec![0.0; n]);
        }
    }
}
