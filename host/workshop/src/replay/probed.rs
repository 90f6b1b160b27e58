//! Calls as `pilum check` has made them: in a separate process, where they may crash again, or in
//! this one, for a debugger.

use super::{Called, Reached, Report};
use crate::check::points::{first_difference, is_success};
use crate::check::specimen::create_form;
use crate::check::{refusal, refusal_in};
use crate::scratch::Scratch;
use crate::{Error, internal};
use abi::Hypothesis;
use law::capsule::Capsule;
use law::probe::call_log::Function;
use law::probe::{Answer, Form, PointEnd, PointStart, Probe};
use law::{FormulationDescription, LoadedLaw, Opener};
use std::path::Path;
use std::time::Duration;

/// Repeats the call of a capsule of a check.
pub(super) fn replay(
    path: &Path,
    capsule: &Capsule,
    opener: &Opener,
    report: &mut Report<'_>,
) -> Result<(), Error> {
    let Some(limit) = opener.trust().isolate else {
        // Nothing is tried in a child first: what happens is to happen here.
        return inside(capsule, &super::find(capsule, &Opener::default())?, report);
    };
    let law = &capsule.law;
    report.say(&format!(
        "law `{}` {} of {}, {}",
        law.id,
        law.version,
        law.library.display(),
        law.hypothesis
    ));
    report.say(&super::from(&capsule.origin));
    outside(path, capsule, limit, report)
}

/// The error of a call that fails.
fn fails(capsule: &Capsule, outcome: &'static str) -> Error {
    Error::CallFails {
        law: capsule.law.id.clone(),
        outcome,
        cannot_follow: false,
    }
}

/// Repeats the call in another process.
fn outside(
    path: &Path,
    capsule: &Capsule,
    limit: Duration,
    report: &mut Report<'_>,
) -> Result<(), Error> {
    let there = Called::Law.elsewhere(path, limit)?;
    there.said.lines().for_each(|line| report.say(line));
    let Some(crash) = there.crash else {
        return if there.is_faultless {
            Ok(())
        } else {
            Err(fails(capsule, "internal"))
        };
    };
    report.compared(&capsule.outcome, &crash);
    let is_update = capsule
        .probe
        .is_some_and(|p| p.function == Function::Integrate);
    if is_update && capsule.n_points() == 1 && !there.is_stuck {
        let scratch = Scratch::new()?;
        let shorter = scratch.path().join("shorter.toml");
        let succeeds = |fraction| {
            capsule.shortened(fraction).write(&shorter).is_ok()
                && Called::Law
                    .elsewhere(&shorter, limit)
                    .is_ok_and(|there| there.crash.is_none())
        };
        super::bisect(succeeds, report);
    }
    Err(fails(capsule, "internal"))
}

/// Message as soon as the law has returned.
const RETURNED: &str = "the call returned";
/// Message if nothing is wrong.
const FAULTLESS: &str = "the call succeeds";
/// Most points of a batch whose results are shown.
const SHOWN: usize = 16;

/// The results of a point, to the last bit.
pub(crate) fn shown(end: &PointEnd) -> String {
    format!("flux {:?}, internal variables {:?}", end.flux, end.state)
}

impl Report<'_> {
    fn returns(&mut self) -> Result<(), Error> {
        self.say(RETURNED);
        self.reached(&Reached::Returned)
    }

    fn finds_no_fault(&mut self) -> Result<(), Error> {
        self.say(FAULTLESS);
        self.reached(&Reached::Faultless)
    }
}

fn formulation<'a>(
    capsule: &Capsule,
    loaded: &'a LoadedLaw,
) -> Result<(Hypothesis, &'a FormulationDescription), Error> {
    let wrong = |message: String| Error::from(capsule.error(&["law", "hypothesis"], message));
    let hypothesis = capsule.hypothesis().ok_or_else(|| {
        let name = &capsule.law.hypothesis;
        wrong(format!("there is no hypothesis `{name}`"))
    })?;
    let formulation = loaded.description().formulation(hypothesis);
    let formulation =
        formulation.ok_or_else(|| wrong(format!("law `{}` does not offer it", capsule.law.id)))?;
    Ok((hypothesis, formulation))
}

/// A failure of the call, or a fault of the law that further calls show.
fn found(
    first: &Answer,
    formulation: &FormulationDescription,
    [points, before]: [&[PointStart]; 2],
    call: impl FnMut(&[PointStart]) -> Result<Vec<PointEnd>, Error>,
) -> Result<Option<String>, Error> {
    if first.points.iter().any(|end| !is_success(end.status)) {
        let why = refusal(first.status, first.text().as_deref());
        return Ok(Some(format!("outcome   {why}")));
    }
    let variables = formulation.internal_variables.iter();
    let ids: Vec<&str> = variables.map(|v| v.id.as_str()).collect();
    fault(&first.points, &ids, [points, before], call)
}

/// Ends an instance after the call that came before.
fn destroyed(probe: Probe, points: &[PointStart], form: &Form) -> Result<(), Error> {
    let is_of_start = points.iter().all(|point| point.gradient1.is_empty());
    let before = if is_of_start {
        Function::InitState
    } else {
        Function::Integrate
    };
    if !points.is_empty() {
        called(&probe, before, points, form)?;
    }
    drop(probe);
    Ok(())
}

/// Repeats the call in this process, once more, and in other ways that must not matter.
fn inside(capsule: &Capsule, loaded: &LoadedLaw, report: &mut Report<'_>) -> Result<(), Error> {
    let (hypothesis, formulation) = formulation(capsule, loaded)?;
    let values = super::parameters(capsule, loaded)?;
    let [points, before] = capsule.batch(hypothesis, formulation)?;
    let created = loaded
        .probe(&create_form(formulation, hypothesis, &values))
        .map_err(internal)?;
    let function = capsule
        .probe
        .map_or(Function::Integrate, |probe| probe.function);
    if function == Function::Create {
        report.returns()?;
    }
    let Some(probe) = created.probe else {
        let why = refusal_in(created.status, &created.message);
        report.say(&format!("`create` refuses: {why}"));
        report.reached(&Reached::Returned)?;
        return Err(fails(capsule, "parameter"));
    };
    let form = capsule.form();
    match function {
        Function::Create => report.finds_no_fault(),
        Function::Destroy => {
            destroyed(probe, &points, &form)?;
            report.returns()?;
            report.finds_no_fault()
        }
        Function::InitState | Function::Integrate => {
            let call = |points: &[PointStart]| called(&probe, function, points, &form);
            let Some(first) = call(&points)? else {
                let why = format!("law `{}` has no `init_state`", capsule.law.id);
                return Err(Error::library(why));
            };
            report.returns()?;
            let ends = |points: &[PointStart]| {
                Ok(call(points)?.map_or(Vec::new(), |answer| answer.points))
            };
            if let Some(found) = found(&first, formulation, [&points, &before], ends)? {
                report.say(&found);
                return Err(fails(capsule, "internal"));
            }
            report.finds_no_fault()?;
            for end in first.points.iter().take(SHOWN) {
                report.say(&shown(end));
            }
            Ok(())
        }
    }
}

/// Fault of the results of points: values that are not written, or other results after other points, alone, or in
/// reverse order. The ids are those of the internal variables.
fn fault(
    first: &[PointEnd],
    ids: &[&str],
    [points, before]: [&[PointStart]; 2],
    mut call: impl FnMut(&[PointStart]) -> Result<Vec<PointEnd>, Error>,
) -> Result<Option<String>, Error> {
    let unwritten = first.iter().enumerate().find_map(|(i, end)| {
        let k = end.state.iter().position(|value| !value.is_finite())?;
        let id = ids[k];
        Some(format!("point {i}: `{id}` is not written, or not finite"))
    });
    let differs = |found: &[PointEnd], when: &str| {
        let i = first_difference(first, found)?;
        let found = found.get(i).map_or(String::new(), shown);
        Some(format!("point {i}: {}; {when}: {found}", shown(&first[i])))
    };
    if !before.is_empty() {
        call(before)?;
    }
    let again = call(points)?;
    let mut alone = Vec::new();
    for point in points {
        alone.extend(call(std::slice::from_ref(point))?);
    }
    let reversed: Vec<PointStart> = points.iter().rev().cloned().collect();
    let mut back = call(&reversed)?;
    back.reverse();
    let when = if before.is_empty() {
        "called again"
    } else {
        "after another call"
    };
    Ok(unwritten
        .or_else(|| differs(&again, when))
        .or_else(|| differs(&alone, "alone"))
        .or_else(|| differs(&back, "in reverse order")))
}

/// What the function makes of the points; nothing if the law lacks it.
fn called(
    probe: &Probe,
    function: Function,
    points: &[PointStart],
    form: &Form,
) -> Result<Option<Answer>, Error> {
    match function {
        Function::InitState => {
            let fluxes = crate::check::points::fluxes(points);
            probe.init_state(&fluxes, form).map_err(internal)
        }
        _ => probe.integrate(points, form).map(Some).map_err(internal),
    }
}
