//! Figures of a driver: its columns, and a few that an interface is usually drawn with.

use super::{Driver, Row};
use crate::error::{Error, Source};
use crate::output::{Figures, check_table_figures};
use abi::Hypothesis;

/// Columns that only figures have, under `interface_2d`: mobilised friction, normal stress
/// (compression positive, kPa), opening and slip in mm.
const DERIVED: [&str; 4] = ["mu", "sigma_n", "u_n", "u_t"];

impl Driver {
    /// Names of everything that figures may show.
    fn drawable(&self) -> Vec<String> {
        let mut names = self.columns();
        if self.law.hypothesis() == Hypothesis::Interface2d {
            names.extend(DERIVED.map(str::to_owned));
        }
        names
    }

    /// Refuses figures of columns that there are not.
    pub(super) fn check_figures(&self, source: &Source) -> Result<(), Error> {
        let names = self.drawable();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        check_table_figures(source, &self.figures, &names)
    }

    /// The figures, still without curves.
    pub(super) fn empty_figures(&self) -> Figures {
        Figures::new(&self.title, &self.figures, self.drawable())
    }

    /// Adds a row to the figures.
    pub(super) fn draw_row(&self, figures: &mut Figures, row: &Row<'_>) {
        if self.figures.is_empty() {
            return;
        }
        let table = row.gradient.iter().chain(row.flux).chain(row.internal);
        let mut values: Vec<Option<f64>> = table.copied().map(Some).collect();
        if let (Hypothesis::Interface2d, &[u_n, u_t], &[t_n, t_t]) =
            (self.law.hypothesis(), row.gradient, row.flux)
        {
            let mu = (t_n < 0.0).then(|| t_t / -t_n);
            values.extend([mu, Some(-t_n), Some(1e3 * u_n), Some(1e3 * u_t)]);
        }
        figures.add(&values, |_| true);
    }
}
