//! Tables and pages of results.

use crate::Error;
use minijinja::{Environment, Value, context};
use results::report::STYLE;
use std::path::Path;
use text::write::replace;

/// Writes a file of results in place of what has its name.
///
/// # Errors
/// [`text::Error::Unwritable`].
pub(crate) fn write(path: &Path, text: &str) -> Result<(), Error> {
    Ok(replace(path, text)?)
}

/// A table as comma-separated values, from the names of its columns and its rows.
///
/// # Errors
/// A row has another number of cells.
pub(crate) fn csv(
    columns: impl IntoIterator<Item: AsRef<[u8]>>,
    rows: impl IntoIterator<Item = Vec<String>>,
) -> Result<String, Error> {
    Ok(results::comma_separated(columns, rows)?)
}

/// A page in the style of the reports. Numbers of its contents are brought into digits by the template.
///
/// # Errors
/// [`text::Error::Internal`].
pub(crate) fn page(template: &str, contents: Value) -> Result<String, Error> {
    let mut environment = Environment::new();
    environment.add_filter("digits", digits);
    environment.add_filter("root", f64::sqrt);
    environment.add_filter("fixed", |value: f64, n: usize| format!("{value:.n$}"));
    environment.add_filter("scientific", |value: f64, n: usize| format!("{value:.n$e}"));
    let all = context! { version => env!("CARGO_PKG_VERSION"), style => STYLE, ..contents };
    environment
        .render_named_str("page.html", template, all)
        .map_err(|error| Error::internal(format!("page: {error:#}")))
}

/// A number with six digits.
pub(crate) fn digits(value: f64) -> String {
    let rounded: f64 = format!("{value:.5e}").parse().unwrap_or(value);
    if rounded == 0.0 || (1e-4..1e7).contains(&rounded.abs()) {
        format!("{rounded}")
    } else {
        format!("{rounded:e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_six_digits() {
        assert_eq!(digits(0.780_123_456), "0.780123");
        assert_eq!(digits(86_000.0), "86000");
        assert_eq!(digits(4.500_000_1e-5), "4.5e-5");
        assert_eq!(digits(0.0), "0");
    }
}
