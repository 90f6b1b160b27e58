//! How far a correction is followed.
//!
//! The longest of a few fractions is taken that does not make the residual grow. A law that fails is
//! treated like a residual that grows: it may only have been asked for too much.

use super::Newton;
use super::failure::{Reason, StepFailure};
use super::iterate::{Control, Correction, State};
use super::outcome::Iteration;
use law::Operator;

/// The fractions tried, and the choice if all make the residual grow.
#[derive(Clone, Copy, Debug)]
pub(in crate::equilibrium) struct LineSearch {
    /// Fractions of the correction, the longest first.
    pub(in crate::equilibrium) lengths: &'static [f64],
    /// A relative residual that does not count as grown.
    pub(in crate::equilibrium) enough: f64,
    pub(in crate::equilibrium) otherwise: Otherwise,
}

/// The choice if the residual grows at every length.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::equilibrium) enum Otherwise {
    /// The fraction with the smallest residual. Fails only if a law does at every one.
    Best,
    /// The shortest fraction.
    Shortest,
}

/// What a search ends with.
#[derive(Debug)]
struct Found {
    length: f64,
    state: State,
    /// It is the last one that was tried: the groups hold it.
    is_held: bool,
}

impl LineSearch {
    /// Searches the states at these lengths. A step that is stopped ends the search.
    fn among(
        self,
        mut at: impl FnMut(f64) -> Result<State, StepFailure>,
    ) -> Result<Found, StepFailure> {
        let mut best: Option<Found> = None;
        let mut first_failure = None;
        for (number, &length) in self.lengths.iter().enumerate() {
            let is_shortest = number + 1 == self.lengths.len();
            let taken = |state| Found {
                length,
                state,
                is_held: true,
            };
            match at(length) {
                Ok(state) if state.balance.relative <= self.enough => return Ok(taken(state)),
                Err(failure) if failure.is_stop() => return Err(failure),
                outcome if is_shortest && self.otherwise == Otherwise::Shortest => {
                    return outcome.map(taken);
                }
                Ok(state) => {
                    // What is no number is no answer while another one is.
                    let size = |state: &State| {
                        let relative = state.balance.relative;
                        if relative.is_nan() {
                            f64::INFINITY
                        } else {
                            relative
                        }
                    };
                    let least = best.as_ref().map(|best| size(&best.state));
                    if least.is_none_or(|least| size(&state) < least) {
                        best = Some(Found {
                            is_held: false,
                            ..taken(state)
                        });
                    }
                }
                Err(failure) => first_failure = first_failure.or(Some(failure)),
            }
        }
        best.ok_or_else(|| first_failure.unwrap_or_else(|| Reason::NoState.into()))
    }
}

impl Newton<'_> {
    /// Follows a correction from an iterate: the fraction taken, for the log, and the iterate there. If the step
    /// probably `ends` with it, tangents are left out.
    pub(in crate::equilibrium) fn search(
        &mut self,
        control: &impl Control,
        from: &State,
        correction: &Correction,
        ends: bool,
    ) -> Result<(Iteration, State), StepFailure> {
        let mut search = control.line_search(self, from);
        if !self.settings.line_search {
            search.lengths = &search.lengths[..1];
        }
        let operator = if ends {
            Operator::None
        } else {
            self.operator()
        };
        let found = search.among(|length| {
            self.may_go_on()?;
            control.evaluate(self, from.moved_by(length, correction), operator)
        })?;
        let mut state = found.state;
        if !found.is_held {
            // The groups hold the state of the last fraction tried. Another correction follows.
            let operator = self.operator();
            state = control.evaluate(self, (state.increment, state.rise), operator)?;
        }
        let taken = self.took(&state, &correction.increment, found.length);
        Ok((taken, state))
    }
}

#[cfg(test)]
mod tests {
    use super::super::residual::Balance;
    use super::*;
    use approx::assert_relative_eq;

    fn search(otherwise: Otherwise) -> LineSearch {
        LineSearch {
            lengths: &[1.0, 0.5, 0.25],
            enough: 1.0,
            otherwise,
        }
    }

    /// A search among states with these residuals; a law fails at the missing ones.
    fn among(otherwise: Otherwise, residuals: [Option<f64>; 3]) -> (usize, Option<(f64, bool)>) {
        let mut tried = 0;
        let found = search(otherwise).among(|_| {
            let relative = residuals[tried];
            tried += 1;
            let balance = |relative| Balance {
                relative,
                ..Balance::default()
            };
            relative.map_or(Err(Reason::Singular(None).into()), |relative| {
                Ok(State {
                    increment: Vec::new(),
                    rise: 0.0,
                    balance: balance(relative),
                })
            })
        });
        (tried, found.ok().map(|found| (found.length, found.is_held)))
    }

    #[test]
    fn the_longest_fraction_that_does_not_make_the_residual_grow_is_taken() {
        for otherwise in [Otherwise::Best, Otherwise::Shortest] {
            assert_eq!(
                among(otherwise, [Some(1.0), Some(0.1), Some(0.1)]),
                (1, Some((1.0, true)))
            );
            assert_eq!(
                among(otherwise, [Some(2.0), None, Some(0.5)]),
                (3, Some((0.25, true)))
            );
        }
    }

    #[test]
    fn where_all_grow_the_best_or_the_shortest_is_taken() {
        let residuals = [Some(3.0), Some(2.0), Some(4.0)];
        assert_eq!(among(Otherwise::Best, residuals), (3, Some((0.5, false))));
        assert_eq!(
            among(Otherwise::Shortest, residuals),
            (3, Some((0.25, true)))
        );
    }

    #[test]
    fn a_residual_that_is_no_number_is_not_the_best() {
        let residuals = [Some(f64::NAN), Some(4.0), Some(3.0)];
        assert_eq!(among(Otherwise::Best, residuals), (3, Some((0.25, false))));
    }

    #[test]
    fn a_law_that_fails_ends_the_search_only_if_nothing_is_left() {
        let residuals = [Some(3.0), None, None];
        assert_eq!(among(Otherwise::Best, residuals), (3, Some((1.0, false))));
        assert_eq!(among(Otherwise::Shortest, residuals), (3, None));
        assert_eq!(among(Otherwise::Best, [None; 3]), (3, None));
    }

    #[test]
    fn a_stop_ends_the_search_at_once() {
        let mut tried = 0;
        let found = search(Otherwise::Best).among(|length| {
            tried += 1;
            assert_relative_eq!(length, 1.0);
            Err(Reason::Stopped.into())
        });
        assert!(found.is_err_and(|failure| failure.is_stop()));
        assert_eq!(tried, 1);
    }
}
