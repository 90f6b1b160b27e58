//! All runs of a study, this many at a time, each in a separate process.

use super::single_run::{COORDINATOR, one_line};
use super::{Plan, folder_of_run, is_wanted};
use crate::{Error, supervision};
use law::{Stop, Stopped};
use results::report::Running;
use results::study::{Record, Row, Standing, State, standing, take_table};
use std::collections::VecDeque;
use std::ffi::OsString;
use std::io::Read as _;
use std::process::{ChildStdin, Command, Stdio};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// How often the table of runs is written again at most.
const TABLE_EVERY: Duration = Duration::from_secs(1);
/// How often a request to stop is looked for.
const PAUSE: Duration = Duration::from_millis(20);
/// Most bytes of a message that are kept.
const LONGEST_MESSAGE: usize = 2000;

/// How the runs are carried out.
#[derive(Clone, Debug)]
pub struct Jobs {
    /// So many runs at a time.
    pub at_a_time: usize,
    /// Those that failed once more.
    pub retry: bool,
    /// All of them, whatever was done before.
    pub anew: bool,
    /// Arguments of each process besides the run.
    pub arguments: Vec<OsString>,
}

/// How a study goes.
#[derive(Clone, Debug)]
pub enum Event {
    /// There are this many runs in all, this many of which are left to be carried out.
    Planned {
        /// In all.
        of: usize,
        /// Left.
        left: usize,
    },
    /// A run has ended.
    Ended {
        /// Its number.
        index: usize,
        /// How.
        standing: Standing,
    },
}

/// Carries out all runs that are not done. Returns the table of runs; runs that could not come to their end
/// are rows with their reason.
///
/// # Errors
/// As [`Plan::check`] and [`Plan::prepare`]; another process carries out the study; stopped as asked.
pub fn carry_out(
    plan: &Plan,
    jobs: &Jobs,
    stop: &Stop,
    watch: &mut dyn FnMut(&Event),
) -> Result<Vec<Row>, Error> {
    let record = plan.check()?;
    let Some(_table) = take_table(&plan.folder)? else {
        let message = format!(
            "{}: another process carries out this study",
            plan.folder.display()
        );
        return Err(Error::usage(message));
    };
    let mut rows = plan.prepare(&record, jobs.anew)?;
    // From here on a request to stop is answered.
    supervision::case_begun(1, &plan.folder);
    let wanted = rows
        .iter()
        .filter(|row| is_wanted(&row.standing.state, jobs.retry));
    let queue: VecDeque<usize> = wanted.map(|row| row.index).collect();
    watch(&Event::Planned {
        of: rows.len(),
        left: queue.len(),
    });
    let n_workers = jobs.at_a_time.clamp(1, queue.len().max(1));
    let pool = Pool {
        plan,
        jobs,
        queue: Mutex::new(queue),
        inputs: (0..n_workers).map(|_| Mutex::default()).collect(),
    };
    let written = pool.follow(&record, &mut rows, stop, watch);
    supervision::end_run();
    written?;
    record.write_table(&plan.folder, &rows)?;
    if stop.is_asked() {
        let n = rows
            .iter()
            .filter(|row| row.standing.state.is_final())
            .count();
        let doing = format!(
            "{n} of {} runs have come to an end, and the same command goes on with the others",
            rows.len()
        );
        return Err(Stopped { doing }.into());
    }
    Ok(rows)
}

/// What a worker says.
enum Message {
    Begun(usize),
    Ended(usize, Standing),
}

/// What the workers share.
struct Pool<'p> {
    plan: &'p Plan,
    jobs: &'p Jobs,
    /// Runs that nobody has taken yet.
    queue: Mutex<VecDeque<usize>>,
    /// The standard input of each worker's process: closed, it asks that to stop.
    inputs: Vec<Mutex<Option<ChildStdin>>>,
}

impl Pool<'_> {
    /// Has the workers carry out all runs, and keeps `rows` and their table up to date.
    ///
    /// # Errors
    /// The table cannot be written.
    fn follow(
        &self,
        record: &Record,
        rows: &mut [Row],
        stop: &Stop,
        watch: &mut dyn FnMut(&Event),
    ) -> Result<(), text::Error> {
        let folder = &self.plan.folder;
        let (sender, receiver) = channel();
        std::thread::scope(|scope| {
            for worker in 0..self.inputs.len() {
                let sender = sender.clone();
                scope.spawn(move || self.work(worker, &sender));
            }
            drop(sender);
            let mut last = Instant::now();
            let mut report = Running::new(folder);
            let mut written = Ok(());
            loop {
                match receiver.recv_timeout(PAUSE) {
                    Ok(Message::Begun(index)) => {
                        rows[index - 1].standing = Standing::plain(State::Running);
                    }
                    Ok(Message::Ended(index, standing)) => {
                        let ended = Event::Ended {
                            index,
                            standing: standing.clone(),
                        };
                        record.note(folder, &mut rows[index - 1], standing);
                        watch(&ended);
                    }
                    Err(RecvTimeoutError::Timeout) => {}
                    Err(RecvTimeoutError::Disconnected) => break,
                }
                if stop.is_asked() || written.is_err() {
                    self.stop();
                }
                if last.elapsed() >= TABLE_EVERY && written.is_ok() {
                    written = record.write_table(folder, rows);
                    // What cannot be shown now is said by the report at the end.
                    let _ = report.write_if_due();
                    last = Instant::now();
                }
            }
            written
        })
    }

    /// Takes run after run. The thread that starts a process has to outlive it: the process ends with it.
    fn work(&self, worker: usize, sender: &Sender<Message>) {
        while let Some(index) = self.next() {
            let _ = sender.send(Message::Begun(index));
            let standing = self.run(worker, index);
            let _ = sender.send(Message::Ended(index, standing));
        }
    }

    fn next(&self) -> Option<usize> {
        let mut queue = self.queue.lock().unwrap_or_else(PoisonError::into_inner);
        queue.pop_front()
    }

    /// Asks all processes to stop, and starts no more.
    fn stop(&self) {
        self.queue
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .clear();
        for input in &self.inputs {
            *input.lock().unwrap_or_else(PoisonError::into_inner) = None;
        }
    }

    fn run(&self, worker: usize, index: usize) -> Standing {
        let (ending, message) = match self.process(worker, index) {
            Ok(ended) => ended,
            Err(why) => {
                let state = State::Lost;
                let reason = format!("the program cannot start itself: {why}");
                return Standing { state, reason };
            }
        };
        let found = standing(&self.plan.folder.join(folder_of_run(index)));
        if found.state.is_final() || found.state == State::Interrupted {
            return found;
        }
        let reason = match message.as_str() {
            "" => format!("the process was ended: {ending}"),
            said => format!("the process was ended: {ending}: {said}"),
        };
        Standing {
            state: State::Lost,
            reason,
        }
    }

    /// Carries out a run in a process. Returns how that ended, and what it said.
    fn process(&self, worker: usize, index: usize) -> std::io::Result<(String, String)> {
        let program = std::env::current_exe().ok().filter(|path| path.is_file());
        let program = program.unwrap_or_else(|| "/proc/self/exe".into());
        let mut child = Command::new(program)
            .arg("study")
            .arg(self.plan.study.source.path())
            .args(["--run", &index.to_string()])
            .arg("--out")
            .arg(&self.plan.folder)
            .args(&self.jobs.arguments)
            .env(COORDINATOR, std::process::id().to_string())
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()?;
        let lock = || {
            self.inputs[worker]
                .lock()
                .unwrap_or_else(PoisonError::into_inner)
        };
        *lock() = child.stdin.take();
        // All is read: a process whose messages nobody takes would wait for ever.
        let mut said = Vec::new();
        if let Some(mut messages) = child.stderr.take() {
            messages.read_to_end(&mut said)?;
        }
        let status = child.wait()?;
        *lock() = None;
        let said = String::from_utf8_lossy(&said);
        let said = said.trim();
        let from = said.len().saturating_sub(LONGEST_MESSAGE);
        let from = (from..=said.len())
            .find(|&at| said.is_char_boundary(at))
            .unwrap_or(0);
        Ok((status.to_string(), one_line(&said[from..])))
    }
}
