//! The `pilum` program: arguments to library calls, and their outcome to messages and exit codes.

use clap::{CommandFactory, Parser, Subcommand};
use host::case::Case;
use host::error::{Error, Place, suggestion};
use host::new_law::NewLaw;
use host::output::{Figures, refuse_other, remove_comparison};
use host::plugin::adapter::{self, Adapter};
use host::plugin::{SearchPath, Trust, vetting};
use host::run::{Observer, Options, check, run_reusing};
use host::schema::{self, FileKind};
use host::solver::Reuse;
use host::stop::Stop;
use host::supervision;
use host::trade_off;
use indicatif::{ProgressBar, ProgressStyle};
use std::io::{IsTerminal, Write as _};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

/// Memory that runs out ends the program with a message.
#[cfg(unix)]
#[global_allocator]
static ALLOCATOR: host::memory::Allocator = host::memory::Allocator;

/// A line on the error stream. That it cannot be written does not end a run, but is said of it in
/// the end.
macro_rules! say {
    ($($text:tt)*) => {
        unsaid(writeln!(std::io::stderr(), $($text)*))
    };
}

/// Why the error stream took no more.
static UNSAID: Mutex<Option<std::io::Error>> = Mutex::new(None);

/// Keeps why a line could not be written. Whoever reads a pipe may have read enough.
fn unsaid(written: std::io::Result<()>) {
    if let Err(why) = written
        && why.kind() != std::io::ErrorKind::BrokenPipe
    {
        let mut unsaid = UNSAID.lock().unwrap_or_else(PoisonError::into_inner);
        unsaid.get_or_insert(why);
    }
}

/// Finite elements for soil-structure interfaces, with constitutive laws as plugins.
#[derive(Parser)]
#[command(name = "pilum", version, max_term_width = 100)]
struct Arguments {
    /// Open libraries that are not known yet without trying them in a child process first.
    #[arg(long, global = true)]
    no_probe: bool,
    /// Call laws in processes of their own, so that one that crashes ends the increment and not the
    /// program; a call may take this many seconds.
    #[arg(
        long,
        global = true,
        value_name = "SECONDS",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "10",
        value_parser = seconds
    )]
    isolate: Option<f64>,
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Run a case, or all variants of it.
    Run {
        /// A case file, or a folder with `case.toml`.
        case: PathBuf,
        /// Run only this variant of it.
        #[arg(long)]
        variant: Option<String>,
        /// Folder for the results [default: results/CASE or results/CASE/VARIANT].
        #[arg(long)]
        out: Option<PathBuf>,
        /// Go on from where an earlier run into the same folder was stopped, or start if none was.
        #[arg(long)]
        resume: bool,
        /// Seconds between checkpoints, from which a run can be resumed; 0: after every increment.
        #[arg(long, value_name = "SECONDS", default_value_t = 1.0, value_parser = not_negative)]
        checkpoint: f64,
        /// Threads; the results do not depend on it [default: all processors].
        #[arg(long, value_parser = clap::value_parser!(u16).range(1..))]
        threads: Option<u16>,
        /// Write all arguments of one call of the case's UMAT to this file, before and after it.
        #[arg(long, value_name = "FILE")]
        record: Option<PathBuf>,
    },
    /// Lead one law at one integration point along a path.
    Point {
        /// A driver file, or with `--umat` the `test.inp` of an IncrementalDriver.
        driver: PathBuf,
        /// Read input of the IncrementalDriver, and run it with this Abaqus user subroutine.
        #[arg(long, value_name = "LIBRARY", conflicts_with = "variant")]
        umat: Option<PathBuf>,
        /// Run only this variant of it.
        #[arg(long)]
        variant: Option<String>,
        /// File for the table; standard output if left out.
        #[arg(long)]
        csv: Option<PathBuf>,
        /// Write all arguments of one call of the UMAT to this file, before and after it.
        #[arg(long, value_name = "FILE")]
        record: Option<PathBuf>,
    },
    /// Write the report of a run, or the comparison of several.
    Report {
        /// Results folders.
        #[arg(required = true)]
        folders: Vec<PathBuf>,
        /// The report's file [default: report.html in the folder, or beside the folders].
        #[arg(long)]
        out: Option<PathBuf>,
    },
    /// Measure what accuracy costs: the settings of a case or driver, error against CPU time.
    TradeOff {
        /// A case file, a folder with `case.toml`, or a driver file.
        input: PathBuf,
        /// Study only this variant of it.
        #[arg(long)]
        variant: Option<String>,
        /// Folder for the results [default: `results/trade_off_NAME`].
        #[arg(long)]
        out: Option<PathBuf>,
        /// Divide the mesh of a case by 4 too, not only by 2.
        #[arg(long)]
        fine: bool,
        /// Most increments per segment of a driver.
        #[arg(long, default_value_t = 1000)]
        max_increments: usize,
        /// Instead: what stiffness the interfaces of no thickness should have.
        #[arg(long)]
        interface_stiffness: bool,
    },
    /// Check whether a library keeps the contract; each check runs in a process of its own.
    Check(host::check::Arguments),
    /// List the laws found, or show all about one of them.
    Laws {
        /// Id of a law.
        id: Option<String>,
        /// A folder with law libraries, looked in first; may be repeated.
        #[arg(long, value_name = "DIR")]
        law_path: Vec<PathBuf>,
        /// As JSON.
        #[arg(long)]
        json: bool,
    },
    /// Read what a library is and needs, without executing it.
    Inspect {
        /// A library.
        library: PathBuf,
        /// As JSON.
        #[arg(long)]
        json: bool,
    },
    /// Write the libraries that a case or driver uses, with their SHA-256, to a lock file beside it.
    Lock {
        /// A case file, a folder with `case.toml`, or a driver file.
        input: PathBuf,
    },
    /// Repeat the call of a law that failed, from the file that a run left in its results.
    Replay {
        /// A `failure.toml`.
        capsule: PathBuf,
        /// Write all arguments of the call, that of a UMAT, to this file, before and after it.
        #[arg(long, value_name = "FILE")]
        record: Option<PathBuf>,
        /// Call the law in this process, for a debugger, and not in one of its own.
        #[arg(long, conflicts_with = "isolate")]
        in_process: bool,
    },
    /// Write a small project for a law that builds and runs.
    NewLaw(NewLaw),
    /// Print the JSON Schema of an input file, for editors.
    Schema {
        /// Which file.
        file: FileKind,
    },
    /// Print completions for a shell.
    Completions {
        /// Which shell.
        shell: clap_complete::Shell,
    },
    /// Print the manual page.
    Man,
    /// Try a library: what a child process does.
    #[command(name = vetting::COMMAND, hide = true)]
    ProbeLibrary { library: PathBuf, sha256: String },
    /// Call a law for another process.
    #[command(name = "law-worker", hide = true)]
    LawWorker,
}

impl Command {
    /// Whether it calls laws in its own process, which they may end; and whether that may be done
    /// once more with laws in processes of their own.
    fn calls_laws(&self) -> Option<bool> {
        match self {
            // What came through a pipe comes only once.
            Self::Run { case, .. } => Some(case.is_file() || case.is_dir()),
            Self::Point { driver, csv, .. } => {
                let goes_into_pipe = csv
                    .as_ref()
                    .is_some_and(|csv| csv.exists() && !csv.is_file());
                Some(driver.is_file() && !goes_into_pipe)
            }
            Self::TradeOff { .. } | Self::Laws { .. } | Self::Lock { .. } => Some(false),
            _ => None,
        }
    }

    /// A replay outlives a law that crashes again.
    fn isolates_anyway(&self) -> Option<f64> {
        let replays = matches!(self, Self::Replay { in_process, .. } if !in_process);
        (replays && cfg!(unix)).then_some(10.0)
    }
}

fn main() -> ExitCode {
    #[cfg(unix)]
    {
        host::memory::reserve();
        host::child::ignore_file_limit();
    }
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) => {
            let said = error.print().and_then(|()| std::io::stdout().flush());
            // Help and version are no errors; everything else is bad input.
            if error.use_stderr() {
                return ExitCode::from(1);
            }
            let failure = said.err();
            return ended(Output { failure }.end(Ok(())));
        }
    };
    let outcome = match arguments.command.calls_laws().map(watched) {
        Some(Watched::By(code)) => return code,
        Some(Watched::Not(failure)) => failure.map_or(Ok(()), Err),
        None => Ok(()),
    };
    if outcome.is_err() {
        return ended(outcome);
    }
    let apart = arguments
        .isolate
        .or_else(|| arguments.command.isolates_anyway());
    // The limits of a check's own process are not a law's doing.
    if arguments.command.calls_laws().is_some() {
        host::custody::begin();
    }
    supervision::begin_run(apart.is_some());
    let trust = Trust {
        probe: !arguments.no_probe,
        isolate: apart
            .or_else(|| supervision::is_again().then_some(AS_LONG_AS_IT_TAKES))
            .map(Duration::from_secs_f64),
    };
    trust.set();
    let run = || {
        if cfg!(not(unix)) && trust.isolate.is_some() {
            let message = "--isolate needs a Unix system";
            return Err(Error::Usage(message.to_owned()));
        }
        execute(arguments.command)
    };
    // A panic has printed itself; it is a defect of the program, not of the input.
    let outcome =
        std::panic::catch_unwind(std::panic::AssertUnwindSafe(run)).unwrap_or_else(|_| {
            Err(Error::Internal(
                "the program panicked; please report it".to_owned(),
            ))
        });
    ended(outcome)
}

/// Seconds that a call may take where the user has set no limit to it.
const AS_LONG_AS_IT_TAKES: f64 = 1e6;

/// Who carries out a command that calls laws.
enum Watched {
    /// A child did, with this outcome.
    By(ExitCode),
    /// This process has to, unless something is wrong.
    Not(Option<Error>),
}

/// Has a child carry the command out and watches it, unless this process is the child.
fn watched(again: bool) -> Watched {
    if std::env::var_os(supervision::ALONE).is_some() {
        return Watched::Not(None);
    }
    match supervision::enter() {
        Ok(true) => return Watched::Not(None),
        Ok(false) => {}
        Err(why) => {
            let message = format!("the program cannot be watched: {why}");
            return Watched::Not(Some(Error::Internal(message)));
        }
    }
    // What the child could not write any more.
    let mend = |folder: &Path, error: &Error| {
        let mended = host::output::end_summary(folder, error);
        let reported = || {
            let folders = [folder.to_owned()];
            host::report::write(&folders, &host::report::default_path(&folders)).map(|_| ())
        };
        if let Err(why) = mended.and_then(|is_there| if is_there { reported() } else { Ok(()) }) {
            say!("{:?}", miette::Report::new(why));
        }
    };
    match supervision::supervise(again, &mend) {
        None => Watched::Not(None),
        Some(Ok(code)) => Watched::By(ExitCode::from(code)),
        Some(Err(error)) => Watched::By(ended(Err(error))),
    }
}

/// The exit code, after the message. What a command came to matters more than that not all could be
/// said of it.
fn ended(outcome: Result<(), Error>) -> ExitCode {
    let unsaid = UNSAID.lock().unwrap_or_else(PoisonError::into_inner).take();
    let outcome = outcome.and(match unsaid {
        None => Ok(()),
        Some(why) => Err(Error::Usage(format!(
            "cannot write to the standard error: {why}"
        ))),
    });
    let code = match outcome.map_err(named_shortage) {
        Ok(()) => 0,
        Err(error) => {
            let code = error.exit_code();
            say!("{:?}", miette::Report::new(error));
            code
        }
    };
    supervision::end(code);
    ExitCode::from(code)
}

/// A file that the system has no memory for is no trouble with the file.
fn named_shortage(error: Error) -> Error {
    match &error {
        Error::Unreadable { source, .. } | Error::Unwritable { source, .. }
            if source.kind() == std::io::ErrorKind::OutOfMemory =>
        {
            cannot_start("the command", &error)
        }
        _ => error,
    }
}

fn execute(command: Command) -> Result<(), Error> {
    match command {
        Command::Run {
            case,
            variant,
            out,
            resume,
            checkpoint,
            threads,
            record,
        } => {
            start_threads(threads)?;
            let options = Options {
                resume,
                checkpoints: Some(Duration::from_secs_f64(checkpoint)),
            };
            let stop = stop_on_signals()?;
            recorded(record.as_deref(), || {
                run_cases(&case, variant.as_deref(), out.as_deref(), options, &stop)
            })
        }
        Command::Point {
            driver,
            umat,
            variant,
            csv,
            record,
        } => {
            let stop = stop_on_signals()?;
            recorded(record.as_deref(), || {
                let (umat, variant) = (umat.as_deref(), variant.as_deref());
                run_point(&driver, umat, variant, csv.as_deref(), &stop)
            })
        }
        Command::Report { folders, out } => write_report(&folders, out),
        Command::TradeOff {
            input,
            variant,
            out,
            fine,
            max_increments,
            interface_stiffness,
        } => {
            let options = trade_off::Options {
                variant,
                out,
                fine,
                most_increments: max_increments,
                interface_stiffness,
                stop: stop_on_signals()?,
            };
            printing(|out| {
                let mut show = |text: &str| out.line(text);
                trade_off::run(&input, &options, &mut show, &mut |doing| {
                    say!("{doing}");
                })
            })
        }
        Command::Check(arguments) => {
            printing(|out| host::check::run(&arguments, &mut |text| out.text(text)))
        }
        Command::Laws { id, law_path, json } => show_laws(id.as_deref(), &law_path, json),
        Command::NewLaw(project) => print(&project.write()?),
        Command::Schema { file } => print_schema(file),
        Command::Completions { shell } => {
            let mut program = Arguments::command();
            let mut script = Vec::new();
            clap_complete::generate(shell, &mut program, "pilum", &mut script);
            print(&String::from_utf8_lossy(&script))
        }
        Command::Man => manual(&Arguments::command()),
        Command::Inspect { library, json } => {
            let inspection = host::inspect::inspect(&library)?;
            if json {
                print(&host::inspect::json(&inspection)?)
            } else {
                print(&format!("{inspection}\n"))
            }
        }
        Command::Lock { input } => {
            let lock = host::lock::write(&input)?;
            print(&format!("lock in {}\n", lock.display()))
        }
        Command::Replay {
            capsule, record, ..
        } => recorded(record.as_deref(), || {
            printing(|out| host::capsule::replay(&capsule, &mut |line| out.line(line)))
        }),
        #[cfg(unix)]
        Command::LawWorker => host::plugin::isolate::work(),
        #[cfg(not(unix))]
        Command::LawWorker => Err(Error::Usage("there are no workers here".to_owned())),
        Command::ProbeLibrary { library, sha256 } => {
            vetting::probe(&library, &sha256, &mut std::io::stdout().lock())
        }
    }
}

/// What a command says on the standard output.
#[derive(Debug, Default)]
struct Output {
    /// Why it can say no more.
    failure: Option<std::io::Error>,
}

impl Output {
    fn text(&mut self, text: &str) {
        if self.failure.is_none() {
            let mut out = supervision::stdout();
            let written = out.write_all(text.as_bytes()).and_then(|()| out.flush());
            self.failure = written.err();
        }
    }

    fn line(&mut self, text: &str) {
        self.text(&format!("{text}\n"));
    }

    /// How the command ends: what it came to matters more than what could not be said of it.
    /// Whoever reads a pipe may have read enough.
    fn end(self, outcome: Result<(), Error>) -> Result<(), Error> {
        let is_read = |why: &std::io::Error| why.kind() == std::io::ErrorKind::BrokenPipe;
        outcome.and(match self.failure.filter(|why| !is_read(why)) {
            None => Ok(()),
            Some(why) => Err(Error::Usage(format!(
                "cannot write to the standard output: {why}"
            ))),
        })
    }
}

/// Does what says something on the standard output.
fn printing(work: impl FnOnce(&mut Output) -> Result<(), Error>) -> Result<(), Error> {
    let mut out = Output::default();
    let done = work(&mut out);
    out.end(done)
}

fn print(text: &str) -> Result<(), Error> {
    printing(|out| {
        out.text(text);
        Ok(())
    })
}

/// Does something while one call of a UMAT is recorded, if a file for it is given, and says whether
/// it was.
fn recorded(file: Option<&Path>, action: impl FnOnce() -> Result<(), Error>) -> Result<(), Error> {
    let Some(file) = file else {
        return action();
    };
    let path = std::path::absolute(file).unwrap_or_else(|_| file.to_owned());
    let unwritable = |source| Error::Unwritable {
        path: path.clone(),
        source,
    };
    refuse_other(&path)?;
    // The record takes the place of an earlier one when there is one, not before.
    let mut partial = path.clone().into_os_string();
    partial.push(".part");
    let partial = PathBuf::from(partial);
    std::fs::File::create(&partial)
        .and_then(|_| std::fs::remove_file(&partial))
        .map_err(unwritable)?;
    adapter::record_to(partial.clone());
    let outcome = action();
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
    if adapter::is_recorded_to().is_none() {
        return Ok(());
    }
    let [case] = cases else {
        let message = "--record is for one run: name one with --variant";
        return Err(Error::Usage(message.to_owned()));
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
    Err(Error::Usage(message))
}

/// Who asks the work to stop: the process that watches this one; where none does, Ctrl-C and its
/// like, and a second one ends the program at once.
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
        error => Error::Internal(error.to_string()),
    })?;
    Ok(stop)
}

/// Starts the threads that a run works with; as many as there are processors, if it is not said.
fn start_threads(n: Option<u16>) -> Result<(), Error> {
    let threads = rayon::ThreadPoolBuilder::new().num_threads(n.map_or(0, usize::from));
    threads
        .build_global()
        .map_err(|why| cannot_start("the threads of the run", &why))
}

/// What starting a thread takes is memory, above all.
fn cannot_start(what: &str, why: &impl std::fmt::Display) -> Error {
    #[cfg(unix)]
    let message = host::memory::cannot_start(what, why);
    #[cfg(not(unix))]
    let message = format!("not enough memory to start {what}: {why}");
    Error::Usage(message)
}

/// A time in seconds.
fn not_negative(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| "expected a number of seconds")?;
    if (0.0..=1e6).contains(&value) {
        Ok(value)
    } else {
        Err("expected 0 to 1e6 seconds".to_owned())
    }
}

/// A time limit in seconds.
fn seconds(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| "expected a number of seconds")?;
    if value > 0.0 && value <= 1e6 {
        Ok(value)
    } else {
        Err("expected more than 0 and at most 1e6 seconds".to_owned())
    }
}

/// Runs a case, or all variants of one, and writes the report of each, and their comparison. A
/// variant that fails does not stop the others; the last failure is the outcome.
fn run_cases(
    path: &Path,
    variant: Option<&str>,
    out: Option<&Path>,
    options: Options,
    stop: &Stop,
) -> Result<(), Error> {
    let mut cases = Case::load(path)?;
    if let Some(wanted) = variant {
        let names: Vec<String> = cases
            .iter()
            .filter_map(|case| case.variant.clone())
            .collect();
        cases.retain(|case| case.variant.as_deref() == Some(wanted));
        if cases.is_empty() {
            let known = suggestion(wanted, names.iter().map(String::as_str).collect::<Vec<_>>());
            return Err(Error::Usage(format!(
                "there is no variant `{wanted}`: {known}"
            )));
        }
    }
    check_recording(&cases)?;
    // All variants are checked before the first one runs.
    if cases.len() > 1 {
        cases.iter().try_for_each(check)?;
    }
    let together = match (out, cases.first()) {
        (Some(out), _) => out.to_owned(),
        (None, case) => Path::new("results").join(case.map(Case::name).unwrap_or_default()),
    };
    if let [case, _, ..] = cases.as_slice() {
        remove_comparison(&together, case)?;
    }
    let mut outcome = Ok(());
    let mut reports = Ok(());
    let mut drawn = Vec::new();
    let mut folders = Vec::new();
    // Variants on one mesh share the factors of its linear part.
    let mut reuse = Reuse::default();
    for (number, case) in (1..).zip(&cases) {
        reuse.is_last_run = number == cases.len();
        let folder = match (out, &case.variant) {
            (None, _) => case.default_folder(),
            (Some(out), Some(name)) if variant.is_none() => out.join(name),
            (Some(out), _) => out.to_owned(),
        };
        if let Some(name) = &case.variant {
            say!("variant {name}");
        }
        let mut progress = Progress::new(number, &folder, stop);
        let options = Options {
            resume: options.resume || supervision::was_begun(number),
            ..options
        };
        let run = run_accurately(case, &folder, &mut progress, &mut reuse, options);
        progress.finish();
        supervision::end_run();
        let has_results = progress.has_begun;
        match run {
            Ok(figures) => {
                let _ = writeln!(supervision::stdout(), "results in {}", folder.display());
                drawn.extend(case.variant.clone().map(|variant| (variant, figures)));
            }
            Err(error) => keep_last(&mut outcome, error),
        }
        let is_stopped = outcome.as_ref().is_err_and(Error::is_stop);
        if has_results {
            if let Err(error) = write_report(std::slice::from_ref(&folder), None) {
                keep_last(&mut reports, error);
            }
            folders.push(folder);
        }
        if is_stopped {
            break;
        }
    }
    if drawn.len() > 1
        && let Err(error) = Figures::draw_overlaid(&together, &drawn)
    {
        keep_last(&mut reports, error);
    }
    if folders.len() > 1
        && let Err(error) = write_report(&folders, Some(together))
    {
        keep_last(&mut reports, error);
    }
    match (outcome, reports) {
        // What became of the run matters more than what became of its report.
        (Err(run), Err(report)) => {
            say!("{:?}", miette::Report::new(report));
            Err(run)
        }
        (outcome, reports) => outcome.and(reports),
    }
}

/// Runs a case; where it asks for an accuracy, with settings that reach it.
fn run_accurately(
    case: &Case,
    folder: &Path,
    progress: &mut Progress,
    reuse: &mut Reuse,
    options: Options,
) -> Result<Figures, Error> {
    let studied =
        trade_off::reach_until(case, folder, &progress.stop, &mut |doing| say!("{doing}"))?;
    let case = studied.as_ref().unwrap_or(case);
    if let Some(chosen) = &case.file.chosen {
        let increments: Vec<String> = chosen
            .increments
            .iter()
            .map(|(phase, n)| format!("{phase} {n}"))
            .collect();
        let settings = format!(
            "error {:.1e} estimated, {:.1e} asked for; increments {}, force tolerance {:e} {}",
            chosen.reached,
            chosen.asked,
            increments.join(", "),
            chosen.force_tolerance,
            chosen.parameters.join(" ")
        );
        if chosen.is_reached {
            progress.say(&format!("accuracy: {}", settings.trim_end()));
        } else {
            progress.warning(&format!(
                "the accuracy is not reached: {}",
                settings.trim_end()
            ));
        }
    }
    run_reusing(case, folder, progress, reuse, options)
}

/// Keeps the last failure for the caller to report, and reports the one before it.
fn keep_last(outcome: &mut Result<(), Error>, error: Error) {
    if let Err(earlier) = std::mem::replace(outcome, Err(error)) {
        say!("{:?}", miette::Report::new(earlier));
    }
}

/// Tables go to standard output or files, what came out of each driver to the error stream.
fn run_point(
    driver: &Path,
    umat: Option<&Path>,
    variant: Option<&str>,
    csv: Option<&Path>,
    stop: &Stop,
) -> Result<(), Error> {
    let report = |report: &host::point::PointReport| say!("{report}");
    match umat {
        Some(umat) => host::point::run_incremental(driver, umat, csv, stop, report),
        None if driver.extension().is_some_and(|ending| ending == "inp") => {
            Err(Error::Usage(format!(
                "{} is no driver file; `--umat LIBRARY` reads input of the IncrementalDriver",
                driver.display()
            )))
        }
        None => host::point::run_file_until(driver, variant, csv, stop, report),
    }
}

fn write_report(folders: &[PathBuf], out: Option<PathBuf>) -> Result<(), Error> {
    let out = out.unwrap_or_else(|| host::report::default_path(folders));
    let written = host::report::write(folders, &out)?;
    let _ = writeln!(supervision::stdout(), "report in {}", written.display());
    Ok(())
}

fn show_laws(id: Option<&str>, folders: &[PathBuf], json: bool) -> Result<(), Error> {
    if let Some(missing) = folders.iter().find(|folder| !folder.is_dir()) {
        let message = format!("--law-path: there is no folder {}", missing.display());
        return Err(Error::Usage(message));
    }
    let search = SearchPath::new(folders);
    let text = match (id, json) {
        (None, false) => host::laws::list(&search),
        (None, true) => host::laws::list_json(&search)?,
        (Some(id), false) => host::laws::page(&search.law(id)?),
        (Some(id), true) => host::laws::page_json(&search.law(id)?)?,
    };
    print(&text)
}

fn print_schema(file: FileKind) -> Result<(), Error> {
    let text = serde_json::to_string_pretty(&schema::of(file))
        .map_err(|error| Error::Internal(error.to_string()))?;
    print(&format!("{text}\n"))
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
    written.map_err(|error| Error::Internal(error.to_string()))?;
    print(&String::from_utf8_lossy(&page))
}

/// A bar on a terminal, plain lines elsewhere; both on the error stream.
struct Progress {
    /// Number of the case, from 1, and where its results go.
    place: (usize, PathBuf),
    stop: Stop,
    bar: Option<ProgressBar>,
    cut_backs: usize,
    /// A phase has begun, so there is a folder with results.
    has_begun: bool,
}

impl Progress {
    fn new(number: usize, folder: &Path, stop: &Stop) -> Self {
        Self {
            place: (number, folder.to_owned()),
            stop: stop.clone(),
            bar: None,
            cut_backs: 0,
            has_begun: false,
        }
    }

    fn say(&self, line: &str) {
        match &self.bar {
            Some(bar) => bar.println(line),
            None => say!("{line}"),
        }
    }

    fn finish(&mut self) {
        if let Some(bar) = self.bar.take() {
            bar.finish();
        }
    }
}

impl Observer for Progress {
    fn phase(&mut self, name: &str, increments: usize) {
        self.finish();
        self.cut_backs = 0;
        self.has_begun = true;
        supervision::case_begun(self.place.0, &self.place.1);
        if std::io::stderr().is_terminal() {
            let bar = ProgressBar::new(increments as u64);
            let template = "{prefix:16} {bar:32} {pos}/{len}  {msg}  {eta} left";
            if let Ok(style) = ProgressStyle::with_template(template) {
                bar.set_style(style);
            }
            bar.set_prefix(name.to_owned());
            bar.tick();
            self.bar = Some(bar);
        } else {
            say!("phase {name}: {increments} increments");
        }
    }

    fn increment(&mut self, place: &Place, of: usize, iterations: usize) {
        match &self.bar {
            Some(bar) => {
                bar.set_position(place.increment as u64);
                bar.set_message(format!(
                    "{iterations} iterations, {} cut-backs",
                    self.cut_backs
                ));
            }
            None => say!(
                "phase {}: increment {}/{of}, {iterations} iterations",
                place.phase,
                place.increment
            ),
        }
    }

    fn cut_back(&mut self, place: &Place, reason: &str) {
        self.cut_backs += 1;
        if self.cut_backs <= 10 {
            self.say(&format!("{place}: step cut back: {reason}"));
        } else if self.cut_backs == 11 {
            self.say("further cut-backs are only in log.jsonl");
        }
    }

    fn warning(&mut self, message: &str) {
        self.say(&format!("warning: {message}"));
    }

    fn resumed(&mut self, from: Option<&Place>) {
        self.has_begun = true;
        match from {
            Some(place) => self.say(&format!("resumed after {place}")),
            None => self.say("done already"),
        }
    }

    fn stop(&self) -> Stop {
        self.stop.clone()
    }
}
