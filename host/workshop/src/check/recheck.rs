//! A check once more, of the one increment of a capsule that it has left: does it still find the same?

use super::specimen::{Specimen, create_form, hypotheses};
use super::{
    Answer, Arguments, Check, Outcome, ScratchFolder, Subject, Verdict, applies, asked_in_child,
    checks, failed, own_arguments, routine, run_check,
};
use crate::Error;
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
        library: Some(library.display().to_string()),
        json: false,
        only: vec![check.id.to_owned()],
        seed: seed_of(capsule),
        set: Vec::new(),
        driver: None,
        out: None,
        only_failed: false,
        strict: false,
        time_limit: PATIENCE,
        list: false,
        in_process: opener.trust().isolate.is_none(),
        child: false,
        near: false,
        at: Some(std::path::absolute(file).map_err(|why| Error::internal(why.to_string()))?),
        kept: None,
        tell: None,
    };
    let answer = if arguments.in_process {
        run_check(check, &Subject::new(&arguments, opener, library))
    } else {
        asked_in_child(check, &arguments, library, &ScratchFolder::new()?, false)?
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
        let own = own_arguments(check, &whole);
        let own: Vec<_> = own.iter().map(|a| a.to_string_lossy()).collect();
        say(&format!(
            "the whole check: pilum check {} {}",
            library.display(),
            own.join(" ")
        ));
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
        let parameters = law.description().parameters.iter();
        let ids = parameters.map(|p| p.id.as_str());
        let values = capsule
            .in_order(&capsule.parameters, ids, &["parameters"], "parameter")
            .map_err(unusable)?;
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
