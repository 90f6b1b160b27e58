//! Runs of drivers: one law at one integration point, from a file to tables and figures.

use crate::Error;
use crate::variants::keep;
use input::driver::Driver;
use law::capsule::{self, Capsule};
use law::foreign::Adapter;
use law::{Opener, Stop};
use point::Course;
use results::figure::Figures;
use results::point_figure::{draw_row, drawable};
use results::point_table::Table;
use std::fmt;
use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use text::write::{Identity, check_own, identity, is_same};

/// What came out of a driver file.
#[derive(Clone, Debug)]
pub struct PointReport {
    /// Name of the variant, if the file stands for several drivers.
    pub variant: Option<String>,
    /// Law.
    pub law: String,
    /// Version of the law.
    pub version: String,
    /// Library the law comes from.
    pub library: PathBuf,
    /// SHA-256 of the library.
    pub sha256: String,
    /// Hypothesis.
    pub hypothesis: &'static str,
    /// Increments done.
    pub increments: usize,
    /// Calls of the law.
    pub calls: usize,
    /// Steps repeated with a smaller size.
    pub cut_backs: usize,
    /// Columns of the last row, with their values.
    pub last: Vec<(String, f64)>,
    /// What the user should know.
    pub warnings: Vec<String>,
    /// File of the rows, unless they went to the standard output.
    pub csv: Option<PathBuf>,
}

impl PointReport {
    fn new(driver: &point::Driver, course: Course) -> Self {
        let law = driver.law();
        Self {
            variant: driver.variant().map(str::to_owned),
            law: law.description().id.clone(),
            version: law.description().version.clone(),
            library: law.library().path().to_owned(),
            sha256: law.library().sha256().to_owned(),
            hypothesis: law.hypothesis().name(),
            increments: course.increments,
            calls: course.calls,
            cut_backs: course.cut_backs,
            last: driver.columns().into_iter().zip(course.last).collect(),
            warnings: course.warnings,
            csv: None,
        }
    }
}

impl fmt::Display for PointReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(variant) = &self.variant {
            write!(f, "variant {variant}: ")?;
        }
        writeln!(
            f,
            "law `{}` {} of {}, {}",
            self.law,
            self.version,
            self.library.display(),
            self.hypothesis
        )?;
        for warning in &self.warnings {
            writeln!(f, "warning: {warning}")?;
        }
        write!(
            f,
            "{} increments, {} calls of the law, {} cut-backs",
            self.increments, self.calls, self.cut_backs
        )?;
        for (name, value) in &self.last {
            write!(f, "\n  {name:<20} {value:>14.6e}")?;
        }
        if let Some(csv) = &self.csv {
            write!(f, "\nrows in {}", csv.display())?;
        }
        Ok(())
    }
}

/// Runs a driver file: all its variants one after the other, or one of them. Rows go to `csv`, or
/// to the standard output; of several variants to `csv` with `_<variant>` before its ending.
/// Figures are next to `csv`, each with the curves of all variants. Settings, `KEY=VALUE`, go over what
/// the file says.
///
/// # Errors
/// Bad input and trouble with libraries, before anything is written; what cannot be written; a
/// driver that does not come to its end or is stopped, after the rows and curves found until then
/// have been written.
pub fn run_file(
    opener: &Opener,
    path: &Path,
    (variant, settings): (Option<&str>, &[String]),
    csv: Option<&Path>,
    stop: &Stop,
    mut report: impl FnMut(&PointReport),
) -> Result<(), Error> {
    let mut drivers = Driver::read(opener, path, settings)?;
    for driver in &mut drivers {
        driver.point_mut().stop_on(stop);
    }
    run_all(opener, drivers, path, variant, csv, &mut report)
}

/// Runs input of the IncrementalDriver of A. Niemunis with a UMAT. Rows go to `csv`, or to the
/// standard output.
///
/// # Errors
/// As [`run_file`].
pub fn run_incremental(
    opener: &Opener,
    path: &Path,
    umat: &Path,
    csv: Option<&Path>,
    stop: &Stop,
    mut report: impl FnMut(&PointReport),
) -> Result<(), Error> {
    let mut driver = Driver::read_incremental(opener, path, umat)?;
    driver.point_mut().stop_on(stop);
    run_all(opener, vec![driver], path, None, csv, &mut report)
}

fn run_all(
    opener: &Opener,
    mut drivers: Vec<Driver>,
    path: &Path,
    variant: Option<&str>,
    csv: Option<&Path>,
    report: &mut dyn FnMut(&PointReport),
) -> Result<(), Error> {
    let names: Vec<String> = drivers.iter().filter_map(name).map(str::to_owned).collect();
    keep(&mut drivers, variant, |driver| {
        name(driver).map(str::to_owned)
    })?;
    if opener.record().is_some() {
        check_recording(&drivers)?;
    }
    for driver in &drivers {
        let checked = driver.point().check();
        checked.map_err(|error| driver.located(error))?;
    }
    match csv {
        Some(csv) => run_to_files(&drivers, path, csv, report),
        None => run_to_stdout(&drivers, path, &names, report),
    }
}

/// Name of the variant.
fn name(driver: &Driver) -> Option<&str> {
    driver.point().variant()
}

/// Only one run of a UMAT can be recorded.
fn check_recording(drivers: &[Driver]) -> Result<(), Error> {
    let [driver] = drivers else {
        return Err(Error::usage(
            "--record is for one run: name one with --variant",
        ));
    };
    let law = driver.point().law();
    let foreign = law.library().foreign();
    if foreign.is_none_or(|foreign| foreign.adapter != Adapter::Umat) {
        let id = &law.description().id;
        return Err(Error::usage(format!("--record: law `{id}` is no UMAT")));
    }
    Ok(())
}

fn run_to_stdout(
    drivers: &[Driver],
    path: &Path,
    names: &[String],
    report: &mut dyn FnMut(&PointReport),
) -> Result<(), Error> {
    let [driver] = drivers else {
        return Err(Error::usage(format!(
            "{} has variants: give --csv FILE for all of them, or --variant NAME for one of {}",
            path.display(),
            names.join(", ")
        )));
    };
    let name = Path::new("the standard output");
    let mut figures = empty_figures(driver);
    match follow(driver, crate::supervision::stdout(), &mut figures) {
        Ok(done) => {
            report(&done);
            Ok(())
        }
        // Whoever reads the rows has read enough.
        Err(Ended::Unwritable(source)) if source.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        Err(ended) => Err(ended.at(driver, name)),
    }
}

fn run_to_files(
    drivers: &[Driver],
    path: &Path,
    csv: &Path,
    report: &mut dyn FnMut(&PointReport),
) -> Result<(), Error> {
    let alone = drivers.len() == 1;
    let target = |driver: &Driver| match name(driver) {
        Some(variant) if !alone => with_suffix(csv, variant),
        _ => csv.to_owned(),
    };
    for driver in drivers {
        let csv = target(driver);
        if is_same(path, &csv) {
            return Err(Error::usage(format!(
                "--csv {} would overwrite the driver file",
                csv.display()
            )));
        }
    }
    let mut drawn = Vec::new();
    let outcome = drivers.iter().try_for_each(|driver| {
        let csv = target(driver);
        // A capsule of an earlier run must not be mistaken for one of this.
        let _ = std::fs::remove_file(csv.with_extension(capsule::FILE_NAME));
        let file = File::create(&csv).map_err(|source| text::Error::unwritable(&csv, source))?;
        let mut figures = empty_figures(driver);
        let out = Guarded {
            own: identity(&file),
            file,
            length: 0,
        };
        let result = follow(driver, out, &mut figures);
        drawn.push((name(driver).unwrap_or_default().to_owned(), figures));
        let mut done = result.map_err(|ended| ended.at(driver, &csv))?;
        done.csv = Some(csv);
        report(&done);
        Ok(())
    });
    let folder = csv.parent().unwrap_or(Path::new(""));
    let figures = match drawn.as_slice() {
        [(_, figures)] if alone => figures.draw(folder),
        several => Figures::draw_overlaid(folder, several),
    };
    outcome.and(figures.map_err(Error::from))
}

/// `a/b.csv` to `a/b_<variant>.csv`.
fn with_suffix(csv: &Path, variant: &str) -> PathBuf {
    let mut name = csv.file_stem().unwrap_or_default().to_owned();
    name.push("_");
    name.push(variant);
    if let Some(ending) = csv.extension() {
        name.push(".");
        name.push(ending);
    }
    csv.with_file_name(name)
}

/// A file that is written to only as long as it is what was opened, and with what belongs to the
/// process as it was.
struct Guarded {
    file: File,
    own: Identity,
    length: u64,
}

impl Write for Guarded {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        law::process_state::restore().map_err(io::Error::other)?;
        check_own(&self.file, self.own, self.length)?;
        let n = self.file.write(bytes)?;
        self.length += n as u64;
        Ok(n)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

/// Follows a driver and writes its rows as comma-separated values; `name` is for messages, and a
/// capsule is written next to it if it is a file.
///
/// # Errors
/// As [`run_file`]; the rows found until then have been written.
pub fn write_csv(driver: &Driver, out: impl Write, name: &Path) -> Result<PointReport, Error> {
    follow(driver, out, &mut empty_figures(driver)).map_err(|ended| ended.at(driver, name))
}

/// The figures of a driver, still without curves.
fn empty_figures(driver: &Driver) -> Figures {
    Figures::new(driver.title(), driver.figures(), drawable(driver.point()))
}

/// Why no more rows come.
enum Ended {
    Unwritable(io::Error),
    Point(point::Error),
}

impl Ended {
    /// The error of a table of this name.
    fn at(self, driver: &Driver, name: &Path) -> Error {
        match self {
            Self::Unwritable(source) => text::Error::unwritable(name, source).into(),
            Self::Point(error) => match with_capsule(driver, error, name) {
                Ok(error) => driver.located(error),
                Err(error) => error,
            },
        }
    }
}

impl From<point::Error> for Ended {
    fn from(error: point::Error) -> Self {
        Self::Point(error)
    }
}

fn follow(driver: &Driver, out: impl Write, figures: &mut Figures) -> Result<PointReport, Ended> {
    let point = driver.point();
    // What came through a pipe cannot be read once more.
    let mut table = Table::new(out, point, !driver.path().is_file());
    let has_figures = !driver.figures().is_empty();
    let result = point.run(|row| {
        if !row.is_written {
            return Ok(());
        }
        if has_figures {
            draw_row(point, figures, row);
        }
        table.write(row).map_err(Ended::Unwritable)
    });
    if !matches!(result, Err(Ended::Unwritable(_))) {
        table.flush().map_err(Ended::Unwritable)?;
    }
    Ok(PointReport::new(point, result?))
}

/// Writes the call of the law behind an error next to a table that is a file, and reports it. A table on
/// the standard output has no place next to it.
fn with_capsule(driver: &Driver, error: point::Error, name: &Path) -> Result<point::Error, Error> {
    let capsule = error.failed_call().and_then(|(failure, call)| {
        let mut origin = vec![("driver", driver.path().display().to_string().into())];
        origin.extend(
            failure
                .variant
                .iter()
                .map(|v| ("variant", v.as_str().into())),
        );
        origin.push(("place", failure.place.to_string().into()));
        Capsule::of(driver.point().law(), call, origin)
    });
    let Some(capsule) = capsule.filter(|_| name.is_file()) else {
        return Ok(error);
    };
    let file = name.with_extension(capsule::FILE_NAME);
    capsule.write(&file)?;
    let hint = format!(
        "`pilum replay {}` repeats the call that failed",
        file.display()
    );
    Ok(error.with_hint(&hint))
}
