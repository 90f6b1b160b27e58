//! The table of a driver: one row per increment, as comma-separated values.

use point::{Driver, Row};
use std::fmt::Write as _;
use std::io::{self, Write};
use std::time::{Duration, Instant};

/// Rows wait in memory no longer than this.
const FLUSH_EVERY: Duration = Duration::from_millis(200);

/// Writes rows with 17 significant digits.
#[derive(Debug)]
pub struct Table<W: Write> {
    out: W,
    pending: String,
    flushed: Instant,
    /// The driver cannot be followed once more if a law ends the process: no row waits.
    is_only_once: bool,
    /// Rows say the time.
    is_timed: bool,
}

impl<W: Write> Table<W> {
    /// Starts with the names of the columns. `is_only_once`: the driver came through a pipe, say, so
    /// that every row is handed over at once.
    pub fn new(out: W, driver: &Driver, is_only_once: bool) -> Self {
        let mut pending = String::from("increment");
        let is_timed = driver.is_timed();
        if is_timed {
            pending.push(',');
            pending.push_str(point::TIME);
        }
        for column in driver.columns() {
            pending.push(',');
            pending.push_str(&column);
        }
        pending.push_str(",iterations\n");
        Self {
            out,
            pending,
            flushed: Instant::now(),
            is_only_once,
            is_timed,
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
        let time = self.is_timed.then_some(&row.time).into_iter();
        let state = row.gradient.iter().chain(row.flux).chain(row.internal);
        for value in time.chain(state) {
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
