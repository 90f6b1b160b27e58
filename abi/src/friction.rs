//! For authors of laws with Coulomb friction: how the parameters of its strength go together. A law need
//! not use it.

use crate::law::Refusal;

/// Relative rounding of c cot φ.
const APEX_ROUNDING: f64 = 1e-12;

/// Tangent of an angle in degrees, without cancellation near 90°.
pub fn tan(degrees: f64) -> f64 {
    if degrees > 45.0 {
        (90.0 - degrees).to_radians().tan().recip()
    } else {
        degrees.to_radians().tan()
    }
}

/// A surface with its apex at c cot φ, cut off by a tensile strength.
#[derive(Clone, Copy, Debug)]
pub struct Strength {
    /// c, kPa.
    pub cohesion: f64,
    /// φ, degrees.
    pub friction_angle: f64,
    /// ψ, degrees.
    pub dilatancy_angle: f64,
    /// `R_t`, kPa; NaN: none.
    pub tensile_strength: f64,
    /// c cot φ, kPa, infinite for φ = 0: computed from what the law knows φ by, so that it is the law's
    /// own apex to the last bit.
    pub apex: f64,
}

impl Strength {
    /// What the bounds of single parameters cannot say.
    ///
    /// # Errors
    /// ψ > φ, no strength at all, or `R_t` beyond the apex.
    pub fn check(&self) -> Result<(), Refusal> {
        let Self {
            cohesion: c,
            friction_angle: phi,
            dilatancy_angle: psi,
            tensile_strength: t,
            apex,
        } = *self;
        if psi > phi {
            let reason = format!("{psi} deg exceeds the friction angle of {phi} deg");
            return Err(Refusal::new("dilatancy_angle", reason));
        }
        if phi <= 0.0 && c <= 0.0 {
            let reason = "0 kPa with a friction angle of 0 deg leaves no strength";
            return Err(Refusal::new("cohesion", reason));
        }
        if t > apex * (1.0 + APEX_ROUNDING) {
            let reason = format!("{t} kPa exceeds c cot φ = {apex} kPa, the apex of the surface");
            return Err(Refusal::new("tensile_strength", reason));
        }
        Ok(())
    }

    /// The tensile strength, if it cuts the apex off: at c cot φ it touches the apex and changes nothing.
    pub fn cut_off(&self) -> Option<f64> {
        let below_apex = |t: &f64| *t < self.apex * (1.0 - APEX_ROUNDING);
        Some(self.tensile_strength).filter(below_apex)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Near 90° the tangent is 1/(90° − φ), whose argument a subtraction leaves exact.
    #[test]
    fn the_tangent_keeps_its_digits_near_a_right_angle() {
        let left = 2.0_f64.powi(-30);
        let expected = 1.0 / left.to_radians();
        assert!((tan(90.0 - left) / expected - 1.0).abs() < 2.0 * f64::EPSILON);
        assert!((tan(45.0) - 1.0).abs() < f64::EPSILON);
    }

    fn strength(tensile_strength: f64) -> Strength {
        Strength {
            cohesion: 10.0,
            friction_angle: 45.0,
            dilatancy_angle: 45.0,
            tensile_strength,
            apex: 10.0,
        }
    }

    #[test]
    fn the_apex_itself_is_a_legal_strength_that_cuts_nothing_off() {
        for (tensile_strength, cut_off) in [(f64::NAN, None), (10.0, None), (9.0, Some(9.0))] {
            assert_eq!(strength(tensile_strength).check(), Ok(()));
            assert_eq!(strength(tensile_strength).cut_off(), cut_off);
        }
        assert_eq!(
            strength(10.1).check().unwrap_err().parameter,
            "tensile_strength"
        );
    }

    #[test]
    fn angles_and_cohesion_go_together() {
        let steep = Strength {
            dilatancy_angle: 46.0,
            ..strength(0.0)
        };
        assert_eq!(steep.check().unwrap_err().parameter, "dilatancy_angle");
        let none = Strength {
            cohesion: 0.0,
            friction_angle: 0.0,
            dilatancy_angle: 0.0,
            ..strength(0.0)
        };
        assert_eq!(none.check().unwrap_err().parameter, "cohesion");
    }
}
