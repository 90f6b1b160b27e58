//! The words for why a step failed.

use super::{
    Criterion, Culprit, DomainFailure, Imbalance, Iterations, Motion, PointPlace, Reason,
    Singularity, Symptom, Unmet,
};
use std::fmt;

impl fmt::Display for Unmet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let residual = format!(
            "residual {:.1e}, tolerance {:.1e}",
            self.residual, self.residual_tolerance
        );
        let correction = match self.correction {
            Some(correction) if self.correction_tolerance.is_infinite() => {
                format!("last correction {correction:.1e} of the increment")
            }
            None if self.correction_tolerance.is_infinite() => "no correction yet".to_owned(),
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
            Criterion::Distance => write!(f, "displacements ran away"),
        }
    }
}

impl fmt::Display for Iterations {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Newton(n, in_vain) => {
                let tried = match in_vain {
                    Some(Motion::Relaxation) => ", nor by viscous relaxation",
                    Some(Motion::Viscous) => ", nor under viscous control",
                    None => "",
                };
                write!(f, "no equilibrium after {n} iterations{tried}")
            }
            Self::Path(n) => write!(f, "no equilibrium along the path after {n} iterations"),
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
                        " at {lambda:.3e} of the phase, the elastic one is not: a collapse load or a mechanism"
                    ),
                    Some((Singularity::Unknown, _)) | None => Ok(()),
                }
            }
            Self::NoState => write!(f, "the line search found no state"),
            Self::LoadMovesNothing => write!(
                f,
                "the load does not move the points that the path is measured by"
            ),
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
            Self::RanBack { steps, highest, to } => write!(
                f,
                "the path of equilibrium runs backwards: after {steps} steps along it, which reached {highest:.4} of the \
                 phase, the next one leads to {to:.4}, far before its start"
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
