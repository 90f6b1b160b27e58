//! What tolerances may grow with: what a path was given, not where a trial of it went.
//!
//! A component that runs away takes fluxes, gradients and their round-off along. Were the tolerance
//! relative to these, whatever runs far enough would be met.

/// How far fluxes, and gradients beyond those prescribed, may lie above what was given before they
/// count no more.
const MARGIN: f64 = 10.0;
/// The same for free gradients, in elastic answers to the largest flux. The round-off of one as
/// large is 4e-10 of that flux.
const FREE: f64 = 1e5;
/// Largest distance from a goal, relative to the largest flux that the path has seen.
const MET: f64 = 1e-9;

/// Sizes given to a path up to the end of an increment.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ToleranceScale {
    /// Largest flux that it started from or was asked for.
    flux: f64,
    /// Largest gradient prescribed.
    reach: f64,
    /// Largest stiffness that the law had where the path came along, or that controls it.
    modulus: f64,
}

impl ToleranceScale {
    /// Takes in a flux that the path starts from, or is asked for.
    pub(crate) fn flux(&mut self, flux: f64) {
        self.flux = self.flux.max(flux.abs());
    }

    /// Takes in a prescribed gradient.
    pub(crate) fn reach(&mut self, gradient: f64) {
        self.reach = self.reach.max(gradient.abs());
    }

    /// Takes in a stiffness.
    pub(crate) fn modulus(&mut self, modulus: f64) {
        self.modulus = self.modulus.max(modulus);
    }

    /// The largest flux that the path started from or was asked for.
    pub(crate) fn largest_flux(&self) -> f64 {
        self.flux
    }

    /// A flux that was found, as far as what was given explains it.
    pub(crate) fn flux_of(&self, found: f64) -> f64 {
        let explained = MARGIN * (self.flux + self.modulus * self.reach);
        // Where there is no stiffness, or nothing was given, there is nothing to go by.
        if self.modulus > 0.0 && explained > 0.0 {
            found.min(explained)
        } else {
            found
        }
    }

    /// A gradient that was found, as far as what was given explains it.
    pub(crate) fn reach_of(&self, found: f64) -> f64 {
        let explained = MARGIN * self.reach + FREE * self.flux / self.modulus;
        // Not a number, too, without stiffness.
        if explained > 0.0 {
            found.min(explained)
        } else {
            found
        }
    }

    /// How far from its goal a component may be after an increment: whatever the tolerance of the
    /// iterations was. `found`: the largest flux; `round_off`: of a sum, relative.
    pub(crate) fn bound(&self, goal: f64, found: f64, round_off: f64) -> f64 {
        let flux = self.flux.max(goal.abs()).max(self.flux_of(found));
        MET * flux + 2.0 * round_off * MARGIN * self.modulus * self.reach
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// 100 kPa on a law with 1e5 kPa, led by 0.01.
    fn anchor() -> ToleranceScale {
        let mut anchor = ToleranceScale::default();
        anchor.flux(-100.0);
        anchor.flux(7.0);
        anchor.reach(-0.01);
        anchor.modulus(1e5);
        anchor
    }

    #[test]
    fn what_runs_away_counts_no_more_than_what_was_given() {
        let anchor = anchor();
        assert_relative_eq!(anchor.flux_of(5e3), 5e3);
        assert_relative_eq!(anchor.flux_of(1e30), 10.0 * (100.0 + 1e5 * 0.01));
        assert_relative_eq!(anchor.reach_of(3.0), 3.0);
        assert_relative_eq!(anchor.reach_of(1e30), 0.1 + 1e5 * 1e-3);
        let bound = anchor.bound(0.0, 1e30, 1e-15);
        assert!(bound < 1.2e-5, "{bound}");
    }

    #[test]
    fn without_stiffness_or_anything_given_all_counts() {
        let mut anchor = ToleranceScale::default();
        assert_relative_eq!(anchor.flux_of(1e30), 1e30);
        assert_relative_eq!(anchor.reach_of(1e30), 1e30);
        anchor.flux(1.0);
        assert_relative_eq!(anchor.flux_of(1e30), 1e30);
        assert_relative_eq!(anchor.reach_of(1e30), 1e30);
    }
}
