//! Cost of accuracy: `pilum trade-off`.
//!
//! A study runs a driver or a case under many settings. It measures each against a reference that
//! is finer than all of them, and reports how far the reference is converged. The command is
//! [`run`]; [`reach_until`] goes the other way round and finds settings for a requested error.

mod accuracy;
mod case_study;
mod diagram;
mod division;
mod driver_study;
mod expected;
mod pareto;
mod scheme;
mod settings;
mod stiffness;
mod study;
mod table;
mod trials;

pub use accuracy::{reach_until, run_accurately};

use crate::Error;
use crate::experiment::{Counts, write};
use crate::variants::{folder, keep, of_variant};
use input::{Case, Driver, file_in, is_driver};
use law::{Opener, Stop};
use std::path::{Path, PathBuf};
use study::Study;
use trials::Trials;

/// Settings of a study.
#[derive(Clone, Debug)]
#[expect(clippy::struct_excessive_bools, reason = "options of the command line")]
pub struct Options {
    /// Only this variant.
    pub variant: Option<String>,
    /// Settings over what the file says, `KEY=VALUE`.
    pub settings: Vec<String>,
    /// Folder of the results; `results/trade_off_<name>` if left out.
    pub out: Option<PathBuf>,
    /// Divide meshes by 4 too.
    pub fine: bool,
    /// Try all settings of a case, however long it runs.
    pub thorough: bool,
    /// Go on with the study of a case that was stopped.
    pub resume: bool,
    /// Most increments per segment of a driver, the reference excepted.
    pub most_increments: usize,
    /// Study the stiffness of zero-thickness interfaces instead.
    pub interface_stiffness: bool,
    /// Who may want the study to stop.
    pub stop: Stop,
    /// Settings for opening libraries of laws.
    pub opener: Opener,
}

/// Studies a driver or a case, or all its variants, and writes the results. `show` takes the
/// tables, `say` what is being done.
///
/// # Errors
/// Bad input before anything is written; the failure of the file's own settings or of every
/// reference; [`text::Error::Unwritable`].
pub fn run(
    path: &Path,
    options: &Options,
    show: &mut dyn FnMut(&str),
    say: &mut dyn FnMut(&str),
) -> Result<(), Error> {
    let refused = |message: &str| Err(Error::usage(message));
    if options.most_increments == 0 {
        return refused("--max-increments is 0, expected at least 1");
    }
    if options.resume && options.interface_stiffness {
        return refused(
            "--resume goes on with a study of settings, not with --interface-stiffness",
        );
    }
    let path = file_in(path, "case");
    if !is_driver(&path)? {
        return run_cases(&path, options, show, say);
    }
    if options.interface_stiffness {
        return refused("--interface-stiffness needs a case: a driver has no elements beside it");
    }
    if options.resume {
        return refused("--resume needs a case: the study of a driver always starts anew");
    }
    run_drivers(&path, options, show, say)
}

fn run_drivers(
    path: &Path,
    options: &Options,
    show: &mut dyn FnMut(&str),
    say: &mut dyn FnMut(&str),
) -> Result<(), Error> {
    let mut drivers = Driver::read(&options.opener, path, &options.settings)?;
    let stop = &options.stop;
    for driver in &mut drivers {
        driver.point_mut().stop_on(stop);
    }
    let stem = path.file_stem().unwrap_or_default();
    let stem = stem.to_string_lossy().into_owned();
    let name = |driver: &Driver| driver.point().variant().map(str::to_owned);
    keep(&mut drivers, options.variant.as_deref(), name)?;
    for driver in &drivers {
        let name = options.full_name(&stem, driver.point().variant());
        let place = options.folder(&stem, driver.point().variant());
        let mut study = Study::new(&name, driver.title(), driver_study::COUNTS);
        let mut done = |study: &Study| write_table(study, &place);
        let most = options.most_increments;
        let outcome = driver_study::study(driver, &mut study, most, stop, (&mut done, say));
        let finished = finish(&mut study, &place, outcome, show);
        finished.map_err(|error| of_variant(error, driver.point().variant()))?;
    }
    Ok(())
}

fn run_cases(
    path: &Path,
    options: &Options,
    show: &mut dyn FnMut(&str),
    say: &mut dyn FnMut(&str),
) -> Result<(), Error> {
    let cases = Case::load_with(path, &options.settings)?.into_iter();
    let mut cases: Vec<Case> = cases.map(|case| case.opened_by(&options.opener)).collect();
    keep(&mut cases, options.variant.as_deref(), |c| {
        c.variant.clone()
    })?;
    for case in &cases {
        let checked = crate::run::check(case);
        checked.map_err(|error| of_variant(error, case.variant.as_deref()))?;
    }
    for case in &cases {
        let name = options.full_name(&case.name(), case.variant.as_deref());
        let place = options.folder(&case.name(), case.variant.as_deref());
        if options.interface_stiffness {
            let studied = stiffness::run(case, &name, (&place, &options.stop), show, say);
            studied.map_err(|error| of_variant(error, case.variant.as_deref()))?;
            continue;
        }
        let trials = Trials::begin(case, &place, options.resume, &options.stop)?;
        if trials.len() > 0 {
            say(&format!("{} trials are done already", trials.len()));
        }
        let mut study = Study::new(&name, &case.file.title, Counts::NAMES);
        let mut done = |study: &Study| write_table(study, &place);
        let extent = (options.fine, options.thorough);
        let outcome = case_study::study(&trials, &mut study, extent, (&mut done, say));
        match trials.len() {
            kept if outcome.is_err() && kept > 0 => say(&format!(
                "{kept} trials are kept in {}: --resume goes on from there",
                place.display()
            )),
            _ => trials.end(),
        }
        let finished = finish(&mut study, &place, outcome, show);
        finished.map_err(|error| of_variant(error, case.variant.as_deref()))?;
    }
    Ok(())
}

impl Options {
    /// Name of a study: the file, the variant and the settings.
    fn full_name(&self, name: &str, variant: Option<&str>) -> String {
        let settings = self.settings.iter().map(String::as_str);
        let parts = std::iter::once(name).chain(variant).chain(settings);
        parts.collect::<Vec<_>>().join(", ")
    }

    /// The folder of one study: that of all, or one inside it for each variant.
    fn folder(&self, name: &str, variant: Option<&str>) -> PathBuf {
        let name = format!("trade_off_{name}");
        folder(self.out.as_deref(), &name, variant, self.variant.as_deref())
    }
}

/// Writes table, diagram and page, and shows the table: of a study that was stopped what there is.
fn finish(
    study: &mut Study,
    folder: &Path,
    outcome: Result<(), Error>,
    show: &mut dyn FnMut(&str),
) -> Result<(), Error> {
    match &outcome {
        Ok(()) => (),
        Err(error) if error.is_stop() && !study.references.is_empty() => {
            let n = study.rows.len();
            let note = format!("the study was stopped: these are the first {n} settings of it");
            study.notes.push(note);
        }
        Err(_) => return outcome,
    }
    write_table(study, folder)?;
    let diagram = study.diagram().map_err(Error::internal)?;
    let page = study.page(&diagram)?;
    write(&folder.join("trade_off.svg"), &diagram)?;
    write(&folder.join("trade_off.html"), &page)?;
    show(&study.text());
    show(&format!("results in {}", folder.display()));
    outcome
}

/// Writes the rows that there are.
fn write_table(study: &Study, folder: &Path) -> Result<(), Error> {
    std::fs::create_dir_all(folder).map_err(|source| text::Error::unwritable(folder, source))?;
    write(&folder.join("trade_off.csv"), &study.csv()?)
}
