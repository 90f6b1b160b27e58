//! Why a step failed, as data, and the words for it.

use super::Iteration;
use crate::group::{Fault, PointFailure};
use std::fmt;

/// A criterion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Criterion {
    /// Of the forces out of balance.
    Residual,
    /// Of the last correction of the displacements.
    Correction,
}

/// How far a state is from equilibrium.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unmet {
    /// The criterion that is not met; the residual's, if neither is.
    pub failed: Criterion,
    /// Relative residual.
    pub residual: f64,
    /// What it may be.
    pub residual_tolerance: f64,
    /// Relative correction; `None` before the first one.
    pub correction: Option<f64>,
    /// What it may be.
    pub correction_tolerance: f64,
}

impl fmt::Display for Unmet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let residual = format!(
            "residual {:.1e}, tolerance {:.1e}",
            self.residual, self.residual_tolerance
        );
        let correction = match self.correction {
            Some(correction) => format!(
                "last correction {correction:.1e} of the increment, tolerance {:.1e}",
                self.correction_tolerance
            ),
            None => format!(
                "no correction yet, tolerance {:.1e}",
                self.correction_tolerance
            ),
        };
        match self.failed {
            Criterion::Residual => write!(f, "{residual}; {correction}"),
            Criterion::Correction => write!(f, "{correction}; {residual}"),
        }
    }
}

/// A displacement far beyond anything that the step could call forth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Runaway {
    /// Degree of freedom.
    pub dof: usize,
    /// Its increment in the step.
    pub increment: f64,
}

/// What a singular matrix says of the model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Singularity {
    /// Not even its elastic stiffness holds every part.
    Free,
    /// It is held elastically.
    Limit,
    /// Its laws know no elastic stiffness.
    Unknown,
}

/// Which iterations came to an end short of equilibrium.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Iterations {
    /// So many; and whether viscous relaxation was tried in vain.
    Newton(usize, bool),
    /// So many along the path of equilibrium.
    Path(usize),
    /// So many steps of viscous relaxation.
    Relaxation(usize),
}

/// Why a step found no equilibrium.
#[derive(Clone, Debug, PartialEq)]
pub enum Reason {
    /// A law failed at a point.
    Law(Box<PointFailure>),
    /// Iterations came to an end short of the criteria.
    Unmet(Iterations, Unmet),
    /// The tangent matrix is singular; what that says beyond a load factor, if it was found out.
    Singular(Option<(Singularity, f64)>),
    /// No length of a correction led to a state at all.
    NoState,
    /// The load does not move the points that the path is measured by.
    LoadMovesNothing,
    /// No correction of any length leads on along the path.
    PathEnds,
    /// No non-linear group deforms, from the start or any more: there is no path.
    NothingDeforms {
        /// There was a path before.
        any_more: bool,
    },
    /// The non-linear groups move so many times as fast as in the last step.
    Leap(f64),
    /// The path of equilibrium was followed, from one load factor between two others, and ended.
    Followed {
        /// Why it ended.
        end: Box<Reason>,
        /// Load factor at which it began, and the lowest and highest on it.
        start: f64,
        /// Lowest and highest load factor on it.
        between: [f64; 2],
    },
    /// So many steps along the path did not lead to a higher load.
    LoadDoesNotRise {
        /// Number of steps.
        steps: usize,
        /// Lowest and highest load factor.
        between: [f64; 2],
        /// Where it is.
        at: f64,
    },
    /// Reactions and loads do not balance.
    Unbalanced(Imbalance),
    /// The linear groups are left out of equilibrium.
    Domain(DomainFailure),
    /// The step was stopped as asked: that says nothing of equilibrium.
    Stopped,
}

/// Sums of forces or moments that should cancel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Imbalance {
    /// 0: forces in x; 1: forces in y; 2: moments.
    pub component: usize,
    /// Sum of the reactions.
    pub reactions: f64,
    /// Sum of the loads.
    pub loads: f64,
    /// What the tolerances allow for both together.
    pub allowed: f64,
}

/// Why the groups of a linear domain are not in equilibrium.
#[derive(Clone, Debug, PartialEq)]
pub enum DomainFailure {
    /// A residual that corrections do not lessen.
    Residual {
        /// Relative residual.
        left: f64,
        /// What it may be.
        tolerance: f64,
        /// What the last bit of the displacements stands for.
        last_bit: f64,
    },
    /// A law failed.
    Law(Box<PointFailure>),
    /// There is no state to count from.
    NoState,
}

/// What keeps iterations from settling: a point, and what happens there.
#[derive(Clone, Debug, PartialEq)]
pub struct Culprit {
    /// Group, law, element (from 1), integration point (from 1) and coordinates.
    pub at: PointPlace,
    /// What happens there.
    pub what: Symptom,
    /// At how many points more.
    pub others: usize,
}

/// An integration point.
#[derive(Clone, Debug, PartialEq)]
pub struct PointPlace {
    /// Name of the group.
    pub group: String,
    /// Id of the law.
    pub law: String,
    /// Element within the group, from 1.
    pub element: usize,
    /// Integration point within the element, from 1.
    pub point: usize,
    /// Coordinates.
    pub position: [f64; 2],
}

/// What happens at a point from one iteration to the next.
#[derive(Clone, Debug, PartialEq)]
pub enum Symptom {
    /// The law's tangent is wrong.
    Fault(Fault),
    /// The traction is zero in one iteration and not in the next.
    Contact,
    /// The stress is zero in one iteration and not in the next.
    Cohesion,
    /// The tangent changes by this fraction.
    Branch(f64),
}

/// A step that found no equilibrium. The committed state is untouched.
#[derive(Clone, Debug)]
pub struct StepFailure {
    /// What happened until then.
    pub iterations: Vec<Iteration>,
    /// Why.
    pub reason: Reason,
    /// The displacement that ran away, if one did.
    pub runaway: Option<Runaway>,
    /// What keeps the iterations from settling, if that could be found out.
    pub culprit: Option<Culprit>,
}

impl From<Reason> for StepFailure {
    fn from(reason: Reason) -> Self {
        Self {
            iterations: Vec::new(),
            reason,
            runaway: None,
            culprit: None,
        }
    }
}

impl From<PointFailure> for StepFailure {
    fn from(failure: PointFailure) -> Self {
        Reason::Law(Box::new(failure)).into()
    }
}

impl StepFailure {
    /// The point whose law failed, if one did.
    pub fn failed(&self) -> Option<&PointFailure> {
        match &self.reason {
            Reason::Law(failure) => Some(failure),
            _ => None,
        }
    }

    /// The same, if no smaller step will help.
    pub fn defect(&self) -> Option<&PointFailure> {
        use abi::status::Outcome::{Argument, Internal, Unknown, Unsupported};
        let never = |failure: &&PointFailure| {
            matches!(
                failure.failure.outcome,
                Argument | Internal | Unknown(_) | Unsupported
            )
        };
        self.failed().filter(never)
    }

    /// Size of the next attempt that a law asks for, as a fraction of this one.
    pub fn factor(&self) -> Option<f64> {
        self.failed()?.failure.factor
    }

    /// Whether the matrix was singular.
    pub fn is_singular(&self) -> bool {
        matches!(self.reason, Reason::Singular(_))
    }

    /// Whether the step was stopped as asked.
    pub fn is_stop(&self) -> bool {
        self.reason == Reason::Stopped
    }

    /// With what a singular matrix says beyond this load factor.
    pub(super) fn explained(self, singularity: Singularity, lambda: f64) -> Self {
        Self {
            reason: Reason::Singular(Some((singularity, lambda))),
            ..self
        }
    }
}

impl fmt::Display for Iterations {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Newton(n, in_vain) => {
                let tried = if *in_vain {
                    ", nor by viscous relaxation"
                } else {
                    ""
                };
                write!(f, "no equilibrium after {n} iterations{tried}")
            }
            Self::Path(n) => write!(f, "no equilibrium along the path after {n} iterations"),
            Self::Relaxation(n) => write!(
                f,
                "no equilibrium by Newton iterations, nor by {n} steps of viscous relaxation"
            ),
        }
    }
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Law(failure) => failure.fmt(f),
            Self::Unmet(iterations, unmet) => write!(f, "{iterations}: {unmet}"),
            Self::Singular(says) => {
                write!(f, "the tangent matrix is singular")?;
                match says {
                    Some((Singularity::Free, _)) => {
                        write!(f, ": a part of the model can move freely")
                    }
                    Some((Singularity::Limit, lambda)) => write!(
                        f,
                        ", the elastic one is not: a limit state (a collapse load or a mechanism) \
                         beyond load factor {lambda:.3e} of the phase"
                    ),
                    Some((Singularity::Unknown, _)) | None => Ok(()),
                }
            }
            Self::NoState => write!(f, "the line search found no state"),
            Self::LoadMovesNothing => write!(
                f,
                "the load does not move the points that the path is measured by"
            ),
            Self::PathEnds => write!(f, "the path ends here"),
            Self::NothingDeforms { any_more: false } => {
                write!(f, "no non-linear group deforms: there is no path to follow")
            }
            Self::NothingDeforms { any_more: true } => {
                write!(f, "no non-linear group deforms any more: the path ends")
            }
            Self::Leap(times) => write!(
                f,
                "the non-linear groups move {times:.1} times as fast as in the last step, which may \
                 leap over a piece of the path of equilibrium"
            ),
            Self::Followed {
                end,
                start,
                between: [lowest, highest],
            } => write!(
                f,
                "{end}; the path of equilibrium was followed from {start:.4} of the phase, between \
                 {lowest:.4} and {highest:.4}"
            ),
            Self::LoadDoesNotRise {
                steps,
                between: [lowest, highest],
                at,
            } => write!(
                f,
                "the load does not rise beyond {highest:.4} of the phase: in {steps} steps along the \
                 path of equilibrium it went down to {lowest:.4} and is at {at:.4}"
            ),
            Self::Unbalanced(imbalance) => imbalance.fmt(f),
            Self::Domain(failure) => failure.fmt(f),
            Self::Stopped => write!(f, "stopped as asked"),
        }
    }
}

impl fmt::Display for Imbalance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let what = ["forces in x", "forces in y", "moments"][self.component];
        let Self {
            reactions, loads, ..
        } = self;
        write!(
            f,
            "the {what} do not balance: reactions {reactions:.6e} and loads {loads:.6e} leave {:.1e} \
             where the tolerances allow {:.1e}",
            reactions + loads,
            self.allowed
        )
    }
}

impl fmt::Display for DomainFailure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Residual {
                left,
                tolerance,
                last_bit,
            } => write!(
                f,
                "the linear groups are left with a residual of {left:.1e}, tolerance \
                 {tolerance:.1e}; the last bit of their displacements stands for {last_bit:.1e}"
            ),
            Self::Law(failure) => failure.fmt(f),
            Self::NoState => write!(f, "no state to count from"),
        }
    }
}

impl fmt::Display for PointPlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y] = self.position;
        write!(
            f,
            "group `{}`, element {}, point {} at ({x:.4}, {y:.4}), law `{}`",
            self.group, self.element, self.point, self.law
        )
    }
}

impl fmt::Display for Symptom {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Fault(fault) => fault.fmt(f),
            Self::Contact => write!(
                f,
                "traction zero (no contact) in one iteration and not in the next: contact opens and \
                 closes there"
            ),
            Self::Cohesion => write!(
                f,
                "stress zero in one iteration and not in the next: the material comes apart and \
                 closes there"
            ),
            Self::Branch(relative) => write!(
                f,
                "tangent changes by {:.0} % from one iteration to the next: the law changes its \
                 branch there (yield, unloading, an edge of its surface)",
                100.0 * relative
            ),
        }
    }
}

impl fmt::Display for Culprit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.at, self.what)?;
        match self.others {
            0 => Ok(()),
            1 => write!(f, ", and at one point more"),
            n => write!(f, ", and at {n} points more"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_criterion_that_failed_comes_first() {
        let unmet = Unmet {
            failed: Criterion::Residual,
            residual: 2e-3,
            residual_tolerance: 1e-9,
            correction: Some(0.5),
            correction_tolerance: 1e-7,
        };
        assert_eq!(
            unmet.to_string(),
            "residual 2.0e-3, tolerance 1.0e-9; last correction 5.0e-1 of the increment, \
             tolerance 1.0e-7"
        );
        let moved = Unmet {
            failed: Criterion::Correction,
            residual: 7.4e-11,
            ..unmet
        };
        assert!(
            moved.to_string().starts_with("last correction 5.0e-1"),
            "{moved}"
        );
    }
}
