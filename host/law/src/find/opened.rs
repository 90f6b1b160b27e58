//! Opened libraries and the laws in them.

use crate::description::LawDescription;
use crate::foreign::Foreign;
use crate::instance::Source;
use crate::library::{LawHandle, probe};
use crate::shear_zone::ShearZone;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::SystemTime;

/// What changes with a file's contents. A file with an equal stamp is not hashed again.
pub(crate) type Stamp = (u64, SystemTime);

/// An opened library. It is never unloaded.
#[derive(Clone, Debug)]
pub struct Library {
    pub(crate) path: PathBuf,
    pub(crate) sha256: String,
    pub(crate) warnings: Vec<String>,
    pub(crate) stamp: Option<Stamp>,
    pub(crate) laws: Vec<OpenedLaw>,
    pub(crate) foreign: Option<Foreign>,
    /// SHA-256 of the file that describes it, where it does not do so itself.
    pub(crate) sidecar: Option<String>,
}

/// A law of a library, and what builds it.
#[derive(Clone, Debug)]
pub(crate) struct OpenedLaw {
    pub(crate) description: LawDescription,
    pub(crate) source: Arc<dyn Source>,
    /// Its handle in the library, if the library follows the contract and is called in this process.
    pub(crate) handle: Option<LawHandle>,
    /// The zone that it fills, if it is the law of one.
    pub(crate) zone: Option<ShearZone>,
}

impl OpenedLaw {
    /// A law that keeps no contract, or is called elsewhere.
    pub(crate) fn new((description, source): (LawDescription, Arc<dyn Source>)) -> Self {
        Self {
            description,
            source,
            handle: None,
            zone: None,
        }
    }

    /// A law of the contract that is called in this process.
    pub(crate) fn here((description, handle): (LawDescription, LawHandle)) -> Self {
        Self {
            handle: Some(handle),
            ..Self::new((description, Arc::new(handle)))
        }
    }
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
        self.laws.iter().map(|law| &law.description)
    }

    /// The law with this id.
    pub fn law(self: &Arc<Self>, id: &str) -> Option<LoadedLaw> {
        let number = self.laws().position(|law| law.id == id)?;
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

impl LoadedLaw {
    /// What was opened.
    pub(crate) fn opened(&self) -> &OpenedLaw {
        &self.library.laws[self.number]
    }

    /// Its description.
    pub fn description(&self) -> &LawDescription {
        &self.opened().description
    }

    /// Its library.
    pub fn library(&self) -> &Library {
        &self.library
    }

    /// The zone that it fills, if it is the law of one.
    pub fn shear_zone(&self) -> Option<ShearZone> {
        self.opened().zone
    }

    /// The law of an interface that this law of solids makes in a zone. It has its id, parameters
    /// and internal variables, and the zone's stresses.
    ///
    /// # Errors
    /// The law is not for solids, or the zone does not fit; in words.
    pub fn in_shear_zone(&self, zone: ShearZone) -> Result<Self, String> {
        let law = self.opened();
        let law = OpenedLaw {
            zone: Some(zone),
            ..OpenedLaw::new(zone.filled_with(&law.description, &law.source)?)
        };
        Ok(Self {
            number: 0,
            library: Arc::new(Library {
                laws: vec![law],
                ..Library::clone(&self.library)
            }),
        })
    }

    /// Calls `create` as a check does. For a law behind an adapter, its replacement.
    ///
    /// # Errors
    /// There is no memory, or the law is in a worker process.
    pub fn probe(&self, form: &probe::CreateForm<'_>) -> io::Result<probe::Created> {
        let law = self.opened();
        let id = &law.description.id;
        if let Some(handle) = law.handle {
            return probe::create(id, handle, form);
        }
        let formulation = law.description.formulation(form.hypothesis);
        match formulation.filter(|_| law.source.is_called_here()) {
            Some(formulation) => probe::create_foreign(id, &*law.source, formulation, form),
            None => Err(io::Error::other("the law is not one of this process")),
        }
    }

    /// Calls `destroy` with null.
    pub fn destroy_nothing(&self) {
        if let Some(handle) = self.opened().handle {
            probe::destroy_nothing(&self.description().id, handle);
        }
    }
}
