//! A folder for the files of child processes, removed at the end.

use crate::Error;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// The folder.
pub(crate) struct Scratch(PathBuf);

impl Scratch {
    /// A new one.
    ///
    /// # Errors
    /// [`text::Error::Unwritable`].
    pub(crate) fn new() -> Result<Self, Error> {
        let id = std::process::id();
        // What was killed may have left a folder behind, and the system gives the numbers of processes again.
        for number in 0..1000 {
            let path = std::env::temp_dir().join(format!("pilum-check-{id}-{number}"));
            match std::fs::create_dir(&path) {
                Ok(()) => return Ok(Self(path)),
                Err(why) if why.kind() == ErrorKind::AlreadyExists => {}
                Err(why) => return Err(text::Error::unwritable(&path, why).into()),
            }
        }
        let why = "a thousand folders of earlier checks are in the way";
        Err(text::Error::unwritable(&std::env::temp_dir(), std::io::Error::other(why)).into())
    }

    /// Its path.
    pub(crate) fn path(&self) -> &Path {
        &self.0
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        // A folder that stays behind in the system's place for such folders harms nobody.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}
