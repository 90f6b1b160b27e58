//! Tables, edits and arguments as text, and what a text says.

use std::fmt::Debug;

/// Rows of a table: a line each, cells between ` | `. `\n` in a cell is the end of a line.
///
/// # Panics
/// If a row has another number of cells.
#[expect(clippy::panic, reason = "part of the tests")]
pub fn rows_of<const N: usize>(table: &str) -> Vec<[&'static str; N]> {
    let row = |line: &str| {
        let cells = line.split(" | ").map(cell).collect::<Vec<_>>();
        let Ok(cells) = cells.try_into() else {
            panic!("not {N} cells: {line}")
        };
        cells
    };
    table.trim().lines().map(row).collect()
}

/// A cell lives as long as the tests, as the literals that it stands for do.
fn cell(text: &str) -> &'static str {
    text.trim().replace("\\n", "\n").leak()
}

/// Named paths from rows `name | segment; segment`, the numbers of a segment between spaces.
///
/// # Panics
/// If a segment does not have N numbers.
#[expect(clippy::expect_used, reason = "part of the tests")]
pub fn paths_of<const N: usize>(table: &str) -> Vec<(&'static str, Vec<[f64; N]>)> {
    let number = |text: &str| text.parse::<f64>().expect("a number");
    let segment = |text: &str| {
        let numbers: Vec<f64> = text.split_whitespace().map(number).collect();
        numbers.try_into().expect("N numbers")
    };
    let rows = rows_of(table).into_iter();
    rows.map(|[name, path]| (name, path.split(';').map(segment).collect()))
        .collect()
}

/// A text with the first `from` of each edit `from => to` replaced by `to`. `\n` is the end of a line.
///
/// # Panics
/// If a text to be replaced does not occur.
#[expect(clippy::panic, reason = "part of the tests")]
pub fn edited(text: &str, edits: &[impl AsRef<str>]) -> String {
    edits.iter().fold(text.to_owned(), |text, edit| {
        let edit = edit.as_ref().replace("\\n", "\n");
        let Some((from, to)) = edit.split_once(" =>") else {
            panic!("no edit: {edit}")
        };
        let to = to.strip_prefix(' ').unwrap_or(to);
        assert!(text.contains(from), "there is no {from:?} in:\n{text}");
        text.replacen(from, to, 1)
    })
}

/// Arguments of a command, parted by spaces.
pub fn words(line: &str) -> Vec<&str> {
    line.split_whitespace().collect()
}

/// Asserts that a text contains another one.
///
/// # Panics
/// With the text, if it does not.
#[track_caller]
pub fn has(text: impl AsRef<str> + Debug, part: impl AsRef<str>) {
    let (text, part) = (text.as_ref(), part.as_ref());
    assert!(text.contains(part), "there is no {part:?} in:\n{text}");
}

#[cfg(test)]
mod tests {
    use super::{edited, rows_of};

    #[test]
    fn rows_have_cells_and_edits_two_sides() {
        assert_eq!(
            rows_of("\na\\nb |  c\nd | =\n"),
            [["a\nb", "c"], ["d", "="]]
        );
        let text = edited("x = 1\ny = 2\n", &[r"x = 1\n => ", r"y => z\n y"]);
        assert_eq!(text, "z\n y = 2\n");
    }

    #[test]
    #[should_panic(expected = "not 3 cells: a | b")]
    fn a_cell_too_few_is_found() {
        rows_of::<3>("a | b");
    }

    #[test]
    #[should_panic(expected = "there is no \"q\"")]
    fn an_edit_of_nothing_is_found() {
        edited("x", &["q => y"]);
    }
}
