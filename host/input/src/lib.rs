//! Files that pose something to compute, and back: a case becomes a problem, a driver a path of one law,
//! and what is wrong with either is reported at its place in the file.

pub mod accuracy_settings;
pub mod build;
pub mod calibration;
pub mod case;
pub mod driver;
mod error;
mod expression;
pub mod figures;
pub mod gmsh;
mod grid;
pub mod ground;
pub mod incremental_driver;
mod ineffective_options;
pub mod lock;
pub mod material;
mod measured;
pub mod mesh;
pub mod pile;
pub mod probes;
mod refusal;
pub mod schema;
mod spanned;
pub mod study;

pub use case::Case;
pub use driver::Driver;
pub use error::{Error, Kind};
pub use study::Study;

use serde::de::IgnoredAny;
use std::path::{Path, PathBuf};
use text::{Source, base};

/// The file that a path leads to: itself, or in a folder the one of this kind.
pub fn file_in(path: &Path, kind: &str) -> PathBuf {
    if path.is_dir() {
        path.join(format!("{kind}.toml"))
    } else {
        path.to_owned()
    }
}

/// The name of a file of this kind: its folder if it is called after the kind, else its stem.
fn name_of(path: &Path, kind: &str) -> String {
    let absolute = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let is_only_one = absolute.file_name() == Some(format!("{kind}.toml").as_ref());
    let named = if is_only_one {
        absolute.parent().and_then(Path::file_name)
    } else {
        absolute.file_stem()
    };
    named
        .map_or(kind.into(), |name| name.to_string_lossy())
        .into_owned()
}

/// Whether a file is a driver, which has a path of segments; else it is taken for a case.
///
/// # Errors
/// It cannot be read.
pub fn is_driver(path: &Path) -> Result<bool, Error> {
    /// Keys that only driver files have.
    #[derive(serde::Deserialize)]
    struct OfDriver {
        hypothesis: Option<IgnoredAny>,
        segment: Option<IgnoredAny>,
    }
    let (_, files) = base::read::<OfDriver>(Source::read(path)?)?;
    let mut tables = files.iter().map(|(_, table)| table);
    Ok(tables.any(|table| table.hypothesis.is_some() || table.segment.is_some()))
}
