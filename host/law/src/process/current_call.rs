//! The law that this process is calling, its caller and increment, in memory shared with the
//! watching process, so that they are known however the process ends. And
//! whether this process is still the one that called: a law may have made a copy of it.
//!
//! Writing costs a few nanoseconds for a call with a whole batch of points. Without a watcher there
//! is nothing to write to.

use crate::call::Moment;
use crate::library::SharedMemory;
use std::cell::Cell;
use std::fmt::Write as _;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, OnceLock, PoisonError};

/// Threads with a separate place; others share the last.
const THREADS: usize = 64;
/// Words of a place.
const WORDS: usize = 8;
/// Names that are kept, and the words of one: its length and its bytes.
const NAMES: usize = 96;
const NAME: usize = 48;
/// Words in all: the places, the place of a copy, the number of names, the names.
pub const SIZE: usize = COUNT + 1 + NAMES * NAME;
const COPY: usize = THREADS * WORDS;
const COUNT: usize = COPY + WORDS;

// What follows is of the whole process by nature: whoever watches it reads this one memory, and a
// copy of the process (fork) is told from it by one word.

/// The memory, and where in it the places begin.
static SHARED: OnceLock<(&'static SharedMemory, usize)> = OnceLock::new();
/// A word that is 1 in this process and 0 in a copy of it.
static ORIGINAL: OnceLock<Option<SharedMemory>> = OnceLock::new();
/// Names so far.
static KNOWN: Mutex<Vec<String>> = Mutex::new(Vec::new());

thread_local! {
    /// Number of the thread, from 1.
    static THREAD: Cell<usize> = const { Cell::new(0) };
    /// Calls so far.
    static CALLS: Cell<u64> = const { Cell::new(0) };
    static SCOPE: Cell<Scope> = const { Cell::new(Scope { group: 0, first: 0, per_element: 0 }) };
}

/// Whose points the next call carries.
#[derive(Clone, Copy, Debug, Default)]
struct Scope {
    group: u64,
    first: u64,
    per_element: u64,
}

/// The current activity of a law.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Doing {
    /// Fixing parameters.
    Create = 1,
    /// Giving initial internal variables.
    Start = 2,
    /// Carrying points over an increment.
    Update = 3,
}

/// Keeps the places in this memory from now on.
pub fn keep_in(memory: &'static SharedMemory, at: usize) {
    let _ = SHARED.set((memory, at));
}

/// A number for a name; 0 where nobody watches.
pub fn name(text: &str) -> u64 {
    let Some((memory, at)) = SHARED.get() else {
        return 0;
    };
    let mut known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(number) = known.iter().position(|name| name == text) {
        return number as u64 + 1;
    }
    if known.len() == NAMES {
        return 0;
    }
    write_text(memory, at + COUNT + 1 + known.len() * NAME, NAME, text);
    known.push(text.to_owned());
    memory.write(at + COUNT, std::iter::once(known.len() as u64));
    known.len() as u64
}

/// Says whose points the next call of this thread carries: points of a group from this one on.
pub fn of_group(group: u64, first: usize, per_element: usize) {
    SCOPE.set(Scope {
        group,
        first: first as u64,
        per_element: per_element as u64,
    });
}

/// Calls a law.
pub fn calling<T>(
    law: u64,
    doing: Doing,
    n_points: usize,
    moment: Moment,
    call: impl FnOnce() -> T,
) -> T {
    let Some((memory, at)) = SHARED.get() else {
        let answer = call();
        end_if_copy(|| {});
        return answer;
    };
    let thread = THREAD.get();
    let thread = if thread == 0 { enter() } else { thread };
    let calls = CALLS.get() + 1;
    CALLS.set(calls);
    let scope = SCOPE.take();
    let place = at + (thread - 1) * WORDS;
    let words = [
        doing as u64,
        law,
        scope.group,
        scope.first,
        scope.per_element,
        n_points as u64,
        u64::from(moment.step) << 32 | u64::from(moment.increment),
        calls,
    ];
    memory.write(place, words.into_iter());
    let answer = call();
    end_if_copy(|| {
        // The first one counts.
        if memory.read(at + COPY, 1).next() == Some(0) {
            memory.write(at + COPY, words.into_iter());
        }
    });
    memory.write(place, std::iter::once(0));
    answer
}

/// A place for this thread.
fn enter() -> usize {
    static LAST: AtomicUsize = AtomicUsize::new(0);
    let number = (LAST.fetch_add(1, Ordering::Relaxed) + 1).min(THREADS);
    THREAD.set(number);
    number
}

/// Remembers which process this is, before a law is called for the first time.
pub fn remember_process() {
    ORIGINAL.get_or_init(|| {
        let word = SharedMemory::gone_in_copies().ok()?;
        word.write(0, std::iter::once(1));
        Some(word)
    });
}

/// A copy of the process that its user has made, and no law, is a separate process.
pub fn goes_on_as_copy() {
    if let Some(Some(word)) = ORIGINAL.get() {
        word.write(0, std::iter::once(1));
    }
}

/// Whether this process is a copy that a law has made.
pub fn is_copy() -> bool {
    let original = ORIGINAL.get().and_then(Option::as_ref);
    original.is_some_and(|word| word.read(0, 1).next() == Some(0))
}

/// A copy of the process must not go on: it would write the results once more.
pub fn end_if_copy(report: impl FnOnce()) {
    if is_copy() {
        report();
        // Nothing that the copy has registered or opened may run or be written at its end.
        let _ =
            rustix::process::kill_process(rustix::process::getpid(), rustix::process::Signal::KILL);
        std::process::abort();
    }
}

/// Writes a text into this many words, cut where they end.
pub fn write_text(memory: &SharedMemory, at: usize, n_words: usize, text: &str) {
    let mut end = text.len().min(8 * (n_words - 1));
    while !text.is_char_boundary(end) {
        end -= 1;
    }
    let bytes = &text.as_bytes()[..end];
    let words = bytes.chunks(8).map(|chunk| {
        let mut word = [0; 8];
        word[..chunk.len()].copy_from_slice(chunk);
        u64::from_le_bytes(word)
    });
    memory.write(at + 1, words);
    memory.write(at, std::iter::once(end as u64));
}

/// The text that [`write_text`] wrote.
pub fn read_text(memory: &SharedMemory, at: usize, n_words: usize) -> String {
    let length = memory.read(at, 1).next().unwrap_or(0);
    let length = (length as usize).min(8 * (n_words - 1));
    let words = memory.read(at + 1, length.div_ceil(8));
    let mut bytes: Vec<u8> = words.flat_map(u64::to_le_bytes).collect();
    bytes.truncate(length);
    String::from_utf8_lossy(&bytes).into_owned()
}

/// A call that was under way, as whoever watches sees it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Seen {
    doing: u64,
    law: String,
    group: String,
    first: u64,
    per_element: u64,
    n_points: u64,
    /// Phase or segment, and its increment.
    pub moment: u64,
    calls: u64,
}

impl std::fmt::Display for Seen {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mut text = self.law.clone();
        if !self.group.is_empty() {
            let per_element = self.per_element.max(1);
            let first = self.first / per_element + 1;
            let last = (self.first + self.n_points.max(1) - 1) / per_element + 1;
            write!(text, ", {}", self.group)?;
            if first == last {
                write!(text, ", element {first}")?;
            } else {
                write!(text, ", elements {first} to {last}")?;
            }
        }
        match self.doing {
            1 => text += ", as its parameters were given to it",
            2 => text += ", as it gave its initial state",
            _ => {
                let (step, increment) = (self.moment >> 32, self.moment & 0xFFFF_FFFF);
                write!(text, ", phase or segment {step}, increment {increment}")?;
            }
        }
        f.write_str(&text)
    }
}

/// What whoever watches sees in the memory.
#[derive(Debug)]
pub struct Watched<'a>(pub &'a SharedMemory, pub usize);

impl Watched<'_> {
    /// Calls under way.
    pub fn calls(&self) -> Vec<Seen> {
        (0..THREADS).filter_map(|t| self.at(t * WORDS)).collect()
    }

    /// The call from which a copy of the process came back.
    pub fn copy(&self) -> Option<Seen> {
        self.at(COPY)
    }

    /// Forgets all of it.
    pub fn clear(&self) {
        self.0.write(self.1, std::iter::repeat_n(0, SIZE));
    }

    /// The latest phase and increment in which a law was called.
    pub fn moment(&self) -> u64 {
        let of_thread = |t: usize| self.0.read(self.1 + t * WORDS + 6, 1).next();
        (0..THREADS).filter_map(of_thread).max().unwrap_or(0)
    }

    fn at(&self, place: usize) -> Option<Seen> {
        let words: Vec<u64> = self.0.read(self.1 + place, WORDS).collect();
        let [
            doing,
            law,
            group,
            first,
            per_element,
            n_points,
            moment,
            calls,
        ] = words[..]
        else {
            return None;
        };
        (doing != 0).then(|| Seen {
            doing,
            law: self.name(law),
            group: self.name(group),
            first,
            per_element,
            n_points,
            moment,
            calls,
        })
    }

    fn name(&self, number: u64) -> String {
        let Some(number) = number.checked_sub(1).filter(|n| *n < NAMES as u64) else {
            return String::new();
        };
        let at = self.1 + COUNT + 1 + number as usize * NAME;
        read_text(self.0, at, NAME)
    }
}
