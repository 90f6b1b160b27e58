//! Handling of exhausted memory: a message that says how much is needed, a summary that reports it
//! too, and exit code 1. Rows that were written stay.
//!
//! An allocation that fails cannot be reported by the code that asked for it: it has no other way
//! on. So the program's allocator says what there is to say, in memory that was set aside, and ends the
//! process. Large pieces of work announce the memory they need.

use crate::Error;
use rustix::io::Errno;
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::{Cell, UnsafeCell};
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::time::Duration;

/// Bytes set aside for the last words: a summary is read and written again in them.
const RESERVE: usize = 4 << 20;
/// Bytes of the largest piece that is kept once it is given back: what glibc keeps at most, with its own.
const LARGEST_KEPT: usize = (32 << 20) - (1 << 16);
/// Exit code: the limit is the user's to raise.
const CODE: u8 = 1;

/// Memory for the thread that says the last words, and for no other.
static HELD: Reserve = Reserve {
    bytes: UnsafeCell::new([0; RESERVE]),
    used: AtomicUsize::new(0),
};
/// Bytes that what goes on was expected to take in all.
static EXPECTED: AtomicU64 = AtomicU64::new(0);
/// What was announced with it.
static DOING: Mutex<&str> = Mutex::new("");
/// Folder of the results that are being written.
static RESULTS: Mutex<Option<PathBuf>> = Mutex::new(None);
/// A thread is saying the last words.
static ENDS: AtomicBool = AtomicBool::new(false);

thread_local! {
    /// This one is.
    static IS_LAST: Cell<bool> = const { Cell::new(false) };
}

/// The program's allocator: the system's, with an end that is reported.
#[derive(Debug)]
pub struct Allocator;

/// Memory that is given out once, from its beginning to its end.
struct Reserve {
    bytes: UnsafeCell<[u8; RESERVE]>,
    used: AtomicUsize,
}

// SAFETY: `used` grows in one step, so that no byte is given out twice.
unsafe impl Sync for Reserve {}

impl Reserve {
    /// A piece of it. The process ends if it is used up.
    fn give(&self, layout: Layout) -> *mut u8 {
        let start = self.bytes.get().cast::<u8>();
        // What the alignment may cost is part of the piece.
        let size = layout.size().saturating_add(layout.align());
        let used = self.used.fetch_add(size, Ordering::Relaxed);
        if used.saturating_add(size) > RESERVE {
            exit();
        }
        let piece = start.wrapping_add(used);
        piece.wrapping_add(piece.align_offset(layout.align()))
    }

    fn has(&self, pointer: *mut u8) -> bool {
        let start = self.bytes.get() as usize;
        (start..start + RESERVE).contains(&(pointer as usize))
    }
}

/// What was found, or the end of the process.
fn checked(found: *mut u8, size: usize) -> *mut u8 {
    if found.is_null() {
        end(size);
    }
    found
}

// SAFETY: everything is the system's allocator's, with the same arguments, but for the thread that says the last
// words: its pieces come from the reserve, are no one else's, and stay to the end. What is added neither unwinds nor
// returns.
unsafe impl GlobalAlloc for Allocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        if IS_LAST.get() {
            return HELD.give(layout);
        }
        // SAFETY: as the caller promises.
        checked(unsafe { System.alloc(layout) }, layout.size())
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        if !HELD.has(pointer) {
            // SAFETY: as the caller promises.
            unsafe { System.dealloc(pointer, layout) }
        }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        if IS_LAST.get() {
            // The reserve is zero until it is given out.
            return HELD.give(layout);
        }
        // SAFETY: as the caller promises.
        checked(unsafe { System.alloc_zeroed(layout) }, layout.size())
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        if IS_LAST.get() {
            let Ok(larger) = Layout::from_size_align(size, layout.align()) else {
                return std::ptr::null_mut();
            };
            let piece = HELD.give(larger);
            // SAFETY: both have as many bytes, and the new piece is apart from all others.
            unsafe { piece.copy_from_nonoverlapping(pointer, layout.size().min(size)) };
            return piece;
        }
        // SAFETY: as the caller promises; what could not be had has left the piece as it was.
        checked(unsafe { System.realloc(pointer, layout, size) }, size)
    }
}

/// Lets the system's allocator keep large freed pieces for the next ones: the kernel gives new memory page by
/// page. The allocator of glibc keeps pieces no larger than the largest one ever freed, up to 32 MB
/// (`mallopt(3)`, `M_MMAP_THRESHOLD`). Other allocators are unaffected.
pub fn keep_freed() {
    let Ok(layout) = Layout::array::<u8>(LARGEST_KEPT) else {
        return;
    };
    // SAFETY: the layout is not empty.
    let piece = std::hint::black_box(unsafe { System.alloc(layout) });
    if !piece.is_null() {
        // SAFETY: what is given back is what was given, with the same layout; nobody else has seen it.
        unsafe { System.dealloc(piece, layout) };
    }
}

/// Announces what comes next, and how many bytes it takes in addition to those in use.
pub(crate) fn expect(bytes: u64, what: &'static str) {
    EXPECTED.store(in_use().unwrap_or(0) + bytes, Ordering::Relaxed);
    if let Ok(mut doing) = DOING.lock() {
        *doing = what;
    }
}

/// Results are being written into a folder, or no longer.
pub(crate) fn writes(folder: Option<&Path>) {
    if let Ok(mut results) = RESULTS.lock() {
        *results = folder.map(Path::to_owned);
    }
}

/// Says that a thread, or whatever else is not simply memory, could not be had.
pub fn cannot_start(what: &str, why: &impl std::fmt::Display) -> String {
    format!("{} to start {what}: {why}", shortage(0))
}

/// Bytes of address space in use.
fn in_use() -> Option<u64> {
    // At once: read bit by bit, as what has no length, it would take the system some times as long.
    let mut status = [0; 4096];
    let n = File::open("/proc/self/status")
        .and_then(|mut file| file.read(&mut status))
        .ok()?;
    let size = str::from_utf8(&status[..n])
        .ok()?
        .lines()
        .find_map(|line| line.strip_prefix("VmSize:"))?;
    let kilobytes: u64 = size.split_ascii_whitespace().next()?.parse().ok()?;
    Some(kilobytes << 10)
}

/// How much is needed: what was expected, or at least what is in use and what could not be had.
fn shortage(size: u64) -> String {
    let megabytes = |bytes: u64| bytes.div_ceil(1_000_000);
    let least = in_use().unwrap_or(0) + size;
    let expected = EXPECTED.load(Ordering::Relaxed);
    let needed = if expected > least {
        format!("about {} MB needed", megabytes(expected))
    } else {
        format!("about {} MB needed, or more", megabytes(least))
    };
    let doing = DOING.try_lock().map_or("", |doing| *doing);
    let last = if doing.is_empty() {
        String::new()
    } else {
        format!("; the last large piece of work was {doing}")
    };
    format!("not enough memory: {needed}{last}")
}

/// The last words of the process.
#[cold]
fn end(size: usize) {
    if ENDS.swap(true, Ordering::SeqCst) {
        // Another thread ends the process, unless it waits for what this one holds.
        std::thread::sleep(Duration::from_secs(10));
        std::process::abort();
    }
    IS_LAST.set(true);
    let message = shortage(size as u64);
    let text = format!(
        "error: {message}\n  |\n  = help: raise the limit of memory, or take a coarser mesh; rows that were written are whole\n"
    );
    // Another thread may hold the lock of the error stream, and wait for memory.
    let mut rest = text.as_bytes();
    while !rest.is_empty() {
        match rustix::io::write(rustix::stdio::stderr(), rest) {
            Ok(n) if n > 0 => rest = &rest[n..],
            Err(Errno::INTR) => (),
            _ => break,
        }
    }
    if let Ok(results) = RESULTS.try_lock()
        && let Some(folder) = &*results
    {
        let _ = results::end_summary(folder, &crate::ending(Some(&Error::usage(message))));
    }
    exit();
}

/// Ends the process; who watches it knows that no law has.
fn exit() -> ! {
    crate::supervision::end(CODE);
    std::process::exit(CODE.into());
}
