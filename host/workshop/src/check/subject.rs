//! The library that is checked, and how.

use super::draw::Draw;
use super::random::Random;
use super::specimen::{Specimen, hypotheses};
use super::{Arguments, Verdict, author_path, failed, routine};
use abi::Hypothesis;
use law::capsule::Capsule;
use law::foreign::Foreign;
use law::probe::call_log::KeptCall;
use law::{FormulationDescription, LoadedLaw, Opener};
use std::path::{Path, PathBuf};
use text::{InputError, file};

/// A law under one of its hypotheses.
pub(super) type Offered = (LoadedLaw, FormulationDescription, Hypothesis);

/// Subject of the checks.
#[derive(Clone, Debug)]
pub(super) struct Subject {
    pub(super) path: PathBuf,
    pub(super) seed: u64,
    pub(super) settings: Vec<(String, f64)>,
    pub(super) opener: Opener,
    /// The author's own path.
    pub(super) driver: Option<PathBuf>,
    /// A routine is led a short way only.
    pub(super) near: bool,
    /// The capsule whose increment is all that is looked at.
    pub(super) at: Option<Box<Capsule>>,
}

impl Subject {
    pub(super) fn new(arguments: &Arguments, opener: &Opener, path: &Path) -> Self {
        // One that can no longer be read was not asked for: the parent has read it.
        let at = arguments.at.as_ref().and_then(|at| Capsule::read(at).ok());
        Self {
            at: at.map(Box::new),
            path: path.to_owned(),
            seed: arguments.seed,
            settings: arguments.set.clone(),
            opener: opener.clone(),
            driver: arguments.driver.clone(),
            near: arguments.near,
        }
    }

    pub(super) fn bytes(&self) -> Result<Vec<u8>, Verdict> {
        file::read_library(&self.path).map_err(|why| failed(format!("it cannot be read: {why}")))
    }

    /// The library as a file would name it, called in this process if it has no contract; a check
    /// has a separate process.
    pub(super) fn foreign(&self) -> Option<Foreign> {
        if let Some(capsule) = &self.at {
            return capsule.law.foreign();
        }
        let adapter = routine::adapter(&self.path)?;
        let of_driver = self
            .driver
            .as_ref()
            .and_then(|driver| author_path::foreign(&self.opener, driver));
        Some(Foreign {
            in_process: true,
            record: None,
            ..of_driver.unwrap_or_else(|| Foreign {
                adapter,
                ..Foreign::umat(&self.path)
            })
        })
    }

    /// The laws of the library.
    pub(super) fn laws(&self) -> Result<Vec<LoadedLaw>, Verdict> {
        let library = match self.foreign() {
            Some(foreign) => self.opener.open_foreign(&foreign, |_| Ok(())),
            None => self.opener.open(&self.path),
        };
        let library = library.map_err(|why| failed(with_place(&why)))?;
        let ids = library.laws().map(|law| law.id.as_str());
        Ok(ids.filter_map(|id| library.law(id)).collect())
    }

    /// The law of a call that was written down, and its hypothesis.
    pub(super) fn law_of(&self, call: &KeptCall) -> Result<Option<Offered>, Verdict> {
        let laws = self.laws()?.into_iter();
        let mut named = laws.filter(|law| law.description().id == call.law);
        Ok(named.find_map(|law| {
            let mut offered = hypotheses(&law).into_iter();
            let (formulation, hypothesis) = offered.find(|(_, h)| h.name() == call.hypothesis)?;
            Some((law, formulation, hypothesis))
        }))
    }

    /// Looks at every law under every hypothesis with this many sets of parameters, by random numbers of this
    /// name. Returns the sum of the counts. What was looked at is destroyed before the next one.
    pub(super) fn each(
        &self,
        how: Draw,
        name: &str,
        n_sets: usize,
        mut look: impl FnMut(&Specimen, &mut Random) -> Result<usize, Verdict>,
    ) -> Result<usize, Verdict> {
        let mut random = Random::new(self.seed, name);
        let specimens = self.specimens(how, n_sets, &mut random)?.into_iter();
        specimens.map(|specimen| look(&specimen, &mut random)).sum()
    }
}

/// Why a library or its sidecar cannot be used, on one line: with file and line, where there is one, and what the
/// user could do.
fn with_place(why: &law::Error) -> String {
    let place = match why {
        law::Error::Text(error) => error.place().map(InputError::line),
        _ => None,
    };
    let mut words = match place {
        Some(line) => format!("{}:{}: {why}", line.file, line.at.0),
        None => why.to_string(),
    };
    if let Some(help) = why.help() {
        words.push_str("; ");
        words.push_str(help);
    }
    words
}
