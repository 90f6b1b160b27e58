//! The watcher's side: it starts the child, passes requests to stop on, and makes of the child's end
//! what it is.

use super::{Page, SIZE, STOPPING, WATCHER, word};
use crate::Error;
use law::calls::Seen;
use law::child::{self, Ending};
use law::{SharedMemory, isolate};
use rustix::process::{
    Pid, Signal, WaitId, WaitIdOptions, WaitOptions, kill_process, set_child_subreaper, wait,
    waitid,
};
use std::ffi::OsString;
use std::io::{self, Write};
use std::os::fd::AsRawFd;
use std::path::Path;
use std::process::Command;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// How long a child may take to answer a request to stop while a law is being called, or before
/// there is anything to stop.
const PATIENCE: Duration = Duration::from_secs(2);
/// How often the watcher looks while it waits for an answer.
const PAUSE: Duration = Duration::from_millis(20);
/// How long what a law has left behind may take to end by itself.
const LEFTOVERS: Duration = Duration::from_secs(2);

/// What the watcher knows.
struct Watch {
    page: Page,
    /// The child, as long as it is not waited for.
    child: Mutex<Option<Pid>>,
    /// The request was made a second time, or the child did not answer.
    is_killed: Mutex<bool>,
}

/// Carries the program out in a child, and says how it ended. `again`: laws may be called once more
/// in processes of their own where one has ended the child; else the outcome stands. `None`: no
/// child can be had here, and the program is to do it all by itself.
///
/// # Errors
/// What the child could not say itself.
pub fn supervise(again: bool, mend: &dyn Fn(&Path, &Error)) -> Option<Result<u8, Error>> {
    let watch = Arc::new(Watch::new().ok()?);
    watch.take_signals().ok()?;
    let ending = match watch.carry_out() {
        Ok(ending) => ending,
        Err(why) => {
            let message = format!("the program cannot start itself: {why}");
            return Some(Err(Error::internal(message)));
        }
    };
    Some(watch.conclude(ending, again, mend))
}

impl Watch {
    fn new() -> io::Result<Self> {
        let file = isolate::memory_file()?;
        file.set_len((SIZE * size_of::<u64>()) as u64)?;
        set_child_subreaper(Some(rustix::process::getpid()))?;
        Ok(Self {
            page: Page(SharedMemory::new(file)?),
            child: Mutex::default(),
            is_killed: Mutex::default(),
        })
    }

    /// Takes the signals that ask the program to stop. Children started from now on are not reached
    /// by them.
    fn take_signals(self: &Arc<Self>) -> io::Result<()> {
        let watch = Arc::clone(self);
        ctrlc::set_handler(move || watch.asked()).map_err(io::Error::other)?;
        // The thread that waits for them was started before.
        child::block_requests()
    }

    /// A request to stop.
    fn asked(self: &Arc<Self>) {
        let stops = self.page.get(word::STOPS) + 1;
        self.page.set(word::STOPS, stops);
        if stops > 1 {
            self.kill();
            return;
        }
        let _ = writeln!(io::stderr(), "{STOPPING}");
        let watch = Arc::clone(self);
        std::thread::spawn(move || watch.wait_for_answer());
    }

    /// Ends the child where it does not answer.
    fn wait_for_answer(&self) {
        let asked = Instant::now();
        let mut still = (Vec::new(), Instant::now());
        while self.has_child() {
            std::thread::sleep(PAUSE);
            let calls = self.page.calls().calls();
            if calls.is_empty() || calls != still.0 {
                still = (calls, Instant::now());
            }
            let is_over = self.page.get(word::ENDED) != 0;
            let has_begun = self.page.get(word::RUNNING) != 0 || self.page.get(word::LONGEST) != 0;
            let longest = Duration::from_micros(self.page.get(word::LONGEST));
            let is_stuck = still.1.elapsed() >= PATIENCE.max(2 * longest);
            // Equations take the time they take; a law, or what comes before the first step, not.
            let is_calling = !still.0.is_empty();
            let may_be_ended = is_over || if is_calling { is_stuck } else { !has_begun };
            if asked.elapsed() >= PATIENCE && may_be_ended {
                self.kill();
                return;
            }
        }
    }

    fn has_child(&self) -> bool {
        let child = self.child.lock().unwrap_or_else(PoisonError::into_inner);
        child.is_some()
    }

    fn kill(&self) {
        let child = self.child.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(child) = *child {
            *self
                .is_killed
                .lock()
                .unwrap_or_else(PoisonError::into_inner) = true;
            let _ = kill_process(child, Signal::KILL);
        }
    }

    /// Starts the child and waits for its end.
    fn carry_out(&self) -> io::Result<Ending> {
        let program = std::env::current_exe().ok().filter(|path| path.is_file());
        let program = program.unwrap_or_else(|| "/proc/self/exe".into());
        let arguments: Vec<OsString> = std::env::args_os().skip(1).collect();
        let descriptor = self.page.0.descriptor()?.as_raw_fd();
        let mut child = Command::new(program)
            .args(arguments)
            .env(WATCHER, format!("{}:{descriptor}", std::process::id()))
            .spawn()?;
        let pid = Pid::from_child(&child);
        let lock = || self.child.lock().unwrap_or_else(PoisonError::into_inner);
        *lock() = Some(pid);
        if self.page.get(word::STOPS) > 1 {
            self.kill();
        }
        // Not reaped yet: its number is nobody else's while it may be killed.
        while waitid(
            WaitId::Pid(pid),
            WaitIdOptions::EXITED | WaitIdOptions::NOWAIT,
        )
        .is_err_and(|why| why == rustix::io::Errno::INTR)
        {}
        *lock() = None;
        let status = child.wait()?;
        end_leftovers();
        Ok(child::ending(status))
    }

    fn conclude(
        &self,
        ending: Ending,
        again: bool,
        mend: &dyn Fn(&Path, &Error),
    ) -> Result<u8, Error> {
        if let Some(copied) = self.page.calls().copy() {
            let error = law::Error::Library {
                message: format!(
                    "{copied}: the law made a copy of the process (fork), which came back from the \
                     call and was ended"
                ),
                hint: Some("what stands in the files was written by one process alone".to_owned()),
            };
            return Err(self.mended(mend, error.into()));
        }
        if let Some(code) = self.ended() {
            return Ok(code);
        }
        let calls = self.page.calls().calls();
        if self.page.get(word::STOPS) > 0 {
            return Err(self.mended(mend, stopped(&calls)));
        }
        let what = match ending {
            Ending::Signal(_) => format!("crashed: {ending}"),
            _ => format!("ended itself: {ending}"),
        };
        let place = places(&calls);
        let is_apart = self.page.get(word::APART) != 0;
        if is_apart && ending != Ending::Signal(9) {
            let message = format!("the program {what}, and no law was in its process");
            return Err(self.mended(mend, Error::internal(message)));
        }
        let trouble = format!("{place}: the process {what}");
        if ending == Ending::Signal(9) {
            return Err(self.mended(mend, Error::Killed { trouble }));
        }
        if !again {
            let hint = "with `--isolate` the law is called in a process of its own, and its point is named";
            let error = law::Error::Library {
                message: trouble,
                hint: Some(hint.to_owned()),
            };
            return Err(self.mended(mend, error.into()));
        }
        let _ = writeln!(
            io::stderr(),
            "{trouble}; once more with laws in processes of their own, to name the point"
        );
        let folder = self.page.folder();
        self.prepare_again(&calls);
        let ending = self.carry_out();
        let code = self.ended();
        if code == Some(3) {
            return Ok(3);
        }
        if self.page.get(word::STOPS) > 0 {
            return match code {
                Some(code) => Ok(code),
                None => Err(self.mended(mend, stopped(&self.page.calls().calls()))),
            };
        }
        if code.is_none() && calls.is_empty() {
            let message = format!("the program {what}, twice, and no law was being called");
            return Err(self.mended(mend, Error::internal(message)));
        }
        let since = match (code, ending) {
            (Some(_), _) => "it did not do so in a process of its own".to_owned(),
            (None, Ok(ending)) => format!("the second attempt ended, too: {ending}"),
            (None, Err(why)) => format!("there was no second attempt: {why}"),
        };
        let error = Error::from(law::Error::Library {
            message: format!("{trouble}\n  {since}"),
            hint: Some(
                "all rows in equilibrium are written; `--isolate`, with `--resume` for a run, goes \
                 on with laws in processes of their own"
                    .to_owned(),
            ),
        });
        // The run that it happened in, not one that came after it.
        if !folder.is_empty() {
            mend(Path::new(&folder), &error);
        }
        Err(error)
    }

    /// The exit code, if the child has said it.
    fn ended(&self) -> Option<u8> {
        let code = self.page.get(word::ENDED).checked_sub(1)?;
        Some(code as u8)
    }

    /// Has the summary of the run under way say how it ended.
    fn mended(&self, mend: &dyn Fn(&Path, &Error), error: Error) -> Error {
        let folder = self.page.folder();
        if !folder.is_empty() {
            mend(Path::new(&folder), &error);
        }
        error
    }

    fn prepare_again(&self, calls: &[Seen]) {
        let page = &self.page;
        let moment = calls.iter().map(|call| call.moment).max().unwrap_or(0);
        let in_run = page.get(word::RUNNING) != 0;
        page.set(word::ENOUGH, if in_run { moment } else { 0 });
        page.set(word::BEGUN, page.get(word::CASES));
        page.set(word::SKIP, page.get(word::HANDED));
        for word in [word::ENDED, word::CASES, word::RUNNING, word::LONGEST] {
            page.set(word, 0);
        }
        page.calls().clear();
        page.set(word::AGAIN, 1);
    }
}

/// What is said of a child that did not stop by itself.
fn stopped(calls: &[Seen]) -> Error {
    Error::StoppedAtOnce {
        during: (!calls.is_empty()).then(|| places(calls)),
    }
}

/// The calls under way in words.
fn places(calls: &[Seen]) -> String {
    if calls.is_empty() {
        return "while no law was being called".to_owned();
    }
    let mut texts: Vec<String> = calls.iter().map(ToString::to_string).collect();
    texts.dedup();
    let more = texts.len().saturating_sub(3);
    texts.truncate(3);
    let mut text = texts.join("; or ");
    if more > 0 {
        text = format!("{text}; or {more} more");
    }
    text
}

/// Ends what the child has left behind: it would hold files open, or go on by itself.
fn end_leftovers() {
    let since = Instant::now();
    loop {
        match wait(WaitOptions::NOHANG) {
            Ok(Some(_)) => continue,
            Ok(None) => {}
            Err(_) => return,
        }
        if since.elapsed() >= LEFTOVERS {
            for pid in children() {
                let _ = kill_process(pid, Signal::KILL);
            }
        }
        if since.elapsed() >= 2 * LEFTOVERS {
            return;
        }
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// Children of this process.
fn children() -> Vec<Pid> {
    let Ok(tasks) = std::fs::read_dir("/proc/self/task") else {
        return Vec::new();
    };
    let of_task = |task: io::Result<std::fs::DirEntry>| {
        std::fs::read_to_string(task.ok()?.path().join("children")).ok()
    };
    let texts: Vec<String> = tasks.filter_map(of_task).collect();
    let words = texts.iter().flat_map(|text| text.split_whitespace());
    words
        .filter_map(|word| Pid::from_raw(word.parse().ok()?))
        .collect()
}
