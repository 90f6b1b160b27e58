//! Crashes of a library outside calls of its laws: loading, handshake, entry,
//! description, `destroy` of null, the end of the process.

use super::{OutcomePart, VERSION, place};
use crate::Error;
use crate::description::is_false;
use crate::foreign::Foreign;
use crate::library::probe::call_log::{KeptPhase, Phase};
use indexmap::IndexMap;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use text::Source;
use toml::de::DeTable;

/// A phase of a library that failed, and where it comes from.
#[derive(Clone, Debug, Serialize, Deserialize)]
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
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LibraryPart {
    /// Its file.
    pub path: PathBuf,
    /// SHA-256 of that.
    pub sha256: String,
    /// The action on it.
    pub phase: Phase,
    /// It is loaded from its file and not from the bytes that were hashed.
    #[serde(default, skip_serializing_if = "is_false")]
    pub from_file: bool,
    /// The law whose function is called.
    pub law: Option<String>,
    /// The library as a file would name it, if it keeps no contract.
    foreign: Option<Foreign>,
}

impl LibraryPart {
    /// The library as a file would name it, called in this process, if it keeps no contract.
    pub fn foreign(&self) -> Option<Foreign> {
        let foreign = self.foreign.as_ref();
        foreign.map(|foreign| foreign.of_capsule(&self.path))
    }
}

impl LibraryCapsule {
    /// The capsule of a phase of this library, with an outcome to be filled in.
    pub fn new(path: &Path, sha256: String, kept: KeptPhase, foreign: Option<&Foreign>) -> Self {
        Self {
            version: VERSION,
            library: LibraryPart {
                path: path.to_string_lossy().into_owned().into(),
                sha256,
                phase: kept.phase,
                from_file: kept.from_file,
                law: kept.law,
                foreign: foreign.map(|foreign| foreign.of_capsule(path)),
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
        let is_of_library =
            DeTable::parse(source.text()).is_ok_and(|root| root.get_ref().contains_key("library"));
        if !is_of_library {
            return Ok(None);
        }
        let capsule: Self = text::parse_any_numbers(source)?;
        if capsule.version != VERSION {
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
        let text = toml::to_string(self).map_err(|_| std::fmt::Error)?;
        write!(
            f,
            "# A library that failed where no law is called. `pilum replay` does the same once more.\n{text}"
        )
    }
}
