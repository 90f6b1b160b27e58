//! Running a driver given as a text, and reading its rows by column.

use input::Error;
use runs::point::PointReport;
use std::path::Path;

/// MEPI of Table IV (1) of De Gennaro & Frank, with the p_0 that makes it dilate.
pub(crate) const MEPI: &str = "[parameters]\nk_n = 0.86e5\nk_t = 0.37e5\nn = 0.55\n\
    mu_0 = 0.27\nmu_p = 0.7\nmu_c0 = 0.46\na = 0.008\nc_0 = 40\nt = 0.002\np_0 = 100\n";

/// What a driver gave: rows as far as it came, and how it ended.
#[derive(Debug)]
pub(crate) struct Run {
    columns: Vec<String>,
    rows: Vec<Vec<f64>>,
    pub(crate) result: Result<PointReport, Error>,
}

/// The table that a driver writes, and how it ended.
pub(crate) fn csv(text: &str) -> (String, Result<PointReport, Error>) {
    let mut out = Vec::new();
    let result = tests::driver::of_text(text)
        .and_then(|driver| runs::point::write_csv(&driver, &mut out, Path::new("table")));
    (String::from_utf8(out).unwrap(), result)
}

/// Runs a driver that may fail.
pub(crate) fn attempt(text: &str) -> Run {
    let (table, result) = csv(text);
    let mut lines = table.lines();
    let split = |line: &str| line.split(',').map(str::to_owned).collect::<Vec<_>>();
    let columns = lines.next().map(split).unwrap_or_default();
    let rows = lines
        .map(|line| split(line).iter().map(|v| v.parse().unwrap()).collect())
        .collect();
    Run {
        columns,
        rows,
        result,
    }
}

/// Runs a driver that has to succeed.
pub(crate) fn follow(text: &str) -> Run {
    let run = attempt(text);
    if let Err(error) = &run.result {
        panic!("{error}\n{text}");
    }
    run
}

impl Run {
    /// All values of a column.
    pub(crate) fn column(&self, name: &str) -> Vec<f64> {
        let Some(i) = self.columns.iter().position(|column| column == name) else {
            panic!("there is no column `{name}` in {:?}", self.columns);
        };
        self.rows.iter().map(|row| row[i]).collect()
    }

    /// The value of a column in the row of an increment.
    pub(crate) fn at(&self, increment: usize, name: &str) -> f64 {
        self.column(name)[increment]
    }

    /// The last value of a column.
    pub(crate) fn last(&self, name: &str) -> f64 {
        *self.column(name).last().unwrap()
    }

    /// Increments done.
    pub(crate) fn increments(&self) -> usize {
        self.rows.len() - 1
    }

    /// The error, which there has to be.
    pub(crate) fn error(&self) -> &Error {
        self.result.as_ref().unwrap_err()
    }
}
