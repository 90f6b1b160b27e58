//! `pilum run`: a case, or all variants of one, with a report of each and their comparison.

use super::check_recording;
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

/// Runs a case, or all variants of one, and writes the report of each, and their comparison. A
/// variant that fails does not stop the others; the last failure is the outcome.
pub(super) fn run_cases(
    opener: &Opener,
    (path, settings): (&Path, &[String]),
    variant: Option<&str>,
    out: Option<&Path>,
    options: Options,
    stop: &Stop,
) -> Result<(), Error> {
    let cases = Case::load_with(path, settings)?.into_iter();
    let mut cases: Vec<Case> = cases.map(|case| case.opened_by(opener)).collect();
    variants::keep(&mut cases, variant, |case| case.variant.clone())?;
    let stop = &threads::begin_for(&cases, stop)?;
    if opener.record().is_some() {
        check_recording(&cases)?;
    }
    // All variants are checked before the first one runs.
    if cases.len() > 1 {
        let check = |case: &Case| check(case).map_err(|error| of_variant(error, case));
        cases.iter().try_for_each(check)?;
    }
    let together = match (out, cases.first()) {
        (Some(out), _) => out.to_owned(),
        (None, case) => Path::new("results").join(case.map(Case::name).unwrap_or_default()),
    };
    if let [case, _, ..] = cases.as_slice() {
        let figures = case.file.figures.iter();
        let figures: Vec<&str> = figures.map(|f| f.name.get_ref().as_str()).collect();
        remove_comparison(&together, &figures)?;
    }
    let mut outcome = Ok(());
    let mut reports = Ok(());
    let mut drawn = Vec::new();
    let mut folders = Vec::new();
    // Variants on one mesh share the factors of its linear part.
    let mut reuse = Reuse::default();
    for (number, case) in (1..).zip(&cases) {
        reuse.is_last_run = number == cases.len();
        let folder = folder_of(case, variant, out);
        if let Some(name) = &case.variant {
            say!("variant {name}");
        }
        let mut progress = Progress::new(number, &folder, stop);
        let options = Options {
            resume: options.resume || supervision::was_begun(number),
            ..options
        };
        let run = run_accurately(case, &folder, &mut progress, &mut reuse, options);
        progress.finish();
        supervision::end_run();
        let has_results = progress.has_begun;
        match run {
            Ok(figures) => {
                let _ = writeln!(supervision::stdout(), "results in {}", folder.display());
                drawn.extend(case.variant.clone().map(|variant| (variant, figures)));
            }
            Err(error) => keep_last(&mut outcome, of_variant(error, case)),
        }
        let is_stopped = outcome.as_ref().is_err_and(Error::is_stop);
        if has_results {
            match report::write_of(&folder, progress.known) {
                Ok(written) => say_written(&written),
                Err(error) => keep_last(&mut reports, error.into()),
            }
            folders.push(folder);
        }
        if is_stopped {
            break;
        }
    }
    if drawn.len() > 1
        && let Err(error) = Figures::draw_overlaid(&together, &drawn)
    {
        keep_last(&mut reports, error.into());
    }
    if folders.len() > 1
        && let Err(error) = write_report(&folders, Some(together), false)
    {
        keep_last(&mut reports, error);
    }
    match (outcome, reports) {
        // What became of the run matters more than what became of its report.
        (Err(run), Err(report)) => {
            output::error(&report);
            Err(run)
        }
        (outcome, reports) => outcome.and(reports),
    }
}

/// Reads, builds and checks a case, or all variants of one, and writes the report of each; nothing is
/// computed. An error in one variant does not hide errors in the others.
pub(super) fn dry_run_cases(
    opener: &Opener,
    (path, settings): (&Path, &[String]),
    variant: Option<&str>,
    out: Option<&Path>,
) -> Result<(), Error> {
    let cases = Case::load_with(path, settings)?.into_iter();
    let mut cases: Vec<Case> = cases.map(|case| case.opened_by(opener)).collect();
    variants::keep(&mut cases, variant, |case| case.variant.clone())?;
    let mut outcome = Ok(());
    for (number, case) in (1..).zip(&cases) {
        let folder = folder_of(case, variant, out);
        if let Some(name) = &case.variant {
            say!("variant {name}");
        }
        let mut progress = Progress::new(number, &folder, &Stop::never());
        match dry_run(case, &folder, &mut progress) {
            Ok(report) => {
                let _ = writeln!(supervision::stdout(), "report in {}", report.display());
            }
            Err(error) => keep_last(&mut outcome, of_variant(error, case)),
        }
    }
    outcome
}

fn of_variant(error: Error, case: &Case) -> Error {
    variants::of_variant(error, case.variant.as_deref())
}

/// Where the results of a case go.
fn folder_of(case: &Case, variant: Option<&str>, out: Option<&Path>) -> PathBuf {
    match (out, &case.variant) {
        (None, _) => case.default_folder(),
        (Some(out), Some(name)) if variant.is_none() => out.join(name),
        (Some(out), _) => out.to_owned(),
    }
}

/// Keeps the last failure for the caller to report, and reports the one before it.
fn keep_last(outcome: &mut Result<(), Error>, error: Error) {
    if let Err(earlier) = std::mem::replace(outcome, Err(error)) {
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
