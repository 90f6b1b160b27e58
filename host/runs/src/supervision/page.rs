//! The memory that the watcher and its child share: single words, the folder where the present run writes, and the calls
//! of laws under way.

use law::{SharedMemory, current_call};

/// Single words.
pub(super) mod word {
    /// The exit code plus 1, once the child has said it.
    pub(crate) const ENDED: usize = 0;
    /// Requests to stop.
    pub(crate) const STOPS: usize = 1;
    /// Longest piece of work that was not to be interrupted, in microseconds.
    pub(crate) const LONGEST: usize = 2;
    /// Bytes handed out on the standard output.
    pub(crate) const HANDED: usize = 3;
    /// Cases whose results have begun.
    pub(crate) const CASES: usize = 4;
    /// 1: in the course of the phases of a case.
    pub(crate) const RUNNING: usize = 5;
    /// 1: all is done once more, with laws in separate processes.
    pub(crate) const AGAIN: usize = 6;
    /// Then: cases that had begun the first time.
    pub(crate) const BEGUN: usize = 7;
    /// Then: the phase and increment after which it is enough, if any.
    pub(crate) const ENOUGH: usize = 8;
    /// Then: bytes that had been handed out.
    pub(crate) const SKIP: usize = 9;
    /// 1: laws are in separate processes anyway.
    pub(crate) const APART: usize = 10;
}
pub(super) const FOLDER: usize = 16;
pub(super) const FOLDER_WORDS: usize = 513;
pub(super) const CALLS: usize = FOLDER + FOLDER_WORDS;
pub(super) const SIZE: usize = CALLS + current_call::SIZE;

/// The memory that both share.
#[derive(Debug)]
pub(super) struct Page(pub(super) SharedMemory);

impl Page {
    pub(super) fn get(&self, word: usize) -> u64 {
        self.0.read(word, 1).next().unwrap_or(0)
    }

    pub(super) fn set(&self, word: usize, value: u64) {
        self.0.write(word, std::iter::once(value));
    }

    pub(super) fn folder(&self) -> String {
        current_call::read_text(&self.0, FOLDER, FOLDER_WORDS)
    }

    pub(super) fn calls(&self) -> current_call::Watched<'_> {
        current_call::Watched(&self.0, CALLS)
    }
}
