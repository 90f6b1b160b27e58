//! A study as a table: on a terminal, as comma-separated values, and on a page.

use super::study::{Reference, Row, Study};
use crate::Error;
use crate::experiment::{csv, page};
use minijinja::value::Serde;
use minijinja::{Value, context};
use std::fmt::Write as _;

impl Study {
    /// The table for a terminal, with what it says.
    pub(super) fn text(&self) -> String {
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

    /// The table as comma-separated values.
    ///
    /// # Errors
    /// [`text::Error::Internal`].
    pub(super) fn csv(&self) -> Result<String, Error> {
        let fixed = "family,setting,default,reference,error,below_uncertainty,optimal,cpu_seconds";
        let mut columns: Vec<String> = fixed.split(',').map(str::to_owned).collect();
        columns.extend(self.counts.iter().map(|&count| count.to_owned()));
        columns.extend(self.columns.iter().map(|name| format!("error_{name}")));
        columns.push("failure".to_owned());
        csv(columns, self.rows.iter().map(|row| self.cells(row)))
    }

    fn cells(&self, row: &Row) -> Vec<String> {
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
                cells.extend([m.is_below, m.is_optimal].map(|is| is.to_string()));
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
        cells
    }

    /// The page, in the style of the reports.
    ///
    /// # Errors
    /// [`text::Error::Internal`].
    pub(super) fn page(&self, diagram: &str) -> Result<String, Error> {
        let part = |(number, reference): (usize, &Reference)| {
            let rows = self.rows.iter().filter(|row| row.reference == number);
            context! {
                heading => if number == 0 { "Settings" } else { "Mesh and elements" },
                statement => reference.statement(),
                rows => Value::from(Serde(rows.collect::<Vec<_>>())),
            }
        };
        let title = if self.title.is_empty() {
            &self.name
        } else {
            &self.title
        };
        let contents = context! {
            title => title.clone(),
            verdict => self.verdict(),
            notes => self.notes.clone(),
            diagram,
            counts => self.counts.to_vec(),
            columns => self.columns.clone(),
            parts => self.references.iter().enumerate().map(part).collect::<Vec<_>>(),
        };
        page(include_str!("page.html"), contents)
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
