//! Figures of a driver: its columns, and a few that an interface is usually drawn with.

use crate::figure::Figures;
use abi::Hypothesis;
use point::{Driver, Row};

/// Columns that only figures have, of interfaces: mobilised friction, normal stress (compression
/// positive, kPa), opening and slip in mm; the last is that of three dimensions.
const DERIVED: [&str; 5] = ["mu", "sigma_n", "u_n", "u_t", "u_s"];

/// Names of everything that figures of a driver may show.
pub fn drawable(driver: &Driver) -> Vec<String> {
    let mut names = driver.columns();
    let hypothesis = driver.law().hypothesis();
    if hypothesis.is_interface() {
        let n = DERIVED.len() - usize::from(hypothesis == Hypothesis::Interface2d);
        names.extend(DERIVED[..n].iter().map(|name| (*name).to_owned()));
    }
    if driver.is_timed() {
        names.push(point::TIME.to_owned());
    }
    names
}

/// The values of a row, in the order of [`drawable`].
pub fn drawn(driver: &Driver, row: &Row<'_>) -> Vec<Option<f64>> {
    let table = row.gradient.iter().chain(row.flux).chain(row.internal);
    let mut values: Vec<Option<f64>> = table.copied().map(Some).collect();
    match (driver.law().hypothesis(), row.gradient, row.flux) {
        (Hypothesis::Interface2d, &[u_n, u_t], &[t_n, t_t]) => {
            let mu = (t_n < 0.0).then(|| t_t / -t_n);
            values.extend([mu, Some(-t_n), Some(1e3 * u_n), Some(1e3 * u_t)]);
        }
        (Hypothesis::Interface3d, &[u_n, u_t, u_s], &[t_n, t_t, t_s]) => {
            let mu = (t_n < 0.0).then(|| t_t.hypot(t_s) / -t_n);
            values.extend([mu, Some(-t_n)]);
            values.extend([u_n, u_t, u_s].map(|u| Some(1e3 * u)));
        }
        _ => {}
    }
    if driver.is_timed() {
        values.push(Some(row.time));
    }
    values
}

/// Adds a row to figures of what is [`drawable`].
pub fn draw_row(driver: &Driver, figures: &mut Figures, row: &Row<'_>) {
    figures.add(&drawn(driver, row), |_| true);
}
