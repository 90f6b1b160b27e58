//! The runs of the study for an accuracy, as a table.

use super::super::driver_study::in_one_line;
use super::super::settings::Settings;
use crate::Error;
use crate::experiment::{Trial, write};
use std::path::{Path, PathBuf};

/// `accuracy.csv`: a row for every run of the study.
pub(super) struct Table {
    path: PathBuf,
    text: String,
}

impl Table {
    /// Begins the table in a folder.
    pub(super) fn begin(folder: &Path) -> Result<Self, Error> {
        let table = Self {
            path: folder.join("accuracy.csv"),
            text: "run,setting,cpu_seconds,iterations,change,error,failure\n".to_owned(),
        };
        table.write()?;
        Ok(table)
    }

    /// Adds a run: its trial, by how much it differs from the one before it, the error that is estimated
    /// for it.
    pub(super) fn row(
        &mut self,
        (run, settings): (usize, &Settings),
        outcome: Result<&Trial, &Error>,
        [change, error]: [Option<f64>; 2],
    ) -> Result<(), Error> {
        let number = |value: Option<f64>| value.map(|v| format!("{v:e}")).unwrap_or_default();
        let quoted = |text: &str| format!("\"{}\"", text.replace('"', "\"\""));
        let label = quoted(&settings.label());
        let row = match outcome {
            Ok(trial) => format!(
                "{run},{label},{:e},{},{},{},\n",
                trial.seconds,
                trial.counts.iterations,
                number(change),
                number(error)
            ),
            Err(error) => format!("{run},{label},,,,,{}\n", quoted(&in_one_line(error))),
        };
        self.text += &row;
        self.write()
    }

    fn write(&self) -> Result<(), Error> {
        write(&self.path, &self.text)
    }
}
