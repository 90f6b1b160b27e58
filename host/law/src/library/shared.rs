//! Memory that two processes share, seen as numbers.

use memmap2::{MmapMut, MmapRaw};
use std::fs::File;
use std::io;
use std::sync::atomic::{AtomicU64, Ordering};

/// A mapped file of 64-bit words. The other process may write to it at any time, whatever was
/// agreed, so words are only copied, one by one, and any bits are a valid word.
#[derive(Debug)]
pub struct SharedMemory {
    /// `None`: nobody else has it.
    file: Option<File>,
    map: MmapRaw,
}

impl SharedMemory {
    /// Maps a file, which must not shrink: it is a sealed one, or nobody else knows its name.
    ///
    /// # Errors
    /// The system's.
    pub fn new(file: File) -> io::Result<Self> {
        let map = MmapRaw::map_raw(&file)?;
        let file = Some(file);
        Ok(Self { file, map })
    }

    /// A page of this process alone. In a copy of it, made by `fork`, its words are 0.
    ///
    /// # Errors
    /// The system's; it may not know how.
    pub fn gone_in_copies() -> io::Result<Self> {
        let map = MmapMut::map_anon(4096)?;
        let map = MmapRaw::from(map);
        #[cfg(target_os = "linux")]
        {
            use rustix::mm::{Advice, madvise};
            // SAFETY: the page is this mapping's own, and no reference to its words is ever made.
            unsafe { madvise(map.as_mut_ptr().cast(), 4096, Advice::LinuxWipeOnFork)? };
        }
        Ok(Self { file: None, map })
    }

    fn file(&self) -> io::Result<&File> {
        let file = self.file.as_ref();
        file.ok_or_else(|| io::Error::other("nobody shares this memory"))
    }

    /// Number of words.
    pub fn len(&self) -> usize {
        self.map.len() / size_of::<u64>()
    }

    /// Whether there is no word.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Makes room for this many words.
    ///
    /// # Errors
    /// The system's.
    pub fn grow(&mut self, n: usize) -> io::Result<()> {
        self.file()?.set_len((n * size_of::<u64>()) as u64)?;
        self.map = MmapRaw::map_raw(self.file()?)?;
        Ok(())
    }

    /// Maps what the other process has made room for.
    ///
    /// # Errors
    /// The system's.
    pub fn follow(&mut self) -> io::Result<()> {
        self.map = MmapRaw::map_raw(self.file()?)?;
        Ok(())
    }

    #[expect(clippy::cast_ptr_alignment, reason = "a mapping starts at a page")]
    fn word(&self, i: usize) -> &AtomicU64 {
        assert!(i < self.len(), "word {i} of {} is shared", self.len());
        // SAFETY: the word lies inside the mapping, which starts at a page, is never unmapped while
        // it is borrowed, and is only accessed by such atomics.
        unsafe { AtomicU64::from_ptr(self.map.as_mut_ptr().cast::<u64>().add(i)) }
    }

    /// Writes words from place `i` on; returns the place after them.
    pub fn write(&self, i: usize, words: impl Iterator<Item = u64>) -> usize {
        let mut at = i;
        for word in words {
            self.word(at).store(word, Ordering::Relaxed);
            at += 1;
        }
        at
    }

    /// `n` words from place `i` on.
    pub fn read(&self, i: usize, n: usize) -> impl Iterator<Item = u64> {
        (i..i + n).map(|at| self.word(at).load(Ordering::Relaxed))
    }
}
