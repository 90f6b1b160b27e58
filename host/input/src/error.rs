//! Errors from file to result, by who has to act; the exit code follows from it.

use law::Stopped;
use mechanics::NoEquilibrium;
use mechanics::equilibrium::{Iterations, Mechanism, Reason, Singularity};
use mechanics::group::FailureMode;
use mechanics::settings::Control;
use text::{InputError, add_hint};
use thiserror::Error;

/// Any error of the host.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Error {
    /// A file, or what was asked for, is wrong.
    #[error(transparent)]
    Text(#[from] text::Error),
    /// A library cannot be used, or broke the contract.
    #[error(transparent)]
    Law(law::Error),
    /// The process was killed from outside.
    #[error("{trouble}")]
    Killed {
        /// Where, in words.
        trouble: String,
    },
    /// A point did not come to the end of its path.
    #[error(transparent)]
    Point(Box<point::Error>),
    /// A simulation did not come to its end.
    #[error("{error}")]
    Simulation {
        /// Why.
        error: Box<mechanics::Error>,
        /// What the user could do.
        hint: Option<String>,
    },
    /// A call that was repeated fails.
    #[error("law `{law}` fails: {outcome}")]
    CallFails {
        /// Id of the law.
        law: String,
        /// Name of the outcome.
        outcome: &'static str,
        /// The law cannot follow; else it, or its library, is at fault.
        cannot_follow: bool,
    },
    /// The user stopped the work in the middle.
    #[error(transparent)]
    Stopped(#[from] Stopped),
    /// The user ended the program at once, during these calls of laws if there were any.
    #[error("{}stopped at once, as asked", during.as_ref().map(|calls| format!("{calls}: ")).unwrap_or_default())]
    StoppedAtOnce {
        /// The calls, in words.
        during: Option<String>,
    },
}

impl From<InputError> for Error {
    fn from(error: InputError) -> Self {
        text::Error::from(error).into()
    }
}

impl From<law::Error> for Error {
    fn from(error: law::Error) -> Self {
        match error {
            law::Error::Text(error) => Self::Text(error),
            law::Error::Stopped(stopped) => Self::Stopped(stopped),
            error @ law::Error::Library { .. } => Self::Law(error),
        }
    }
}

impl From<point::Error> for Error {
    fn from(error: point::Error) -> Self {
        Self::Point(Box::new(error))
    }
}

impl From<mechanics::Error> for Error {
    fn from(error: mechanics::Error) -> Self {
        let hint = hint(&error);
        let error = Box::new(error);
        Self::Simulation { error, hint }
    }
}

impl Error {
    /// What gave way where no equilibrium was found.
    pub fn mechanism(&self) -> Option<&Mechanism> {
        match self {
            Self::Simulation { error, .. } => match &**error {
                mechanics::Error::NoEquilibrium(none) => none.failure.mechanism.as_ref(),
                _ => None,
            },
            _ => None,
        }
    }
}

/// Hint for an error of a simulation.
fn hint(error: &mechanics::Error) -> Option<String> {
    let hint = match error {
        mechanics::Error::CannotStart(failure)
            if failure.failure.outcome == abi::status::Outcome::CutStep =>
        {
            "the law failed when it was called with a zero increment at the start of its phase, so that no shorter step can help"
        }
        mechanics::Error::Singular { .. } => "a part of the model can move freely: add a support",
        mechanics::Error::NoEquilibrium(none) => return Some(after_no_equilibrium(none)),
        mechanics::Error::Interrupted { .. } => "go on with --resume",
        mechanics::Error::Stopped { .. } => {
            "the last equilibrium is `stopped_at` in summary.json; go on with --resume"
        }
        _ => return None,
    };
    Some(hint.to_owned())
}

/// Untried remedies if no equilibrium was found, and the files written by the run.
fn after_no_equilibrium(none: &NoEquilibrium) -> String {
    let viscous = none.control.relaxes().then_some(if none.viscous {
        "`control = \"viscous\"` in [solver] takes whole increments and may get further, but depends more on \
         them: repeat it with more increments"
    } else {
        "`control = \"viscous\"` in [solver] follows the motion to the next equilibrium and may get further"
    });
    let ways = match &none.failure.reason {
        reason if none.control == Control::ArcLength && may_have_another_way(reason) => vec![
            "`control = \"auto\"` in [solver], which turns to viscous relaxation and viscous control where steps of the load fail, and \
             `control = \"viscous\"` were not tried",
        ],
        reason if !none.may_move && may_have_another_way(reason) => vec![
            "`method = \"auto\"` with `relaxation = true` in [solver], which allows viscous relaxation and viscous control where \
             iterations stall, was not tried",
        ],
        Reason::Unmet(Iterations::Newton(_, Some(_)), _) => vec![
            viscous.unwrap_or("other increments may get further"),
            "`convergence = \"force\"` with `force_tolerance = 1e-3` accepts steps by the balance of forces \
             alone, although displacements have not settled",
        ],
        Reason::Singular(Some((Singularity::Limit, _))) => viscous.into_iter().collect(),
        _ => Vec::new(),
    };
    let bond = none.failure.mechanism.as_ref().and_then(remedy);
    let written = "all whole increments in equilibrium are written; the last equilibrium is `stopped_at` in summary.json, and \
                   log.jsonl lists the iterations";
    bond.into_iter()
        .chain(ways)
        .chain([written])
        .collect::<Vec<_>>()
        .join("; ")
}

/// What keeps a bond that breaks at once and leaves no equilibrium.
fn remedy(mechanism: &Mechanism) -> Option<&'static str> {
    match mechanism.how {
        FailureMode::BondBreaks | FailureMode::Opens if mechanism.is_bare => Some(
            "the interface starts without normal stress, and the first tension breaks its bond: give it an \
             initial stress, a phase of weight or pressure before, or a tensile strength, or set its cohesion to \
             0",
        ),
        FailureMode::BondBreaks => Some(
            "a bond that breaks at once may leave nothing that carries the load: prescribe a displacement instead, or give the \
             law a tensile strength",
        ),
        _ => None,
    }
}

/// Whether a step that failed so may be made in another way: not one that the model does not allow, or the laws.
fn may_have_another_way(reason: &Reason) -> bool {
    match reason {
        Reason::Followed { end, .. } => may_have_another_way(end),
        Reason::Law(_)
        | Reason::Singular(Some((Singularity::Free, _)))
        | Reason::Unbalanced(_)
        | Reason::Domain(_)
        | Reason::Stopped => false,
        _ => true,
    }
}

/// The one who has to act.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Whoever wrote the input; places that cannot be read or written included.
    Input,
    /// Nobody: there is no equilibrium.
    NoEquilibrium,
    /// The author of a library.
    Library,
    /// We.
    Internal,
    /// Nobody: stopped as asked.
    Stopped,
}

impl Error {
    /// The request does not fit the files.
    pub fn usage(message: impl Into<String>) -> Self {
        text::Error::Usage(message.into()).into()
    }

    /// A defect of the program.
    pub fn internal(message: impl Into<String>) -> Self {
        text::Error::Internal(message.into()).into()
    }

    /// Trouble with a library, without a hint.
    pub fn library(message: impl Into<String>) -> Self {
        law::Error::library(message).into()
    }

    /// A hint for the user, if one is known.
    pub fn help(&self) -> Option<String> {
        let help = match self {
            Self::Text(error) => error.help(),
            Self::Law(error) => error.help(),
            Self::Point(error) => return error.hint(),
            Self::Simulation { hint, .. } => hint.as_deref(),
            Self::StoppedAtOnce { .. } => Some(
                "a run has all its rows and goes on with --resume; a driver lacks those of the \
                 last 0.2 s",
            ),
            Self::Killed { .. } => Some(
                "it was killed by somebody, or by the system, which may have had no memory left",
            ),
            Self::CallFails { .. } | Self::Stopped(_) => None,
        };
        help.map(str::to_owned)
    }

    /// The place in a file that it is about.
    pub fn place(&self) -> Option<&InputError> {
        match self {
            Self::Text(error) | Self::Law(law::Error::Text(error)) => error.place(),
            _ => None,
        }
    }

    /// Its message on a terminal, with or without colours, or elsewhere.
    pub fn shown(&self, coloured: bool) -> String {
        text::shown(self, self.place(), self.help().as_deref(), coloured)
    }

    /// Adds what the user could do.
    #[must_use]
    pub fn with_hint(self, more: &str) -> Self {
        match self {
            Self::Text(error) => error.with_hint(more).into(),
            Self::Law(error) => error.with_hint(more).into(),
            Self::Point(error) => error.with_hint(more).into(),
            Self::Simulation { error, mut hint } => {
                add_hint(&mut hint, more);
                Self::Simulation { error, hint }
            }
            other @ (Self::CallFails { .. }
            | Self::Killed { .. }
            | Self::Stopped(_)
            | Self::StoppedAtOnce { .. }) => other,
        }
    }

    /// The one who has to act.
    pub fn kind(&self) -> Kind {
        use abi::status::Outcome;
        match self {
            Self::Text(text::Error::Internal(_)) => Kind::Internal,
            Self::Text(_) => Kind::Input,
            Self::CallFails {
                cannot_follow: true,
                ..
            } => Kind::NoEquilibrium,
            Self::Law(_) | Self::CallFails { .. } | Self::Killed { .. } => Kind::Library,
            Self::Stopped(_) | Self::StoppedAtOnce { .. } => Kind::Stopped,
            Self::Point(error) => match &**error {
                point::Error::Misuse { .. } | point::Error::InitialState { .. } => Kind::Input,
                point::Error::Failure(failure) => match failure.cause {
                    point::Cause::Stopped => Kind::Stopped,
                    point::Cause::NoEquilibrium(_) => Kind::NoEquilibrium,
                    _ => Kind::Library,
                },
            },
            Self::Simulation { error, .. } => match &**error {
                mechanics::Error::Refused(_) | mechanics::Error::OtherState(_) => Kind::Input,
                mechanics::Error::CannotStart(failure)
                    if failure.failure.outcome != Outcome::CutStep =>
                {
                    Kind::Library
                }
                mechanics::Error::CannotStart(_)
                | mechanics::Error::Singular { .. }
                | mechanics::Error::NoEquilibrium(_) => Kind::NoEquilibrium,
                mechanics::Error::Law { .. } | mechanics::Error::Process { .. } => Kind::Library,
                mechanics::Error::Interrupted { .. } | mechanics::Error::Stopped { .. } => {
                    Kind::Stopped
                }
                mechanics::Error::Halted => Kind::Internal,
            },
        }
    }

    /// Whether the user stopped the work: nothing is wrong with it.
    pub fn is_stop(&self) -> bool {
        self.kind() == Kind::Stopped
    }

    /// The program's exit code: 1 bad input (places that cannot be read or written included), 2 no
    /// equilibrium, 3 plugin trouble, 4 internal, 130 stopped as asked (as shells say it of Ctrl-C).
    pub fn exit_code(&self) -> u8 {
        match self.kind() {
            Kind::Input => 1,
            Kind::NoEquilibrium => 2,
            Kind::Library => 3,
            Kind::Internal => 4,
            Kind::Stopped => 130,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mechanics::Place;
    use mechanics::equilibrium::{Criterion, Motion, Unmet};

    const VISCOUSLY: &str = "`control = \"viscous\"`";
    const LIMIT: Reason = Reason::Singular(Some((Singularity::Limit, 0.7)));

    fn none(control: Control, reason: Reason) -> NoEquilibrium {
        NoEquilibrium {
            place: Place {
                phase: "push".to_owned(),
                increment: 3,
            },
            reached: 2.5,
            of: 10,
            control,
            viscous: false,
            may_move: true,
            failure: reason.into(),
            runaway: None,
        }
    }

    fn help(control: Control, reason: Reason) -> String {
        after_no_equilibrium(&none(control, reason))
    }

    fn unmet(iterations: Iterations) -> Reason {
        let unmet = Unmet {
            failed: Criterion::Correction,
            residual: 1e-12,
            residual_tolerance: 1e-9,
            correction: Some(0.1),
            correction_tolerance: 1e-7,
        };
        Reason::Unmet(iterations, unmet)
    }

    #[test]
    fn auto_proposes_viscous_control_that_was_not_tried() {
        let in_vain = |motion| unmet(Iterations::Newton(25, Some(motion)));
        let relaxed = help(Control::Auto, in_vain(Motion::Relaxation));
        assert!(relaxed.starts_with(VISCOUSLY), "{relaxed}");
        assert!(relaxed.contains("`convergence = \"force\"`"), "{relaxed}");
        assert!(help(Control::Auto, LIMIT).starts_with(VISCOUSLY));
        // By short steps under `auto`.
        let short = after_no_equilibrium(&NoEquilibrium {
            viscous: true,
            ..none(Control::Auto, in_vain(Motion::Viscous))
        });
        assert!(short.starts_with(VISCOUSLY), "{short}");
        assert!(short.contains("takes whole increments"), "{short}");
        assert!(!relaxed.contains("takes whole increments"), "{relaxed}");
        let viscous = help(Control::Viscous, in_vain(Motion::Viscous));
        assert!(!viscous.contains(VISCOUSLY), "{viscous}");
        assert!(viscous.starts_with("other increments"), "{viscous}");
        let written = "all whole increments in equilibrium are written";
        assert!(help(Control::Viscous, LIMIT).starts_with(written));
        assert!(help(Control::Auto, Reason::NoState).starts_with(written));
    }

    /// `modified_newton` and the like, and `relaxation = false`.
    #[test]
    fn settings_without_relaxation_propose_it() {
        let still = |reason| {
            after_no_equilibrium(&NoEquilibrium {
                may_move: false,
                ..none(Control::Auto, reason)
            })
        };
        let proposal = "`method = \"auto\"` with `relaxation = true`";
        for reason in [unmet(Iterations::Newton(200, None)), LIMIT] {
            assert!(still(reason.clone()).starts_with(proposal));
            assert!(!help(Control::Auto, reason).contains(proposal));
        }
        let free = Reason::Singular(Some((Singularity::Free, 0.7)));
        assert!(!still(free).contains(proposal));
    }

    #[test]
    fn a_path_that_ends_proposes_what_was_not_tried() {
        let others = |reason| help(Control::ArcLength, reason).contains("were not tried");
        let back = || Reason::RanBack {
            steps: 3,
            highest: 0.2,
            to: -0.1,
        };
        assert!(others(back()) && others(unmet(Iterations::Path(25))) && others(LIMIT));
        assert!(others(Reason::Followed {
            end: Box::new(Reason::NoState),
            start: 0.1,
            between: [0.0, 0.2],
        }));
        assert!(!others(Reason::Singular(Some((Singularity::Free, 0.7)))));
        assert!(!help(Control::Load, back()).contains("were not tried"));
    }
}
