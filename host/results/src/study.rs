//! A study in a folder. `study.json` describes it. `runs.csv` has a row for each run, made at the start, and its
//! outputs once it ends. `effects.csv` has the effects of the parameters on the outputs, written with the report.
//! `run.json` in the folder of each run has its progress. The folders are authoritative: the table's column `state`
//! follows them.

mod bootstrap;
mod effects;
mod history;
mod indices;

pub use effects::{Design, Effect, Level, effects};
pub use history::History;
pub use indices::{Estimate, Indices, indices};

use crate::run_table::shown;
use crate::table::comma_separated;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::fs::{File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};
use text::Error;
use text::write::replace_whole;

/// Definition of a study, in its folder.
pub const RECORD: &str = "study.json";
/// Its runs.
pub const TABLE: &str = "runs.csv";
/// Effects of the parameters.
pub const EFFECTS: &str = "effects.csv";
/// How far a run has come, in its folder.
const RUN: &str = "run.json";
/// Held by whoever carries the run out, or writes the table.
const LOCK: &str = ".lock";
/// Columns of the table before the parameters, and behind them.
const FIRST: [&str; 2] = ["index", "folder"];
const LAST: [&str; 2] = ["state", "reason"];

/// Definition of a study.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Record {
    /// The program.
    pub program: String,
    /// Title, or the name.
    pub title: String,
    /// How the values were chosen, in words.
    pub design: String,
    /// Whether its runs are all combinations of the parameters' values.
    pub is_grid: bool,
    /// Whether its runs are those of base points, for [`indices`].
    #[serde(default)]
    pub is_saltelli: bool,
    /// Texts of study and case, and the program, as one number.
    pub texts: String,
    /// What all runs depend on: these texts and the libraries.
    pub identity: String,
    /// The libraries and meshes that the runs were planned with: by the name of each the sums of what is in it, of
    /// which there are several where a parameter chooses one.
    #[serde(default)]
    pub files: BTreeMap<String, BTreeSet<String>>,
    /// What varies.
    pub parameters: Vec<ParameterRecord>,
    /// What counts.
    pub outputs: Vec<Output>,
}

/// What varies.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ParameterRecord {
    /// Column of the table.
    pub name: String,
    /// Keys of the case that have its value.
    pub keys: Vec<String>,
    /// Its values in words.
    pub spread: String,
}

/// Which value of a probe counts.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum Take {
    /// The last one.
    #[default]
    Final,
    /// The largest.
    Max,
    /// The smallest.
    Min,
}

/// A number of each run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Output {
    /// Its name.
    pub name: String,
    /// Column of `history.csv`.
    pub probe: String,
    /// Which of its values.
    pub take: Take,
    /// Instead: where this column first comes to this value.
    pub at: Option<(String, f64)>,
    /// Only of this phase.
    pub phase: Option<String>,
}

impl Output {
    /// The last value of a column, called as that is.
    pub fn last(column: &str) -> Self {
        Self {
            name: column.to_owned(),
            probe: column.to_owned(),
            take: Take::Final,
            at: None,
            phase: None,
        }
    }
}

/// How far a run has come.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "String", into = "String")]
pub enum State {
    /// Nothing was done yet.
    Planned,
    /// It is being carried out.
    Running,
    /// The process that carried it out was ended; it goes on from its last checkpoint.
    Lost,
    /// It was stopped as asked, and goes on from its last checkpoint.
    Interrupted,
    /// It has come to its end.
    Done,
    /// It could not come to its end: how a run's summary calls that.
    Failed(String),
}

impl State {
    /// As tables have it.
    pub fn word(&self) -> &str {
        match self {
            Self::Planned => "planned",
            Self::Running => "running",
            Self::Lost => "lost",
            Self::Interrupted => "interrupted",
            Self::Done => "done",
            Self::Failed(status) => status,
        }
    }

    /// Whether nothing is left to be done.
    pub fn is_final(&self) -> bool {
        matches!(self, Self::Done | Self::Failed(_))
    }
}

impl From<State> for String {
    fn from(state: State) -> Self {
        state.word().to_owned()
    }
}

impl From<String> for State {
    fn from(word: String) -> Self {
        let all = [
            Self::Planned,
            Self::Running,
            Self::Lost,
            Self::Interrupted,
            Self::Done,
        ];
        let same = all.into_iter().find(|state| state.word() == word);
        same.unwrap_or(Self::Failed(word))
    }
}

/// A run's state, with the reason where there is one.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Standing {
    /// How far it has come.
    pub state: State,
    /// Why not further.
    pub reason: String,
}

impl Standing {
    /// A state that needs no reason.
    pub fn plain(state: State) -> Self {
        Self {
            state,
            reason: String::new(),
        }
    }
}

/// `run.json`.
#[derive(Debug, Serialize, Deserialize)]
struct RunRecord {
    identity: String,
    #[serde(flatten)]
    standing: Standing,
}

/// The folder of a run, held by the process that carries it out.
#[derive(Debug)]
pub struct Held {
    folder: PathBuf,
    identity: String,
    _lock: File,
}

impl Held {
    /// Takes the folder of a run, and makes it if need be. `None`: another process has it.
    ///
    /// # Errors
    /// [`Error::Unwritable`].
    pub fn take(folder: &Path) -> Result<Option<Self>, Error> {
        std::fs::create_dir_all(folder).map_err(|error| Error::unwritable(folder, error))?;
        Ok(lock(folder)?.map(|lock| Self {
            folder: folder.to_owned(),
            identity: String::new(),
            _lock: lock,
        }))
    }

    /// Says that the run is under way. `identity`: what its results depend on.
    ///
    /// # Errors
    /// [`Error::Unwritable`].
    pub fn begin(&mut self, identity: &str) -> Result<(), Error> {
        identity.clone_into(&mut self.identity);
        self.end(&Standing::plain(State::Running))
    }

    /// Says how far it has come.
    ///
    /// # Errors
    /// [`Error::Unwritable`].
    pub fn end(&self, standing: &Standing) -> Result<(), Error> {
        write_run(
            &self.folder,
            &RunRecord {
                identity: self.identity.clone(),
                standing: standing.clone(),
            },
        )
    }
}

/// Takes the lock of a folder; `None`: another process has it. Some file systems know no locks: there
/// nobody is kept out.
fn lock(folder: &Path) -> Result<Option<File>, Error> {
    let path = folder.join(LOCK);
    let mut options = File::options();
    let file = options.create(true).truncate(false).write(true).open(&path);
    let file = file.map_err(|error| Error::unwritable(&path, error))?;
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => Ok(None),
        _ => Ok(Some(file)),
    }
}

/// Takes the table of a study; `None`: another process has it.
///
/// # Errors
/// [`Error::Unwritable`].
pub fn take_table(folder: &Path) -> Result<Option<File>, Error> {
    std::fs::create_dir_all(folder).map_err(|error| Error::unwritable(folder, error))?;
    lock(folder)
}

fn write_run(folder: &Path, record: &RunRecord) -> Result<(), Error> {
    let text = serde_json::to_string(record).map_err(|e| Error::Internal(e.to_string()))?;
    replace_whole(&folder.join(RUN), text + "\n")
}

fn read_run(folder: &Path) -> Option<RunRecord> {
    let text = std::fs::read_to_string(folder.join(RUN)).ok()?;
    serde_json::from_str(&text).ok()
}

/// What the results in the folder of a run depend on; `None` if it was not begun.
pub fn identity_of_run(folder: &Path) -> Option<String> {
    read_run(folder).map(|record| record.identity)
}

/// Forgets how far a run has come; its results stay until it begins again.
///
/// # Errors
/// [`Error::Unwritable`].
pub fn forget_run(folder: &Path) -> Result<(), Error> {
    let path = folder.join(RUN);
    match std::fs::remove_file(&path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => {
            Err(Error::unwritable(&path, error))
        }
        _ => crate::checkpoint::remove(folder),
    }
}

/// How far the run in this folder has come.
pub fn standing(folder: &Path) -> Standing {
    let Some(record) = read_run(folder) else {
        return Standing::plain(State::Planned);
    };
    match record.standing.state {
        // Without a lock to be had, nobody is there any more.
        State::Running if !is_held(folder) => Standing::plain(State::Lost),
        // What was done has its results; a run without them has been, and is begun anew.
        State::Done if !History::has_rows(folder) => Standing {
            state: State::Lost,
            reason: "its history.csv is gone, or has no rows".to_owned(),
        },
        _ => record.standing,
    }
}

fn is_held(folder: &Path) -> bool {
    let file = File::open(folder.join(LOCK));
    file.is_ok_and(|file| matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock)))
}

/// Has the record of a run that could not write it any more say how it ended. Whether there is one.
///
/// # Errors
/// [`Error::Unwritable`].
pub fn end_run(folder: &Path, standing: &Standing) -> Result<bool, Error> {
    match read_run(folder) {
        Some(record) if record.standing.state == State::Running => {
            let standing = standing.clone();
            write_run(folder, &RunRecord { standing, ..record })?;
            Ok(true)
        }
        _ => Ok(false),
    }
}

/// A row of the table of runs.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Its number, from 1.
    pub index: usize,
    /// Its folder inside that of the study.
    pub folder: String,
    /// Values of the parameters: texts without quotes, all else as the case file has it.
    pub values: Vec<String>,
    /// What counts of its results, by output; `None` as long as none exists.
    pub numbers: Vec<Option<f64>>,
    /// How far it has come.
    pub standing: Standing,
}

/// Whether a folder is that of a study.
pub fn is_study(folder: &Path) -> bool {
    folder.join(RECORD).is_file() && folder.join(TABLE).is_file()
}

impl Record {
    /// The first of these files that was another one when the study was planned, by its name. A
    /// file that did not exist then does not count.
    pub fn changed(&self, files: impl Iterator<Item = (String, String)>) -> Option<String> {
        let is_other = |(name, sum): &(String, String)| {
            let planned = self.files.get(name);
            planned.is_some_and(|planned| !planned.contains(sum))
        };
        let mut files = files;
        files.find(is_other).map(|(name, _)| name)
    }

    /// Reads the record of the study in a folder.
    ///
    /// # Errors
    /// [`Error::Unreadable`]; [`Error::Usage`] if a study has not written it.
    pub fn read(folder: &Path) -> Result<Self, Error> {
        let path = folder.join(RECORD);
        let text = std::fs::read_to_string(&path);
        let text = text.map_err(|why| Error::unreadable(&path, why))?;
        serde_json::from_str(&text).map_err(|error| not_ours(&path, &error))
    }

    /// Writes it.
    ///
    /// # Errors
    /// [`Error::Unwritable`].
    pub fn write(&self, folder: &Path) -> Result<(), Error> {
        let text = serde_json::to_string_pretty(self);
        let text = text.map_err(|error| Error::Internal(error.to_string()))?;
        replace_whole(&folder.join(RECORD), text + "\n")
    }

    /// Writes the table of runs.
    ///
    /// # Errors
    /// [`Error::Unwritable`].
    pub fn write_table(&self, folder: &Path, rows: &[Row]) -> Result<(), Error> {
        let path = folder.join(TABLE);
        let body = rows.iter().map(|row| {
            let mut cells = vec![row.index.to_string(), row.folder.clone()];
            cells.extend(row.values.iter().cloned());
            let numbers = row.numbers.iter();
            cells.extend(numbers.map(|number| shown(&(*number).into())));
            cells.push(row.standing.state.word().to_owned());
            cells.push(row.standing.reason.clone());
            cells
        });
        let table = comma_separated(self.columns(), body)?;
        replace_whole(&path, table)
    }

    /// Names of the table's columns, each once: an output that is called as a column before it is marked.
    fn columns(&self) -> Vec<String> {
        let parameters = self
            .parameters
            .iter()
            .map(|parameter| parameter.name.clone());
        let mut names: Vec<String> = FIRST.iter().map(|name| (*name).to_owned()).collect();
        names.extend(parameters);
        for output in &self.outputs {
            let is_taken = names.contains(&output.name) || LAST.contains(&output.name.as_str());
            names.push(if is_taken {
                format!("{} (output)", output.name)
            } else {
                output.name.clone()
            });
        }
        names.extend(LAST.iter().map(|name| (*name).to_owned()));
        names
    }

    /// Notes in a row how far its run has come, and what counts of its results as soon as it has an end.
    pub fn note(&self, folder: &Path, row: &mut Row, standing: Standing) {
        let history = History::read_if(standing.state.is_final(), &folder.join(&row.folder));
        let is_done = standing.state == State::Done;
        let outputs = self.outputs.iter();
        row.numbers = outputs
            .map(|output| history.counted(output, is_done))
            .collect();
        row.standing = standing;
    }

    /// Reads the table of runs, as it was written.
    ///
    /// # Errors
    /// [`Error::Unreadable`]; [`Error::Usage`] if a study has not written it.
    pub fn read_table(&self, folder: &Path) -> Result<Vec<Row>, Error> {
        let path = folder.join(TABLE);
        let text = std::fs::read(&path).map_err(|why| Error::unreadable(&path, why))?;
        let mut rows = Vec::new();
        let (n, m) = (self.parameters.len(), self.outputs.len());
        for record in csv::Reader::from_reader(text.as_slice()).records() {
            let record = record.map_err(|error| not_ours(&path, &error))?;
            let cells: Vec<&str> = record.iter().collect();
            let index = cells.first().and_then(|index| index.parse().ok());
            let (Some(index), true) = (index, cells.len() == FIRST.len() + n + m + LAST.len())
            else {
                let why = format!("row {} is not one of this study", rows.len() + 1);
                return Err(not_ours(&path, &why));
            };
            rows.push(Row {
                index,
                folder: cells[1].to_owned(),
                values: cells[2..2 + n].iter().map(ToString::to_string).collect(),
                numbers: cells[2 + n..][..m]
                    .iter()
                    .map(|cell| cell.parse().ok())
                    .collect(),
                standing: Standing {
                    state: cells[2 + n + m].to_owned().into(),
                    reason: cells[3 + n + m].to_owned(),
                },
            });
        }
        Ok(rows)
    }

    /// The runs as their folders show them.
    ///
    /// # Errors
    /// As [`Record::read_table`].
    pub fn runs(&self, folder: &Path) -> Result<Vec<Row>, Error> {
        let mut rows = self.read_table(folder)?;
        for row in &mut rows {
            row.standing = standing(&folder.join(&row.folder));
        }
        Ok(rows)
    }
}

fn not_ours(path: &Path, why: &dyn std::fmt::Display) -> Error {
    Error::Usage(format!("{}: not written by a study: {why}", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record() -> Record {
        Record {
            program: "pilum".to_owned(),
            title: "t".to_owned(),
            design: "grid".to_owned(),
            is_grid: true,
            is_saltelli: false,
            texts: String::new(),
            identity: String::new(),
            files: BTreeMap::new(),
            parameters: vec![ParameterRecord {
                name: "phi".to_owned(),
                keys: vec!["laws.a.parameters.phi".to_owned()],
                spread: "20, 30".to_owned(),
            }],
            outputs: vec![Output::last("tau")],
        }
    }

    #[test]
    fn a_table_reads_back_as_it_was_written() {
        let folder = std::env::temp_dir().join(format!("pilum_table_{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let row = |index, state, reason: &str| Row {
            index,
            folder: format!("{index:05}"),
            values: vec!["a, \"b\"\nc".to_owned()],
            numbers: vec![(index == 3).then_some(0.1 + 0.2)],
            standing: Standing {
                state,
                reason: reason.to_owned(),
            },
        };
        let rows = [
            row(1, State::Planned, ""),
            row(
                2,
                State::Failed("no equilibrium".to_owned()),
                "why,\nand \"how\"",
            ),
            row(3, State::Done, ""),
        ];
        record().write_table(&folder, &rows).unwrap();
        assert_eq!(record().read_table(&folder).unwrap(), rows);
        let mut twice = record();
        twice.outputs.push(Output::last("phi"));
        let columns = [
            "index",
            "folder",
            "phi",
            "tau",
            "phi (output)",
            "state",
            "reason",
        ];
        assert_eq!(twice.columns(), columns);
        std::fs::write(folder.join(TABLE), "index,folder\n1,2\n").unwrap();
        assert!(record().read_table(&folder).is_err());
        std::fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn a_run_that_nobody_holds_is_lost() {
        let folder = std::env::temp_dir().join(format!("pilum_held_{}", std::process::id()));
        assert_eq!(standing(&folder).state, State::Planned);
        let mut held = Held::take(&folder).unwrap().unwrap();
        held.begin("x").unwrap();
        assert_eq!(standing(&folder).state, State::Running);
        assert!(Held::take(&folder).unwrap().is_none());
        drop(held);
        assert_eq!(standing(&folder).state, State::Lost);
        let failed = Standing {
            state: State::Failed("plugin trouble".to_owned()),
            reason: "crashed".to_owned(),
        };
        assert!(end_run(&folder, &failed).unwrap());
        assert_eq!(standing(&folder), failed);
        // What has an end keeps it.
        assert!(!end_run(&folder, &Standing::plain(State::Lost)).unwrap());
        assert_eq!(identity_of_run(&folder).as_deref(), Some("x"));
        forget_run(&folder).unwrap();
        assert_eq!(standing(&folder).state, State::Planned);
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
