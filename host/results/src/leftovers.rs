//! What an earlier run left in a results folder, and what must not be mistaken for results of the
//! next one.

use crate::log_file::LogFile;
use crate::summary::{self, Summary};
use std::ffi::OsStr;
use std::path::Path;
use text::Error;

/// Files that every run writes, or may write, under the same name. `history.csv` and `log.jsonl`
/// are begun again by each.
const NAMES: [&str; 12] = [
    law::capsule::FILE_NAME,
    crate::checkpoint::FILE_NAME,
    "path.csv",
    "profile.csv",
    "pile.csv",
    "cycles.csv",
    "points.csv",
    "fields.pvd",
    "report.html",
    "report.html.part",
    summary::FILE_NAME,
    "summary.json.part",
];

/// Removes what an earlier run wrote: files with the names a run gives, and the pictures that its
/// `summary.json` lists. Everything else in the folder stays.
///
/// # Errors
/// [`Error::Unwritable`].
pub(crate) fn remove(folder: &Path) -> Result<(), Error> {
    let pictures = pictures(folder);
    let ours = |name: &str| {
        NAMES.contains(&name) || is_field(name) || pictures.iter().any(|picture| picture == name)
    };
    remove_if(folder, ours)
}

/// Removes what an earlier run left in a folder, for work that comes before the next one begins there: if
/// that fails, nothing is there as its result.
///
/// # Errors
/// [`Error::Unwritable`]; another run writes there.
pub fn make_way(folder: &Path) -> Result<(), Error> {
    std::fs::create_dir_all(folder).map_err(|error| Error::unwritable(folder, error))?;
    let _log = LogFile::begin(folder)?;
    remove(folder)?;
    remove_if(folder, |name| name == "history.csv")
}

/// Removes from the common folder of a case's variants what an earlier run of them wrote there:
/// figures over all of them, and their comparison.
///
/// # Errors
/// [`Error::Unwritable`].
pub fn remove_comparison(folder: &Path, figures: &[&str]) -> Result<(), Error> {
    if !folder.is_dir() {
        return Ok(());
    }
    remove_if(folder, |name| {
        let figure = name.strip_suffix(".svg");
        name == "report.html" || figure.is_some_and(|stem| figures.contains(&stem))
    })
}

/// Removes files of these names where there are any.
fn remove_if(folder: &Path, ours: impl Fn(&str) -> bool) -> Result<(), Error> {
    let unreadable = |error| Error::unwritable(folder, error);
    for entry in std::fs::read_dir(folder).map_err(unreadable)? {
        let entry = entry.map_err(unreadable)?;
        let is_folder = entry.file_type().map_err(unreadable)?.is_dir();
        if !is_folder && entry.file_name().to_str().is_some_and(&ours) {
            let path = entry.path();
            std::fs::remove_file(&path).map_err(|error| Error::unwritable(&path, error))?;
        }
    }
    Ok(())
}

/// `fields_<n>.vtu`.
fn is_field(name: &str) -> bool {
    let number = name
        .strip_prefix("fields_")
        .and_then(|rest| rest.strip_suffix(".vtu"));
    number.is_some_and(|n| n.len() >= 5 && n.bytes().all(|digit| digit.is_ascii_digit()))
}

/// Pictures of the earlier run, from its summary; none if that cannot be read.
fn pictures(folder: &Path) -> Vec<String> {
    let summary = std::fs::read(folder.join(summary::FILE_NAME)).unwrap_or_default();
    let summary: Summary = serde_json::from_slice(&summary).unwrap_or_default();
    let mut names = summary.head.pictures;
    names.retain(|name| Path::new(name).extension() == Some(OsStr::new("svg")));
    names
}
