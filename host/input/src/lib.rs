//! Files that pose something to compute, and back: a case becomes a problem, a driver a path of one law,
//! and what is wrong with either is reported at its place in the file.

pub mod accuracy_settings;
pub mod build;
pub mod calibration;
pub mod case;
pub mod driver;
mod error;
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
pub mod schema;
pub mod study;

pub use case::Case;
pub use driver::Driver;
pub use error::{Error, Kind};
pub use study::Study;

use std::path::Path;
use text::{Source, base};

/// Whether a file is a driver, which has a path of segments; else it is taken for a case.
///
/// # Errors
/// It cannot be read.
pub fn is_driver(path: &Path) -> Result<bool, Error> {
    let (_, files) = base::read::<toml::Table>(Source::read(path)?)?;
    let mut tables = files.iter().map(|(_, table)| table);
    Ok(tables.any(|table| table.contains_key("hypothesis") || table.contains_key("segment")))
}
