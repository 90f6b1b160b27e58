//! Measured points of figures: two columns of a file of comma-separated values.

use crate::Error;
use crate::case::MeasuredInput;
use csv::{ByteRecord, Reader, ReaderBuilder};
use results::output_request::Measured;
use std::path::Path;
use text::file::read_text;
use text::{Source, Spanned, suggestion};

/// Most points of a table: a figure and the page of a report hold all of them.
const MOST_POINTS: usize = 20_000;

/// Reads the points of a table.
///
/// # Errors
/// [`text::Error::Input`] at the key that does not fit: the file cannot be read, a column is
/// missing, a cell is not a number, there are no points or too many.
pub(crate) fn read(source: &Source, input: &MeasuredInput) -> Result<Measured, Error> {
    let path = source.file_named(input.file.get_ref(), &input.file.span());
    let at_file = |message: String| Error::from(source.error(input.file.span(), message));
    let shown = path.display();
    let unreadable = |why: String| at_file(format!("`file`: cannot read {shown}: {why}"));
    let bytes = read_text(&path).map_err(|why| unreadable(why.to_string()))?;
    let (mut reader, columns) = begin(&bytes).map_err(|why| unreadable(why.to_string()))?;
    let table = Table {
        source,
        path: &path,
        bytes: &bytes,
        columns,
    };
    let x = table.position("x", &input.x)?;
    let y = table.position("y", &input.y)?;
    let mut points = Vec::new();
    for row in reader.byte_records() {
        let row = row.map_err(|why| at_file(format!("`file`: {shown}: {why}")))?;
        let x = table.number(&row, x, &input.x)?;
        let y = table.number(&row, y, &input.y)?;
        if let (Some(x), Some(y)) = (x, y) {
            let y = input.y_scale * y + input.y_offset;
            points.push((input.x_scale * x + input.x_offset, y));
        }
        if points.len() > MOST_POINTS {
            return Err(at_file(format!(
                "`file`: {shown} has more than {MOST_POINTS} points, the most that a figure takes"
            )));
        }
    }
    if points.is_empty() {
        let [x, y] = [&input.x, &input.y].map(Spanned::get_ref);
        return Err(at_file(format!(
            "`file`: {shown} has no row with `{x}` and `{y}`"
        )));
    }
    let is_finite = |(x, y): &&(f64, f64)| x.is_finite() && y.is_finite();
    if let Some((x, y)) = points.iter().find(|point| !is_finite(point)) {
        return Err(at_file(format!(
            "`file`: with its factors and offsets a point is ({x}, {y}), no finite number"
        )));
    }
    Ok(Measured {
        label: input.label.clone(),
        points,
        of_curve: None,
        colour_of: None,
    })
}

/// The rows of a table, and the names of its columns. The first line that is no remark tells what
/// stands between columns.
fn begin(bytes: &[u8]) -> csv::Result<(Reader<&[u8]>, Vec<String>)> {
    let mut lines = bytes.split(|&byte| byte == b'\n');
    let header = lines.find(|line| !line.trim_ascii().is_empty() && !line.starts_with(b"#"));
    let header = header.unwrap_or_default();
    let separators = [b'\t', b';'];
    let separator = separators.into_iter().find(|s| header.contains(s));
    let mut reader = ReaderBuilder::new()
        .delimiter(separator.unwrap_or(b','))
        .comment(Some(b'#'))
        .trim(csv::Trim::All)
        .flexible(true)
        .from_reader(bytes);
    let columns = reader.byte_headers()?.iter();
    let columns = columns.map(|name| String::from_utf8_lossy(name).into_owned());
    let columns = columns.collect();
    Ok((reader, columns))
}

/// A table while it is read.
struct Table<'a> {
    source: &'a Source,
    path: &'a Path,
    bytes: &'a [u8],
    columns: Vec<String>,
}

impl Table<'_> {
    /// Position of the column that a key names.
    fn position(&self, key: &str, name: &Spanned<String>) -> Result<usize, Error> {
        let position = self
            .columns
            .iter()
            .position(|column| column == name.get_ref());
        position.ok_or_else(|| {
            let message = format!(
                "`{key}`: {} has no column `{}`",
                self.path.display(),
                name.get_ref()
            );
            let known = self.columns.iter().map(String::as_str);
            let error = self.source.error(name.span(), message);
            error.hint(suggestion(name.get_ref(), known)).into()
        })
    }

    /// Number of the line, from 1, of the row that is read from here on. The reader's own number leaves
    /// out blank lines.
    fn line(&self, from: usize) -> usize {
        let (before, rest) = self.bytes.split_at(from.min(self.bytes.len()));
        let is_end = |byte: &u8| *byte == b'\n';
        let is_no_row = |line: &&[u8]| line.trim_ascii().is_empty() || line.starts_with(b"#");
        let skipped = rest.split(is_end).take_while(is_no_row);
        before.split(is_end).count() + skipped.count()
    }

    /// The number in a cell; `None` if it is empty.
    fn number(
        &self,
        row: &ByteRecord,
        column: usize,
        name: &Spanned<String>,
    ) -> Result<Option<f64>, Error> {
        let cell = String::from_utf8_lossy(row.get(column).unwrap_or_default());
        if cell.is_empty() {
            return Ok(None);
        }
        match cell.parse() {
            Ok(value) if f64::is_finite(value) => Ok(Some(value)),
            _ => {
                let message = format!(
                    "{}, line {}: `{cell}` in column `{}` is no number",
                    self.path.display(),
                    row.position().map_or(0, |at| self.line(at.byte() as usize)),
                    name.get_ref()
                );
                let error = self.source.error(name.span(), message);
                Err(match cell.replacen(',', ".", 1) {
                    point if point != cell && point.parse::<f64>().is_ok() => error
                        .hint(format!("is a decimal point meant? `{point}`, not `{cell}`"))
                        .into(),
                    _ => error.into(),
                })
            }
        }
    }
}
