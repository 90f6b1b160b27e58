//! Opened libraries and the laws in them.

use crate::adapter::{self, Foreign, ForeignLaw};
use crate::calls::{self, Doing};
use crate::image::Image;
#[cfg(unix)]
use crate::isolate;
use crate::law::LawInstance;
use crate::library::{self, LawHandle, probe};
use crate::{Error, Law, LawDescription, Moment, Trust, custody, search, vetting};
use abi::Hypothesis;
use abi::raw;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::SystemTime;

/// An opened library. It is never unloaded.
#[derive(Debug)]
pub struct Library {
    pub(crate) path: PathBuf,
    sha256: String,
    warnings: Vec<String>,
    stamp: Option<Stamp>,
    pub(crate) laws: Vec<(LawDescription, Origin)>,
    foreign: Option<Foreign>,
    /// SHA-256 of the file that describes it, where it does not do so itself.
    sidecar: Option<String>,
}

/// Where a law is called.
#[derive(Clone, Debug)]
pub(crate) enum Origin {
    /// In this process.
    Here(LawHandle),
    /// In this process, by an adapter.
    Foreign(Arc<dyn ForeignLaw>),
    /// In worker processes.
    #[cfg(unix)]
    Apart {
        /// Calls of one material must follow one another.
        is_serial: bool,
    },
}

/// What changes with a file's contents. Within one process a file with an equal stamp is not
/// hashed again.
type Stamp = (u64, SystemTime);

fn stamp(path: &Path) -> Option<Stamp> {
    let metadata = path.metadata().ok()?;
    Some((metadata.len(), metadata.modified().ok()?))
}

/// Libraries opened by this process so far. Equal bytes are opened once, wherever they lie.
static OPENED: Mutex<Vec<Arc<Library>>> = Mutex::new(Vec::new());

impl Library {
    /// Opens a library: permissions, hash, handshake, description, in this order.
    ///
    /// # Errors
    /// [`Error::Library`] with the path and what is wrong.
    pub fn open(path: &Path) -> Result<Arc<Self>, Error> {
        Self::open_if(path, |_| Ok(()))
    }

    /// Opens a library whose SHA-256 is approved; nothing of it runs before.
    ///
    /// # Errors
    /// As [`Library::open`], and those of `approve`.
    pub fn open_if(
        path: &Path,
        approve: impl Fn(&str) -> Result<(), Error>,
    ) -> Result<Arc<Self>, Error> {
        let mut opened = OPENED.lock().unwrap_or_else(PoisonError::into_inner);
        let stamp = stamp(path);
        let known = |library: &&Arc<Self>| library.path == path && library.stamp == stamp;
        if let Some(library) = opened.iter().find(known).filter(|_| stamp.is_some()) {
            approve(&library.sha256)?;
            return Ok(Arc::clone(library));
        }
        let fault = |why| Error::library(format!("library {} {why}", path.display()));
        let mut image = Image::read(path).map_err(fault)?;
        approve(&image.sha256)?;
        let sha256 = image.sha256.clone();
        let warnings = std::mem::take(&mut image.warnings);
        let same = opened.iter().find(|library| library.sha256 == sha256);
        let laws = if let Some(library) = same {
            library.laws.clone()
        } else {
            Self::laws_of(path, image)?
        };
        let library = Arc::new(Self {
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
    fn laws_of(path: &Path, image: Image) -> Result<Vec<(LawDescription, Origin)>, Error> {
        let unusable = |why| Error::library(format!("library {}: {why}", path.display()));
        let trust = Trust::current();
        #[cfg(unix)]
        if trust.isolate.is_some() {
            return isolate::describe(path, &image.sha256).map_err(unusable);
        }
        if trust.probe {
            vetting::vet(path, &image.sha256)?;
        }
        let laws = library::open(path, image).map_err(unusable)?.laws;
        let here = |(law, handle)| (law, Origin::Here(handle));
        Ok(laws.into_iter().map(here).collect())
    }

    /// Opens a library that is made for another program, if its SHA-256 is approved. Its code runs
    /// in worker processes unless it is said to run in this one.
    ///
    /// # Errors
    /// [`Error::Library`] with the path and what is wrong, and those of `approve`.
    pub fn open_foreign(
        foreign: &Foreign,
        approve: impl Fn(&str) -> Result<(), Error>,
    ) -> Result<Arc<Self>, Error> {
        let path = &foreign.library;
        let fault = |why: String| Error::library(format!("library {} {why}", path.display()));
        let mut image = Image::read(path).map_err(fault)?;
        approve(&image.sha256)?;
        if cfg!(not(unix)) && !foreign.in_process {
            return Err(fault(
                "can only run in this process here: `in_process = true`".to_owned(),
            ));
        }
        let foreign = &foreign.completed();
        let opened = adapter::open(foreign, &image)?;
        let (externals, scratch) = opened.wishes;
        let foreign = Foreign {
            externals: foreign.externals.or(externals),
            scratch: foreign.scratch.or(scratch),
            ..foreign.clone()
        };
        #[cfg(unix)]
        let apart = !foreign.in_process || Trust::current().isolate.is_some();
        let origin = |law: Arc<dyn ForeignLaw>| {
            #[cfg(unix)]
            if apart {
                let is_serial = law.is_serial();
                return Origin::Apart { is_serial };
            }
            Origin::Foreign(law)
        };
        Ok(Arc::new(Self {
            path: path.clone(),
            warnings: std::mem::take(&mut image.warnings),
            sha256: image.sha256.clone(),
            stamp: None,
            laws: opened
                .laws
                .into_iter()
                .map(|(description, law)| (description, origin(law)))
                .collect(),
            sidecar: opened.sidecar,
            foreign: Some(foreign),
        }))
    }

    /// How it is named, if it is made for another program.
    pub fn foreign(&self) -> Option<&Foreign> {
        self.foreign.as_ref()
    }

    /// SHA-256 of the file that describes it, if there is one.
    pub fn sidecar_sha256(&self) -> Option<&str> {
        self.sidecar.as_deref()
    }

    /// Where the library was found.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Whether it lies where the program's own laws do.
    pub fn is_beside_program(&self) -> bool {
        let folder = self.path.parent().map(Path::canonicalize);
        let Some(Ok(folder)) = folder else {
            return false;
        };
        let mut own = search::beside_program().into_iter();
        own.any(|own| own.canonicalize().is_ok_and(|own| own == folder))
    }

    /// SHA-256 of the file, in hexadecimal digits.
    pub fn sha256(&self) -> &str {
        &self.sha256
    }

    /// What the user should know about the file.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// Descriptions of its laws.
    pub fn laws(&self) -> impl Iterator<Item = &LawDescription> {
        self.laws.iter().map(|(description, _)| description)
    }

    /// The law with this id.
    pub fn law(self: &Arc<Self>, id: &str) -> Option<LoadedLaw> {
        let number = self
            .laws
            .iter()
            .position(|(description, _)| description.id == id)?;
        Some(LoadedLaw {
            library: Arc::clone(self),
            number,
        })
    }
}

/// A law of an opened library, without parameters yet.
#[derive(Clone, Debug)]
pub struct LoadedLaw {
    pub(crate) library: Arc<Library>,
    pub(crate) number: usize,
}

/// Why a law cannot be built.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CreateFailure {
    /// The parameter to change, if the law names one.
    pub parameter: Option<String>,
    /// Why.
    pub reason: String,
    /// The fault is the library's, not the parameter's.
    pub library_at_fault: bool,
}

impl LoadedLaw {
    /// Its description.
    pub fn description(&self) -> &LawDescription {
        &self.library.laws[self.number].0
    }

    /// Its library.
    pub fn library(&self) -> &Library {
        &self.library
    }

    /// Calls `create` as a check does.
    ///
    /// # Errors
    /// There is no memory, or the law is in a worker process.
    pub fn probe(&self, form: &probe::CreateForm<'_>) -> std::io::Result<probe::Created> {
        probe::create(self.here()?, form)
    }

    /// Calls `destroy` with null.
    pub fn destroy_nothing(&self) {
        if let Ok(law) = self.here() {
            probe::destroy_nothing(law);
        }
    }

    /// The law in this process.
    fn here(&self) -> std::io::Result<LawHandle> {
        match self.library.laws[self.number].1 {
            Origin::Here(law) => Ok(law),
            _ => Err(std::io::Error::other("the law is not one of this process")),
        }
    }

    /// Fixes the parameters (in declared order; NaN: left out) under a hypothesis.
    ///
    /// # Errors
    /// The law's refusal, or a defect of the library.
    pub fn build(&self, hypothesis: Hypothesis, parameters: &[f64]) -> Result<Law, CreateFailure> {
        let (description, origin) = &self.library.laws[self.number];
        let defect = |reason: &str| CreateFailure {
            parameter: None,
            reason: reason.to_owned(),
            library_at_fault: true,
        };
        let formulation = description
            .formulation(hypothesis)
            .ok_or_else(|| defect("the hypothesis is not offered"))?
            .clone();
        let index = formulation.index;
        let name = calls::name(&format!(
            "law `{}` of library {}",
            description.id,
            self.library.path.display()
        ));
        calls::remember_process();
        let create = || match origin {
            Origin::Here(handle) => handle.create(index, parameters).map(LawInstance::Here),
            Origin::Foreign(law) => law.create(hypothesis, parameters).map(LawInstance::Foreign),
            #[cfg(unix)]
            Origin::Apart { is_serial } => {
                let library = &self.library;
                let law = (self.number, index);
                isolate::IsolatedInstance::create(library, law, parameters, *is_serial)
                    .map(|apart| LawInstance::Apart(Box::new(apart)))
            }
        };
        let created = calls::calling(name, Doing::Create, 0, Moment::default(), create);
        let changes = custody::restore().map_err(|why| defect(&why))?;
        let instance = created.map_err(|(status, message)| {
            let parameter = message
                .split_once(':')
                .map(|(id, _)| id.trim())
                .filter(|id| description.parameters.iter().any(|p| p.id == *id))
                .map(str::to_owned);
            CreateFailure {
                parameter,
                reason: message,
                library_at_fault: status != raw::PILUM_E_PARAMETER && status != raw::PILUM_E_DOMAIN,
            }
        })?;
        Ok(Law {
            loaded: self.clone(),
            hypothesis,
            formulation,
            parameters: parameters.to_vec(),
            instance,
            name,
            changes,
        })
    }
}
