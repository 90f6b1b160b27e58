//! Tables of comma-separated values, with cells written while a run goes on. The `csv` crate would write the same bytes (a test
//! compares them), but searches every byte of a number for characters that need quotation marks. For 3.4 MB of
//! rows like those of `profile.csv` it takes 105 million instructions instead of 62; the difference is 4 % of
//! the whole run of `cases/chamber_mesh1`. Tables are read with that crate.

use crate::file::{Appended, Extent};
use std::path::PathBuf;
use text::Error;

/// Significant digits: reading them back gives the same bits.
const DIGITS: usize = 17;

/// The shortest decimal digits that read back to the same bits.
struct Shortest {
    /// Filled up with zeros.
    digits: [u8; DIGITS],
    /// So many of them are shown where they are not filled up, at least one.
    n: usize,
    /// Power of ten of the first.
    exponent: i32,
}

impl Shortest {
    /// Those of a finite number's size.
    fn of(value: f64) -> Self {
        let mut buffer = zmij::Buffer::new();
        let text = buffer.format_finite(value.abs()).as_bytes();
        let find = |text: &[u8], wanted: u8| text.iter().position(|&byte| byte == wanted);
        let (mantissa, power) = match find(text, b'e') {
            Some(at) => (&text[..at], whole(&text[at + 1..])),
            None => (text, 0),
        };
        let (before, after) = match find(mantissa, b'.') {
            Some(at) => (&mantissa[..at], &mantissa[at + 1..]),
            None => (mantissa, &[][..]),
        };
        let mut shortest = Self {
            digits: [b'0'; DIGITS],
            n: 1,
            exponent: 0,
        };
        if before != b"0" {
            shortest.exponent = power + before.len() as i32 - 1;
            let n = shortest.take(before, 0);
            shortest.take(after, n);
        } else if let Some(zeros) = after.iter().position(|&byte| byte != b'0') {
            shortest.exponent = power - 1 - zeros as i32;
            shortest.take(&after[zeros..], 0);
        }
        let last = shortest.digits.iter().rposition(|&digit| digit != b'0');
        shortest.n = last.map_or(1, |last| last + 1);
        shortest
    }

    /// Takes digits from this place on; the place after them. Zeros at the end need no place.
    fn take(&mut self, digits: &[u8], from: usize) -> usize {
        let end = (from + digits.len()).min(DIGITS);
        self.digits[from..end].copy_from_slice(&digits[..end - from]);
        end
    }
}

/// A whole number, with its sign.
fn whole(text: &[u8]) -> i32 {
    let sign = if text.starts_with(b"-") { -1 } else { 1 };
    let digits = text.iter().skip_while(|byte| !byte.is_ascii_digit());
    let value = |value: i32, digit: &u8| 10 * value + i32::from(digit - b'0');
    sign * digits.fold(0, value)
}

/// Appends a number with 17 significant digits: the shortest that read back to the same bits, filled up with
/// zeros. That is much faster than the first 17 digits of the exact value, which are no more exact.
pub(crate) fn push(text: &mut Vec<u8>, value: f64) {
    push_digits(text, value, |_| DIGITS);
}

/// Appends a number in the form of `{:e}`: the shortest digits that read back to the same bits.
pub(crate) fn push_shortest(text: &mut Vec<u8>, value: f64) {
    push_digits(text, value, |shortest| shortest.n);
}

fn push_digits(text: &mut Vec<u8>, value: f64, n: impl Fn(&Shortest) -> usize) {
    if !value.is_finite() {
        text.extend_from_slice(match value {
            f64::INFINITY => b"inf",
            f64::NEG_INFINITY => b"-inf",
            _ => b"NaN",
        });
        return;
    }
    if value.is_sign_negative() {
        text.push(b'-');
    }
    let shortest = Shortest::of(value);
    let (first, rest) = shortest.digits[..n(&shortest)].split_at(1);
    text.extend_from_slice(first);
    if !rest.is_empty() {
        text.push(b'.');
        text.extend_from_slice(rest);
    }
    text.push(b'e');
    if shortest.exponent < 0 {
        text.push(b'-');
    }
    push_count(text, shortest.exponent.unsigned_abs() as usize);
}

/// Appends a whole number.
pub(crate) fn push_count(text: &mut Vec<u8>, count: usize) {
    // The largest has 20 digits.
    let mut digits = [b'0'; 20];
    let (mut at, mut left) = (digits.len() - 1, count);
    digits[at] += (left % 10) as u8;
    while left >= 10 {
        left /= 10;
        at -= 1;
        digits[at] += (left % 10) as u8;
    }
    text.extend_from_slice(&digits[at..]);
}

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

/// A number with 17 significant digits: reading it back gives the same bits.
pub fn number(value: f64) -> String {
    let mut text = Vec::with_capacity(DIGITS + 7);
    push(&mut text, value);
    String::from_utf8_lossy(&text).into_owned()
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
    fn numbers_have_17_digits_and_read_back() {
        let powers = (-323..=308).map(|exponent| 10_f64.powi(exponent));
        let neighbours = powers.clone().map(f64::next_down);
        let thirds = powers.clone().map(|power| power / 3.0);
        let values = [
            0.0,
            -0.0,
            1.0,
            -1.0,
            0.1,
            -2.5e-7,
            123_456_789.0,
            1.0 / 3.0,
            f64::MAX,
            f64::MIN_POSITIVE,
            5e-324,
            -1e22,
        ];
        for value in values
            .into_iter()
            .chain(powers)
            .chain(neighbours)
            .chain(thirds)
        {
            let text = number(value);
            let digits = text.split('e').next().unwrap();
            assert_eq!(
                digits.chars().filter(char::is_ascii_digit).count(),
                17,
                "{text}"
            );
            let back: f64 = text.parse().unwrap();
            assert_eq!(back.to_bits(), value.to_bits(), "{text}");
            // As the standard library has it, but for the zeros.
            let short = format!("{value:e}");
            let mut shortest = Vec::new();
            push_shortest(&mut shortest, value);
            assert_eq!(shortest, short.as_bytes());
            let (shown, exponent) = short.split_once('e').unwrap();
            assert!(text.starts_with(shown), "{text} {short}");
            assert!(text.ends_with(&format!("e{exponent}")), "{text} {short}");
        }
        assert_eq!(number(-0.25), "-2.5000000000000000e-1");
        assert_eq!(number(0.0), "0.0000000000000000e0");
        assert_eq!(number(f64::NAN), "NaN");
        assert_eq!(number(f64::NEG_INFINITY), "-inf");
    }

    #[test]
    fn shortest_digits_are_as_many_as_those_of_the_standard_library() {
        // Bits of all kinds, by a multiplicative sequence.
        let mut bits = 1_u64;
        for _ in 0..100_000 {
            bits = bits.wrapping_mul(0x5851_f42d_4c95_7f2d).wrapping_add(1);
            let value = f64::from_bits(bits.rotate_left(11));
            let mut text = Vec::new();
            push_shortest(&mut text, value);
            let text = String::from_utf8(text).unwrap();
            // Of two that are as near to it either will do.
            let back: f64 = text.parse().unwrap();
            assert!(
                back.to_bits() == value.to_bits() || value.is_nan(),
                "{text}"
            );
            assert_eq!(text.len(), format!("{value:e}").len(), "{text}");
        }
    }

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
