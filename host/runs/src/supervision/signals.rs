//! The signals that are for the watcher: requests to stop, and ends of children. It takes them one after
//! another, when it is ready for them, so it needs no thread for them.

use law::child;
use nix::sys::signal::{SigSet, Signal};
use nix::sys::signalfd::{SfdFlags, SignalFd};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use std::io;
use std::time::Duration;

/// Signals that wait until they are taken.
#[derive(Debug)]
pub(super) struct Signals {
    waiting: SignalFd,
    /// What was kept away before.
    before: SigSet,
}

impl Signals {
    /// Keeps them away from this process, and requests to stop from those that it starts.
    ///
    /// # Errors
    /// The system's.
    pub(super) fn keep() -> io::Result<Self> {
        let before = SigSet::thread_get_mask()?;
        let mut signals = child::requests();
        signals.add(Signal::SIGCHLD);
        let flags = SfdFlags::SFD_CLOEXEC | SfdFlags::SFD_NONBLOCK;
        let waiting = SignalFd::with_flags(&signals, flags)?;
        signals.thread_block()?;
        Ok(Self { waiting, before })
    }

    /// For a copy of the watcher: it sees its children end as any process does.
    ///
    /// # Errors
    /// The system's.
    pub(super) fn leave_to_watcher(mut self) -> io::Result<()> {
        self.before.extend(&child::requests());
        self.before.thread_set_mask()?;
        Ok(())
    }

    /// Waits for the next one, no longer than this. Whether it is a request to stop.
    ///
    /// # Errors
    /// The system's.
    pub(super) fn next_is_request(&self, at_most: Option<Duration>) -> io::Result<bool> {
        let at_most = at_most.map(|time| Timespec {
            tv_sec: time.as_secs() as i64,
            tv_nsec: i64::from(time.subsec_nanos()),
        });
        let mut waiting = [PollFd::new(&self.waiting, PollFlags::IN)];
        match poll(&mut waiting, at_most.as_ref()) {
            Ok(_) | Err(Errno::INTR) => {}
            Err(why) => return Err(why.into()),
        }
        let signal = self.waiting.read_signal()?;
        Ok(signal.is_some_and(|signal| signal.ssi_signo != Signal::SIGCHLD as u32))
    }
}
