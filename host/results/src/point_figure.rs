//! Figures of a driver: its columns, and a few that an interface is usually drawn with.

use crate::figure::Figures;
use abi::Hypothesis;
use point::{Driver, Row};

/// Columns that only figures have, under `interface_2d`: mobilised friction, normal stress
/// (compression positive, kPa), opening and slip in mm.
const DERIVED: [&str; 4] = ["mu", "sigma_n", "u_n", "u_t"];

/// Names of everything that figures of a driver may show.
pub fn drawable(driver: &Driver) -> Vec<String> {
    let mut names = driver.columns();
    if driver.law().hypothesis() == Hypothesis::Interface2d {
        names.extend(DERIVED.map(str::to_owned));
    }
    names
}

/// Adds a row to figures of what is [`drawable`].
pub fn draw_row(driver: &Driver, figures: &mut Figures, row: &Row<'_>) {
    let table = row.gradient.iter().chain(row.flux).chain(row.internal);
    let mut values: Vec<Option<f64>> = table.copied().map(Some).collect();
    if let (Hypothesis::Interface2d, &[u_n, u_t], &[t_n, t_t]) =
        (driver.law().hypothesis(), row.gradient, row.flux)
    {
        let mu = (t_n < 0.0).then(|| t_t / -t_n);
        values.extend([mu, Some(-t_n), Some(1e3 * u_n), Some(1e3 * u_t)]);
    }
    figures.add(&values, |_| true);
}
