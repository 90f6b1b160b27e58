//! Return mapping on the facet: normal stress `n` (tension positive) and shear stress `t`.
//!
//! | symbol | here | |
//! |---|---|---|
//! | `tan φ`, `tan ψ` | `tan_phi`, `tan_psi` | friction, dilatancy |
//! | `M`, `G` | `oedometric`, `shear_modulus` | moduli of the facet, kPa |
//! | `H` | `hardness` | G + M tan φ tan ψ, kPa |

use abi::friction::{Strength, tan};

/// Where a trial stress returns to. Each inadmissible trial stress has exactly one zone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Zone {
    /// Sliding on the friction line.
    Face,
    /// The point of the friction lines, at c cot φ.
    Apex,
    /// Opening at the tensile strength, without sliding.
    Tension,
    /// Sliding and opening at the tensile strength.
    Corner,
}

/// A stress of the facet on its surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Returned {
    pub(crate) zone: Zone,
    pub(crate) normal: f64,
    pub(crate) shear: f64,
}

/// The tensile strength and the shear strength that goes with it.
#[derive(Clone, Copy, Debug)]
struct CutOff {
    normal: f64,
    shear: f64,
}

/// The surface and everything that follows from the parameters alone.
#[derive(Clone, Debug)]
pub(crate) struct Facet {
    cohesion: f64,
    tan_phi: f64,
    tan_psi: f64,
    oedometric: f64,
    shear_modulus: f64,
    hardness: f64,
    apex: f64,
    cut_off: Option<CutOff>,
}

/// c cot φ; infinite for φ = 0.
pub(crate) fn apex(cohesion: f64, friction_angle: f64) -> f64 {
    let tan_phi = tan(friction_angle);
    if tan_phi > 0.0 {
        cohesion / tan_phi
    } else {
        f64::INFINITY
    }
}

impl Facet {
    /// The surface of this strength.
    pub(crate) fn new(oedometric: f64, shear_modulus: f64, strength: &Strength) -> Self {
        let cohesion = strength.cohesion;
        let tan_phi = tan(strength.friction_angle);
        let tan_psi = tan(strength.dilatancy_angle);
        Self {
            cohesion,
            tan_phi,
            tan_psi,
            oedometric,
            shear_modulus,
            hardness: shear_modulus + oedometric * tan_phi * tan_psi,
            apex: strength.apex,
            cut_off: strength.cut_off().map(|normal| CutOff {
                normal,
                shear: cohesion - normal * tan_phi,
            }),
        }
    }

    /// Yield function, Eq. (2).
    #[inline]
    fn yield_function(&self, normal: f64, shear: f64) -> f64 {
        shear.abs() + normal * self.tan_phi - self.cohesion
    }

    /// Whether a stress is admissible, Eqs. (2) and (3). The margin covers the rounding of a
    /// return, so that a returned stress is admissible.
    #[inline]
    pub(crate) fn admits(&self, normal: f64, shear: f64) -> bool {
        const ROUNDING: f64 = 4.0 * f64::EPSILON;
        let size = shear.abs() + normal.abs() * self.tan_phi + self.cohesion;
        self.yield_function(normal, shear) <= ROUNDING * size
            && self.cut_off.is_none_or(|cut| normal <= cut.normal)
    }

    /// Returns an inadmissible trial stress, Eq. (8).
    #[inline]
    pub(crate) fn return_stress(&self, normal: f64, shear: f64) -> Returned {
        let Some(cut) = &self.cut_off else {
            let face = self.face(normal, shear);
            return face.unwrap_or(Returned {
                // Eq. (6).
                zone: Zone::Apex,
                normal: self.apex,
                shear: 0.0,
            });
        };
        // Eq. (7).
        if normal > cut.normal && shear.abs() <= cut.shear {
            return Returned {
                zone: Zone::Tension,
                normal: cut.normal,
                shear,
            };
        }
        let face = self.face(normal, shear);
        face.filter(|end| end.normal <= cut.normal)
            .unwrap_or(Returned {
                // Eq. (7).
                zone: Zone::Corner,
                normal: cut.normal,
                shear: cut.shear.copysign(shear),
            })
    }

    /// Derivatives of (normal, shear) by their trial values, Eq. (9), row by row.
    #[inline]
    pub(crate) fn jacobian(&self, end: &Returned) -> [[f64; 2]; 2] {
        let (m, g, h) = (self.oedometric, self.shear_modulus, self.hardness);
        let sign = 1.0_f64.copysign(end.shear);
        match end.zone {
            Zone::Face => [
                [g / h, -sign * m * self.tan_psi / h],
                [
                    -sign * g * self.tan_phi / h,
                    m * self.tan_phi * self.tan_psi / h,
                ],
            ],
            Zone::Tension => [[0.0, 0.0], [0.0, 1.0]],
            Zone::Apex | Zone::Corner => [[0.0; 2]; 2],
        }
    }

    /// The friction line on the side of the shear stress, Eq. (5); none if that is beyond the apex.
    #[inline]
    fn face(&self, normal: f64, shear: f64) -> Option<Returned> {
        let slip = self.yield_function(normal, shear) / self.hardness;
        let mut end_normal = normal - self.oedometric * self.tan_psi * slip;
        let mut size = shear.abs() - self.shear_modulus * slip;
        // One of the two from Eq. (2): on the surface to the rounding of the end, not of the trial.
        if self.tan_phi > 1.0 {
            end_normal = (self.cohesion - size) / self.tan_phi;
        } else {
            size = self.cohesion - end_normal * self.tan_phi;
        }
        (size >= 0.0).then_some(Returned {
            zone: Zone::Face,
            normal: end_normal,
            shear: size.copysign(shear),
        })
    }
}
