//! Files that the program writes, in place of whatever has their names. Nothing is written through
//! a link: what it leads to belongs to somebody else.

use crate::Error;
use std::fs::{File, Metadata, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Refuses to write where something else than a file is: a pipe that nobody reads would keep the
/// program waiting for ever.
///
/// # Errors
/// [`Error::Unwritable`].
pub fn refuse_other(path: &Path) -> Result<(), Error> {
    if std::fs::metadata(path).is_ok_and(|found| !found.is_file()) {
        return Err(Error::unwritable(path, other()));
    }
    Ok(())
}

/// The message if the name belongs to something other than a file.
pub fn other() -> io::Error {
    io::Error::other("there is something else than a file of this name")
}

/// Writes a whole file of results in place of what has its name.
///
/// # Errors
/// [`Error::Unwritable`].
pub fn replace(path: &Path, content: impl AsRef<[u8]>) -> Result<(), Error> {
    begin(path)
        .and_then(|mut file| file.write_all(content.as_ref()))
        .map_err(|error| Error::unwritable(path, error))
}

/// The same, whole or not at all: whoever reads meanwhile, or is left with it after a kill, has the earlier
/// file or this one.
///
/// # Errors
/// [`Error::Unwritable`].
pub fn replace_whole(path: &Path, content: impl AsRef<[u8]>) -> Result<(), Error> {
    refuse_other(path)?;
    let mut partial = path.as_os_str().to_owned();
    partial.push(".part");
    let partial = PathBuf::from(partial);
    replace(&partial, content)
        .and_then(|()| {
            std::fs::rename(&partial, path).map_err(|error| Error::unwritable(path, error))
        })
        .inspect_err(|_| {
            let _ = std::fs::remove_file(&partial);
        })
}

/// Begins a file in place of what has its name, which other names of the same file keep.
///
/// # Errors
/// That of the system; anything but a file or a link has the name.
pub fn begin(path: &Path) -> io::Result<File> {
    match path.symlink_metadata() {
        Ok(found) if found.is_file() || found.is_symlink() => std::fs::remove_file(path)?,
        Ok(_) => return Err(other()),
        Err(error) if error.kind() == io::ErrorKind::NotFound => (),
        Err(error) => return Err(error),
    }
    let mut options = OpenOptions::new();
    options.read(true).write(true).create_new(true).open(path)
}

/// Whether two names lead to one file.
pub fn is_same(a: &Path, b: &Path) -> bool {
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        let place = |path: &Path| path.metadata().map(|found| (found.dev(), found.ino())).ok();
        place(a).is_some_and(|of_a| place(b) == Some(of_a))
    }
    #[cfg(not(unix))]
    {
        let same = a.canonicalize().ok().zip(b.canonicalize().ok());
        same.is_some_and(|(a, b)| a == b)
    }
}

/// The identity of a file, whatever its name: its device and its number there; `None` where that is not
/// known.
pub type Identity = Option<(u64, u64)>;

/// The identity of an open file.
pub fn identity(file: &File) -> Identity {
    file.metadata().ok().and_then(|found| identity_of(&found))
}

#[cfg_attr(
    unix,
    expect(clippy::unnecessary_wraps, reason = "not known on other systems")
)]
fn identity_of(found: &Metadata) -> Identity {
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        Some((found.dev(), found.ino()))
    }
    #[cfg(not(unix))]
    {
        let _ = found;
        None
    }
}

/// Refuses to write where something else than the file is by now: a law may have closed it, and
/// its number may be that of another one.
///
/// # Errors
/// It is not this file, or not of this length.
pub fn check_own(file: &File, own: Identity, length: u64) -> io::Result<()> {
    let is_own =
        |found: &Metadata| identity_of(found) == own && (!found.is_file() || found.len() == length);
    if file.metadata().is_ok_and(|found| is_own(&found)) {
        return Ok(());
    }
    let why = "a law has closed it, or something else has written to it";
    Err(io::Error::other(why))
}
