//! `pilum run`: a case, or all variants of one, with a report of each and their comparison.

use super::{check_recording, recorded, stop_on_signals};
use crate::arguments::Run;
use crate::output::{self, say};
use crate::progress::Progress;
use crate::threads;
use input::{Case, Error};
use law::{Opener, Stop};
use mechanics::equilibrium::Reuse;
use results::{Figures, remove_comparison, report};
use runs::run::{Options, check, dry_run};
use runs::trade_off::run_accurately;
use runs::{supervision, variants};
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::time::Duration;

pub(super) fn run(asked: &Run, opener: Opener) -> Result<(), Error> {
    threads::gather(asked.threads)?;
    if asked.threads.is_some() || asked.dry_run {
        threads::begin()?;
    }
    if asked.dry_run {
        return dry_run_cases(asked, &opener);
    }
    let stop = stop_on_signals()?;
    recorded(asked.record.as_deref(), opener, |opener| {
        run_cases(asked, opener, &stop)
    })
}

fn load(asked: &Run, opener: &Opener) -> Result<Vec<Case>, Error> {
    let cases = Case::load_with(&asked.case, &asked.set)?.into_iter();
    let mut cases: Vec<Case> = cases.map(|case| case.opened_by(opener)).collect();
    let variant = asked.variant.as_deref();
    variants::keep(&mut cases, variant, |case| case.variant.clone())?;
    Ok(cases)
}

/// Runs a case, or all variants of one, and writes the report of each, and their comparison. A
/// variant that fails does not stop the others; the last failure is the outcome.
fn run_cases(asked: &Run, opener: &Opener, stop: &Stop) -> Result<(), Error> {
    let cases = load(asked, opener)?;
    let stop = &threads::begin_for(&cases, stop)?;
    if opener.record().is_some() {
        check_recording(&cases)?;
    }
    // All variants are checked before the first one runs.
    if cases.len() > 1 {
        let check = |case: &Case| check(case).map_err(|error| of_variant(error, case));
        cases.iter().try_for_each(check)?;
    }
    let together = match (&asked.out, cases.first()) {
        (Some(out), _) => out.clone(),
        (None, case) => Path::new("results").join(case.map(Case::name).unwrap_or_default()),
    };
    if let [case, _, ..] = cases.as_slice() {
        let figures = case.file.figures.iter();
        let figures: Vec<&str> = figures.map(|f| f.name.get_ref().as_str()).collect();
        remove_comparison(&together, &figures)?;
    }
    // Variants on one mesh share the factors of its linear part.
    let mut reuse = Reuse::default();
    let mut ended = Ended::default();
    for (number, case) in (1..).zip(&cases) {
        reuse.is_last_run = number == cases.len();
        let folder = folder_of(case, asked);
        say_variant(case);
        let progress = Progress::new(number, &folder, stop);
        let options = Options {
            resume: asked.resume || supervision::was_begun(number),
            checkpoints: Some(Duration::from_secs_f64(asked.checkpoint)),
            ends_without: false,
            reports: true,
        };
        ended.run(case, folder, progress, &mut reuse, options);
        if ended.failure.as_ref().is_some_and(Error::is_stop) {
            break;
        }
    }
    ended.compared(together)
}

/// The runs that have ended. The last failure of each kind is for the caller to report, those before it are reported.
#[derive(Default)]
struct Ended {
    failure: Option<Error>,
    /// Error of a report that could not be written.
    unwritten: Option<Error>,
    /// Figures of the variants.
    drawn: Vec<(String, Figures)>,
    /// Those with results.
    folders: Vec<PathBuf>,
}

impl Ended {
    /// Runs a case and writes its report.
    fn run(
        &mut self,
        case: &Case,
        folder: PathBuf,
        mut progress: Progress,
        reuse: &mut Reuse,
        options: Options,
    ) {
        let run = run_accurately(case, &folder, &mut progress, reuse, options);
        progress.finish();
        supervision::end_run();
        match run {
            Ok(figures) => {
                let _ = writeln!(supervision::stdout(), "results in {}", folder.display());
                let variant = case.variant.clone();
                self.drawn.extend(variant.map(|variant| (variant, figures)));
            }
            Err(error) => keep_last(&mut self.failure, of_variant(error, case)),
        }
        if progress.has_begun {
            match report::write_of(&folder, progress.known) {
                Ok(written) => say_written(&written),
                Err(error) => keep_last(&mut self.unwritten, error.into()),
            }
            self.folders.push(folder);
        }
    }

    /// Writes the comparison of several.
    fn compared(mut self, together: PathBuf) -> Result<(), Error> {
        if self.drawn.len() > 1
            && let Err(error) = Figures::draw_overlaid(&together, &self.drawn)
        {
            keep_last(&mut self.unwritten, error.into());
        }
        if self.folders.len() > 1
            && let Err(error) = write_report(&self.folders, Some(together), false)
        {
            keep_last(&mut self.unwritten, error);
        }
        // What became of the run matters more than what became of its report.
        if let (Some(_), Some(report)) = (&self.failure, &self.unwritten) {
            output::error(report);
        }
        self.failure.or(self.unwritten).map_or(Ok(()), Err)
    }
}

/// Reads, builds and checks a case, or all variants of one, and writes the report of each; nothing is
/// computed. An error in one variant does not hide errors in the others.
fn dry_run_cases(asked: &Run, opener: &Opener) -> Result<(), Error> {
    let mut failure = None;
    for (number, case) in (1..).zip(&load(asked, opener)?) {
        let folder = folder_of(case, asked);
        say_variant(case);
        let mut progress = Progress::new(number, &folder, &Stop::never());
        match dry_run(case, &folder, &mut progress) {
            Ok(report) => say_written(&report),
            Err(error) => keep_last(&mut failure, of_variant(error, case)),
        }
    }
    failure.map_or(Ok(()), Err)
}

fn say_variant(case: &Case) {
    if let Some(name) = &case.variant {
        say!("variant {name}");
    }
}

fn of_variant(error: Error, case: &Case) -> Error {
    variants::of_variant(error, case.variant.as_deref())
}

/// Where the results of a case go.
fn folder_of(case: &Case, asked: &Run) -> PathBuf {
    match (&asked.out, &case.variant) {
        (None, _) => case.default_folder(),
        (Some(out), Some(name)) if asked.variant.is_none() => out.join(name),
        (Some(out), _) => out.clone(),
    }
}

/// Keeps the last failure for the caller to report, and reports the one before it.
fn keep_last(failure: &mut Option<Error>, error: Error) {
    if let Some(earlier) = failure.replace(error) {
        output::error(&earlier);
    }
}

/// Writes the report of a run, or the comparison of several.
pub(super) fn write_report(
    folders: &[PathBuf],
    out: Option<PathBuf>,
    for_paper: bool,
) -> Result<(), Error> {
    let out = out.unwrap_or_else(|| report::default_path(folders));
    let write = if for_paper {
        report::write_for_paper
    } else {
        report::write
    };
    say_written(&write(folders, &out)?);
    Ok(())
}

fn say_written(report: &Path) {
    let _ = writeln!(supervision::stdout(), "report in {}", report.display());
}
