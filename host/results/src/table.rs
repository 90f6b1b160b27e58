//! Tables of comma-separated values, with cells written while a run goes on. The `csv` crate would write the same bytes (a test
//! compares them), but searches every byte of a number for characters that need quotation marks. For 3.4 MB of
//! rows like those of `profile.csv` it takes 105 million instructions instead of 62; the difference is 4 % of
//! the whole run of `cases/chamber_mesh1`. Tables are read with that crate.

use crate::file::{Appended, Extent};
use std::path::PathBuf;
use text::Error;
use text::digits::{push, push_count};

/// Appends a cell of a CSV file, in quotation marks where it needs them.
pub(crate) fn push_text(row: &mut Vec<u8>, text: &str) {
    let is_special = |byte: u8| matches!(byte, b',' | b'"' | b'\r' | b'\n');
    if !text.bytes().any(is_special) {
        row.extend_from_slice(text.as_bytes());
        return;
    }
    row.push(b'"');
    row.extend_from_slice(text.replace('"', "\"\"").as_bytes());
    row.push(b'"');
}

/// Content of a table cell.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Cell<'a> {
    Text(&'a str),
    Count(usize),
    /// Empty where absent.
    Number(Option<f64>),
    /// Some cells as a row has them.
    Written(&'a [u8]),
}

impl Cell<'_> {
    /// Appends it to a row.
    pub(crate) fn push(self, row: &mut Vec<u8>) {
        match self {
            Cell::Text(text) => push_text(row, text),
            Cell::Count(count) => push_count(row, count),
            Cell::Number(None) => (),
            Cell::Number(Some(value)) => push(row, value),
            Cell::Written(cells) => row.extend_from_slice(cells),
        }
    }
}

/// A CSV file.
#[derive(Debug)]
pub(crate) struct Table {
    file: Appended,
    /// Rows that are not in the file yet.
    rows: Vec<u8>,
}

impl Table {
    /// Begins a file with a head; or, `from` what it held, goes on after that of an earlier run's.
    pub(crate) fn begin<'a>(
        path: PathBuf,
        columns: impl IntoIterator<Item = &'a str>,
        from: Option<Extent>,
    ) -> Result<Self, Error> {
        let mut table = Self {
            file: Appended::begin(path, from)?,
            rows: Vec::new(),
        };
        if from.is_none() {
            table.row(columns.into_iter().map(Cell::Text));
            table.flush()?;
        }
        Ok(table)
    }

    /// Adds a row, of two cells at least.
    pub(crate) fn row<'a>(&mut self, cells: impl IntoIterator<Item = Cell<'a>>) {
        for cell in cells {
            cell.push(&mut self.rows);
            self.rows.push(b',');
        }
        self.rows.pop();
        self.rows.push(b'\n');
    }

    /// Writes the rows that are waiting, all of them or none.
    pub(crate) fn flush(&mut self) -> Result<(), Error> {
        let written = self.file.append(&self.rows);
        self.rows.clear();
        written
    }

    /// Bytes in the file.
    pub(crate) fn length(&self) -> u64 {
        self.file.length()
    }

    /// Waits until everything is on the disk.
    pub(crate) fn sync(&self) -> Result<Extent, Error> {
        self.file.sync()
    }
}

/// A table as comma-separated values, from the names of its columns and its rows.
///
/// # Errors
/// A row has another number of cells.
pub fn comma_separated(
    columns: impl IntoIterator<Item: AsRef<[u8]>>,
    rows: impl IntoIterator<Item = Vec<String>>,
) -> Result<String, Error> {
    let table = || -> Result<String, Box<dyn std::error::Error>> {
        let mut table = csv::Writer::from_writer(Vec::new());
        table.write_record(columns)?;
        for row in rows {
            table.write_record(row)?;
        }
        Ok(String::from_utf8(table.into_inner()?)?)
    };
    table().map_err(|error| Error::Internal(format!("a table: {error}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_and_texts_are_those_of_a_csv_file() {
        for count in [0, 7, 10, 99, 100, 12_345, usize::MAX] {
            let mut text = Vec::new();
            push_count(&mut text, count);
            assert_eq!(String::from_utf8(text).unwrap(), count.to_string());
        }
        for text in ["sand", "", "a,b", "say \"so\"", "two\nlines", "a\rb", " b "] {
            let mut own = Vec::new();
            push_text(&mut own, text);
            own.extend_from_slice(b",1\n");
            let mut writer = csv::Writer::from_writer(Vec::new());
            writer.write_record([text, "1"]).unwrap();
            assert_eq!(own, writer.into_inner().unwrap(), "{text:?}");
        }
    }
}
