//! The checks of a library in the order in which they run.

use super::report::Finding;
use super::verdict::Outcome;
use super::{Arguments, Check, Family, Subject, checks, in_child, routine};
use crate::Error;
use crate::scratch::Scratch;
use law::Opener;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::path::Path;

/// Whether a check is for such a library: a UMAT with a sidecar, or one of the contract.
pub(super) fn applies(id: &str, is_routine: bool) -> bool {
    let is_of_routines = routine::CHECKS.iter().any(|check| check.id == id);
    let is_shared = routine::SHARED.contains(&id) || routine::OF_RESPONSES.contains(&id);
    is_of_routines == is_routine || is_routine && is_shared
}

/// Checks that are asked for, and what was found so far.
struct Schedule {
    chosen: Vec<&'static Check>,
    is_routine: bool,
    findings: BTreeMap<&'static str, Finding>,
}

impl Schedule {
    fn new(arguments: &Arguments, path: &Path) -> Self {
        let is_routine = routine::is_one(path);
        let is_asked_for =
            |id: &str| arguments.only.is_empty() || arguments.only.iter().any(|only| id == only);
        Self {
            chosen: checks()
                .filter(|check| applies(check.id, is_routine) && is_asked_for(check.id))
                .collect(),
            is_routine,
            findings: BTreeMap::new(),
        }
    }

    /// The checks that this one builds on.
    fn needs(&self, check: &Check) -> &'static [&'static str] {
        // What describes a routine is read first: what is wrong there is told once.
        if self.is_routine && check.family() == Family::Description {
            &["sidecar-is-read"]
        } else if self.is_routine && routine::OF_RESPONSES.contains(&check.id) {
            &["routine-is-repeatable"]
        } else {
            check.needs
        }
    }

    /// The finding about a check that builds on one that has not passed, if there is one.
    fn missing(&self, check: &'static Check) -> Option<Finding> {
        let has_not_passed = |id: &&&str| {
            self.findings.get(**id).is_some_and(|finding| {
                !matches!(finding.outcome, Outcome::Passed | Outcome::Warning)
                    && !finding.is_well_nearby
            })
        };
        let id = self.needs(check).iter().find(has_not_passed)?;
        Some(Finding::new(
            check,
            Outcome::Skipped,
            format!("needs `{id}`"),
        ))
    }

    /// The checks that were not run and whose needs were.
    fn ready(&self) -> Vec<&'static Check> {
        let is_open = |id: &str| !self.findings.contains_key(id);
        let waits = |id: &&str| is_open(id) && self.chosen.iter().any(|other| other.id == *id);
        let open = self.chosen.iter().filter(|check| is_open(check.id));
        open.filter(|check| !self.needs(check).iter().any(waits))
            .copied()
            .collect()
    }

    /// The findings in the order of the checks.
    fn in_order(mut self) -> Vec<Finding> {
        let ids = self.chosen.iter().map(|check| check.id);
        ids.filter_map(|id| self.findings.remove(id)).collect()
    }
}

/// Runs the checks, all that can at the same time, each in a child.
pub(super) fn run_apart(arguments: &Arguments, path: &Path) -> Result<Vec<Finding>, Error> {
    let scratch = Scratch::new()?;
    let mut schedule = Schedule::new(arguments, path);
    loop {
        let ready = schedule.ready();
        if ready.is_empty() {
            return Ok(schedule.in_order());
        }
        let done: Vec<Finding> = ready
            .par_iter()
            .map(|&check| match schedule.missing(check) {
                Some(skipped) => Ok(skipped),
                None => in_child::run(check, arguments, path, scratch.path()),
            })
            .collect::<Result<_, Error>>()?;
        let done = done.into_iter().map(|finding| (finding.id, finding));
        schedule.findings.extend(done);
    }
}

/// Runs the checks in this process, one after the other.
pub(super) fn run_here(arguments: &Arguments, path: &Path) -> Result<Vec<Finding>, Error> {
    // Nothing is tried in a child first: what happens is to happen here.
    let opener = Opener::default();
    let mut schedule = Schedule::new(arguments, path);
    while let Some(&check) = schedule.ready().first() {
        let done = match schedule.missing(check) {
            Some(skipped) => skipped,
            None => in_child::answer(check, &Subject::new(arguments, &opener, path))
                .reported(check, arguments, path)?,
        };
        schedule.findings.insert(check.id, done);
    }
    Ok(schedule.in_order())
}
