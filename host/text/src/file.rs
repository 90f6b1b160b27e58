//! Reading files whole, if they are of a kind and size that can be meant: a device never ends.

use std::fs::{File, Metadata};
use std::io::{self, Read};
use std::path::Path;

/// Longest input file, in bytes.
pub const LONGEST_TEXT: u64 = 16 << 20;
/// Largest file of a mesh, in bytes.
pub const LARGEST_MESH: u64 = 1 << 30;
/// Largest library, in bytes.
pub const LARGEST_LIBRARY: u64 = 1 << 30;

/// Reads an input file. A pipe may stand for it, as shells write `<(…)`.
///
/// # Errors
/// That of the system; another kind of file; more than [`LONGEST_TEXT`].
pub fn read_text(path: &Path) -> io::Result<Vec<u8>> {
    let is_pipe = |metadata: &Metadata| {
        #[cfg(unix)]
        {
            use std::os::unix::fs::FileTypeExt;
            metadata.file_type().is_fifo()
        }
        #[cfg(not(unix))]
        {
            let _ = metadata;
            false
        }
    };
    let file = open_if(path, |metadata| metadata.is_file() || is_pipe(metadata))?;
    up_to(file, LONGEST_TEXT, "an input file")
}

/// Reads a mesh.
///
/// # Errors
/// That of the system; anything but a regular file; more than [`LARGEST_MESH`].
pub fn read_mesh(path: &Path) -> io::Result<Vec<u8>> {
    up_to(open_regular(path)?, LARGEST_MESH, "a mesh")
}

/// Reads a library.
///
/// # Errors
/// That of the system; anything but a regular file; more than [`LARGEST_LIBRARY`].
pub fn read_library(path: &Path) -> io::Result<Vec<u8>> {
    up_to(open_regular(path)?, LARGEST_LIBRARY, "a library")
}

/// Opens a regular file: opening a pipe would wait for its other end.
///
/// # Errors
/// That of the system; anything but a regular file.
pub fn open_regular(path: &Path) -> io::Result<File> {
    open_if(path, Metadata::is_file)
}

fn open_if(path: &Path, fits: impl Fn(&Metadata) -> bool) -> io::Result<File> {
    let metadata = path.metadata()?;
    if metadata.is_dir() {
        return Err(io::Error::new(
            io::ErrorKind::IsADirectory,
            "it is a folder, expected a file",
        ));
    }
    if !fits(&metadata) {
        return Err(io::Error::new(
            io::ErrorKind::InvalidInput,
            "it is a device, a pipe or a socket, expected a file",
        ));
    }
    File::open(path)
}

/// The content of a file, unless it is implausibly long, whatever length the system reports.
fn up_to(file: File, most: u64, what: &str) -> io::Result<Vec<u8>> {
    let length = file.metadata()?.len();
    let too_long = || {
        let message = format!(
            "it is longer than {} MB, the most that is read of {what}",
            most >> 20
        );
        Err(io::Error::new(io::ErrorKind::FileTooLarge, message))
    };
    if length > most {
        return too_long();
    }
    let mut bytes = Vec::with_capacity(length as usize);
    file.take(most + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > most {
        return too_long();
    }
    Ok(bytes)
}
