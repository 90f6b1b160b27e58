//! `history.csv` of a run, and the numbers of it that count.

use super::{Output, Take};
use std::io::BufRead as _;
use std::path::Path;

/// Columns of numbers, by increment.
#[derive(Clone, Debug, Default)]
pub struct History {
    /// Phase of each row.
    pub phases: Vec<String>,
    /// Names of the columns of numbers: probes, and before them time and increment.
    pub names: Vec<String>,
    /// Values by column and row; `None` where absent.
    pub values: Vec<Vec<Option<f64>>>,
}

impl History {
    /// Reads the history in the folder of a run: empty where absent, its whole rows where the run
    /// was ended within one.
    pub fn read(folder: &Path) -> Self {
        let text = std::fs::read(folder.join("history.csv")).unwrap_or_default();
        Self::of(&text)
    }

    /// The same of a run that is known to have one, else empty.
    pub(crate) fn read_if(is_there: bool, folder: &Path) -> Self {
        if is_there {
            Self::read(folder)
        } else {
            Self::default()
        }
    }

    fn of(text: &[u8]) -> Self {
        let whole = text
            .iter()
            .rposition(|&byte| byte == b'\n')
            .map_or(0, |end| end + 1);
        let mut reader = csv::ReaderBuilder::new()
            .flexible(true)
            .from_reader(&text[..whole]);
        let Ok(header) = reader.headers().cloned() else {
            return Self::default();
        };
        let names: Vec<String> = header.iter().skip(1).map(str::to_owned).collect();
        let mut history = Self {
            phases: Vec::new(),
            values: vec![Vec::new(); names.len()],
            names,
        };
        for row in reader.records().map_while(Result::ok) {
            if row.len() != history.names.len() + 1 {
                break;
            }
            history.phases.push(row[0].to_owned());
            for (column, cell) in history.values.iter_mut().zip(row.iter().skip(1)) {
                column.push(cell.parse().ok().filter(|value: &f64| value.is_finite()));
            }
        }
        history
    }

    /// A column by its name.
    pub fn column(&self, name: &str) -> Option<&[Option<f64>]> {
        let number = self.names.iter().position(|other| other == name)?;
        Some(&self.values[number])
    }

    /// Whether the history in the folder of a run has a row.
    pub(super) fn has_rows(folder: &Path) -> bool {
        let file = std::fs::File::open(folder.join("history.csv"));
        let rows = file.map(|file| std::io::BufReader::new(file).split(b'\n').take(2).count());
        rows.is_ok_and(|n| n == 2)
    }

    /// The number of this run that an output asks for, as far as it counts. A run that did not come to its end
    /// has a value where another probe came to a given one, but no last, largest or smallest.
    pub fn counted(&self, output: &Output, is_done: bool) -> Option<f64> {
        let counts = is_done || output.at.is_some();
        counts.then(|| self.output(output)).flatten()
    }

    /// The number of this run that an output asks for; `None` if the run lacks it.
    pub fn output(&self, output: &Output) -> Option<f64> {
        let values = self.column(&output.probe)?;
        let is_of_phase = |row: &usize| {
            let phase = output.phase.as_ref();
            phase.is_none_or(|phase| self.phases[*row] == *phase)
        };
        let rows = (0..self.phases.len()).filter(is_of_phase);
        if let Some((other, goal)) = &output.at {
            let other = self.column(other)?;
            let points = rows.filter_map(|row| Some((other[row]?, values[row]?)));
            return at(points, *goal);
        }
        let mut found = rows.filter_map(|row| values[row]);
        match output.take {
            Take::Final => found.next_back(),
            Take::Max => found.reduce(f64::max),
            Take::Min => found.reduce(f64::min),
        }
    }
}

/// The ordinate where points, joined by straight lines, first come to this abscissa.
fn at(points: impl Iterator<Item = (f64, f64)>, goal: f64) -> Option<f64> {
    let mut last: Option<(f64, f64)> = None;
    for (x, y) in points {
        if x.total_cmp(&goal).is_eq() {
            return Some(y);
        }
        if let Some((x0, y0)) = last
            && (x0 < goal) != (x < goal)
        {
            return Some(y0 + (y - y0) * ((goal - x0) / (x - x0)));
        }
        last = Some((x, y));
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "phase,increment,time,w,q,iterations\n\
                        a,1,1,0,5,2\nb,1,2,1,10,2\nb,2,3,3,30,2\nb,3,4,2,,2\nb,4,5,4,20,2\nb,5,6,5,9";

    fn output(take: Take, at: Option<f64>, phase: Option<&str>) -> Option<f64> {
        let output = Output {
            take,
            at: at.map(|goal| ("w".to_owned(), goal)),
            phase: phase.map(str::to_owned),
            ..Output::last("q")
        };
        History::of(TEXT.as_bytes()).output(&output)
    }

    #[test]
    fn outputs_are_those_of_whole_rows() {
        assert_eq!(output(Take::Final, None, None), Some(20.0));
        assert_eq!(output(Take::Max, None, None), Some(30.0));
        assert_eq!(output(Take::Min, None, None), Some(5.0));
        assert_eq!(output(Take::Min, None, Some("b")), Some(10.0));
        assert_eq!(output(Take::Final, None, Some("c")), None);
        assert!(History::of(b"").output(&Output::last("q")).is_none());
    }

    #[test]
    fn what_was_passed_counts_of_a_run_that_failed_and_its_end_does_not() {
        let history = History::of(TEXT.as_bytes());
        let at = Output {
            at: Some(("w".to_owned(), 2.5)),
            ..Output::last("q")
        };
        assert_eq!(history.counted(&at, false), Some(25.0));
        assert_eq!(history.counted(&Output::last("q"), false), None);
        assert_eq!(history.counted(&Output::last("q"), true), Some(20.0));
    }

    #[test]
    fn a_value_at_another_is_the_first_one_and_linear_in_between() {
        assert_eq!(output(Take::Final, Some(2.5), None), Some(25.0));
        assert_eq!(output(Take::Final, Some(3.0), None), Some(30.0));
        assert_eq!(output(Take::Final, Some(0.5), None), Some(7.5));
        // Not between phases, and not beyond the last row.
        assert_eq!(output(Take::Final, Some(0.5), Some("b")), None);
        assert_eq!(output(Take::Final, Some(4.5), None), None);
    }
}
