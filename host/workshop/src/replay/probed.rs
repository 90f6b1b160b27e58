//! Calls as `pilum check` has made them: in a their own process, where they may crash again, or in
//! this one, for a debugger.

use crate::Error;
use crate::check::specimen::{create_form, first_difference, is_success};
use law::capsule::Capsule;
use law::child::{self, Ending, Work};
use law::probe::call_log::Function;
use law::probe::{Answer, Created, Form, PointEnd, PointStart, Probe};
use law::{LoadedLaw, Opener, Trust};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Message about a law that exceeds its time limit.
const STUCK: &str = "the law does not return";
/// How long a law may take for some points in a their own process.
const PATIENCE: Duration = Duration::from_secs(20);
/// Message as soon as the law has returned.
const RETURNED: &str = "the call returned";

/// Repeats the call in another process.
pub(super) fn outside(
    path: &Path,
    capsule: &Capsule,
    limit: Duration,
    say: &mut dyn FnMut(&str),
) -> Result<(), Error> {
    let (said, crash) = run(path, limit)?;
    said.lines().for_each(&mut *say);
    let fails = || Error::CallFails {
        law: capsule.law.id.clone(),
        outcome: "internal",
        cannot_follow: false,
    };
    let Some(crash) = crash else {
        return if said.contains(FAULTLESS) {
            Ok(())
        } else {
            Err(fails())
        };
    };
    if crash == capsule.outcome.message {
        say(&format!("as recorded: `internal`: {crash}"));
    } else {
        say(&format!("outcome   `internal`: {crash}"));
        let recorded = &capsule.outcome;
        say(&format!(
            "recorded  `{}`: {}",
            recorded.status, recorded.message
        ));
    }
    let is_update = capsule
        .probe
        .is_some_and(|p| p.function == Function::Integrate);
    if is_update && capsule.n_points() == 1 && crash != STUCK {
        let shorter = ScratchFile::new();
        let succeeds = |fraction| {
            capsule.shortened(fraction).write(&shorter.0).is_ok()
                && run(&shorter.0, limit).is_ok_and(|(_, crash)| crash.is_none())
        };
        super::bisect(succeeds, say);
    }
    Err(fails())
}

/// Repeats the call of a capsule in a process that does nothing else, with these environment variables. Returns a
/// line for each point, or how a call without results ended.
///
/// # Errors
/// There is no process, or the capsule cannot be used.
pub(crate) fn afresh(
    capsule: &Capsule,
    variables: &[(&'static str, &'static str)],
) -> Result<Result<Vec<String>, String>, Error> {
    let file = ScratchFile::new();
    capsule.write(&file.0)?;
    let (said, crash) = run_with(&file.0, PATIENCE, variables)?;
    let lines = || said.lines().map(str::to_owned);
    Ok(match (crash, said.contains(FAULTLESS)) {
        (Some(crash), _) => Err(crash),
        (None, true) => Ok(lines().filter(|line| line.starts_with(FLUX)).collect()),
        (None, false) => Err(lines().next_back().unwrap_or_default()),
    })
}

/// A file for capsules of shorter increments, removed at the end.
struct ScratchFile(PathBuf);

impl ScratchFile {
    fn new() -> Self {
        let name = format!("pilum-replay-{}.toml", std::process::id());
        Self(std::env::temp_dir().join(name))
    }
}

impl Drop for ScratchFile {
    fn drop(&mut self) {
        // What stays behind in the system's place for such files harms nobody.
        let _ = std::fs::remove_file(&self.0);
    }
}

/// Repeats the call of a capsule in a separate process: what was said, and how the process ended if the
/// law ended it.
///
/// # Errors
/// There is no process, or the capsule cannot be used.
pub(crate) fn run(path: &Path, limit: Duration) -> Result<(String, Option<String>), Error> {
    run_with(path, limit, &[])
}

/// The same with these variables of its environment.
fn run_with(
    path: &Path,
    limit: Duration,
    variables: &[(&'static str, &'static str)],
) -> Result<(String, Option<String>), Error> {
    let internal = |why: std::io::Error| Error::internal(why.to_string());
    let work = Work {
        arguments: vec!["replay".into(), path.into(), "--in-process".into()],
        folder: None,
        variables: variables.to_vec(),
        time: limit,
        memory: None,
    };
    let outcome = child::run(&work).map_err(internal)?;
    let said = String::from_utf8_lossy(&outcome.stdout).into_owned();
    // A call as in a run says what came of it.
    let returned = said
        .lines()
        .any(|line| line == RETURNED || line.starts_with(FAULTLESS))
        || said.contains("as recorded")
        || said.contains("outcome   ")
        || said.contains("refuses");
    let crash = match outcome.ending {
        Ending::TimedOut => Some(STUCK.to_owned()),
        Ending::Signal(_) => Some(format!("the law crashed: {}", outcome.ending)),
        Ending::Exited(_) if !returned => {
            // The program says why it could not come as far as the call.
            if let Some(why) = refusal_of(&outcome) {
                return Err(Error::usage(why));
            }
            Some(format!("the law ended its process: {}", outcome.ending))
        }
        Ending::Exited(_) => None,
    };
    Ok((said, crash))
}

/// Why the program refused, in its words; `None` if it was the library that ended the process.
pub(super) fn refusal_of(outcome: &child::Outcome) -> Option<String> {
    let said = String::from_utf8_lossy(&outcome.stderr);
    let is_ours = matches!(outcome.ending, Ending::Exited(code) if code != 0);
    let lines: Vec<&str> = said.lines().collect();
    let first = lines.iter().position(|line| line.starts_with("error: "));
    let why = lines[first.filter(|_| is_ours)?..].join("\n");
    Some(why.trim_start_matches("error: ").trim().to_owned())
}

/// Most points of a batch whose results are shown.
const SHOWN: usize = 16;
/// How the line of a point begins.
const FLUX: &str = "flux ";

/// The results of a point, to the last bit.
pub(crate) fn shown(end: &PointEnd) -> String {
    format!("{FLUX}{:?}, internal variables {:?}", end.flux, end.state)
}

/// Message if nothing is wrong.
const FAULTLESS: &str = "the call succeeds";

/// Repeats the call in this process, once more, and in other ways that must not matter.
#[expect(clippy::too_many_lines, reason = "one call after the other")]
pub(super) fn inside(
    capsule: &Capsule,
    loaded: &LoadedLaw,
    say: &mut dyn FnMut(&str),
) -> Result<(), Error> {
    let Some(hypothesis) = capsule.hypothesis() else {
        let message = format!("there is no hypothesis `{}`", capsule.law.hypothesis);
        return Err(capsule.error(&["law", "hypothesis"], message).into());
    };
    let Some(formulation) = loaded.description().formulation(hypothesis) else {
        let message = format!("law `{}` does not offer it", capsule.law.id);
        return Err(capsule.error(&["law", "hypothesis"], message).into());
    };
    let ids = loaded
        .description()
        .parameters
        .iter()
        .map(|p| p.id.as_str());
    let values = capsule.in_order(&capsule.parameters, ids, &["parameters"], "parameter")?;
    let [points, before] = capsule.batch(hypothesis, formulation)?;
    let internal = |why: std::io::Error| Error::internal(why.to_string());
    let fails = |outcome| Error::CallFails {
        law: capsule.law.id.clone(),
        outcome,
        cannot_follow: false,
    };
    let Created {
        status,
        message,
        probe,
    } = loaded
        .probe(&create_form(formulation, hypothesis, &values))
        .map_err(internal)?;
    let function = capsule
        .probe
        .map_or(Function::Integrate, |probe| probe.function);
    if function == Function::Create {
        say(RETURNED);
    }
    let Some(probe) = probe else {
        let text = message.split(|&b| b == 0).next().unwrap_or_default();
        let text = String::from_utf8_lossy(text).into_owned();
        say(&format!(
            "`create` refuses: {}",
            crate::check::refusal(status, Some(&text))
        ));
        return Err(fails("parameter"));
    };
    if function == Function::Create {
        say(FAULTLESS);
        return Ok(());
    }
    let form = capsule.form();
    if function == Function::Destroy {
        let is_of_start = points.iter().all(|point| point.gradient1.is_empty());
        let before = if is_of_start {
            Function::InitState
        } else {
            Function::Integrate
        };
        if !points.is_empty() {
            called(&probe, before, &points, &form).map_err(internal)?;
        }
        drop(probe);
        say(RETURNED);
        say(FAULTLESS);
        return Ok(());
    }
    let call = |points: &[PointStart]| called(&probe, function, points, &form).map_err(internal);
    let Some(first) = call(&points)? else {
        return Err(Error::library(format!(
            "law `{}` has no `init_state`",
            capsule.law.id
        )));
    };
    say(RETURNED);
    if first.points.iter().any(|end| !is_success(end.status)) {
        let why = crate::check::refusal(first.status, first.text().as_deref());
        say(&format!("outcome   {why}"));
        return Err(fails("internal"));
    }
    let variables = &formulation.internal_variables;
    let unwritten = first.points.iter().enumerate().find_map(|(i, end)| {
        let k = end.state.iter().position(|value| !value.is_finite())?;
        Some(format!(
            "point {i}: `{}` is not written, or not finite",
            variables[k].id
        ))
    });
    let differs = |found: &[PointEnd], when: &str| {
        let i = first_difference(&first.points, found)?;
        let found = found.get(i).map_or(String::new(), shown);
        Some(format!(
            "point {i}: {}; {when}: {found}",
            shown(&first.points[i])
        ))
    };
    if !before.is_empty() {
        call(&before)?;
    }
    let again = call(&points)?.map_or(Vec::new(), |answer| answer.points);
    let mut alone = Vec::new();
    for point in &points {
        let one = call(std::slice::from_ref(point))?;
        alone.extend(one.map_or(Vec::new(), |answer| answer.points));
    }
    let reversed: Vec<PointStart> = points.iter().rev().cloned().collect();
    let mut back = call(&reversed)?.map_or(Vec::new(), |answer| answer.points);
    back.reverse();
    let when = if before.is_empty() {
        "called again"
    } else {
        "after another call"
    };
    let fault = unwritten
        .or_else(|| differs(&again, when))
        .or_else(|| differs(&alone, "alone"))
        .or_else(|| differs(&back, "in reverse order"));
    if let Some(fault) = fault {
        say(&fault);
        return Err(fails("internal"));
    }
    say(FAULTLESS);
    let shown = first.points.iter().take(SHOWN).map(shown);
    shown.for_each(|line| say(&line));
    Ok(())
}

/// What the function makes of the points; nothing if the law lacks it.
fn called(
    probe: &Probe,
    function: Function,
    points: &[PointStart],
    form: &Form,
) -> std::io::Result<Option<Answer>> {
    if function == Function::InitState {
        let fluxes: Vec<Vec<f64>> = points.iter().map(|point| point.flux0.clone()).collect();
        return probe.init_state(&fluxes, form);
    }
    probe.integrate(points, form).map(Some)
}

/// Repeats the call of a capsule of a check.
pub(super) fn replay(
    path: &Path,
    capsule: &Capsule,
    opener: &Opener,
    say: &mut dyn FnMut(&str),
) -> Result<(), Error> {
    if let Some(limit) = opener.trust().isolate {
        let law = &capsule.law;
        say(&format!(
            "law `{}` {} of {}, {}",
            law.id,
            law.version,
            law.library.display(),
            law.hypothesis
        ));
        say(&super::from(&capsule.origin));
        return outside(path, capsule, limit, say);
    }
    // Nothing is tried in a child first: what happens is to happen here.
    let opener = Opener::new(Trust {
        probe: false,
        isolate: None,
    });
    inside(capsule, &super::find(capsule, &opener)?, say)
}
