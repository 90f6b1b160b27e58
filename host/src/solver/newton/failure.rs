//! Why a step failed, as data, and the words for it.

use super::Iteration;
use crate::group::PointFailure;
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
pub(super) enum Singularity {
    /// Not even its elastic stiffness holds every part.
    Free,
    /// It is held elastically.
    Limit,
    /// Its laws know no elastic stiffness.
    Unknown,
}

/// A step that found no equilibrium. The committed state is untouched.
#[derive(Clone, Debug)]
pub struct StepFailure {
    /// What happened until then.
    pub iterations: Vec<Iteration>,
    /// Why.
    pub reason: String,
    /// Both criteria, where iterations came to an end.
    pub unmet: Option<Unmet>,
    /// The matrix is singular.
    pub singular: bool,
    /// The displacement that ran away, if one did.
    pub runaway: Option<Runaway>,
    /// Size of the next attempt that a law asks for, as a fraction of this one.
    pub factor: Option<f64>,
    /// A law that no smaller step will help.
    pub defect: Option<PointFailure>,
    /// The point whose law failed, if one did.
    pub failed: Option<Box<PointFailure>>,
    /// What keeps the iterations from settling, if that could be found out.
    pub culprit: Option<String>,
    /// The step was stopped as asked: it says nothing of equilibrium.
    pub is_stop: bool,
}

impl StepFailure {
    /// A failure of which nothing more is known.
    pub fn because(reason: String) -> Self {
        Self {
            iterations: Vec::new(),
            reason,
            unmet: None,
            singular: false,
            runaway: None,
            factor: None,
            defect: None,
            failed: None,
            culprit: None,
            is_stop: false,
        }
    }

    /// The failure of a law.
    pub fn of_law(failure: PointFailure) -> Self {
        super::failed_law(failure)
    }

    /// A step that was stopped as asked.
    pub fn stopped() -> Self {
        Self {
            is_stop: true,
            ..Self::because("stopped as asked".to_owned())
        }
    }

    /// Iterations that came to an end (`what`) short of the criteria.
    pub(super) fn unmet(what: &str, unmet: Unmet) -> Self {
        Self {
            unmet: Some(unmet),
            ..Self::because(format!("{what}: {unmet}"))
        }
    }

    /// A singular matrix.
    pub(super) fn singular() -> Self {
        Self {
            singular: true,
            ..Self::because("the tangent matrix is singular".to_owned())
        }
    }

    /// With what a singular matrix says beyond this load factor.
    pub(super) fn explained(self, singularity: Singularity, lambda: f64) -> Self {
        let why = match singularity {
            Singularity::Free => ": a part of the model can move freely".to_owned(),
            Singularity::Limit => format!(
                ", the elastic one is not: a limit state (a collapse load or a mechanism) beyond \
                 load factor {lambda:.3e} of the phase"
            ),
            Singularity::Unknown => String::new(),
        };
        Self {
            reason: self.reason + &why,
            ..self
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
