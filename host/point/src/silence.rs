//! Laws that take no notice of what they are led through: routines that refuse without saying so.

use super::{Driver, words};

/// Steps whose gradient moved, and what the law made of them.
#[derive(Clone, Debug, Default)]
pub(super) struct Silence {
    /// Increments with such a step.
    increments: usize,
    /// Place of the first.
    first: String,
    /// In one of them there was a flux.
    has_flux: bool,
    /// The law answered another step.
    has_answered: bool,
}

impl Silence {
    /// Takes in a step that the law answered.
    pub(super) fn answered(&mut self) {
        self.has_answered = true;
    }

    /// Takes in an increment with steps that it did not.
    pub(super) fn ignored(&mut self, place: impl Fn() -> String, flux: &[f64]) {
        if self.increments == 0 {
            self.first = place();
        }
        self.increments += 1;
        self.has_flux |= flux.iter().any(|value| *value != 0.0);
    }

    /// What the user should know. Without stress a contact that is open answers nothing either, as
    /// long as it has been, or will be, closed.
    pub(super) fn warning(&self, driver: &Driver) -> Option<String> {
        if self.increments == 0 || (self.has_answered && !self.has_flux) {
            return None;
        }
        let (gradient, flux) = words(driver.law().hypothesis());
        let n = self.increments;
        let increments = if n == 1 { "increment" } else { "increments" };
        Some(format!(
            "law `{}` takes no notice of the {gradient} in {n} {increments}, first in {}: {flux} and \
             internal variables stay to the last bit; a routine that refuses without saying so does \
             that, or a law without stiffness",
            driver.law().description().id,
            self.first
        ))
    }
}
