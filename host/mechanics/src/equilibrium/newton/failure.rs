//! Why a step failed, as data.

mod messages;

use super::outcome::Iteration;
use crate::equilibrium::mechanism::Mechanism;
use crate::group::{Fault, Group, PointFailure};
use serde::Serialize;

/// A criterion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Criterion {
    /// Displacements that do not run away.
    Distance,
    /// The forces out of balance.
    Residual,
    /// The last correction of the displacements.
    Correction,
}

/// How far a state is from equilibrium.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unmet {
    /// The criterion that is not met; the first of them.
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

/// A motion to another equilibrium.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// Viscous relaxation.
    Relaxation,
    /// Viscous control.
    Viscous,
}

/// Which iterations came to an end short of equilibrium.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Iterations {
    /// So many; and what else was tried in vain.
    Newton(usize, Option<Motion>),
    /// So many along the path of equilibrium.
    Path(usize),
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
    /// No non-linear group deforms, from the start or any more: there is no path.
    NothingDeforms {
        /// There was a path before.
        any_more: bool,
    },
    /// The non-linear groups move this many times as fast as in the last step.
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
        /// Its place.
        at: f64,
    },
    /// The path of equilibrium led back far beyond the start of the phase.
    RanBack {
        /// Number of steps along it.
        steps: usize,
        /// Highest load factor on it.
        highest: f64,
        /// Where the next step led.
        to: f64,
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
        /// The effect of the last bit of the displacements.
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
#[derive(Clone, Debug, PartialEq, Serialize)]
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

impl PointPlace {
    /// That of a point of a group.
    pub(in crate::equilibrium) fn of(group: &Group, point: usize) -> Self {
        let (element, within) = group.kinematics.place_of(point);
        Self {
            group: group.name.clone(),
            law: group.law.built.law.description().id.clone(),
            element: element + 1,
            point: within + 1,
            position: group.kinematics.position(point),
        }
    }
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
    /// What gives way, if that could be found out.
    pub mechanism: Option<Mechanism>,
    /// A point of an interface with a bond opened in an iterate of the step.
    pub opens_bond: bool,
}

impl From<Reason> for StepFailure {
    fn from(reason: Reason) -> Self {
        Self {
            iterations: Vec::new(),
            reason,
            runaway: None,
            culprit: None,
            mechanism: None,
            opens_bond: false,
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
