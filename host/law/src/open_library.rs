//! Opened libraries and the laws in them.

use crate::adapter::{Foreign, ForeignLaw};
use crate::current_call::{self, Doing};
#[cfg(unix)]
use crate::isolate;
use crate::law::LawInstance;
use crate::library::{CallFailure, LawHandle, probe};
use crate::opener::Stamp;
use crate::shear_zone::{ShearZone, ZoneInstance};
use crate::{Law, LawDescription, Moment, process_state, search};
use abi::Hypothesis;
use abi::raw;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

/// An opened library. It is never unloaded.
#[derive(Debug)]
pub struct Library {
    pub(crate) path: PathBuf,
    pub(crate) sha256: String,
    pub(crate) warnings: Vec<String>,
    pub(crate) stamp: Option<Stamp>,
    pub(crate) laws: Vec<(LawDescription, Origin)>,
    pub(crate) foreign: Option<Foreign>,
    /// SHA-256 of the file that describes it, where it does not do so itself.
    pub(crate) sidecar: Option<String>,
    /// How long one call of a worker may take, if its opener has said so.
    pub(crate) call_limit: Option<Duration>,
}

/// The process in which a law is called.
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
    /// Place of the law of solids that fills this zone.
    Zone(ShearZone, Box<LoadedLaw>),
}

impl Library {
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
        let mut own = search::of_program().into_iter();
        own.any(|own| own.folder.canonicalize().is_ok_and(|own| own == folder))
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

    /// Calls `create` as a check does. For a law behind an adapter, its replacement.
    ///
    /// # Errors
    /// There is no memory, or the law is in a worker process.
    pub fn probe(&self, form: &probe::CreateForm<'_>) -> std::io::Result<probe::Created> {
        let id = &self.description().id;
        match &self.library.laws[self.number].1 {
            Origin::Foreign(law) => probe::create_foreign(id, &**law, form),
            _ => probe::create(id, self.here()?, form),
        }
    }

    /// Calls `destroy` with null.
    pub fn destroy_nothing(&self) {
        if let Ok(law) = self.here() {
            probe::destroy_nothing(&self.description().id, law);
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
        let description = self.description();
        let defect = |reason: &str| CreateFailure {
            parameter: None,
            reason: reason.to_owned(),
            library_at_fault: true,
        };
        let formulation = description
            .formulation(hypothesis)
            .ok_or_else(|| defect("the hypothesis is not offered"))?
            .clone();
        let name = current_call::name(&format!(
            "law `{}` of library {}",
            description.id,
            self.library.path.display()
        ));
        current_call::remember_process();
        let create = || self.instance(hypothesis, parameters);
        let created = current_call::calling(name, Doing::Create, 0, Moment::default(), create);
        let changes = process_state::restore().map_err(|why| defect(&why))?;
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

    /// What the library makes of the parameters, in this process or in workers.
    ///
    /// # Errors
    /// The law's status and message.
    pub(crate) fn instance(
        &self,
        hypothesis: Hypothesis,
        parameters: &[f64],
    ) -> Result<LawInstance, CallFailure> {
        let (description, origin) = &self.library.laws[self.number];
        let Some(formulation) = description.formulation(hypothesis) else {
            let message = "the hypothesis is not offered".to_owned();
            return Err((raw::PILUM_E_INTERNAL, message));
        };
        let index = formulation.index;
        match origin {
            Origin::Here(handle) => handle.create(index, parameters).map(LawInstance::Here),
            Origin::Foreign(law) => law.create(hypothesis, parameters).map(LawInstance::Foreign),
            #[cfg(unix)]
            Origin::Apart { is_serial } => {
                let law = (self.number, index);
                isolate::IsolatedInstance::create(&self.library, law, parameters, *is_serial)
                    .map(|apart| LawInstance::Apart(Box::new(apart)))
            }
            Origin::Zone(zone, law) => {
                ZoneInstance::create(*zone, law, parameters).map(LawInstance::Zone)
            }
        }
    }
}
