//! The Mohr–Coulomb pyramid and its tension cut-off: what follows from the parameters alone.
//!
//! Letters are those of `LAW.md`: a and b of an angle, r = λ/G, g and h of a return, M of a zone.

use crate::elasticity::Elasticity;
use crate::return_mapping::Zone;
use crate::spectral::{InPlaneModuli, Pair, in_plane_moduli};
use abi::friction::Strength;
use nalgebra::{Matrix3, Vector3};

/// (1 ± sin)/2 of an angle, without cancellation near 90°.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slope {
    pub(crate) sin: f64,
    cos: f64,
    pub(crate) a: f64,
    pub(crate) b: f64,
}

impl Slope {
    fn new(degrees: f64) -> Self {
        let sin = degrees.to_radians().sin();
        let cos = (90.0 - degrees).to_radians().sin();
        Self {
            sin,
            cos,
            a: 0.5 * (1.0 + sin),
            b: 0.5 * cos * cos / (1.0 + sin),
        }
    }

    /// g of Eqs. (5) and (6): the stress, over G, that flow along m = (w₁ a, w₂ a − w₃ b, −w₄ b) takes
    /// away, Eq. (4), r tr m + 2 m, where tr m = a − b = sin.
    fn g(&self, r: f64, weight: [f64; 4]) -> Vector3<f64> {
        let [w1, w2, w3, w4] = weight;
        let Self { a, b, sin, .. } = *self;
        Vector3::new(2.0 * w1 * a, 2.0 * (w2 * a - w3 * b), -2.0 * w4 * b).add_scalar(r * sin)
    }
}

/// Weights of the flow in [`Slope::g`]: on a face, and half the sum of two faces'.
const FACE: [f64; 4] = [1.0, 0.0, 0.0, 1.0];
const EDGE_12: [f64; 4] = [0.5, 0.5, 0.0, 1.0];
const EDGE_23: [f64; 4] = [1.0, 0.0, 0.5, 0.5];

/// A return by Eq. (5): Δ = f/h, s = s\* − Δ g.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Direction {
    pub(crate) g: Vector3<f64>,
    pub(crate) h: f64,
}

/// The tension cut-off.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CutOff {
    pub(crate) R_t: f64,
    /// s₃ where the cut-off meets the pyramid, Eq. (9).
    pub(crate) t_3: f64,
}

/// The surface and everything that follows from the parameters alone.
#[derive(Clone, Debug)]
pub(crate) struct Pyramid {
    phi: Slope,
    pub(crate) psi: Slope,
    pub(crate) nu: f64,
    c_cos_phi: f64,
    pub(crate) apex: f64,
    pub(crate) face: Direction,
    pub(crate) edge_12: Direction,
    pub(crate) edge_23: Direction,
    pub(crate) cut_off: Option<CutOff>,
    M: [Matrix3<f64>; 10],
    in_plane_M: [[InPlaneModuli; 3]; 10],
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

/// Eq. (12), by zone: the elastic operator, averaged over the merged pair, less what flow takes away.
fn consistent_moduli(
    elasticity: &Elasticity,
    phi: &Slope,
    [face, edge_12, edge_23]: [&Direction; 3],
) -> [Matrix3<f64>; 10] {
    let Elasticity {
        E, nu, lambda, G, ..
    } = *elasticity;
    let D = elasticity.principal_operator();
    let P_12 = Matrix3::new(0.5, 0.5, 0.0, 0.5, 0.5, 0.0, 0.0, 0.0, 1.0);
    let P_23 = Matrix3::new(1.0, 0.0, 0.0, 0.0, 0.5, 0.5, 0.0, 0.5, 0.5);
    let less = |D: Matrix3<f64>, to: &Direction, weight| {
        D - to.g * phi.g(lambda / G, weight).transpose() * (G / to.h)
    };
    let plane_stress = E / ((1.0 - nu) * (1.0 + nu));
    let mut M = [Matrix3::zeros(); 10];
    M[Zone::Face as usize] = less(D, face, FACE);
    M[Zone::Edge12 as usize] = less(P_12 * D, edge_12, EDGE_12);
    M[Zone::Edge23 as usize] = less(P_23 * D, edge_23, EDGE_23);
    M[Zone::TensionPlane as usize] =
        Matrix3::new(0.0, 0.0, 0.0, 0.0, 1.0, nu, 0.0, nu, 1.0) * plane_stress;
    M[Zone::TensionEdge as usize][(2, 2)] = E;
    M[Zone::FaceAndTension as usize][(1, 1)] = E;
    M
}

impl Pyramid {
    /// The surface of this strength.
    pub(crate) fn new(elasticity: &Elasticity, strength: &Strength) -> Self {
        let phi = Slope::new(strength.friction_angle);
        let psi = Slope::new(strength.dilatancy_angle);
        let Elasticity { nu, lambda, G, .. } = *elasticity;
        let r = lambda / G;
        let ss = r * phi.sin * psi.sin;
        let (aa, bb) = (phi.a * psi.a, phi.b * psi.b);
        let direction = |weight, h| Direction {
            g: psi.g(r, weight),
            h,
        };
        // Eqs. (5) and (6).
        let face = direction(FACE, ss + 2.0 * (aa + bb));
        let edge_12 = direction(EDGE_12, ss + aa + 2.0 * bb);
        let edge_23 = direction(EDGE_23, ss + 2.0 * aa + bb);

        let M = consistent_moduli(elasticity, &phi, [&face, &edge_12, &edge_23]);
        let c_cos_phi = strength.cohesion * phi.cos;
        Self {
            phi,
            psi,
            nu,
            c_cos_phi,
            apex: strength.apex,
            face,
            edge_12,
            edge_23,
            cut_off: strength.cut_off().map(|R_t| CutOff {
                R_t,
                t_3: (phi.a * R_t - c_cos_phi) / phi.b,
            }),
            M,
            in_plane_M: M.map(|m| Pair::ALL.map(|pair| in_plane_moduli(&m, pair))),
        }
    }

    /// Yield function of the pyramid, Eq. (2), of the extreme principal stresses.
    #[inline]
    pub(crate) fn f(&self, s1: f64, s3: f64) -> f64 {
        self.phi.a * s1 - self.phi.b * s3 - self.c_cos_phi
    }

    /// s₁ on the pyramid above this s₃, Eq. (2).
    #[inline]
    pub(crate) fn s1_above(&self, s3: f64) -> f64 {
        (self.phi.b * s3 + self.c_cos_phi) / self.phi.a
    }

    /// s₁ − s₃ on the pyramid above this s₃; negative beyond the apex.
    #[inline]
    pub(crate) fn gap_above(&self, s3: f64) -> f64 {
        (self.c_cos_phi - self.phi.sin * s3) / self.phi.a
    }

    /// Whether a stress with these extreme principal values is admissible, Eqs. (2) and (3). The
    /// margin covers the rounding of a decomposition, so that a returned stress is admissible.
    #[inline]
    pub(crate) fn admits(&self, s1: f64, s3: f64) -> bool {
        const ROUNDING: f64 = 64.0 * f64::EPSILON;
        let margin = ROUNDING * s1.abs().max(s3.abs()).max(self.c_cos_phi);
        self.f(s1, s3) <= margin && self.cut_off.is_none_or(|cut| s1 <= cut.R_t + margin)
    }

    /// ∂s/∂ε of the return in principal values, Eq. (12).
    #[inline]
    pub(crate) fn M(&self, zone: Zone) -> &Matrix3<f64> {
        &self.M[zone as usize]
    }

    /// The same as the plane of these two axes sees it.
    #[inline]
    pub(crate) fn in_plane_M(&self, zone: Zone, pair: Pair) -> &InPlaneModuli {
        &self.in_plane_M[zone as usize][pair as usize]
    }
}
