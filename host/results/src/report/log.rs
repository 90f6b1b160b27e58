//! `log.jsonl`: iterations and cut-backs.

use super::budget::Budget;
use super::number_format::Short;
use super::table::Broken;
use serde::Serialize;
use serde_json::Value;
use std::io::{self, BufRead, BufReader};
use std::path::Path;
use text::file::open_regular;

/// Number of cut-backs in the table.
const IN_TABLE: usize = 100;
/// Number of reported increments whose results a law calls inaccurate.
const TOLD: usize = 20;

/// The convergence of a run.
#[derive(Debug, Default, Serialize)]
pub(super) struct Log {
    /// Attempts at equilibrium, in order.
    pub(super) attempts: Vec<Attempt>,
    /// Those of them that came to nothing.
    cut_backs: Vec<CutBack>,
    /// The first of all that came to nothing, and their number.
    #[serde(skip)]
    pub(super) first_cut_backs: Vec<CutBack>,
    #[serde(skip)]
    pub(super) n_cut_backs: usize,
    /// Attempts that are no longer kept, and iterations of those that are.
    #[serde(skip)]
    forgotten: usize,
    #[serde(skip)]
    n_iterations: usize,
    /// Increments with results that a law calls inaccurate.
    #[serde(skip)]
    pub(super) unreliable: Vec<String>,
    /// The run came to its end, good or bad.
    #[serde(skip)]
    pub(super) ended: bool,
}

/// The iterations of one step.
#[derive(Debug, Serialize)]
pub(super) struct Attempt {
    pub(super) phase: String,
    pub(super) increment: u64,
    pub(super) load_factor: Short,
    pub(super) residuals: Vec<Short>,
}

/// A step given up.
#[derive(Clone, Debug, Serialize)]
pub(super) struct CutBack {
    pub(super) phase: String,
    pub(super) increment: u64,
    pub(super) load_factor: Short,
    pub(super) next_step: Short,
    pub(super) reason: String,
    /// Number of the attempt.
    pub(super) attempt: Option<usize>,
}

impl Log {
    /// Reads a log as far as it goes.
    pub(super) fn read(path: &Path, budget: &Budget, notes: &mut Vec<String>) -> Self {
        let mut log = Self::default();
        if let Err(error) = log.read_lines(path, budget, notes) {
            notes.push(format!(
                "log.jsonl: {error}; there is no convergence history"
            ));
            return Self::default();
        }
        log.forget(budget.iterations);
        if log.forgotten > 0 {
            notes.push(format!(
                "the convergence history shows the last {} iterations only; log.jsonl has all",
                log.n_iterations
            ));
        }
        log
    }

    fn read_lines(
        &mut self,
        path: &Path,
        budget: &Budget,
        notes: &mut Vec<String>,
    ) -> io::Result<()> {
        let mut file = BufReader::with_capacity(1 << 16, open_regular(path)?);
        let mut broken = Broken::default();
        let mut line = Vec::new();
        for number in 1.. {
            line.clear();
            if file.read_until(b'\n', &mut line)? == 0 {
                break;
            }
            match serde_json::from_slice::<Value>(&line) {
                Ok(event) => self.take(&event),
                Err(_) => broken.add(number),
            }
            if self.n_iterations > 2 * budget.iterations {
                self.forget(budget.iterations);
            }
        }
        notes.extend(broken.note("log.jsonl", "line", "is line"));
        Ok(())
    }

    fn take(&mut self, event: &Value) {
        let text = |key: &str| event[key].as_str().unwrap_or_default().to_owned();
        let number = |key: &str| Short(event[key].as_f64());
        let increment = event["increment"].as_u64().unwrap_or_default();
        match event["event"].as_str() {
            Some("iteration") => {
                let starts = event["iteration"].as_u64() == Some(0);
                if starts || self.attempts.is_empty() {
                    self.attempts.push(Attempt {
                        phase: text("phase"),
                        increment,
                        load_factor: number("load_factor"),
                        residuals: Vec::new(),
                    });
                }
                if let Some(attempt) = self.attempts.last_mut() {
                    attempt.residuals.push(number("residual"));
                    self.n_iterations += 1;
                }
            }
            Some("cut_back") => {
                let cut_back = CutBack {
                    phase: text("phase"),
                    increment,
                    load_factor: number("load_factor"),
                    next_step: number("next_step"),
                    reason: text("reason"),
                    attempt: self.attempts.len().checked_sub(1),
                };
                if self.n_cut_backs < IN_TABLE {
                    self.first_cut_backs.push(cut_back.clone());
                }
                self.n_cut_backs += 1;
                self.cut_backs.push(cut_back);
            }
            Some("unreliable") if self.unreliable.len() < TOLD => self.unreliable.push(format!(
                "phase `{}`, increment {increment}: {}",
                text("phase"),
                text("reason")
            )),
            Some("end") => self.ended = true,
            _ => (),
        }
    }

    /// Forgets the first attempts, so that no more than this many iterations are left, and what cut
    /// them back.
    fn forget(&mut self, most: usize) {
        let mut gone = 0;
        while self.n_iterations > most && gone < self.attempts.len() {
            self.n_iterations -= self.attempts[gone].residuals.len();
            gone += 1;
        }
        self.attempts.drain(..gone);
        self.forgotten += gone;
        self.cut_backs.retain_mut(|cut_back| {
            cut_back.attempt = cut_back.attempt.and_then(|n| n.checked_sub(gone));
            gone == 0 || cut_back.attempt.is_some()
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_log_that_breaks_off_is_read_up_to_there() {
        let folder = std::env::temp_dir().join(format!("pilum-log-{}", std::process::id()));
        let lines = concat!(
            r#"{"event":"iteration","phase":"a","increment":1,"iteration":0,"residual":1.0,"load_factor":0.5}"#,
            "\n",
            r#"{"event":"iteration","phase":"a","increment":1,"iteration":1,"residual":null,"load_factor":0.5}"#,
            "\n",
            r#"{"event":"cut_back","phase":"a","increment":1,"load_factor":0.5,"next_step":0.25,"reason":"no"}"#,
            "\n",
            r#"{"event":"iteration","phase":"a","incr"#
        );
        std::fs::write(&folder, lines).unwrap();
        let mut notes = Vec::new();
        let log = Log::read(&folder, &Budget::of(1), &mut notes);
        std::fs::remove_file(&folder).unwrap();
        assert_eq!(log.attempts.len(), 1);
        assert_eq!(log.attempts[0].residuals, [Short::from(1.0), Short(None)]);
        assert_eq!(log.cut_backs[0].attempt, Some(0));
        assert_eq!(notes.len(), 1);
        assert!(notes[0].contains("line 4"), "{}", notes[0]);
    }
}
