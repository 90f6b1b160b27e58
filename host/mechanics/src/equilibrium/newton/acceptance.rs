//! When a state counts as equilibrium.
//!
//! Two criteria, body by body: the residual relative to the forces in play, and the last correction relative to the
//! increment of the displacements. Both references come from the iterate itself, so an iterate that runs away would
//! widen its own tolerances. Pressures of 10⁹ kPa in elements without stiffness would excuse a residual of many kN, and
//! a correction of 10¹⁰ m is small compared with an increment of 10¹⁰ m. Therefore neither reference may exceed given
//! values by more than a factor:
//!
//! - Forces: those at the start of the phase, those of the last equilibrium, the loads, and those of the elastic
//!   response to the step.
//! - Displacements: those predicted from the last steps or by elasticity.
//!
//! Stresses on a yield surface are smaller than elastic ones. Larger ones arise from dilatancy against a stiff
//! neighbour or from a stiffness that grows with pressure. A factor of ten ([`FORCES`]) leaves room for them, and costs
//! at most one digit of the tolerance. If the forces rise farther in one step, the criterion is only stricter.

use super::round_off::exact;

/// Share of the tolerances that a correction with a kept matrix, and the residual it leaves, must not exceed; neither
/// is waived then.
pub(super) const STALE: f64 = 0.1;
/// The residual is measured against at most this multiple of the forces that are given.
pub(super) const FORCES: f64 = 10.0;
/// A correction is measured against at most this multiple of the predicted displacements, and never waived beyond it.
pub(super) const MOVES: f64 = 100.0;

/// Forces and displacements of a body, as they are given to a step and as an iterate has them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Forces {
    /// Internal forces of the iterate.
    pub(super) in_play: f64,
    /// Loads, or the largest of the forces at the start of a phase.
    pub(super) imposed: f64,
    /// Internal forces of the last equilibrium.
    pub(super) last: f64,
    /// Forces of the elastic response to the step; `None` without one.
    pub(super) elastic: Option<f64>,
    /// If no force has ever acted, smaller forces count as zero.
    pub(super) floor: f64,
}

impl Forces {
    /// Reference of the residual.
    pub(super) fn scale(self) -> f64 {
        let given = self.elastic.map_or(f64::INFINITY, |elastic| {
            FORCES * elastic.max(self.imposed).max(self.last)
        });
        self.in_play.min(given).max(self.imposed).max(self.floor)
    }
}

/// Size of the last correction in one body.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Change {
    /// Relative to the increment, as far as that may measure it.
    pub(super) relative: f64,
    /// Relative to what was predicted for the step; 0 where nothing was.
    pub(super) beyond: f64,
}

impl Change {
    /// The criterion of a correction in a step whose increment has come to `moved` where `predicted` was expected.
    pub(super) fn of(correction: f64, moved: f64, predicted: f64) -> Self {
        let limit = if predicted > 0.0 {
            MOVES * predicted
        } else {
            f64::INFINITY
        };
        Self {
            relative: correction / moved.min(limit).max(f64::MIN_POSITIVE),
            beyond: if predicted > 0.0 {
                correction / predicted
            } else {
                0.0
            },
        }
    }
}

/// Criteria of a state.
#[derive(Clone, Copy, Debug)]
pub(super) struct Criteria {
    pub(super) force: f64,
    pub(super) displacement: f64,
    /// The matrix is kept: a part that has yielded since still looks stiff to it, so corrections are smaller than the
    /// error.
    pub(super) is_stale: bool,
}

/// A body after an iteration.
#[derive(Clone, Copy, Debug)]
pub(super) struct Measures {
    /// Residual relative to the forces in play.
    pub(super) residual: f64,
    /// The last correction, if there was one and it was a whole Newton correction.
    pub(super) whole: Option<Change>,
    /// The last correction, whatever it was, relative to what was predicted.
    pub(super) beyond: f64,
    /// The body has moved by more than its own size and far beyond what was predicted.
    pub(super) is_away: bool,
}

impl Measures {
    /// Whether the residual is [exact], and the body where it can be expected.
    pub(super) fn is_exact(&self, criteria: Criteria) -> bool {
        !criteria.is_stale
            && self.residual <= exact(criteria.force)
            && self.beyond <= MOVES
            && !self.is_away
    }

    /// Whether the body is in equilibrium.
    pub(super) fn is_equilibrium(&self, criteria: Criteria) -> bool {
        let share = if criteria.is_stale { STALE } else { 1.0 };
        let is_small = |change: Change| change.relative <= share * criteria.displacement;
        let small_residual = self.residual <= share * criteria.force;
        // Where corrections are free, whole ones are no better than others.
        let is_free = criteria.displacement.is_infinite() && !criteria.is_stale;
        self.is_exact(criteria)
            || (small_residual && !self.is_away && is_free)
            || (small_residual && !self.is_away && self.whole.is_some_and(is_small))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    const CRITERIA: Criteria = Criteria {
        force: 1e-9,
        displacement: 1e-7,
        is_stale: false,
    };

    fn measures(residual: f64, change: Change) -> Measures {
        Measures {
            residual,
            whole: Some(change),
            beyond: change.beyond,
            is_away: false,
        }
    }

    #[test]
    fn forces_in_play_measure_the_residual() {
        let forces = Forces {
            in_play: 50.0,
            imposed: 20.0,
            last: 30.0,
            elastic: Some(0.0),
            floor: 0.0,
        };
        assert_relative_eq!(forces.scale(), 50.0);
        // What acts from outside is in play, whatever the trial says.
        let unloaded = Forces {
            in_play: 0.0,
            ..forces
        };
        assert_relative_eq!(unloaded.scale(), 20.0);
    }

    #[test]
    fn forces_that_run_away_do_not() {
        let forces = Forces {
            in_play: 3e9,
            imposed: 20.0,
            last: 30.0,
            elastic: Some(0.0),
            floor: 0.0,
        };
        assert_relative_eq!(forces.scale(), FORCES * 30.0);
        let pushed = Forces {
            elastic: Some(1e3),
            ..forces
        };
        assert_relative_eq!(pushed.scale(), FORCES * 1e3);
        // From nothing that is given nothing can be told.
        let unknown = Forces {
            elastic: None,
            ..forces
        };
        assert_relative_eq!(unknown.scale(), 3e9);
    }

    #[test]
    fn a_linear_step_ends_after_one_correction_as_large_as_its_increment() {
        let change = Change::of(1e-3, 1e-3, 1e-3);
        assert_relative_eq!(change.relative, 1.0);
        assert!(measures(1e-13, change).is_equilibrium(CRITERIA));
        assert!(!measures(1e-11, change).is_equilibrium(CRITERIA));
    }

    #[test]
    fn a_tolerance_near_round_off_does_not_ask_round_off_to_settle() {
        let tight = Criteria {
            force: 1e-13,
            ..CRITERIA
        };
        // Nothing was to move: an increment of 1e-19 m, and corrections as large.
        let change = Change::of(1e-19, 1e-19, 0.0);
        assert!(measures(4e-16, change).is_equilibrium(tight));
        assert!(!measures(5e-14, change).is_equilibrium(tight));
        // What is above the tolerance stays above it.
        let tighter = Criteria {
            force: 1e-16,
            ..CRITERIA
        };
        assert!(!measures(4e-16, change).is_equilibrium(tighter));
    }

    #[test]
    fn a_correction_far_beyond_what_was_predicted_is_not_waived() {
        // 5e9 m where 0.1 mm was expected, and a residual of nothing.
        let change = Change::of(5e9, 5e9, 1e-4);
        assert!(!measures(0.0, change).is_equilibrium(CRITERIA));
    }

    #[test]
    fn an_increment_that_ran_away_does_not_measure_the_next_correction() {
        // A metre is little beside 5e9 m, and much beside 0.1 mm.
        let change = Change::of(1.0, 5e9, 1e-4);
        assert!(change.relative > 1.0, "{change:?}");
        assert!(!measures(1e-11, change).is_equilibrium(CRITERIA));
        // The same correction counts where so much was predicted.
        let change = Change::of(1.0, 5e9, 5e9);
        assert!(measures(1e-11, change).is_equilibrium(CRITERIA));
    }

    #[test]
    fn a_body_that_is_away_is_in_no_equilibrium() {
        let change = Change::of(0.0, 5e9, 1e-4);
        let still = measures(0.0, change);
        assert!(still.is_equilibrium(CRITERIA));
        let away = Measures {
            is_away: true,
            ..still
        };
        assert!(!away.is_equilibrium(CRITERIA));
    }

    #[test]
    fn the_matrix_of_an_earlier_step_must_do_better() {
        let change = Change::of(0.5e-7, 1.0, 1.0);
        let fresh = measures(0.5e-9, change);
        assert!(fresh.is_equilibrium(CRITERIA));
        let stale = Criteria {
            is_stale: true,
            ..CRITERIA
        };
        assert!(!fresh.is_equilibrium(stale));
        assert!(!measures(0.0, Change::of(1.0, 1.0, 1.0)).is_equilibrium(stale));
        assert!(measures(0.5e-10, Change::of(0.5e-8, 1.0, 1.0)).is_equilibrium(stale));
    }

    #[test]
    fn part_of_a_correction_decides_nothing() {
        let part = Measures {
            whole: None,
            ..measures(1e-11, Change::default())
        };
        assert!(!part.is_equilibrium(CRITERIA));
    }
}
