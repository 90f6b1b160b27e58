//! Cases and drivers as Python names them: a file, or a dictionary with the keys of one.

use crate::law::{Law, opener};
use crate::value;
use abi::Hypothesis;
use input::build::Laws;
use input::{Case, Driver, Error};
use law::Opener;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use runs::variants::keep;
use std::path::PathBuf;
use std::sync::Arc;
use text::Source;

/// A case or driver before it is read.
pub(crate) struct Posed {
    path: Option<PathBuf>,
    text: Option<String>,
    /// Name of the text.
    name: String,
    /// The mesh, as a file of Gmsh would say it.
    mesh: Option<Arc<[u8]>>,
    settings: Vec<String>,
    variant: Option<String>,
    /// Laws that were made for a hypothesis, by their names in the case.
    chosen: Vec<(String, Hypothesis)>,
    pub(crate) opener: Opener,
}

impl Posed {
    /// Takes what Python's functions hand over.
    ///
    /// # Errors
    /// A value that no file has.
    pub(crate) fn of(
        source: &Bound<'_, PyAny>,
        name: String,
        mesh: Option<Vec<u8>>,
        settings: Option<&Bound<'_, PyDict>>,
        variant: Option<String>,
        isolate: Option<f64>,
    ) -> PyResult<Self> {
        let (path, text) = if source.cast::<PyDict>().is_ok() {
            let table = value::table(source)?;
            (None, Some(value::text_of(&table)?))
        } else {
            (Some(source.extract()?), None)
        };
        Ok(Self {
            chosen: chosen(source)?,
            path,
            text,
            name,
            mesh: mesh.map(Into::into),
            settings: value::settings(settings)?,
            variant,
            opener: opener(isolate)?,
        })
    }

    /// The name of a text that no file has.
    pub(crate) fn written(&self) -> Option<&str> {
        self.text.as_ref().map(|_| self.name.as_str())
    }

    fn source(&self) -> Result<Source, Error> {
        let source = match (&self.text, &self.path) {
            (Some(text), _) => Source::in_memory(&self.name, text.as_str()),
            (None, Some(path)) if path.is_dir() => Source::read(&path.join("case.toml"))?,
            (None, path) => Source::read(path.as_deref().unwrap_or("".as_ref()))?,
        };
        Ok(source.with_settings_in_memory(&self.settings))
    }

    /// The case, or its variants.
    ///
    /// # Errors
    /// As [`Case::load`]; there is no such variant.
    pub(crate) fn cases(&self) -> Result<Vec<Case>, Error> {
        let cases = Case::of(self.source()?)?.into_iter();
        let mut cases: Vec<Case> = cases.map(|case| case.opened_by(&self.opener)).collect();
        for case in &mut cases {
            case.file.mesh.content.clone_from(&self.mesh);
        }
        keep(&mut cases, self.variant.as_deref(), |case| {
            case.variant.clone()
        })?;
        Ok(cases)
    }

    /// Checks that a case takes laws that were made for a hypothesis in that one.
    ///
    /// # Errors
    /// As [`Case::pose`]; it does not.
    pub(crate) fn check_laws_of(&self, case: &Case) -> Result<(), Error> {
        if self.chosen.is_empty() {
            return Ok(());
        }
        self.check_laws(&case.pose()?.laws)
    }

    /// The same of laws that were built for a case.
    ///
    /// # Errors
    /// It does not.
    pub(crate) fn check_laws(&self, laws: &Laws) -> Result<(), Error> {
        for (name, made_for) in &self.chosen {
            let mut own = laws.keys().filter(|(law, _)| law == name);
            let Some((_, taken_in)) = own.find(|(_, taken_in)| *taken_in != made_for.name()) else {
                continue;
            };
            let message = format!(
                "law `{name}` was made for the hypothesis `{}`, and the case takes it in `{taken_in}`",
                made_for.name()
            );
            let hint = format!("`hypothesis=\"{taken_in}\"`, or a dictionary instead of the law");
            return Err(Error::usage(message).with_hint(&hint));
        }
        Ok(())
    }

    /// The driver, or its variants.
    ///
    /// # Errors
    /// As [`Driver::read`]; there is no such variant.
    pub(crate) fn drivers(&self) -> Result<Vec<Driver>, Error> {
        let mut drivers = Driver::variants(&self.opener, self.source()?, true)?;
        let name = |driver: &Driver| driver.point().variant().map(str::to_owned);
        keep(&mut drivers, self.variant.as_deref(), name)?;
        Ok(drivers)
    }
}

/// The laws of a dictionary that were made for a hypothesis which was named.
fn chosen(source: &Bound<'_, PyAny>) -> PyResult<Vec<(String, Hypothesis)>> {
    let mut chosen = Vec::new();
    let Ok(case) = source.cast::<PyDict>() else {
        return Ok(chosen);
    };
    let Some(laws) = case.get_item("laws")? else {
        return Ok(chosen);
    };
    let Ok(laws) = laws.cast_into::<PyDict>() else {
        return Ok(chosen);
    };
    for (name, law) in laws {
        if let Ok(law) = law.cast::<Law>()
            && let Some(hypothesis) = law.get().chosen_hypothesis()
        {
            chosen.push((name.str()?.to_string(), hypothesis));
        }
    }
    Ok(chosen)
}
