//! Files in a results folder: begun in place of whatever has their names, and, where a run goes on,
//! only if they still hold what they held. Nothing is written through a link: what it leads to
//! belongs to somebody else.

use crc32fast::Hasher;
use serde::{Deserialize, Serialize};
use std::fs::{File, Metadata, OpenOptions, TryLockError};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use text::Error;
use text::write::{Identity, begin, check_own, identity, other};

/// Bytes read at a time where a file is summed.
const PIECE: usize = 1 << 16;
/// Time that the process of a run that was killed may take to end.
const MOMENT: Duration = Duration::from_millis(500);

/// Whether what is written into this file is seen under another name.
fn has_other_names(metadata: &Metadata) -> bool {
    #[cfg(unix)]
    {
        std::os::unix::fs::MetadataExt::nlink(metadata) > 1
    }
    #[cfg(not(unix))]
    {
        let _ = metadata;
        false
    }
}

/// How much a file held, and its CRC-32, by which damage is noticed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Extent {
    pub(crate) length: u64,
    pub(crate) sum: u32,
}

/// A file that is appended to.
#[derive(Debug)]
pub(crate) struct Appended {
    path: PathBuf,
    file: File,
    own: Identity,
    /// Bytes of whole entries in the file, and their sum.
    length: u64,
    sum: Hasher,
}

impl Appended {
    /// Begins a file; or, `from` what it held, goes on after that.
    ///
    /// # Errors
    /// [`Error::Unwritable`]; [`Error::Usage`] if it no longer holds that.
    pub(crate) fn begin(path: PathBuf, from: Option<Extent>) -> Result<Self, Error> {
        let Some(extent) = from else {
            let file = begin(&path).map_err(|error| Error::unwritable(&path, error))?;
            return Ok(Self::new(path, file));
        };
        let mut options = OpenOptions::new();
        refuse_link(&path)?;
        let opened = options.read(true).write(true).open(&path);
        let file = opened.map_err(|error| Error::unwritable(&path, error))?;
        Self::new(path, file).go_on(extent)
    }

    /// Begins a file, or opens the one that a run goes on in. As long as it is open, no other run
    /// gets hold of it.
    ///
    /// # Errors
    /// [`Error::Unwritable`].
    pub(crate) fn begin_locked(path: PathBuf, goes_on: bool) -> Result<Self, Error> {
        let failed = |error| Error::unwritable(&path, error);
        // A link is not opened, not even to see whether another run writes there.
        match path.symlink_metadata() {
            Ok(_) if goes_on => refuse_link(&path)?,
            Ok(found) if found.is_symlink() => std::fs::remove_file(&path).map_err(failed)?,
            Ok(found) if !found.is_file() => return Err(failed(other())),
            _ => (),
        }
        let mut options = OpenOptions::new();
        let options = options.read(true).write(true).create(true).truncate(false);
        let mut file = options.open(&path).map_err(failed)?;
        lock(&file).map_err(failed)?;
        if !goes_on {
            if has_other_names(&file.metadata().map_err(failed)?) {
                file = begin(&path).map_err(failed)?;
                lock(&file).map_err(failed)?;
            }
            file.set_len(0).map_err(failed)?;
        }
        Ok(Self::new(path, file))
    }

    fn new(path: PathBuf, file: File) -> Self {
        Self {
            path,
            own: identity(&file),
            file,
            length: 0,
            sum: Hasher::new(),
        }
    }

    /// Forgets what the file holds after `extent` and goes on there.
    ///
    /// # Errors
    /// [`Error::Unwritable`]; [`Error::Usage`] if it does not begin with that.
    pub(crate) fn go_on(mut self, extent: Extent) -> Result<Self, Error> {
        let summed = sum_of(&mut self.file, extent.length);
        self.sum = summed.map_err(|error| Error::unwritable(&self.path, error))?;
        self.length = extent.length;
        if self.extent() != extent {
            return Err(changed(&self.path));
        }
        self.file
            .set_len(extent.length)
            .and_then(|()| self.file.seek(SeekFrom::Start(extent.length)))
            .map_err(|error| Error::unwritable(&self.path, error))?;
        Ok(self)
    }

    /// Bytes of whole entries in the file.
    pub(crate) fn length(&self) -> u64 {
        self.length
    }

    fn extent(&self) -> Extent {
        Extent {
            length: self.length,
            sum: self.sum.clone().finalize(),
        }
    }

    /// Appends whole entries. A text that does not fit as a whole is removed completely, so that no
    /// part passes for the whole.
    ///
    /// # Errors
    /// [`Error::Unwritable`].
    pub(crate) fn append(&mut self, text: &[u8]) -> Result<(), Error> {
        check_own(&self.file, self.own, self.length)
            .map_err(|error| Error::unwritable(&self.path, error))?;
        if let Err(error) = self.file.write_all(text) {
            let _ = self.file.set_len(self.length);
            return Err(Error::unwritable(&self.path, error));
        }
        self.length += text.len() as u64;
        self.sum.update(text);
        Ok(())
    }

    /// Waits until everything is on the disk.
    ///
    /// # Errors
    /// [`Error::Unwritable`].
    pub(crate) fn sync(&self) -> Result<Extent, Error> {
        let synced = self.file.sync_data();
        synced.map_err(|error| Error::unwritable(&self.path, error))?;
        Ok(self.extent())
    }
}

/// Locks a file. The process of a run that was killed may take a moment to end.
fn lock(file: &File) -> io::Result<()> {
    let since = Instant::now();
    loop {
        // Some file systems know no locks: an error says nothing of another run.
        match file.try_lock() {
            Err(TryLockError::WouldBlock) if since.elapsed() < MOMENT => {
                std::thread::sleep(Duration::from_millis(5));
            }
            Err(TryLockError::WouldBlock) => {
                return Err(io::Error::other("another run is writing into this folder"));
            }
            _ => return Ok(()),
        }
    }
}

/// Checks that a file still begins with what it held, without touching it.
///
/// # Errors
/// [`Error::Unreadable`]; [`Error::Usage`] if it does not.
pub(crate) fn check(path: &Path, extent: Extent) -> Result<(), Error> {
    let unreadable = |why| Error::unreadable(path, why);
    let mut file = text::file::open_regular(path).map_err(unreadable)?;
    let sum = sum_of(&mut file, extent.length).map_err(unreadable)?;
    if sum.finalize() == extent.sum {
        Ok(())
    } else {
        Err(changed(path))
    }
}

/// Checks that a file is there and has this length: a look at what it holds would take too long.
///
/// # Errors
/// [`Error::Usage`].
pub(crate) fn check_length(path: &Path, length: u64) -> Result<(), Error> {
    match path.metadata() {
        Ok(found) if found.is_file() && found.len() == length => Ok(()),
        _ => Err(changed(path)),
    }
}

/// The sum of the first bytes of a file; of all if there are fewer.
fn sum_of(file: &mut File, length: u64) -> io::Result<Hasher> {
    file.seek(SeekFrom::Start(0))?;
    let mut sum = Hasher::new();
    let mut piece = vec![0; PIECE];
    let mut left = length;
    while left > 0 {
        let most = left.min(PIECE as u64) as usize;
        let n = file.read(&mut piece[..most])?;
        if n == 0 {
            // The sum is another one then.
            sum.update(&[1]);
            break;
        }
        sum.update(&piece[..n]);
        left -= n as u64;
    }
    Ok(sum)
}

fn refuse_link(path: &Path) -> Result<(), Error> {
    let found = path.symlink_metadata();
    let found = found.map_err(|error| Error::unwritable(path, error))?;
    if found.is_symlink() || has_other_names(&found) {
        let why = "it is a link: results are not written through one";
        return Err(Error::unwritable(path, io::Error::other(why)));
    }
    if found.is_file() {
        Ok(())
    } else {
        Err(Error::unwritable(path, other()))
    }
}

fn changed(path: &Path) -> Error {
    Error::Usage(format!(
        "{}: it is not what it was at the last checkpoint: it was changed or removed since; run \
         without --resume to start anew",
        path.display()
    ))
}
