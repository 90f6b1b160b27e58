//! The table of results: one row per increment, as comma-separated values.

use super::{Driver, file::words};
use std::fmt::Write as _;
use std::io::{self, Write};
use std::time::{Duration, Instant};

/// Rows wait in memory no longer than this.
const FLUSH_EVERY: Duration = Duration::from_millis(200);

/// One row of results.
#[derive(Clone, Copy, Debug)]
pub struct Row<'a> {
    /// Increment, counted through all segments; 0 is the initial state.
    pub increment: usize,
    /// Jumps or strains.
    pub gradient: &'a [f64],
    /// Tractions or stresses.
    pub flux: &'a [f64],
    /// Internal variables.
    pub internal: &'a [f64],
    /// Calls of the law that the increment took.
    pub iterations: usize,
}

impl Driver {
    /// Names of the columns between `increment` and `iterations`.
    pub fn columns(&self) -> Vec<String> {
        let hypothesis = self.law.hypothesis();
        let (gradient, flux) = words(hypothesis);
        let components = hypothesis.components();
        let named = |word| components.iter().map(move |c| format!("{word}_{c}"));
        let variables = &self.law.formulation().internal_variables;
        named(gradient)
            .chain(named(flux))
            .chain(variables.iter().map(|v| v.id.clone()))
            .collect()
    }
}

/// Writes rows with 17 significant digits.
#[derive(Debug)]
pub struct Table<W: Write> {
    out: W,
    pending: String,
    flushed: Instant,
    /// The driver came through a pipe: it cannot be followed once more if a law ends the process.
    is_only_once: bool,
}

impl<W: Write> Table<W> {
    /// Starts with the names of the columns.
    pub fn new(out: W, driver: &Driver) -> Self {
        let mut pending = String::from("increment");
        for column in driver.columns() {
            pending.push(',');
            pending.push_str(&column);
        }
        pending.push_str(",iterations\n");
        Self {
            out,
            pending,
            flushed: Instant::now(),
            is_only_once: !driver.path().is_file(),
        }
    }

    /// Adds a row.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn write(&mut self, row: &Row<'_>) -> io::Result<()> {
        let text = &mut self.pending;
        let full = "a string takes everything";
        write!(text, "{}", row.increment).map_err(|_| io::Error::other(full))?;
        for value in row.gradient.iter().chain(row.flux).chain(row.internal) {
            // Adding 0 turns −0 into 0.
            text.push(',');
            write!(text, "{:.16e}", value + 0.0).map_err(|_| io::Error::other(full))?;
        }
        writeln!(text, ",{}", row.iterations).map_err(|_| io::Error::other(full))?;
        if self.is_only_once || text.len() > 1 << 15 || self.flushed.elapsed() > FLUSH_EVERY {
            self.flush()?;
        }
        Ok(())
    }

    /// Hands over all rows so far.
    ///
    /// # Errors
    /// They cannot be written.
    pub fn flush(&mut self) -> io::Result<()> {
        self.out.write_all(self.pending.as_bytes())?;
        self.pending.clear();
        self.flushed = Instant::now();
        self.out.flush()
    }
}
