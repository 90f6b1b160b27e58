//! State of the whole process that a law may change: the working folder, the limits, the standard streams. It is
//! checked after a law is built and before results are written, and restored as it was at the start. Changes made while
//! a library is loaded are reported with the first of its laws that is built.

use std::io;
use std::path::PathBuf;
use std::sync::{Mutex, OnceLock, PoisonError};

// Of the whole process by nature: limits, signals and folders belong to it.
static AT_START: OnceLock<Custody> = OnceLock::new();

/// How it was at the start.
#[derive(Debug)]
struct Custody {
    folder: Option<(PathBuf, Identity)>,
    #[cfg(unix)]
    limits: Vec<(rustix::process::Resource, rustix::process::Rlimit)>,
    streams: [Option<Identity>; 3],
}

/// Identity of a file, whatever its name: its device and its number there.
type Identity = (u64, u64);

/// Remembers how it is, before the first law is opened. A program that never does is not watched.
pub fn begin() {
    AT_START.get_or_init(|| {
        let folder = std::env::current_dir().ok();
        Custody {
            folder: folder.and_then(|path| Some((path, here()?))),
            #[cfg(unix)]
            limits: LIMITS
                .map(|(limit, _)| (limit, rustix::process::getrlimit(limit)))
                .to_vec(),
            streams: streams(),
        }
    });
}

/// Remarks on libraries, and whether each was reported. They belong to the whole process, as a library is loaded for
/// all of it.
static REMARKS: Mutex<Vec<(String, bool)>> = Mutex::new(Vec::new());

/// Keeps a remark to be reported once, however often it is found.
pub(crate) fn remark(words: String) {
    let mut all = REMARKS.lock().unwrap_or_else(PoisonError::into_inner);
    if !all.iter().any(|(known, _)| *known == words) {
        all.push((words, false));
    }
}

/// Remarks on libraries that this process has loaded, without those already reported.
pub fn remarks() -> Vec<String> {
    let mut all = REMARKS.lock().unwrap_or_else(PoisonError::into_inner);
    let new = all.iter_mut().filter(|(_, is_said)| !is_said);
    new.map(|(words, is_said)| {
        *is_said = true;
        words.clone()
    })
    .collect()
}

/// Restores it. Returns what had been changed.
///
/// # Errors
/// What cannot be set back.
pub fn restore() -> Result<Vec<String>, String> {
    let Some(start) = AT_START.get() else {
        return Ok(Vec::new());
    };
    let mut changes = Vec::new();
    if let Some((path, identity)) = &start.folder
        && here() != Some(*identity)
    {
        std::env::set_current_dir(path).map_err(|why| {
            format!(
                "a law has changed the working folder, and {} cannot be gone back to: {why}",
                path.display()
            )
        })?;
        changes.push("a law has changed the working folder; it was set back".to_owned());
    }
    #[cfg(unix)]
    for ((limit, before), (_, name)) in start.limits.iter().zip(LIMITS) {
        if rustix::process::getrlimit(*limit) != *before {
            rustix::process::setrlimit(*limit, *before)
                .map_err(|why| format!("a law has changed the limit of {name}, for good: {why}"))?;
            changes.push(format!(
                "a law has changed the limit of {name}; it was set back"
            ));
        }
    }
    check_streams().map_err(|why| why.to_string())?;
    Ok(changes)
}

/// Refuses to write to a standard stream that a law has closed: its number may be that of another
/// file by now.
fn check_streams() -> io::Result<()> {
    let Some(start) = AT_START.get() else {
        return Ok(());
    };
    let names = ["input", "output", "error stream"];
    for ((before, now), name) in start.streams.iter().zip(streams()).zip(names) {
        if before.is_some() && *before != now {
            return Err(io::Error::other(format!(
                "a law has closed the standard {name}"
            )));
        }
    }
    Ok(())
}

#[cfg(unix)]
const LIMITS: [(rustix::process::Resource, &str); 5] = {
    use rustix::process::Resource;
    [
        (Resource::Fsize, "file sizes"),
        (Resource::Nofile, "open files"),
        (Resource::Cpu, "CPU time"),
        (Resource::As, "address space"),
        (Resource::Data, "data"),
    ]
};

#[cfg(unix)]
fn here() -> Option<Identity> {
    use std::os::unix::fs::MetadataExt;
    let found = std::fs::metadata(".").ok()?;
    Some((found.dev(), found.ino()))
}

#[cfg(not(unix))]
fn here() -> Option<Identity> {
    None
}

#[cfg(unix)]
#[allow(
    clippy::unnecessary_cast,
    reason = "the types are others on other systems"
)]
fn streams() -> [Option<Identity>; 3] {
    let (input, output, error) = (io::stdin(), io::stdout(), io::stderr());
    let of = |stream: rustix::io::Result<rustix::fs::Stat>| {
        let found = stream.ok()?;
        Some((found.st_dev as u64, found.st_ino as u64))
    };
    [
        of(rustix::fs::fstat(&input)),
        of(rustix::fs::fstat(&output)),
        of(rustix::fs::fstat(&error)),
    ]
}

#[cfg(not(unix))]
fn streams() -> [Option<Identity>; 3] {
    [None; 3]
}
