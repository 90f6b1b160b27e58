//! `checkpoint.bin` in a results folder: what a run needs to go on from a whole increment as if it
//! had never stopped.
//!
//! The file is written whole or not at all, and carries a checksum and the identity of its run:
//! program, case and libraries. It includes the state of the results files at that moment.

use crate::recorder::ResultsState;
use law::{hexadecimal, hexadecimal_sha256};
use mechanics::State;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::borrow::Cow;
use std::fs::File;
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::Path;
use text::Error;
use text::write::begin;

/// Name of the file in a results folder.
pub const FILE_NAME: &str = "checkpoint.bin";

/// First bytes of the file: the format.
const NAME: &[u8] = b"pilum checkpoint ";
/// The same with its version.
const HEAD: &[u8] = b"pilum checkpoint 14\n";

/// Bytes that are summed and written at a time, by two threads if there are two: few enough to stay in the processor's
/// cache, and as long in work as waking a thread is worth.
const PIECE: usize = 1 << 19;

/// Removes the checkpoint of a folder, if there is one.
///
/// # Errors
/// [`Error::Unwritable`].
pub fn remove(folder: &Path) -> Result<(), Error> {
    let path = folder.join(FILE_NAME);
    match std::fs::remove_file(&path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => {
            Err(Error::unwritable(&path, error))
        }
        _ => Ok(()),
    }
}

/// A run after a whole increment.
#[derive(Debug, Serialize, Deserialize)]
pub struct Checkpoint<'c> {
    identity: Cow<'c, str>,
    /// The results so far.
    pub results: ResultsState,
    /// Warnings so far.
    pub warnings: Cow<'c, [String]>,
    /// The run; `None` if it has come to its end.
    pub run: Option<Cow<'c, State<'c>>>,
}

impl<'c> Checkpoint<'c> {
    /// A checkpoint of this case.
    pub fn new(
        identity: &'c str,
        results: ResultsState,
        warnings: &'c [String],
        run: Option<&'c State<'c>>,
    ) -> Self {
        Self {
            identity: identity.into(),
            results,
            warnings: warnings.into(),
            run: run.map(Cow::Borrowed),
        }
    }

    /// Writes it into a results folder, in place of an earlier one, and waits for the disk.
    ///
    /// # Errors
    /// [`Error::Unwritable`]; the earlier one is still there.
    pub fn write(&self, folder: &Path) -> Result<(), Error> {
        let path = folder.join(FILE_NAME);
        let partial = folder.join(format!("{FILE_NAME}.part"));
        let written = begin(&partial).and_then(|file| self.write_to(file));
        written
            .and_then(|()| std::fs::rename(&partial, &path))
            .map_err(|error| {
                let _ = std::fs::remove_file(&partial);
                Error::unwritable(&path, error)
            })
    }

    /// Writes it into a file without a copy of it in memory: the checksum follows what it is of.
    fn write_to(&self, mut file: File) -> io::Result<()> {
        file.write_all(HEAD)?;
        file.write_all(&[b' '; 64])?;
        let body = Summed {
            file,
            sum: Sha256::new(),
            outcome: Ok(()),
        };
        let mut body = BufWriter::with_capacity(PIECE, body);
        let encoded = postcard::to_io(self, &mut body).map(|_| ());
        let Summed {
            mut file,
            sum,
            outcome,
        } = body.into_inner().map_err(io::IntoInnerError::into_error)?;
        outcome?;
        encoded.map_err(io::Error::other)?;
        file.seek(SeekFrom::Start(HEAD.len() as u64))?;
        file.write_all(hexadecimal(&sum.finalize()).as_bytes())?;
        file.sync_all()
    }

    /// Reads the checkpoint of a run of this identity; `None` if absent.
    ///
    /// # Errors
    /// It cannot be read, is damaged, or belongs to another run.
    pub fn read(folder: &Path, identity: &str) -> Result<Option<Checkpoint<'static>>, Error> {
        let path = folder.join(FILE_NAME);
        let bytes = match std::fs::read(&path) {
            Ok(bytes) => bytes,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            Err(source) => return Err(Error::Unreadable { path, source }),
        };
        let refused = |why: &str| {
            Error::Usage(format!(
                "{}: {why}; run without --resume to start anew",
                path.display()
            ))
        };
        let is_other = !bytes.starts_with(HEAD) && bytes.starts_with(NAME);
        let broken = if is_other {
            "it was written by another version of the program"
        } else {
            "the file is damaged"
        };
        let checkpoint = decode(&bytes).ok_or_else(|| refused(broken))?;
        if checkpoint.identity != identity {
            return Err(refused(
                "it belongs to another case or other settings, another version of the program, or \
                 other libraries or sidecars",
            ));
        }
        Ok(Some(checkpoint))
    }
}

/// A file with the checksum of what is written into it.
struct Summed {
    file: File,
    sum: Sha256,
    /// Kept until everything is encoded: the encoder would take a failure here for an encoding
    /// error.
    outcome: io::Result<()>,
}

impl Write for Summed {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.outcome.is_ok() {
            // It is the run's own thread that writes.
            let Self { file, sum, .. } = self;
            ((), self.outcome) = rayon::join(|| sum.update(bytes), || file.write_all(bytes));
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

fn decode(bytes: &[u8]) -> Option<Checkpoint<'static>> {
    let rest = bytes.strip_prefix(HEAD)?;
    let (checksum, body) = rest.split_at_checked(64)?;
    (hexadecimal_sha256(body).as_bytes() == checksum).then_some(())?;
    postcard::from_bytes(body).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn damaged_files_are_none() {
        assert!(decode(b"").is_none());
        assert!(decode(HEAD).is_none());
        let mut bytes = HEAD.to_vec();
        bytes.extend(hexadecimal_sha256(b"nonsense").as_bytes());
        bytes.extend(b"nonsense");
        assert!(decode(&bytes).is_none());
    }
}
