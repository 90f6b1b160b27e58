//! Libraries that a case was made with: `sha256` next to a law in the file, and a lock file next to
//! the case.
//!
//! A lock lists every law that the case uses. It is honoured wherever it stands: a case with
//! `case.lock` runs with those libraries or not at all.

use crate::case::Case;
use crate::driver::Driver;
use crate::material::LawTables;
use crate::{Error, file_in, is_driver};
use law::{LoadedLaw, Opener, Pins, SearchPath, lock_path};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use text::Spanned;

/// A law as it is written to a lock.
#[derive(Debug, Serialize)]
struct Entry<'a> {
    id: &'a str,
    version: &'a str,
    library: String,
    sha256: &'a str,
}

/// Writes the lock of a case (a file, or a folder with `case.toml`) or of a driver: all laws it uses
/// and their libraries. Returns its path.
///
/// # Errors
/// The file or a library cannot be used, or the lock cannot be written.
pub fn write(opener: &Opener, path: &Path) -> Result<PathBuf, Error> {
    let path = file_in(path, "case");
    let laws = if is_driver(&path)? {
        let drivers = Driver::read_unlocked(opener, &path)?;
        let laws = drivers
            .iter()
            .map(|driver| driver.point().law().loaded().clone());
        laws.collect()
    } else {
        laws_of_case(opener, &path)?
    };
    let mut entries = BTreeMap::new();
    for law in &laws {
        let library = law.library();
        let name = library.path().file_name().unwrap_or_default();
        let description = law.description();
        let entry = Entry {
            id: &description.id,
            version: &description.version,
            library: name.to_string_lossy().into_owned(),
            sha256: library.sha256(),
        };
        entries.insert(&description.id, entry);
    }
    let table = BTreeMap::from([("law", entries.into_values().collect::<Vec<_>>())]);
    let laws = toml::to_string(&table).map_err(|why| Error::internal(why.to_string()))?;
    let content = format!(
        "# Written by `pilum lock`: the libraries that {} runs with.\nversion = 1\n\n{laws}",
        path.file_name().unwrap_or_default().to_string_lossy(),
    );
    let lock = lock_path(&path);
    std::fs::write(&lock, content).map_err(|why| text::Error::unwritable(&lock, why))?;
    Ok(lock)
}

/// The laws that groups use, in any phase of any variant.
fn laws_of_case(opener: &Opener, path: &Path) -> Result<Vec<LoadedLaw>, Error> {
    let mut laws = Vec::new();
    for case in Case::load(path)? {
        let file = &case.file;
        let declared = file.laws.values().map(Spanned::get_ref);
        let pins = declared.map(|law| (&law.law, law.sha256.as_ref()));
        let search =
            SearchPath::of(opener, &case.law_folders()?).pinned(Pins::given(&case.source, pins)?);
        let groups = file
            .groups
            .values()
            .map(|group| group.get_ref().law.get_ref());
        let swaps = file.phases.iter().flat_map(|phase| phase.laws.values());
        for name in groups.chain(swaps.map(Spanned::get_ref)) {
            let entry = file.laws.iter().find(|(key, _)| key.get_ref() == name);
            if let Some((_, law)) = entry {
                let tables = LawTables {
                    source: &case.source,
                    tables: &file.laws,
                };
                laws.push(tables.loaded(&search, law.get_ref())?);
            }
        }
    }
    Ok(laws)
}
