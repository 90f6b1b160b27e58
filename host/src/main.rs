//! The `pilum` program: arguments to library calls, and their outcome to messages and exit codes.
#![expect(
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "this is where the program prints"
)]

use clap::{Parser, Subcommand};
use host::case::Case;
use host::error::{Error, Place, suggestion};
use host::output::{Figures, remove_comparison};
use host::plugin::SearchPath;
use host::run::{Observer, check, run_reusing};
use host::solver::Reuse;
use host::trade_off;
use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Finite elements for soil-structure interfaces, with constitutive laws as plugins.
#[derive(Parser)]
#[command(name = "pilum", version, max_term_width = 100)]
struct Arguments {
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
        /// Threads; the results do not depend on it [default: all processors].
        #[arg(long, value_parser = clap::value_parser!(u16).range(1..))]
        threads: Option<u16>,
    },
    /// Lead one law at one integration point along a path.
    Point {
        /// A driver file.
        driver: PathBuf,
        /// Run only this variant of it.
        #[arg(long)]
        variant: Option<String>,
        /// File for the table; standard output if left out.
        #[arg(long)]
        csv: Option<PathBuf>,
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
    },
}

fn main() -> ExitCode {
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) => {
            // Help and version are no errors; everything else is bad input.
            let _ = error.print();
            return ExitCode::from(u8::from(error.use_stderr()));
        }
    };
    let run = || execute(arguments.command);
    // A panic has printed itself; it is a defect of the program, not of the input.
    let outcome =
        std::panic::catch_unwind(std::panic::AssertUnwindSafe(run)).unwrap_or_else(|_| {
            Err(Error::Internal(
                "the program panicked; please report it".to_owned(),
            ))
        });
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            let code = error.exit_code();
            eprintln!("{:?}", miette::Report::new(error));
            ExitCode::from(code)
        }
    }
}

fn execute(command: Command) -> Result<(), Error> {
    match command {
        Command::Run {
            case,
            variant,
            out,
            threads,
        } => {
            if let Some(n) = threads {
                rayon::ThreadPoolBuilder::new()
                    .num_threads(n.into())
                    .build_global()
                    .map_err(|error| Error::Internal(error.to_string()))?;
            }
            run_cases(&case, variant.as_deref(), out.as_deref())
        }
        Command::Point {
            driver,
            variant,
            csv,
        } => run_point(&driver, variant.as_deref(), csv.as_deref()),
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
            };
            trade_off::run(
                &input,
                &options,
                &mut |text| println!("{text}"),
                &mut |doing| eprintln!("{doing}"),
            )
        }
        Command::Check(arguments) => host::check::run(&arguments, &mut |text| print!("{text}")),
        Command::Laws { id } => show_laws(id.as_deref()),
    }
}

/// Runs a case, or all variants of one, and writes the report of each, and their comparison. A
/// variant that fails does not stop the others; the last failure is the outcome.
fn run_cases(path: &Path, variant: Option<&str>, out: Option<&Path>) -> Result<(), Error> {
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
    for case in &cases {
        let folder = match (out, &case.variant) {
            (None, _) => case.default_folder(),
            (Some(out), Some(name)) if variant.is_none() => out.join(name),
            (Some(out), _) => out.to_owned(),
        };
        if let Some(name) = &case.variant {
            eprintln!("variant {name}");
        }
        let mut progress = Progress::new();
        let run = run_accurately(case, &folder, &mut progress, &mut reuse);
        progress.finish();
        let has_results = progress.has_begun;
        match run {
            Ok(figures) => {
                println!("results in {}", folder.display());
                drawn.extend(case.variant.clone().map(|variant| (variant, figures)));
            }
            Err(error) => keep_last(&mut outcome, error),
        }
        if has_results {
            if let Err(error) = write_report(std::slice::from_ref(&folder), None) {
                keep_last(&mut reports, error);
            }
            folders.push(folder);
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
            eprintln!("{:?}", miette::Report::new(report));
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
) -> Result<Figures, Error> {
    let studied = trade_off::reach(case, folder)?;
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
    run_reusing(case, folder, progress, reuse)
}

/// Keeps the last failure for the caller to report, and reports the one before it.
fn keep_last(outcome: &mut Result<(), Error>, error: Error) {
    if let Err(earlier) = std::mem::replace(outcome, Err(error)) {
        eprintln!("{:?}", miette::Report::new(earlier));
    }
}

/// Tables go to standard output or files, what came out of each driver to the error stream.
fn run_point(driver: &Path, variant: Option<&str>, csv: Option<&Path>) -> Result<(), Error> {
    host::point::run_file_variants(driver, variant, csv, |report| eprintln!("{report}"))
}

fn write_report(folders: &[PathBuf], out: Option<PathBuf>) -> Result<(), Error> {
    let out = out.unwrap_or_else(|| host::report::default_path(folders));
    let written = host::report::write(folders, &out)?;
    println!("report in {}", written.display());
    Ok(())
}

fn show_laws(id: Option<&str>) -> Result<(), Error> {
    let search = SearchPath::new(&[]);
    match id {
        None => print!("{}", host::laws::list(&search)?),
        Some(id) => print!("{}", host::laws::page(&search.law(id)?)),
    }
    Ok(())
}

/// A bar on a terminal, plain lines elsewhere; both on the error stream.
struct Progress {
    bar: Option<ProgressBar>,
    cut_backs: usize,
    /// A phase has begun, so there is a folder with results.
    has_begun: bool,
}

impl Progress {
    fn new() -> Self {
        Self {
            bar: None,
            cut_backs: 0,
            has_begun: false,
        }
    }

    fn say(&self, line: &str) {
        match &self.bar {
            Some(bar) => bar.println(line),
            None => eprintln!("{line}"),
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
            eprintln!("phase {name}: {increments} increments");
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
            None => eprintln!(
                "phase {}: increment {}/{of}, {iterations} iterations",
                place.phase, place.increment
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
}
