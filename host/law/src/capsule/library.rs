//! Crashes of a library outside calls of its laws: loading, handshake, entry,
//! description, `destroy` of null, the end of the process.

use super::{Made, OutcomePart, place, text};
use crate::Error;
use crate::adapter::{Adapter, Externals, Foreign, Order};
use crate::library::probe::call_log::{KeptPhase, Phase};
use indexmap::IndexMap;
use serde::Deserialize;
use std::path::{Path, PathBuf};
use text::{Source, toml_error};

/// A phase of a library that failed, and where it comes from.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LibraryCapsule {
    version: u32,
    /// Which library, and what of it.
    pub library: LibraryPart,
    /// Its origin, by key.
    #[serde(rename = "where", default)]
    pub origin: IndexMap<String, toml::Value>,
    /// What became of it.
    pub outcome: OutcomePart,
}

/// The library of a capsule.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LibraryPart {
    /// Its file.
    pub path: PathBuf,
    /// SHA-256 of that.
    pub sha256: String,
    /// The action on it.
    pub phase: Phase,
    /// It is loaded from its file and not from the bytes that were hashed.
    #[serde(default)]
    pub from_file: bool,
    /// The law whose function is called.
    pub law: Option<String>,
    /// The program that the library is made for, if not for the contract.
    pub adapter: Option<Adapter>,
    /// What describes it.
    pub sidecar: Option<PathBuf>,
    /// What becomes of routines that nobody supplies.
    pub externals: Option<Externals>,
    /// How the routine leaves its stiffness.
    pub tangent_order: Option<Order>,
}

impl LibraryPart {
    fn made(&self) -> Made {
        Made {
            adapter: self.adapter,
            sidecar: self.sidecar.clone(),
            externals: self.externals,
            tangent_order: self.tangent_order,
        }
    }

    /// The library as a file would name it, called in this process, if it keeps no contract.
    pub fn foreign(&self) -> Option<Foreign> {
        self.made().foreign(&self.path)
    }
}

impl LibraryCapsule {
    /// The capsule of a phase of this library, with an outcome to be filled in.
    pub fn new(path: &Path, sha256: String, kept: KeptPhase, foreign: Option<&Foreign>) -> Self {
        let made = Made::of(foreign);
        Self {
            version: 1,
            library: LibraryPart {
                path: path.to_owned(),
                sha256,
                phase: kept.phase,
                from_file: kept.from_file,
                law: kept.law,
                adapter: made.adapter,
                sidecar: made.sidecar,
                externals: made.externals,
                tangent_order: made.tangent_order,
            },
            origin: IndexMap::new(),
            outcome: OutcomePart {
                status: String::new(),
                message: String::new(),
                step_factor: None,
            },
        }
    }

    /// Takes the text of a capsule; `None` if it is one of a call.
    ///
    /// # Errors
    /// At the place that does not fit.
    #[inline]
    pub fn of_source(source: &Source) -> Result<Option<Self>, Error> {
        // A capsule of a call may have many points, and is not read twice.
        let mut lines = source.text().lines();
        if !lines.any(|line| line.trim() == "[library]") {
            return Ok(None);
        }
        let capsule: Self =
            toml::from_str(source.text()).map_err(|why| toml_error(source, &why))?;
        if capsule.version != 1 {
            let message = format!("this is a capsule of version {}", capsule.version);
            let at = place(source.text(), &["version"]);
            return Err(source.error(at, message).into());
        }
        if capsule.library.phase == Phase::DestroyNull && capsule.library.law.is_none() {
            let message = "`destroy` is a law's: `law` is missing";
            let at = place(source.text(), &["library", "phase"]);
            return Err(source.error(at, message).into());
        }
        Ok(Some(capsule))
    }
}

impl std::fmt::Display for LibraryCapsule {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let library = &self.library;
        writeln!(
            f,
            "# A library that failed where no law is called. `pilum replay` does the same once more.\n\
             version = {}\n\n[library]\npath = {}\nsha256 = {}\nphase = {}",
            self.version,
            text(&library.path.to_string_lossy()),
            text(&library.sha256),
            text(library.phase.name())
        )?;
        if library.from_file {
            writeln!(f, "from_file = true")?;
        }
        if let Some(law) = &library.law {
            writeln!(f, "law = {}", text(law))?;
        }
        write!(f, "{}", library.made())?;
        writeln!(f, "\n[where]")?;
        for (key, value) in &self.origin {
            writeln!(f, "{key} = {value}")?;
        }
        let outcome = &self.outcome;
        writeln!(
            f,
            "\n[outcome]\nstatus = {}\nmessage = {}",
            text(&outcome.status),
            text(&outcome.message)
        )
    }
}
