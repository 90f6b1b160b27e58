//! `pilum study`: many runs of one case, or one of them.

use super::cases::write_report;
use super::stop_on_signals;
use crate::arguments::Study;
use crate::output::{print, say};
use crate::threads;
use indicatif::{ProgressBar, ProgressStyle};
use input::Error;
use law::{Opener, Stop};
use results::study::{Row, State};
use runs::run::Observer;
use runs::study::{Event, Jobs, Once, Plan, carry_out, run_one, stop_of_worker};
use std::collections::BTreeMap;
use std::io::IsTerminal as _;
use std::path::PathBuf;
use std::time::Duration;

pub(super) fn study(asked: &Study, opener: &Opener) -> Result<(), Error> {
    threads::gather(Some(asked.threads.unwrap_or(1)))?;
    threads::begin()?;
    let stop = stop_on_signals()?;
    let plan = Plan::of(&asked.file, asked.out.as_deref(), opener)?;
    if let Some(index) = asked.run {
        return one(&plan, index, asked, stop);
    }
    say_warnings(&plan);
    if asked.plan {
        return plan_alone(&plan, asked.anew);
    }
    let jobs = Jobs {
        at_a_time: asked.jobs.map_or_else(processors, usize::from),
        retry: asked.retry,
        anew: asked.anew,
        arguments: arguments(opener, asked),
    };
    all(&plan, &jobs, &stop)
}

/// Checks everything and writes the table of runs.
fn plan_alone(plan: &Plan, anew: bool) -> Result<(), Error> {
    let record = plan.check()?;
    let Some(_table) = results::study::take_table(plan.folder())? else {
        let message = format!(
            "{}: another process carries out this study",
            plan.folder().display()
        );
        return Err(Error::usage(message));
    };
    plan.prepare(&record, anew)?;
    let table = plan.folder().join(results::study::TABLE);
    print(&format!(
        "{} runs\ntable in {}\n",
        plan.n_runs(),
        table.display()
    ))
}

fn say_warnings(plan: &Plan) {
    for warning in plan.warnings() {
        say!("warning: {warning}");
    }
}

fn processors() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// Arguments of the process of each run.
fn arguments(opener: &Opener, asked: &Study) -> Vec<std::ffi::OsString> {
    let trust = opener.trust();
    let mut arguments = vec![format!("--checkpoint={}", asked.checkpoint)];
    arguments.extend(asked.threads.map(|n| format!("--threads={n}")));
    if !trust.probe {
        arguments.push("--no-probe".to_owned());
    }
    let isolate = trust.isolate.map(|limit| limit.as_secs_f64());
    arguments.extend(isolate.map(|limit| format!("--isolate={limit}")));
    arguments.into_iter().map(Into::into).collect()
}

/// One run among many reports only warnings.
struct Quiet(Stop);

impl Observer for Quiet {
    fn warning(&mut self, message: &str) {
        say!("warning: {message}");
    }

    fn stop(&self) -> Stop {
        self.0.clone()
    }
}

fn one(plan: &Plan, index: usize, asked: &Study, stop: Stop) -> Result<(), Error> {
    let mut quiet = Quiet(stop_of_worker(stop));
    let once = Once {
        anew: asked.anew,
        checkpoints: Duration::from_secs_f64(asked.checkpoint),
    };
    let run = run_one(plan, index, once, &mut quiet, &mut |_| {})?;
    let what = if run { "done" } else { "done already" };
    print(&format!("run {index}: {what}\n"))
}

fn all(plan: &Plan, jobs: &Jobs, stop: &Stop) -> Result<(), Error> {
    let mut shown = Shown::default();
    let rows = carry_out(plan, jobs, stop, &mut |event| shown.event(event));
    shown.finish();
    let rows = rows?;
    print(&counts(&rows))?;
    let folder = plan.folder();
    print(&format!(
        "table in {}\n",
        folder.join(results::study::TABLE).display()
    ))?;
    write_report(&[PathBuf::from(folder)], None, false)?;
    let unfinished = rows.iter().filter(|row| !row.standing.state.is_final());
    match unfinished.count() {
        0 => Ok(()),
        n => Err(Error::usage(format!(
            "{n} of {} runs have no outcome, see the reasons in the table; the same command goes on with them",
            rows.len()
        ))),
    }
}

/// How many runs came to what.
fn counts(rows: &[Row]) -> String {
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    for row in rows {
        *counts.entry(row.standing.state.word()).or_default() += 1;
    }
    let done = counts.remove(State::Done.word()).unwrap_or(0);
    let others = counts.iter().map(|(word, n)| format!(", {n} {word}"));
    format!(
        "{} runs: {done} done{}\n",
        rows.len(),
        others.collect::<String>()
    )
}

/// A bar on a terminal, plain lines elsewhere.
#[derive(Default)]
struct Shown {
    bar: Option<ProgressBar>,
    of: usize,
    ended: usize,
}

impl Shown {
    fn event(&mut self, event: &Event) {
        match event {
            Event::Planned { of, left } => {
                self.of = *of;
                self.ended = of - left;
                if self.ended > 0 {
                    say!("{of} runs, {} of them done already", self.ended);
                } else {
                    say!("{of} runs");
                }
                if std::io::stderr().is_terminal() {
                    let bar = ProgressBar::new(*of as u64).with_position(self.ended as u64);
                    if let Ok(style) =
                        ProgressStyle::with_template("{bar:32} {pos}/{len}  {msg}  {eta} left")
                    {
                        bar.set_style(style);
                    }
                    bar.reset_eta();
                    bar.tick();
                    self.bar = Some(bar);
                }
            }
            Event::Ended { index, standing } => {
                self.ended += 1;
                let word = standing.state.word();
                let why = standing.reason.lines().next().unwrap_or_default();
                let line = match why {
                    "" => format!("run {index}: {word}"),
                    why => format!("run {index}: {word}: {why}"),
                };
                match &self.bar {
                    Some(bar) => {
                        bar.inc(1);
                        if standing.state != State::Done {
                            bar.println(line);
                        }
                    }
                    None => say!("{line} ({} of {})", self.ended, self.of),
                }
            }
        }
    }

    fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
