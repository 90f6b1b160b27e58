//! Many runs of one case: `pilum study`.
//!
//! A [`Plan`] is the study with the values of all its runs. Its [`prepare`](Plan::prepare) checks it
//! and writes the table of runs. Then [`carry_out`] starts a process for each run, a number of them at
//! a time. Such a process, or one started by another scheduler, calls [`run_one`]. The folders of the
//! runs hold all results, so that any of these processes may be killed at any time.

mod design;
mod execution;
mod single_run;
mod sobol;

pub use execution::{Event, Jobs, carry_out};
pub use single_run::{Once, follow, mend, run_one, stop_of_worker};

use crate::Error;
use crate::run::{Ready, ready};
use input::study::{Method, Parameter, Spread};
use input::{Case, Study};
use law::{Opener, hexadecimal_sha256};
use mechanics::Simulation;
use results::study::{
    Output, ParameterRecord, Record, Row, Standing, State, forget_run, identity_of_run, is_study,
    standing,
};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use toml::Value;

/// A study with the values of its runs, and the folder of its results.
#[derive(Debug)]
pub struct Plan {
    study: Study,
    rows: Vec<Vec<Value>>,
    folder: PathBuf,
    opener: Opener,
}

impl Plan {
    /// A study file; results go to `out`, or to `results/<study>`.
    ///
    /// # Errors
    /// Bad input, at its place in the file.
    pub fn of(file: &Path, out: Option<&Path>, opener: &Opener) -> Result<Self, Error> {
        let study = Study::load(file)?;
        let folder = match out {
            Some(out) => out.to_owned(),
            None => Path::new("results").join(study.name()),
        };
        Ok(Self {
            rows: design::rows(&study)?,
            study,
            folder,
            opener: opener.clone(),
        })
    }

    /// How many runs there are.
    pub fn n_runs(&self) -> usize {
        self.rows.len()
    }

    /// Folder of the results.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Warnings about the plan before it is carried out.
    pub fn warnings(&self) -> Vec<String> {
        let (n, what) = match self.study.file.method {
            Method::Sobol => (self.rows.len(), "runs"),
            Method::Saltelli => {
                let of_each = self.study.parameters.len() + 2;
                (self.rows.len() / of_each, "base points (`runs`)")
            }
            _ => (1, ""),
        };
        let below = n.next_power_of_two() / 2;
        let warning = (!n.is_power_of_two()).then(|| {
            format!(
                "the points of Sobol' are even for 2, 4, 8, … {what}: rather {below} or {} than {n}",
                2 * below
            )
        });
        warning.into_iter().collect()
    }

    /// The values of a run.
    fn values(&self, index: usize) -> Result<&[Value], Error> {
        let row = index.checked_sub(1).and_then(|row| self.rows.get(row));
        row.map(Vec::as_slice).ok_or_else(|| {
            let n = self.rows.len();
            Error::usage(format!(
                "there is no run {index}: the study has runs 1 to {n}"
            ))
        })
    }

    /// The case of a run, as it is carried out.
    fn case(&self, values: &[Value]) -> Result<Case, Error> {
        let mut case = self.study.case(&self.opener, values)?;
        if !self.study.file.reports {
            case.file.figures.clear();
        }
        Ok(case)
    }

    /// Texts of study and case, with the program version.
    fn texts(&self, case: &Case) -> String {
        let parts = [
            env!("CARGO_PKG_VERSION"),
            self.study.source.text(),
            case.source.text_of_files(),
        ];
        hexadecimal_sha256(parts.join("\n\0\n").as_bytes())
    }

    /// Checks the values of all parameters, as far as possible without running anything. Every listed value
    /// is read. The smallest and the largest number of each parameter, and values that are not numbers, are
    /// tried in a case with the first run's values of the others. Returns the record of the study.
    ///
    /// # Errors
    /// Bad input, at its place in the study or case file; trouble with a library.
    pub fn check(&self) -> Result<Record, Error> {
        let first = self.values(1)?;
        let case = self.case(first)?;
        let placed = |error: Error| self.study.placed(error, first);
        let of_first = ready(&case).map_err(placed)?;
        let mut files: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
        let mut note = |ready: &Ready<'_>| {
            for (name, sum) in ready.files() {
                files.entry(name).or_default().insert(sum);
            }
        };
        note(&of_first);
        let problem = of_first.into_problem();
        let phases = problem.phases.iter().map(|phase| phase.name.clone());
        let phases: Vec<String> = phases.collect();
        let simulation = Simulation::new(problem).map_err(|error| placed(case.place(error)))?;
        let wanted = case.wanted(&simulation).map_err(placed)?;
        let columns: Vec<&str> = wanted.columns().collect();
        let phases: Vec<&str> = phases.iter().map(String::as_str).collect();
        let outputs = self.study.outputs(&columns, &phases)?;
        drop(simulation);
        for (number, parameter) in self.study.parameters.iter().enumerate() {
            let with = |value: &Value| {
                let mut values = first.to_vec();
                values[number] = value.clone();
                values
            };
            if let Spread::Values(values) = &parameter.spread {
                for value in values {
                    self.case(&with(value))?;
                }
            }
            for value in design::extremes(parameter) {
                let values = with(&value);
                let case = self.case(&values)?;
                let checked = ready(&case).and_then(|ready| {
                    note(&ready);
                    let simulation = Simulation::new(ready.into_problem());
                    let simulation = simulation.map_err(|error| case.place(error))?;
                    case.wanted(&simulation).map(|_| ())
                });
                checked.map_err(|error| {
                    let hint = format!("in a run with {} = {value}", parameter.name);
                    self.study.placed(error, &values).with_hint(&hint)
                })?;
            }
        }
        Ok(self.record(&case, files, outputs))
    }

    /// The record of the study: `files` that its runs name with the sums of what is in them, and `outputs`.
    fn record(
        &self,
        case: &Case,
        files: BTreeMap<String, BTreeSet<String>>,
        outputs: Vec<Output>,
    ) -> Record {
        let texts = self.texts(case);
        let mut identity = texts.clone();
        let sums: BTreeSet<&String> = files.values().flatten().collect();
        identity.extend(sums.into_iter().flat_map(|sum| [sum, "\n"]));
        let title = match self.study.file.title.as_str() {
            "" => self.study.name(),
            title => title.to_owned(),
        };
        Record {
            program: format!("pilum {}", env!("CARGO_PKG_VERSION")),
            title,
            design: self.design(),
            is_grid: self.study.file.method == Method::Grid,
            is_saltelli: self.study.file.method == Method::Saltelli,
            texts,
            identity: hexadecimal_sha256(identity.as_bytes()),
            files,
            parameters: self.study.parameters.iter().map(described).collect(),
            outputs,
        }
    }

    /// Method and seed in words.
    fn design(&self) -> String {
        let method = match self.study.file.method {
            Method::Grid => "grid",
            Method::List => "list",
            Method::LatinHypercube => "Latin hypercube",
            Method::Sobol => "points of Sobol', digital shift",
            Method::Saltelli => "Saltelli's design on points of Sobol', digital shift",
        };
        match (&self.study.file.seed, self.study.file.method) {
            (None, Method::Grid | Method::List) => method.to_owned(),
            (seed, _) => {
                let seed = seed.as_ref().map_or(0, |seed| *seed.get_ref());
                format!("{method}, seed {seed}")
            }
        }
    }

    /// Writes the record of the study, which [`Plan::check`] returned, and the table of its runs; whoever
    /// calls holds the table. Results of earlier calls are kept, unless they are to be carried
    /// out `anew`.
    ///
    /// # Errors
    /// Runs of another study in the folder; files that cannot be written.
    pub fn prepare(&self, record: &Record, anew: bool) -> Result<Vec<Row>, Error> {
        if anew {
            for index in 1..=self.rows.len() {
                forget_run(&self.folder.join(folder_of_run(index)))?;
            }
            return self.write(record);
        }
        self.prepare_beside(record, None)
    }

    /// The same with what was done of the runs, but for one that is begun again.
    fn prepare_beside(&self, record: &Record, anew: Option<usize>) -> Result<Vec<Row>, Error> {
        let is_same = is_study(&self.folder)
            && Record::read(&self.folder).is_ok_and(|old| old.identity == record.identity);
        if !is_same {
            let mut others = (1..=self.rows.len()).filter(|index| Some(*index) != anew);
            others.try_for_each(|index| self.check_run(index))?;
        }
        self.write(record)
    }

    fn write(&self, record: &Record) -> Result<Vec<Row>, Error> {
        let rows = (1..=self.rows.len()).map(|index| self.row(record, index));
        let rows: Vec<Row> = rows.collect();
        record.write(&self.folder)?;
        record.write_table(&self.folder, &rows)?;
        Ok(rows)
    }

    /// The row of a run in the table, as its folder has it.
    fn row(&self, record: &Record, index: usize) -> Row {
        let folder = folder_of_run(index);
        let mut row = Row {
            index,
            values: self.rows[index - 1].iter().map(shown).collect(),
            numbers: Vec::new(),
            standing: Standing::plain(State::Planned),
            folder,
        };
        let standing = standing(&self.folder.join(&row.folder));
        record.note(&self.folder, &mut row, standing);
        row
    }

    /// Refuses a folder that holds another run than this one.
    fn check_run(&self, index: usize) -> Result<(), Error> {
        let folder = self.folder.join(folder_of_run(index));
        match identity_of_run(&folder) {
            // It failed before it was known what it depends on.
            Some(identity) if !identity.is_empty() => {
                let case = self.case(self.values(index)?)?;
                if ready(&case)?.identity() == identity {
                    return Ok(());
                }
                Err(other_run(&folder))
            }
            _ => Ok(()),
        }
    }
}

/// Error of a folder with another run.
fn other_run(folder: &Path) -> Error {
    Error::usage(format!(
        "{}: it holds a run of another case, with other values, libraries or another version of the program: \
         --out names another folder, --anew without --run carries out all runs anew",
        folder.display()
    ))
}

/// Error if the runs of one study would use two libraries, or two meshes.
fn other_file(folder: &Path, name: &str) -> Error {
    Error::usage(format!(
        "{}: {name} is another one than the runs of this study were planned with: --out names another folder, --anew \
         without --run carries out all runs anew",
        folder.display()
    ))
}

/// The folder of a run inside that of the study.
fn folder_of_run(index: usize) -> String {
    format!("{index:05}")
}

/// A value in a table: a text without quotes.
fn shown(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}

fn described(parameter: &Parameter) -> ParameterRecord {
    let range = |what: &str, [from, to]: [f64; 2]| format!("{what} {from} … {to}");
    let spread = match &parameter.spread {
        Spread::Values(values) => {
            let texts: Vec<String> = values.iter().take(8).map(shown).collect();
            let more = if values.len() > 8 { ", …" } else { "" };
            texts.join(", ") + more
        }
        Spread::Uniform(range_of) => range("uniform", *range_of),
        Spread::LogUniform(range_of) => range("log-uniform", *range_of),
        Spread::Normal(n) => {
            let range = range("within", [n.min, n.max]);
            format!(
                "normal, mean {}, deviation {}, {range}",
                n.mean, n.deviation
            )
        }
    };
    ParameterRecord {
        name: parameter.name.clone(),
        keys: parameter.keys.clone(),
        spread,
    }
}

/// Whether a run is to be carried out.
fn is_wanted(state: &State, retry: bool) -> bool {
    match state {
        State::Planned | State::Lost | State::Interrupted => true,
        State::Failed(_) => retry,
        State::Done | State::Running => false,
    }
}
