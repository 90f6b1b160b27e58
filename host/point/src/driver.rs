//! The single-point driver: one law, one integration point, mixed control of its components.
//!
//! A driver file leads a point through segments; each component follows a jump or strain, a
//! traction or stress, or a stiffness. [`Driver`] is the checked file, [`Driver::run`] follows its
//! path. An increment lasts one unit of time.

mod anchor;
mod equilibrium;
mod figure;
mod file;
mod frame;
mod incremental_driver;
mod restrictions;
mod silence;
mod table;

pub use file::Driver;
pub(crate) use file::File as DriverFile;
pub use table::{Row, Table};

use crate::capsule::{self, Capsule};
use crate::error::{Error, suggestion};
use crate::output::{Figures, Identity, check_own, identity, is_same};
use crate::plugin::Moment;
use crate::plugin::adapter::{self, Adapter};
use abi::status::Outcome;
use equilibrium::{Fatal, Goal, Miss, Obstacle, Point, Search, Step};
pub(crate) use file::words;
use file::{Control, Segment};
use frame::Frame;
use silence::Silence;
use std::fmt;
use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Most components of gradient and flux.
const N_MAX: usize = 6;
/// Components of gradient or flux, padded with zeros.
type Vector = [f64; N_MAX];

/// Steps below this fraction of an increment are not tried.
const SMALLEST_STEP: f64 = 1.0 / (1 << 20) as f64;
/// Calls of the law after which an increment is given up.
const MAX_CALLS: usize = 1_000_000;
/// Relative change of the initial flux that is worth a warning.
const OUTSIDE: f64 = 1e-9;

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
    /// Where the rows are, unless they went to the standard output.
    pub csv: Option<PathBuf>,
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

/// Runs a driver file without variants. Rows go to `csv`, or to the standard output.
///
/// # Errors
/// As [`run_file_variants`].
pub fn run_file(path: &Path, csv: Option<&Path>) -> Result<PointReport, Error> {
    let mut last = None;
    run_file_variants(path, None, csv, |report| last = Some(report.clone()))?;
    last.ok_or_else(|| Error::Internal("a driver file without drivers".to_owned()))
}

/// Runs a driver file: all its variants one after the other, or one of them. Rows go to `csv`, or
/// to the standard output; of several variants to `csv` with `_<variant>` before its ending.
/// Figures stand beside `csv`, each with the curves of all variants.
///
/// # Errors
/// Bad input and plugin trouble, before anything is written; [`Error::Unwritable`];
/// [`Error::NoEquilibrium`] after the rows and curves found until then have been written.
pub fn run_file_variants(
    path: &Path,
    variant: Option<&str>,
    csv: Option<&Path>,
    report: impl FnMut(&PointReport),
) -> Result<(), Error> {
    run_file_until(path, variant, csv, &crate::stop::Stop::never(), report)
}

/// As [`run_file_variants`], to be stopped on its way.
///
/// # Errors
/// As [`run_file_variants`]; [`Error::Stopped`] after the rows found until then have been written.
pub fn run_file_until(
    path: &Path,
    variant: Option<&str>,
    csv: Option<&Path>,
    stop: &crate::stop::Stop,
    mut report: impl FnMut(&PointReport),
) -> Result<(), Error> {
    let mut drivers = Driver::read(path)?;
    for driver in &mut drivers {
        driver.stop_on(stop);
    }
    run_all(drivers, path, variant, csv, &mut report)
}

/// Runs input of the IncrementalDriver of A. Niemunis with a UMAT. Rows go to `csv`, or to the
/// standard output.
///
/// # Errors
/// As [`run_file_variants`].
pub fn run_incremental(
    path: &Path,
    umat: &Path,
    csv: Option<&Path>,
    stop: &crate::stop::Stop,
    mut report: impl FnMut(&PointReport),
) -> Result<(), Error> {
    let mut driver = Driver::read_incremental(path, umat)?;
    driver.stop_on(stop);
    run_all(vec![driver], path, None, csv, &mut report)
}

fn run_all(
    mut drivers: Vec<Driver>,
    path: &Path,
    variant: Option<&str>,
    csv: Option<&Path>,
    report: &mut dyn FnMut(&PointReport),
) -> Result<(), Error> {
    let names: Vec<String> = drivers.iter().filter_map(|d| d.variant.clone()).collect();
    if let Some(wanted) = variant {
        drivers.retain(|driver| driver.variant.as_deref() == Some(wanted));
        if drivers.is_empty() {
            let known = suggestion(wanted, names.iter().map(String::as_str).collect::<Vec<_>>());
            let message = format!("there is no variant `{wanted}`: {known}");
            return Err(Error::Usage(message));
        }
    }
    if adapter::is_recorded_to().is_some() {
        let [driver] = drivers.as_slice() else {
            let message = "--record is for one run: name one with --variant";
            return Err(Error::Usage(message.to_owned()));
        };
        let foreign = driver.law.library().foreign();
        if foreign.is_none_or(|foreign| foreign.adapter != Adapter::Umat) {
            let id = &driver.law.description().id;
            return Err(Error::Usage(format!("--record: law `{id}` is no UMAT")));
        }
    }
    for driver in &drivers {
        driver.start()?;
    }
    let alone = drivers.len() == 1;
    let Some(csv) = csv else {
        let [driver] = drivers.as_slice() else {
            return Err(Error::Usage(format!(
                "{} has variants: give --csv FILE for all of them, or --variant NAME for one of {}",
                path.display(),
                names.join(", ")
            )));
        };
        let name = Path::new("the standard output");
        return match driver.write_csv(crate::supervision::stdout(), name) {
            Ok(done) => {
                report(&done);
                Ok(())
            }
            // Whoever reads the rows has read enough.
            Err(Error::Unwritable { source, .. }) if source.kind() == io::ErrorKind::BrokenPipe => {
                Ok(())
            }
            Err(error) => Err(error),
        };
    };
    let target = |driver: &Driver| match &driver.variant {
        Some(variant) if !alone => with_suffix(csv, variant),
        _ => csv.to_owned(),
    };
    for driver in &drivers {
        let csv = target(driver);
        if is_same(path, &csv) {
            return Err(Error::Usage(format!(
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
        let file = File::create(&csv).map_err(|source| Error::Unwritable {
            path: csv.clone(),
            source,
        })?;
        let mut figures = driver.empty_figures();
        let out = Guarded {
            own: identity(&file),
            file,
            length: 0,
        };
        let result = driver.follow(out, &csv, &mut figures);
        drawn.push((driver.variant.clone().unwrap_or_default(), figures));
        let mut done = result?;
        done.csv = Some(csv);
        report(&done);
        Ok(())
    });
    let folder = csv.parent().unwrap_or(Path::new(""));
    let figures = match drawn.as_slice() {
        [(_, figures)] if alone => figures.draw(folder),
        several => Figures::draw_overlaid(folder, several),
    };
    outcome.and(figures)
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
        crate::custody::restore().map_err(io::Error::other)?;
        check_own(&self.file, self.own, self.length)?;
        let n = self.file.write(bytes)?;
        self.length += n as u64;
        Ok(n)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
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

/// A goal that was not reached.
#[derive(Debug)]
struct Shortfall {
    /// Fraction of the increment that was reached.
    reached: f64,
    /// Fluxes asked for at its end.
    asked: Vector,
    obstacle: Obstacle,
}

/// Why a walk stopped.
#[derive(Debug)]
enum Stop {
    Shortfall(Box<Shortfall>),
    Fatal(Fatal),
    /// As asked.
    Asked,
}

impl From<Fatal> for Stop {
    fn from(failure: Fatal) -> Self {
        Self::Fatal(failure)
    }
}

impl Driver {
    /// Follows the path and writes its rows as comma-separated values; `name` is for messages.
    ///
    /// # Errors
    /// As [`Driver::run`]; the rows found until then have been written.
    pub fn write_csv(&self, out: impl Write, name: &Path) -> Result<PointReport, Error> {
        self.follow(out, name, &mut self.empty_figures())
    }

    fn follow(
        &self,
        out: impl Write,
        name: &Path,
        figures: &mut Figures,
    ) -> Result<PointReport, Error> {
        let unwritable = |source| Error::Unwritable {
            path: name.to_owned(),
            source,
        };
        let mut table = Table::new(out, self);
        let mut failed = None;
        let sink = |row: &Row<'_>| {
            self.draw_row(figures, row);
            table.write(row).map_err(unwritable)
        };
        let result = self.run_keeping(sink, &mut failed);
        if !matches!(result, Err(Error::Unwritable { .. })) {
            table.flush().map_err(unwritable)?;
        }
        // A table on the standard output has no place beside it.
        match (result, failed) {
            (Err(error), Some(capsule)) if name.is_file() => {
                let file = name.with_extension(capsule::FILE_NAME);
                capsule.write(&file)?;
                let hint = format!(
                    "`pilum replay {}` repeats the call that failed",
                    file.display()
                );
                Err(error.with_hint(&hint))
            }
            (result, _) => result,
        }
    }

    /// Follows the path and hands out its rows, the initial state first.
    ///
    /// # Errors
    /// [`Error::NoEquilibrium`] where a controlled flux cannot be reached or the law cannot
    /// follow; [`Error::Plugin`] if the library breaks down; whatever `sink` fails with.
    pub fn run(
        &self,
        sink: impl FnMut(&Row<'_>) -> Result<(), Error>,
    ) -> Result<PointReport, Error> {
        self.run_keeping(sink, &mut None)
    }

    /// As [`Driver::run`]; also hands out the call of the law that failed for good.
    fn run_keeping(
        &self,
        mut sink: impl FnMut(&Row<'_>) -> Result<(), Error>,
        failed: &mut Option<Capsule>,
    ) -> Result<PointReport, Error> {
        let (point, search, mut warnings) = self.start()?;
        let mut walk = Walk {
            point,
            search,
            rate: None,
            first_step: 1.0,
            cut_backs: 0,
            is_ignored: false,
            silence: Silence::default(),
        };
        let mut strayed = None;
        let n = self.law.n_components();
        let row = |point: &Point, increment, iterations, sink: &mut dyn FnMut(&Row<'_>) -> _| {
            sink(&Row {
                increment,
                gradient: &point.gradient[..n],
                flux: &point.flux[..n],
                internal: &point.internal,
                iterations,
            })
        };
        row(&walk.point, 0, 0, &mut sink)?;
        let mut increment = 0;
        let (mut time, mut step_start) = (0.0, 0.0);
        let mut held = walk.point.flux;
        for (number, segment) in self.segments.iter().enumerate() {
            walk.change_frame(segment.frame, &mut held);
            let ramp = walk.enter(segment, n, &held);
            if segment.first == 0 {
                step_start = time;
            }
            let mut goal = ramp.from;
            for k in 1..=segment.increments {
                let next = ramp.goal(k, segment.increments);
                let calls = walk.search.calls;
                walk.search.moment = Moment {
                    step: segment.step,
                    increment: (segment.first + k) as u32,
                    step_start,
                };
                let place = || {
                    format!(
                        "segment {}, increment {k} of {} ({} of the file)",
                        number + 1,
                        segment.increments,
                        increment + 1
                    )
                };
                let reached = walk.advance(&goal, &next, (time, segment.time_increment));
                let point = walk.cartesian();
                if walk.is_ignored {
                    walk.silence.ignored(place, &point.flux);
                }
                if let Err(stop) = reached {
                    warnings.extend(strayed);
                    warnings.extend(walk.silence.warning(self));
                    if walk.search.is_without_stiffness() {
                        let id = &self.law.description().id;
                        warnings.push(format!("law `{id}` has no stiffness in the initial state"));
                    }
                    let place = place();
                    *failed = self.capsule(&stop, &place);
                    return Err(self.explain(stop, &place, &warnings));
                }
                if strayed.is_none() {
                    strayed = self.strayed(&walk, &place);
                }
                increment += 1;
                time += segment.time_increment;
                row(&point, increment, walk.search.calls - calls, &mut sink)?;
                goal = next;
            }
            // A flux that was led keeps its goal; what is left of its residual does not pile up.
            for i in 0..n {
                held[i] = match segment.control[i] {
                    _ if segment.restrictions.is_some() => walk.point.flux[i],
                    Control::Keep | Control::Flux(_) | Control::FluxBy(_) => goal.flux[i],
                    Control::Gradient(_) | Control::GradientBy(_) | Control::Stiffness(_) => {
                        walk.point.flux[i]
                    }
                };
            }
        }
        warnings.extend(strayed);
        warnings.extend(walk.silence.warning(self));
        walk.change_frame(Frame::Cartesian, &mut held);
        let (times, words) = &walk.search.unreliable;
        if *times > 0 {
            warnings.push(format!(
                "law `{}` calls {times} updates unreliable; the first: {words}",
                self.law.description().id
            ));
        }
        warnings.extend(self.law.take_notes());
        Ok(self.report(&walk, increment, warnings))
    }

    /// What came of a walk to its end.
    fn report(&self, walk: &Walk<'_>, increments: usize, warnings: Vec<String>) -> PointReport {
        let n = self.law.n_components();
        let Point {
            gradient,
            flux,
            internal,
        } = &walk.point;
        let values = gradient[..n].iter().chain(&flux[..n]).chain(internal);
        PointReport {
            variant: self.variant.clone(),
            law: self.law.description().id.clone(),
            version: self.law.description().version.clone(),
            library: self.law.library().path().to_owned(),
            sha256: self.law.library().sha256().to_owned(),
            hypothesis: self.law.hypothesis().name(),
            increments,
            calls: walk.search.calls,
            cut_backs: walk.cut_backs,
            last: self.columns().into_iter().zip(values.copied()).collect(),
            warnings,
            csv: None,
        }
    }

    /// The initial state, checked by an update of no size.
    fn start(&self) -> Result<(Point, Search<'_>, Vec<String>), Error> {
        let point = Point {
            gradient: [0.0; N_MAX],
            flux: self.flux,
            internal: self.internal.clone(),
        };
        let mut search = Search::new(&self.law, &point);
        search.stop = self.stop.clone();
        let mut warnings = self.warnings.clone();
        let answer = search
            .at_rest(&point)
            .map_err(|failure| self.explain(Stop::Fatal(failure), "initial state", &warnings))?;
        let Some(returned) = answer else {
            self.stop.check("initial state")?;
            let words = search.take_obstacle().law.unwrap_or_default();
            return Err(self.initial_error(&words));
        };
        let n = self.law.n_components();
        let scale = self.flux.iter().fold(0.0_f64, |max, v| max.max(v.abs()));
        if (0..n).any(|i| (returned[i] - self.flux[i]).abs() > OUTSIDE * scale) {
            let (_, word) = words(self.law.hypothesis());
            let list = |flux: &Vector| {
                let components = self.law.hypothesis().components();
                let values: Vec<String> = components
                    .iter()
                    .zip(flux)
                    .map(|(name, value)| format!("{name} = {value:.6}"))
                    .collect();
                values.join(", ")
            };
            let (id, given, found) = (
                &self.law.description().id,
                list(&self.flux),
                list(&returned),
            );
            // Those of other programs are given a time in this call, in which they may creep.
            warnings.push(if self.law.library().foreign().is_some() {
                format!(
                    "the initial {word} {given} does not last: law `{id}`, called without any \
                     change, returns {found}"
                )
            } else {
                format!(
                    "the initial {word} {given} lies outside the surface of law `{id}`, which \
                     returns it to {found}"
                )
            });
        }
        Ok((point, search, warnings))
    }

    /// What to say of a point that went farther than what it was led to explains.
    fn strayed(&self, walk: &Walk<'_>, place: &dyn Fn() -> String) -> Option<String> {
        let component = walk.search.strayed(&walk.point)?;
        let (gradient, flux) = words(self.law.hypothesis());
        Some(format!(
            "{}: {gradient} `{}` has to come to {:.3e} to meet its {flux}, which is all but the \
             strength of law `{}`",
            place(),
            self.component(component, walk.search.frame()),
            walk.point.gradient[component],
            self.law.description().id
        ))
    }

    /// Name of a component.
    fn component(&self, number: usize, frame: Frame) -> &'static str {
        let names = frame.components();
        names.map_or_else(
            || self.law.hypothesis().components()[number],
            |names| names[number],
        )
    }

    /// The call of the law behind a stop.
    fn capsule(&self, stop: &Stop, place: &str) -> Option<Capsule> {
        let failure = match stop {
            Stop::Fatal(failure) => failure,
            Stop::Shortfall(shortfall) => shortfall.obstacle.refusal.as_ref()?,
            Stop::Asked => return None,
        };
        let mut origin = vec![("driver", self.path().display().to_string().into())];
        origin.extend(self.variant.iter().map(|v| ("variant", v.as_str().into())));
        origin.push(("place", place.into()));
        Capsule::of(&self.law, failure, origin)
    }

    /// The error that a stop stands for.
    fn explain(&self, stop: Stop, place: &str, warnings: &[String]) -> Error {
        let id = &self.law.description().id;
        let variant = self.variant.iter().map(|name| format!("variant {name}, "));
        let place = &(variant.collect::<String>() + place);
        match stop {
            Stop::Fatal(failure) => {
                let what = match failure.outcome {
                    Outcome::Unsupported => "offers neither a tangent nor an elastic operator",
                    Outcome::Argument => "says that the host broke the contract",
                    Outcome::Internal => "broke down",
                    _ => "failed with a code that fits no update",
                };
                Error::plugin(format!(
                    "{place}: law `{id}` of library {} {what}: {}",
                    self.law.library().path().display(),
                    failure.message
                ))
            }
            Stop::Asked => Error::Stopped {
                message: format!("{place}: stopped as asked; the rows before it are written"),
                hint: None,
            },
            Stop::Shortfall(shortfall) => {
                let Shortfall {
                    reached,
                    asked,
                    obstacle,
                } = *shortfall;
                let broken = obstacle.refusal.as_ref();
                if obstacle.miss.is_none()
                    && let Some(failure) = broken.filter(|failure| self.law.breaks_down(failure))
                {
                    return Error::plugin(format!(
                        "{place}: law `{id}` of library {} fails, however small the step: {}",
                        self.law.library().path().display(),
                        failure.message
                    ));
                }
                let (gradient, flux) = words(self.law.hypothesis());
                let mut end = String::new();
                let (why, hint) = if let Some(miss) =
                    obstacle.miss.filter(|_| obstacle.is_restricted)
                {
                    let why = format!(
                        "restriction {} cannot be met: residual {:.2e} kPa, tolerance {:.1e} kPa",
                        miss.component + 1,
                        miss.residual,
                        miss.tolerance
                    );
                    (why, None)
                } else if let Some(miss) = obstacle.miss {
                    let name = self.component(miss.component, obstacle.frame);
                    if !obstacle.is_sprung(miss.component) {
                        end = format!(
                            ", at whose end {flux} `{name}` is to be {:.9e} kPa",
                            asked[miss.component]
                        );
                    }
                    let hint = format!(
                        "a {flux} beyond strength has no equilibrium; control the {gradient} of \
                         `{name}` instead"
                    );
                    (describe(&miss, name, flux), Some(hint))
                } else {
                    (format!("law `{id}` cannot follow the {gradient}s"), None)
                };
                let mut lines = vec![
                    format!("{place}: no equilibrium: {why}"),
                    format!("reached: {reached:.6} of the increment{end}"),
                ];
                lines.extend(obstacle.law.map(|words| format!("law `{id}`: {words}")));
                lines.extend(warnings.iter().map(|warning| format!("warning: {warning}")));
                let message = lines.join("\n  ");
                Error::NoEquilibrium { message, hint }
            }
        }
    }
}

fn describe(miss: &Miss, name: &str, flux: &str) -> String {
    format!(
        "{flux} `{name}` is {:.9e} kPa at best, {:.9e} kPa is asked for (residual {:.2e}, \
         tolerance {:.1e})",
        miss.flux, miss.goal, miss.residual, miss.tolerance
    )
}

/// A straight line of goals.
#[derive(Clone, Copy, Debug)]
struct Ramp {
    from: Goal,
    to: Goal,
}

impl Ramp {
    /// The goal of increment k of n, the last one without rounding.
    fn goal(&self, k: usize, n: usize) -> Goal {
        if k == n {
            self.to
        } else {
            between(&self.from, &self.to, k as f64 / n as f64)
        }
    }
}

fn between(from: &Goal, to: &Goal, fraction: f64) -> Goal {
    let on_line = |a: &Vector, b: &Vector| std::array::from_fn(|i| a[i] + (b[i] - a[i]) * fraction);
    Goal {
        gradient: on_line(&from.gradient, &to.gradient),
        flux: on_line(&from.flux, &to.flux),
    }
}

/// A point on its way.
#[derive(Debug)]
struct Walk<'a> {
    point: Point,
    search: Search<'a>,
    /// Gradient per increment of the last step, within a segment.
    rate: Option<Vector>,
    /// Fraction of the increment that the first step tries.
    first_step: f64,
    cut_backs: usize,
    /// The law took no notice of a step of the last increment.
    is_ignored: bool,
    silence: Silence,
}

impl Walk<'_> {
    /// Gives the point, and the flux that is held, in other components.
    fn change_frame(&mut self, frame: Frame, held: &mut Vector) {
        let old = self.search.frame();
        if frame == old {
            return;
        }
        self.search.set_frame(frame);
        let point = &mut self.point;
        point.gradient = frame.gradient(&old.cartesian_gradient(&point.gradient));
        point.flux = frame.flux(&old.cartesian_flux(&point.flux));
        *held = frame.flux(&old.cartesian_flux(held));
    }

    /// The point in the components of the law.
    fn cartesian(&self) -> Point {
        let frame = self.search.frame();
        Point {
            gradient: frame.cartesian_gradient(&self.point.gradient),
            flux: frame.cartesian_flux(&self.point.flux),
            internal: self.point.internal.clone(),
        }
    }

    /// Starts a segment. `held` is the flux that components without control keep.
    fn enter(&mut self, segment: &Segment, n: usize, held: &Vector) -> Ramp {
        let from = Goal {
            gradient: self.point.gradient,
            flux: *held,
        };
        if let Some(restrictions) = &segment.restrictions {
            self.rate = None;
            self.first_step = 1.0;
            let gradient = from.gradient;
            let goal = |flux| Goal { gradient, flux };
            return Ramp {
                from: goal([0.0; N_MAX]),
                to: goal(self.search.restrict(restrictions, &self.point)),
            };
        }
        let mut to = from;
        let mut stiffness = [0.0; N_MAX];
        for i in 0..n {
            match segment.control[i] {
                Control::Keep => {}
                Control::Gradient(end) => to.gradient[i] = end,
                Control::Flux(end) => to.flux[i] = end,
                Control::GradientBy(change) => to.gradient[i] += change,
                Control::FluxBy(change) => to.flux[i] += change,
                Control::Stiffness(k) => stiffness[i] = k,
            }
        }
        let is_free = |control| !matches!(control, Control::Gradient(_) | Control::GradientBy(_));
        let free = (0..n).filter(|&i| is_free(segment.control[i]));
        self.search.control(free, stiffness, from.gradient);
        self.rate = None;
        self.first_step = 1.0;
        Ramp { from, to }
    }

    fn shortfall(reached: f64, to: &Goal, obstacle: Obstacle) -> Stop {
        Stop::Shortfall(Box::new(Shortfall {
            reached,
            asked: to.flux,
            obstacle,
        }))
    }

    /// Carries the point over one increment, in as many steps as it takes.
    /// `period`: its start and its length.
    fn advance(&mut self, from: &Goal, to: &Goal, period: (f64, f64)) -> Result<(), Stop> {
        let (time, time_increment) = period;
        let first_call = self.search.calls;
        self.search.anchor(to);
        self.is_ignored = false;
        let mut done = 0.0;
        let mut size = self.first_step;
        let mut may_grow = true;
        while done < 1.0 {
            let end = if done + size > 1.0 - SMALLEST_STEP {
                1.0
            } else {
                done + size
            };
            let length = end - done;
            let goal = if end < 1.0 {
                between(from, to, end)
            } else {
                *to
            };
            let step = Step {
                start: &self.point,
                goal: &goal,
                time: time + done * time_increment,
                time_increment: length * time_increment,
            };
            let guess = self.rate.map(|rate| rate.map(|rate| rate * length));
            if self.search.find(&step, guess.as_ref())? {
                match self.search.is_ignored(&step)? {
                    Some(true) => self.is_ignored = true,
                    Some(false) => self.silence.answered(),
                    None => {}
                }
                let before = self.point.gradient;
                self.search.commit(&mut self.point);
                let after = &self.point.gradient;
                self.rate = Some(std::array::from_fn(|i| (after[i] - before[i]) / length));
                done = end;
                if may_grow {
                    size = (2.0 * size).min(1.0);
                }
                may_grow = true;
                continue;
            }
            if self.search.stop.is_asked() {
                return Err(Stop::Asked);
            }
            let obstacle = self.search.take_obstacle();
            let factor = obstacle.factor.map_or(0.5, |f| f.clamp(0.1, 0.9));
            size = factor * length;
            may_grow = false;
            self.cut_backs += 1;
            if size < SMALLEST_STEP || self.search.calls - first_call > MAX_CALLS {
                return Err(Self::shortfall(done, to, obstacle));
            }
        }
        self.first_step = size;
        match self.search.unmet(&self.point, to) {
            None => Ok(()),
            Some(miss) => {
                let mut obstacle = self.search.take_obstacle();
                obstacle.miss = Some(miss);
                Err(Self::shortfall(1.0, to, obstacle))
            }
        }
    }
}
