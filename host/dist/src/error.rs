//! What can go wrong.

use std::path::{Path, PathBuf};

/// Why there is no archive.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A file cannot be read or written.
    #[error("{}: {source}", path.display())]
    File {
        /// Which.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// Something that the archive has is not built.
    #[error("{} is missing: `cargo build --release` builds it", .0.display())]
    NotBuilt(PathBuf),
    /// A command fails.
    #[error("{command} fails: {why}")]
    Command {
        /// The command.
        command: String,
        /// What it says.
        why: String,
    },
    /// `cargo metadata` says something else than expected.
    #[error("`cargo metadata` gives no {0}")]
    Metadata(&'static str),
}

impl Error {
    /// For `map_err`, of a file.
    pub(crate) fn of(path: &Path) -> impl Fn(std::io::Error) -> Self {
        let path = path.to_owned();
        move |source| Self::File {
            path: path.clone(),
            source,
        }
    }
}
