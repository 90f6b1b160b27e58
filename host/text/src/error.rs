//! What can go wrong with files.

use crate::InputError;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// A file, or what somebody asked for, is wrong.
#[derive(Debug, Error)]
pub enum Error {
    /// An input file is wrong.
    #[error(transparent)]
    Input(#[from] Box<InputError>),
    /// An input file cannot be read.
    #[error("cannot read {}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// Results cannot be written.
    #[error("cannot write {}", path.display())]
    Unwritable {
        /// The file or folder.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The request does not fit the files.
    #[error("{0}")]
    Usage(String),
    /// A value that was asked for is out of bounds.
    #[error("`{name}` is {value}, outside [{}, {}]", bounds[0], bounds[1])]
    OutOfBounds {
        /// Whose value.
        name: String,
        /// The value.
        value: f64,
        /// The least and the greatest one.
        bounds: [f64; 2],
    },
    /// A defect of the program.
    #[error("internal error: {0}")]
    Internal(String),
}

impl From<InputError> for Error {
    fn from(error: InputError) -> Self {
        Self::Input(Box::new(error))
    }
}

impl Error {
    /// A file or folder cannot be written.
    pub fn unwritable(path: &Path, source: std::io::Error) -> Self {
        Self::Unwritable {
            path: path.to_owned(),
            source,
        }
    }

    /// A file cannot be read.
    pub fn unreadable(path: &Path, source: std::io::Error) -> Self {
        Self::Unreadable {
            path: path.to_owned(),
            source,
        }
    }

    /// A hint for the user, if one is known.
    pub fn help(&self) -> Option<&str> {
        match self {
            Self::Input(input) => input.help(),
            Self::Unwritable { .. } => {
                Some("name another place for the results on the command line")
            }
            Self::Unreadable { .. }
            | Self::Usage(_)
            | Self::OutOfBounds { .. }
            | Self::Internal(_) => None,
        }
    }

    /// The place in a file that it is about.
    pub fn place(&self) -> Option<&InputError> {
        match self {
            Self::Input(input) => Some(input),
            _ => None,
        }
    }

    /// Adds what the user could do, where a place in a file is marked.
    #[must_use]
    pub fn with_hint(mut self, more: &str) -> Self {
        if let Self::Input(input) = &mut self {
            add_hint(input.hint_mut(), more);
        }
        self
    }
}

/// Adds to what the user could do.
pub fn add_hint(hint: &mut Option<String>, more: &str) {
    *hint = Some(match hint.take() {
        Some(hint) => format!("{hint}; {more}"),
        None => more.to_owned(),
    });
}
