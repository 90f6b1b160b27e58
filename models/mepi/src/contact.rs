//! One update: elastic trial, plastic flow, loss of contact and its return.

use crate::first_root::last_that;
use crate::interface::{Constants, Interface, State};
use crate::return_mapping::{Flow, Increment, Sample};
use crate::substeps::{Path, Sliding};
use abi::reclosure::InContact;
use abi::substepping::Scheme;
use abi::{Failure, InterfacePoint, InterfaceResponse, Tangent};

pub(crate) type Matrix = [[f64; 2]; 2];

/// ∂(`σ_n`, τ)/∂(σ*, τ*) without flow.
const ELASTIC: Matrix = [[1.0, 0.0], [0.0, 1.0]];

/// The part of the increment that acts on a point in contact, compression and contraction positive.
#[derive(Clone, Copy, Debug)]
struct Contact {
    /// `σ_n` and τ at the start.
    sigma: f64,
    tau: f64,
    /// Relative displacement: contraction and slip.
    contraction: f64,
    slip: f64,
    /// ∂slip/∂⟦u⟧.
    slip_by_jump: [f64; 2],
}

impl Contact {
    /// From these stresses on.
    fn of(sigma: f64, tau: f64, part: InContact) -> Self {
        Self {
            sigma,
            tau,
            contraction: -part.opening,
            slip: part.slip,
            slip_by_jump: part.slip_by_jump,
        }
    }
}

/// Carries a point over an increment.
#[inline]
pub(crate) fn update(
    law: &Interface,
    point: &InterfacePoint<State>,
    tangent: Tangent,
) -> Result<InterfaceResponse<State>, Failure> {
    let state = point.state;
    if !(state.sigma_ni > 0.0 && state.plastic_slip >= 0.0) {
        return Err(Failure::Domain(
            "`sigma_ni` must be positive and `plastic_slip` not negative",
        ));
    }
    let constants = law.constants(state.sigma_ni);
    let mut end = match contact(&constants, point) {
        Ok(contact) => close_or_slide(&constants, law.scheme, state, &contact, tangent)?,
        Err(gap) => InterfaceResponse::open(State { gap, ..state }),
    };
    if tangent == Tangent::Elastic {
        // Eq. (6).
        end.tangent = [[constants.K_n, 0.0], [0.0, constants.K_t]];
    }
    Ok(end)
}

/// The part of the increment in contact, or the gap at its end if absent.
#[inline]
fn contact(constants: &Constants, point: &InterfacePoint<State>) -> Result<Contact, f64> {
    let sigma = -point.traction[0];
    let gap = point.state.gap;
    if gap <= 0.0 {
        // A tension carried in enters the trial like any stress outside the surface; what is left
        // of it at the end of the increment becomes a gap.
        let left = -sigma / constants.K_n + point.jump_increment[0];
        if sigma < 0.0 && left >= 0.0 {
            return Err(left);
        }
        let part = InContact::throughout(point.jump_increment);
        return Ok(Contact::of(sigma, point.traction[1], part));
    }
    let part = InContact::after_closure(gap, point.jump_increment)?;
    Ok(Contact::of(0.0, 0.0, part))
}

#[inline]
fn close_or_slide(
    constants: &Constants,
    scheme: Scheme,
    state: State,
    contact: &Contact,
    tangent: Tangent,
) -> Result<InterfaceResponse<State>, Failure> {
    let Constants { K_n, K_t, .. } = *constants;
    let hardening = &constants.hardening;
    let xi = state.plastic_slip;
    // Elastic trial, Eq. (6).
    let sigma_trial = contact.sigma + K_n * contact.contraction;
    let tau_trial = contact.tau + K_t * contact.slip;
    if !(sigma_trial - tau_trial).is_finite() {
        return Err(Failure::Numeric("the elastic predictor overflows"));
    }
    let mu = hardening.friction(hardening.branch(xi), xi).value;
    let increment = Increment {
        constants,
        xi,
        mu,
        sigma: sigma_trial,
        highest: sigma_trial.max(contact.sigma),
        tau: tau_trial.abs(),
    };
    // Eq. (9).
    let strength = mu * sigma_trial;
    let round_off = 4.0 * f64::EPSILON * strength;
    if sigma_trial >= 0.0 && increment.tau <= strength + round_off {
        let (trial, state) = ([sigma_trial, tau_trial], State { gap: 0.0, ..state });
        return Ok(response(constants, contact, trial, state, ELASTIC));
    }
    if scheme != Scheme::Implicit && contact.sigma >= 0.0 {
        return substeps(constants, scheme, state, contact);
    }
    flowed(&increment, state, contact, tau_trial, tangent)
}

/// After plastic flow, as far as it goes.
#[inline]
fn flowed(
    increment: &Increment<'_>,
    state: State,
    contact: &Contact,
    tau_trial: f64,
    tangent: Tangent,
) -> Result<InterfaceResponse<State>, Failure> {
    let constants = increment.constants;
    let sign = 1.0_f64.copysign(tau_trial);
    let (stress, state, by_trial) = match increment.flow()? {
        Flow::Slides(end) => {
            let sigma = end.sigma.max(0.0);
            let by_trial = if tangent == Tangent::Consistent {
                derivative(constants, &end, sign)?
            } else {
                ELASTIC
            };
            let state = slid(state, end.d_lambda, end.contraction);
            ([sigma, sign * end.mu * sigma], state, by_trial)
        }
        Flow::StopsAtPeak(end) => {
            let mut state = slid(state, end.d_lambda, end.contraction);
            if let Some(softening) = constants.hardening.softening {
                state.plastic_slip = softening.u_tp;
            }
            let tau = sign * (increment.tau - constants.K_t * end.d_lambda);
            ([end.sigma, tau], state, ELASTIC)
        }
        Flow::LosesContact { exhausted } => {
            let state = lose_contact(constants, state, contact, increment, exhausted);
            return Ok(InterfaceResponse::open(state));
        }
    };
    Ok(response(constants, contact, stress, state, by_trial))
}

/// The flow by substeps. If it loses contact, the rest of the increment is left to the implicit
/// scheme, which knows how contact is lost.
#[cold]
fn substeps(
    constants: &Constants,
    scheme: Scheme,
    state: State,
    contact: &Contact,
) -> Result<InterfaceResponse<State>, Failure> {
    let path = Path {
        constants,
        contraction: contact.contraction,
        slip: contact.slip,
    };
    let start = Sliding {
        sigma: contact.sigma,
        tau: contact.tau,
        xi: state.plastic_slip,
        contraction: 0.0,
        done: 0.0,
        loses_contact: false,
    };
    let end = path.follow(&start, scheme)?;
    let state = State {
        plastic_contraction: state.plastic_contraction + end.contraction,
        plastic_slip: end.xi,
        gap: 0.0,
        ..state
    };
    if end.loses_contact {
        let left = 1.0 - end.done;
        let rest = Contact {
            sigma: end.sigma,
            tau: end.tau,
            contraction: left * contact.contraction,
            slip: left * contact.slip,
            slip_by_jump: contact.slip_by_jump,
        };
        return close_or_slide(
            constants,
            Scheme::Implicit,
            state,
            &rest,
            Tangent::Consistent,
        );
    }
    let by_trial = path.continuum_tangent(&end)?;
    let stress = [end.sigma, end.tau];
    Ok(response(constants, contact, stress, state, by_trial))
}

/// The state after plastic flow in contact, Eq. (14).
fn slid(state: State, d_lambda: f64, contraction: f64) -> State {
    State {
        plastic_slip: state.plastic_slip + d_lambda,
        gap: 0.0,
        plastic_contraction: state.plastic_contraction + contraction,
        ..state
    }
}

/// The state after contact is lost: `σ_n` = τ = 0 at that moment, and nothing flows afterwards.
#[cold]
fn lose_contact(
    constants: &Constants,
    state: State,
    contact: &Contact,
    increment: &Increment<'_>,
    exhausted: Option<f64>,
) -> State {
    let Constants { K_n, K_t, .. } = *constants;
    // At the fraction s of the increment, τ = 0 and σ_n = 0 with the slip λ that makes τ vanish.
    let lambda = |s: f64| (contact.tau + s * K_t * contact.slip).abs() / K_t;
    let sigma = |s: f64| {
        contact.sigma + s * K_n * contact.contraction - K_n * increment.contraction(lambda(s))
    };
    let d_lambda = if contact.contraction < 0.0 && sigma(1.0) < 0.0 {
        if sigma(0.0) >= 0.0 {
            lambda(last_that(|s| sigma(s) >= 0.0, 0.0, 1.0))
        } else {
            let left = |x: f64| contact.sigma - K_n * increment.contraction(x);
            last_that(|x| left(x) >= 0.0, 0.0, lambda(0.0))
        }
    } else {
        // The contraction uses up the approach of the two faces and no more.
        exhausted.unwrap_or(lambda(1.0))
    };
    let contraction = increment.contraction(d_lambda);
    // Where contact was lost the faces would touch again.
    let gap = if contact.contraction < 0.0 {
        (contraction - increment.sigma / K_n).max(0.0)
    } else {
        0.0
    };
    State {
        gap,
        ..slid(state, d_lambda, contraction)
    }
}

/// ∂(`σ_n`, τ)/∂(σ*, τ*) on the yield surface.
#[inline]
fn derivative(constants: &Constants, end: &Sample, sign: f64) -> Result<Matrix, Failure> {
    let Constants { K_n, K_t, .. } = *constants;
    // Eq. (B).
    let friction = end.mu_slope * end.sigma;
    let coupling = K_n * end.contraction_slope;
    let H = -end.residual_slope;
    if H <= 1e-13 * (K_t + friction.abs() + end.mu * coupling.abs()) {
        return Err(Failure::CutStep {
            factor: 0.5,
            reason: "the response turns back at the end of the increment",
        });
    }
    Ok([
        [(K_t + friction) / H, -sign * coupling / H],
        [sign * end.mu * K_t / H, (friction - end.mu * coupling) / H],
    ])
}

/// Back to the signs of the contract: ∂t/∂⟦u⟧ from ∂(`σ_n`, τ)/∂(σ*, τ*).
#[inline]
fn response(
    constants: &Constants,
    contact: &Contact,
    [sigma, tau]: [f64; 2],
    state: State,
    by_trial: Matrix,
) -> InterfaceResponse<State> {
    let K_n = constants.K_n;
    let [by_normal, by_tangential] = contact.slip_by_jump.map(|d| d * constants.K_t);
    let [[a, b], [c, d]] = by_trial;
    InterfaceResponse {
        traction: [-sigma, tau],
        state,
        tangent: [
            [a * K_n - b * by_normal, -b * by_tangential],
            [d * by_normal - c * K_n, d * by_tangential],
        ],
        unreliable: None,
    }
}
