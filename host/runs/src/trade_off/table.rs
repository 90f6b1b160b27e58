//! A study as a table: on a terminal, and as comma-separated values.

use super::study::{Row, Study};
use std::fmt::Write as _;
use std::path::Path;
use text::write::begin;

impl Study {
    /// The table for a terminal, with what it says.
    pub fn text(&self) -> String {
        let mut text = format!("{}: {}\n", self.name, self.title);
        for (number, reference) in self.references.iter().enumerate() {
            let what = if number == 0 {
                "reference"
            } else {
                "reference of mesh and elements"
            };
            let _ = writeln!(text, "\n{what}: {}\n", reference.statement());
            let rows: Vec<&Row> = self
                .rows
                .iter()
                .filter(|row| row.reference == number)
                .collect();
            let longest = rows.iter().map(|row| row.label.chars().count()).max();
            let width = longest.unwrap_or(0).max(7);
            let counts: Vec<String> = self.counts.iter().map(|n| format!(" {n:>14}")).collect();
            let _ = writeln!(
                text,
                "    {:<width$}  {:>9}  {:>10}{}",
                "setting",
                "error",
                "CPU ms",
                counts.concat()
            );
            for row in rows {
                let _ = writeln!(text, "{}", line(row, width));
            }
        }
        text += "\n> as in the file   * nothing is cheaper and as accurate   < below the uncertainty of the reference\n";
        for note in &self.notes {
            let _ = writeln!(text, "note: {note}");
        }
        let _ = writeln!(text, "{}", self.verdict());
        text
    }

    /// Writes the rows.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(super) fn write_csv(&self, path: &Path) -> Result<(), csv::Error> {
        let mut writer = csv::Writer::from_writer(begin(path)?);
        let fixed = [
            "family",
            "setting",
            "default",
            "reference",
            "error",
            "below_uncertainty",
            "optimal",
            "cpu_seconds",
        ];
        let errors = self.columns.iter().map(|name| format!("error_{name}"));
        let header = fixed.iter().map(|name| (*name).to_owned());
        let counts = self.counts.iter().map(|name| (*name).to_owned());
        let failure = std::iter::once("failure".to_owned());
        writer.write_record(header.chain(counts).chain(errors).chain(failure))?;
        for row in &self.rows {
            let reference = self.references.get(row.reference);
            let label = reference.map(|reference| reference.label.clone());
            let mut cells = vec![
                row.family.clone(),
                row.label.clone(),
                row.is_default.to_string(),
                label.unwrap_or_default(),
            ];
            match &row.outcome {
                Ok(m) => {
                    // Without a reference so far there is no error to tell.
                    let error = reference.map(|_| format!("{:e}", m.error));
                    cells.push(error.unwrap_or_default());
                    cells.push(m.is_below.to_string());
                    cells.push(m.is_optimal.to_string());
                    cells.push(format!("{:e}", m.seconds));
                    cells.extend(m.counts.iter().map(u64::to_string));
                    cells.extend(m.errors.iter().map(|error| format!("{error:e}")));
                    cells.push(String::new());
                }
                Err(failure) => {
                    let empty = 4 + self.counts.len() + self.columns.len();
                    cells.extend(std::iter::repeat_n(String::new(), empty));
                    cells.push(failure.clone());
                }
            }
            writer.write_record(&cells)?;
        }
        writer.flush()?;
        Ok(())
    }
}

fn line(row: &Row, width: usize) -> String {
    let default = if row.is_default { '>' } else { ' ' };
    match &row.outcome {
        Ok(m) => {
            let optimal = if m.is_optimal { '*' } else { ' ' };
            let below = if m.is_below { '<' } else { ' ' };
            let counts: Vec<String> = m.counts.iter().map(|n| format!(" {n:>14}")).collect();
            format!(
                "{default}{optimal}  {:<width$} {below}{:>9.1e}  {:>10.3}{}",
                row.label,
                m.error,
                1e3 * m.seconds,
                counts.concat()
            )
        }
        Err(failure) => format!("{default}   {:<width$}  failed: {failure}", row.label),
    }
}
