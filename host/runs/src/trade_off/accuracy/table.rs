//! The runs of the study for an accuracy, as a table.

use super::super::driver_study::in_one_line;
use super::super::settings::Settings;
use crate::Error;
use crate::experiment::{Trial, csv, write};
use std::path::{Path, PathBuf};

/// `accuracy.csv`: a row for every run of the study.
pub(super) struct Table {
    path: PathBuf,
    rows: Vec<Vec<String>>,
}

const COLUMNS: &str = "run,setting,cpu_seconds,iterations,change,error,failure";

impl Table {
    /// Begins the table in a folder.
    pub(super) fn begin(folder: &Path) -> Result<Self, Error> {
        let table = Self {
            path: folder.join("accuracy.csv"),
            rows: Vec::new(),
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
        told: [Option<f64>; 2],
    ) -> Result<(), Error> {
        let number = |value: Option<f64>| value.map(|v| format!("{v:e}")).unwrap_or_default();
        let trial = outcome.ok();
        let mut row = vec![run.to_string(), settings.label()];
        row.push(number(trial.map(|trial| trial.seconds)));
        let iterations = trial.map(|trial| trial.counts.iterations.to_string());
        row.push(iterations.unwrap_or_default());
        row.extend(told.map(number));
        row.push(outcome.err().map(in_one_line).unwrap_or_default());
        self.rows.push(row);
        self.write()
    }

    fn write(&self) -> Result<(), Error> {
        let rows = self.rows.iter().cloned();
        write(&self.path, &csv(COLUMNS.split(','), rows)?)
    }
}
