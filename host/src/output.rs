//! Results in a folder: `history.csv`, `profile.csv`, `points.csv`, `fields.pvd` with `*.vtu`,
//! `summary.json`, `log.jsonl`. Rows are flushed as increments converge, so whatever was reported
//! is in its file. What an earlier run left in the folder is removed first, unless it is resumed:
//! then the files go on from where its last checkpoint saw them.

mod fields;
mod figure;
mod leftovers;
mod points;
mod profile;
mod summary;

pub(crate) use figure::COLOURS;
pub use figure::{Figures, check_figures, check_table_figures};
pub use summary::PhaseRecord;

use crate::case::{Case, Control, OutputInput, When};
use crate::error::{Error, Place};
use crate::group::Group;
use crate::mesh::Mesh;
use crate::model::Model;
use crate::probe::{Probes, Snapshot};
use crate::solver::Iteration;
use fields::Fields;
use figure::Curve;
use points::Points;
use profile::Profile;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use summary::{Course, Stopped, Summary};

/// A number with 17 significant digits: reading it back gives the same bits.
pub fn number(value: f64) -> String {
    // The shortest digits that read back to the same bits, filled up: much faster than the first
    // 17 digits of the exact value, which are no more exact.
    let shortest = format!("{value:e}");
    let (digits, exponent) = shortest.split_once('e').unwrap_or((&shortest, "0"));
    let dot = if digits.contains('.') { "" } else { "." };
    let length = 18 + usize::from(value.is_sign_negative());
    let missing = length.saturating_sub(digits.len() + dot.len());
    format!("{digits}{dot}{:0<missing$}e{exponent}", "")
}

/// An increment of a phase, for the record.
#[derive(Clone, Debug, Default)]
pub struct IncrementRecord {
    /// Pseudo-time at its end.
    pub time: f64,
    /// Values of the probes.
    pub probes: Vec<Option<f64>>,
    /// Iterations, failed attempts included.
    pub iterations: usize,
    /// A law called a result inaccurate.
    pub warning: Option<String>,
}

/// The results of a run, as they are written.
#[derive(Debug)]
pub struct Results {
    folder: PathBuf,
    settings: OutputInput,
    history: Table,
    path: Option<Table>,
    profile: Option<Profile>,
    points: Option<Points>,
    fields: Option<Fields>,
    log: LogFile,
    summary: Summary,
    figures: Figures,
    seconds: Duration,
}

/// How far the results of a run had come at a checkpoint.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ResultsState {
    history: u64,
    path: Option<u64>,
    profile: Option<u64>,
    points: Option<u64>,
    log: u64,
    times: Option<Vec<f64>>,
    course: Course,
    curves: Vec<Vec<Curve>>,
    seconds: Duration,
}

impl ResultsState {
    /// The figures of the run.
    pub fn figures(self, case: &Case, probes: &Probes) -> Figures {
        let mut figures = empty_figures(case, probes);
        figures.restore(self.curves);
        figures
    }
}

fn empty_figures(case: &Case, probes: &Probes) -> Figures {
    let names = probes.names().map(str::to_owned).collect();
    Figures::new(&case.file.title, &case.file.figures, names)
}

/// A CSV file.
#[derive(Debug)]
struct Table {
    path: PathBuf,
    file: File,
    /// Rows that are not in the file yet.
    rows: csv::Writer<Vec<u8>>,
    /// Bytes of whole rows in the file.
    length: u64,
}

impl Table {
    /// Begins a file with a head; or, `from` a length, goes on after that of an earlier run's.
    fn begin<'a>(
        path: PathBuf,
        columns: impl IntoIterator<Item = &'a str>,
        from: Option<u64>,
    ) -> Result<Self, Error> {
        let file = match from {
            None => create(&path)?,
            Some(length) => OpenOptions::new()
                .write(true)
                .open(&path)
                .and_then(|file| cut(&file, length).map(|()| file))
                .map_err(|error| unwritable(&path, error))?,
        };
        let mut table = Self {
            path,
            file,
            rows: csv::Writer::from_writer(Vec::new()),
            length: from.unwrap_or(0),
        };
        if from.is_none() {
            table.row(columns)?;
            table.flush()?;
        }
        Ok(table)
    }

    fn row<I: IntoIterator<Item = T>, T: AsRef<[u8]>>(&mut self, cells: I) -> Result<(), Error> {
        self.rows
            .write_record(cells)
            .map_err(|error| unwritable(&self.path, std::io::Error::other(error)))
    }

    /// Writes the rows that are waiting, all of them or none.
    fn flush(&mut self) -> Result<(), Error> {
        let rows = std::mem::replace(&mut self.rows, csv::Writer::from_writer(Vec::new()));
        let rows = rows
            .into_inner()
            .map_err(|error| Error::Internal(error.to_string()))?;
        append(&mut self.file, &mut self.length, &rows)
            .map_err(|error| unwritable(&self.path, error))
    }

    /// Waits until everything is on the disk.
    fn sync(&self) -> Result<u64, Error> {
        let synced = self.file.sync_data();
        synced.map_err(|error| unwritable(&self.path, error))?;
        Ok(self.length)
    }
}

/// Appends to a file of this length. What fits of a text that does not fit as a whole is taken
/// back: it would pass for more than it is.
fn append(file: &mut File, length: &mut u64, text: &[u8]) -> std::io::Result<()> {
    check_own(file, *length)?;
    if let Err(error) = file.write_all(text) {
        let _ = file.set_len(*length);
        return Err(error);
    }
    *length += text.len() as u64;
    Ok(())
}

/// Refuses to write where something else than the file is by now: a law may have closed it, and
/// its number may be that of another one.
pub(crate) fn check_own(file: &File, length: u64) -> std::io::Result<()> {
    let found = file.metadata();
    if found.is_ok_and(|found| !found.is_file() || found.len() == length) {
        return Ok(());
    }
    let why = "a law has closed it, or something else has written to it";
    Err(std::io::Error::other(why))
}

/// Forgets what a file holds after `length` bytes and goes on there.
fn cut(mut file: &File, length: u64) -> std::io::Result<()> {
    if file.metadata()?.len() < length {
        return Err(std::io::Error::other(
            "it is shorter than it was at the last checkpoint: it was changed since",
        ));
    }
    file.set_len(length)?;
    file.seek(SeekFrom::Start(length))?;
    Ok(())
}

/// Refuses to write where something else than a file is: a pipe that nobody reads would keep the
/// program waiting for ever.
///
/// # Errors
/// [`Error::Unwritable`].
pub fn refuse_other(path: &Path) -> Result<(), Error> {
    if std::fs::metadata(path).is_ok_and(|found| !found.is_file()) {
        let other = std::io::Error::other("there is something else than a file of this name");
        return Err(unwritable(path, other));
    }
    Ok(())
}

fn create(path: &Path) -> Result<File, Error> {
    refuse_other(path)?;
    File::create(path).map_err(|error| unwritable(path, error))
}

pub(crate) fn unwritable(path: &Path, source: std::io::Error) -> Error {
    Error::Unwritable {
        path: path.to_owned(),
        source,
    }
}

/// Ids of the internal variables of all laws that these groups ever carry, each once.
fn internal_variables(model: &Model, of: impl Fn(&Group) -> bool) -> Vec<String> {
    let first = model.groups.iter().map(|group| (group, &group.law));
    let swapped = model.swaps.iter().flatten();
    let swapped = swapped.map(|(group, law)| (&model.groups[*group], law));
    let mut ids: Vec<String> = Vec::new();
    for (_, law) in first.chain(swapped).filter(|(group, _)| of(group)) {
        for variable in &law.built.law.formulation().internal_variables {
            if !ids.contains(&variable.id) {
                ids.push(variable.id.clone());
            }
        }
    }
    ids
}

/// One JSON object a line. As long as it is open, no other run writes into the folder.
#[derive(Debug)]
struct LogFile {
    path: PathBuf,
    file: File,
    /// Bytes of whole lines.
    length: u64,
}

/// Locks a file. The process of a run that was killed may take a moment to end.
fn locked(file: &File) -> Result<(), TryLockError> {
    const MOMENT: Duration = Duration::from_millis(500);
    let since = std::time::Instant::now();
    loop {
        match file.try_lock() {
            Err(TryLockError::WouldBlock) if since.elapsed() < MOMENT => {
                std::thread::sleep(Duration::from_millis(5));
            }
            outcome => return outcome,
        }
    }
}

impl LogFile {
    /// Opens and locks the file, and goes on after its first `length` bytes.
    fn begin(path: PathBuf, length: u64) -> Result<Self, Error> {
        let mut options = OpenOptions::new();
        let options = options.read(true).write(true).create(true).truncate(false);
        let file = options
            .open(&path)
            .map_err(|error| unwritable(&path, error))?;
        // Some file systems know no locks: an error says nothing of another run.
        if let Err(TryLockError::WouldBlock) = locked(&file) {
            let busy = std::io::Error::other("another run is writing into this folder");
            return Err(unwritable(&path, busy));
        }
        cut(&file, length).map_err(|error| unwritable(&path, error))?;
        Ok(Self { path, file, length })
    }

    fn line(&mut self, value: &Value) -> Result<(), Error> {
        let line = format!("{value}\n");
        append(&mut self.file, &mut self.length, line.as_bytes())
            .map_err(|error| unwritable(&self.path, error))
    }

    fn sync(&self) -> Result<u64, Error> {
        let synced = self.file.sync_data();
        synced.map_err(|error| unwritable(&self.path, error))?;
        Ok(self.length)
    }
}

impl Results {
    /// Creates the folder and its files, and removes those of an earlier run.
    ///
    /// # Errors
    /// [`Error::Unwritable`].
    pub fn create(
        folder: &Path,
        case: &Case,
        model: &Model,
        probes: &Probes,
    ) -> Result<Self, Error> {
        std::fs::create_dir_all(folder).map_err(|error| unwritable(folder, error))?;
        let log = LogFile::begin(folder.join("log.jsonl"), 0)?;
        leftovers::remove(folder)?;
        Self::begin(folder, case, model, probes, log, None)
    }

    /// Takes over the results that an interrupted run of the same case left in the folder, as
    /// they were at its last checkpoint; what it wrote after that is forgotten.
    ///
    /// # Errors
    /// [`Error::Unwritable`].
    pub fn resume(
        folder: &Path,
        case: &Case,
        model: &Model,
        probes: &Probes,
        state: ResultsState,
    ) -> Result<Self, Error> {
        let log = LogFile::begin(folder.join("log.jsonl"), state.log)?;
        Self::begin(folder, case, model, probes, log, Some(state))
    }

    fn begin(
        folder: &Path,
        case: &Case,
        model: &Model,
        probes: &Probes,
        log: LogFile,
        state: Option<ResultsState>,
    ) -> Result<Self, Error> {
        let settings = case.file.output;
        let columns = ["phase", "increment", "time"]
            .into_iter()
            .chain(probes.names())
            .chain(["iterations"]);
        let at = state.as_ref();
        let history_from = at.map(|state| state.history);
        let path_columns = ["phase", "increment", "load_factor"]
            .into_iter()
            .chain(probes.names())
            .chain(["iterations"]);
        let path_from = at.and_then(|state| state.path);
        let follows = case.file.solver.control == Control::ArcLength;
        let path = follows
            .then(|| Table::begin(folder.join("path.csv"), path_columns, path_from))
            .transpose()?;
        let mut results = Self {
            history: Table::begin(folder.join("history.csv"), columns, history_from)?,
            path,
            profile: Profile::begin(folder, settings.profile, model, at.and_then(|s| s.profile))?,
            points: Points::begin(folder, settings.points, model, at.and_then(|s| s.points))?,
            fields: Fields::create(folder, settings.fields, model),
            log,
            summary: Summary::new(case, model, probes),
            figures: empty_figures(case, probes),
            folder: folder.to_owned(),
            settings,
            seconds: Duration::ZERO,
        };
        if let Some(state) = state {
            results.summary.course = state.course;
            results.figures.restore(state.curves);
            results.seconds = state.seconds;
            if let (Some(fields), Some(times)) = (&mut results.fields, state.times) {
                fields.times = times;
            }
        }
        write_summary(folder, &results.summary.running())?;
        Ok(results)
    }

    /// How far the results have come, after waiting until they are on the disk.
    ///
    /// # Errors
    /// [`Error::Unwritable`].
    pub fn state(&self) -> Result<ResultsState, Error> {
        let path = self.path.as_ref().map(Table::sync);
        let profile = self.profile.as_ref().map(|profile| profile.table.sync());
        let points = self.points.as_ref().map(|points| points.table.sync());
        Ok(ResultsState {
            history: self.history.sync()?,
            path: path.transpose()?,
            profile: profile.transpose()?,
            points: points.transpose()?,
            log: self.log.sync()?,
            times: self.fields.as_ref().map(|fields| fields.times.clone()),
            course: self.summary.course.clone(),
            curves: self.figures.curves(),
            seconds: self.seconds,
        })
    }

    /// Logs the iterations of an attempt.
    ///
    /// # Errors
    /// [`Error::Unwritable`].
    pub fn iterations(
        &mut self,
        place: &Place,
        lambda: f64,
        iterations: &[Iteration],
    ) -> Result<(), Error> {
        for (number, iteration) in iterations.iter().enumerate() {
            self.log.line(&json!({
                "event": "iteration",
                "phase": place.phase,
                "increment": place.increment,
                "load_factor": lambda,
                "iteration": number,
                "residual": iteration.residual,
                "correction": iteration.correction,
                "step_length": iteration.step_length,
                "viscosity": iteration.viscosity,
            }))?;
        }
        Ok(())
    }

    /// Logs a cut-back.
    ///
    /// # Errors
    /// [`Error::Unwritable`].
    pub fn cut_back(
        &mut self,
        place: &Place,
        lambda: f64,
        step: f64,
        reason: &str,
    ) -> Result<(), Error> {
        self.log.line(&json!({
            "event": "cut_back",
            "phase": place.phase,
            "increment": place.increment,
            "load_factor": lambda,
            "next_step": step,
            "reason": reason,
        }))
    }

    /// Groups that this increment's results look at, one of `of`, beside those that its probes
    /// look at. `None`: all of them.
    pub fn looks_at(
        &self,
        place: &Place,
        of: usize,
        probed: &[bool],
        groups: &[Group],
    ) -> Option<Vec<bool>> {
        let asks = |when: When| when.includes(place.increment, of);
        let all = (self.fields.is_some() && asks(self.settings.fields))
            || (self.points.is_some() && asks(self.settings.points))
            || self.figures.cuts_at(place, of)
            || place.increment == of;
        if all {
            return None;
        }
        let mut looked_at = probed.to_vec();
        if self.profile.is_some() && asks(self.settings.profile) {
            for (looked_at, group) in looked_at.iter_mut().zip(groups) {
                *looked_at |= group.jump_and_traction(0).is_some();
            }
        }
        Some(looked_at)
    }

    /// Writes a step of a run under arc-length control, in an increment that it leads to.
    ///
    /// # Errors
    /// [`Error::Unwritable`].
    pub fn step(
        &mut self,
        place: &Place,
        load_factor: f64,
        probes: &[Option<f64>],
        iterations: usize,
    ) -> Result<(), Error> {
        let Some(path) = &mut self.path else {
            return Ok(());
        };
        let mut row = vec![
            place.phase.clone(),
            place.increment.to_string(),
            number(load_factor),
        ];
        let values = probes.iter().map(|value| value.map(number));
        row.extend(values.map(Option::unwrap_or_default));
        row.push(iterations.to_string());
        path.row(&row)?;
        path.flush()
    }

    /// Notes the last state of equilibrium of a phase that cannot go on, and writes its fields if
    /// there are any. `place` is the increment that it lies in.
    ///
    /// # Errors
    /// [`Error::Unwritable`].
    pub fn last_equilibrium(
        &mut self,
        place: &Place,
        load_factor: f64,
        time: f64,
        probes: Vec<Option<f64>>,
        snapshot: &Snapshot<'_>,
        mesh: &Mesh,
    ) -> Result<(), Error> {
        self.summary.course.stopped = Some(Stopped {
            phase: place.phase.clone(),
            load_factor,
            time,
            probes,
        });
        if let Some(fields) = &mut self.fields
            && fields.times.last().copied() != Some(time)
        {
            fields.write(time, snapshot, mesh)?;
        }
        Ok(())
    }

    /// Writes an increment that reached equilibrium.
    ///
    /// # Errors
    /// [`Error::Unwritable`].
    pub fn increment(
        &mut self,
        place: &Place,
        of: usize,
        record: &IncrementRecord,
        snapshot: &Snapshot<'_>,
        mesh: &Mesh,
    ) -> Result<(), Error> {
        let start = Instant::now();
        let mut row = vec![
            place.phase.clone(),
            place.increment.to_string(),
            number(record.time),
        ];
        row.extend(
            record
                .probes
                .iter()
                .map(|value| value.map(number).unwrap_or_default()),
        );
        row.push(record.iterations.to_string());
        self.history.row(&row)?;
        self.history.flush()?;
        if self.settings.profile.includes(place.increment, of)
            && let Some(profile) = &mut self.profile
        {
            profile.write(place, snapshot.groups)?;
        }
        if self.settings.points.includes(place.increment, of)
            && let Some(points) = &mut self.points
        {
            points.write(place, snapshot.groups)?;
        }
        if self.settings.fields.includes(place.increment, of)
            && let Some(fields) = &mut self.fields
        {
            fields.write(record.time, snapshot, mesh)?;
        }
        if let Some(warning) = &record.warning {
            self.log.line(&json!({
                "event": "unreliable",
                "phase": place.phase,
                "increment": place.increment,
                "reason": warning,
            }))?;
        }
        self.summary.last_increment(place, record);
        self.figures.increment(place, &record.probes);
        self.figures.cuts(place, of, snapshot.groups);
        self.seconds += start.elapsed();
        Ok(())
    }

    /// Takes the record of a phase.
    pub fn phase(&mut self, record: PhaseRecord) {
        self.summary.phase(record);
    }

    /// The figures so far.
    pub fn figures(&self) -> &Figures {
        &self.figures
    }

    /// Folder of the results.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Warnings about results that laws call inaccurate, one for each phase that has any.
    pub fn unreliable(&self) -> Vec<String> {
        self.summary.unreliable()
    }

    /// Draws the figures and writes the summary; the run's error, if there is one, and its
    /// warnings go into it.
    ///
    /// # Errors
    /// [`Error::Unwritable`].
    pub fn finish(
        &mut self,
        groups: &[Group],
        total: Duration,
        warnings: &[String],
        error: Option<&Error>,
    ) -> Result<(), Error> {
        let drawn = self.figures.draw(&self.folder);
        let summary = self
            .summary
            .finish(groups, [total, self.seconds], warnings, error);
        let logged = self
            .log
            .line(&json!({ "event": "end", "status": summary["status"] }));
        // A log that takes no more must not leave a run that seems to go on.
        write_summary(&self.folder, &summary)?;
        logged.and(drawn)
    }
}

/// Removes from the common folder of a case's variants what an earlier run of them wrote there:
/// figures over all of them, and their comparison.
///
/// # Errors
/// [`Error::Unwritable`].
pub fn remove_comparison(folder: &Path, case: &Case) -> Result<(), Error> {
    if !folder.is_dir() {
        return Ok(());
    }
    let is_figure = |stem: &str| {
        let mut figures = case.file.figures.iter();
        figures.any(|figure| figure.name.get_ref() == stem)
    };
    leftovers::remove_if(folder, |name| {
        name == "report.html" || name.strip_suffix(".svg").is_some_and(is_figure)
    })
}

/// Has the summary of a run that could not end it say how it ended. Whether there is one.
///
/// # Errors
/// [`Error::Unreadable`] or [`Error::Unwritable`].
pub fn end_summary(folder: &Path, error: &Error) -> Result<bool, Error> {
    let path = folder.join("summary.json");
    if !path.is_file() {
        return Ok(false);
    }
    let text = std::fs::read_to_string(&path).map_err(|source| Error::Unreadable {
        path: path.clone(),
        source,
    })?;
    let Ok(Value::Object(mut summary)) = serde_json::from_str(&text) else {
        return Ok(false);
    };
    summary.insert("status".to_owned(), summary::status(Some(error)).into());
    summary.insert("error".to_owned(), error.to_string().into());
    write_summary(folder, &summary.into())?;
    Ok(true)
}

/// Writes the summary whole or not at all.
fn write_summary(folder: &Path, summary: &Value) -> Result<(), Error> {
    let path = folder.join("summary.json");
    let partial = folder.join("summary.json.part");
    let text = serde_json::to_string_pretty(summary)
        .map_err(|error| Error::Internal(error.to_string()))?;
    std::fs::write(&partial, text + "\n").map_err(|error| unwritable(&partial, error))?;
    std::fs::rename(&partial, &path).map_err(|error| unwritable(&path, error))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_17_digits_and_read_back() {
        let values = [
            0.0,
            -0.0,
            1.0,
            -1.0,
            0.1,
            -2.5e-7,
            1.0 / 3.0,
            f64::MAX,
            f64::MIN_POSITIVE,
            5e-324,
            -1e22,
        ];
        for value in values {
            let text = number(value);
            let digits = text.split('e').next().unwrap();
            assert_eq!(
                digits.chars().filter(char::is_ascii_digit).count(),
                17,
                "{text}"
            );
            let back: f64 = text.parse().unwrap();
            assert_eq!(back.to_bits(), value.to_bits(), "{text}");
        }
    }
}
