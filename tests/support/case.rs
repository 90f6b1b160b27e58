//! Running a case and reading its results.

use input::case::CaseFile;
use input::{Case, Error};
use mechanics::Place;
use runs::run::{Observer, run};
use std::collections::BTreeMap;
use std::path::Path;
use text::{Source, parse};

/// An observer that only keeps warnings and counts cut-backs.
#[derive(Clone, Debug, Default)]
pub struct Silent {
    /// Warnings, in order.
    pub warnings: Vec<String>,
    /// Number of cut-backs.
    pub cut_backs: usize,
}

impl Observer for Silent {
    fn phase(&mut self, _: &str, _: usize) {}
    fn increment(&mut self, _: &Place, _: usize, _: usize) {}
    fn cut_back(&mut self, _: &Place, _: &str) {
        self.cut_backs += 1;
    }
    fn warning(&mut self, message: &str) {
        self.warnings.push(message.to_owned());
    }
}

/// Runs a case given as the text of its file, with results in a folder.
///
/// # Errors
/// The run's.
pub fn run_text(text: &str, folder: &Path) -> Result<Silent, Error> {
    let source = Source::new("case.toml", text);
    let file: CaseFile = parse(&source)?;
    let mut observer = Silent::default();
    let case = Case {
        source,
        file,
        variant: None,
        opener: law::Opener::default(),
    };
    run(&case, folder, &mut observer)?;
    Ok(observer)
}

/// Runs a case file, with results in a folder; of a file with variants, in one folder for each.
///
/// # Errors
/// The first run's that fails.
pub fn run_case(path: &Path, folder: &Path) -> Result<Silent, Error> {
    let mut observer = Silent::default();
    for case in Case::load(path)? {
        let folder = case
            .variant
            .iter()
            .fold(folder.to_owned(), |folder, name| folder.join(name));
        run(&case, &folder, &mut observer)?;
    }
    Ok(observer)
}

/// A CSV file as rows of cells by column name.
///
/// # Panics
/// If it cannot be read.
#[expect(clippy::expect_used, reason = "part of the tests")]
pub fn table(path: &Path) -> Vec<BTreeMap<String, String>> {
    let mut reader = csv::Reader::from_path(path).expect("the file is there");
    reader
        .deserialize()
        .map(|row| row.expect("a row of the header's length"))
        .collect()
}

/// A column of a CSV file as numbers, rows where it is empty left out.
///
/// # Panics
/// If there is no such column, or a cell is no number.
#[expect(clippy::expect_used, clippy::panic, reason = "part of the tests")]
pub fn column(path: &Path, name: &str) -> Vec<f64> {
    let cell = |row: &BTreeMap<String, String>| {
        let Some(cell) = row.get(name) else {
            panic!("no column `{name}`")
        };
        cell.clone()
    };
    let cells = table(path)
        .iter()
        .map(cell)
        .filter(|cell| !cell.is_empty())
        .collect::<Vec<_>>();
    cells
        .iter()
        .map(|cell| cell.parse().expect("a number"))
        .collect()
}
