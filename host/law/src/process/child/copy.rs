//! A process that is a copy of this one as it stands, and goes on where this one is: it need not be started and set up
//! once more.
#![expect(unsafe_code, reason = "the system's copy of a process")]

use nix::sys::signal::{SigHandler, Signal, signal};
use nix::unistd::{ForkResult, fork};
use rustix::process::Pid;
use std::io;

/// Whether this process can be copied whole. The copy has one thread; what others held would be held for good.
pub fn can_be_copied() -> bool {
    std::fs::read_dir("/proc/self/task").is_ok_and(|threads| threads.count() == 1)
}

/// Copies this process and returns the number of the copy; `None`: this is the copy.
///
/// # Errors
/// The process cannot be copied, or the system has no room for one more.
pub fn copy() -> io::Result<Option<Pid>> {
    if !can_be_copied() {
        return Err(io::Error::other("it has more than one thread"));
    }
    // Whoever started this process may not have cared for the ends of children, which is passed on.
    // SAFETY: the default calls nothing, and takes the place of no handler of this program.
    unsafe { signal(Signal::SIGCHLD, SigHandler::SigDfl) }.map_err(io::Error::from)?;
    // SAFETY: the only thread goes on in both, so that nothing is held by one that the copy lacks.
    match unsafe { fork() }.map_err(io::Error::from)? {
        ForkResult::Parent { child } => Ok(Pid::from_raw(child.as_raw())),
        ForkResult::Child => Ok(None),
    }
}
