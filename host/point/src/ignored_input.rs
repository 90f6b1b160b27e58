//! Laws that take no notice of what they are led through: routines that refuse without saying so.

use crate::error::Place;
use law::{Law, words};

/// Steps whose gradient moved, and what the law made of them.
#[derive(Clone, Debug, Default)]
pub(crate) struct IgnoredInput {
    /// Increments with such a step.
    increments: usize,
    /// Place of the first.
    first: Option<Place>,
    /// In one of them there was a flux.
    has_flux: bool,
    /// The increment that goes on has one.
    is_in_increment: bool,
    /// The law answered another step.
    has_answered: bool,
}

impl IgnoredInput {
    /// Takes in a step whose gradient moved: whether the law ignored it.
    pub(crate) fn step(&mut self, is_ignored: Option<bool>) {
        self.is_in_increment |= is_ignored == Some(true);
        self.has_answered |= is_ignored == Some(false);
    }

    /// Takes in the end of an increment.
    pub(crate) fn increment(&mut self, place: Place, flux: &[f64]) {
        if std::mem::take(&mut self.is_in_increment) {
            self.first.get_or_insert(place);
            self.increments += 1;
            self.has_flux |= flux.iter().any(|value| *value != 0.0);
        }
    }

    /// What the user should know. Without stress a contact that is open answers nothing either, as
    /// long as it has been, or will be, closed.
    pub(crate) fn warning(&self, law: &Law) -> Option<String> {
        let first = self.first?;
        if self.has_answered && !self.has_flux {
            return None;
        }
        let (id, n) = (&law.description().id, self.increments);
        let increments = if n == 1 { "increment" } else { "increments" };
        let (gradient, flux) = words(law.hypothesis());
        Some(format!(
            "law `{id}` takes no notice of the {gradient} in {n} {increments}, first in {first}: {flux} and internal \
             variables stay to the last bit; a routine that refuses without saying so does that, or a law \
             without stiffness"
        ))
    }
}
