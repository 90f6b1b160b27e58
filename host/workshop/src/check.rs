//! `pilum check`: does a library keep the contract?
//!
//! Every check runs in a [`child`] process, so that a library may crash, hang or end the
//! process and be reported like any other fault. Checks are named, and a check is skipped when one
//! that it builds on has not passed, so that a fault is reported by the check that names it.

mod author_path;
mod contract;
mod coverage;
mod crashed;
mod description;
mod inputs;
mod load;
mod loading_path;
mod location;
mod margins;
mod mathematics;
mod memory;
mod purity;
mod random;
pub(crate) mod recheck;
mod report;
mod response;
mod robustness;
mod routine;
pub(crate) mod specimen;

use crate::Error;
use abi::raw;
use law::adapter::{Adapter, Foreign};
use law::capsule::Capsule;
use law::child::{self, Ending, Work};
use law::probe::NO_OUTCOME;
use law::probe::call_log::{self, KeptPhase, Phase};
use law::{LoadedLaw, Opener, SearchPath, Trust, hexadecimal_sha256};
use rayon::prelude::*;
use report::{Finding, Outcome, Report, finding, json, list, text};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::time::Duration;
use text::InputError;
use text::file;
use text::suggestion;
use text::write::replace;

/// Arguments of `pilum check`.
#[derive(Clone, Debug, clap::Args)]
#[expect(
    clippy::struct_excessive_bools,
    reason = "switches of the command line"
)]
pub struct Arguments {
    /// A library of the contract, a UMAT with its sidecar, with `--driver` a UDSM or MFront
    /// behaviours, or the id of a law as of `pilum laws`.
    #[arg(required_unless_present = "list")]
    library: Option<String>,
    /// Write JSON.
    #[arg(long)]
    json: bool,
    /// Run only this check, without those it depends on; may be repeated.
    #[arg(long, value_name = "ID")]
    only: Vec<String>,
    /// Seed of all random numbers.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Fix a parameter of the laws, where random ones are refused; may be repeated.
    #[arg(long, value_name = "ID=VALUE", value_parser = setting)]
    set: Vec<(String, f64)>,
    /// Use the path, parameters and sidecar of this driver file instead of random ones.
    #[arg(long, value_name = "FILE", conflicts_with = "set")]
    driver: Option<PathBuf>,
    /// Folder for the calls of failures and warnings, for `pilum replay`; default:
    /// `results/check/<library>`.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print only failures, crashes and warnings.
    #[arg(long)]
    only_failed: bool,
    /// Exit code 3 for warnings, too.
    #[arg(long)]
    strict: bool,
    /// Seconds after which a check is ended.
    #[arg(long, default_value_t = 60.0, value_parser = positive)]
    time_limit: f64,
    /// List the checks.
    #[arg(long)]
    list: bool,
    /// Run the checks in this process, one by one, for a debugger: a crash ends the program, and
    /// there are no limits of time and memory.
    #[arg(long)]
    in_process: bool,
    /// Run the one check as a child; its answer is the last line, or next to the file of its calls.
    #[arg(long, hide = true, requires = "only", conflicts_with = "in_process")]
    child: bool,
    /// Lead a routine a short way only.
    #[arg(long, hide = true, requires = "child")]
    near: bool,
    /// Lead the law along the increment of this capsule alone, with its parameters.
    #[arg(long, hide = true, requires = "child", conflicts_with_all = ["set", "driver"])]
    at: Option<PathBuf>,
    /// Write every call of the child to this file before it is made.
    #[arg(long, hide = true, requires = "child")]
    kept: Option<PathBuf>,
    /// Make the call in this file a capsule next to it.
    #[arg(long, hide = true, requires = "child", conflicts_with = "kept")]
    tell: Option<PathBuf>,
}

fn setting(text: &str) -> Result<(String, f64), String> {
    let (id, value) = text.split_once('=').ok_or("expected ID=VALUE")?;
    let value = value
        .trim()
        .parse()
        .map_err(|_| format!("`{value}` is no number"))?;
    Ok((id.trim().to_owned(), value))
}

fn positive(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| "expected a number".to_owned())?;
    if value > 0.0 && value <= 1e6 {
        Ok(value)
    } else {
        Err("expected seconds".to_owned())
    }
}

/// Subject of a check.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
enum Family {
    Load,
    Description,
    Contract,
    Memory,
    Purity,
    Mathematics,
    Robustness,
    Routine,
}

/// A check: its name and meaning are public and never change.
struct Check {
    id: &'static str,
    family: Family,
    description: &'static str,
    /// Checks without which this one says nothing.
    needs: &'static [&'static str],
    run: fn(&Subject) -> Found,
}

/// All checks, those that others build on first.
fn checks() -> impl Iterator<Item = &'static Check> {
    [
        load::CHECKS,
        description::CHECKS,
        contract::CHECKS,
        memory::CHECKS,
        purity::CHECKS,
        robustness::CHECKS,
        mathematics::CHECKS,
        response::CHECKS,
        inputs::CHECKS,
        coverage::CHECKS,
        routine::CHECKS,
    ]
    .into_iter()
    .flatten()
}

/// Finding of a check that has not passed.
#[derive(Clone, Debug)]
enum Verdict {
    Skipped(String),
    Warning(String),
    Failed(String),
    /// One of the above, with the call that it is about.
    At(Box<Self>, Box<Capsule>),
}

impl Verdict {
    /// What it says.
    fn words(&self) -> &str {
        match self {
            Self::Skipped(why) | Self::Warning(why) | Self::Failed(why) => why,
            Self::At(inner, _) => inner.words(),
        }
    }

    /// Whether it is a fault, and no warning.
    fn is_failure(&self) -> bool {
        match self {
            Self::Skipped(_) | Self::Warning(_) => false,
            Self::Failed(_) => true,
            Self::At(inner, _) => inner.is_failure(),
        }
    }

    /// The same with words before it.
    fn led_by(self, before: &str) -> Self {
        match self {
            Self::Skipped(why) => Self::Skipped(format!("{before}{why}")),
            Self::Warning(why) => Self::Warning(format!("{before}{why}")),
            Self::Failed(why) => Self::Failed(format!("{before}{why}")),
            Self::At(inner, capsule) => Self::At(Box::new(inner.led_by(before)), capsule),
        }
    }

    /// A warning where it was a failure.
    fn milder(self) -> Self {
        match self {
            Self::Failed(why) => Self::Warning(why),
            Self::At(inner, capsule) => Self::At(Box::new(inner.milder()), capsule),
            other => other,
        }
    }
}

/// Details of what was tried, or what is wrong.
type Found = Result<String, Verdict>;

fn failed(why: impl Into<String>) -> Verdict {
    Verdict::Failed(why.into())
}

fn skipped(why: impl Into<String>) -> Verdict {
    Verdict::Skipped(why.into())
}

/// A status as the header calls it, with its number.
fn status_name(status: raw::Status) -> String {
    let name = match status {
        NO_OUTCOME => return "no outcome".to_owned(),
        raw::PILUM_OK => "PILUM_OK",
        raw::PILUM_OK_UNRELIABLE => "PILUM_OK_UNRELIABLE",
        raw::PILUM_CUT_STEP => "PILUM_CUT_STEP",
        raw::PILUM_E_ARGUMENT => "PILUM_E_ARGUMENT",
        raw::PILUM_E_PARAMETER => "PILUM_E_PARAMETER",
        raw::PILUM_E_UNSUPPORTED => "PILUM_E_UNSUPPORTED",
        raw::PILUM_E_DOMAIN => "PILUM_E_DOMAIN",
        raw::PILUM_E_NUMERIC => "PILUM_E_NUMERIC",
        raw::PILUM_E_INTERNAL => "PILUM_E_INTERNAL",
        _ => {
            return format!(
                "the unknown status {status} (the contract has {} to {})",
                raw::PILUM_E_INTERNAL,
                raw::PILUM_CUT_STEP
            );
        }
    };
    format!("{name} ({status})")
}

/// A failure in words: its status, and what the law says of it.
pub(crate) fn refusal(status: raw::Status, message: Option<&str>) -> String {
    let name = status_name(status);
    match message {
        Some(message) if !message.is_empty() => format!("{name}: {message}"),
        _ => format!("{name}, without a message"),
    }
}

impl From<std::io::Error> for Verdict {
    fn from(why: std::io::Error) -> Self {
        skipped(format!("the check cannot be set up: {why}"))
    }
}

/// Subject of the checks.
#[derive(Debug)]
struct Subject {
    path: PathBuf,
    seed: u64,
    settings: Vec<(String, f64)>,
    opener: Opener,
    /// The author's own path.
    driver: Option<PathBuf>,
    /// A routine is led a short way only.
    near: bool,
    /// The capsule whose increment is all that is looked at.
    at: Option<Box<Capsule>>,
}

impl Subject {
    fn new(arguments: &Arguments, opener: &Opener, path: &Path) -> Self {
        // One that can no longer be read was not asked for: the parent has read it.
        let at = arguments.at.as_ref().and_then(|at| Capsule::read(at).ok());
        Self {
            at: at.map(Box::new),
            path: path.to_owned(),
            seed: arguments.seed,
            settings: arguments.set.clone(),
            opener: opener.clone(),
            driver: arguments.driver.clone(),
            near: arguments.near,
        }
    }

    fn bytes(&self) -> Result<Vec<u8>, Verdict> {
        file::read_library(&self.path).map_err(|why| failed(format!("it cannot be read: {why}")))
    }

    /// The library as a file would name it, called in this process if it has no contract; a check
    /// has a separate process.
    fn foreign(&self) -> Option<Foreign> {
        if let Some(capsule) = &self.at {
            return capsule.law.foreign();
        }
        let adapter = routine::adapter(&self.path)?;
        let of_driver = self
            .driver
            .as_ref()
            .and_then(|driver| author_path::foreign(&self.opener, driver));
        Some(Foreign {
            in_process: true,
            record: None,
            ..of_driver.unwrap_or_else(|| Foreign {
                adapter,
                ..Foreign::umat(&self.path)
            })
        })
    }

    /// The laws of the library.
    fn laws(&self) -> Result<Vec<LoadedLaw>, Verdict> {
        let library = match self.foreign() {
            Some(foreign) => self.opener.open_foreign(&foreign, |_| Ok(())),
            None => self.opener.open(&self.path),
        };
        let library = library.map_err(|why| failed(with_place(&why)))?;
        let ids = library.laws().map(|law| law.id.as_str());
        Ok(ids.filter_map(|id| library.law(id)).collect())
    }
}

/// Why a library or its sidecar cannot be used, on one line: with file and line, where there is one, and what the
/// user could do.
fn with_place(why: &law::Error) -> String {
    let place = match why {
        law::Error::Text(error) => error.place().map(InputError::line),
        _ => None,
    };
    let mut words = match place {
        Some(line) => format!("{}:{}: {why}", line.file, line.at.0),
        None => why.to_string(),
    };
    if let Some(help) = why.help() {
        words.push_str("; ");
        words.push_str(help);
    }
    words
}

/// Checks a library and prints what it found.
///
/// # Errors
/// [`text::Error::Usage`] for an unknown check or settings that no law can have, [`text::Error::Unreadable`],
/// [`law::Error::Library`] if there is no such law or a check fails or crashes.
pub fn run(
    arguments: &Arguments,
    opener: &Opener,
    print: &mut dyn FnMut(&str),
) -> Result<(), Error> {
    let ids: Vec<&str> = checks().map(|check| check.id).collect();
    for id in &arguments.only {
        let is_inner = arguments.child && INNER.iter().any(|check| id == check.id);
        if !is_inner && !ids.contains(&id.as_str()) {
            let known = suggestion(id, ids.iter().copied());
            return Err(Error::usage(format!("there is no check `{id}`: {known}")));
        }
    }
    if arguments.list {
        print(&list(arguments.json)?);
        return Ok(());
    }
    let path = library_path(arguments.library.as_deref().unwrap_or_default())?;
    if arguments.child {
        let started = std::process::id();
        let internal = |error: std::io::Error| Error::internal(error.to_string());
        child::enter().map_err(internal)?;
        if let Some(kept) = &arguments.kept {
            call_log::keep_in(std::fs::File::create(kept).map_err(internal)?);
        }
        if let Some(kept) = &arguments.tell {
            return crashed::tell(&Subject::new(arguments, opener, &path), kept);
        }
        let answer = answer(arguments, opener, &path)?;
        // A law that forks would have two processes answer.
        if std::process::id() == started {
            let answer = serde_json::to_string(&answer);
            let answer = answer.map_err(|error| Error::internal(error.to_string()))?;
            match &arguments.kept {
                // However much the law has printed.
                Some(kept) => replace(&kept.with_extension(ANSWERED), answer)?,
                None => print(&format!("\n{ANSWER}{answer}\n")),
            }
            // What is left is the end of the process.
            call_log::keep_phase(KeptPhase::new(Phase::Exit, false)).map_err(internal)?;
        }
        return Ok(());
    }
    // What cannot be read needs no checks, and what it was is what is reported.
    let bytes = file::read_library(&path).map_err(|source| text::Error::Unreadable {
        path: path.clone(),
        source,
    })?;
    let sha256 = hexadecimal_sha256(&bytes);
    drop(bytes);
    let is_routine = routine::is_one(&path);
    if let Some(id) = arguments.only.iter().find(|id| !applies(id, is_routine)) {
        let whose = if is_routine {
            "libraries of the contract"
        } else {
            "UMATs, UDSMs and MFront behaviours"
        };
        return Err(Error::usage(format!(
            "--only {id}: this check is for {whose}"
        )));
    }
    let arguments = &with_absolute_driver(arguments)?;
    if is_routine {
        routine::refuse_without_driver(&path, arguments.driver.is_some())?;
        routine::refuse_settings(&arguments.set, &path)?;
    } else if !arguments.set.is_empty() {
        refuse_settings(arguments, &path)?;
    }
    if let Some(driver) = &arguments.driver {
        refuse_driver(arguments, opener, driver, &path)?;
    }
    let mut findings = if arguments.in_process {
        run_here(arguments, &path, is_routine)?
    } else {
        run_all(arguments, &path, is_routine)?
    };
    report::tell_once(&mut findings);
    let mut counts = BTreeMap::new();
    for finding in &findings {
        *counts.entry(finding.outcome.name()).or_insert(0) += 1;
    }
    if arguments.only_failed {
        findings.retain(|finding| finding.outcome.is_bad() || finding.outcome == Outcome::Warning);
    }
    let report = Report {
        library: path.display().to_string(),
        sha256,
        seed: arguments.seed,
        checks: &findings,
        counts,
    };
    if arguments.json {
        print(&format!("{}\n", json(&report)?));
    } else {
        print(&text(&report));
    }
    judged(arguments, &path, &findings)
}

/// What the findings say of the library in the end.
///
/// # Errors
/// [`law::Error::Library`] if a check fails or crashes, or warns where that counts.
fn judged(arguments: &Arguments, path: &Path, findings: &[Finding]) -> Result<(), Error> {
    let with = |is_meant: fn(Outcome) -> bool| -> Vec<&str> {
        let those = findings.iter().filter(|finding| is_meant(finding.outcome));
        those.map(|finding| finding.id).collect()
    };
    let mut named = with(Outcome::is_bad);
    let what = if named.is_empty() {
        named = with(|outcome| outcome == Outcome::Warning);
        if named.is_empty() || !arguments.strict {
            return Ok(());
        }
        "is warned of, and `--strict` asks for no warnings"
    } else {
        match routine::adapter(path) {
            None => "does not keep the contract",
            // Without a sidecar nothing was held against one.
            Some(Adapter::Umat) if named.contains(&"sidecar-is-read") => "cannot be checked",
            Some(Adapter::Umat) => "is not what its sidecar says",
            Some(_) => "is not what it says of itself",
        }
    };
    Err(Error::library(format!(
        "library {} {what}: {}",
        path.display(),
        named.join(", ")
    )))
}

/// Children work in their own folders.
fn with_absolute_driver(arguments: &Arguments) -> Result<Arguments, Error> {
    let mut own = arguments.clone();
    if let Some(driver) = &arguments.driver {
        let unreadable = |source| text::Error::Unreadable {
            path: driver.clone(),
            source,
        };
        let whole = std::path::absolute(driver).map_err(unreadable)?;
        file::read_text(&whole).map_err(unreadable)?;
        own.driver = Some(whole);
    }
    Ok(own)
}

/// The library's file: a path unchanged, a law's id where `pilum laws` finds it. Nothing is opened.
fn library_path(name: &str) -> Result<PathBuf, Error> {
    let path = Path::new(name);
    let looks_like_a_path = path.components().count() > 1 || name.ends_with(DLL_SUFFIX);
    if looks_like_a_path || path.is_file() {
        return std::path::absolute(path)
            .and_then(|path| std::fs::metadata(&path).map(|_| path))
            .map_err(|source| {
                let path = path.to_owned();
                text::Error::Unreadable { path, source }.into()
            });
    }
    let search = SearchPath::new(&[]);
    let installed = search.installed();
    let file = format!("{DLL_PREFIX}{name}{DLL_SUFFIX}");
    let mut named = search.places().iter().map(|place| place.folder.join(&file));
    named
        .find(|path| path.is_file())
        .or_else(|| installed.get(name).cloned())
        .ok_or_else(|| {
            let known = installed.keys().map(String::as_str);
            let error = law::Error::Library {
                message: format!("there is no library or law `{name}`"),
                hint: Some(suggestion(name, known.collect::<Vec<_>>())),
            };
            error.into()
        })
}

/// Requirement on `--set` before the checks: not a check of the library.
static SETTINGS: Check = Check {
    id: "settings-fit",
    family: Family::Description,
    description: "`--set` names parameters, and values that the laws accept.",
    needs: &[],
    run: specimen::settings_fit,
};

/// Requirement on `--driver` before the checks.
static DRIVER: Check = Check {
    id: "driver-fits",
    family: Family::Description,
    description: "The driver can be read, and leads a law of the library.",
    needs: &[],
    run: author_path::driver_fits,
};

/// Checks of what is asked for, none of the library.
static INNER: [&Check; 2] = [&SETTINGS, &DRIVER];

/// Refuses a driver that cannot be read or leads another law. Whether its library can be opened is
/// tried in a child first; it is left to the checks if not.
fn refuse_driver(
    arguments: &Arguments,
    opener: &Opener,
    driver: &Path,
    path: &Path,
) -> Result<(), Error> {
    let finding = in_child(&DRIVER, arguments, path, &ScratchFolder::new()?)?;
    match finding.outcome {
        // Once more here, with the place in the file.
        Outcome::Warning => author_path::read(opener, driver).map(drop),
        Outcome::Failed => Err(Error::usage(finding.details)),
        _ => Ok(()),
    }
}

/// Refuses settings that do not fit the laws. A library that cannot answer is left to the checks.
fn refuse_settings(arguments: &Arguments, path: &Path) -> Result<(), Error> {
    let finding = in_child(&SETTINGS, arguments, path, &ScratchFolder::new()?)?;
    match finding.outcome {
        Outcome::Failed => Err(Error::usage(finding.details)),
        _ => Ok(()),
    }
}

/// Whether a check is for such a library: a UMAT with a sidecar, or one of the contract.
fn applies(id: &str, is_routine: bool) -> bool {
    let is_of_routines = routine::CHECKS.iter().any(|check| check.id == id);
    let is_shared = routine::SHARED.contains(&id) || routine::OF_RESPONSES.contains(&id);
    is_of_routines == is_routine || is_routine && is_shared
}

/// The checks that are asked for.
fn chosen(arguments: &Arguments, is_routine: bool) -> Vec<&'static Check> {
    checks()
        .filter(|check| applies(check.id, is_routine))
        .filter(|check| arguments.only.is_empty() || arguments.only.iter().any(|id| id == check.id))
        .collect()
}

/// The checks that this one builds on.
fn needs(check: &Check, is_routine: bool) -> &'static [&'static str] {
    // What describes a routine is read first: what is wrong there is told once.
    if is_routine && check.family == Family::Description {
        &["sidecar-is-read"]
    } else if is_routine && routine::OF_RESPONSES.contains(&check.id) {
        &["routine-is-repeatable"]
    } else {
        check.needs
    }
}

/// The check that this one builds on and that has not passed, if there is one.
fn missing(
    check: &Check,
    is_routine: bool,
    findings: &BTreeMap<&str, Finding>,
) -> Option<&'static str> {
    let mut needs = needs(check, is_routine).iter();
    needs
        .find(|id| {
            findings.get(**id).is_some_and(|finding| {
                !matches!(finding.outcome, Outcome::Passed | Outcome::Warning)
                    && !finding.is_well_nearby
            })
        })
        .copied()
}

/// The checks that were not run and whose needs were.
fn ready(
    chosen: &[&'static Check],
    is_routine: bool,
    findings: &BTreeMap<&str, Finding>,
) -> Vec<&'static Check> {
    let waits =
        |id: &&str| !findings.contains_key(*id) && chosen.iter().any(|other| other.id == *id);
    let open = chosen
        .iter()
        .filter(|check| !findings.contains_key(check.id));
    open.filter(|check| !needs(check, is_routine).iter().any(waits))
        .copied()
        .collect()
}

/// Runs the checks, all that can at the same time.
fn run_all(arguments: &Arguments, path: &Path, is_routine: bool) -> Result<Vec<Finding>, Error> {
    let chosen = chosen(arguments, is_routine);
    let folder = ScratchFolder::new()?;
    let mut findings: BTreeMap<&str, Finding> = BTreeMap::new();
    loop {
        let ready = ready(&chosen, is_routine, &findings);
        if ready.is_empty() {
            break;
        }
        let done: Vec<Finding> = ready
            .par_iter()
            .map(|check| match missing(check, is_routine, &findings) {
                Some(id) => Ok(finding(check, Outcome::Skipped, format!("needs `{id}`"))),
                None => in_child(check, arguments, path, &folder),
            })
            .collect::<Result<_, Error>>()?;
        findings.extend(done.into_iter().map(|finding| (finding.id, finding)));
    }
    Ok(chosen
        .iter()
        .filter_map(|check| findings.remove(check.id))
        .collect())
}

/// Runs the checks in this process, one after the other.
fn run_here(arguments: &Arguments, path: &Path, is_routine: bool) -> Result<Vec<Finding>, Error> {
    // Nothing is tried in a child first: what happens is to happen here.
    let opener = Opener::new(Trust {
        probe: false,
        isolate: None,
    });
    let mut findings: BTreeMap<&str, Finding> = BTreeMap::new();
    let chosen = chosen(arguments, is_routine);
    while let Some(check) = ready(&chosen, is_routine, &findings).first() {
        let done = if let Some(id) = missing(check, is_routine, &findings) {
            finding(check, Outcome::Skipped, format!("needs `{id}`"))
        } else {
            let answer = run_check(check, &Subject::new(arguments, &opener, path));
            answer.reported(check, arguments, path)?
        };
        findings.insert(check.id, done);
    }
    Ok(chosen
        .iter()
        .filter_map(|check| findings.remove(check.id))
        .collect())
}

/// Prefix of the line with a child's answer.
const ANSWER: &str = "pilum-check-answer ";
/// The ending of the file with it, else.
const ANSWERED: &str = "answer";
/// Most memory of a check, in bytes.
const MEMORY: u64 = 8 << 30;

/// What came of a check.
#[derive(Serialize, Deserialize)]
struct Answer {
    outcome: Outcome,
    details: String,
    /// The call that it is about.
    capsule: Option<String>,
    /// The largest of what was found, as a part of each threshold.
    nearest: BTreeMap<String, f64>,
    /// How the library has ended the process of the check.
    #[serde(skip)]
    ended: Option<String>,
    /// The check took longer than it may.
    #[serde(skip)]
    is_late: bool,
}

/// Origin of the content of a capsule, by key.
fn origin(check: &Check, seed: u64) -> [(&'static str, toml::Value); 2] {
    [
        ("check", check.id.into()),
        ("seed", seed.to_string().into()),
    ]
}

/// Runs one check here.
fn run_check(check: &Check, subject: &Subject) -> Answer {
    let is_routine = routine::OF_RESPONSES.contains(&check.id) && routine::is_one(&subject.path);
    let found = if is_routine {
        routine::of_response(check, subject)
    } else {
        (check.run)(subject)
    };
    let (verdict, capsule) = match found {
        Err(Verdict::At(verdict, mut capsule)) => {
            let origin = origin(check, subject.seed);
            let origin = origin.map(|(key, value)| (key.to_owned(), value));
            capsule.origin.extend(origin);
            (Err(*verdict), Some(capsule.to_string()))
        }
        verdict => (verdict, None),
    };
    let (outcome, details) = match verdict {
        Ok(details) => (Outcome::Passed, details),
        Err(verdict) => {
            let outcome = match verdict {
                Verdict::Skipped(_) => Outcome::Skipped,
                Verdict::Warning(_) => Outcome::Warning,
                Verdict::Failed(_) | Verdict::At(..) => Outcome::Failed,
            };
            (outcome, verdict.words().to_owned())
        }
    };
    Answer {
        outcome,
        details,
        capsule,
        nearest: margins::take(),
        ended: None,
        is_late: false,
    }
}

impl Answer {
    /// The line of the report, with the file for `pilum replay`.
    fn reported(self, check: &Check, arguments: &Arguments, path: &Path) -> Result<Finding, Error> {
        let mut finding = finding(check, self.outcome, self.details);
        finding.nearest = self.nearest;
        finding.ended = self.ended;
        finding.is_late = self.is_late;
        if finding.outcome.is_bad() {
            let own: Vec<String> = own_arguments(check, arguments)
                .iter()
                .map(|a| a.to_string_lossy().into_owned())
                .collect();
            finding.replay = Some(format!("pilum check {} {}", path.display(), own.join(" ")));
        }
        if let Some(capsule) = self.capsule {
            let name = path.file_stem().unwrap_or_default();
            let folder = arguments.out.clone();
            let folder = folder.unwrap_or_else(|| Path::new("results/check").join(name));
            std::fs::create_dir_all(&folder)
                .map_err(|source| text::Error::unwritable(&folder, source))?;
            let file = folder.join(format!("{}.toml", check.id));
            replace(&file, capsule)?;
            finding.capsule = Some(file);
        }
        Ok(finding)
    }
}

/// Runs one check in this process, a child.
fn answer(arguments: &Arguments, opener: &Opener, path: &Path) -> Result<Answer, Error> {
    let check = checks()
        .chain(INNER)
        .find(|check| arguments.only.iter().any(|id| id == check.id))
        .ok_or_else(|| Error::internal("there is no check to run".to_owned()))?;
    Ok(run_check(check, &Subject::new(arguments, opener, path)))
}

/// The arguments that make a check the same again.
fn own_arguments(check: &Check, arguments: &Arguments) -> Vec<OsString> {
    let mut own: Vec<OsString> = ["--only", check.id, "--seed", &arguments.seed.to_string()]
        .map(OsString::from)
        .to_vec();
    for (id, value) in &arguments.set {
        own.extend(["--set".into(), format!("{id}={value}").into()]);
    }
    for (option, file) in [("--driver", &arguments.driver), ("--at", &arguments.at)] {
        if let Some(file) = file {
            own.extend([option.into(), file.into()]);
        }
    }
    own
}

/// Runs one check in a child. A routine may end its process on long paths where it does not
/// converge; its results on short paths are then reported too. That it does so is a fault of one
/// check, and a warning of the others.
fn in_child(
    check: &Check,
    arguments: &Arguments,
    path: &Path,
    scratch: &ScratchFolder,
) -> Result<Finding, Error> {
    let far = led_in_child(check, arguments, path, scratch, false)?;
    if far.outcome != Outcome::Crashed || !routine::is_one(path) {
        return Ok(far);
    }
    let near = led_in_child(check, arguments, path, scratch, true)?;
    let on_short_paths = if near.outcome == Outcome::Skipped {
        "of short paths it says nothing".to_owned()
    } else {
        format!("on short paths: {}", near.details)
    };
    let details = format!("far away {}; {on_short_paths}", far.details);
    let is_well_nearby = matches!(near.outcome, Outcome::Passed | Outcome::Warning);
    Ok(match near.outcome {
        Outcome::Crashed => far,
        Outcome::Failed => near,
        // The others lead it on all the same. A limit of time is no fault of a routine that is slow.
        _ if check.id == routine::GOES_FAR && !far.is_late => Finding {
            details,
            is_well_nearby,
            ..far
        },
        Outcome::Passed | Outcome::Warning | Outcome::Skipped => Finding {
            outcome: Outcome::Warning,
            details,
            replay: None,
            ..far
        },
    })
}

fn led_in_child(
    check: &Check,
    arguments: &Arguments,
    path: &Path,
    scratch: &ScratchFolder,
    is_near: bool,
) -> Result<Finding, Error> {
    asked_in_child(check, arguments, path, scratch, is_near)?.reported(check, arguments, path)
}

fn asked_in_child(
    check: &Check,
    arguments: &Arguments,
    path: &Path,
    scratch: &ScratchFolder,
    is_near: bool,
) -> Result<Answer, Error> {
    let internal = |error: std::io::Error| Error::internal(error.to_string());
    let name = if is_near { "-near" } else { "" };
    let folder = scratch.inner(&format!("{}{name}", check.id));
    let folder = folder.map_err(internal)?;
    let mut all: Vec<OsString> = vec!["check".into(), path.into()];
    all.extend(own_arguments(check, arguments));
    all.push("--child".into());
    all.extend(is_near.then(|| OsString::from("--near")));
    let told = all.clone();
    // Beside the folder, since what stands in that is the law's.
    let kept = folder.with_extension("call");
    all.extend(["--kept".into(), kept.clone().into()]);
    let outcome = child::run(&Work {
        arguments: all,
        folder: Some(folder.clone()),
        variables: Vec::new(),
        time: Duration::from_secs_f64(arguments.time_limit),
        memory: Some(MEMORY),
    })
    .map_err(internal)?;
    let stdout = String::from_utf8_lossy(&outcome.stdout).into_owned();
    let stderr = String::from_utf8_lossy(&outcome.stderr).into_owned();
    let answer = file::read_text(&kept.with_extension(ANSWERED)).ok();
    let answer = answer.and_then(|text| serde_json::from_slice::<Answer>(&text).ok());
    let crashed = |details: String| Answer {
        outcome: Outcome::Crashed,
        ended: Some(details.clone()),
        details,
        capsule: None,
        nearest: BTreeMap::new(),
        is_late: false,
    };
    let answer = match (answer, outcome.ending) {
        (_, Ending::TimedOut) => Answer {
            is_late: true,
            ..crashed(format!(
                "it did not return within {} s",
                arguments.time_limit
            ))
        },
        (Some(answer), Ending::Exited(0)) => {
            match (
                answer.outcome,
                afterwards(check.id, &stdout, &stderr, &folder),
            ) {
                (Outcome::Passed, Some(details)) => Answer {
                    outcome: Outcome::Failed,
                    details,
                    ..answer
                },
                _ => answer,
            }
        }
        (Some(_), ending) => crashed(format!("the process ended with {ending} after the check")),
        (None, ending) => {
            let last = stderr.lines().rfind(|line| !line.trim().is_empty());
            let last = last.map_or(String::new(), |line| format!(": {}", line.trim()));
            crashed(format!(
                "the process ended with {ending} before it could answer{last}"
            ))
        }
    };
    let mut answer = answer;
    if answer.outcome == Outcome::Crashed && arguments.at.is_none() {
        let limit = Duration::from_secs_f64(arguments.time_limit.min(10.0));
        let told = [told, vec!["--tell".into(), kept.clone().into()]].concat();
        answer.capsule = crashed::repeated(told, &kept, limit, origin(check, arguments.seed));
    }
    Ok(answer)
}

/// What only the parent can see of two of the checks.
fn afterwards(id: &str, stdout: &str, stderr: &str, folder: &Path) -> Option<String> {
    match id {
        "prints-nothing" => {
            let mut lines = stdout.lines().chain(stderr.lines());
            let line = lines.find(|line| !line.is_empty() && !line.starts_with(ANSWER))?;
            Some(format!("it printed: {line}"))
        }
        "writes-no-files" => {
            let entry = std::fs::read_dir(folder).ok()?.next()?.ok()?;
            let name = entry.file_name().to_string_lossy().into_owned();
            Some(format!("it wrote `{name}` into the working directory"))
        }
        _ => None,
    }
}

/// A folder for the children to work in, removed at the end.
struct ScratchFolder(PathBuf);

impl ScratchFolder {
    fn new() -> Result<Self, Error> {
        let id = std::process::id();
        // What was killed may have left a folder behind, and the system gives the numbers of processes again.
        for number in 0..1000 {
            let path = std::env::temp_dir().join(format!("pilum-check-{id}-{number}"));
            match std::fs::create_dir(&path) {
                Ok(()) => return Ok(Self(path)),
                Err(why) if why.kind() == std::io::ErrorKind::AlreadyExists => {}
                Err(why) => return Err(text::Error::unwritable(&path, why).into()),
            }
        }
        let why = "a thousand folders of earlier checks are in the way";
        Err(text::Error::unwritable(&std::env::temp_dir(), std::io::Error::other(why)).into())
    }

    fn inner(&self, name: &str) -> std::io::Result<PathBuf> {
        let path = self.0.join(name);
        std::fs::create_dir(&path)?;
        Ok(path)
    }
}

impl Drop for ScratchFolder {
    fn drop(&mut self) {
        // A folder that stays behind in the system's place for such folders harms nobody.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}
