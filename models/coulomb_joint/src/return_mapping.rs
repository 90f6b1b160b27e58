//! Elastic trial, return to the friction line, opening. Tension and opening positive throughout.

use crate::{CoulombJoint, State};
use abi::InterfaceResponse;
use abi::reclosure::InContact;

/// Strength of a joint, intact or broken.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Strength {
    /// c.
    pub(crate) cohesion: f64,
    /// `R_t`.
    pub(crate) tensile: f64,
    /// tan φ.
    pub(crate) tan_phi: f64,
    /// tan ψ.
    pub(crate) tan_psi: f64,
}

/// The part of the increment that acts on a joint in contact.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Contact {
    /// Traction at the start.
    pub(crate) traction: [f64; 2],
    /// Relative displacement.
    pub(crate) part: InContact,
    pub(crate) strength: Strength,
}

impl CoulombJoint {
    /// Carries a joint in contact over its part of the increment.
    #[inline]
    pub(crate) fn carry(&self, state: State, contact: &Contact) -> InterfaceResponse<State> {
        let (k_n, k_t) = (self.normal_stiffness, self.shear_stiffness);
        let Strength {
            cohesion,
            tensile,
            tan_phi,
            tan_psi,
        } = contact.strength;
        // Eq. (1).
        let normal = contact.traction[0] + k_n * contact.part.opening;
        let shear = contact.traction[1] + k_t * contact.part.slip;
        let closed = State { gap: 0.0, ..state };
        // Eq. (2).
        let excess = shear.abs() + normal * tan_phi - cohesion;
        let round_off = 4.0 * f64::EPSILON * (cohesion + (normal * tan_phi).abs());
        if excess <= round_off && normal <= tensile {
            let tangent = [[k_n, 0.0], [0.0, k_t]];
            return contact.part.response([normal, shear], closed, tangent);
        }
        // Eq. (4).
        let resistance = k_t + k_n * tan_phi * tan_psi;
        let d_lambda = excess.max(0.0) / resistance;
        // Eq. (3).
        let returned = normal - k_n * tan_psi * d_lambda;
        if returned > tensile || cohesion - returned * tan_phi < 0.0 {
            return InterfaceResponse::open(self.lose_contact(state, contact));
        }
        let sign = 1.0_f64.copysign(shear);
        let traction = [returned, sign * (cohesion - returned * tan_phi)];
        // Eq. (5).
        let tangent = [
            [
                k_n * k_t / resistance,
                -sign * k_n * k_t * tan_psi / resistance,
            ],
            [
                -sign * k_n * k_t * tan_phi / resistance,
                k_n * k_t * tan_phi * tan_psi / resistance,
            ],
        ];
        let end = slid(closed, d_lambda, tan_psi);
        contact.part.response(traction, end, tangent)
    }

    /// The state after the joint has opened: the flow until then counts, Eq. (6).
    #[cold]
    fn lose_contact(&self, state: State, contact: &Contact) -> State {
        let Strength { tan_psi, .. } = contact.strength;
        let d_lambda = self.slip_before_opening(contact);
        let dilation = tan_psi * d_lambda;
        // From the position of contact without stress.
        let gap = contact.traction[0] / self.normal_stiffness + contact.part.opening - dilation;
        State {
            gap: gap.max(0.0),
            broken: 1.0,
            ..slid(state, d_lambda, tan_psi)
        }
    }

    /// Δλ from the start of the increment to the moment when `t_n` reaches the tensile strength.
    /// Rates are constant before and after yielding, so this is exact on a straight path.
    fn slip_before_opening(&self, contact: &Contact) -> f64 {
        let (k_n, k_t) = (self.normal_stiffness, self.shear_stiffness);
        let Strength {
            cohesion,
            tensile,
            tan_phi,
            tan_psi,
        } = contact.strength;
        let [normal, shear] = contact.traction;
        let (normal_rate, shear_rate) = (k_n * contact.part.opening, k_t * contact.part.slip);
        let opens_elastically = if normal < tensile && normal_rate > 0.0 {
            (tensile - normal) / normal_rate
        } else {
            0.0
        };
        // F = max over both signs of ±τ + t_n tan φ − c: the first that reaches zero yields.
        let mut yields = f64::INFINITY;
        // From there: growth of F, rate of τ in the direction of slip, and t_n still to go to R_t.
        let (mut growth, mut along, mut left) = (0.0, 0.0, 0.0);
        for sign in [1.0, -1.0] {
            let start = sign * shear + normal * tan_phi - cohesion;
            let rate = sign * shear_rate + normal_rate * tan_phi;
            let at = if start >= 0.0 { 0.0 } else { -start / rate };
            if rate > 0.0 && at < yields {
                (yields, growth, along) = (at, rate, sign * shear_rate);
                // On F = 0 a steep line gives t_n from τ with more digits than its own path does.
                let reached = if start < 0.0 && tan_phi > 1.0 {
                    (cohesion - sign * (shear + at * shear_rate)) / tan_phi
                } else {
                    normal + at * normal_rate
                };
                left = tensile - reached;
            }
        }
        if opens_elastically <= yields {
            return 0.0;
        }
        // The rate of t_n on F = 0 times K_t + K_n tan φ tan ψ, where terms in tan φ cancel.
        let opening_rate = normal_rate * k_t - k_n * tan_psi * along;
        if opening_rate > 0.0 && left > 0.0 {
            growth * left / opening_rate
        } else {
            0.0
        }
    }
}

/// The state after plastic flow, Eq. (3).
fn slid(state: State, d_lambda: f64, tan_psi: f64) -> State {
    State {
        plastic_slip: state.plastic_slip + d_lambda,
        plastic_opening: state.plastic_opening + tan_psi * d_lambda,
        ..state
    }
}
