//! `log.jsonl`: iterations and cut-backs.

use super::short::Short;
use serde::Serialize;
use serde_json::Value;
use std::path::Path;

/// More iterations than this are not shown; the last ones are kept.
const MOST_ITERATIONS: usize = 20_000;

/// The convergence of a run.
#[derive(Debug, Default, Serialize)]
pub(super) struct Log {
    /// Attempts at equilibrium, in order.
    pub(super) attempts: Vec<Attempt>,
    /// Attempts that came to nothing.
    pub(super) cut_backs: Vec<CutBack>,
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
#[derive(Debug, Serialize)]
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
    pub(super) fn read(path: &Path, notes: &mut Vec<String>) -> Self {
        let text = match std::fs::read(path) {
            Ok(bytes) => String::from_utf8_lossy(&bytes).into_owned(),
            Err(error) => {
                notes.push(format!(
                    "log.jsonl: {error}; there is no convergence history"
                ));
                return Self::default();
            }
        };
        let mut log = Self::default();
        let mut broken = Vec::new();
        for (number, line) in text.lines().enumerate() {
            match serde_json::from_str::<Value>(line) {
                Ok(event) => log.take(&event),
                Err(_) => broken.push(number + 1),
            }
        }
        if let Some(first) = broken.first() {
            notes.push(format!(
                "log.jsonl: {} not complete and left out, the first is line {first}",
                match broken.len() {
                    1 => "1 line is".to_owned(),
                    n => format!("{n} lines are"),
                }
            ));
        }
        log.shorten(notes);
        log
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
                }
            }
            Some("cut_back") => self.cut_backs.push(CutBack {
                phase: text("phase"),
                increment,
                load_factor: number("load_factor"),
                next_step: number("next_step"),
                reason: text("reason"),
                attempt: self.attempts.len().checked_sub(1),
            }),
            Some("unreliable") => self.unreliable.push(format!(
                "phase `{}`, increment {increment}: {}",
                text("phase"),
                text("reason")
            )),
            Some("end") => self.ended = true,
            _ => (),
        }
    }

    fn shorten(&mut self, notes: &mut Vec<String>) {
        let mut left = MOST_ITERATIONS;
        let kept = self
            .attempts
            .iter()
            .rev()
            .take_while(|attempt| {
                let fits = attempt.residuals.len() <= left;
                left = left.saturating_sub(attempt.residuals.len());
                fits
            })
            .count();
        let gone = self.attempts.len() - kept;
        if gone == 0 {
            return;
        }
        self.attempts.drain(..gone);
        for cut_back in &mut self.cut_backs {
            cut_back.attempt = cut_back.attempt.and_then(|n| n.checked_sub(gone));
        }
        notes.push(format!(
            "the convergence history shows the last {MOST_ITERATIONS} iterations only; \
             log.jsonl has all"
        ));
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
        let log = Log::read(&folder, &mut notes);
        std::fs::remove_file(&folder).unwrap();
        assert_eq!(log.attempts.len(), 1);
        assert_eq!(log.attempts[0].residuals, [Short::from(1.0), Short(None)]);
        assert_eq!(log.cut_backs[0].attempt, Some(0));
        assert_eq!(notes.len(), 1);
        assert!(notes[0].contains("line 4"), "{}", notes[0]);
    }
}
