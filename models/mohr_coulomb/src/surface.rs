//! The Mohr–Coulomb pyramid and its tension cut-off: what follows from the parameters alone.
//!
//! | symbol | here | |
//! |---|---|---|
//! | `a`, `b` | `upper`, `lower` | (1 + sin)/2 and (1 − sin)/2 of the friction or dilatancy angle |
//! | `k` | `strength` | c cos φ, kPa |
//! | `r` | `ratio` | λ/G |
//! | `g`, `h` | `relief`, `hardness` | stress taken away, and fall of the yield function, for Δ = 1 |

use crate::elasticity::Elasticity;
use crate::return_mapping::Zone;
use crate::spectral::{InPlaneModuli, Pair, in_plane_moduli};
use nalgebra::{Matrix3, Vector3};

/// (1 ± sin)/2 of an angle, without cancellation near 90°.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slope {
    pub(crate) sin: f64,
    cos: f64,
    pub(crate) upper: f64,
    pub(crate) lower: f64,
}

impl Slope {
    fn new(degrees: f64) -> Self {
        let sin = degrees.to_radians().sin();
        let cos = (90.0 - degrees).to_radians().sin();
        Self {
            sin,
            cos,
            upper: 0.5 * (1.0 + sin),
            lower: 0.5 * cos * cos / (1.0 + sin),
        }
    }

    /// Stress that flow along m = (w₁ a, w₂ a − w₃ b, −w₄ b) takes away, over G, Eq. (4):
    /// r tr m + 2 m, where tr m = a − b = sin.
    fn relief(&self, ratio: f64, weight: [f64; 4]) -> Vector3<f64> {
        let [w1, w2, w3, w4] = weight;
        let (a, b) = (self.upper, self.lower);
        Vector3::new(2.0 * w1 * a, 2.0 * (w2 * a - w3 * b), -2.0 * w4 * b)
            .add_scalar(ratio * self.sin)
    }
}

/// Weights of the flow in [`Slope::relief`]: on a face, and half the sum of two faces'.
const FACE: [f64; 4] = [1.0, 0.0, 0.0, 1.0];
const EDGE_12: [f64; 4] = [0.5, 0.5, 0.0, 1.0];
const EDGE_23: [f64; 4] = [1.0, 0.0, 0.5, 0.5];

/// A return direction: Δ = f / `hardness`, stress −= Δ `relief`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Direction {
    pub(crate) relief: Vector3<f64>,
    pub(crate) hardness: f64,
}

/// The tension cut-off.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CutOff {
    pub(crate) strength: f64,
    /// s₃ where the cut-off meets the pyramid.
    pub(crate) s3: f64,
}

/// The surface and everything that follows from the parameters alone.
#[derive(Clone, Debug)]
pub(crate) struct Pyramid {
    phi: Slope,
    pub(crate) psi: Slope,
    pub(crate) poisson_ratio: f64,
    strength: f64,
    pub(crate) apex: f64,
    pub(crate) face: Direction,
    pub(crate) edge_12: Direction,
    pub(crate) edge_23: Direction,
    pub(crate) cut_off: Option<CutOff>,
    moduli: [Matrix3<f64>; 10],
    in_plane_moduli: [[InPlaneModuli; 3]; 10],
}

/// c cot φ; infinite for φ = 0.
pub(crate) fn apex(cohesion: f64, friction_angle: f64) -> f64 {
    let phi = Slope::new(friction_angle);
    if phi.sin > 0.0 {
        cohesion * phi.cos / phi.sin
    } else {
        f64::INFINITY
    }
}

impl Pyramid {
    /// The surface for angles in degrees. `tensile_strength` below c cot φ cuts the apex off.
    pub(crate) fn new(
        elasticity: &Elasticity,
        cohesion: f64,
        friction_angle: f64,
        dilatancy_angle: f64,
        tensile_strength: Option<f64>,
    ) -> Self {
        let (phi, psi) = (Slope::new(friction_angle), Slope::new(dilatancy_angle));
        let (lambda, g) = (elasticity.lambda, elasticity.shear_modulus);
        let (e, nu) = (elasticity.young_modulus, elasticity.poisson_ratio);
        let r = lambda / g;
        let ss = r * phi.sin * psi.sin;
        let (aa, bb) = (phi.upper * psi.upper, phi.lower * psi.lower);
        let direction = |weight, hardness| Direction {
            relief: psi.relief(r, weight),
            hardness,
        };
        // Eqs. (5) and (6).
        let face = direction(FACE, ss + 2.0 * (aa + bb));
        let edge_12 = direction(EDGE_12, ss + aa + 2.0 * bb);
        let edge_23 = direction(EDGE_23, ss + 2.0 * aa + bb);

        // Eq. (12): the elastic operator, averaged over the merged pair, less what flow takes away.
        let d = elasticity.principal_operator();
        let pair_12 = Matrix3::new(0.5, 0.5, 0.0, 0.5, 0.5, 0.0, 0.0, 0.0, 1.0);
        let pair_23 = Matrix3::new(1.0, 0.0, 0.0, 0.0, 0.5, 0.5, 0.0, 0.5, 0.5);
        let less = |d: Matrix3<f64>, to: &Direction, weight| {
            d - to.relief * phi.relief(r, weight).transpose() * (g / to.hardness)
        };
        let plane_stress = e / ((1.0 - nu) * (1.0 + nu));
        let mut moduli = [Matrix3::zeros(); 10];
        moduli[Zone::Face as usize] = less(d, &face, FACE);
        moduli[Zone::Edge12 as usize] = less(pair_12 * d, &edge_12, EDGE_12);
        moduli[Zone::Edge23 as usize] = less(pair_23 * d, &edge_23, EDGE_23);
        moduli[Zone::TensionPlane as usize] =
            Matrix3::new(0.0, 0.0, 0.0, 0.0, 1.0, nu, 0.0, nu, 1.0) * plane_stress;
        moduli[Zone::TensionEdge as usize][(2, 2)] = e;
        moduli[Zone::FaceAndTension as usize][(1, 1)] = e;

        let strength = cohesion * phi.cos;
        Self {
            phi,
            psi,
            poisson_ratio: nu,
            strength,
            apex: apex(cohesion, friction_angle),
            face,
            edge_12,
            edge_23,
            cut_off: tensile_strength.map(|t| CutOff {
                strength: t,
                s3: (phi.upper * t - strength) / phi.lower,
            }),
            moduli,
            in_plane_moduli: moduli.map(|m| Pair::ALL.map(|pair| in_plane_moduli(&m, pair))),
        }
    }

    /// Yield function of the pyramid, Eq. (2), of the extreme principal stresses.
    #[inline]
    pub(crate) fn yield_function(&self, s1: f64, s3: f64) -> f64 {
        self.phi.upper * s1 - self.phi.lower * s3 - self.strength
    }

    /// s₁ on the pyramid above this s₃, Eq. (2).
    #[inline]
    pub(crate) fn s1_above(&self, s3: f64) -> f64 {
        (self.phi.lower * s3 + self.strength) / self.phi.upper
    }

    /// s₁ − s₃ on the pyramid above this s₃; negative beyond the apex.
    #[inline]
    pub(crate) fn gap_above(&self, s3: f64) -> f64 {
        (self.strength - self.phi.sin * s3) / self.phi.upper
    }

    /// Whether a stress with these extreme principal values is admissible, Eqs. (2) and (3). The
    /// margin covers the rounding of a decomposition, so that a returned stress is admissible.
    #[inline]
    pub(crate) fn admits(&self, s1: f64, s3: f64) -> bool {
        const ROUNDING: f64 = 64.0 * f64::EPSILON;
        let margin = ROUNDING * s1.abs().max(s3.abs()).max(self.strength);
        self.yield_function(s1, s3) <= margin
            && self.cut_off.is_none_or(|cut| s1 <= cut.strength + margin)
    }

    /// ∂s/∂ε of the return in principal values, Eq. (12).
    #[inline]
    pub(crate) fn moduli(&self, zone: Zone) -> &Matrix3<f64> {
        &self.moduli[zone as usize]
    }

    /// The same as the plane of these two axes sees it.
    #[inline]
    pub(crate) fn in_plane_moduli(&self, zone: Zone, pair: Pair) -> &InPlaneModuli {
        &self.in_plane_moduli[zone as usize][pair as usize]
    }
}
