//! Drivers, of a text or a file.

use input::Driver;
use law::{Opener, Stop};
use runs::point::{PointReport, run_file};
use std::path::Path;
use text::Source;

/// The driver of a text without variants.
///
/// # Errors
/// Those of [`Driver::variants`].
///
/// # Panics
/// If the text has variants.
pub fn of_text(text: &str) -> Result<Driver, input::Error> {
    let source = Source::new("driver.toml", text);
    let mut drivers = Driver::variants(&Opener::default(), source, true)?;
    assert_eq!(drivers.len(), 1);
    Ok(drivers.remove(0))
}

/// Runs a driver file: all its variants, or one of them. Rows go to `csv`.
///
/// # Errors
/// Those of [`run_file`].
pub fn run(
    path: &Path,
    variant: Option<&str>,
    csv: Option<&Path>,
    report: impl FnMut(&PointReport),
) -> Result<(), runs::Error> {
    let (opener, stop) = (Opener::default(), Stop::never());
    run_file(&opener, path, (variant, &[]), csv, &stop, report)
}
