//! Cases and drivers as Python names them: a file, or a dictionary with the keys of one.

use crate::law::opener;
use crate::value;
use input::{Case, Driver, Error};
use law::Opener;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use runs::variants::keep;
use std::path::PathBuf;
use std::sync::Arc;
use text::Source;

/// What is to be computed, before it is read.
pub(crate) struct Posed {
    path: Option<PathBuf>,
    text: Option<String>,
    /// What the text is called.
    name: String,
    /// The mesh, as a file of Gmsh would say it.
    mesh: Option<Arc<[u8]>>,
    settings: Vec<String>,
    variant: Option<String>,
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
            (Some(text), _) => Source::new(&self.name, text.as_str()),
            (None, Some(path)) if path.is_dir() => Source::read(&path.join("case.toml"))?,
            (None, path) => Source::read(path.as_deref().unwrap_or("".as_ref()))?,
        };
        Ok(source.with_settings(&self.settings))
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

    /// The driver, or its variants.
    ///
    /// # Errors
    /// As [`Driver::read`]; there is no such variant.
    pub(crate) fn drivers(&self) -> Result<Vec<Driver>, Error> {
        let mut drivers = Driver::variants_with(&self.opener, self.source()?, true)?;
        let name = |driver: &Driver| driver.point().variant().map(str::to_owned);
        keep(&mut drivers, self.variant.as_deref(), name)?;
        Ok(drivers)
    }
}
