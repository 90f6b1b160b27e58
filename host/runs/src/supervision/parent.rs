//! The watcher's side: it starts the child, passes requests to stop on, and makes of the child's end
//! what it is.

use super::page::{Page, SIZE, word};
use super::signals::Signals;
use super::{STOPPING, child};
use crate::Error;
use law::child::{Ending, can_be_copied, copy, ending};
use law::current_call::Seen;
use law::{SharedMemory, isolate};
use rustix::process::{
    Pid, Signal, WaitOptions, getpid, kill_process, set_child_subreaper, wait, waitpid,
};
use std::io::{self, Write};
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::ExitStatus;
use std::time::{Duration, Instant};

/// How long a child may take to answer a request to stop while a law is being called, or before
/// there is anything to stop.
const PATIENCE: Duration = Duration::from_secs(2);
/// How often the watcher looks while it waits for an answer.
const PAUSE: Duration = Duration::from_millis(20);
/// How long what a law has left behind may take to end by itself.
const LEFTOVERS: Duration = Duration::from_secs(2);
/// Warning if no process is watched.
const UNWATCHED: &str = "the program has threads already, as by a library that was preloaded, so a law that ends the \
     process ends the program, too, and is not named";

/// What the watcher knows.
struct Watch {
    /// The watcher's own number.
    process: Pid,
    page: Page,
    signals: Signals,
}

/// Outcome of a child's end.
enum Verdict {
    Stands(Result<u8, Error>),
    /// A law has ended it, which is worth a second look.
    Again(Trouble),
}

/// How the first child ended.
struct Trouble {
    what: String,
    /// With the place.
    text: String,
    calls: Vec<Seen>,
    folder: String,
}

/// Has a child carry the program out, and says how it ended. `again`: laws may be called once more in
/// separate processes where one has ended the child; else the outcome stands. `None`: this process is
/// to carry it out, as the child, or because none can be had here.
pub fn supervise(again: bool, mend: &dyn Fn(&Path, &Error)) -> Option<Result<u8, Error>> {
    if !can_be_copied() {
        let _ = writeln!(io::stderr(), "warning: {UNWATCHED}");
        return None;
    }
    let watch = Watch::new().ok()?;
    let first = match watch.carry_out() {
        Ok(Some(ending)) => ending,
        Ok(None) => return watch.become_child(),
        Err(why) => {
            let message = format!("the program cannot start itself: {why}");
            return Some(Err(Error::internal(message)));
        }
    };
    let trouble = match watch.judge(first, again, mend) {
        Verdict::Stands(outcome) => return Some(outcome),
        Verdict::Again(trouble) => trouble,
    };
    watch.prepare_again(&trouble.calls);
    let second = match watch.carry_out() {
        Ok(None) => return watch.become_child(),
        Ok(Some(ending)) => format!("the second attempt ended, too: {ending}"),
        Err(why) => format!("there was no second attempt: {why}"),
    };
    Some(watch.judge_again(&trouble, &second, mend))
}

impl Watch {
    fn new() -> io::Result<Self> {
        let file = isolate::memory_file()?;
        file.set_len((SIZE * size_of::<u64>()) as u64)?;
        let process = getpid();
        set_child_subreaper(Some(process))?;
        Ok(Self {
            process,
            page: Page(SharedMemory::new(file)?),
            // Last: who cannot watch leaves them as they are.
            signals: Signals::keep()?,
        })
    }

    /// Has a copy of this process carry the program out, and waits for its end. `None`: this is the copy.
    fn carry_out(&self) -> io::Result<Option<Ending>> {
        let Some(child) = copy()? else {
            return Ok(None);
        };
        let mut request: Option<Request> = None;
        loop {
            let stops = self.page.get(word::STOPS);
            if stops > 0 {
                let request = request.get_or_insert_with(Request::new);
                if stops > 1 || request.is_unanswered(&self.page) {
                    // Not waited for yet: its number is nobody else's.
                    let _ = kill_process(child, Signal::KILL);
                }
            }
            let pause = request.is_some().then_some(PAUSE);
            if self.signals.next_is_request(pause)? {
                self.page.set(word::STOPS, stops + 1);
                if stops == 0 {
                    let _ = writeln!(io::stderr(), "{STOPPING}");
                }
            }
            if let Some((_, status)) = waitpid(Some(child), WaitOptions::NOHANG)? {
                end_leftovers();
                return Ok(Some(ending(ExitStatus::from_raw(status.as_raw()))));
            }
        }
    }

    /// This process is the copy that carries the program out; an outcome only if it cannot.
    fn become_child(self) -> Option<Result<u8, Error>> {
        let begun = child::begin(self.page, self.process);
        let why = begun.and_then(|()| self.signals.leave_to_watcher()).err()?;
        let message = format!("the program cannot be watched: {why}");
        Some(Err(Error::internal(message)))
    }

    fn judge(&self, ending: Ending, again: bool, mend: &dyn Fn(&Path, &Error)) -> Verdict {
        if let Some(copied) = self.page.calls().copy() {
            let error = law::Error::Library {
                message: format!(
                    "{copied}: the law made a copy of the process (fork), which came back from the \
                     call and was ended"
                ),
                hint: Some("what stands in the files was written by one process alone".to_owned()),
            };
            return self.stands(mend, error.into());
        }
        if let Some(code) = self.ended() {
            return Verdict::Stands(Ok(code));
        }
        let calls = self.page.calls().calls();
        if self.page.get(word::STOPS) > 0 {
            return self.stands(mend, stopped(&calls));
        }
        let what = match ending {
            Ending::Signal(_) => format!("crashed: {ending}"),
            _ => format!("ended itself: {ending}"),
        };
        let is_apart = self.page.get(word::APART) != 0;
        if is_apart && ending != Ending::Signal(9) {
            let message = format!("the program {what}, and no law was in its process");
            return self.stands(mend, Error::internal(message));
        }
        let trouble = format!("{}: the process {what}", places(&calls));
        if ending == Ending::Signal(9) {
            return self.stands(mend, Error::Killed { trouble });
        }
        if !again {
            let hint = "with `--isolate` the law is called in a process of its own, and its point is named";
            let error = law::Error::Library {
                message: trouble,
                hint: Some(hint.to_owned()),
            };
            return self.stands(mend, error.into());
        }
        let _ = writeln!(
            io::stderr(),
            "{trouble}; once more with laws in processes of their own, to name the point"
        );
        Verdict::Again(Trouble {
            what,
            text: trouble,
            calls,
            folder: self.page.folder(),
        })
    }

    fn judge_again(
        &self,
        first: &Trouble,
        second: &str,
        mend: &dyn Fn(&Path, &Error),
    ) -> Result<u8, Error> {
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
        if code.is_none() && first.calls.is_empty() {
            let what = &first.what;
            let message = format!("the program {what}, twice, and no law was being called");
            return Err(self.mended(mend, Error::internal(message)));
        }
        let since = match code {
            Some(_) => "it did not do so in a process of its own",
            None => second,
        };
        let error = Error::from(law::Error::Library {
            message: format!("{}\n  {since}", first.text),
            hint: Some(
                "all rows in equilibrium are written; `--isolate`, with `--resume` for a run, goes \
                 on with laws in processes of their own"
                    .to_owned(),
            ),
        });
        // The run that it happened in, not one that came after it.
        if !first.folder.is_empty() {
            mend(Path::new(&first.folder), &error);
        }
        Err(error)
    }

    fn stands(&self, mend: &dyn Fn(&Path, &Error), error: Error) -> Verdict {
        Verdict::Stands(Err(self.mended(mend, error)))
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

/// A request to stop that the child has not answered yet.
struct Request {
    since: Instant,
    /// The calls under way, and since when they are the same.
    still: (Vec<Seen>, Instant),
}

impl Request {
    fn new() -> Self {
        Self {
            since: Instant::now(),
            still: (Vec::new(), Instant::now()),
        }
    }

    /// Whether the child has had its time.
    fn is_unanswered(&mut self, page: &Page) -> bool {
        let calls = page.calls().calls();
        let is_calling = !calls.is_empty();
        if !is_calling || calls != self.still.0 {
            self.still = (calls, Instant::now());
        }
        let is_over = page.get(word::ENDED) != 0;
        let has_begun = page.get(word::RUNNING) != 0 || page.get(word::LONGEST) != 0;
        let longest = Duration::from_micros(page.get(word::LONGEST));
        let is_stuck = self.still.1.elapsed() >= PATIENCE.max(2 * longest);
        // Equations take the time they take; a law, or what comes before the first step, not.
        let may_be_ended = is_over || if is_calling { is_stuck } else { !has_begun };
        self.since.elapsed() >= PATIENCE && may_be_ended
    }
}

/// Message about a child that did not stop by itself.
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
