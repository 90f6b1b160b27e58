//! Does a result depend on what came first in its process, or on what the process was told of its surroundings?
//! Calls are made once more in a process that does nothing else.

use super::draw::Draw;
use super::in_child::answered;
use super::points::{UPDATE, fluxes, is_finite, is_success, with_fluxes};
use super::random::Random;
use super::specimen::{BOTH, Specimen, asked, create_form, name};
use super::{Found, Subject, Verdict, failed, refusal_in, skipped};
use crate::replay::{Called, shown};
use crate::scratch::Scratch;
use crate::{Error, internal};
use law::child::{self, Work};
use law::probe::PointStart;
use law::probe::call_log::{Function, KeptCall};
use std::path::Path;
use std::time::Duration;
use text::file;
use text::write::replace;

/// Points of a law that are called for in another process.
const N: usize = 12;
/// How long that process may take.
const PATIENCE: Duration = Duration::from_secs(20);
/// Environment variables, with other values than usual.
const VARIABLES: [(&str, &str); 6] = [
    ("HOME", "/nonexistent/home"),
    ("LANG", "tr_TR.UTF-8"),
    ("LC_ALL", "tr_TR.UTF-8"),
    ("TZ", "Pacific/Kiritimati"),
    ("USER", "somebody"),
    ("LOGNAME", "somebody"),
];

/// Results of the points of a call, in words to the last bit; or why there are none.
type Results = Result<Vec<String>, String>;

/// A function of a law, some points that it succeeds at, and what it makes of them in this process.
struct Here<'a> {
    specimen: &'a Specimen,
    function: Function,
    starts: Vec<PointStart>,
    ends: Vec<String>,
}

/// Another result in another process: the call, its point, and the results here and there.
struct Difference<'a> {
    of: &'a Here<'a>,
    point: usize,
    there: String,
}

impl<'a> Here<'a> {
    /// The functions that the law has, at the points at which they succeed.
    fn of(specimen: &'a Specimen, starts: &[PointStart]) -> Result<Vec<Self>, Verdict> {
        let mut all = Vec::new();
        for function in BOTH {
            let ends = specimen.ask(function, starts, &specimen.form(UPDATE))?;
            let pairs = starts.iter().zip(&ends);
            let (starts, ends): (Vec<_>, Vec<_>) = pairs
                .filter(|(_, end)| is_success(end.status) && is_finite(end))
                .map(|(start, end)| (start.clone(), shown(end)))
                .unzip();
            if !ends.is_empty() {
                all.push(Self {
                    specimen,
                    function,
                    starts,
                    ends,
                });
            }
        }
        Ok(all)
    }

    fn call(&self) -> KeptCall {
        let Self {
            specimen, function, ..
        } = self;
        let of_fluxes = with_fluxes(&fluxes(&self.starts));
        let (request, starts) = match function {
            Function::InitState => (0, &of_fluxes),
            _ => (UPDATE, &self.starts),
        };
        let form = specimen.form(request);
        KeptCall {
            law: specimen.law.description().id.clone(),
            hypothesis: specimen.hypothesis.name().to_owned(),
            function: *function,
            form,
            parameters: specimen.values.clone(),
            points: starts.clone(),
        }
    }
}

impl Difference<'_> {
    /// The failure.
    fn fails(&self, when: &str, kept: &str) -> Verdict {
        let Here {
            specimen,
            function,
            starts,
            ends,
        } = self.of;
        let (start, here, there) = (&starts[self.point], &ends[self.point], &self.there);
        let why = format!(
            "`{}` gives {here}; {when} {there}: {kept}, at {}",
            name(*function),
            specimen.at(start)
        );
        let starts = std::slice::from_ref(start);
        specimen.fails_in(*function, (starts, 0), (&specimen.form(0), &[]), why)
    }
}

/// The first difference in a process that does nothing else, with these variables of its environment.
fn afresh<'a>(
    subject: &Subject,
    all: &'a [Here<'a>],
    variables: &[(&'static str, &'static str)],
) -> Result<Option<Difference<'a>>, Verdict> {
    if all.is_empty() {
        return Ok(None);
    }
    let calls: Vec<KeptCall> = all.iter().map(Here::call).collect();
    let there = results(subject, &calls, variables)
        .map_err(|why| skipped(format!("there is no other process: {why}")))?;
    for (k, of) in all.iter().enumerate() {
        // Where the process ended, it gives no results of any call.
        let there = match &there {
            Ok(there) => there.get(k).cloned(),
            Err(words) => Some(Err(words.clone())),
        };
        let there = match there {
            Some(Ok(there)) if there.len() == of.ends.len() => there,
            Some(Err(words)) => vec![words; of.ends.len()],
            _ => return Err(skipped("what it prints cannot be told from its results")),
        };
        let mut pairs = of.ends.iter().zip(there).enumerate();
        let other = pairs.find(|(_, (here, there))| *here != there);
        if let Some((point, (_, there))) = other {
            return Ok(Some(Difference { of, point, there }));
        }
    }
    Ok(None)
}

/// Results of calls in another process, or how that ended without an answer.
fn results(
    subject: &Subject,
    calls: &[KeptCall],
    variables: &[(&'static str, &'static str)],
) -> Result<Result<Vec<Results>, String>, Error> {
    let scratch = Scratch::new()?;
    let file = scratch.path().join("calls");
    std::fs::write(&file, postcard::to_stdvec(calls).map_err(internal)?).map_err(internal)?;
    let mut arguments = vec!["check".into(), subject.path.clone().into()];
    arguments.extend(["--child".into(), file.clone().into(), "--calls".into()]);
    let outcome = child::run(&Work {
        variables: variables.to_vec(),
        ..Work::new(arguments, PATIENCE)
    })
    .map_err(internal)?;
    let answer = file::read_text(&answered(&file)).ok();
    let answer = answer.and_then(|bytes| postcard::from_bytes(&bytes).ok());
    Ok(answer.ok_or_else(|| Called::Law.ends(outcome.ending)))
}

/// Makes the calls of a file in this process, and writes their results next to it.
///
/// # Errors
/// The calls cannot be read, or the results not written.
pub(super) fn answer(subject: &Subject, file: &Path) -> Result<(), Error> {
    let calls = std::fs::read(file).map_err(internal)?;
    let calls: Vec<KeptCall> = postcard::from_bytes(&calls).map_err(internal)?;
    let results: Vec<Results> = calls
        .iter()
        .map(|call| repeated(subject, call).map_err(|verdict| verdict.why))
        .collect();
    let results = postcard::to_stdvec(&results).map_err(internal)?;
    Ok(replace(&answered(file), results)?)
}

/// Makes a call with a new instance.
fn repeated(subject: &Subject, call: &KeptCall) -> Result<Vec<String>, Verdict> {
    let offered = subject.law_of(call)?;
    let (law, formulation, hypothesis) = offered.ok_or_else(|| failed("there is no such law"))?;
    let created = law.probe(&create_form(&formulation, hypothesis, &call.parameters))?;
    let Some(probe) = &created.probe else {
        let why = refusal_in(created.status, &created.message);
        return Err(failed(format!("`create` refuses: {why}")));
    };
    let ends = asked(probe, call.function, &call.points, &call.form)?;
    let words = ends.iter().map(|end| {
        if is_success(end.status) {
            shown(end)
        } else {
            format!("outcome {}", super::status_name(end.status))
        }
    });
    Ok(words.collect())
}

pub(super) fn independent_of_first_instance(subject: &Subject) -> Found {
    let mut random = Random::new(subject.seed, "first instance");
    let specimens = subject.specimens(Draw::Any, 2, &mut random)?;
    if specimens.len() < 2 {
        return Err(skipped(
            "there is one set of parameters, and nothing comes before it",
        ));
    }
    // All of them are called before any is compared.
    let mut all = Vec::new();
    for specimen in &specimens {
        all.push((specimen, specimen.points(N, &mut random)?));
    }
    let mut n = 0;
    for (specimen, starts) in &all[1..] {
        let here = Here::of(specimen, starts)?;
        n += here.iter().map(|here| here.ends.len()).sum::<usize>();
        if let Some(difference) = afresh(subject, &here, &[])? {
            return Err(difference.fails(
                "as the first instance of a process it gives",
                "something is kept of the instance that came first (`static`, `SAVE`)",
            ));
        }
    }
    Ok(format!("{n} points"))
}

pub(super) fn independent_of_environment(subject: &Subject) -> Found {
    let mut random = Random::new(subject.seed, "environment");
    let specimens = subject.specimens(Draw::Any, 1, &mut random)?;
    let mut here = Vec::new();
    for specimen in &specimens {
        here.extend(Here::of(specimen, &specimen.points(N, &mut random)?)?);
    }
    if let Some(difference) = afresh(subject, &here, &VARIABLES)? {
        let mut names = Vec::new();
        for one in VARIABLES {
            if afresh(subject, std::slice::from_ref(difference.of), &[one])?.is_some() {
                names.push(one.0);
            }
        }
        if names.is_empty() {
            names = VARIABLES.map(|(name, _)| name).to_vec();
        }
        let when = format!("with another {} it gives", names.join(", "));
        return Err(difference.fails(&when, "a variable of the environment is read"));
    }
    let n: usize = here.iter().map(|here| here.ends.len()).sum();
    Ok(format!("{n} points"))
}
