//! The child's side: it says where it is and how it ends, and looks whether it is to stop.

use super::page::{CALLS, FOLDER, FOLDER_WORDS, Page, word};
use law::Stop;
use law::current_call;
use rustix::process::{Pid, Signal, getppid, set_parent_process_death_signal};
use std::io::{self, Write};
use std::path::Path;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

static PAGE: OnceLock<Page> = OnceLock::new();
/// Bytes of the standard output that were handed out the first time.
static SKIP: AtomicU64 = AtomicU64::new(0);

/// This process is the child of the watcher with this number, shares this memory with it, and dies with it.
///
/// # Errors
/// The system's; the watcher is gone.
pub(super) fn begin(page: Page, watcher: Pid) -> io::Result<()> {
    set_parent_process_death_signal(Some(Signal::KILL))?;
    if getppid() != Some(watcher) {
        return Err(io::Error::other("the watching process is gone"));
    }
    let page = PAGE.get_or_init(|| page);
    current_call::keep_in(&page.0, CALLS);
    current_call::remember_process();
    SKIP.store(page.get(word::SKIP), Ordering::Relaxed);
    Ok(())
}

/// Says how the process ends: the last thing it does.
pub fn end(code: u8) {
    current_call::end_if_copy(|| {});
    let Some(page) = PAGE.get() else { return };
    let _ = io::stdout().flush();
    page.set(word::ENDED, u64::from(code) + 1);
}

/// Whether laws are called in separate processes to find out which one ended the process.
pub fn is_again() -> bool {
    PAGE.get().is_some_and(|page| page.get(word::AGAIN) != 0)
}

/// Says whether laws are in separate processes, whatever comes.
pub fn begin_run(apart: bool) {
    if let Some(page) = PAGE.get() {
        page.set(word::APART, u64::from(apart));
    }
}

/// Says that the results of this case, one of several, have begun in this folder.
pub fn case_begun(number: usize, folder: &Path) {
    if let Some(page) = PAGE.get() {
        let folder = std::path::absolute(folder).unwrap_or_else(|_| folder.to_owned());
        let text = folder.to_string_lossy();
        current_call::write_text(&page.0, FOLDER, FOLDER_WORDS, &text);
        page.set(word::CASES, number as u64);
        page.set(word::RUNNING, 1);
    }
}

/// Says that the phases of the present case are over.
pub fn end_run() {
    if let Some(page) = PAGE.get() {
        page.set(word::RUNNING, 0);
    }
}

/// Whether the results of this case had begun when the process was ended.
pub fn was_begun(number: usize) -> bool {
    PAGE.get()
        .is_some_and(|page| page.get(word::AGAIN) != 0 && number as u64 <= page.get(word::BEGUN))
}

/// The watcher's request to stop; `None` if nobody watches.
pub fn stop() -> Option<Stop> {
    PAGE.get()?;
    let asked = || {
        let Some(page) = PAGE.get() else { return false };
        // A copy that a law has made came back: what follows is not to be trusted.
        page.get(word::STOPS) != 0 || page.calls().copy().is_some() || has_enough(page)
    };
    let beat = |took: Duration| {
        if let Some(page) = PAGE.get() {
            let took = took.as_micros() as u64;
            if took > page.get(word::LONGEST) {
                page.set(word::LONGEST, took);
            }
        }
    };
    Some(Stop::asked_by(asked, beat))
}

/// Whether the place where the process was ended lies behind.
fn has_enough(page: &Page) -> bool {
    let enough = page.get(word::ENOUGH);
    enough != 0
        && page.get(word::RUNNING) != 0
        && page.get(word::CASES) == page.get(word::BEGUN)
        && page.calls().moment() > enough
}

/// The standard output, which a second attempt goes on with where the first one left it.
#[derive(Debug, Default)]
pub struct Handed(());

/// The standard output.
pub fn stdout() -> Handed {
    Handed(())
}

impl Write for Handed {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let skipped = SKIP.load(Ordering::Relaxed).min(bytes.len() as u64);
        if skipped > 0 {
            SKIP.fetch_sub(skipped, Ordering::Relaxed);
            return Ok(skipped as usize);
        }
        law::process_state::restore().map_err(io::Error::other)?;
        // No line is kept back: a law may end the process at any time.
        let mut out = io::stdout().lock();
        let n = out.write(bytes)?;
        out.flush()?;
        if let Some(page) = PAGE.get() {
            page.set(word::HANDED, page.get(word::HANDED) + n as u64);
        }
        Ok(n)
    }

    fn flush(&mut self) -> io::Result<()> {
        io::stdout().flush()
    }
}
