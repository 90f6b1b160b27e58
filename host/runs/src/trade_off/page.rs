//! A study as a page, in the style of the reports.

use super::study::{Row, Study};
use crate::Error;
use minijinja::{Environment, Value, context};

const TEMPLATE: &str = include_str!("page.html");
use results::report::STYLE;

impl Study {
    /// The page.
    ///
    /// # Errors
    /// [`text::Error::Internal`].
    pub(super) fn page(&self, diagram: &str) -> Result<String, Error> {
        let mut environment = Environment::new();
        environment
            .add_template("trade_off.html", TEMPLATE)
            .and_then(|()| environment.get_template("trade_off.html"))
            .and_then(|template| template.render(self.contents(diagram)))
            .map_err(|error| Error::internal(format!("page: {error:#}")))
    }

    fn contents(&self, diagram: &str) -> Value {
        let part = |number: usize| {
            let rows = self.rows.iter().filter(|row| row.reference == number);
            context! {
                heading => if number == 0 { "Settings" } else { "Mesh and elements" },
                statement => self.references[number].statement(),
                rows => rows.map(cells).collect::<Vec<_>>(),
            }
        };
        let title = if self.title.is_empty() {
            &self.name
        } else {
            &self.title
        };
        context! {
            version => env!("CARGO_PKG_VERSION"),
            style => STYLE,
            title => title.clone(),
            verdict => self.verdict(),
            notes => self.notes.clone(),
            diagram,
            counts => self.counts.to_vec(),
            columns => self.columns.clone(),
            width => 2 + self.counts.len() + self.columns.len(),
            parts => (0..self.references.len()).map(part).collect::<Vec<_>>(),
        }
    }
}

fn cells(row: &Row) -> Value {
    let mut marks = String::new();
    if row.is_default {
        marks.push('>');
    }
    match &row.outcome {
        Ok(measured) => {
            if measured.is_optimal {
                marks.push('*');
            }
            if measured.is_below {
                marks.push('<');
            }
            let mut cells = vec![
                format!("{:.1e}", measured.error),
                format!("{:.3}", 1e3 * measured.seconds),
            ];
            cells.extend(measured.counts.iter().map(u64::to_string));
            cells.extend(measured.errors.iter().map(|error| format!("{error:.1e}")));
            context! { marks, label => row.label.clone(), cells }
        }
        Err(failure) => context! { marks, label => row.label.clone(), failure => failure.clone() },
    }
}
