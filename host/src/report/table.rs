//! Reading the CSV files of a run, whatever has become of them.

use crate::error::{Error, Source};
use std::path::Path;

/// The complete rows of a CSV file.
#[derive(Debug)]
pub(super) struct Table {
    /// Names of the columns.
    columns: Vec<String>,
    rows: Vec<csv::StringRecord>,
}

impl Table {
    /// Reads a file that has to have certain columns. A row that is not complete is left out with
    /// a note.
    ///
    /// # Errors
    /// [`Error::Unreadable`]; [`Error::Input`] if a column is missing.
    pub(super) fn read(
        path: &Path,
        needed: &[&str],
        notes: &mut Vec<String>,
    ) -> Result<Self, Error> {
        let source = Source::read(path)?;
        let text = source.text();
        // A run that is stopped can stop in the middle of a number.
        let whole = text.rfind('\n').map_or("", |end| &text[..=end]);
        let mut reader = csv::ReaderBuilder::new()
            .flexible(true)
            .from_reader(whole.as_bytes());
        let header_end = text.find('\n').unwrap_or(text.len());
        let unusable = |why: String| -> Error { source.error(0..header_end, why).into() };
        let columns: Vec<String> = match reader.headers() {
            Ok(headers) => headers.iter().map(str::to_owned).collect(),
            Err(error) => return Err(unusable(format!("the header cannot be read: {error}"))),
        };
        let missing: Vec<&str> = needed
            .iter()
            .filter(|name| !columns.iter().any(|column| column == *name))
            .copied()
            .collect();
        if !missing.is_empty() {
            return Err(unusable(format!(
                "not written by a run: there is no column {}",
                missing.join(", ")
            )));
        }
        let file = path.file_name().unwrap_or_default().to_string_lossy();
        let mut rows = Vec::new();
        let mut broken = Vec::new();
        for row in reader.records() {
            match row {
                Ok(row) if row.len() == columns.len() => rows.push(row),
                Ok(row) => broken.push(row.position().map_or(0, csv::Position::line)),
                Err(error) => broken.push(error.position().map_or(0, csv::Position::line)),
            }
        }
        if whole.len() < text.len() {
            broken.push(whole.lines().count() as u64 + 1);
        }
        if let Some(line) = broken.first() {
            notes.push(format!(
                "{file}: {} not complete and left out, the first in line {line}",
                match broken.len() {
                    1 => "1 row is".to_owned(),
                    n => format!("{n} rows are"),
                }
            ));
        }
        Ok(Self { columns, rows })
    }

    /// Names of the columns, in order.
    pub(super) fn columns(&self) -> &[String] {
        &self.columns
    }

    /// Number of rows.
    pub(super) fn n_rows(&self) -> usize {
        self.rows.len()
    }

    /// Where a column stands.
    pub(super) fn position(&self, name: &str) -> Option<usize> {
        self.columns.iter().position(|column| column == name)
    }

    /// A cell's text.
    pub(super) fn text(&self, row: usize, column: usize) -> &str {
        self.rows
            .get(row)
            .and_then(|row| row.get(column))
            .unwrap_or_default()
    }

    /// A cell's number, if it is a finite one.
    pub(super) fn number(&self, row: usize, column: usize) -> Option<f64> {
        let value: f64 = self.text(row, column).trim().parse().ok()?;
        value.is_finite().then_some(value)
    }

    /// A cell's whole number.
    pub(super) fn count(&self, row: usize, column: usize) -> Option<usize> {
        self.text(row, column).trim().parse().ok()
    }
}
