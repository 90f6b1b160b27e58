//! `log.jsonl`: every iteration and cut-back, one JSON object a line.

use crate::file::{Appended, Extent};
use mechanics::Place;
use mechanics::equilibrium::Iteration;
use serde::Serialize;
use serde_json::json;
use std::path::Path;
use text::Error;

/// Name of the file.
const FILE_NAME: &str = "log.jsonl";

/// The log of a run. As long as it is open, no other run writes into the folder.
#[derive(Debug)]
pub(crate) struct LogFile(Appended);

/// An iteration as the log has it, in the order of the other lines' keys.
#[derive(Serialize)]
struct LoggedIteration<'a> {
    correction: Option<f64>,
    event: &'static str,
    increment: usize,
    iteration: usize,
    load_factor: f64,
    phase: &'a str,
    residual: f64,
    step_length: f64,
    viscosity: f64,
}

impl LogFile {
    /// Begins the log of a folder.
    pub(crate) fn begin(folder: &Path) -> Result<Self, Error> {
        Ok(Self(Appended::begin_locked(folder.join(FILE_NAME), false)?))
    }

    /// Opens the log of an interrupted run, whose files are checked before it goes on.
    pub(crate) fn begin_again(folder: &Path) -> Result<Self, Error> {
        Ok(Self(Appended::begin_locked(folder.join(FILE_NAME), true)?))
    }

    /// Goes on after what it held.
    pub(crate) fn go_on(self, from: Extent) -> Result<Self, Error> {
        Ok(Self(self.0.go_on(from)?))
    }

    pub(crate) fn sync(&self) -> Result<Extent, Error> {
        self.0.sync()
    }

    pub(crate) fn iterations(
        &mut self,
        place: &Place,
        lambda: f64,
        iterations: &[Iteration],
    ) -> Result<(), Error> {
        let lines = iterations.iter().enumerate();
        self.lines(lines.map(|(number, iteration)| LoggedIteration {
            correction: iteration.correction,
            event: "iteration",
            increment: place.increment,
            iteration: number,
            load_factor: lambda,
            phase: &place.phase,
            residual: iteration.residual,
            step_length: iteration.step_length,
            viscosity: iteration.viscosity,
        }))
    }

    pub(crate) fn cut_back(
        &mut self,
        place: &Place,
        lambda: f64,
        step: f64,
        reason: &str,
    ) -> Result<(), Error> {
        self.lines([json!({
            "event": "cut_back",
            "phase": place.phase,
            "increment": place.increment,
            "load_factor": lambda,
            "next_step": step,
            "reason": reason,
        })])
    }

    pub(crate) fn unreliable(&mut self, place: &Place, reason: &str) -> Result<(), Error> {
        self.lines([json!({
            "event": "unreliable",
            "phase": place.phase,
            "increment": place.increment,
            "reason": reason,
        })])
    }

    pub(crate) fn end(&mut self, status: &str) -> Result<(), Error> {
        self.lines([json!({ "event": "end", "status": status })])
    }

    /// Appends all of them at once.
    fn lines(&mut self, values: impl IntoIterator<Item = impl Serialize>) -> Result<(), Error> {
        let mut text = Vec::new();
        for value in values {
            serde_json::to_writer(&mut text, &value)
                .map_err(|error| Error::Internal(error.to_string()))?;
            text.push(b'\n');
        }
        self.0.append(&text)
    }
}
