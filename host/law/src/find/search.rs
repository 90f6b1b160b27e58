//! Folders in which libraries are searched. Only explicit folders count, never the working directory.

use super::expected_hashes::Pins;
use super::inspect;
use super::opened::{Library, LoadedLaw};
use super::opener::Opener;
use crate::Error;
use crate::foreign::Foreign;
use crate::process::child;
use std::collections::BTreeMap;
use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use text::file;
use text::suggestion;

/// A folder to look in, and why.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// The folder; it need not exist.
    pub folder: PathBuf,
    /// Why it is looked in.
    pub origin: Origin,
}

/// Why a folder is looked in, in the order in which they are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    /// The input file or the command line names it.
    Given,
    /// `PILUM_LAW_PATH` names it.
    Variable,
    /// The program lies in it.
    Program,
    /// `../lib/pilum` of the program: laws that were installed with it.
    Installed,
    /// `deps` of the program: cargo's folder of parts.
    Parts,
}

impl Origin {
    /// Why the folder is looked in, in a few words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Given => "as asked",
            Self::Variable => "PILUM_LAW_PATH",
            Self::Program => "beside the program",
            Self::Installed => "installed with the program",
            Self::Parts => "built with the program",
        }
    }
}

/// Libraries of a folder, each with the ids of its laws.
pub type Libraries = Vec<(PathBuf, Vec<String>)>;

/// Folders to look in, in order, and the libraries opened so far. A library that changes on the way
/// stays what it was.
#[derive(Debug)]
pub struct SearchPath {
    places: Vec<Place>,
    pins: Pins,
    opener: Opener,
    opened: Mutex<BTreeMap<PathBuf, Arc<Library>>>,
}

/// The program's own folders, by where it is: a link to the program is followed.
fn of_program() -> Vec<Place> {
    let program = child::program().ok();
    let program = program.map(|program| program.canonicalize().unwrap_or(program));
    let Some(folder) = program.as_deref().and_then(Path::parent) else {
        return Vec::new();
    };
    // Without `..`, as users would write it.
    let installed = folder.parent().map(|above| above.join("lib/pilum"));
    [
        (Some(folder.to_owned()), Origin::Program),
        (installed, Origin::Installed),
        (Some(folder.join("deps")), Origin::Parts),
    ]
    .into_iter()
    .filter_map(|(folder, origin)| {
        Some(Place {
            folder: folder?,
            origin,
        })
    })
    .collect()
}

impl Library {
    /// Whether it lies where the program's own laws do.
    pub fn is_beside_program(&self) -> bool {
        let folder = self.path.parent().map(Path::canonicalize);
        let Some(Ok(folder)) = folder else {
            return false;
        };
        let mut own = of_program().into_iter();
        own.any(|own| own.folder.canonicalize().is_ok_and(|own| own == folder))
    }
}

impl SearchPath {
    /// First the given folders (from a case file), then those of `PILUM_LAW_PATH`, then the
    /// folder of the program, its `../lib/pilum` and its `deps`.
    pub fn new(from_case: &[PathBuf]) -> Self {
        Self::of(&Opener::default(), from_case)
    }

    /// As [`SearchPath::new`]; libraries are opened with this.
    pub fn of(opener: &Opener, from_case: &[PathBuf]) -> Self {
        let place = |origin| move |folder| Place { folder, origin };
        let given = from_case.iter().cloned();
        let mut places: Vec<Place> = given.map(place(Origin::Given)).collect();
        if let Some(list) = std::env::var_os("PILUM_LAW_PATH") {
            let named = std::env::split_paths(&list).filter(|p| !p.as_os_str().is_empty());
            places.extend(named.map(place(Origin::Variable)));
        }
        places.extend(of_program());
        Self {
            places,
            pins: Pins::default(),
            opener: opener.clone(),
            opened: Mutex::default(),
        }
    }

    /// Only libraries that these pins allow.
    #[must_use]
    pub fn pinned(self, pins: Pins) -> Self {
        Self { pins, ..self }
    }

    /// The folders, in order.
    pub fn places(&self) -> &[Place] {
        &self.places
    }

    /// Opens the library that holds a law: in the first folder that has one, the library named
    /// like the law, else the one whose manifest lists it. Libraries are opened once.
    ///
    /// # Errors
    /// [`Error::Library`] if absent, if two libraries of a folder claim the law, or if the
    /// library cannot be used.
    pub fn law(&self, id: &str) -> Result<LoadedLaw, Error> {
        for Place { folder, .. } in &self.places {
            let named = folder.join(format!("{DLL_PREFIX}{id}{DLL_SUFFIX}"));
            let path = if named.is_file() {
                named
            } else {
                let mut claims = manifests(folder)
                    .into_iter()
                    .filter(|(_, laws)| laws.iter().any(|law| law == id));
                match (claims.next(), claims.next()) {
                    (None, _) => continue,
                    (Some((path, _)), None) => path,
                    (Some((first, _)), Some((second, _))) => {
                        return Err(Error::library(format!(
                            "law `{id}` is in two libraries: {} and {}",
                            first.display(),
                            second.display()
                        )));
                    }
                }
            };
            let library = self.open_for(&path, Some(id))?;
            return library
                .law(id)
                .ok_or_else(|| no_such_law(&library, &path, id));
        }
        let installed = self.installed();
        let ids: Vec<&str> = installed.keys().map(String::as_str).collect();
        let places = self.places.iter();
        let folders: Vec<String> = places.map(|p| p.folder.display().to_string()).collect();
        Err(Error::Library {
            message: format!("no library with law `{id}` in {}", folders.join(", ")),
            hint: Some(if ids.is_empty() {
                "no law library is there at all; an archive of Pilum has them in lib/pilum, in the \
                 repository `cargo build --release` builds them; `pilum laws --where` says where \
                 they are looked for"
                    .to_owned()
            } else {
                format!(
                    "{}; more folders: `law_path` in the file, or PILUM_LAW_PATH \
                     (`pilum laws --where`)",
                    suggestion(id, ids)
                )
            }),
        })
    }

    /// A law of a library that is made for another program.
    ///
    /// # Errors
    /// As [`Opener::open_foreign`]; [`Error::Library`] if it has no such law.
    pub fn foreign_law(&self, id: &str, foreign: &Foreign) -> Result<LoadedLaw, Error> {
        let approve = |sha256: &str| self.pins.check(id, &foreign.library, sha256);
        let library = self.opener.open_foreign(foreign, approve)?;
        library
            .law(id)
            .ok_or_else(|| no_such_law(&library, &foreign.library, id))
    }

    /// Opens a library, once.
    ///
    /// # Errors
    /// As [`Opener::open`].
    pub fn open(&self, path: &Path) -> Result<Arc<Library>, Error> {
        self.open_for(path, None)
    }

    fn open_for(&self, path: &Path, law: Option<&str>) -> Result<Arc<Library>, Error> {
        let approve = |sha256: &str| law.map_or(Ok(()), |id| self.pins.check(id, path, sha256));
        let mut opened = self.opened.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(library) = opened.get(path) {
            approve(library.sha256())?;
            return Ok(Arc::clone(library));
        }
        let library = self.opener.open_if(path, approve)?;
        opened.insert(path.to_owned(), Arc::clone(&library));
        Ok(library)
    }

    /// Ids of all laws found, with their libraries, read from manifests without running anything.
    pub fn installed(&self) -> BTreeMap<String, PathBuf> {
        let mut found = BTreeMap::new();
        for (_, libraries) in self.libraries() {
            for (path, laws) in libraries {
                for law in laws {
                    found.entry(law).or_insert_with(|| path.clone());
                }
            }
        }
        found
    }

    /// The folders with the libraries that each has, sorted by name, and the ids of their laws, read
    /// from manifests without running anything.
    pub fn libraries(&self) -> Vec<(&Place, Libraries)> {
        let mut has_built = false;
        let of = |place| {
            // Cargo's folder of parts holds the libraries of tests too. Who has built the program
            // has the others beside it.
            let &Place { ref folder, origin } = place;
            let is_left_out = origin == Origin::Parts && has_built;
            let libraries = if is_left_out {
                Vec::new()
            } else {
                manifests(folder)
            };
            has_built |= origin == Origin::Program && !libraries.is_empty();
            (place, libraries)
        };
        self.places.iter().map(of).collect()
    }
}

fn no_such_law(library: &Library, path: &Path, id: &str) -> Error {
    let ids: Vec<&str> = library.laws().map(|law| law.id.as_str()).collect();
    Error::Library {
        message: format!("library {} has no law `{id}`", path.display()),
        hint: Some(suggestion(id, ids)),
    }
}

/// Libraries of a folder that carry a manifest, sorted by name, with the ids of their laws.
fn manifests(folder: &Path) -> Libraries {
    let Ok(entries) = std::fs::read_dir(folder) else {
        return Vec::new();
    };
    let mut paths: Vec<PathBuf> = entries
        .filter_map(|entry| entry.ok().map(|entry| entry.path()))
        .filter(|path| path.to_string_lossy().ends_with(DLL_SUFFIX))
        .collect();
    paths.sort();
    paths
        .into_iter()
        .filter_map(|path| manifest(&path).map(|laws| (path, laws)))
        .collect()
}

/// Ids in the manifest section of a library. Only the parts of the file that are needed are read.
fn manifest(path: &Path) -> Option<Vec<String>> {
    let file = file::open_regular(path).ok()?;
    let length = file.metadata().ok()?.len();
    if length > file::LARGEST_LIBRARY {
        return None;
    }
    let cache = object::ReadCache::new(file);
    let file = object::File::parse(&cache).ok()?;
    let laws = inspect::manifest(&file)?;
    Some(laws.into_iter().map(|law| law.id).collect())
}
