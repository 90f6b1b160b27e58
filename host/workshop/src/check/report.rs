//! Report of checks: a line each, and common findings once.

use super::verdict::Outcome;
use super::{Check, Family, checks};
use crate::{Error, internal};
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::PathBuf;

/// A line of the report.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Finding {
    pub(super) id: &'static str,
    pub(super) family: Family,
    pub(super) description: &'static str,
    pub(super) outcome: Outcome,
    pub(super) details: String,
    /// The command that runs this check alone.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) replay: Option<String>,
    /// The file with the call that it is about.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) capsule: Option<PathBuf>,
    /// The largest of what was found, as a part of each threshold.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub(super) nearest: BTreeMap<String, f64>,
    /// How the library has ended its process, as the details say.
    #[serde(skip)]
    pub(super) ended: Option<String>,
    /// The check took longer than it may.
    #[serde(skip)]
    pub(super) is_late: bool,
    /// It fails far away alone: those that build on it go on.
    #[serde(skip)]
    pub(super) is_well_nearby: bool,
}

/// An entry of the list of checks.
#[derive(Serialize)]
struct Entry {
    id: &'static str,
    family: Family,
    description: &'static str,
    needs: &'static [&'static str],
}

#[derive(Serialize)]
pub(super) struct Report<'a> {
    pub(super) library: String,
    pub(super) sha256: String,
    pub(super) seed: u64,
    pub(super) checks: &'a [Finding],
    pub(super) counts: BTreeMap<&'static str, usize>,
}

impl Finding {
    pub(super) fn new(check: &'static Check, outcome: Outcome, details: String) -> Self {
        Self {
            id: check.id,
            family: check.family(),
            description: check.description,
            outcome,
            details,
            replay: None,
            capsule: None,
            nearest: BTreeMap::new(),
            ended: None,
            is_late: false,
            is_well_nearby: false,
        }
    }

    /// Its lines.
    fn text(&self) -> String {
        let name = self.outcome.name();
        let word = if self.outcome.is_bad() {
            name.to_uppercase()
        } else {
            name.to_owned()
        };
        let line = format!("  {word:9}{:32}{}", self.id, self.details);
        let mut text = format!("{}\n", line.trim_end());
        if let Some(replay) = &self.replay {
            let _ = writeln!(text, "           {}\n           {replay}", self.description);
        }
        if let Some(capsule) = &self.capsule {
            let _ = writeln!(text, "           pilum replay {}", capsule.display());
        }
        text
    }
}

/// Tells how a library has ended its process with the first check that fails of it, or else the first one that it has
/// ended so, and which others those are; these refer to it.
pub(super) fn tell_once(findings: &mut [Finding]) {
    for i in 0..findings.len() {
        let Some(ended) = findings[i].ended.clone() else {
            continue;
        };
        let is_same = |finding: &Finding| finding.ended.as_ref() == Some(&ended);
        let fails = |finding: &Finding| finding.outcome.is_bad() && is_same(finding);
        let main = findings.iter().position(fails).unwrap_or(i);
        let as_there = format!("the process ended as in `{}`", findings[main].id);
        let mut others = Vec::new();
        for (k, other) in findings.iter_mut().enumerate() {
            if k != main && is_same(other) {
                other.details = other.details.replacen(&ended, &as_there, 1);
                other.ended = None;
                others.push(format!("`{}`", other.id));
            }
        }
        findings[main].ended = None;
        if !others.is_empty() {
            let with_others = format!("{ended} (so it did in {})", others.join(", "));
            let details = &mut findings[main].details;
            *details = details.replacen(&ended, &with_others, 1);
        }
    }
}

pub(super) fn json(value: &impl Serialize) -> Result<String, Error> {
    serde_json::to_string_pretty(value).map_err(internal)
}

pub(super) fn list(as_json: bool) -> Result<String, Error> {
    if as_json {
        let entry = |check: &'static Check| Entry {
            id: check.id,
            family: check.family(),
            description: check.description,
            needs: check.needs,
        };
        let all: Vec<Entry> = checks().map(entry).collect();
        return Ok(format!("{}\n", json(&all)?));
    }
    let line = |check: &Check| format!("{}\n    {}\n", check.id, check.description);
    Ok(checks().map(line).collect())
}

impl Report<'_> {
    pub(super) fn text(&self) -> String {
        let mut text = format!(
            "{}\nsha256 {}, seed {}\n",
            self.library, self.sha256, self.seed
        );
        let mut family = None;
        for finding in self.checks {
            if family != Some(finding.family) {
                family = Some(finding.family);
                let _ = writeln!(text, "\n{}", format!("{:?}", finding.family).to_lowercase());
            }
            text.push_str(&finding.text());
        }
        let counts: Vec<String> = self
            .counts
            .iter()
            .map(|(word, n)| format!("{n} {word}"))
            .collect();
        let n: usize = self.counts.values().sum();
        let _ = writeln!(text, "\n{n} checks: {}", counts.join(", "));
        text
    }
}
