//! For authors of interface laws whose faces part: what of an increment acts once they touch again.
//! A law need not use it.

use crate::law::InterfaceResponse;

/// The part of an increment in contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InContact {
    /// Relative displacement in contact: opening, negative where the faces are pressed together, and slip.
    pub opening: f64,
    /// See `opening`.
    pub slip: f64,
    /// ∂slip/∂⟦u⟧: slip before the contact re-forms does not act.
    pub slip_by_jump: [f64; 2],
}

impl InContact {
    /// The traction, kPa, from which a point goes on in contact, and the part of its increment Δ⟦u⟧ there: without
    /// stress after it has closed a gap g > 0, else from its `traction` throughout.
    ///
    /// # Errors
    /// The gap at the end, if it does not close.
    #[inline]
    pub fn from(
        gap: f64,
        traction: [f64; 2],
        jump_increment: [f64; 2],
    ) -> Result<([f64; 2], Self), f64> {
        if gap > 0.0 {
            return Ok(([0.0; 2], Self::after_closure(gap, jump_increment)?));
        }
        Ok((traction, Self::throughout(jump_increment)))
    }

    /// The response of a law whose `tangent` is by what acts in contact, opening and slip.
    #[inline]
    pub fn response<S>(
        &self,
        traction: [f64; 2],
        state: S,
        [[a, b], [c, d]]: [[f64; 2]; 2],
    ) -> InterfaceResponse<S> {
        let [by_normal, by_tangential] = self.slip_by_jump;
        InterfaceResponse {
            traction,
            state,
            tangent: [
                [a + b * by_normal, b * by_tangential],
                [c + d * by_normal, d * by_tangential],
            ],
            unreliable: None,
        }
    }

    /// The whole increment of a point whose faces touch from its start on.
    #[inline]
    pub fn throughout([opening, slip]: [f64; 2]) -> Self {
        Self {
            opening,
            slip,
            slip_by_jump: [0.0, 1.0],
        }
    }

    /// The rest of an increment Δ⟦u⟧ after it has closed a gap g > 0. The path within the increment
    /// is straight, so contact re-forms at the fraction −g/`Δ[u_n]` of it, where `g + Δ[u_n]` of the
    /// opening and `f = 1 + g/Δ[u_n]` of the slip are left; ∂f/∂`[u_n]` = −g/`Δ[u_n]²`.
    ///
    /// # Errors
    /// The gap at the end, if it does not close.
    #[inline]
    pub fn after_closure(gap: f64, [opening, slip]: [f64; 2]) -> Result<Self, f64> {
        if gap + opening >= 0.0 {
            return Err(gap + opening);
        }
        let fraction = 1.0 + gap / opening;
        Ok(Self {
            opening: gap + opening,
            slip: slip * fraction,
            slip_by_jump: [-slip * gap / (opening * opening), fraction],
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Powers of two, so that every number below is exact: half of the increment closes the gap.
    #[test]
    fn the_part_after_closure_acts() {
        let contact = InContact::after_closure(0.25, [-0.5, 2.0]);
        let expected = InContact {
            opening: -0.25,
            slip: 1.0,
            slip_by_jump: [-2.0, 0.5],
        };
        assert_eq!(contact, Ok(expected));
    }

    #[test]
    fn a_gap_that_stays_open_is_told() {
        assert_eq!(InContact::after_closure(0.25, [-0.125, 2.0]), Err(0.125));
        assert_eq!(InContact::after_closure(0.25, [-0.25, 2.0]), Err(0.0));
    }

    /// ∂slip/∂`[u_n]` against a central difference of step h = 2⁻¹⁰. Slip s (1 + g/u) has the third
    /// derivative −6 s g/u⁴, so the difference is off by h²/6 times that, |s g| h²/u⁴. The fifth
    /// derivative adds a part (h/u)² of it.
    #[test]
    fn the_derivative_is_that_of_the_slip() {
        let (g, u, s, h) = (0.25, -0.5, 2.0, 1.0 / 1024.0);
        let slip = |u| InContact::after_closure(g, [u, s]).unwrap().slip;
        let difference = (slip(u + h) - slip(u - h)) / (2.0 * h);
        let exact = InContact::after_closure(g, [u, s]).unwrap().slip_by_jump[0];
        let off = s * g * h * h / (u * u * u * u);
        assert!(
            (difference - exact).abs() < 1.01 * off,
            "{difference} {exact}"
        );
    }

    #[test]
    fn in_contact_everything_acts() {
        let expected = InContact {
            opening: -0.5,
            slip: 2.0,
            slip_by_jump: [0.0, 1.0],
        };
        assert_eq!(InContact::throughout([-0.5, 2.0]), expected);
    }
}
