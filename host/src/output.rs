//! Results in a folder: `history.csv`, `profile.csv`, `points.csv`, `fields.pvd` with `*.vtu`,
//! `summary.json`, `log.jsonl`. Rows are flushed as increments converge, so whatever was reported
//! is on disk. What an earlier run left in the folder is removed first.

mod fields;
mod figure;
mod leftovers;
mod points;
mod profile;
mod summary;

pub(crate) use figure::COLOURS;
pub use figure::{Figures, check_figures, check_table_figures};
pub use summary::PhaseRecord;

use crate::case::{Case, OutputInput};
use crate::error::{Error, Place};
use crate::group::Group;
use crate::mesh::Mesh;
use crate::model::Model;
use crate::probe::{Probes, Snapshot};
use crate::solver::Iteration;
use fields::Fields;
use points::Points;
use profile::Profile;
use serde_json::{Value, json};
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use summary::Summary;

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
    profile: Option<Profile>,
    points: Option<Points>,
    fields: Option<Fields>,
    log: LogFile,
    summary: Summary,
    figures: Figures,
    seconds: Duration,
}

/// A CSV file.
#[derive(Debug)]
struct Table {
    path: PathBuf,
    writer: csv::Writer<File>,
}

impl Table {
    fn create<'a>(
        path: PathBuf,
        columns: impl IntoIterator<Item = &'a str>,
    ) -> Result<Self, Error> {
        let file = create(&path)?;
        let mut table = Self {
            path,
            writer: csv::Writer::from_writer(file),
        };
        table.row(columns)?;
        table.flush()?;
        Ok(table)
    }

    fn row<I: IntoIterator<Item = T>, T: AsRef<[u8]>>(&mut self, cells: I) -> Result<(), Error> {
        self.writer
            .write_record(cells)
            .map_err(|error| unwritable(&self.path, std::io::Error::other(error)))
    }

    fn flush(&mut self) -> Result<(), Error> {
        self.writer
            .flush()
            .map_err(|error| unwritable(&self.path, error))
    }
}

fn create(path: &Path) -> Result<File, Error> {
    File::create(path).map_err(|error| unwritable(path, error))
}

fn unwritable(path: &Path, source: std::io::Error) -> Error {
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

#[derive(Debug)]
struct LogFile {
    path: PathBuf,
    file: File,
}

impl LogFile {
    fn line(&mut self, value: &Value) -> Result<(), Error> {
        writeln!(self.file, "{value}").map_err(|error| unwritable(&self.path, error))
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
        leftovers::remove(folder)?;
        let settings = case.file.output;
        let columns = ["phase", "increment", "time"]
            .into_iter()
            .chain(probes.names())
            .chain(["iterations"]);
        let log_path = folder.join("log.jsonl");
        let summary = Summary::new(case, model, probes);
        write_summary(folder, &summary.running())?;
        Ok(Self {
            history: Table::create(folder.join("history.csv"), columns)?,
            profile: Profile::create(folder, settings.profile, model)?,
            points: Points::create(folder, settings.points, model)?,
            fields: Fields::create(folder, settings.fields, model),
            log: LogFile {
                file: create(&log_path)?,
                path: log_path,
            },
            summary,
            figures: Figures::new(
                &case.file.title,
                &case.file.figures,
                probes.names().map(str::to_owned).collect(),
            ),
            folder: folder.to_owned(),
            settings,
            seconds: Duration::ZERO,
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
        self.log
            .line(&json!({ "event": "end", "status": summary["status"] }))?;
        write_summary(&self.folder, &summary)?;
        drawn
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
