//! Reading the CSV files of a run, whatever has become of them, and however long they are: row by
//! row, never as a whole.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::{Path, PathBuf};
use text::file::open_regular;
use text::{Error, Source};

/// Of a header that cannot be used, so much is shown.
const SHOWN: usize = 400;

/// A CSV file that is about to be read.
#[derive(Debug)]
pub(super) struct Table {
    path: PathBuf,
    columns: Vec<String>,
    lines: Lines,
    /// The file ends within a row: a run that is stopped can stop in the middle of a number.
    is_cut: bool,
}

impl Table {
    /// Opens a file that has to have certain columns.
    ///
    /// # Errors
    /// [`Error::Unreadable`]; [`Error::Input`] if a column is missing.
    pub(super) fn open(path: &Path, needed: &[&str]) -> Result<Self, Error> {
        let unreadable = |source| Error::Unreadable {
            path: path.to_owned(),
            source,
        };
        let mut file = open_regular(path).map_err(unreadable)?;
        let is_cut = ends_in_a_row(&mut file).map_err(unreadable)?;
        let mut lines = Lines {
            file: BufReader::with_capacity(1 << 16, file),
            bytes: Vec::new(),
            n: 0,
        };
        let mut header = Row::default();
        lines.read(&mut header).map_err(unreadable)?;
        let columns: Vec<String> = (0..header.cells.len())
            .map(|column| header.text(column))
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
            lines,
            is_cut,
        })
    }

    /// Names of the columns, in order.
    pub(super) fn columns(&self) -> &[String] {
        &self.columns
    }

    /// Where a column stands.
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
            self.lines.read(row).map_err(|source| Error::Unreadable {
                path: self.path.clone(),
                source,
            })
        };
        let mut has_row = read(&mut row)?;
        while has_row {
            let has_next = read(&mut next)?;
            let is_whole = row.cells.len() == self.columns.len() && (has_next || !self.is_cut);
            if is_whole {
                take(&row);
            } else {
                broken.add(row.line);
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

    /// What is to be said of them, if there are any.
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

/// The lines of a file on their way into rows. Nearly all cells are numbers: where a line has no quotation
/// marks, its cells are what stands between the commas.
#[derive(Debug)]
struct Lines {
    file: BufReader<File>,
    bytes: Vec<u8>,
    /// So many lines are read.
    n: u64,
}

impl Lines {
    /// Reads the next row that is not empty. Whether there is one.
    fn read(&mut self, row: &mut Row) -> io::Result<bool> {
        loop {
            self.bytes.clear();
            let is_first = self.n == 0;
            row.line = self.n + 1;
            let mut is_open = false;
            loop {
                let from = self.bytes.len();
                if self.file.read_until(b'\n', &mut self.bytes)? == 0 {
                    break;
                }
                self.n += 1;
                let line = &self.bytes[from..];
                is_open = (is_open || line.contains(&b'"')) && ends_open(line, is_open);
                if !is_open {
                    break;
                }
            }
            if self.bytes.is_empty() {
                return Ok(false);
            }
            let mut line = self.bytes.as_slice();
            for end in [b"\n", b"\r"] {
                line = line.strip_suffix(end).unwrap_or(line);
            }
            let mark = is_first.then(|| line.strip_prefix("\u{feff}".as_bytes()));
            line = mark.flatten().unwrap_or(line);
            if !line.is_empty() {
                row.take(line);
                return Ok(true);
            }
        }
    }
}

/// A row.
#[derive(Debug, Default)]
pub(super) struct Row {
    text: String,
    /// Where the cells stand in it.
    cells: Vec<Range<usize>>,
    /// Number of its first line in the file.
    line: u64,
}

impl Row {
    fn take(&mut self, line: &[u8]) {
        self.text.clear();
        self.cells.clear();
        match std::str::from_utf8(line) {
            Ok(line) => self.text.push_str(line),
            Err(_) => self.text.push_str(&String::from_utf8_lossy(line)),
        }
        if self.text.contains('"') {
            self.unquote();
            return;
        }
        let mut start = 0;
        for (at, byte) in self.text.bytes().enumerate() {
            if byte == b',' {
                self.cells.push(start..at);
                start = at + 1;
            }
        }
        self.cells.push(start..self.text.len());
    }

    /// Parts a line with quotation marks: commas between them belong to a cell, two of them are one.
    fn unquote(&mut self) {
        let line = std::mem::take(&mut self.text);
        let (mut start, mut is_quoted) = (0, false);
        let mut characters = line.chars().peekable();
        while let Some(character) = characters.next() {
            match character {
                '"' if is_quoted && characters.peek() == Some(&'"') => {
                    characters.next();
                    self.text.push('"');
                }
                '"' if is_quoted || self.text.len() == start => is_quoted = !is_quoted,
                ',' if !is_quoted => {
                    self.cells.push(start..self.text.len());
                    start = self.text.len();
                }
                other => self.text.push(other),
            }
        }
        self.cells.push(start..self.text.len());
    }

    fn cell(&self, column: usize) -> &str {
        let place = self.cells.get(column).cloned().unwrap_or_default();
        &self.text[place]
    }

    /// A cell.
    pub(super) fn bytes(&self, column: usize) -> &[u8] {
        self.cell(column).as_bytes()
    }

    /// A cell's text.
    pub(super) fn text(&self, column: usize) -> String {
        self.cell(column).to_owned()
    }

    /// A cell's number, NaN if it is not a finite one.
    pub(super) fn number(&self, column: usize) -> f64 {
        let text = self.cell(column);
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
        self.cell(column).trim().parse().ok()
    }
}

/// Whether a line ends within the quotation marks of a cell; whether it begins so is known.
fn ends_open(line: &[u8], mut is_open: bool) -> bool {
    let (mut begins, mut has_closed) = (!is_open, false);
    for &byte in line {
        let is_mark = byte == b'"' && (is_open || begins || has_closed);
        has_closed = is_mark && is_open;
        is_open ^= is_mark;
        begins = byte == b',' && !is_open;
    }
    is_open
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_those_of_a_csv_reader() {
        let text = "\u{feff}a,b,c\r\n1,2,3\n\n\"x,\"\"y\"\"\",,z\n\"two\nlines\",5e-1,\n\"\",q\"r,\"s\"t\n7,8";
        let path = std::env::temp_dir().join(format!("pilum-rows-{}", std::process::id()));
        std::fs::write(&path, text).unwrap();
        let mut lines = Lines {
            file: BufReader::new(File::open(&path).unwrap()),
            bytes: Vec::new(),
            n: 0,
        };
        std::fs::remove_file(&path).unwrap();
        let mut reader = csv::ReaderBuilder::new()
            .flexible(true)
            .has_headers(false)
            .from_reader(text.as_bytes());
        let mut row = Row::default();
        let mut starts = Vec::new();
        for record in reader.records() {
            assert!(lines.read(&mut row).unwrap());
            let cells: Vec<String> = (0..row.cells.len()).map(|c| row.text(c)).collect();
            let expected: Vec<String> = record.unwrap().iter().map(str::to_owned).collect();
            assert_eq!(cells, expected);
            starts.push(row.line);
        }
        assert!(!lines.read(&mut row).unwrap());
        assert_eq!(starts, [1, 2, 4, 5, 7, 8]);
    }
}
