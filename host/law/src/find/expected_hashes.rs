//! Which libraries a file was meant for: `sha256` next to a law in the file, and a lock next to it.

use crate::Error;
use serde::Deserialize;
use std::path::{Path, PathBuf};
use text::{Source, Spanned};

/// Digits of a SHA-256.
const DIGITS: usize = 64;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct LockFile {
    version: Spanned<u32>,
    #[serde(default)]
    law: Vec<LockedLaw>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct LockedLaw {
    id: String,
    version: String,
    library: String,
    sha256: Spanned<String>,
}

/// A demand on the library of a law.
#[derive(Clone, Debug)]
struct Pin {
    law: String,
    sha256: String,
    /// Its place, and the remedy if it does not hold.
    place: String,
    hint: String,
}

/// What a file and its lock demand of the libraries.
#[derive(Clone, Debug, Default)]
pub struct Pins {
    demands: Vec<Pin>,
    lock: Option<PathBuf>,
    /// Laws in the lock.
    locked: Vec<String>,
}

impl Pins {
    /// Those of a file: of each law its id and its `sha256`, if it has one; and the lock next to the
    /// file.
    ///
    /// # Errors
    /// [`text::Error::Input`] for what is no SHA-256, or a lock that cannot be read.
    #[inline]
    pub fn of<'a>(
        source: &Source,
        laws: impl Iterator<Item = (&'a Spanned<String>, Option<&'a Spanned<String>>)>,
    ) -> Result<Self, Error> {
        let mut pins = Self::given(source, laws)?;
        let path = lock_path(source.path());
        // A link that leads nowhere is a lock that cannot be read, and not none.
        if path.symlink_metadata().is_ok() {
            pins.add_lock(&path)?;
        }
        Ok(pins)
    }

    /// As [`Pins::of`], without the lock.
    ///
    /// # Errors
    /// [`text::Error::Input`] for what is no SHA-256.
    pub fn given<'a>(
        source: &Source,
        laws: impl Iterator<Item = (&'a Spanned<String>, Option<&'a Spanned<String>>)>,
    ) -> Result<Self, Error> {
        let mut pins = Self::default();
        for (law, sha256) in laws {
            let Some(sha256) = sha256 else { continue };
            pins.demands.push(Pin {
                law: law.get_ref().clone(),
                sha256: digits(source, sha256)?,
                place: format!("`sha256` at {}", source.place(&sha256.span())),
                hint: "if the other library is the right one, write its SHA-256 there".to_owned(),
            });
        }
        Ok(pins)
    }

    #[inline]
    fn add_lock(&mut self, path: &Path) -> Result<(), Error> {
        self.take_lock(&Source::read(path)?)?;
        self.lock = Some(path.to_owned());
        Ok(())
    }

    /// Reads a lock alone: the number of laws in it.
    ///
    /// # Errors
    /// [`text::Error::Input`] at the place that does not fit.
    #[inline]
    pub fn of_lock(source: &Source) -> Result<usize, Error> {
        let mut pins = Self::default();
        pins.take_lock(source)?;
        Ok(pins.locked.len())
    }

    #[inline]
    fn take_lock(&mut self, source: &Source) -> Result<(), Error> {
        let lock: LockFile = text::parse(source)?;
        if *lock.version.get_ref() != 1 {
            let message = format!("this is a lock of version {}", lock.version.get_ref());
            return Err(source
                .error(lock.version.span(), message)
                .hint("this program writes and reads version 1")
                .into());
        }
        for law in lock.law {
            self.demands.push(Pin {
                sha256: digits(source, &law.sha256)?,
                place: format!(
                    "`sha256` at {}, for {} {} of {}",
                    source.place(&law.sha256.span()),
                    law.id,
                    law.version,
                    law.library
                ),
                hint: "if the other library is the right one, `pilum lock` writes the lock anew; \
                       without the file any library will do"
                    .to_owned(),
                law: law.id.clone(),
            });
            self.locked.push(law.id);
        }
        Ok(())
    }

    /// Whether the library with this SHA-256 may provide the law.
    ///
    /// # Errors
    /// [`Error::Library`] with what was expected, where that is written, and what was found.
    pub fn check(&self, law: &str, library: &Path, sha256: &str) -> Result<(), Error> {
        let wrong = |pin: &&Pin| pin.law == law && pin.sha256 != sha256;
        if let Some(pin) = self.demands.iter().find(wrong) {
            return Err(Error::Library {
                message: format!(
                    "law `{law}`: library {} is not the one asked for\n  found SHA-256 {sha256}\n  \
                     expected {}\n  by {}",
                    library.display(),
                    pin.sha256,
                    pin.place
                ),
                hint: Some(pin.hint.clone()),
            });
        }
        match &self.lock {
            Some(lock) if !self.locked.iter().any(|id| id == law) => Err(Error::Library {
                message: format!("law `{law}` is not in {}", lock.display()),
                hint: Some("`pilum lock` writes the lock anew".to_owned()),
            }),
            _ => Ok(()),
        }
    }
}

/// A SHA-256 in lower case.
fn digits(source: &Source, written: &Spanned<String>) -> Result<String, Error> {
    let text = written.get_ref().to_ascii_lowercase();
    if text.len() == DIGITS && text.bytes().all(|byte| byte.is_ascii_hexdigit()) {
        return Ok(text);
    }
    let message = format!("`sha256`: expected {DIGITS} hexadecimal digits");
    Err(source
        .error(written.span(), message)
        .hint("`pilum inspect LIBRARY` and `pilum laws ID` show it")
        .into())
}

/// `case.toml` to `case.lock`.
pub fn lock_path(file: &Path) -> PathBuf {
    file.with_extension("lock")
}
