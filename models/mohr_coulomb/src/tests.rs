//! Unit tests of the mathematics: `zones` by hand, `sweep` over random states, `tangent` against differences,
//! `viscosity` against the exponential. All sets of active planes are tried in `tests/extremes`.
#![expect(
    clippy::float_cmp,
    reason = "what must not change is compared bit for bit"
)]

mod schemes;
mod sweep;
mod tangent;
mod viscosity;
mod zones;

use crate::return_mapping::Zone;
use crate::{MohrCoulomb, Parameters, State};
use abi::substepping::SchemeParameters;
use abi::{ContinuumLaw as _, SolidPoint, SolidResponse, Tangent};
use nalgebra::{Matrix3, Vector3};
use walk::Random;

/// E = 25e3 kPa and ν = 1/4, so that λ = G = 1e4 kPa; φ = 30°, ψ = 0, c cos φ = 10 kPa, so that the
/// yield function is 3/4 s₁ − 1/4 s₃ − 10 and the apex is at 20 kPa.
fn handy(tensile_strength: Option<f64>) -> Parameters {
    Parameters {
        young_modulus: 25e3,
        poisson_ratio: 0.25,
        cohesion: 20.0 / 3.0_f64.sqrt(),
        friction_angle: 30.0,
        dilatancy_angle: 0.0,
        tensile_strength: tensile_strength.unwrap_or(f64::NAN),
        scheme: IMPLICIT,
        relaxation_time: 0.0,
    }
}

/// Default parameters of the scheme.
const IMPLICIT: SchemeParameters = SchemeParameters {
    scheme: 0.0,
    substeps: 10.0,
    scheme_tolerance: 1e-6,
};

fn law(p: Parameters) -> MohrCoulomb {
    MohrCoulomb::new(p).unwrap()
}

fn rested<const N: usize>(stress: [f64; N], strain_increment: [f64; N]) -> SolidPoint<N, State> {
    SolidPoint {
        strain: [0.0; N],
        strain_increment,
        stress,
        state: State {
            plastic_strain: 0.0,
            plastic_dilation: 0.0,
        },
        time: 0.0,
        time_increment: 1.0,
        step_time: 0.0,
    }
}

/// The update from a stress that plays the trial stress.
fn from_trial<const N: usize>(law: &MohrCoulomb, trial: [f64; N]) -> SolidResponse<N, State> {
    law.update(&rested(trial, [0.0; N]), Tangent::Consistent)
        .unwrap()
}

/// Voigt components of the stress with these principal values in axes turned by three angles. For
/// N = 4 only the first counts and turns about the axis of `values[2]`.
fn turned<const N: usize>(values: [f64; 3], angles: [f64; 3]) -> [f64; N] {
    let turn = |i: usize, j: usize, angle: f64| {
        let mut q = Matrix3::identity();
        (q[(i, i)], q[(j, j)]) = (angle.cos(), angle.cos());
        (q[(i, j)], q[(j, i)]) = (-angle.sin(), angle.sin());
        q
    };
    let mut q = turn(0, 1, angles[0]);
    if N == 6 {
        q = turn(0, 2, angles[2]) * turn(1, 2, angles[1]) * q;
    }
    let s = q * Matrix3::from_diagonal(&Vector3::from(values)) * q.transpose();
    let all = [
        s[(0, 0)],
        s[(1, 1)],
        s[(2, 2)],
        s[(0, 1)],
        s[(0, 2)],
        s[(1, 2)],
    ];
    std::array::from_fn(|c| all[c])
}

/// Principal values, largest first, by a library.
fn principal_values<const N: usize>(stress: &[f64; N]) -> Vector3<f64> {
    let [xz, yz] = if N == 6 {
        [stress[4], stress[5]]
    } else {
        [0.0, 0.0]
    };
    let mut values = Matrix3::new(
        stress[0], stress[3], xz, stress[3], stress[1], yz, xz, yz, stress[2],
    )
    .symmetric_eigenvalues();
    values.as_mut_slice().sort_by(|a, b| b.total_cmp(a));
    values
}

/// How far a stress lies outside the surface, as a fraction of its size and the strength. The
/// yield function is written as in textbooks, not as in the law.
fn excess<const N: usize>(p: &Parameters, stress: &[f64; N]) -> f64 {
    let s = principal_values(stress);
    let phi = p.friction_angle.to_radians();
    let strength = p.cohesion * (90.0 - p.friction_angle).to_radians().sin();
    let f = 0.5 * (s[0] - s[2]) + 0.5 * (s[0] + s[2]) * phi.sin() - strength;
    let tension = if p.tensile_strength.is_nan() {
        f
    } else {
        s[0] - p.tensile_strength
    };
    f.max(tension) / s.amax().max(strength).max(f64::MIN_POSITIVE)
}

/// The largest difference between two arrays.
fn distance<const N: usize>(a: &[f64; N], b: &[f64; N]) -> f64 {
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f64::max)
}

/// The largest component.
fn size<const N: usize>(a: &[f64; N]) -> f64 {
    distance(a, &[0.0; N])
}

fn any_angles(random: &mut Random) -> [f64; 3] {
    std::array::from_fn(|_| random.between(0.0, 6.3))
}

/// Principal values about as large as the strength, some of them equal.
fn principal(random: &mut Random, scale: f64) -> [f64; 3] {
    let mean = random.between(-3.0, 2.0) * scale;
    let reach = random.one_of(&[0.1, 1.0, 5.0]) * scale;
    let mut s: [f64; 3] = std::array::from_fn(|_| mean + random.between(-reach, reach));
    match random.one_of(&[0, 1, 2, 3, 4, 5]) {
        0 => s[1] = s[0],
        1 => s[2] = s[0],
        2 => s[2] = s[1],
        _ => {}
    }
    s
}

/// Parameters whose strength is of the order of `scale`, special values included.
fn parameters(random: &mut Random, angles: &[f64], scale: f64) -> Parameters {
    let friction_angle = random.one_of(angles);
    let cohesion = if friction_angle > 0.0 {
        random.one_of(&[0.0, 0.3, 1.0])
    } else {
        1.0
    };
    let apex = cohesion * (90.0 - friction_angle).to_radians().tan();
    let share = random.one_of(&[f64::NAN, f64::NAN, 0.0, 0.3, 0.9, 1.0]);
    Parameters {
        young_modulus: 10_f64.powf(random.between(0.0, 9.0)),
        poisson_ratio: random.one_of(&[-0.9, 0.0, 0.2, 0.35, 0.499]),
        cohesion: cohesion * scale,
        friction_angle,
        dilatancy_angle: friction_angle * random.one_of(&[0.0, 0.0, 0.4, 1.0]),
        tensile_strength: share * apex.min(3.0) * scale,
        scheme: IMPLICIT,
        relaxation_time: 0.0,
    }
}
