//! For authors of laws that integrate rate equations: the choice of a scheme, and steps whose size
//! follows from an estimate of their error. A law need not use it.

use crate::descriptor::Parameter;
use crate::law::{Failure, Refusal};

crate::parameters! {
    /// The parameters that a [`Scheme`] is made from: a law includes them behind its own.
    pub struct SchemeParameters {
        /// How the flow is integrated.
        scheme: Parameter::new(c"scheme", c"-")
            .one_of(crate::choices!(c"implicit", c"explicit", c"error_controlled"))
            .default(0.0),
        /// Number of steps of the explicit scheme in an increment, whole.
        substeps: Parameter::new(c"n_s", c"-").at_least(1.0).at_most(1e6).default(10.0),
        /// Relative error that a step of the error-controlled scheme may have.
        scheme_tolerance: Parameter::new(c"ε_s", c"-")
            .above(0.0)
            .below(1.0)
            .usual(1e-10, 1e-2)
            .default(1e-6),
    }
}

/// How a law integrates its rate equations over an increment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scheme {
    /// The end of the increment satisfies the equations.
    Implicit,
    /// Equal steps forward, each from the rates at its start.
    Explicit {
        /// Number of steps, at least 1.
        substeps: u32,
    },
    /// Steps whose estimated error stays below a tolerance.
    ErrorControlled {
        /// Error of a step relative to the values at its end.
        tolerance: f64,
    },
}

impl Scheme {
    /// The scheme that the parameters ask for.
    ///
    /// # Errors
    /// `substeps` is not a whole number, and the scheme needs it.
    pub fn new(parameters: SchemeParameters) -> Result<Self, Refusal> {
        let SchemeParameters {
            scheme,
            substeps,
            scheme_tolerance: tolerance,
        } = parameters;
        if scheme < 0.5 {
            return Ok(Self::Implicit);
        }
        if scheme > 1.5 {
            return Ok(Self::ErrorControlled { tolerance });
        }
        if substeps.fract() != 0.0 || substeps < 1.0 {
            let reason = format!("{substeps} is not a whole number from 1 on");
            return Err(Refusal::new("substeps", reason));
        }
        Ok(Self::Explicit {
            substeps: substeps as u32,
        })
    }
}

/// Attempts after which [`error_controlled`] gives up.
pub const MAX_SUBSTEPS: u32 = 10_000;

/// A step that [`error_controlled`] may accept.
#[derive(Clone, Copy, Debug)]
pub struct Attempt<S> {
    /// What the step ends with.
    pub end: S,
    /// Its estimated error, relative.
    pub error: f64,
}

/// Carries `start` over an increment in steps, each a fraction of it. `attempt` takes a step of a
/// fraction in (0, 1] and estimates its error, assumed to grow with the square of the step as in
/// the modified Euler method. A step above the tolerance is repeated smaller; the next one is as
/// large as the error permits. Does not allocate.
///
/// # Errors
/// [`Failure::CutStep`] with the fraction done, after [`MAX_SUBSTEPS`] attempts; the failure of
/// `attempt`.
pub fn error_controlled<S: Copy>(
    start: S,
    tolerance: f64,
    mut attempt: impl FnMut(&S, f64) -> Result<Attempt<S>, Failure>,
) -> Result<S, Failure> {
    /// Keeps the next step clear of the tolerance.
    const SAFETY: f64 = 0.9;
    let (mut state, mut done, mut step) = (start, 0.0, 1.0);
    let mut growth = 2.0;
    for _ in 0..MAX_SUBSTEPS {
        let Attempt { end, error } = attempt(&state, step)?;
        // An error that is not a number counts as too large.
        let factor = SAFETY * (tolerance / error.max(f64::MIN_POSITIVE)).sqrt();
        if error <= tolerance {
            state = end;
            done += step;
            if done >= 1.0 {
                return Ok(state);
            }
            step *= factor.clamp(0.1, growth);
            growth = 2.0;
        } else {
            step *= if factor.is_nan() {
                0.1
            } else {
                factor.clamp(0.1, 0.9)
            };
            // Where a step has failed, the next one does not grow.
            growth = 1.0;
        }
        // The last step ends exactly at 1, and none is left that rounding would swallow.
        if step > 1.0 - done || 1.0 - done - step < 1e-12 {
            step = 1.0 - done;
        }
    }
    Err(Failure::CutStep {
        factor: done,
        reason: "the substeps that the tolerance asks for are too many",
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::descriptor::Parameters;

    /// Modified Euler on y' = −5 y, y(0) = 1.
    fn decay(tolerance: f64) -> Result<f64, Failure> {
        error_controlled(1.0, tolerance, |y, step| {
            let first = -5.0 * y * step;
            let second = -5.0 * (y + first) * step;
            let end = y + 0.5 * (first + second);
            let error = (0.5 * (second - first) / end).abs();
            Ok(Attempt { end, error })
        })
    }

    #[test]
    fn meets_the_tolerance_on_a_decay() {
        for tolerance in [1e-3, 1e-4, 1e-5, 1e-6] {
            let y = decay(tolerance).unwrap();
            let error = (y / (-5.0_f64).exp() - 1.0).abs();
            assert!(error < 10.0 * tolerance, "{error:e} at {tolerance:e}");
        }
    }

    #[test]
    fn gives_up_with_the_fraction_done() {
        let failure = decay(1e-12).unwrap_err();
        assert!(matches!(failure, Failure::CutStep { factor, .. } if factor > 0.0 && factor < 1.0));
    }

    #[test]
    fn ends_exactly_at_the_end() {
        let sum = error_controlled(0.0, 1e-3, |sum, step| {
            Ok(Attempt {
                end: sum + step,
                error: if step > 0.3 { 1.0 } else { 1e-4 },
            })
        });
        assert!((sum.unwrap() - 1.0_f64).abs() < 1e-15);
    }

    #[test]
    fn an_error_that_is_no_number_is_too_large() {
        let failure = error_controlled(0.0, 1e-3, |_, _| {
            Ok(Attempt {
                end: 1.0,
                error: f64::NAN,
            })
        });
        assert!(failure.is_err());
    }

    #[test]
    fn reads_the_three_parameters() {
        let tolerance = 1e-3;
        let of =
            |scheme, substeps| Scheme::new(SchemeParameters::read(&[scheme, substeps, tolerance]));
        assert_eq!(of(0.0, 2.5), Ok(Scheme::Implicit));
        assert_eq!(of(1.0, 7.0), Ok(Scheme::Explicit { substeps: 7 }));
        assert_eq!(of(2.0, 2.5), Ok(Scheme::ErrorControlled { tolerance }));
        assert!(of(1.0, 2.5).unwrap_err().parameter == "substeps");
    }
}
