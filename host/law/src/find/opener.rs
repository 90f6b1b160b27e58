//! Opening libraries: whom to trust, what to record, what is open already.

use super::opened::{Library, OpenedLaw, Stamp};
use crate::foreign::{self, Adapter, Fault, Foreign};
use crate::instance::Described;
#[cfg(unix)]
use crate::process::isolate::Workers;
use crate::process::library_bytes::Image;
use crate::process::trust::Trust;
use crate::process::{child, vetting};
use crate::{Error, library};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

/// Settings for opening libraries. The program makes one and hands it down; two of them know nothing
/// of each other. Copies share what is opened.
///
/// The default neither probes nor isolates, and records nothing.
#[derive(Clone, Debug, Default)]
pub struct Opener {
    trust: Trust,
    record: Option<PathBuf>,
    /// A file that stays what it is is opened once.
    opened: Arc<Mutex<Vec<Arc<Library>>>>,
}

fn stamp(path: &Path) -> Option<Stamp> {
    let metadata = path.metadata().ok()?;
    Some((metadata.len(), metadata.modified().ok()?))
}

impl Opener {
    /// Opens libraries with this trust.
    pub fn new(trust: Trust) -> Self {
        Self {
            trust,
            ..Self::default()
        }
    }

    /// UMATs that are opened from now on write the arguments of one call to this file, where no key
    /// `record` says otherwise.
    #[must_use]
    pub fn recording_to(self, path: PathBuf) -> Self {
        Self {
            record: Some(path),
            ..self
        }
    }

    /// The file of [`Opener::recording_to`].
    pub fn record(&self) -> Option<&Path> {
        self.record.as_deref()
    }

    /// The trust that holds here. A child is where libraries are tried and called, so it does
    /// neither.
    pub fn trust(&self) -> Trust {
        if child::is_child() {
            return Trust::default();
        }
        self.trust
    }

    /// Opens a library: permissions, hash, handshake, description, in this order.
    ///
    /// # Errors
    /// [`Error::Library`] with the path and what is wrong.
    pub fn open(&self, path: &Path) -> Result<Arc<Library>, Error> {
        self.open_if(path, |_| Ok(()))
    }

    /// Opens a library whose SHA-256 is approved; nothing of it runs before.
    ///
    /// # Errors
    /// As [`Opener::open`], and those of `approve`.
    pub fn open_if(
        &self,
        path: &Path,
        approve: impl Fn(&str) -> Result<(), Error>,
    ) -> Result<Arc<Library>, Error> {
        let mut opened = self.opened.lock().unwrap_or_else(PoisonError::into_inner);
        let stamp = stamp(path);
        let known = |library: &&Arc<Library>| library.path == path && library.stamp == stamp;
        if let Some(library) = opened.iter().find(known).filter(|_| stamp.is_some()) {
            approve(&library.sha256)?;
            return Ok(Arc::clone(library));
        }
        let fault = |why| Error::library(format!("library {} {why}", path.display()));
        let mut image = Image::read(path).map_err(fault)?;
        approve(&image.sha256)?;
        let sha256 = image.sha256.clone();
        let warnings = std::mem::take(&mut image.warnings);
        let laws = self.laws_of(path, image)?;
        let library = Arc::new(Library {
            path: path.to_owned(),
            sha256,
            warnings,
            stamp,
            laws,
            sidecar: None,
            foreign: None,
        });
        opened.push(Arc::clone(&library));
        Ok(library)
    }

    /// Opens the library in this process, after it was tried in another, or asks a worker.
    fn laws_of(&self, path: &Path, image: Image) -> Result<Vec<OpenedLaw>, Error> {
        let unusable = |why| Error::library(format!("library {}: {why}", path.display()));
        let trust = self.trust();
        #[cfg(unix)]
        if let Some(limit) = trust.isolate {
            let workers = Workers::of(path, &image.sha256, None, Some(limit));
            let laws = workers.laws(false).map_err(unusable)?.into_iter();
            return Ok(laws.map(OpenedLaw::new).collect());
        }
        if trust.probe {
            vetting::vet(path, &image.sha256)?;
        }
        let laws = library::open(path, image).map_err(unusable)?;
        Ok(laws.into_iter().map(OpenedLaw::here).collect())
    }

    /// Opens a library that is made for another program, if its SHA-256 is approved. Its code runs
    /// in worker processes unless it is reported to run in this one.
    ///
    /// # Errors
    /// [`Error::Library`] with the path and what is wrong, and those of `approve`.
    pub fn open_foreign(
        &self,
        foreign: &Foreign,
        approve: impl Fn(&str) -> Result<(), Error>,
    ) -> Result<Arc<Library>, Error> {
        let path = &foreign.library;
        let fault = |why: String| Error::library(format!("library {} {why}", path.display()));
        let mut image = Image::read(path).map_err(fault)?;
        approve(&image.sha256)?;
        if cfg!(not(unix)) && !foreign.in_process {
            return Err(fault(
                "can only run in this process here: `in_process = true`".to_owned(),
            ));
        }
        let mut foreign = self.completed(foreign);
        let (laws, sidecar) = self.foreign_laws(&mut foreign, &image)?;
        Ok(Arc::new(Library {
            path: path.clone(),
            warnings: std::mem::take(&mut image.warnings),
            sha256: image.sha256.clone(),
            stamp: None,
            laws: laws.into_iter().map(OpenedLaw::new).collect(),
            sidecar,
            foreign: Some(foreign),
        }))
    }

    /// The laws of a foreign library, in this process or in workers, and the hash of its sidecar. The hash becomes part
    /// of the library's identity.
    fn foreign_laws(
        &self,
        foreign: &mut Foreign,
        image: &Image,
    ) -> Result<(Described, Option<String>), Error> {
        let path = foreign.library.clone();
        let unusable = |why| Error::library(format!("library {}: {why}", path.display()));
        let limit = self.trust().isolate;
        let is_apart = cfg!(unix) && (!foreign.in_process || limit.is_some());
        // What describes a UDSM is code of its own.
        #[cfg(unix)]
        if is_apart && foreign.adapter == Adapter::Udsm {
            let workers = Workers::of(&path, &image.sha256, Some(foreign), limit);
            return Ok((workers.laws(true).map_err(unusable)?, None));
        }
        let opened = foreign::open(foreign, image).map_err(|fault| match fault {
            Fault::Library(why) => unusable(why),
            Fault::Other(error) => error,
        })?;
        let (externals, scratch) = opened.wishes;
        foreign.externals = foreign.externals.or(externals);
        foreign.scratch = foreign.scratch.or(scratch);
        let mut laws = opened.laws;
        #[cfg(unix)]
        if is_apart {
            let workers = Workers::of(&path, &image.sha256, Some(foreign), limit);
            for (number, (law, source)) in laws.iter_mut().enumerate() {
                *source = workers.law(number, &law.id, source.is_serial());
            }
        }
        Ok((laws, opened.sidecar))
    }

    /// As a file names it, and with what was asked for next to it.
    fn completed(&self, foreign: &Foreign) -> Foreign {
        let mut foreign = foreign.clone();
        if foreign.adapter == Adapter::Umat && foreign.record.is_none() {
            foreign.record.clone_from(&self.record);
            // A replay calls anew, in other workers, after the call that is meant.
            foreign.records_once = true;
        }
        foreign
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn umat(record: Option<&str>) -> Foreign {
        Foreign {
            record: record.map(PathBuf::from),
            ..Foreign::umat(Path::new("law.so"))
        }
    }

    #[test]
    fn only_the_opener_that_records_does() {
        let place = |opener: &Opener, foreign: &Foreign| opener.completed(foreign).record;
        let [first, second] = ["first.toml", "second.toml"].map(|file| {
            let opener = Opener::default().recording_to(PathBuf::from(file));
            std::thread::spawn(move || place(&opener, &umat(None)))
        });
        let silent = std::thread::spawn(move || place(&Opener::default(), &umat(None)));
        assert_eq!(first.join().unwrap(), Some("first.toml".into()));
        assert_eq!(second.join().unwrap(), Some("second.toml".into()));
        assert_eq!(silent.join().unwrap(), None);
        // A file's own key comes first; only UMATs are recorded.
        let opener = Opener::default().recording_to(PathBuf::from("asked.toml"));
        let own = umat(Some("own.toml"));
        assert_eq!(place(&opener, &own), Some("own.toml".into()));
        let mfront = Foreign {
            adapter: Adapter::Mfront,
            ..umat(None)
        };
        assert_eq!(place(&opener, &mfront), None);
    }
}
