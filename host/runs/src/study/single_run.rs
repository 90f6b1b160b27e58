//! One run of a study, in a separate process.

use super::{Plan, folder_of_run, is_wanted, other_file, other_run};
use crate::run::{Observer, Options, Ready, ready};
use crate::{Error, ending, supervision, trade_off};
use input::{Case, Kind};
use law::Stop;
use mechanics::equilibrium::Reuse;
use results::study::{
    Held, Record, Standing, State, end_run, forget_run, identity_of_run, is_study, standing,
    take_table,
};
use results::{checkpoint, report};
use std::io::Read as _;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Tells a process that carries out one run the process that carries out the study.
pub(super) const COORDINATOR: &str = "PILUM_STUDY";

/// How long the table may be held by another process before a run leaves its row to that.
const TABLE_PATIENCE: Duration = Duration::from_secs(2);

/// Has this process end with the one that carries out the study, if that has started it.
pub fn follow() {
    #[cfg(target_os = "linux")]
    {
        use rustix::process::{Signal, getppid, set_parent_process_death_signal};
        let coordinator: Option<i32> = std::env::var(COORDINATOR)
            .ok()
            .and_then(|pid| pid.parse().ok());
        let parent = || getppid().map(|pid| pid.as_raw_nonzero().get());
        if coordinator.is_some() && parent() == coordinator {
            // Without it, the run goes on to its end and is found done.
            let _ = set_parent_process_death_signal(Some(Signal::KILL));
            if parent() != coordinator {
                std::process::exit(130);
            }
        }
    }
}

/// Whether this process was started for one run by one that carries out the study.
fn is_worker() -> bool {
    std::env::var_os(COORDINATOR).is_some()
}

/// Who may want the run to stop: `other`, and the process that carries out the study, by closing the
/// standard input.
pub fn stop_of_worker(other: Stop) -> Stop {
    if !is_worker() {
        return other;
    }
    let closed = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&closed);
    std::thread::spawn(move || {
        let mut byte = [0];
        while std::io::stdin().read(&mut byte).is_ok_and(|n| n > 0) {}
        flag.store(true, Ordering::Relaxed);
    });
    let beat = other.clone();
    Stop::asked_by(
        move || closed.load(Ordering::Relaxed) || other.is_asked(),
        move |took| beat.beat(took),
    )
}

/// How one run is carried out.
#[derive(Clone, Copy, Debug)]
pub struct Once {
    /// Whatever was done of it before is forgotten.
    pub anew: bool,
    /// Time between checkpoints.
    pub checkpoints: Duration,
}

impl Once {
    fn options(&self, plan: &Plan) -> Options {
        Options {
            resume: true,
            checkpoints: Some(self.checkpoints),
            // What is left of a run that is done is in its record.
            ends_without: true,
            reports: plan.study.file.reports,
        }
    }
}

/// Plans the study before its run, unless that is done already or is the work of another process.
fn make_plan(plan: &Plan, index: usize, case: &Case, anew: bool) -> Result<(), Error> {
    if is_worker() || is_planned(plan, case)? {
        return Ok(());
    }
    let record = plan.check()?;
    let _table = wait_for_table(&plan.folder)?;
    // Whoever had it until now may have made the plan.
    if !is_planned(plan, case)? {
        plan.prepare_beside(&record, anew.then_some(index))?;
    }
    Ok(())
}

/// Refuses to go on with a run that was begun as another one, or with files changed since the study was begun.
fn refuse_changed(plan: &Plan, folder: &Path, ready: &Ready<'_>) -> Result<(), Error> {
    let earlier = identity_of_run(folder).filter(|identity| !identity.is_empty());
    if earlier.is_some_and(|earlier| earlier != ready.identity()) {
        return Err(other_run(folder));
    }
    // Since the study was begun, or by another process in this moment.
    match Record::read(&plan.folder)?.changed(ready.files()) {
        Some(name) => Err(other_file(&plan.folder, &name)),
        None => Ok(()),
    }
}

/// Carries out one run, unless it is done already; goes on from where it was stopped. Returns whether there
/// was anything to do.
///
/// # Errors
/// There is no such run; another process carries it out; what the run ended with, which then is in
/// its folder, too.
pub fn run_one(
    plan: &Plan,
    index: usize,
    once: Once,
    observer: &mut dyn Observer,
    say: &mut dyn FnMut(&str),
) -> Result<bool, Error> {
    let case = plan.case(plan.values(index)?)?;
    make_plan(plan, index, &case, once.anew)?;
    let folder = plan.folder.join(folder_of_run(index));
    let Some(mut held) = Held::take(&folder)? else {
        let message = format!("run {index} is being carried out by another process");
        return Err(Error::usage(message));
    };
    if once.anew {
        forget_run(&folder)?;
    }
    let before = match standing(&folder).state {
        // It is this process that has it now.
        State::Running => State::Lost,
        state => state,
    };
    supervision::case_begun(1, &folder);
    if before == State::Planned {
        checkpoint::remove(&folder)?;
        held.begin("")?;
    }
    let mut may_end = before != State::Done;
    let outcome = (|| {
        let studied = trade_off::reach_until(&case, (&folder, true), &observer.stop(), say)?;
        let case = studied.as_ref().unwrap_or(&case);
        let ready = ready(case)?;
        refuse_changed(plan, &folder, &ready)?;
        if !is_wanted(&before, true) {
            return Ok(false);
        }
        held.begin(ready.identity())?;
        may_end = true;
        let mut reuse = Reuse::default();
        reuse.is_last_run = true;
        ready.run(&folder, observer, &mut reuse, once.options(plan))?;
        Ok(true)
    })();
    supervision::end_run();
    // A run that is done stays so where its library is another one now, or its case cannot be read any more.
    if !may_end || matches!(outcome, Ok(false)) {
        return outcome;
    }
    end(plan, index, &mut held, outcome)
}

/// Notes what a run ended with, and writes its report.
fn end(
    plan: &Plan,
    index: usize,
    held: &mut Held,
    outcome: Result<bool, Error>,
) -> Result<bool, Error> {
    let folder = plan.folder.join(folder_of_run(index));
    let standing = standing_after(outcome.as_ref().err());
    held.end(&standing)?;
    if standing.state == State::Done {
        checkpoint::remove(&folder)?;
    }
    if !is_worker() {
        note(plan, index, &standing)?;
    }
    if plan.study.file.reports && folder.join("history.csv").is_file() {
        let folders = [folder];
        let reported = report::write(&folders, &report::default_path(&folders));
        // What became of the run matters more than what became of its report.
        return outcome.and_then(|done| reported.map(|_| done).map_err(Error::from));
    }
    outcome
}

/// The state of a run that has ended so.
fn standing_after(error: Option<&Error>) -> Standing {
    let Some(error) = error else {
        return Standing::plain(State::Done);
    };
    let state = match error.kind() {
        _ if matches!(error, Error::Killed { .. }) => State::Lost,
        Kind::Stopped => State::Interrupted,
        Kind::Input => State::Failed("bad input".to_owned()),
        Kind::Internal => State::Failed("internal error".to_owned()),
        _ => State::Failed(ending(Some(error)).status.clone()),
    };
    let reason = match state {
        State::Interrupted => String::new(),
        _ => one_line(&error.to_string()),
    };
    Standing { state, reason }
}

/// A text on one line: a row of the table is a line, whoever counts them.
pub(super) fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Has the record of the run in this folder say how it ended, where its process could not. Whether there
/// is such a run.
///
/// # Errors
/// The record cannot be written.
pub fn mend(folder: &Path, error: &Error) -> Result<bool, Error> {
    Ok(end_run(folder, &standing_after(Some(error)))?)
}

/// Whether the table of runs is there, of these texts, and of the files that the case names as they are now.
fn is_planned(plan: &Plan, case: &Case) -> Result<bool, Error> {
    if !is_study(&plan.folder) {
        return Ok(false);
    }
    let record = Record::read(&plan.folder)?;
    // What is wrong with a run's case is for its own row.
    let is_other = || ready(case).is_ok_and(|ready| record.changed(ready.files()).is_some());
    Ok(record.texts == plan.texts(case) && !is_other())
}

/// Takes the table of runs, as soon as no other process has it.
fn wait_for_table(folder: &Path) -> Result<std::fs::File, Error> {
    loop {
        if let Some(table) = take_table(folder)? {
            return Ok(table);
        }
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// Notes in the table how far a run has come. The folder reports it, too: a table that another process holds
/// is left to that.
fn note(plan: &Plan, index: usize, standing: &Standing) -> Result<(), Error> {
    let since = Instant::now();
    while since.elapsed() < TABLE_PATIENCE {
        if let Some(_table) = take_table(&plan.folder)? {
            let record = Record::read(&plan.folder)?;
            let mut rows = record.read_table(&plan.folder)?;
            if let Some(row) = rows.iter_mut().find(|row| row.index == index) {
                record.note(&plan.folder, row, standing.clone());
            }
            record.write_table(&plan.folder, &rows)?;
            return Ok(());
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    Ok(())
}
