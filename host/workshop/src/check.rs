//! `pilum check`: does a library keep the contract?
//!
//! Every check runs in a [`child`](law::child) process, so that a library may crash, hang or end the
//! process and be reported like any other fault. Checks are named, and a check is skipped when one
//! that it builds on has not passed, so that a fault is reported by the check that names it.

mod arguments;
mod author_path;
mod contract;
mod coverage;
mod crashed;
mod description;
mod draw;
mod fresh_process;
mod in_child;
mod inputs;
mod load;
mod loading_path;
mod location;
mod margins;
mod mathematics;
mod memory;
pub(crate) mod points;
mod purity;
mod random;
pub(crate) mod recheck;
mod report;
mod response;
mod robustness;
mod routine;
mod schedule;
pub(crate) mod specimen;
mod subject;
mod verdict;
mod words;

pub use arguments::Arguments;
pub(crate) use verdict::{refusal, refusal_in};

use crate::Error;
use crate::scratch::Scratch;
use law::foreign::Adapter;
use law::{Opener, hexadecimal_sha256};
use report::{Finding, Report};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;
use subject::Subject;
use text::file;
use text::suggestion;
use verdict::{Found, Outcome, Verdict, counted, failed, skipped, status_name, warned};

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
    description: &'static str,
    /// Checks without which this one says nothing.
    needs: &'static [&'static str],
    run: fn(&Subject) -> Found,
}

/// All checks, those that others build on first.
const CHECKS: [(Family, &[Check]); 11] = [
    (Family::Load, load::CHECKS),
    (Family::Description, description::CHECKS),
    (Family::Contract, contract::CHECKS),
    (Family::Memory, memory::CHECKS),
    (Family::Purity, purity::CHECKS),
    (Family::Robustness, robustness::CHECKS),
    (Family::Mathematics, mathematics::CHECKS),
    (Family::Mathematics, response::CHECKS),
    (Family::Mathematics, inputs::CHECKS),
    (Family::Mathematics, coverage::CHECKS),
    (Family::Routine, routine::CHECKS),
];

fn checks() -> impl Iterator<Item = &'static Check> {
    CHECKS.into_iter().flat_map(|(_, checks)| checks)
}

impl Check {
    /// Its subject; that of what is asked for is a description.
    fn family(&self) -> Family {
        let is_own = |checks: &[Self]| checks.iter().any(|check| check.id == self.id);
        let mut all = CHECKS.into_iter();
        let own = all.find(|(_, checks)| is_own(checks));
        own.map_or(Family::Description, |(family, _)| family)
    }
}

/// Requirement on `--set` before the checks: not a check of the library.
static SETTINGS: Check = Check {
    id: "settings-fit",
    description: "`--set` names parameters, and values that the laws accept.",
    needs: &[],
    run: draw::settings_fit,
};

/// Requirement on `--driver` before the checks.
static DRIVER: Check = Check {
    id: "driver-fits",
    description: "The driver can be read, and leads a law of the library.",
    needs: &[],
    run: author_path::driver_fits,
};

/// Checks of what is asked for, none of the library.
static INNER: [&Check; 2] = [&SETTINGS, &DRIVER];

/// SHA-256 of a library. A file that cannot be read is an error, and nothing is checked.
fn sha256_of(path: &Path) -> Result<String, Error> {
    let bytes = file::read_library(path).map_err(|source| text::Error::Unreadable {
        path: path.to_owned(),
        source,
    })?;
    Ok(hexadecimal_sha256(&bytes))
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
    if arguments.list {
        refuse_unknown(arguments)?;
        print(&report::list(arguments.json)?);
        return Ok(());
    }
    if let Some(calls) = &arguments.child {
        return in_child::work(arguments, opener, &arguments.library_path()?, calls);
    }
    refuse_unknown(arguments)?;
    let path = arguments.library_path()?;
    let sha256 = sha256_of(&path)?;
    let is_routine = routine::is_one(&path);
    refuse_checks_of_others(arguments, is_routine)?;
    let arguments = &arguments.with_absolute_driver()?;
    refuse_what_does_not_fit(arguments, opener, (&path, is_routine))?;
    let mut findings = if arguments.in_process {
        schedule::run_here(arguments, &path)?
    } else {
        schedule::run_apart(arguments, &path)?
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
        print(&format!("{}\n", report::json(&report)?));
    } else {
        print(&report.text());
    }
    judged(arguments, &path, &findings)
}

/// Refuses checks that do not exist.
fn refuse_unknown(arguments: &Arguments) -> Result<(), Error> {
    let ids: Vec<&str> = checks().map(|check| check.id).collect();
    let mut unknown = arguments
        .only
        .iter()
        .filter(|id| !ids.contains(&id.as_str()));
    unknown.next().map_or(Ok(()), |id| {
        let known = suggestion(id, ids.iter().copied());
        Err(Error::usage(format!("there is no check `{id}`: {known}")))
    })
}

/// Refuses checks that are not for such a library.
fn refuse_checks_of_others(arguments: &Arguments, is_routine: bool) -> Result<(), Error> {
    let whose = if is_routine {
        "libraries of the contract"
    } else {
        "UMATs, UDSMs and MFront behaviours"
    };
    let mut only = arguments.only.iter();
    let other = only.find(|id| !schedule::applies(id, is_routine));
    other.map_or(Ok(()), |id| {
        let message = format!("--only {id}: this check is for {whose}");
        Err(Error::usage(message))
    })
}

/// Refuses settings and drivers that are for other libraries.
fn refuse_what_does_not_fit(
    arguments: &Arguments,
    opener: &Opener,
    (path, is_routine): (&Path, bool),
) -> Result<(), Error> {
    // A library that cannot answer is left to the checks.
    let asked = |check| in_child::run(check, arguments, path, Scratch::new()?.path());
    if is_routine {
        routine::refuse_without_driver(path, arguments.driver.is_some())?;
        routine::refuse_settings(&arguments.set, path)?;
    } else if !arguments.set.is_empty() {
        let finding = asked(&SETTINGS)?;
        if finding.outcome == Outcome::Failed {
            return Err(Error::usage(finding.details));
        }
    }
    let Some(driver) = &arguments.driver else {
        return Ok(());
    };
    let finding = asked(&DRIVER)?;
    match finding.outcome {
        // It cannot be read: once more here, with the place in the file.
        Outcome::Warning => author_path::read(opener, driver).map(drop),
        Outcome::Failed => Err(Error::usage(finding.details)),
        _ => Ok(()),
    }
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
