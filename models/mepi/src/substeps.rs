//! The rate equations, integrated by substeps: Eq. (C) to (E).
//!
//! | symbol | here | |
//! |---|---|---|
//! | `[Δu_n]`, `[Δu_t]` | `contraction`, `slip` of [`Path`] | over the whole increment |

use crate::contact::Matrix;
use crate::first_root::last_that;
use crate::hardening::Jet;
use crate::interface::Constants;
use abi::Failure;
use abi::substepping::{Attempt, Scheme, error_controlled};

/// A straight increment in contact, compression and contraction positive.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Path<'a> {
    pub(crate) constants: &'a Constants,
    pub(crate) contraction: f64,
    pub(crate) slip: f64,
}

/// A point on the way.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sliding {
    pub(crate) sigma: f64,
    pub(crate) tau: f64,
    pub(crate) xi: f64,
    /// Plastic contraction of this increment.
    pub(crate) contraction: f64,
    /// Fraction of the increment.
    pub(crate) done: f64,
    /// The next step would lose contact.
    pub(crate) loses_contact: bool,
}

/// Rates at one point of the way.
struct Rates {
    sign: f64,
    mu: Jet,
    beta: f64,
    H: f64,
}

impl Path<'_> {
    /// From the start to the end of the increment (`done` = 1), or to where contact is about to be
    /// lost.
    ///
    /// # Errors
    /// The rate equations have no solution; too many steps.
    pub(crate) fn follow(&self, start: &Sliding, scheme: Scheme) -> Result<Sliding, Failure> {
        let substeps = match scheme {
            Scheme::Implicit => return Ok(*start),
            Scheme::Explicit { substeps } => Some(substeps),
            Scheme::ErrorControlled { .. } => None,
        };
        let start = self.on_surface(*start)?;
        let at_yield = self.elastic(&start, self.yield_fraction(&start));
        let left = 1.0 - at_yield.done;
        let mut at = at_yield;
        if let Scheme::ErrorControlled { tolerance } = scheme {
            let nearly_lost = LAST_SHARE * at.sigma;
            at = error_controlled(at, tolerance, |from, step| {
                self.modified_euler(from, step * left, nearly_lost)
            })?;
        }
        for _ in 0..substeps.unwrap_or(0) {
            let next = self.euler(
                &at,
                &self.rates(&at)?,
                left * (1.0 / f64::from(substeps.unwrap_or(1))),
            );
            if next.sigma < 0.0 {
                at.loses_contact = true;
                break;
            }
            at = next;
        }
        if !at.loses_contact {
            at.done = 1.0;
        }
        Ok(at)
    }

    /// The fraction of the increment after which Eq. (9) is violated. F is convex along the path.
    fn yield_fraction(&self, start: &Sliding) -> f64 {
        // More than `on_surface` leaves.
        const ROUNDING: f64 = 1e-13;
        let mu = self.friction(start.xi).value;
        let admissible = |fraction: f64| {
            let Sliding { sigma, tau, .. } = self.elastic(start, fraction);
            tau.abs() <= mu * sigma * (1.0 + ROUNDING)
        };
        if admissible(0.0) {
            last_that(admissible, 0.0, 1.0)
        } else {
            0.0
        }
    }

    /// Eq. (6) without flow.
    fn elastic(&self, from: &Sliding, fraction: f64) -> Sliding {
        Sliding {
            sigma: from.sigma + fraction * self.constants.K_n * self.contraction,
            tau: from.tau + fraction * self.constants.K_t * self.slip,
            done: from.done + fraction,
            ..*from
        }
    }

    fn friction(&self, xi: f64) -> Jet {
        let hardening = &self.constants.hardening;
        hardening.friction(hardening.branch(xi), xi)
    }

    /// # Errors
    /// H ≤ 0: softening or dilatancy is steeper than the elastic springs.
    fn rates(&self, at: &Sliding) -> Result<Rates, Failure> {
        let Constants { K_n, K_t, .. } = *self.constants;
        let mu = self.friction(at.xi);
        let beta = self.constants.hardening.contraction_rate(mu, at.xi).value;
        // Eq. (C).
        let H = K_t + mu.slope * at.sigma - mu.value * K_n * beta;
        if H <= 0.0 {
            return Err(Failure::Domain(
                "the rate equations have no solution here; `scheme = \"implicit\"` jumps across",
            ));
        }
        // Without an elastic range the first slip decides.
        let driving = if at.tau == 0.0 { self.slip } else { at.tau };
        Ok(Rates {
            sign: 1.0_f64.copysign(driving),
            mu,
            beta,
            H,
        })
    }

    /// Eq. (D): a step forward with these rates.
    fn euler(&self, at: &Sliding, rates: &Rates, fraction: f64) -> Sliding {
        let Constants { K_n, K_t, .. } = *self.constants;
        let towards = rates.sign * K_t * self.slip - rates.mu.value * K_n * self.contraction;
        let d_lambda = (fraction * towards / rates.H).max(0.0);
        self.elastic(at, fraction)
            .flowed(self.constants, rates, d_lambda)
    }

    /// Eq. (E): the mean of the rates at the start and at the end of a step forward, then back to
    /// the surface; half the difference is the error. If `σ_n` is down to `nearly_lost`, a step may
    /// lose contact.
    fn modified_euler(
        &self,
        from: &Sliding,
        fraction: f64,
        nearly_lost: f64,
    ) -> Result<Attempt<Sliding>, Failure> {
        let attempt = |end, error| Ok(Attempt { end, error });
        if from.loses_contact {
            return attempt(*from, 0.0);
        }
        let first = self.euler(from, &self.rates(from)?, fraction);
        if first.sigma < 0.0 {
            // Approached by ever smaller steps, then left to the implicit scheme.
            let close = from.sigma <= nearly_lost;
            let mut end = *from;
            end.loses_contact = true;
            return attempt(end, if close { 0.0 } else { f64::INFINITY });
        }
        // A step so long that the rates at its end mean nothing is repeated smaller.
        let Ok(rates) = self.rates(&first) else {
            return attempt(*from, f64::INFINITY);
        };
        let second = self.euler(&first, &rates, fraction);
        let mean = |a: f64, b: f64| 0.5 * (a + b);
        let mut end = Sliding {
            sigma: mean(from.sigma, second.sigma),
            tau: mean(from.tau, second.tau),
            xi: mean(from.xi, second.xi),
            contraction: mean(from.contraction, second.contraction),
            done: first.done,
            loses_contact: false,
        };
        // Half of (second − first) − (first − from).
        let off = |a: f64, b: f64, c: f64| 0.5 * (c - 2.0 * b + a).abs();
        let stress = off(from.sigma, first.sigma, second.sigma)
            .hypot(off(from.tau, first.tau, second.tau))
            / end.sigma.hypot(end.tau);
        let slip = off(from.xi, first.xi, second.xi) / end.xi;
        if end.xi > from.xi {
            end = self.on_surface(end)?;
        }
        attempt(
            end,
            if end.xi > 0.0 {
                stress.max(slip)
            } else {
                stress
            },
        )
    }

    /// ∂(`σ_n`, τ)/∂(σ*, τ*) of the rate equations at the end of the increment.
    ///
    /// # Errors
    /// They have no solution there.
    pub(crate) fn continuum_tangent(&self, end: &Sliding) -> Result<Matrix, Failure> {
        let Constants { K_n, K_t, .. } = *self.constants;
        let Rates { sign, mu, beta, H } = self.rates(end)?;
        let towards = sign * K_t * self.slip - mu.value * K_n * self.contraction;
        if towards <= 0.0 {
            return Ok([[1.0, 0.0], [0.0, 1.0]]);
        }
        // dλ = (sign dτ* − μ dσ*)/H.
        let [by_sigma, by_tau] = [-mu.value / H, sign / H];
        Ok([
            [1.0 - K_n * beta * by_sigma, -K_n * beta * by_tau],
            [-sign * K_t * by_sigma, 1.0 - sign * K_t * by_tau],
        ])
    }

    /// Newton's method back to the surface from outside, along the flow at fixed displacement.
    fn on_surface(&self, mut at: Sliding) -> Result<Sliding, Failure> {
        for _ in 0..MAX_CORRECTIONS {
            let rates = self.rates(&at)?;
            let outside = at.tau.abs() - rates.mu.value * at.sigma;
            if outside <= 1e-14 * at.tau.abs() {
                break;
            }
            at = at.flowed(self.constants, &rates, outside / rates.H);
        }
        Ok(at)
    }
}

/// Drift within tolerance needs two corrections; a start far outside needs more.
const MAX_CORRECTIONS: usize = 20;

/// The part of the normal stress over which contact may be lost without an estimate of the error.
const LAST_SHARE: f64 = 1e-3;

impl Sliding {
    /// After plastic flow, Eq. (6) and (14).
    fn flowed(self, constants: &Constants, rates: &Rates, d_lambda: f64) -> Self {
        Self {
            sigma: self.sigma - constants.K_n * rates.beta * d_lambda,
            tau: self.tau - rates.sign * constants.K_t * d_lambda,
            xi: self.xi + d_lambda,
            contraction: self.contraction + rates.beta * d_lambda,
            ..self
        }
    }
}
