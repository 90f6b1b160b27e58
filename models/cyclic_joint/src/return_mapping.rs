//! Elastic trial, return to the friction that the slip has left, loss of contact. Compression and
//! contraction are positive here, as in `LAW.md`.

use crate::{CyclicJoint, State};
use abi::reclosure::InContact;
use abi::{Failure, InterfaceResponse};

/// Newton's method takes a handful of iterations, one for each bit next to a double root.
const MAX_ITERATIONS: usize = 200;
/// Residual of g over `|τ*|`.
const CONVERGED: f64 = 1e-11;

/// A joint in contact over its part of the increment.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Contact {
    /// Traction at the start, normal first, tension positive.
    pub(crate) traction: [f64; 2],
    /// Relative displacement.
    pub(crate) part: InContact,
    pub(crate) state: State,
}

/// State of the joint after a slip, with derivatives.
#[derive(Clone, Copy, Debug)]
struct Faded {
    /// μ.
    friction: f64,
    /// dμ/dξ.
    friction_slope: f64,
    /// Δc, m.
    contraction: f64,
    /// β = dc/dξ.
    contraction_rate: f64,
}

/// The elastic trial of Eq. (1).
#[derive(Clone, Copy, Debug)]
struct Trial {
    /// `σ_n*`.
    sigma: f64,
    /// `τ*`.
    tau: f64,
}

impl CyclicJoint {
    /// Carries a joint in contact.
    ///
    /// # Errors
    /// A smaller increment is asked for where the return has no tangent.
    #[inline]
    pub(crate) fn carry(&self, contact: &Contact) -> Result<InterfaceResponse<State>, Failure> {
        let (k_n, k_t) = (self.normal_stiffness, self.shear_stiffness);
        let Contact {
            traction,
            part,
            state,
        } = *contact;
        // Eq. (1).
        let trial = Trial {
            sigma: -(traction[0] + k_n * part.opening),
            tau: traction[1] + k_t * part.slip,
        };
        if trial.sigma < 0.0 {
            return Ok(self.open(contact, &trial));
        }
        // Eq. (2).
        let start = self.faded(state.plastic_slip, 0.0);
        if trial.tau.abs() <= start.friction * trial.sigma * (1.0 + 4.0 * f64::EPSILON) {
            let closed = State { gap: 0.0, ..state };
            let tangent = [[k_n, 0.0], [0.0, k_t]];
            return Ok(part.response([-trial.sigma, trial.tau], closed, tangent));
        }
        let Some(d_xi) = self.slip_to_surface(&trial, state.plastic_slip)? else {
            return Ok(self.open(contact, &trial));
        };
        let end = self.faded(state.plastic_slip, d_xi);
        let sigma = trial.sigma - k_n * end.contraction;
        let sign = 1.0_f64.copysign(trial.tau);
        let tangent = self.tangent(&end, sigma, sign)?;
        let state = State {
            plastic_slip: state.plastic_slip + d_xi,
            plastic_contraction: state.plastic_contraction + end.contraction,
            gap: 0.0,
        };
        // On the surface to the last bit.
        let traction = [-sigma, sign * end.friction * sigma];
        Ok(part.response(traction, state, tangent))
    }

    /// Eq. (7) on the surface.
    ///
    /// # Errors
    /// A smaller increment is asked for where there is none.
    #[inline]
    fn tangent(&self, end: &Faded, sigma: f64, sign: f64) -> Result<[[f64; 2]; 2], Failure> {
        let (k_n, k_t) = (self.normal_stiffness, self.shear_stiffness);
        let resistance = resistance(self, end, sigma);
        if resistance <= 0.0 {
            return Err(NO_TANGENT);
        }
        let by_opening = k_n * end.friction / resistance;
        let by_slip = sign * k_t / resistance;
        Ok([
            [
                k_n * (1.0 + end.contraction_rate * by_opening),
                k_n * end.contraction_rate * by_slip,
            ],
            [-sign * k_t * by_opening, k_t * (1.0 - k_t / resistance)],
        ])
    }

    /// Eq. (3), (4) after a further slip.
    #[inline]
    fn faded(&self, xi: f64, d_xi: f64) -> Faded {
        let to_lose = self.friction_to_lose * (-(xi + d_xi) / self.friction_slip).exp();
        let rate = self.contraction_rate * (-xi / self.contraction_slip).exp();
        let change = (-d_xi / self.contraction_slip).exp_m1();
        Faded {
            friction: self.residual_friction + to_lose,
            friction_slope: -to_lose / self.friction_slip,
            contraction: -rate * self.contraction_slip * change,
            contraction_rate: rate * (1.0 + change),
        }
    }

    /// The further slip by which so much contraction has come, by Eq. (4), if it ever does.
    fn slip_of(&self, contraction: f64, xi: f64) -> Option<f64> {
        // Also of a joint that no longer contracts.
        if contraction <= 0.0 {
            return Some(0.0);
        }
        let rate = self.contraction_rate * (-xi / self.contraction_slip).exp();
        let share = contraction / (rate * self.contraction_slip);
        (share < 1.0).then(|| -self.contraction_slip * (-share).ln_1p())
    }

    /// The root of Eq. (6); `None` if contraction uses up the normal stress before. For `σ_n ≥ 0`, g is
    /// concave and starts above zero, so that Newton's method descends to its only root from any point
    /// beyond.
    ///
    /// # Errors
    /// A smaller increment is asked for where rounding hides the root.
    #[inline]
    fn slip_to_surface(&self, trial: &Trial, xi: f64) -> Result<Option<f64>, Failure> {
        let (k_n, k_t) = (self.normal_stiffness, self.shear_stiffness);
        let tau = trial.tau.abs();
        let mut d_xi = tau / k_t;
        if self
            .slip_of(trial.sigma / k_n, xi)
            .is_some_and(|exhausted| exhausted < d_xi)
        {
            return Ok(None);
        }
        for _ in 0..MAX_ITERATIONS {
            let at = self.faded(xi, d_xi);
            let sigma = trial.sigma - k_n * at.contraction;
            let g = tau - k_t * d_xi - at.friction * sigma;
            let next = d_xi + g / resistance(self, &at, sigma);
            if next >= 0.0 && next < d_xi {
                d_xi = next;
            } else if g.abs() <= CONVERGED * tau {
                return Ok(Some(d_xi));
            } else {
                break;
            }
        }
        Err(NO_TANGENT)
    }

    /// The state after loss of contact: the slip until then counts.
    #[cold]
    fn open(&self, contact: &Contact, trial: &Trial) -> InterfaceResponse<State> {
        let Contact {
            traction,
            part,
            state,
        } = *contact;
        let k_n = self.normal_stiffness;
        let xi = state.plastic_slip;
        let slip_at = |s: f64| (traction[1] / self.shear_stiffness + s * part.slip).abs();
        let d_xi = if part.opening > 0.0 {
            // Eq. (8).
            let is_lost = |s: f64| {
                let contraction = self.faded(xi, slip_at(s)).contraction;
                -traction[0] - k_n * (s * part.opening + contraction) <= 0.0
            };
            let (mut low, mut high) = (0.0, 1.0);
            if is_lost(0.0) {
                high = 0.0;
            }
            for _ in 0..BISECTIONS {
                let middle = 0.5 * (low + high);
                if is_lost(middle) {
                    high = middle;
                } else {
                    low = middle;
                }
            }
            slip_at(high)
        } else {
            slip_at(1.0)
        };
        // No more than the normal stress has had to give.
        let most = (-traction[0]).max(trial.sigma).max(0.0) / k_n;
        let d_xi = self.slip_of(most, xi).map_or(d_xi, |slip| slip.min(d_xi));
        let contraction = self.faded(xi, d_xi).contraction;
        InterfaceResponse::open(State {
            plastic_slip: xi + d_xi,
            plastic_contraction: state.plastic_contraction + contraction,
            gap: (contraction - trial.sigma / k_n).max(0.0),
        })
    }
}

/// Halvings of the increment that leave nothing of it.
const BISECTIONS: usize = 60;

const NO_TANGENT: Failure = Failure::CutStep {
    factor: f64::NAN,
    reason: "friction and normal stress fade as steeply as the springs let go",
};

/// H = −dg/dΔξ.
#[inline]
fn resistance(law: &CyclicJoint, at: &Faded, sigma: f64) -> f64 {
    law.shear_stiffness + at.friction_slope * sigma
        - at.friction * law.normal_stiffness * at.contraction_rate
}
