//! `report.html`: the results of a run, or of several side by side, as one file that opens without
//! a network.
//!
//! The template writes tables. Drawings go into the page as JSON, rounded to seven digits, and is
//! drawn by the page's own script. The CSV files stay the
//! primary result and are linked. However long they are, and however many runs there are, the page
//! stays of a size that a browser opens; what is left out for that is reported. A folder only has to have a `history.csv`; whatever else is
//! missing or broken is left out, and the page reports it.

mod budget;
mod comparison;
mod fields;
mod law;
mod log;
mod model;
mod number_format;
mod page;
mod pile;
mod profile;
mod results;
mod study;
mod table;

pub use page::STYLE;
pub(crate) use profile::{Point, Profiles};
use text::Error;
use text::write::replace_whole;

use crate::output_request::OutputRequest;
use crate::summary;
use crate::summary::About;
use budget::Budget;
use mechanics::Simulation;
use page::For;
use results::Run;
use std::fmt::Display;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// Name of a report's file.
const FILE: &str = "report.html";

fn internal(why: impl Display) -> Error {
    Error::Internal(format!("report: {why}"))
}

/// A page from its template.
fn filled(template: &str, page: minijinja::Value) -> Result<String, Error> {
    let mut environment = minijinja::Environment::new();
    environment.add_filter("words", page::words);
    environment.add_filter("display", number_format::display);
    environment.add_filter("seconds", page::seconds);
    environment
        .render_named_str(FILE, template, page)
        .map_err(|error| internal(format!("{error:#}")))
}

/// Default place of the report of these folders: into the folder
/// itself, or next to the first of several.
pub fn default_path(folders: &[PathBuf]) -> PathBuf {
    match folders {
        [folder] => folder.join(FILE),
        // `.` and `..` have no parent by name.
        [first, ..] if first.file_name().is_none() => first.join("..").join(FILE),
        [first, ..] => first.parent().unwrap_or(first).join(FILE),
        [] => PathBuf::from(FILE),
    }
}

/// Results that a process has written into a folder and still knows, so that a report need not read them
/// again. For the profiles of `cases/chamber_mesh1` that saves a tenth of the instructions of the whole run.
#[derive(Debug, Default)]
pub struct Known {
    /// Length of `profile.csv`, and what is shown of it.
    pub(crate) profile: Option<(u64, Profiles)>,
}

/// The report of a run, or of a study, that is under way. It is marked as such and reloads itself. It is
/// rewritten at most once a second, and so seldom that this takes about a hundredth of the time.
#[derive(Debug)]
pub struct Running {
    folder: PathBuf,
    next: Instant,
}

/// Least time between two of them; a shorter run has no interim report.
const EVERY: Duration = Duration::from_secs(1);
/// The pause after a report, in times that writing it took.
const SELDOM: u32 = 100;

impl Running {
    /// In this folder.
    pub fn new(folder: &Path) -> Self {
        Self {
            folder: folder.to_owned(),
            next: Instant::now() + EVERY,
        }
    }

    /// Writes the report as the folder is now, if it is time for that.
    ///
    /// # Errors
    /// As [`write()`].
    pub fn write_if_due(&mut self) -> Result<(), Error> {
        let started = Instant::now();
        if started < self.next {
            return Ok(());
        }
        let now = SystemTime::now().duration_since(UNIX_EPOCH);
        let now = now.map_or(0, |since| since.as_secs());
        let text = if crate::study::is_study(&self.folder) {
            study::render(&self.folder, Some(now))?
        } else {
            page::render(
                &read(std::slice::from_ref(&self.folder), None)?,
                &self.folder,
                For::Running(now),
            )?
        };
        replace_whole(&self.folder.join(FILE), text)?;
        self.next = Instant::now() + EVERY.max(SELDOM * started.elapsed());
        Ok(())
    }
}

/// Whether a folder holds what a run has written, which a dry run leaves unchanged.
fn has_results(folder: &Path) -> bool {
    let written = [
        summary::FILE_NAME,
        "history.csv",
        crate::checkpoint::FILE_NAME,
    ];
    written.iter().any(|name| folder.join(name).is_file())
}

/// Writes the report of a case that is not run into a folder, and returns the file's path: its mesh, lines,
/// supports, loads, water and initial stress. `warnings` are to be read first.
///
/// # Errors
/// [`Error::Usage`] if the folder holds the results of a run, whose report that would replace;
/// [`Error::Unwritable`].
pub fn write_dry(
    folder: &Path,
    about: &About,
    wanted: &OutputRequest,
    simulation: &Simulation,
    warnings: &[String],
) -> Result<PathBuf, Error> {
    if has_results(folder) {
        return Err(Error::Usage(format!(
            "all of it could be built, but {} holds the results of a run, whose report a dry run does not \
             replace: `--out` names another folder",
            folder.display()
        )));
    }
    let run = Run::before(folder, about, wanted, simulation, warnings);
    std::fs::create_dir_all(folder).map_err(|error| Error::unwritable(folder, error))?;
    let text = page::render(&[run], folder, For::Screen)?;
    let file = folder.join(FILE);
    replace_whole(&file, text)?;
    Ok(file)
}

/// The folder of a study, if that is what is reported.
fn study_among(folders: &[PathBuf]) -> Result<Option<&Path>, Error> {
    match folders {
        [folder] if crate::study::is_study(folder) => Ok(Some(folder)),
        _ if folders.iter().any(|folder| crate::study::is_study(folder)) => Err(Error::Usage(
            "one of these folders is that of a study, which has a report of its own: name it alone, or folders of \
             its runs"
                .to_owned(),
        )),
        _ => Ok(None),
    }
}

/// The runs in these folders; of a single one may be `known` what it wrote.
fn read(folders: &[PathBuf], known: Option<Known>) -> Result<Vec<Run>, Error> {
    let budget = Budget::of(folders.len());
    let mut known = known.filter(|_| folders.len() == 1).unwrap_or_default();
    let named = summary::names(folders).into_iter().zip(folders);
    named
        .map(|(name, folder)| Run::read(&name, folder, std::mem::take(&mut known), &budget))
        .collect()
}

/// Writes the report of a results folder, or the comparison of several, or the report of a study, and
/// returns the file's path. If `out` is a folder, the report goes into it.
///
/// # Errors
/// [`Error::Usage`] without a folder, or if one has no results; [`Error::Unreadable`] if one has no `history.csv`,
/// [`Error::Input`] if that is not the history of a run; [`Error::Unwritable`].
pub fn write(folders: &[PathBuf], out: &Path) -> Result<PathBuf, Error> {
    write_as(folders, out, None, For::Screen)
}

/// Writes a report for paper, as [`write()`].
///
/// # Errors
/// As [`write()`]; [`Error::Usage`] for a study, whose report is for a screen.
pub fn write_for_paper(folders: &[PathBuf], out: &Path) -> Result<PathBuf, Error> {
    write_as(folders, out, None, For::Paper)
}

/// Writes the report of a run into its folder, as [`write()`], by the process that wrote the results.
///
/// # Errors
/// As [`write()`].
pub fn write_of(folder: &Path, known: Known) -> Result<PathBuf, Error> {
    let folders = [folder.to_owned()];
    write_as(&folders, &default_path(&folders), Some(known), For::Screen)
}

fn refuse_without_results(folders: &[PathBuf]) -> Result<(), Error> {
    let Some(folder) = folders.iter().find(|f| !has_results(f)) else {
        return Ok(());
    };
    let why = if folder.is_dir() {
        "has no results of a run (`history.csv`)"
    } else {
        "is no folder"
    };
    Err(Error::Usage(format!(
        "{} {why}: `pilum run CASE --out FOLDER` writes them",
        folder.display()
    )))
}

fn write_as(
    folders: &[PathBuf],
    out: &Path,
    known: Option<Known>,
    kind: For,
) -> Result<PathBuf, Error> {
    if folders.is_empty() {
        return Err(Error::Usage("name at least one results folder".to_owned()));
    }
    let study = study_among(folders)?;
    if study.is_none() {
        refuse_without_results(folders)?;
    }
    let is_ours = out.is_dir() || out == default_path(folders);
    let out = if out.is_dir() {
        out.join(FILE)
    } else {
        out.to_owned()
    };
    let unwritable = |source| Error::Unwritable {
        path: out.clone(),
        source,
    };
    let absolute = std::path::absolute(&out).map_err(unwritable)?;
    let parent = absolute.parent().unwrap_or(&absolute);
    std::fs::create_dir_all(parent).map_err(unwritable)?;
    let text = match study {
        Some(_) if matches!(kind, For::Paper) => {
            return Err(Error::Usage(
                "the report of a study is for a screen: `--print` takes folders of runs".to_owned(),
            ));
        }
        Some(folder) => study::render(folder, None)?,
        None => page::render(&read(folders, known)?, parent, kind)?,
    };
    // A name that was asked for is followed, as a shell does.
    if is_ours {
        replace_whole(&out, text)?;
    } else {
        std::fs::write(&out, text).map_err(unwritable)?;
    }
    Ok(out)
}
