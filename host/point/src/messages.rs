//! What went wrong or was noticed, in sentences.

use crate::error::{Cause, Criterion, Error, Failure, Misuse, NoEquilibrium, Place, Unmet};
use crate::path::{LONGEST, MAX_INCREMENTS};
use abi::status::Outcome;
use law::words;
use std::fmt::{self, Display, Formatter};

impl Display for Place {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Start => f.write_str("initial state"),
            Self::Increment {
                segment,
                increment,
                of,
                row,
            } => write!(
                f,
                "segment {segment}, increment {increment} of {of} ({row} of the file)"
            ),
        }
    }
}

impl Display for Misuse {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoSegment => f.write_str("the path has no segment"),
            Self::Increments(n) => write!(
                f,
                "`increments`: {n} is outside [1, {MAX_INCREMENTS}], all segments together"
            ),
            Self::Time(time) => write!(
                f,
                "`time` is {time}, expected above 0 and at most {LONGEST:e}: how long the segment takes"
            ),
            Self::NotFinite(value) => write!(f, "{value} is not finite"),
            Self::NegativeStiffness(stiffness) => {
                write!(f, "`stiffness`: {stiffness} kPa/m is outside [0, ∞)")
            }
            Self::StiffnessOfSolid => f.write_str("the stiffness of a stress cannot be controlled"),
            Self::OutOfPlane => {
                f.write_str("the strain 33 is 0 in plane strain and cannot be controlled")
            }
            Self::ThreeDimensional => {
                f.write_str("other components than Cartesian ones, and restrictions, are for 3d")
            }
            Self::NoRestriction(number) => write!(f, "restriction {number} restricts nothing"),
            Self::Length { given, expected } => {
                write!(f, "{given} values, expected {expected}")
            }
        }
    }
}

impl Misuse {
    /// A hint for the user, if one is known.
    pub fn hint(&self) -> Option<&'static str> {
        match self {
            Self::NegativeStiffness(_) => Some("the traction changes by −stiffness × jump"),
            _ => None,
        }
    }
}

impl Display for Error {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Misuse {
                segment: Some(segment),
                misuse,
            } => write!(f, "segment {segment}: {misuse}"),
            Self::Misuse { misuse, .. } => misuse.fmt(f),
            Self::InitialState { law, reason } => {
                write!(f, "law `{law}` refuses the initial state: {reason}")
            }
            Self::Failure(failure) => failure.fmt(f),
        }
    }
}

impl Error {
    /// A hint for the user, if one is known.
    pub fn hint(&self) -> Option<String> {
        match self {
            Self::Misuse { misuse, .. } => misuse.hint().map(str::to_owned),
            Self::InitialState { .. } => {
                Some("tension is positive; a compressive stress is negative".to_owned())
            }
            Self::Failure(failure) => failure.hint(),
        }
    }
}

impl Display for Failure {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let (law, library) = (&self.law, self.library.display());
        // A law that gives no initial variables is not on any path yet.
        if !matches!(self.cause, Cause::InitialState(_)) {
            if let Some(variant) = &self.variant {
                write!(f, "variant {variant}, ")?;
            }
            write!(f, "{}: ", self.place)?;
        }
        match &self.cause {
            Cause::Stopped if self.place == Place::Start => f.write_str("stopped as asked"),
            Cause::Stopped => f.write_str("stopped as asked; the rows before it are written"),
            Cause::NoEquilibrium(why) => self.no_equilibrium(why, f),
            Cause::InitialState(failure) => {
                let (outcome, message) = (failure.outcome, &failure.message);
                write!(
                    f,
                    "law `{law}` of library {library}: the initial state failed ({outcome:?}): \
                     {message}"
                )
            }
            Cause::Law(failure) => {
                let what = match failure.outcome {
                    Outcome::Unsupported => "offers neither a tangent nor an elastic operator",
                    Outcome::Argument => "says that the host broke the contract",
                    Outcome::Internal => "broke down",
                    _ => "failed with a code that fits no update",
                };
                let message = &failure.message;
                write!(f, "law `{law}` of library {library} {what}: {message}")
            }
            Cause::LawInSmallSteps(failure) => write!(
                f,
                "law `{law}` of library {library} fails, however small the step: {}",
                failure.message
            ),
        }
    }
}

impl Failure {
    fn no_equilibrium(&self, why: &NoEquilibrium, f: &mut Formatter<'_>) -> fmt::Result {
        let (gradient, flux) = words(self.hypothesis);
        f.write_str("no equilibrium: ")?;
        match &why.unmet {
            Some(unmet) => unmet.describe(flux, f)?,
            None => write!(f, "law `{}` cannot follow the {gradient}s", self.law)?,
        }
        write!(f, "\n  reached: {:.6} of the increment", why.reached)?;
        if let Some(Unmet {
            criterion: Criterion::Flux { component, at_end },
            ..
        }) = why.unmet
        {
            write!(
                f,
                ", at whose end {flux} `{component}` is to be {at_end:.9e} kPa"
            )?;
        }
        if let Some(refusal) = &why.refusal {
            write!(f, "\n  law `{}`: {}", self.law, refusal.message)?;
        }
        let mut warnings = self.warnings.iter();
        warnings.try_for_each(|warning| write!(f, "\n  warning: {warning}"))
    }

    /// A hint for the user, if one is known.
    pub fn hint(&self) -> Option<String> {
        let own = match &self.cause {
            // A stress without stiffness is not one beyond strength.
            Cause::NoEquilibrium(_) if self.is_without_stiffness => None,
            Cause::NoEquilibrium(why) => why.unmet.and_then(|unmet| self.instead_of(&unmet)),
            _ => None,
        };
        match (own, &self.advice) {
            (Some(own), Some(advice)) => Some(format!("{own}; {advice}")),
            (own, advice) => own.or_else(|| advice.clone()),
        }
    }

    fn instead_of(&self, unmet: &Unmet) -> Option<String> {
        let (gradient, flux) = words(self.hypothesis);
        match unmet.criterion {
            Criterion::Flux { component, .. } | Criterion::Stiffness { component } => {
                Some(format!(
                    "a {flux} beyond strength has no equilibrium; control the {gradient} of \
                     `{component}` instead"
                ))
            }
            Criterion::Restriction(_) => None,
        }
    }
}

impl Unmet {
    fn describe(&self, flux: &str, f: &mut Formatter<'_>) -> fmt::Result {
        match self.criterion {
            Criterion::Flux { component, .. } | Criterion::Stiffness { component } => write!(
                f,
                "{flux} `{component}` is {:.9e} kPa at best, {:.9e} kPa is asked for (residual \
                 {:.2e}, tolerance {:.1e})",
                self.found, self.goal, self.residual, self.tolerance
            ),
            Criterion::Restriction(number) => write!(
                f,
                "restriction {number} cannot be met: residual {:.2e} kPa, tolerance {:.1e} kPa",
                self.residual, self.tolerance
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use abi::Hypothesis;
    use law::BatchFailure;

    const PLACE: Place = Place::Increment {
        segment: 2,
        increment: 3,
        of: 4,
        row: 13,
    };

    fn failure(cause: Cause) -> Failure {
        Failure {
            variant: Some("b".to_owned()),
            place: PLACE,
            law: "joint".to_owned(),
            library: "libjoint.so".into(),
            hypothesis: Hypothesis::Interface2d,
            cause,
            warnings: vec!["a note".to_owned()],
            is_without_stiffness: false,
            advice: None,
        }
    }

    fn refusal(outcome: Outcome) -> BatchFailure {
        BatchFailure {
            point: 0,
            outcome,
            message: "its words".to_owned(),
            factor: None,
            claims_success: false,
            call: None,
        }
    }

    fn unmet(criterion: Criterion) -> Cause {
        Cause::NoEquilibrium(NoEquilibrium {
            reached: 0.5,
            unmet: Some(Unmet {
                criterion,
                found: 70.0,
                goal: 72.0,
                residual: -2.0,
                tolerance: 4.5e-8,
            }),
            refusal: Some(Box::new(refusal(Outcome::CutStep))),
        })
    }

    #[test]
    fn a_flux_beyond_strength_is_said_with_all_that_is_known() {
        let component = "t";
        let at_end = 75.0;
        let failure = failure(unmet(Criterion::Flux { component, at_end }));
        assert_eq!(
            failure.to_string(),
            "variant b, segment 2, increment 3 of 4 (13 of the file): no equilibrium: traction `t` \
             is 7.000000000e1 kPa at best, 7.200000000e1 kPa is asked for (residual -2.00e0, \
             tolerance 4.5e-8)\n  reached: 0.500000 of the increment, at whose end traction `t` is \
             to be 7.500000000e1 kPa\n  law `joint`: its words\n  warning: a note"
        );
        let own = "a traction beyond strength has no equilibrium; control the jump of `t` instead";
        assert_eq!(failure.hint().unwrap(), own);
        let error = Error::Failure(Box::new(failure)).with_hint("more");
        assert_eq!(error.hint().unwrap(), format!("{own}; more"));
        assert!(error.failed_call().is_some());
    }

    #[test]
    fn restrictions_and_springs_have_no_goal_of_their_own_at_the_end() {
        let restricted = failure(unmet(Criterion::Restriction(2)));
        let text = restricted.to_string();
        assert!(text.contains("restriction 2 cannot be met: residual -2.00e0 kPa"));
        assert!(text.contains("reached: 0.500000 of the increment\n"));
        assert_eq!(restricted.hint(), None);
        let sprung = failure(unmet(Criterion::Stiffness { component: "n" }));
        assert!(!sprung.to_string().contains("at whose end"));
        assert!(sprung.hint().unwrap().contains("the jump of `n`"));
    }

    #[test]
    fn libraries_at_fault_are_named() {
        let begins = "variant b, segment 2, increment 3 of 4 (13 of the file): law `joint` of \
                      library libjoint.so ";
        for (cause, says) in [
            (
                Cause::Law(refusal(Outcome::Internal)),
                "broke down: its words",
            ),
            (
                Cause::LawInSmallSteps(refusal(Outcome::Numeric)),
                "fails, however small the step: its words",
            ),
        ] {
            assert_eq!(failure(cause).to_string(), format!("{begins}{says}"));
        }
        let mut start = failure(Cause::InitialState(refusal(Outcome::Internal)));
        start.place = Place::Start;
        assert_eq!(
            start.to_string(),
            "law `joint` of library libjoint.so: the initial state failed (Internal): its words"
        );
    }

    #[test]
    fn a_stop_is_no_failed_call() {
        let failure = failure(Cause::Stopped);
        assert!(
            failure
                .to_string()
                .ends_with("(13 of the file): stopped as asked; the rows before it are written")
        );
        let error = Error::Failure(Box::new(failure));
        assert!(error.failed_call().is_none() && error.hint().is_none());
    }
}
