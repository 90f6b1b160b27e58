//! Runs of case texts in temporary folders, and what the tests read from their results.

use input::Error;
use serde_json::Value;
use std::path::Path;
use tempfile::TempDir;
use tests::case::{Silent, column, run_text, table};

/// A run and its results.
#[derive(Debug)]
pub(crate) struct Finished {
    folder: TempDir,
    /// Warnings and cut-backs.
    pub(crate) observer: Silent,
}

/// A run that ended with an error, and what it left behind.
#[derive(Debug)]
pub(crate) struct Failed {
    folder: TempDir,
    /// The error.
    pub(crate) error: Error,
}

/// Runs a case that must end well.
pub(crate) fn run(text: &str) -> Finished {
    let folder = tempfile::tempdir().unwrap();
    match run_text(text, folder.path()) {
        Ok(observer) => Finished { folder, observer },
        Err(error) => panic!("{error}\n{text}"),
    }
}

/// Runs a case that must not end well.
pub(crate) fn fail(text: &str) -> Failed {
    let folder = tempfile::tempdir().unwrap();
    match run_text(text, folder.path()) {
        Ok(_) => panic!("the run ended well\n{text}"),
        Err(error) => Failed { folder, error },
    }
}

/// A folder of results.
pub(crate) trait Results {
    /// Their place.
    fn folder(&self) -> &Path;

    /// Values of a probe in `history.csv`, all phases.
    fn history(&self, probe: &str) -> Vec<f64> {
        column(&self.folder().join("history.csv"), probe)
    }

    /// Value of a probe after the last increment.
    fn last(&self, probe: &str) -> f64 {
        *self.history(probe).last().expect("an increment")
    }

    /// Asserts that a probe ends at this value, to a part of the scale.
    #[track_caller]
    fn ends_at(&self, probe: &str, expected: f64, tolerance: f64, scale: f64) {
        assert_close(probe, self.last(probe), expected, tolerance, scale);
    }

    /// Values of a probe in one phase.
    fn in_phase(&self, phase: &str, probe: &str) -> Vec<f64> {
        let rows = table(&self.folder().join("history.csv"));
        let rows = rows.iter().filter(|row| row["phase"] == phase);
        rows.map(|row| row[probe].parse().expect("a number"))
            .collect()
    }

    /// Value of a probe at the end of a phase.
    fn end_of(&self, phase: &str, probe: &str) -> f64 {
        *self.in_phase(phase, probe).last().expect("an increment")
    }

    /// `summary.json`.
    fn summary(&self) -> Value {
        let text = std::fs::read_to_string(self.folder().join("summary.json")).unwrap();
        serde_json::from_str(&text).unwrap()
    }

    /// Events of `log.jsonl` of one kind.
    fn events(&self, kind: &str) -> Vec<Value> {
        let text = std::fs::read_to_string(self.folder().join("log.jsonl")).unwrap();
        let events = text
            .lines()
            .map(|line| serde_json::from_str::<Value>(line).unwrap());
        events.filter(|event| event["event"] == kind).collect()
    }

    /// Residuals of an increment's iterations, in order.
    fn residuals(&self, phase: &str, increment: usize) -> Vec<f64> {
        let events = self.events("iteration");
        let here = events
            .iter()
            .filter(|e| e["phase"] == phase && e["increment"] == increment);
        here.map(|e| e["residual"].as_f64().expect("a number"))
            .collect()
    }
}

impl Results for Finished {
    fn folder(&self) -> &Path {
        self.folder.path()
    }
}

impl Results for Failed {
    fn folder(&self) -> &Path {
        self.folder.path()
    }
}

/// Asserts |value − expected| ≤ tolerance · scale and says what was compared.
#[track_caller]
pub(crate) fn assert_close(what: &str, value: f64, expected: f64, tolerance: f64, scale: f64) {
    let difference = value - expected;
    assert!(
        difference.abs() <= tolerance * scale,
        "{what}: {value:.12e}, expected {expected:.12e}, difference {difference:.2e}, \
         allowed {:.2e}",
        tolerance * scale
    );
}

/// Lamé's constants: λ, G, and the oedometric modulus M = λ + 2G.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lame {
    /// λ.
    pub(crate) lambda: f64,
    /// Shear modulus.
    pub(crate) shear: f64,
    /// λ + 2G.
    pub(crate) oedometric: f64,
}

impl Lame {
    /// From Young's modulus and Poisson's ratio.
    pub(crate) fn new(young_modulus: f64, poisson_ratio: f64) -> Self {
        let shear = young_modulus / (2.0 * (1.0 + poisson_ratio));
        let lambda = 2.0 * shear * poisson_ratio / (1.0 - 2.0 * poisson_ratio);
        Self {
            lambda,
            shear,
            oedometric: lambda + 2.0 * shear,
        }
    }
}

/// A law `elastic` of this name, as a line under `[laws]`.
pub(crate) fn elastic(name: &str, young_modulus: f64, poisson_ratio: f64) -> String {
    format!(
        "{name} = {{ law = \"elastic\", parameters = {{ young_modulus = {young_modulus:e}, \
         poisson_ratio = {poisson_ratio} }} }}\n"
    )
}

/// Columns or rows that end at these coordinates, one of each size, as a TOML array.
pub(crate) fn grid(ends: &[f64]) -> String {
    let parts: Vec<String> = ends
        .iter()
        .map(|to| format!("{{ n = 1, to = {to:?} }}"))
        .collect();
    format!("[{}]", parts.join(", "))
}
