//! A check once more, of the one increment of a capsule that it has left: does it still find the same?

use super::in_child::{self, Answer};
use super::schedule::applies;
use super::specimen::{Specimen, create_form, hypotheses};
use super::verdict::Outcome;
use super::{Arguments, Check, Subject, Verdict, checks, failed, routine};
use crate::replay::parameters;
use crate::scratch::Scratch;
use crate::{Error, internal};
use law::Opener;
use law::capsule::Capsule;
use std::path::Path;

/// Seconds that it may take.
const PATIENCE: f64 = 60.0;

/// Asks the check that has left this capsule, if it was one, of its increment: in a separate process or,
/// without isolation, in this one.
///
/// # Errors
/// The check fails once more: [`law::Error::Library`].
pub(crate) fn ask(
    file: &Path,
    capsule: &Capsule,
    (library, opener): (&Path, &Opener),
    say: &mut dyn FnMut(&str),
) -> Result<(), Error> {
    let Some(check) = check_of(capsule, library) else {
        return Ok(());
    };
    let arguments = Arguments {
        seed: seed_of(capsule),
        time_limit: PATIENCE,
        at: Some(std::path::absolute(file).map_err(internal)?),
        ..Arguments::default()
    };
    let answer = if opener.trust().isolate.is_none() {
        in_child::answer(check, &Subject::new(&arguments, opener, library))
    } else {
        in_child::ask(check, &arguments, library, Scratch::new()?.path(), false)?
    };
    told(check, &answer, capsule, say);
    if answer.outcome.is_bad() {
        let why = format!("check `{}` fails for this increment", check.id);
        return Err(Error::library(why));
    }
    if answer.outcome != Outcome::Warning {
        let whole = Arguments {
            at: None,
            ..arguments
        };
        let command = whole.command_of(check, library);
        say(&format!("the whole check: {command}"));
    }
    Ok(())
}

/// Says what has come of it.
fn told(check: &Check, answer: &Answer, capsule: &Capsule, say: &mut dyn FnMut(&str)) {
    let does = match answer.outcome {
        Outcome::Passed => "finds nothing wrong with this increment alone",
        Outcome::Skipped => "says nothing of this increment alone",
        Outcome::Warning => "warns of this increment",
        Outcome::Failed | Outcome::Crashed => "fails for this increment",
    };
    // Words that were told above are not told again.
    let is_known = answer.details.ends_with(&capsule.outcome.message);
    let details = match answer.outcome {
        Outcome::Passed | Outcome::Skipped => String::new(),
        _ if is_known => ", as recorded".to_owned(),
        _ => format!(": {}", answer.details),
    };
    say(&format!("check `{}` {does}{details}", check.id));
}

/// The check that has left a capsule, if it is one of those for this library.
fn check_of(capsule: &Capsule, library: &Path) -> Option<&'static Check> {
    let id = capsule.origin.get("check")?.as_str()?;
    let is_routine = routine::is_one(library);
    checks().find(|check| check.id == id && applies(id, is_routine))
}

fn seed_of(capsule: &Capsule) -> u64 {
    let seed = capsule.origin.get("seed").and_then(toml::Value::as_str);
    seed.and_then(|seed| seed.parse().ok()).unwrap_or(1)
}

impl Subject {
    /// The law of a capsule with its parameters, to be led along its points.
    pub(super) fn specimen_of(&self, capsule: &Capsule) -> Result<Specimen, Verdict> {
        let unusable = |why: law::Error| failed(format!("the capsule cannot be used: {why}"));
        let laws = self.laws()?;
        let law = laws
            .into_iter()
            .find(|law| law.description().id == capsule.law.id)
            .ok_or_else(|| failed(format!("the library has no law `{}`", capsule.law.id)))?;
        let (formulation, hypothesis) = hypotheses(&law)
            .into_iter()
            .find(|(_, hypothesis)| capsule.hypothesis() == Some(*hypothesis))
            .ok_or_else(|| failed("the law does not offer the hypothesis"))?;
        let values = parameters(capsule, &law).map_err(unusable)?;
        let [points, _] = capsule.batch(hypothesis, &formulation).map_err(unusable)?;
        let created = law.probe(&create_form(&formulation, hypothesis, &values))?;
        let probe = created
            .probe
            .ok_or_else(|| failed("`create` refuses the parameters"))?;
        Ok(Specimen {
            time_increment: capsule.form().time_increment,
            course: Some(points),
            ..Specimen::of(law, (formulation, hypothesis), values, probe)
        })
    }
}
