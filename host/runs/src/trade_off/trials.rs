//! Runs of a case under settings. Each is kept, and not done again.

use super::settings::Settings;
use crate::Error;
use crate::experiment::{Earlier, Kept, Scratch, Timing, Trial, measure};
use crate::run::identity_of;
use input::Case;
use law::Stop;
use results::output_request::Output;
use std::cell::RefCell;
use std::path::{Path, PathBuf};

/// Name of the file of trials in the folder of a study, and what is done there.
const FILE: (&str, &str) = ("trials.jsonl", "studies");

/// The trials of one case.
#[derive(Debug)]
pub(super) struct Trials<'a> {
    pub(super) case: &'a Case,
    pub(super) stop: &'a Stop,
    scratch: Scratch,
    kept: RefCell<Kept<String, Trial>>,
    folder: PathBuf,
}

impl<'a> Trials<'a> {
    /// Begins the trials of a study in its folder; `resume`: with those that an earlier call has kept there.
    ///
    /// # Errors
    /// Bad input; the folder cannot be written; what is kept there belongs to another study.
    pub(super) fn begin(
        case: &'a Case,
        folder: &Path,
        resume: bool,
        stop: &'a Stop,
    ) -> Result<Self, Error> {
        let earlier = if resume {
            Earlier::GoOn
        } else {
            Earlier::Forget
        };
        let kept = Kept::in_folder(folder, FILE, &identity_of(case)?, earlier)?;
        Ok(Self {
            case,
            stop,
            scratch: Scratch::new(folder, stop)?,
            kept: RefCell::new(kept),
            folder: folder.to_owned(),
        })
    }

    /// Runs the case under some settings, unless that was done before: in the same round, if it is done several times.
    ///
    /// # Errors
    /// Those of the run; it takes too long; what is done cannot be kept.
    pub(super) fn run(
        &self,
        settings: &Settings,
        timing: Timing,
        round: usize,
    ) -> Result<Trial, Error> {
        let key = key(settings, round);
        if let Some(found) = self.kept.borrow().find(&key) {
            return Ok(found.clone());
        }
        let mut case = settings.apply(self.case)?;
        case.file.output = Output::default();
        let done = measure(case, &self.scratch, timing)?;
        self.kept.borrow_mut().keep(key, done.clone())?;
        Ok(done)
    }

    /// Whether a trial is done.
    pub(super) fn has(&self, settings: &Settings, round: usize) -> bool {
        self.kept.borrow().find(&key(settings, round)).is_some()
    }

    /// How many trials are done.
    pub(super) fn len(&self) -> usize {
        self.kept.borrow().len()
    }

    /// The study has come to its end: its trials are not kept any longer.
    pub(super) fn end(self) {
        // A file that cannot be removed is begun anew by the next study.
        let _ = std::fs::remove_file(self.folder.join(FILE.0));
    }
}

/// Key of a stored trial.
fn key(settings: &Settings, round: usize) -> String {
    format!("{settings:?}, round {round}")
}
