//! Running the cases of `cases/verification` with the program, and what the tests read from their results.
#![allow(
    clippy::print_stdout,
    reason = "errors are printed for the tables of the manual"
)]

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;
use tempfile::TempDir;
use tests::case::{column, table};

/// A row of a table.
pub(crate) type Row = BTreeMap<String, String>;

/// Results of a case: of its only run, or of its variants, in one folder each.
#[derive(Debug)]
pub(crate) struct Results {
    case: String,
    folder: TempDir,
}

/// The folder of the cases.
pub(crate) fn cases() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../cases/verification")
}

/// The program, which has to end well.
pub(crate) fn pilum(arguments: &[&str]) {
    let deps = std::env::current_exe()
        .unwrap()
        .parent()
        .unwrap()
        .to_owned();
    let program = deps
        .parent()
        .unwrap()
        .join(format!("pilum{}", std::env::consts::EXE_SUFFIX));
    let path = program.display();
    assert!(
        program.is_file(),
        "{path} is missing: `cargo build -p pilum`"
    );
    let output = Command::new(&program)
        .args(arguments)
        .env("PILUM_LAW_PATH", &deps)
        .env("XDG_CACHE_HOME", env!("CARGO_TARGET_TMPDIR"))
        .env("NO_COLOR", "1")
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {said}");
}

/// Runs a case, all its variants.
pub(crate) fn run(case: &str) -> Results {
    run_some(case, &[""])
}

/// Runs some variants of a case; "": all.
pub(crate) fn run_some(case: &str, variants: &[&str]) -> Results {
    let folder = tempfile::tempdir().unwrap();
    let path = cases().join(case);
    for variant in variants {
        let into = folder.path().join(variant);
        let mut arguments = vec![
            "run",
            path.to_str().unwrap(),
            "--out",
            into.to_str().unwrap(),
        ];
        if !variant.is_empty() {
            arguments.extend(["--variant", variant]);
        }
        pilum(&arguments);
    }
    Results {
        case: case.to_owned(),
        folder,
    }
}

impl Results {
    /// Values of a probe in all increments; variant "": of the case's only run.
    pub(crate) fn history(&self, variant: &str, probe: &str) -> Vec<f64> {
        column(&self.folder.path().join(variant).join("history.csv"), probe)
    }

    /// Value of a probe at the end.
    pub(crate) fn last(&self, variant: &str, probe: &str) -> f64 {
        *self.history(variant, probe).last().unwrap()
    }

    /// Value of a probe at the end of a phase.
    pub(crate) fn end(&self, variant: &str, phase: &str, probe: &str) -> f64 {
        let rows = self.rows(variant, "history.csv");
        let row = rows.iter().rfind(|row| row["phase"] == phase).unwrap();
        number(row, probe)
    }

    /// `summary.json`.
    pub(crate) fn summary(&self, variant: &str) -> serde_json::Value {
        let path = self.folder.path().join(variant).join("summary.json");
        serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
    }

    /// Rows of a table of the results.
    pub(crate) fn rows(&self, variant: &str, file: &str) -> Vec<Row> {
        table(&self.folder.path().join(variant).join(file))
    }

    /// Asserts |value − exact| ≤ bound · scale, and says what it is.
    #[track_caller]
    pub(crate) fn near(&self, what: &str, value: f64, exact: f64, scale: f64, bound: f64) {
        self.within(what, (value - exact) / scale, -bound, bound);
    }

    /// Asserts |value − exact| ≤ bound · exact of a probe at the end.
    #[track_caller]
    pub(crate) fn ends_at(&self, variant: &str, probe: &str, exact: f64, bound: f64) {
        let value = self.last(variant, probe);
        self.near(&format!("{variant}, {probe}"), value, exact, exact, bound);
    }

    /// Asserts that the error lies between bounds, and says what it is.
    #[track_caller]
    pub(crate) fn within(&self, what: &str, error: f64, least: f64, most: f64) {
        println!("{} | {what} | {error:+.3e}", self.case);
        assert!(
            least <= error && error <= most,
            "{}, {what}: error {error:.3e}, expected {least:.1e} to {most:.1e}",
            self.case
        );
    }
}

/// One variant among the results of a case.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Variant<'r> {
    results: &'r Results,
    name: &'r str,
}

impl Results {
    /// The results of a variant.
    pub(crate) fn of<'r>(&'r self, name: &'r str) -> Variant<'r> {
        Variant {
            results: self,
            name,
        }
    }
}

impl Variant<'_> {
    /// [`Results::last`].
    pub(crate) fn last(&self, probe: &str) -> f64 {
        self.results.last(self.name, probe)
    }

    /// [`Results::end`].
    pub(crate) fn end(&self, phase: &str, probe: &str) -> f64 {
        self.results.end(self.name, phase, probe)
    }

    fn what(&self, what: &str) -> String {
        format!("{}, {what}", self.name)
    }

    /// [`Results::near`].
    #[track_caller]
    pub(crate) fn near(&self, what: &str, value: f64, exact: f64, scale: f64, bound: f64) {
        let what = self.what(what);
        self.results.near(&what, value, exact, scale, bound);
    }

    /// [`Results::within`].
    #[track_caller]
    pub(crate) fn within(&self, what: &str, error: f64, least: f64, most: f64) {
        self.results.within(&self.what(what), error, least, most);
    }
}

/// A number of a row.
pub(crate) fn number(row: &Row, column: &str) -> f64 {
    row[column].parse().unwrap()
}

/// Elastic moduli.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Elastic {
    pub(crate) young: f64,
    pub(crate) poisson: f64,
}

impl Elastic {
    pub(crate) fn shear(self) -> f64 {
        self.young / (2.0 * (1.0 + self.poisson))
    }

    /// λ + 2G.
    pub(crate) fn oedometric(self) -> f64 {
        2.0 * self.shear() * (1.0 - self.poisson) / (1.0 - 2.0 * self.poisson)
    }

    pub(crate) fn bulk(self) -> f64 {
        self.young / (3.0 * (1.0 - 2.0 * self.poisson))
    }

    /// Strain along one axis in plane strain, of the stresses along it and across.
    pub(crate) fn plane_strain(self, along: f64, across: f64) -> f64 {
        (1.0 + self.poisson) / self.young * ((1.0 - self.poisson) * along - self.poisson * across)
    }
}
