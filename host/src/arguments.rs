//! The command line.

use clap::{Args, Parser, Subcommand, ValueEnum};
use law::trial;
use std::path::PathBuf;
use workshop::new_law::NewLaw;

/// Finite elements for soil-structure interfaces, with constitutive laws as plugins.
#[derive(Parser)]
#[command(name = "pilum", version, max_term_width = 100)]
pub(crate) struct Arguments {
    /// Open unknown libraries without a trial in a child process.
    #[arg(long, global = true)]
    pub(crate) no_probe: bool,
    /// Call laws in separate processes: a crash ends the increment and not the program. Seconds
    /// that a call may take, default 10.
    #[arg(
        long,
        global = true,
        value_name = "SECONDS",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "10",
        value_parser = seconds
    )]
    pub(crate) isolate: Option<f64>,
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Subcommand)]
pub(crate) enum Command {
    /// Run a case, or all variants of it.
    Run(Run),
    /// Lead one law at one integration point along a path.
    Point(Point),
    /// Carry out the runs of a study file, or go on with them.
    Study(Study),
    /// Write the report of a run or a study, or the comparison of several runs.
    Report {
        /// Results folders.
        #[arg(required = true)]
        folders: Vec<PathBuf>,
        /// The report's file [default: report.html in the folder, or next to the folders].
        #[arg(long)]
        out: Option<PathBuf>,
        /// For paper: A4 without controls, a title block, all settings as an appendix.
        #[arg(long)]
        print: bool,
    },
    /// Write a table of runs: settings that differ, last values of probes.
    Table {
        /// Results folders, or folders with results folders below.
        #[arg(required = true)]
        folders: Vec<PathBuf>,
        /// The table's file; standard output if left out.
        #[arg(long)]
        out: Option<PathBuf>,
    },
    /// Show what a mesh has before a case exists: elements, groups, lines, shapes, what is refused.
    Mesh(Mesh),
    /// Write a case as input of another program, run there; `pilum import` reads its results.
    Export(Export),
    /// Read the results of a program that a case was exported to, as a table like that of a run.
    Import {
        /// The folder of the export, where the program ran.
        folder: PathBuf,
        /// Folder for `history.csv` and `summary.json` [default: the same].
        #[arg(long)]
        out: Option<PathBuf>,
    },
    /// Measure error against CPU time for many settings of a case or driver.
    TradeOff(TradeOff),
    /// Find parameters of laws from measured curves, with intervals.
    Calibrate(Calibrate),
    /// Check whether a library keeps the contract.
    Check(workshop::check::Arguments),
    /// List the laws found, or show all about one of them.
    Laws {
        /// Id of a law, or the library of a UMAT with a sidecar.
        id: Option<String>,
        /// A folder with law libraries, looked in first; may be repeated.
        #[arg(long, value_name = "DIR")]
        law_path: Vec<PathBuf>,
        /// Instead: the folders that are searched for laws, in order, with their content.
        #[arg(long = "where", conflicts_with = "id")]
        places: bool,
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
    /// Write the libraries of a case or driver, with their SHA-256, to a lock file next to it.
    Lock {
        /// A case file, a folder with `case.toml`, or a driver file.
        input: PathBuf,
    },
    /// Repeat the failed call of a law, from the file in the results of a run.
    Replay {
        /// A `failure.toml`.
        capsule: PathBuf,
        /// Write the arguments of the call of a UMAT to this file, before and after it.
        #[arg(long, value_name = "FILE")]
        record: Option<PathBuf>,
        /// Call the law in this process, for a debugger.
        #[arg(long, conflicts_with = "isolate")]
        in_process: bool,
        /// Write to this file how far the replay has come.
        #[arg(long, hide = true, requires = "in_process")]
        reached: Option<PathBuf>,
    },
    /// Write a small project for a law that builds and runs.
    NewLaw(NewLaw),
    /// Write the sidecar of an Abaqus user subroutine: names of its parameters and internal
    /// variables, to be filled in.
    NewSidecar(workshop::new_sidecar::NewSidecar),
    /// Print the JSON Schema of an input file, for editors.
    Schema {
        /// Which file.
        file: File,
    },
    /// Print completions for a shell.
    Completions {
        /// Which shell.
        shell: clap_complete::Shell,
    },
    /// Print the manual page, or write those of all commands into a folder.
    Man {
        /// Write `pilum.1`, `pilum-run.1` and so on into this folder instead.
        #[arg(long, value_name = "FOLDER")]
        into: Option<PathBuf>,
    },
    /// Try a library: what a child process does.
    #[command(name = trial::COMMAND, hide = true)]
    ProbeLibrary { library: PathBuf, sha256: String },
    /// Call a law for another process.
    #[command(name = "law-worker", hide = true)]
    LawWorker,
}

/// Arguments of `pilum run`.
#[derive(Args)]
#[expect(clippy::struct_field_names, reason = "options of the command line")]
pub(crate) struct Run {
    /// A case file, or a folder with `case.toml`.
    pub(crate) case: PathBuf,
    /// Run only this variant of it.
    #[arg(long)]
    pub(crate) variant: Option<String>,
    /// Override a setting of the file and its variants: KEY is the dotted path, VALUE as in the
    /// file, such as `solver.max_iterations=40`; may be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    pub(crate) set: Vec<String>,
    /// Folder for the results [default: results/CASE or results/CASE/VARIANT].
    #[arg(long)]
    pub(crate) out: Option<PathBuf>,
    /// Check everything and compute nothing: `report.html` shows mesh, lines, supports, loads,
    /// water, initial stress and active groups. A folder with results of a run is refused.
    #[arg(long, conflicts_with_all = ["resume", "record", "checkpoint"])]
    pub(crate) dry_run: bool,
    /// Go on from where an earlier run into the folder was stopped, or start.
    #[arg(long)]
    pub(crate) resume: bool,
    /// Seconds between checkpoints for `--resume`, or 20 times what the last one took if
    /// longer; 0: after every increment.
    #[arg(long, value_name = "SECONDS", default_value_t = 1.0, value_parser = not_negative)]
    pub(crate) checkpoint: f64,
    /// Threads; the results do not depend on it [default: all processors, on a grid of 256 elements or less
    /// only after 0.1 s].
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) threads: Option<u16>,
    /// Write the arguments of one call of the UMAT to this file, before and after it.
    #[arg(long, value_name = "FILE")]
    pub(crate) record: Option<PathBuf>,
}

/// Arguments of `pilum point`.
#[derive(Args)]
pub(crate) struct Point {
    /// A driver file, or with `--umat` the `test.inp` of an IncrementalDriver.
    pub(crate) driver: PathBuf,
    /// Run input of the IncrementalDriver with this Abaqus user subroutine.
    #[arg(long, value_name = "LIBRARY", conflicts_with_all = ["variant", "set"])]
    pub(crate) umat: Option<PathBuf>,
    /// Run only this variant of it.
    #[arg(long)]
    pub(crate) variant: Option<String>,
    /// Override a setting of the file and its variants: KEY is the dotted path, VALUE as in the
    /// file, such as `solver.max_iterations=40`; may be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    pub(crate) set: Vec<String>,
    /// File for the table; standard output if left out.
    #[arg(long)]
    pub(crate) csv: Option<PathBuf>,
    /// Write the arguments of one call of the UMAT to this file, before and after it.
    #[arg(long, value_name = "FILE")]
    pub(crate) record: Option<PathBuf>,
}

/// Arguments of `pilum study`.
#[derive(Args)]
pub(crate) struct Study {
    /// A study file, or a folder with `study.toml`.
    pub(crate) file: PathBuf,
    /// Folder for the results [default: results/STUDY].
    #[arg(long)]
    pub(crate) out: Option<PathBuf>,
    /// Number of runs at a time, each in a separate process [default: one for each processor].
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) jobs: Option<u16>,
    /// Check everything, write the table of runs and carry out none.
    #[arg(long, conflicts_with = "run")]
    pub(crate) plan: bool,
    /// Carry out this run alone, unless it is done, for programs that distribute work.
    #[arg(long, value_name = "INDEX", conflicts_with_all = ["jobs", "retry"])]
    pub(crate) run: Option<usize>,
    /// Repeat runs that failed.
    #[arg(long)]
    pub(crate) retry: bool,
    /// Forget what was done before.
    #[arg(long)]
    pub(crate) anew: bool,
    /// Seconds between checkpoints for `--resume`, or 20 times what the last one took if
    /// longer; 0: after every increment.
    #[arg(long, value_name = "SECONDS", default_value_t = 1.0, value_parser = not_negative)]
    pub(crate) checkpoint: f64,
    /// Threads of each run; the results do not depend on it [default: 1].
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) threads: Option<u16>,
}

/// Arguments of `pilum mesh`.
#[derive(Args)]
pub(crate) struct Mesh {
    /// A mesh file of Gmsh; or a case file (`.toml`), or a folder with `case.toml`, for its mesh.
    pub(crate) file: PathBuf,
    /// Show only the mesh of this variant of the case.
    #[arg(long)]
    pub(crate) variant: Option<String>,
    /// Draw the mesh into this file, as SVG.
    #[arg(long, value_name = "FILE")]
    pub(crate) draw: Option<PathBuf>,
}

/// Arguments of `pilum export`.
#[derive(Args)]
pub(crate) struct Export {
    /// A case file, or a folder with `case.toml`.
    pub(crate) case: PathBuf,
    /// The program.
    #[arg(long)]
    pub(crate) to: exchange::Program,
    /// The variant, if the case has several.
    #[arg(long)]
    pub(crate) variant: Option<String>,
    /// Override a setting of the file and its variants: KEY is the dotted path, VALUE as in the
    /// file, such as `solver.max_iterations=40`; may be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    pub(crate) set: Vec<String>,
    /// Folder for the files [default: `results/CASE_PROGRAM`].
    #[arg(long)]
    pub(crate) out: Option<PathBuf>,
}

/// Arguments of `pilum trade-off`.
#[derive(Args)]
#[expect(
    clippy::struct_excessive_bools,
    reason = "switches of the command line"
)]
pub(crate) struct TradeOff {
    /// A case file, a folder with `case.toml`, or a driver file.
    pub(crate) input: PathBuf,
    /// Study only this variant of it.
    #[arg(long)]
    pub(crate) variant: Option<String>,
    /// Override a setting of the file and its variants: KEY is the dotted path, VALUE as in the
    /// file, such as `solver.max_iterations=40`; may be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    pub(crate) set: Vec<String>,
    /// Folder for the results [default: `results/trade_off_NAME`].
    #[arg(long)]
    pub(crate) out: Option<PathBuf>,
    /// Divide the mesh of a case by 4 too, not only by 2.
    #[arg(long)]
    pub(crate) fine: bool,
    /// Try all settings of a case, however long one run takes.
    #[arg(long)]
    pub(crate) thorough: bool,
    /// Go on with the study of a case that was stopped.
    #[arg(long)]
    pub(crate) resume: bool,
    /// Most increments per segment of a driver.
    #[arg(long, default_value_t = 1000)]
    pub(crate) max_increments: usize,
    /// Instead: find the stiffness that interfaces without thickness should have.
    #[arg(long)]
    pub(crate) interface_stiffness: bool,
}

/// Arguments of `pilum calibrate`.
#[derive(Args)]
pub(crate) struct Calibrate {
    /// A calibration file.
    pub(crate) file: PathBuf,
    /// Carry out only this variant of it.
    #[arg(long)]
    pub(crate) variant: Option<String>,
    /// Override a setting of the file and its variants: KEY is the dotted path, VALUE as in the
    /// file, such as `starts=20`; may be repeated.
    #[arg(long, value_name = "KEY=VALUE")]
    pub(crate) set: Vec<String>,
    /// Folder for the results [default: `results/calibrate_NAME`].
    #[arg(long)]
    pub(crate) out: Option<PathBuf>,
    /// Forget what an earlier, ended call has computed.
    #[arg(long)]
    pub(crate) anew: bool,
    /// Threads of the runs of cases; the results do not depend on it [default: all processors].
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) threads: Option<u16>,
}

impl Command {
    /// Whether it calls laws in its own process, which they may end; and whether that may be done
    /// once more with laws in separate processes.
    pub(crate) fn calls_laws(&self) -> Option<bool> {
        match self {
            // What came through a pipe comes only once.
            Self::Run(Run { case, .. }) => Some(case.is_file() || case.is_dir()),
            Self::Point(Point { driver, csv, .. }) => {
                let is_pipe = |csv: &PathBuf| csv.exists() && !csv.is_file();
                Some(driver.is_file() && !csv.as_ref().is_some_and(is_pipe))
            }
            // One run goes on from its checkpoint.
            Self::Study(Study { run, .. }) => Some(run.is_some()),
            Self::TradeOff(_)
            | Self::Calibrate(_)
            | Self::Export(_)
            | Self::Laws { .. }
            | Self::Lock { .. } => Some(false),
            _ => None,
        }
    }

    /// A replay outlives a law that crashes again.
    pub(crate) fn isolates_anyway(&self) -> Option<f64> {
        let replays = matches!(self, Self::Replay { in_process, .. } if !in_process);
        (replays && cfg!(unix)).then_some(10.0)
    }
}

/// Kind of file of a schema.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum File {
    /// Case files, for `pilum run`.
    Case,
    /// Driver files, for `pilum point`.
    Point,
    /// Study files, for `pilum study`.
    Study,
    /// Calibrations, for `pilum calibrate`.
    Calibration,
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
