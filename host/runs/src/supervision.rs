//! A law may end the process that calls it, in many ways: `exit`, a crash, a copy by `fork`. So a
//! child, a copy made before the program has any thread, does the work, and the program watches. Shared
//! memory holds what the child calls, what it has handed out and how it means to end. If a child
//! disappears without announcing its end, a law ended it. Then the same is done once more with laws in
//! separate processes ([`law::isolate`]), which names the point.
//!
//! The watcher takes the signals. Those of the terminal do not reach the child and its children,
//! which see a request to stop in the memory. A child that does not answer is ended.
//!
//! | words of the memory | |
//! |---|---|
//! | 0 … 15 | see `word` |
//! | folder | where the present run writes |
//! | calls | `plugin::calls` |

#[cfg(target_os = "linux")]
mod child;
#[cfg(not(target_os = "linux"))]
#[path = "supervision/unsupported.rs"]
mod child;
#[cfg(target_os = "linux")]
mod parent;
#[cfg(target_os = "linux")]
mod signals;

#[cfg(not(target_os = "linux"))]
pub use child::supervise;
pub use child::{begin_run, case_begun, end, end_run, is_again, stdout, stop, was_begun};
#[cfg(target_os = "linux")]
pub use parent::supervise;

#[cfg(target_os = "linux")]
use law::{SharedMemory, current_call};

/// Set to anything, the program does all in one process, for debuggers and profilers.
pub const ALONE: &str = "PILUM_UNSUPERVISED";
/// Message after a request to stop.
pub const STOPPING: &str = "stopping after this increment; once more to stop at once";

#[cfg(target_os = "linux")]
/// Single words.
mod word {
    /// The exit code plus 1, once the child has said it.
    pub(super) const ENDED: usize = 0;
    /// Requests to stop.
    pub(super) const STOPS: usize = 1;
    /// Longest piece of work that was not to be interrupted, in microseconds.
    pub(super) const LONGEST: usize = 2;
    /// Bytes handed out on the standard output.
    pub(super) const HANDED: usize = 3;
    /// Cases whose results have begun.
    pub(super) const CASES: usize = 4;
    /// 1: in the course of the phases of a case.
    pub(super) const RUNNING: usize = 5;
    /// 1: all is done once more, with laws in separate processes.
    pub(super) const AGAIN: usize = 6;
    /// Then: cases that had begun the first time.
    pub(super) const BEGUN: usize = 7;
    /// Then: the phase and increment after which it is enough, if any.
    pub(super) const ENOUGH: usize = 8;
    /// Then: bytes that had been handed out.
    pub(super) const SKIP: usize = 9;
    /// 1: laws are in separate processes anyway.
    pub(super) const APART: usize = 10;
}
#[cfg(target_os = "linux")]
const FOLDER: usize = 16;
#[cfg(target_os = "linux")]
const FOLDER_WORDS: usize = 513;
#[cfg(target_os = "linux")]
const CALLS: usize = FOLDER + FOLDER_WORDS;
#[cfg(target_os = "linux")]
const SIZE: usize = CALLS + current_call::SIZE;

#[cfg(target_os = "linux")]
/// The memory that both share.
#[derive(Debug)]
struct Page(SharedMemory);

#[cfg(target_os = "linux")]
impl Page {
    fn get(&self, word: usize) -> u64 {
        self.0.read(word, 1).next().unwrap_or(0)
    }

    fn set(&self, word: usize, value: u64) {
        self.0.write(word, std::iter::once(value));
    }

    fn folder(&self) -> String {
        current_call::read_text(&self.0, FOLDER, FOLDER_WORDS)
    }

    fn calls(&self) -> current_call::Watched<'_> {
        current_call::Watched(&self.0, CALLS)
    }
}
