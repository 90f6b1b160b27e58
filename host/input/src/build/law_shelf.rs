//! The laws of a case, opened and built as its groups take them.

use super::Laws;
use crate::Error;
use crate::case::{CaseFile, GroupInput, LawInput};
use crate::ground::ProfileInput;
use crate::material::{
    LawTables, ParameterTable, ParameterValue, ZONE, internal_variable, is_solid_at_interface,
    place_failure, try_law,
};
use abi::Hypothesis;
use law::{BuildCause, BuiltLaw, Law, LoadedLaw, SearchPath};
use mechanics::mesh::Mesh;
use mechanics::model;
use mechanics::problem::{Formulation, Ground, Material, Variation, Water};
use std::cell::RefCell;
use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;
use text::{InputError, Source, Spanned, suggestion};

/// Key of a law, and the bits of its parameters at a place.
type LawAt = (String, Vec<u64>);

/// Laws built so far; each once for every hypothesis.
pub(super) struct LawShelf<'a> {
    pub(super) source: &'a Source,
    pub(super) file: &'a CaseFile,
    pub(super) search: SearchPath,
    pub(super) laws: Laws,
    /// What parameters may follow from: the ground of every group, and laws of it.
    pub(super) mesh: &'a Mesh,
    pub(super) water: Option<&'a Water>,
    pub(super) ground: Vec<Ground>,
    pub(super) opened: RefCell<HashMap<String, LoadedLaw>>,
    pub(super) grounds: RefCell<HashMap<LawAt, Arc<BuiltLaw>>>,
}

impl<'a> LawShelf<'a> {
    /// What the file says under a law's name.
    pub(super) fn entry(&self, name: &str, at: Range<usize>) -> Result<&'a LawInput, InputError> {
        let laws = &self.file.laws;
        laws.get(name).map(Spanned::get_ref).ok_or_else(|| {
            let names = laws.keys().map(|key| key.get_ref().as_str());
            let message = format!("there is no law `{name}` under [laws]");
            self.source.error(at, message).hint(suggestion(name, names))
        })
    }

    /// The law without its parameters.
    pub(super) fn loaded(&self, entry: &LawInput) -> Result<LoadedLaw, Error> {
        self.tables().loaded(&self.search, entry)
    }

    pub(super) fn tables(&self) -> LawTables<'a> {
        LawTables {
            source: self.source,
            tables: &self.file.laws,
        }
    }

    /// The law of this name, for a group by its number.
    pub(super) fn material(
        &mut self,
        number: usize,
        group_name: &Spanned<String>,
        group: &GroupInput,
        name: &Spanned<String>,
    ) -> Result<Material, Error> {
        let entry = self.entry(name.get_ref(), name.span())?;
        let is_interface_law = group.formulation == Formulation::ThinLayer
            && self.loaded(entry).is_ok_and(|law| {
                let offered = law.description().formulation(Hypothesis::Interface2d);
                offered.is_some()
            });
        let hypothesis = model::hypothesis(self.file.analysis, group.formulation, is_interface_law);
        let (mut parameters, elements) = self.valued_in(number, name.get_ref(), entry)?;
        let handed = self.consolidation(group, name, entry, &parameters)?;
        parameters.extend(handed.clone());
        let taken = (group_name, group, name);
        let built = self.built_for((entry, hypothesis), &parameters, taken)?;
        let mut material = Material::new(name.get_ref(), built);
        material.varying = if elements.is_empty() {
            self.varying(entry, hypothesis, &parameters)?
        } else {
            let own = self.profiles(&self.tables().parameters(entry))?;
            let profiles = own.into_iter().chain(self.profiles(&handed)?);
            profiles.chain(elements).collect()
        };
        // The law may have been built for another group.
        for (id, value) in &handed {
            if let ParameterValue::Number(number) = value.get_ref() {
                let all = Variation::Height((*number).into());
                material.varying.push((id.get_ref().clone(), all));
            }
        }
        let law = &material.built.law;
        material.initial = self.initial(entry, law, &law.description().id)?;
        Ok(material)
    }

    /// The internal variables that a law starts with, by their numbers.
    pub(super) fn initial(
        &self,
        entry: &LawInput,
        law: &Law,
        name: &str,
    ) -> Result<Vec<(usize, f64)>, Error> {
        let mut initial = Vec::new();
        for (variable, value) in &self.tables().initial(entry) {
            if !value.get_ref().is_finite() {
                let message = "expected a finite number";
                return Err(self.source.error(value.span(), message).into());
            }
            let number = internal_variable(self.source, law, name, variable)?;
            initial.push((number, *value.get_ref()));
        }
        Ok(initial)
    }

    /// The law of an entry for a hypothesis, built once. The group is that which takes it.
    fn built_for(
        &mut self,
        (entry, hypothesis): (&LawInput, Hypothesis),
        parameters: &ParameterTable,
        (group_name, group, name): (&Spanned<String>, &GroupInput, &Spanned<String>),
    ) -> Result<Arc<BuiltLaw>, Error> {
        let key = (name.get_ref().clone(), hypothesis.name());
        if let Some(built) = self.laws.get(&key) {
            return Ok(Arc::clone(built));
        }
        let loaded = self.loaded(entry)?;
        let built = try_law(&loaded, hypothesis, parameters).map_err(|failure| {
            // A phase that swaps a law is where to look.
            let by_phase = name.span() != group.law.span();
            let at = if by_phase { name } else { &entry.law };
            let error = place_failure(self.source, at, parameters, &failure);
            match failure.cause {
                BuildCause::Hypothesis { .. } => {}
                BuildCause::Text(_) => return error.with_hint("an expression begins with `=`"),
                _ => return place_failure(self.source, &entry.law, parameters, &failure),
            }
            let zone = entry.adapter.as_ref().filter(|_| entry.is_shear_zone());
            let error = zone.map_or(error, |adapter| {
                let message = format!(
                    "law `{}` is a shear zone, made for interface_2d, expected {}",
                    name.get_ref(),
                    hypothesis.name()
                );
                self.source.error(adapter.span(), message).into()
            });
            let error = self.explain(error, group_name, group, name);
            if zone.is_none() && is_solid_at_interface(&failure) {
                error.with_hint(ZONE)
            } else {
                error
            }
        })?;
        let built = Arc::new(built);
        self.laws.insert(key, Arc::clone(&built));
        Ok(built)
    }

    /// Parameters of a law that vary with the height.
    fn profiles(&self, given: &ParameterTable) -> Result<Vec<(String, Variation)>, Error> {
        let mut varying = Vec::new();
        for (id, value) in given {
            if let ParameterValue::Varying(over) = value.get_ref() {
                let profile = ProfileInput::Over(over.clone()).read(self.source, value.span())?;
                varying.push((id.get_ref().clone(), Variation::Height(profile)));
            }
        }
        Ok(varying)
    }

    /// The same; every value is held against its bounds.
    pub(super) fn varying(
        &self,
        entry: &LawInput,
        hypothesis: Hypothesis,
        given: &ParameterTable,
    ) -> Result<Vec<(String, Variation)>, Error> {
        let varying = self.profiles(given)?;
        let of_profile = |value: &Spanned<ParameterValue>| match value.get_ref() {
            ParameterValue::Varying(over) => over.z.len(),
            _ => 0,
        };
        let most = given.values().map(of_profile).max();
        for point in 1..most.unwrap_or(0) {
            let mut parameters = given.clone();
            for value in parameters.values_mut() {
                if let ParameterValue::Varying(over) = value.get_mut() {
                    let last = over.z.len() - 1;
                    over.z = vec![over.z[point.min(last)]];
                }
            }
            let loaded = self.loaded(entry)?;
            try_law(&loaded, hypothesis, &parameters)
                .map_err(|failure| place_failure(self.source, &entry.law, given, &failure))?;
        }
        Ok(varying)
    }

    /// Adds what the group expects to an error about the law's hypothesis.
    fn explain(
        &self,
        error: Error,
        name: &Spanned<String>,
        group: &GroupInput,
        law: &Spanned<String>,
    ) -> Error {
        let Error::Text(text::Error::Input(input)) = error else {
            return error;
        };
        let label = format!("taken by group `{}`", name.get_ref());
        let input = self.source.mark(*input, law.span(), label);
        let hint = format!(
            "group `{}` has the formulation `{}` in the analysis `{}`",
            name.get_ref(),
            group.formulation.name(),
            self.file.analysis.name()
        );
        input.hint(hint).into()
    }
}
