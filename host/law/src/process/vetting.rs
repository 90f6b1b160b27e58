//! Libraries that are not known yet are tried in a child process first: what crashes, hangs or eats
//! all memory does so there ([`crate::trial`]).
//!
//! Libraries that passed are remembered by SHA-256 and program version, so that each is tried once.
//! Others are tried again every time.

use super::child::{self, Ending, Work};
use crate::Error;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// The hidden command of the child.
pub(crate) const COMMAND: &str = "probe-library";
/// How long the child may take.
const TIME: Duration = Duration::from_secs(5);
/// How much address space it may take, in bytes.
const MEMORY: u64 = 4 << 30;
/// In front of what the child says, since libraries may print too.
pub(crate) const MARK: &str = "pilum-probe: ";
/// Its last words where the library did all it was asked for.
pub(crate) const PASSED: &str = "passed";
/// Its last words where the library was refused in an orderly way.
pub(crate) const REFUSED: &str = "refused";

/// There is no child process.
fn untried(path: &Path, why: &std::io::Error) -> Error {
    let library = path.display();
    if why.kind() == ErrorKind::OutOfMemory {
        let message = format!("not enough memory to try library {library} in a child process");
        return text::Error::Usage(message).into();
    }
    Error::library(format!(
        "library {library} cannot be tried in a child process: {why}"
    ))
}

/// Tries a library in a child process, unless that was done. Orderly refusals are left to this
/// process, which finds the same.
///
/// # Errors
/// [`Error::Library`]: what the library did in the child. [`text::Error::Usage`]: there is not the memory for one.
pub(crate) fn vet(path: &Path, sha256: &str) -> Result<(), Error> {
    let verdict = verdict_path(sha256);
    if verdict.as_ref().is_some_and(|file| file.is_file()) {
        return Ok(());
    }
    let work = Work {
        memory: Some(MEMORY),
        ..Work::new(vec![COMMAND.into(), path.into(), sha256.into()], TIME)
    };
    let outcome = child::run(&work).map_err(|why| untried(path, &why))?;
    let output = String::from_utf8_lossy(&outcome.stdout);
    let mut marked = output.lines().filter_map(|line| line.split_once(MARK));
    let last = marked.next_back().map_or("loading it", |(_, said)| said);
    match (outcome.ending, last) {
        (Ending::Exited(0), PASSED) => {
            if let Some(file) = verdict {
                remember(&file);
            }
            Ok(())
        }
        (Ending::Exited(0), REFUSED) => Ok(()),
        (ending, doing) => Err(Error::Library {
            message: format!(
                "library {} was tried in a child process and did not survive: {ending}, while \
                 {doing}",
                path.display()
            ),
            hint: Some(
                "`pilum check` finds out more; `--no-probe` opens it all the same, `--isolate` \
                 calls its laws in a process of their own"
                    .to_owned(),
            ),
        }),
    }
}

/// The file that stands for a library that passed. `None` where there is no place for it.
fn verdict_path(sha256: &str) -> Option<PathBuf> {
    let set = |name| {
        std::env::var_os(name)
            .map(PathBuf::from)
            .filter(|path| path.is_absolute())
    };
    let home = || {
        if cfg!(windows) {
            set("LOCALAPPDATA")
        } else if cfg!(target_os = "macos") {
            set("HOME").map(|home| home.join("Library/Caches"))
        } else {
            set("HOME").map(|home| home.join(".cache"))
        }
    };
    let cache = set("XDG_CACHE_HOME").or_else(home)?;
    let version = env!("CARGO_PKG_VERSION");
    Some(cache.join("pilum/probed").join(version).join(sha256))
}

/// A verdict that cannot be kept costs time, and nothing else.
fn remember(file: &Path) {
    if let Some(folder) = file.parent() {
        let _ = std::fs::create_dir_all(folder);
    }
    let _ = std::fs::write(file, "");
}
