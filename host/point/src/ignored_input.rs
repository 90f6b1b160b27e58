//! Laws that take no notice of what they are led through: routines that refuse without saying so.

use crate::error::{Place, Warning};
use law::Law;

/// Steps whose gradient moved, and what the law made of them.
#[derive(Clone, Debug, Default)]
pub(crate) struct IgnoredInput {
    /// Increments with such a step.
    increments: usize,
    /// Place of the first.
    first: Option<Place>,
    /// In one of them there was a flux.
    has_flux: bool,
    /// The law answered another step.
    has_answered: bool,
}

impl IgnoredInput {
    /// Takes in a step that the law answered.
    pub(crate) fn answered(&mut self) {
        self.has_answered = true;
    }

    /// Takes in an increment with steps that it did not.
    pub(crate) fn ignored(&mut self, place: Place, flux: &[f64]) {
        self.first.get_or_insert(place);
        self.increments += 1;
        self.has_flux |= flux.iter().any(|value| *value != 0.0);
    }

    /// What the user should know. Without stress a contact that is open answers nothing either, as
    /// long as it has been, or will be, closed.
    pub(crate) fn warning(&self, law: &Law) -> Option<Warning> {
        let first = self.first?;
        if self.has_answered && !self.has_flux {
            return None;
        }
        Some(Warning::Ignored {
            first,
            increments: self.increments,
            law: law.description().id.clone(),
            hypothesis: law.hypothesis(),
        })
    }
}
