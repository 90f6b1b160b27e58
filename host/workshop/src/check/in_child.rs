//! One check in a separate process: the child's work, and its end as the parent sees it.

use super::report::Finding;
use super::verdict::Outcome;
use super::{Arguments, Check, INNER, Subject, checks, crashed, fresh_process, margins, routine};
use crate::{Error, internal};
use law::Opener;
use law::child::{self, Ending, Work};
use law::probe::call_log::{self, KeptPhase, Phase};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::time::Duration;
use text::file;
use text::write::replace;

/// Most memory of a check, in bytes.
const MEMORY: u64 = 8 << 30;
/// Without the cache of each thread: glibc counts what was freed into it as in use (`tcache` in its manual).
const NO_CACHE: (&str, &str) = ("GLIBC_TUNABLES", "glibc.malloc.tcache_count=0");

/// Outcome of a check.
#[derive(Serialize, Deserialize)]
pub(super) struct Answer {
    pub(super) outcome: Outcome,
    pub(super) details: String,
    /// The call that it is about.
    pub(super) capsule: Option<String>,
    /// The largest of what was found, as a part of each threshold.
    nearest: BTreeMap<String, f64>,
    /// How the library has ended the process of the check.
    #[serde(skip)]
    ended: Option<String>,
    /// The check took longer than it may.
    #[serde(skip)]
    is_late: bool,
}

/// The file of a child's answer, next to that of its calls.
pub(super) fn answered(calls: &Path) -> PathBuf {
    calls.with_extension("answer")
}

/// Origin of the content of a capsule, by key.
fn origin(check: &Check, seed: u64) -> [(String, toml::Value); 2] {
    [
        ("check".to_owned(), check.id.into()),
        ("seed".to_owned(), seed.to_string().into()),
    ]
}

/// Runs one check here.
pub(super) fn answer(check: &Check, subject: &Subject) -> Answer {
    let is_routine = routine::OF_RESPONSES.contains(&check.id) && routine::is_one(&subject.path);
    let found = if is_routine {
        routine::of_response(check, subject)
    } else {
        (check.run)(subject)
    };
    let (outcome, details, capsule) = match found {
        Ok(details) => (Outcome::Passed, details, None),
        Err(verdict) => (verdict.outcome, verdict.why, verdict.capsule),
    };
    let capsule = capsule.map(|mut capsule| {
        capsule.origin.extend(origin(check, subject.seed));
        capsule.to_string()
    });
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
    fn crashed(details: String) -> Self {
        Self {
            outcome: Outcome::Crashed,
            ended: Some(details.clone()),
            details,
            capsule: None,
            nearest: BTreeMap::new(),
            is_late: false,
        }
    }

    /// The line of the report, with the file for `pilum replay`.
    pub(super) fn reported(
        self,
        check: &'static Check,
        arguments: &Arguments,
        path: &Path,
    ) -> Result<Finding, Error> {
        let mut finding = Finding::new(check, self.outcome, self.details);
        finding.nearest = self.nearest;
        finding.ended = self.ended;
        finding.is_late = self.is_late;
        if finding.outcome.is_bad() {
            finding.replay = Some(arguments.command_of(check, path));
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

/// Work of this process, a child.
pub(super) fn work(
    arguments: &Arguments,
    opener: &Opener,
    path: &Path,
    calls: &Path,
) -> Result<(), Error> {
    let started = std::process::id();
    child::enter().map_err(internal)?;
    let subject = Subject::new(arguments, opener, path);
    if arguments.tell {
        return crashed::tell(&subject, calls);
    }
    if arguments.calls {
        return fresh_process::answer(&subject, calls);
    }
    call_log::keep_in(std::fs::File::create(calls).map_err(internal)?);
    let check = checks()
        .chain(INNER)
        .find(|check| arguments.only.iter().any(|id| id == check.id))
        .ok_or_else(|| internal("there is no check to run"))?;
    let answer = answer(check, &subject);
    // A law that forks would have two processes answer.
    if std::process::id() == started {
        let answer = serde_json::to_string(&answer).map_err(internal)?;
        replace(&answered(calls), answer)?;
        // What is left is the end of the process.
        call_log::keep_phase(KeptPhase::new(Phase::Exit, false)).map_err(internal)?;
    }
    Ok(())
}

/// Runs one check in a child. A routine may end its process on long paths where it does not
/// converge; its results on short paths are then reported too. That it does so is a fault of one
/// check, and a warning of the others.
pub(super) fn run(
    check: &'static Check,
    arguments: &Arguments,
    path: &Path,
    scratch: &Path,
) -> Result<Finding, Error> {
    let led =
        |is_near| ask(check, arguments, path, scratch, is_near)?.reported(check, arguments, path);
    let far = led(false)?;
    if far.outcome != Outcome::Crashed || !routine::is_one(path) {
        return Ok(far);
    }
    let near = led(true)?;
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

/// The answer of a child that has ended, or how.
fn ended(answer: Option<Answer>, outcome: &child::Outcome, (id, folder): (&str, &Path)) -> Answer {
    let ending = outcome.ending;
    match answer {
        Some(answer) if ending == Ending::Exited(0) => {
            let passed = answer.outcome == Outcome::Passed;
            match passed.then(|| afterwards(id, outcome, folder)).flatten() {
                Some(details) => Answer {
                    outcome: Outcome::Failed,
                    details,
                    ..answer
                },
                None => answer,
            }
        }
        Some(_) => Answer::crashed(format!("the process ended with {ending} after the check")),
        None => {
            let stderr = String::from_utf8_lossy(&outcome.stderr);
            let last = stderr.lines().rfind(|line| !line.trim().is_empty());
            let last = last.map_or(String::new(), |line| format!(": {}", line.trim()));
            Answer::crashed(format!(
                "the process ended with {ending} before it could answer{last}"
            ))
        }
    }
}

/// The answer of a child, or how it ended.
pub(super) fn ask(
    check: &Check,
    arguments: &Arguments,
    path: &Path,
    scratch: &Path,
    is_near: bool,
) -> Result<Answer, Error> {
    let name = if is_near { "-near" } else { "" };
    let folder = scratch.join(format!("{}{name}", check.id));
    std::fs::create_dir(&folder).map_err(internal)?;
    // Beside the folder, since what stands in that is the law's.
    let calls = folder.with_extension("call");
    let mut all: Vec<OsString> = vec!["check".into(), path.into()];
    all.extend(arguments.of_one(check));
    all.extend(["--child".into(), calls.clone().into()]);
    all.extend(is_near.then(|| OsString::from("--near")));
    let time = Duration::from_secs_f64(arguments.time_limit);
    let outcome = child::run(&Work {
        folder: Some(folder.clone()),
        variables: vec![NO_CACHE],
        memory: Some(MEMORY),
        ..Work::new(all.clone(), time)
    })
    .map_err(internal)?;
    let answer = file::read_text(&answered(&calls)).ok();
    let answer = answer.and_then(|text| serde_json::from_slice::<Answer>(&text).ok());
    let mut answer = match outcome.ending {
        Ending::TimedOut => {
            let limit = arguments.time_limit;
            Answer {
                is_late: true,
                ..Answer::crashed(format!("it did not return within {limit} s"))
            }
        }
        _ => ended(answer, &outcome, (check.id, &folder)),
    };
    if answer.outcome == Outcome::Crashed && arguments.at.is_none() {
        let limit = Duration::from_secs_f64(arguments.time_limit.min(10.0));
        all.push("--tell".into());
        answer.capsule = crashed::repeated(all, &calls, limit, origin(check, arguments.seed));
    }
    Ok(answer)
}

/// Faults of two checks that only the parent can see.
fn afterwards(id: &str, outcome: &child::Outcome, folder: &Path) -> Option<String> {
    match id {
        "prints-nothing" => {
            let [stdout, stderr] =
                [&outcome.stdout, &outcome.stderr].map(|bytes| String::from_utf8_lossy(bytes));
            let line = stdout
                .lines()
                .chain(stderr.lines())
                .find(|line| !line.is_empty())?;
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
