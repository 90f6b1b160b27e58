//! The commands: calls of the rooms, and their output.

mod cases;
mod exchanges;
mod meshes;
mod studies;

use crate::arguments::{Arguments, Calibrate, Command, File, Point, TradeOff};
use crate::output::{print, printing, say};
use crate::threads;
use cases::write_report;
use clap::CommandFactory;
use input::schema::{self, FileKind};
use input::{Case, Error};
use law::foreign::Adapter;
use law::{Opener, SearchPath, Stop, trial};
use runs::{calibration, supervision, trade_off};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use text::write::refuse_other;

pub(crate) fn execute(command: Command, opener: Opener) -> Result<(), Error> {
    match command {
        Command::Run(asked) => cases::run(&asked, opener),
        Command::Point(asked) => run_point(&asked, opener),
        Command::Study(asked) => studies::study(&asked, &opener),
        Command::Report {
            folders,
            out,
            print,
        } => write_report(&folders, out, print),
        Command::Table { folders, out } => write_table(&folders, out.as_deref()),
        Command::Mesh(asked) => meshes::show(&asked),
        Command::Export(asked) => exchanges::export(&asked, &opener),
        Command::Import { folder, out } => exchanges::import(&folder, out.as_deref()),
        Command::TradeOff(asked) => study_settings(asked, opener),
        Command::Calibrate(asked) => calibrate(asked, opener),
        Command::Check(arguments) => {
            printing(|out| workshop::check::run(&arguments, &opener, &mut |text| out.text(text)))
        }
        Command::Laws {
            id,
            law_path,
            places,
            json,
        } => show_laws(&opener, id.as_deref(), &law_path, places, json),
        Command::NewLaw(project) => print(&project.write()?),
        Command::NewSidecar(sidecar) => print(&sidecar.write()?),
        Command::Schema { file } => print_schema(file),
        Command::Completions { shell } => print_completions(shell),
        Command::Man { into: None } => manual(&Arguments::command()),
        Command::Man { into: Some(folder) } => manuals(&folder),
        Command::Inspect { library, json } => show_library(&library, json),
        Command::Lock { input } => lock(&opener, &input),
        Command::Replay {
            capsule,
            record,
            reached,
            ..
        } => replay(&capsule, record.as_deref(), opener, reached.as_deref()),
        #[cfg(unix)]
        Command::LawWorker => Ok(law::isolate::work()?),
        #[cfg(not(unix))]
        Command::LawWorker => Err(Error::usage("there are no workers here")),
        Command::ProbeLibrary { library, sha256 } => {
            let answer = &mut std::io::stdout().lock();
            Ok(trial::probe(&library, &sha256, answer)?)
        }
    }
}

fn write_table(folders: &[PathBuf], out: Option<&Path>) -> Result<(), Error> {
    let table = results::run_table::of(folders)?;
    let Some(out) = out else {
        return print(&table);
    };
    std::fs::write(out, table).map_err(|source| text::Error::unwritable(out, source))?;
    print(&format!("table in {}\n", out.display()))
}

fn study_settings(asked: TradeOff, opener: Opener) -> Result<(), Error> {
    let options = trade_off::Options {
        variant: asked.variant,
        settings: asked.set,
        out: asked.out,
        fine: asked.fine,
        thorough: asked.thorough,
        resume: asked.resume,
        most_increments: asked.max_increments,
        interface_stiffness: asked.interface_stiffness,
        stop: stop_on_signals()?,
        opener,
    };
    printing(|out| {
        let mut show = |text: &str| out.line(text);
        trade_off::run(&asked.input, &options, &mut show, &mut |doing| {
            say!("{doing}");
        })
    })
}

fn calibrate(asked: Calibrate, opener: Opener) -> Result<(), Error> {
    threads::gather(asked.threads)?;
    threads::begin()?;
    let options = calibration::Options {
        variant: asked.variant,
        settings: asked.set,
        out: asked.out,
        stop: stop_on_signals()?,
        opener,
        anew: asked.anew,
    };
    printing(|out| {
        let mut show = |text: &str| out.line(text);
        calibration::run(&asked.file, &options, &mut show, &mut |doing| {
            say!("{doing}");
        })
    })
}

fn show_library(library: &Path, json: bool) -> Result<(), Error> {
    let inspection = law::inspect::inspect(library)?;
    if json {
        print(&law::inspect::json(&inspection)?)
    } else {
        print(&format!("{inspection}\n"))
    }
}

/// Does something while one call of a UMAT is recorded, if a file for it is given, and says whether
/// it was.
fn lock(opener: &Opener, input: &Path) -> Result<(), Error> {
    let lock = input::lock::write(opener, input)?;
    print(&format!("lock in {}\n", lock.display()))
}

fn replay(
    capsule: &Path,
    record: Option<&Path>,
    opener: Opener,
    reached: Option<&Path>,
) -> Result<(), Error> {
    recorded(record, opener, |opener| {
        printing(|out| {
            let say = &mut |line: &str| out.line(line);
            workshop::replay::replay(capsule, opener, reached, say)
        })
    })
}

fn recorded(
    file: Option<&Path>,
    opener: Opener,
    action: impl FnOnce(&Opener) -> Result<(), Error>,
) -> Result<(), Error> {
    let Some(file) = file else {
        return action(&opener);
    };
    let path = std::path::absolute(file).unwrap_or_else(|_| file.to_owned());
    let unwritable = |source| text::Error::unwritable(&path, source);
    refuse_other(&path)?;
    // The record takes the place of an earlier one when there is one, not before.
    let mut partial = path.clone().into_os_string();
    partial.push(".part");
    let partial = PathBuf::from(partial);
    std::fs::File::create(&partial)
        .and_then(|_| std::fs::remove_file(&partial))
        .map_err(unwritable)?;
    let outcome = action(&opener.recording_to(partial.clone()));
    if partial.is_file() {
        std::fs::rename(&partial, &path).map_err(unwritable)?;
        say!("all arguments of one call in {}", file.display());
    } else if outcome.is_ok() {
        say!("no call was recorded: none moved a point");
    }
    outcome
}

/// Refuses to record where it is not plain which law is meant.
fn check_recording(cases: &[Case]) -> Result<(), Error> {
    let [case] = cases else {
        let message = "--record is for one run: name one with --variant";
        return Err(Error::usage(message.to_owned()));
    };
    let mut umats = Vec::new();
    for (name, law) in &case.file.laws {
        let foreign = law.get_ref().foreign(&case.source)?;
        if foreign.is_some_and(|foreign| foreign.adapter == Adapter::Umat) {
            umats.push(name.get_ref().as_str());
        }
    }
    let message = match umats.as_slice() {
        [_] => return Ok(()),
        [] => format!(
            "--record: no law of {} is a UMAT",
            case.source.path().display()
        ),
        several => format!(
            "--record: {} are UMATs; give the key `record` to the one that is meant",
            several.join(", ")
        ),
    };
    Err(Error::usage(message))
}

/// Source of requests to stop: the process that watches this one, or else Ctrl-C and similar
/// signals; a second one ends the program at once.
fn stop_on_signals() -> Result<Stop, Error> {
    if let Some(stop) = supervision::stop() {
        return Ok(stop);
    }
    let asked = Arc::new(AtomicBool::new(false));
    let stop = Stop::flag(Arc::clone(&asked));
    let ask = move || {
        if asked.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
        say!("{}", supervision::STOPPING);
    };
    ctrlc::set_handler(ask).map_err(|error| match error {
        ctrlc::Error::System(why) => cannot_start("a thread for Ctrl-C", &why),
        error => Error::internal(error.to_string()),
    })?;
    Ok(stop)
}

/// Starting a thread mostly needs memory.
pub(crate) fn cannot_start(what: &str, why: &impl std::fmt::Display) -> Error {
    #[cfg(unix)]
    let message = runs::memory::cannot_start(what, why);
    #[cfg(not(unix))]
    let message = format!("not enough memory to start {what}: {why}");
    Error::usage(message)
}

/// Tables go to standard output or files, what came out of each driver to the error stream.
fn run_point(asked: &Point, opener: Opener) -> Result<(), Error> {
    let stop = &stop_on_signals()?;
    let report = |report: &runs::point::PointReport| say!("{report}");
    let (driver, csv) = (&asked.driver, asked.csv.as_deref());
    let which = (asked.variant.as_deref(), asked.set.as_slice());
    recorded(asked.record.as_deref(), opener, |opener| {
        match &asked.umat {
            Some(umat) => runs::point::run_incremental(opener, driver, umat, csv, stop, report),
            None if driver.extension().is_some_and(|ending| ending == "inp") => {
                Err(Error::usage(format!(
                    "{} is no driver file; `--umat LIBRARY` reads input of the IncrementalDriver",
                    driver.display()
                )))
            }
            None => runs::point::run_file(opener, driver, which, csv, stop, report),
        }
    })
}

fn show_laws(
    opener: &Opener,
    id: Option<&str>,
    folders: &[PathBuf],
    places: bool,
    json: bool,
) -> Result<(), Error> {
    if let Some(missing) = folders.iter().find(|folder| !folder.is_dir()) {
        let message = format!("--law-path: there is no folder {}", missing.display());
        return Err(Error::usage(message));
    }
    let search = SearchPath::of(opener, folders);
    let text = match (id, json) {
        (None, false) if places => workshop::laws::places(&search),
        (None, true) if places => workshop::laws::places_json(&search)?,
        (None, false) => workshop::laws::list(&search),
        (None, true) => workshop::laws::list_json(&search)?,
        (Some(id), false) => workshop::laws::page(&workshop::laws::find(&search, opener, id)?),
        (Some(id), true) => workshop::laws::page_json(&workshop::laws::find(&search, opener, id)?)?,
    };
    print(&text)
}

fn print_schema(file: File) -> Result<(), Error> {
    let text = serde_json::to_string_pretty(&schema::of(match file {
        File::Case => FileKind::Case,
        File::Point => FileKind::Point,
        File::Study => FileKind::Study,
        File::Calibration => FileKind::Calibration,
    }))
    .map_err(|error| Error::internal(error.to_string()))?;
    print(&format!("{text}\n"))
}

fn print_completions(shell: clap_complete::Shell) -> Result<(), Error> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Arguments::command(), "pilum", &mut script);
    print(&String::from_utf8_lossy(&script))
}

/// A manual page for the program and for each command.
fn manuals(folder: &Path) -> Result<(), Error> {
    let written = clap_mangen::generate_to(Arguments::command(), folder);
    Ok(written.map_err(|source| text::Error::unwritable(folder, source))?)
}

/// The program's manual page, that of each command behind it.
fn manual(program: &clap::Command) -> Result<(), Error> {
    let mut page = Vec::new();
    let mut written = clap_mangen::Man::new(program.clone()).render(&mut page);
    let shown = |command: &&clap::Command| !command.is_hide_set();
    for command in program.get_subcommands().filter(shown) {
        // A command's name lives as long as the program.
        let name: &'static str = format!("pilum-{}", command.get_name()).leak();
        let command = command.clone().name(name);
        let section = clap_mangen::Man::new(command);
        written = written.and_then(|()| section.render(&mut page));
    }
    written.map_err(|error| Error::internal(error.to_string()))?;
    print(&String::from_utf8_lossy(&page))
}
