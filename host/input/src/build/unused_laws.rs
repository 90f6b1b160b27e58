//! Laws of a file that nothing takes: for variants, for other files, for later. No result depends on them, so
//! what is wrong with one is a warning.

use super::followed::Without;
use super::law_shelf::LawShelf;
use crate::Error;
use crate::case::LawInput;
use crate::material::{given, no_internal_variable, place_failure, try_law};
use abi::Hypothesis;
use law::{BuildCause, BuildFailure, LoadedLaw};
use std::collections::BTreeSet;
use text::Spanned;

/// How closely laws that nothing takes are looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Look {
    /// Parameters of laws that others of the file are, too: nothing is opened or called for it.
    Known,
    /// All of them, as if they were taken.
    Close,
}

impl LawShelf<'_> {
    /// What would be refused if it were taken, in words. A file that does not stand alone may leave parameters to
    /// others.
    ///
    /// # Errors
    /// Stopped as asked.
    pub(super) fn spare(&self, look: Look, stands_alone: bool) -> Result<Vec<String>, Error> {
        let mut said = Vec::new();
        for (name, entry) in &self.file.laws {
            let name = name.get_ref();
            let is_taken = self.laws.keys().any(|(taken, _)| taken == name);
            if is_taken || self.tables().is_filler(entry.get_ref()) {
                continue;
            }
            match self.try_spare(name, entry, look, stands_alone) {
                Err(error) if error.is_stop() => return Err(error),
                Err(error) => said.push(self.words(name, entry, &error)),
                Ok(()) => {}
            }
        }
        Ok(said)
    }

    fn try_spare(
        &self,
        name: &str,
        entry: &Spanned<LawInput>,
        look: Look,
        stands_alone: bool,
    ) -> Result<(), Error> {
        let entry = entry.get_ref();
        let parameters = match self.valued(name, entry, None) {
            Ok(parameters) => parameters,
            Err(Without::Error(error)) => return Err(*error),
            // No element says what its values are.
            Err(Without::Place) => return Ok(()),
        };
        let placed = |failure: BuildFailure| match failure.cause {
            BuildCause::Missing { .. } if !stands_alone => Ok(()),
            _ => Err(place_failure(
                self.source,
                &entry.law,
                &parameters,
                &failure,
            )),
        };
        if look == Look::Known {
            let Some(law) = self.known(entry) else {
                return Ok(());
            };
            self.has_variables(law, entry)?;
            let values = law.values(&given(&parameters));
            return values.map_or_else(placed, |_| Ok(()));
        }
        let law = self.loaded(entry)?;
        self.has_variables(&law, entry)?;
        let offers = |one: &Hypothesis| law.description().formulation(*one).is_some();
        let offered: Vec<Hypothesis> = Hypothesis::ALL.into_iter().filter(offers).collect();
        let mut first = None;
        // It may be meant for any of them; a law that offers none says why.
        for &hypothesis in offered.iter().chain(&Hypothesis::ALL[..1]) {
            let tried = match try_law(&law, hypothesis, &parameters) {
                Ok(_) => self.varying(entry, hypothesis, &parameters).map(drop),
                Err(failure) => placed(failure),
            };
            match tried {
                Ok(()) => return Ok(()),
                Err(error) => first = first.or(Some(error)),
            }
        }
        first.map_or(Ok(()), Err)
    }

    /// Internal variables that are given a value are there under one hypothesis at least.
    fn has_variables(&self, law: &LoadedLaw, entry: &LawInput) -> Result<(), Error> {
        let law = law.description();
        let all = law.formulations.iter().flat_map(|f| &f.internal_variables);
        let ids: BTreeSet<&str> = all.map(|variable| variable.id.as_str()).collect();
        let given = self.tables().initial(entry);
        let unknown = given.keys().find(|id| !ids.contains(id.get_ref().as_str()));
        let ids = ids.into_iter().collect();
        unknown.map_or(Ok(()), |id| {
            Err(no_internal_variable(self.source, &law.id, id, ids))
        })
    }

    /// The law of a table, where a table that is taken is of the same one.
    fn known(&self, entry: &LawInput) -> Option<&LoadedLaw> {
        let mut taken = self.laws.values().map(|built| built.law.loaded());
        let is_it = |law: &&LoadedLaw| {
            let is_plain = law.library().foreign().is_none() && law.shear_zone().is_none();
            is_plain && law.description().id == *entry.law.get_ref()
        };
        entry.adapter.is_none().then(|| taken.find(is_it))?
    }

    fn words(&self, name: &str, entry: &Spanned<LawInput>, error: &Error) -> String {
        let place = match error.place() {
            Some(input) => {
                let line = input.line();
                format!("{}:{}:{}", line.file, line.at.0, line.at.1)
            }
            None => self.source.place(&entry.get_ref().law.span()),
        };
        let hint = error.help().map(|hint| format!("; {hint}"));
        let what = error.to_string();
        format!(
            "{place}: law `{name}` of [laws], which is not used here, would be refused: {}{}",
            what.lines()
                .next()
                .unwrap_or_default()
                .trim_end_matches('.'),
            hint.unwrap_or_default()
        )
    }
}
