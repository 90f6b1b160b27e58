//! A results folder, read back.

use super::Known;
use super::budget::Budget;
use super::fields::Fields;
use super::log::Log;
use super::model::Model;
use super::number_format::{Short, extremes, thinned};
use super::pile::Pile;
use super::profile::Profile;
use super::table::Table;
use crate::fields::unstructured_grid;
use crate::output_request::OutputRequest;
use crate::pressures::Pressure;
use crate::summary::{self, About, DONE, Progress, RUNNING, Summary};
use mechanics::Simulation;
use serde::Serialize;
use std::collections::{BTreeMap, HashMap};
use std::fs::Metadata;
use std::path::{Path, PathBuf};
use text::Error;

/// A run as its folder shows it.
#[derive(Debug)]
pub(super) struct Run {
    /// What the page calls it.
    pub(super) name: String,
    /// The folder.
    pub(super) folder: PathBuf,
    /// `summary.json`, empty if absent.
    pub(super) summary: Summary,
    pub(super) history: History,
    pub(super) profile: Option<Profile>,
    pub(super) pile: Option<Pile>,
    pub(super) fields: Option<Fields>,
    pub(super) log: Log,
    /// The model, of a case that was not run.
    pub(super) model: Option<Model>,
    /// Missing or damaged files.
    pub(super) notes: Vec<String>,
}

/// How a run ended.
#[derive(Debug, PartialEq)]
pub(super) enum Ending {
    Done,
    /// Nothing was computed.
    NotRun,
    /// With the status and the reason.
    Failed(String, String),
    /// With what shows it.
    Unfinished(&'static str),
}

/// `history.csv`.
#[derive(Debug, Default, Serialize)]
pub(super) struct History {
    /// Names of the phases, in order.
    phases: Vec<String>,
    /// Number of the phase, by row.
    phase: Vec<usize>,
    increment: Vec<usize>,
    /// Names of the columns of numbers: the time, the probes, the iterations.
    pub(super) names: Vec<String>,
    /// By column and row.
    values: Vec<Vec<Short>>,
    /// Last row of every phase.
    #[serde(skip)]
    pub(super) ends: Vec<PhaseEnd>,
    /// Times of the increments, by name and increment of the phase.
    #[serde(skip)]
    times: Times,
}

/// Times of increments.
#[derive(Debug, Default)]
pub(super) struct Times(HashMap<String, HashMap<usize, f64>>);

impl Times {
    /// Phase and increment of every row, and the finite ones of their times.
    fn new<'p>(rows: impl Iterator<Item = (&'p str, usize)>, times: Option<&[f64]>) -> Self {
        let mut all = Self::default();
        for ((phase, increment), &time) in rows.zip(times.unwrap_or_default()) {
            if time.is_finite() {
                all.add(phase, increment, time);
            }
        }
        all
    }

    fn add(&mut self, phase: &str, increment: usize, time: f64) {
        if let Some(of_phase) = self.0.get_mut(phase) {
            of_phase.insert(increment, time);
        } else {
            let of_phase = HashMap::from([(increment, time)]);
            self.0.insert(phase.to_owned(), of_phase);
        }
    }

    /// The time of an increment.
    pub(super) fn of(&self, phase: &str, increment: usize) -> Option<f64> {
        self.0.get(phase)?.get(&increment).copied()
    }

    /// Phase and increment at a time.
    fn label(&self, time: f64) -> String {
        let all = self.0.iter();
        let all = all.flat_map(|(phase, times)| times.iter().map(move |(i, t)| (phase, i, *t)));
        let off = |t: f64| (t - time).abs();
        let nearest = all.min_by(|a, b| off(a.2).total_cmp(&off(b.2)));
        match nearest {
            Some((phase, increment, t)) if off(t) <= 1e-9 * t.abs() => {
                format!("{phase}, increment {increment}")
            }
            _ => format!("time {time}"),
        }
    }
}

/// Says how many increments the curves leave out, or that there are none.
fn left_out(shown: usize, n: usize) -> Option<String> {
    if n == 0 {
        return Some("history.csv has no increment: none reached equilibrium".to_owned());
    }
    (shown < n).then(|| {
        format!(
            "the curves show {shown} of {n} increments, with the extremes of every probe; history.csv has all"
        )
    })
}

/// The last increment of a phase.
#[derive(Debug)]
pub(super) struct PhaseEnd {
    pub(super) phase: String,
    pub(super) increment: usize,
    /// By column.
    pub(super) values: Vec<Option<f64>>,
}

impl History {
    fn read(path: &Path, budget: &Budget, notes: &mut Vec<String>) -> Result<Self, Error> {
        let needed = ["phase", "increment", "time"];
        let table = Table::open(path, &needed)?;
        let [phase, increment, time] = needed.map(|name| table.position(name).unwrap_or_default());
        let all = 0..table.columns().len();
        let columns: Vec<usize> = all.filter(|c| ![phase, increment].contains(c)).collect();
        let name = |&column: &usize| table.columns()[column].clone();
        let names = columns.iter().map(name).collect();
        let time_at = columns.iter().position(|&column| column == time);
        let mut phases: Vec<String> = Vec::new();
        let mut of_row: Vec<usize> = Vec::new();
        let mut increments: Vec<usize> = Vec::new();
        let mut values: Vec<Vec<f64>> = vec![Vec::new(); columns.len()];
        table.rows(notes, |row| {
            if phases.last().map(String::as_bytes) != Some(row.bytes(phase)) {
                phases.push(row.text(phase));
            }
            of_row.push(phases.len() - 1);
            increments.push(row.count(increment).unwrap_or_default());
            for (values, &column) in values.iter_mut().zip(&columns) {
                values.push(row.number(column));
            }
        })?;
        let n = of_row.len();
        let of_rows = of_row.iter().map(|&phase| phases[phase].as_str());
        let of_rows = of_rows.zip(increments.iter().copied());
        let times = Times::new(of_rows, time_at.map(|at| &values[at][..]));
        let finite = |value: f64| value.is_finite().then_some(value);
        let is_last = |&row: &usize| of_row.get(row + 1) != Some(&of_row[row]);
        let last_rows: Vec<usize> = (0..n).filter(is_last).collect();
        let ends = last_rows.iter().map(|&row| PhaseEnd {
            phase: phases[of_row[row]].clone(),
            increment: increments[row],
            values: values.iter().map(|column| finite(column[row])).collect(),
        });
        let ends: Vec<PhaseEnd> = ends.collect();
        let shown = shown_rows(&values, n, budget.history_rows(columns.len()), &last_rows);
        notes.extend(left_out(shown.len(), n));
        let short_at = |column: &[f64], row: usize| Short(finite(column[row]));
        let short = |column: &Vec<f64>| shown.iter().map(|&row| short_at(column, row)).collect();
        Ok(Self {
            phase: shown.iter().map(|&row| of_row[row]).collect(),
            increment: shown.iter().map(|&row| increments[row]).collect(),
            values: values.iter().map(short).collect(),
            names,
            phases,
            ends,
            times,
        })
    }

    /// Names of the probes.
    pub(super) fn probes(&self) -> impl Iterator<Item = &str> {
        let names = self.names.iter().map(String::as_str);
        names.filter(|name| !["time", "iterations"].contains(name))
    }

    /// The last value of a column.
    pub(super) fn last(&self, name: &str) -> Option<f64> {
        let column = self.names.iter().position(|n| n == name)?;
        self.ends.last()?.values[column]
    }
}

/// Rows of the history to show: half of them evenly spaced, half where columns are lowest and
/// highest, so that no peak is lost.
fn shown_rows(columns: &[Vec<f64>], n: usize, most: usize, ends: &[usize]) -> Vec<usize> {
    if n <= most {
        return (0..n).collect();
    }
    let half = (most / 2).max(1);
    let mut rows = thinned(n, half, |_| false);
    rows.extend(extremes(columns, n, half / (2 * columns.len()).max(1)));
    if ends.len() <= most {
        rows.extend(ends);
    }
    rows.sort_unstable();
    rows.dedup();
    rows
}

impl Run {
    /// Reads a folder, which the page calls so, but for what is known of it.
    ///
    /// # Errors
    /// As [`super::write`].
    pub(super) fn read(
        name: &str,
        folder: &Path,
        known: Known,
        budget: &Budget,
    ) -> Result<Self, Error> {
        let mut notes = Vec::new();
        let history = History::read(&folder.join("history.csv"), budget, &mut notes)?;
        let summary = summary(folder, &mut notes);
        let profile = profile(folder, known, &history.times, budget, &mut notes);
        let pile_path = folder.join("pile.csv");
        let pile = pile_path
            .is_file()
            .then(|| Pile::read(&pile_path, &history.times, budget, &mut notes));
        let pile = pile.transpose().unwrap_or_else(|error| {
            notes.push(format!("pile.csv: {error}; left out"));
            None
        });
        let mut fields = Fields::read(folder, budget, &mut notes);
        if let Some(fields) = &mut fields {
            let groups = summary.head.groups.iter();
            let groups: Vec<String> = groups.map(|group| group.name.clone()).collect();
            fields.label(&groups, |time| history.times.label(time));
        }
        let log = Log::read(&folder.join("log.jsonl"), budget, &mut notes);
        Ok(Self {
            name: name.to_owned(),
            folder: folder.to_owned(),
            summary,
            history,
            profile,
            pile: pile.flatten(),
            fields,
            log,
            model: None,
            notes,
        })
    }

    /// A case that is not run, as it stands before its first phase.
    pub(super) fn before(
        folder: &Path,
        about: &About,
        wanted: &OutputRequest,
        simulation: &Simulation,
        warnings: &[String],
    ) -> Self {
        let summary = Summary {
            head: Progress::new(about, wanted, simulation).head().clone(),
            warnings: Some(warnings.to_vec()),
            ..Summary::default()
        };
        let has_pressures = simulation.problem().has_pore_pressure();
        let text = unstructured_grid(&simulation.snapshot(), has_pressures, false);
        let groups = simulation.groups().iter().map(|group| group.name.clone());
        let groups: Vec<String> = groups.collect();
        let pile = wanted.pile.iter();
        let mut notes: Vec<String> = pile
            .map(|pile| pile.description(simulation.groups()))
            .collect();
        let called = (&groups[..], "before the first phase");
        Self {
            pile: None,
            name: about.case.clone(),
            folder: folder.to_owned(),
            summary,
            history: History::default(),
            profile: None,
            fields: Fields::of_one(&text, called, &Budget::of(1), &mut notes),
            log: Log::default(),
            model: Some(Model::of(simulation, about)),
            notes,
        }
    }

    /// How it ended.
    pub(super) fn ending(&self) -> Ending {
        if self.model.is_some() {
            return Ending::NotRun;
        }
        let summary::Ending { status, error, .. } = &self.summary.ending;
        if status.is_empty() {
            return Ending::Unfinished(
                "there is no summary.json, so the run was stopped from outside or has not ended yet",
            );
        }
        if status == RUNNING {
            return Ending::Unfinished("the run was stopped from outside or has not ended yet");
        }
        if !self.log.ended && !self.log.attempts.is_empty() {
            return Ending::Unfinished(
                "log.jsonl has no end, so the run was stopped from outside or has not ended yet; \
                 summary.json may be of an earlier run",
            );
        }
        match status.as_str() {
            DONE => Ending::Done,
            status => Ending::Failed(status.to_owned(), error.clone().unwrap_or_default()),
        }
    }

    /// Its title.
    pub(super) fn title(&self) -> &str {
        match self.summary.head.title.as_str() {
            "" => &self.name,
            title => title,
        }
    }

    /// Warnings of the run and of its laws, each once.
    pub(super) fn warnings(&self) -> Vec<String> {
        let of_run = self.summary.warnings.iter().flatten();
        let laws = self.summary.head.laws.values();
        let of_laws = laws.flat_map(|law| &law.warnings);
        let mut warnings: Vec<String> = Vec::new();
        let mut add = |warning: &str| {
            if !warning.is_empty() && !warnings.iter().any(|w| w == warning) {
                warnings.push(warning.to_owned());
            }
        };
        of_run.chain(of_laws).for_each(|warning| add(warning));
        // An interrupted run has not come to its summary of them.
        if self.summary.warnings.is_none() {
            self.log.unreliable.iter().for_each(|warning| add(warning));
        }
        warnings
    }

    /// Units of probes, of the quantities of profiles and fields, of internal variables.
    pub(super) fn units(&self) -> BTreeMap<&str, &str> {
        let mut units: BTreeMap<&str, &str> = BTreeMap::new();
        let profile = self.profile.iter().flat_map(|profile| &profile.columns);
        let fields = self.fields.iter().flat_map(|fields| &fields.names);
        for name in profile.chain(fields) {
            let unit = match name.split_once('_') {
                _ if Pressure::named(name).is_some() => "kPa",
                Some(("stress" | "traction", _)) => "kPa",
                Some(("jump", _)) => "m",
                _ => continue,
            };
            units.insert(name, unit);
        }
        units.insert("displacement", "m");
        for law in self.summary.head.laws.values() {
            for variable in &law.internal_variables {
                units.insert(&variable.id, &variable.unit);
            }
        }
        for (probe, unit) in &self.summary.head.probe_units {
            units.insert(probe, unit.as_deref().unwrap_or_default());
        }
        units.retain(|_, unit| !unit.is_empty());
        units
    }
}

/// The values along interfaces, if there are any: what is known, if that is what the file holds by its length.
fn profile(
    folder: &Path,
    known: Known,
    times: &Times,
    budget: &Budget,
    notes: &mut Vec<String>,
) -> Option<Profile> {
    let path = folder.join("profile.csv");
    let found = path.metadata().ok().filter(Metadata::is_file)?;
    let known = known.profile.filter(|(length, _)| *length == found.len());
    if let Some((_, profiles)) = known {
        return Profile::of(profiles, times, notes);
    }
    Profile::read(&path, times, budget, notes).unwrap_or_else(|error| {
        notes.push(format!("profile.csv: {error}; left out"));
        None
    })
}

fn summary(folder: &Path, notes: &mut Vec<String>) -> Summary {
    let text = match std::fs::read_to_string(folder.join(summary::FILE_NAME)) {
        Ok(text) => text,
        Err(error) => {
            if error.kind() != std::io::ErrorKind::NotFound {
                notes.push(format!("summary.json: {error}"));
            }
            return Summary::default();
        }
    };
    serde_json::from_str(&text).unwrap_or_else(|error| {
        notes.push(format!("summary.json: {error}"));
        Summary::default()
    })
}
