//! The bytes of a library, read once: what is hashed is what is opened.
//!
//! On Linux they are copied into a sealed file in memory while they are hashed, so that nobody can
//! change them in between; variables that the copy would share with others become its [own](unique). Elsewhere, and with `PILUM_LOAD_IN_PLACE=1` (for debuggers and
//! profilers, which look for the file), the file itself is opened after it was hashed.

#[cfg(target_os = "linux")]
mod unique;

use super::trust;
use sha2::{Digest, Sha256};
use std::fs::File;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use text::file;

/// Bytes that are read, hashed and copied at a time: they stay in the processor's cache.
const PIECE: usize = 1 << 15;

/// SHA-256 of some bytes, in hexadecimal digits.
pub fn hexadecimal_sha256(bytes: &[u8]) -> String {
    hexadecimal(&Sha256::digest(bytes))
}

/// Bytes in hexadecimal digits.
pub fn hexadecimal(digest: &[u8]) -> String {
    let digits = digest.iter().map(|byte| format!("{byte:02x}"));
    digits.collect()
}

/// A library's bytes.
#[derive(Debug)]
pub(crate) struct Image {
    /// SHA-256 in hexadecimal digits.
    pub(crate) sha256: String,
    /// What the user should know about the file's permissions.
    pub(crate) warnings: Vec<String>,
    path: PathBuf,
    #[cfg(target_os = "linux")]
    sealed: Option<std::os::fd::OwnedFd>,
}

impl Image {
    /// Reads and hashes a file that not everybody may change.
    ///
    /// # Errors
    /// The defect of the file, in words.
    pub(crate) fn read(path: &Path) -> Result<Self, String> {
        let unreadable = |why: io::Error| format!("cannot be read: {why}");
        let warnings = trust::check_permissions(path)?;
        let mut file = file::open_regular(path).map_err(unreadable)?;
        #[cfg(target_os = "linux")]
        let mut memory = if loads_in_place() {
            None
        } else {
            memory_file("pilum_law").ok()
        };
        #[cfg(not(target_os = "linux"))]
        let mut memory: Option<File> = None;
        let mut read = 0;
        let mut hash = Sha256::new();
        let mut piece = vec![0; PIECE];
        loop {
            let n = match file.read(&mut piece) {
                Ok(0) => break,
                Ok(n) => n,
                Err(why) if why.kind() == io::ErrorKind::Interrupted => continue,
                Err(why) => return Err(unreadable(why)),
            };
            read += n as u64;
            if read > file::LARGEST_LIBRARY {
                let most = file::LARGEST_LIBRARY >> 20;
                return Err(format!("is longer than {most} MB, the most that is read"));
            }
            hash.update(&piece[..n]);
            if memory
                .as_mut()
                .is_some_and(|memory| memory.write_all(&piece[..n]).is_err())
            {
                memory = None;
            }
        }
        Ok(Self {
            sha256: hexadecimal(&hash.finalize()),
            warnings,
            path: path.to_owned(),
            #[cfg(target_os = "linux")]
            sealed: memory.and_then(|memory| seal(memory, path)),
        })
    }

    /// Reads a file once more, which must have this SHA-256.
    ///
    /// # Errors
    /// The defect of the file, in words.
    pub(crate) fn again(path: &Path, sha256: &str) -> Result<Self, String> {
        let image = Self::read(path)?;
        if image.sha256 == sha256 {
            Ok(image)
        } else {
            Err("it was changed".to_owned())
        }
    }

    /// The path that stands for the very bytes that were hashed. The image must not be dropped
    /// while the path is in use.
    pub(crate) fn sealed_path(&self) -> Option<PathBuf> {
        #[cfg(target_os = "linux")]
        {
            use std::os::fd::AsRawFd;
            self.sealed
                .as_ref()
                .map(|file| PathBuf::from(format!("/proc/self/fd/{}", file.as_raw_fd())))
        }
        #[cfg(not(target_os = "linux"))]
        None
    }

    /// Whether the file still has the bytes that were hashed.
    pub(crate) fn is_current(&self) -> bool {
        Self::read(&self.path).is_ok_and(|again| again.sha256 == self.sha256)
    }

    /// Keeps the memory for as long as the process lives: a library opened from it is never
    /// unloaded, and the loader knows it by the path of its descriptor, which must not become
    /// another file's.
    pub(crate) fn keep(self) {
        #[cfg(target_os = "linux")]
        std::mem::forget(self.sealed);
    }
}

/// Whether the user wants the file itself to be opened.
#[cfg(target_os = "linux")]
fn loads_in_place() -> bool {
    std::env::var_os("PILUM_LOAD_IN_PLACE").is_some_and(|value| value != "0")
}

/// An empty file in memory that may be sealed and executed.
///
/// # Errors
/// The system lacks it.
#[cfg(target_os = "linux")]
pub(crate) fn memory_file(name: &str) -> io::Result<File> {
    use rustix::fs::{MemfdFlags, memfd_create};
    let flags = MemfdFlags::CLOEXEC | MemfdFlags::ALLOW_SEALING;
    // Kernels before 6.3 do not know the flag, and need none.
    let memory =
        memfd_create(name, flags | MemfdFlags::EXEC).or_else(|_| memfd_create(name, flags))?;
    Ok(memory.into())
}

#[cfg(target_os = "linux")]
fn seal(memory: File, path: &Path) -> Option<std::os::fd::OwnedFd> {
    use rustix::fs::{SealFlags, fcntl_add_seals};
    unique::make_ordinary(&memory, path).ok()?;
    let seals = SealFlags::SEAL | SealFlags::SHRINK | SealFlags::GROW | SealFlags::WRITE;
    fcntl_add_seals(&memory, seals).ok()?;
    Some(memory.into())
}
