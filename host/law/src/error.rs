//! What can go wrong with libraries and laws.

use crate::Stopped;
use text::{InputError, add_hint};
use thiserror::Error;

/// A library cannot be used, or a file about it is wrong.
#[derive(Debug, Error)]
pub enum Error {
    /// A file.
    #[error(transparent)]
    Text(#[from] text::Error),
    /// A library cannot be used, or broke the contract.
    #[error("{message}")]
    Library {
        /// Library, law and reason.
        message: String,
        /// What the user could do.
        hint: Option<String>,
    },
    /// The user stopped the work in the middle.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}

impl From<InputError> for Error {
    fn from(error: InputError) -> Self {
        text::Error::from(error).into()
    }
}

impl Error {
    /// A library that cannot be used, without a hint.
    pub fn library(message: impl Into<String>) -> Self {
        Self::Library {
            message: message.into(),
            hint: None,
        }
    }

    /// A defect of the program.
    pub fn internal(message: impl Into<String>) -> Self {
        text::Error::Internal(message.into()).into()
    }

    /// A hint for the user, if one is known.
    pub fn help(&self) -> Option<&str> {
        match self {
            Self::Text(error) => error.help(),
            Self::Library { hint, .. } => hint.as_deref(),
            Self::Stopped(_) => None,
        }
    }

    /// Adds what the user could do.
    #[must_use]
    pub fn with_hint(self, more: &str) -> Self {
        match self {
            Self::Library { message, mut hint } => {
                add_hint(&mut hint, more);
                Self::Library { message, hint }
            }
            Self::Text(error) => error.with_hint(more).into(),
            Self::Stopped(stopped) => stopped.into(),
        }
    }
}
