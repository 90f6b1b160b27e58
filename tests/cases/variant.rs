//! Variants of the cases in `cases/`, each run once for all tests.

use input::{Case, Error};
use std::collections::{BTreeMap, HashMap};
use std::path::Path;
use std::sync::{Arc, LazyLock, Mutex, OnceLock};
use tempfile::TempDir;
use tests::case::{Silent, table};

/// A run that has ended.
pub(crate) struct Run {
    history: Vec<BTreeMap<String, String>>,
    points: Vec<BTreeMap<String, String>>,
    /// `summary.json`.
    pub(crate) summary: serde_json::Value,
    /// How it ended.
    pub(crate) outcome: Result<Silent, Error>,
}

/// An integration point with its stress, tension positive.
pub(crate) struct Point {
    pub(crate) group: String,
    pub(crate) x: f64,
    pub(crate) y: f64,
    /// Components 11, 22, 33, 12.
    pub(crate) stress: [f64; 4],
}

type Shelf = HashMap<(String, String), Arc<OnceLock<Arc<Run>>>>;
static RUNS: LazyLock<Mutex<Shelf>> = LazyLock::new(Mutex::default);

/// Runs a variant, `""` of a file without variants, however it ends.
pub(crate) fn run(case: &str, variant: &str) -> Arc<Run> {
    let key = (case.to_owned(), variant.to_owned());
    let place = Arc::clone(RUNS.lock().unwrap().entry(key).or_default());
    Arc::clone(place.get_or_init(|| Arc::new(Run::new(case, variant))))
}

/// Runs a variant that must reach its end.
pub(crate) fn finished(case: &str, variant: &str) -> Arc<Run> {
    let run = run(case, variant);
    if let Err(error) = &run.outcome {
        panic!("{case}, {variant}: {error}");
    }
    run
}

impl Run {
    fn new(case: &str, variant: &str) -> Self {
        let path = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("../cases")
            .join(case);
        let cases = Case::load(&path).unwrap();
        let case = cases
            .iter()
            .find(|case| case.variant.as_deref().unwrap_or("") == variant)
            .unwrap_or_else(|| panic!("no variant `{variant}`"));
        let folder = TempDir::new().unwrap();
        let file = |name| folder.path().join(name);
        let mut observer = Silent::default();
        let outcome = runs::run::run(case, folder.path(), &mut observer).map(|_| observer);
        let summary = std::fs::read_to_string(file("summary.json")).unwrap();
        let points = file("points.csv");
        Self {
            history: table(&file("history.csv")),
            points: if points.exists() {
                table(&points)
            } else {
                Vec::new()
            },
            summary: serde_json::from_str(&summary).unwrap(),
            outcome,
        }
    }

    /// Values of a probe in a phase, increment by increment.
    pub(crate) fn probe(&self, phase: &str, name: &str) -> Vec<f64> {
        let rows = self.history.iter().filter(|row| row["phase"] == phase);
        rows.map(|row| row[name].parse().unwrap()).collect()
    }

    /// A probe at the end of a phase.
    pub(crate) fn end(&self, phase: &str, name: &str) -> f64 {
        *self.probe(phase, name).last().unwrap()
    }

    /// All integration points at the end of a phase, from `points.csv`.
    pub(crate) fn points(&self, phase: &str) -> Vec<Point> {
        let rows = self.points.iter().filter(|row| row["phase"] == phase);
        rows.map(|row| {
            let number = |column: &str| row[column].parse::<f64>().unwrap();
            Point {
                group: row["group"].clone(),
                x: number("x"),
                y: number("y"),
                stress: ["stress_11", "stress_22", "stress_33", "stress_12"].map(number),
            }
        })
        .collect()
    }
}

/// |a/b − 1| ≤ tolerance.
pub(crate) fn assert_close(a: f64, b: f64, tolerance: f64, what: &str) {
    assert!((a / b - 1.0).abs() <= tolerance, "{what}: {a} against {b}");
}
