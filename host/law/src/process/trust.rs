//! Trust in libraries. A library has all rights of the user once it is opened; these rules
//! prevent accidents and surprises, not attacks by the user's own programs.

use std::path::Path;
use std::time::Duration;

/// How libraries are dealt with. Only the `pilum` program can probe and isolate: the children are
/// this program again.
#[derive(Clone, Copy, Debug, Default)]
pub struct Trust {
    /// Try libraries that are not known yet in a child process first.
    pub probe: bool,
    /// Call laws in worker processes; one call may take this long.
    pub isolate: Option<Duration>,
}

/// Refuses files that every user may change or replace. Returns what the user should know of
/// those that a group may change.
///
/// # Errors
/// The file or its folder, and what to do about it.
#[cfg(unix)]
pub(crate) fn check_permissions(path: &Path) -> Result<Vec<String>, String> {
    use std::os::unix::fs::MetadataExt;
    const GROUP: u32 = 0o020;
    const EVERYONE: u32 = 0o002;
    const STICKY: u32 = 0o1000;
    let real = path
        .canonicalize()
        .map_err(|why| format!("cannot be read: {why}"))?;
    let mut warnings = Vec::new();
    let mut owner = None;
    for (what, place) in [("", Some(&*real)), ("its folder ", real.parent())] {
        let Some(place) = place else { continue };
        let metadata = place
            .metadata()
            .map_err(|why| format!("cannot be read: {why}"))?;
        let mode = metadata.mode();
        // In a sticky folder nobody else can replace a file of this user or of root.
        let mine = owner == Some(0) || owner == Some(rustix::process::geteuid().as_raw());
        let is_guarded = mode & STICKY != 0 && mine;
        if mode & EVERYONE != 0 && !is_guarded {
            return Err(format!(
                "is refused: {what}{} can be changed by every user of this computer (mode {:o}); \
                 `chmod o-w` takes that right away",
                place.display(),
                mode & 0o7777
            ));
        }
        // Where each user has a group of his own, the group's right is the owner's.
        if mode & GROUP != 0 && metadata.gid() != metadata.uid() && !is_guarded {
            warnings.push(format!(
                "library {}: {what}{} can be changed by its group (mode {:o})",
                path.display(),
                place.display(),
                mode & 0o7777
            ));
        }
        owner = Some(metadata.uid());
    }
    Ok(warnings)
}

/// As on Unix; permissions of other systems are not looked at.
#[cfg(not(unix))]
pub(crate) fn check_permissions(_path: &Path) -> Result<Vec<String>, String> {
    Ok(Vec::new())
}
