//! The curve of Frank and Zhao, and what unloading makes of it: two sliders side by side.

use abi::Parameter;

abi::parameters! {
    /// Common parts of the curves of shaft and base.
    pub struct Ground {
        /// Pressuremeter modulus of Ménard.
        pressuremeter_modulus: Parameter::new(c"E_M", c"kPa").above(0.0).usual(1e3, 1e6),
        /// Diameter of the pile.
        diameter: Parameter::new(c"D", c"m").above(0.0).usual(0.1, 5.0),
        /// Kind of ground: clay and silt, or sand and gravel.
        soil: Parameter::new(c"soil", c"-").one_of(abi::choices!(c"fine", c"granular")),
    }
}

impl Ground {
    /// Eq. (1), (2): the first slope, by the factor of the soil.
    pub(crate) fn slope(&self, fine: f64, granular: f64) -> f64 {
        let factor = if self.soil < 0.5 { fine } else { granular };
        factor * self.pressuremeter_modulus / self.diameter
    }
}

/// A curve with the slopes k, k/5 and 0, which change at half of the strength and at the strength.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Curve {
    /// k, kPa/m.
    pub(crate) slope: f64,
    /// s, kPa.
    pub(crate) strength: f64,
}

/// Mobilised stress, in all and of the stiff slider, kPa.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Mobilised {
    pub(crate) stress: f64,
    pub(crate) stiff_part: f64,
}

/// Eq. (4): share of slope and strength that the stiff slider has; the soft one has the rest.
const STIFF_SLOPE: f64 = 0.8;
const STIFF_STRENGTH: f64 = 0.4;

impl Curve {
    /// How a stress that has been there from the start is shared, as if the first loading had made it.
    pub(crate) fn at_first(&self, stress: f64) -> Mobilised {
        let limit = STIFF_STRENGTH * self.strength;
        Mobilised {
            stress,
            stiff_part: (STIFF_SLOPE * stress).clamp(-limit, limit),
        }
    }

    /// After a movement, and the tangent. Eq. (4). Load of the sliders beyond their strengths at
    /// the start is dropped before they move.
    #[inline]
    pub(crate) fn moved(&self, start: Mobilised, movement: f64) -> (Mobilised, f64) {
        let slider = |stress: f64, slope: f64, strength: f64| {
            let (k, limit) = (slope * self.slope, strength * self.strength);
            let trial = stress.clamp(-limit, limit) + k * movement;
            if trial.abs() <= limit {
                (trial, k)
            } else {
                (limit.copysign(trial), 0.0)
            }
        };
        let (stiff_part, k) = slider(start.stiff_part, STIFF_SLOPE, STIFF_STRENGTH);
        let (soft_part, k_soft) = slider(
            start.stress - start.stiff_part,
            1.0 - STIFF_SLOPE,
            1.0 - STIFF_STRENGTH,
        );
        let end = Mobilised {
            stress: stiff_part + soft_part,
            stiff_part,
        };
        (end, k + k_soft)
    }

    /// Unloaded to nothing along the first slope.
    pub(crate) fn unloaded(start: Mobilised) -> Mobilised {
        Mobilised {
            stress: 0.0,
            stiff_part: start.stiff_part - STIFF_SLOPE * start.stress,
        }
    }
}
