//! Reading the CSV files of a run, whatever has become of them, and however long they are: row by
//! row, never as a whole. The profiles of a run that this process has carried out come from memory
//! ([`super::Known`]).

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use text::file::open_regular;
use text::{Error, Source};

/// Length shown of a header that cannot be used.
const SHOWN: usize = 400;

/// A CSV file that is about to be read.
#[derive(Debug)]
pub(super) struct Table {
    path: PathBuf,
    columns: Vec<String>,
    reader: csv::Reader<File>,
    /// The file ends within a row: a run that is stopped can stop in the middle of a number.
    is_cut: bool,
}

impl Table {
    /// Opens a file that has to have certain columns.
    ///
    /// # Errors
    /// [`Error::Unreadable`]; [`Error::Input`] if a column is missing.
    pub(super) fn open(path: &Path, needed: &[&str]) -> Result<Self, Error> {
        let unreadable = |why| Error::unreadable(path, why);
        let mut file = open_regular(path).map_err(unreadable)?;
        let is_cut = ends_in_a_row(&mut file).map_err(unreadable)?;
        let mut reader = csv::ReaderBuilder::new()
            .flexible(true)
            .buffer_capacity(1 << 16)
            .from_reader(file);
        let header = reader.byte_headers().map_err(|error| {
            let why = io::Error::other(error.to_string());
            unreadable(why)
        })?;
        let columns: Vec<String> = header
            .iter()
            .map(|name| String::from_utf8_lossy(name).into_owned())
            .collect();
        let missing: Vec<&str> = needed
            .iter()
            .filter(|name| !columns.iter().any(|column| column == *name))
            .copied()
            .collect();
        if !missing.is_empty() {
            let line: String = columns.join(",").chars().take(SHOWN).collect();
            let source = Source::new(path, line.clone());
            let message = format!(
                "not written by a run: there is no column {}",
                missing.join(", ")
            );
            return Err(source.error(0..line.len(), message).into());
        }
        Ok(Self {
            path: path.to_owned(),
            columns,
            reader,
            is_cut,
        })
    }

    /// Names of the columns, in order.
    pub(super) fn columns(&self) -> &[String] {
        &self.columns
    }

    /// Position of a column.
    pub(super) fn position(&self, name: &str) -> Option<usize> {
        self.columns.iter().position(|column| column == name)
    }

    /// Takes every complete row. One that is not is left out with a note.
    ///
    /// # Errors
    /// [`Error::Unreadable`].
    pub(super) fn rows(
        mut self,
        notes: &mut Vec<String>,
        mut take: impl FnMut(&Row),
    ) -> Result<(), Error> {
        let mut broken = Broken::default();
        let (mut row, mut next) = (Row::default(), Row::default());
        let mut read = |row: &mut Row| {
            let read = self.reader.read_byte_record(&mut row.0);
            read.map_err(|why| Error::unreadable(&self.path, io::Error::other(why.to_string())))
        };
        let mut has_row = read(&mut row)?;
        while has_row {
            let has_next = read(&mut next)?;
            let is_whole = row.0.len() == self.columns.len() && (has_next || !self.is_cut);
            if is_whole {
                take(&row);
            } else {
                broken.add(row.0.position().map_or(0, csv::Position::line));
            }
            std::mem::swap(&mut row, &mut next);
            has_row = has_next;
        }
        let file = self.path.file_name().unwrap_or_default().to_string_lossy();
        notes.extend(broken.note(&file, "row", "in line"));
        Ok(())
    }
}

/// Entries of a file that are not complete.
#[derive(Debug, Default)]
pub(super) struct Broken {
    n: usize,
    first: u64,
}

impl Broken {
    pub(super) fn add(&mut self, line: u64) {
        if self.n == 0 {
            self.first = line;
        }
        self.n += 1;
    }

    /// Note about them, if any.
    pub(super) fn note(&self, file: &str, entry: &str, place: &str) -> Option<String> {
        let what = match self.n {
            0 => return None,
            1 => format!("1 {entry} is"),
            n => format!("{n} {entry}s are"),
        };
        let first = self.first;
        Some(format!(
            "{file}: {what} not complete and left out, the first {place} {first}"
        ))
    }
}

/// A row.
#[derive(Debug, Default)]
pub(super) struct Row(csv::ByteRecord);

impl Row {
    /// A cell.
    pub(super) fn bytes(&self, column: usize) -> &[u8] {
        self.0.get(column).unwrap_or_default()
    }

    /// A cell's text.
    pub(super) fn text(&self, column: usize) -> String {
        String::from_utf8_lossy(self.bytes(column)).into_owned()
    }

    /// A cell's number, NaN if it is not a finite one.
    pub(super) fn number(&self, column: usize) -> f64 {
        let text = std::str::from_utf8(self.bytes(column)).unwrap_or_default();
        let value = text.parse().or_else(|_| text.trim().parse());
        let value = value.unwrap_or(f64::NAN);
        if f64::is_finite(value) {
            value
        } else {
            f64::NAN
        }
    }

    /// A cell's whole number.
    pub(super) fn count(&self, column: usize) -> Option<usize> {
        std::str::from_utf8(self.bytes(column))
            .ok()?
            .trim()
            .parse()
            .ok()
    }
}

/// Whether a file ends without the end of a line.
fn ends_in_a_row(file: &mut File) -> io::Result<bool> {
    let mut last = [b'\n'];
    if file.metadata()?.len() > 0 {
        file.seek(SeekFrom::End(-1))?;
        file.read_exact(&mut last)?;
        file.seek(SeekFrom::Start(0))?;
    }
    Ok(last != [b'\n'])
}
