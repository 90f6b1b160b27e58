//! Repeating the call of a capsule: what comes out, how far the increment can be followed, and
//! whether the tangent is the derivative of the update.

mod library;
mod probed;

pub(crate) use probed::shown;

use crate::check::recheck;
use crate::scratch::Scratch;
use crate::{Error, internal};
use abi::status::Outcome;
use law::capsule::{Capsule, LibraryCapsule, OutcomePart, status};
use law::child::{self, Ending, Work};
use law::{
    BatchFailure, Law, LoadedLaw, Opener, Operator, PointCall, Request, SearchPath, Start, Strided,
    Updated, words,
};
use serde::{Deserialize, Serialize};
use std::fmt::Write as _;
use std::path::Path;
use std::time::{Duration, Instant};
use text::write::replace;
use text::{Source, file};

/// Smallest fraction of the increment that is tried.
const SMALLEST: f64 = 1.0 / (1 << 20) as f64;
/// Bisections between a fraction that succeeds and one that fails.
const BISECTIONS: usize = 40;
/// How long halving may go on: a law may hang at each fraction.
const PATIENCE: Duration = Duration::from_secs(30);
/// Sizes of differences relative to the increment; the better agreement counts.
const DIFFERENCES: [f64; 3] = [1e-3, 1e-5, 1e-7];

/// How far a process has come that repeats a capsule, for the one that has started it.
#[derive(Debug, Serialize, Deserialize)]
enum Reached {
    /// The program has refused to do so, in its words.
    Refused(String),
    /// The law or the library has done its part.
    Returned,
    /// It has, and nothing is wrong.
    Faultless,
}

/// Report of a replay: words for people, and a file for the process that has started it.
struct Report<'a> {
    say: &'a mut dyn FnMut(&str),
    file: Option<&'a Path>,
    has_returned: bool,
}

impl<'a> Report<'a> {
    fn new(say: &'a mut dyn FnMut(&str), file: Option<&'a Path>) -> Self {
        Self {
            say,
            file,
            has_returned: false,
        }
    }

    fn say(&mut self, words: &str) {
        (self.say)(words);
    }

    fn reached(&mut self, what: &Reached) -> Result<(), Error> {
        self.has_returned = true;
        if let Some(file) = self.file {
            replace(file, serde_json::to_string(what).map_err(internal)?)?;
        }
        Ok(())
    }

    /// Says how it crashed, and what is recorded if that is something else.
    fn compared(&mut self, recorded: &OutcomePart, crash: &str) {
        if crash == recorded.message {
            self.say(&format!("as recorded: `internal`: {crash}"));
        } else {
            self.say(&format!("outcome   `internal`: {crash}"));
            let OutcomePart {
                status, message, ..
            } = recorded;
            self.say(&format!("recorded  `{status}`: {message}"));
        }
    }
}

/// Whether a law or all of a library is called.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Called {
    Law,
    Library,
}

/// Outcome of a process that repeats a capsule.
pub(crate) struct There {
    /// Its output.
    said: String,
    is_faultless: bool,
    is_stuck: bool,
    /// How the law or the library has ended it, if it has.
    pub(crate) crash: Option<String>,
}

impl Called {
    /// How it has ended its process, in words.
    pub(crate) fn ends(self, ending: Ending) -> String {
        let what = match self {
            Self::Law => "the law",
            Self::Library => "the library",
        };
        match ending {
            Ending::TimedOut => format!("{what} does not return"),
            Ending::Signal(_) => format!("{what} crashed: {ending}"),
            Ending::Exited(_) => format!("{what} ended its process: {ending}"),
        }
    }

    /// Does what a capsule says in another process.
    ///
    /// # Errors
    /// There is no process, or the capsule cannot be used.
    pub(crate) fn elsewhere(self, capsule: &Path, limit: Duration) -> Result<There, Error> {
        let scratch = Scratch::new()?;
        let reached = scratch.path().join("reached");
        let mut arguments = vec!["replay".into(), capsule.into(), "--in-process".into()];
        arguments.extend(["--reached".into(), reached.clone().into()]);
        let outcome = child::run(&Work::new(arguments, limit)).map_err(internal)?;
        let reached = file::read_text(&reached).ok();
        let reached: Option<Reached> = reached.and_then(|text| serde_json::from_slice(&text).ok());
        let has_returned = match (&reached, outcome.ending) {
            (Some(Reached::Refused(why)), Ending::Exited(_)) => return Err(Error::usage(why)),
            (Some(Reached::Returned | Reached::Faultless), Ending::Exited(code)) => {
                // A law that fails is an error; a library may end the process when all is done.
                self == Self::Law || code == 0
            }
            _ => false,
        };
        Ok(There {
            said: String::from_utf8_lossy(&outcome.stdout).into_owned(),
            is_faultless: matches!(reached, Some(Reached::Faultless)),
            is_stuck: outcome.ending == Ending::TimedOut,
            crash: (!has_returned).then(|| self.ends(outcome.ending)),
        })
    }
}

/// Repeats the call of a capsule and reports on it; in a file, too, how far that has come.
///
/// # Errors
/// The capsule or its law cannot be used; or, after the report, the call fails as before:
/// [`Error::CallFails`].
pub fn replay(
    path: &Path,
    opener: &Opener,
    reached: Option<&Path>,
    say: &mut dyn FnMut(&str),
) -> Result<(), Error> {
    let mut report = Report::new(say, reached);
    let done = replayed(path, opener, &mut report);
    if let Err(why) = &done
        && !report.has_returned
    {
        let why = why.shown(false);
        let why = why.trim_start_matches("error: ").trim().to_owned();
        report.reached(&Reached::Refused(why))?;
    }
    done
}

fn replayed(path: &Path, opener: &Opener, report: &mut Report<'_>) -> Result<(), Error> {
    let source = Source::read(path)?;
    if let Some(capsule) = LibraryCapsule::of_source(&source)? {
        return library::replay(path, &capsule, opener, report);
    }
    let capsule = Capsule::of_source(source)?;
    if capsule.probe.is_some() {
        return probed::replay(path, &capsule, opener, report);
    }
    let loaded = find(&capsule, opener)?;
    repeated(&capsule, &loaded, report)?;
    // The call succeeds: whether that is what a check has found wrong is for the check to say.
    recheck::ask(
        path,
        &capsule,
        (loaded.library().path(), opener),
        report.say,
    )
}

/// Repeats the call with this law.
#[doc(hidden)]
pub fn repeat(
    capsule: &Capsule,
    loaded: &LoadedLaw,
    say: &mut dyn FnMut(&str),
) -> Result<(), Error> {
    repeated(capsule, loaded, &mut Report::new(say, None))
}

fn repeated(capsule: &Capsule, loaded: &LoadedLaw, report: &mut Report<'_>) -> Result<(), Error> {
    let description = loaded.description();
    report.say(&format!(
        "law `{}` {} of {}, {}",
        description.id,
        description.version,
        loaded.library().path().display(),
        capsule.law.hypothesis
    ));
    if loaded.library().sha256() != capsule.law.sha256 {
        report.say(&format!(
            "this is another library than that of the capsule: version {}, SHA-256 {}",
            capsule.law.version, capsule.law.sha256
        ));
    }
    report.say(&from(&capsule.origin));
    let law = build(capsule, loaded)?;
    let outcome = compare(capsule, &law, report);
    law.take_notes().iter().for_each(|note| report.say(note));
    outcome
}

/// Origin of a capsule, in words.
fn from<'a>(origin: impl IntoIterator<Item = (&'a String, &'a toml::Value)>) -> String {
    let origin = origin.into_iter().map(|(key, value)| match value {
        toml::Value::String(text) => format!("{key} {text}"),
        other => format!("{key} {other}"),
    });
    format!("from {}", origin.collect::<Vec<_>>().join(", "))
}

/// Repeats the call and says what came out.
fn compare(capsule: &Capsule, law: &Law, report: &mut Report<'_>) -> Result<(), Error> {
    let call = capsule.point_call(law)?;
    let Request::Update(operator) = call.request else {
        let state = law.initial_state(1, call.as_start().flux);
        report.reached(&Reached::Returned)?;
        return match state {
            Ok(state) => {
                report.say("the law starts from this state");
                report.say(&values(law, &[], &state));
                Ok(())
            }
            Err(failure) => outcome(capsule, law, &failure, report),
        };
    };
    let updated = update(law, &call, operator, 1.0);
    report.reached(&Reached::Returned)?;
    let failure = match updated {
        Ok((flux, state, _)) => {
            report.say(&format!(
                "the call succeeds; it is recorded as `{}`: {}",
                capsule.outcome.status, capsule.outcome.message
            ));
            report.say(&values(law, &flux, &state));
            report.say(&tangent(law, &call, 1.0));
            return Ok(());
        }
        Err(failure) => failure,
    };
    let outcome = outcome(capsule, law, &failure, report);
    let succeeds = |fraction| update(law, &call, operator, fraction).is_ok();
    if let Some(fraction) = bisect(succeeds, report) {
        report.say(&tangent(law, &call, fraction));
    }
    outcome
}

/// The law, in its zone if it fills one.
fn find(capsule: &Capsule, opener: &Opener) -> Result<LoadedLaw, Error> {
    let law = find_own(capsule, opener)?;
    let Some(zone) = capsule.law.shear_zone else {
        return Ok(law);
    };
    law.in_shear_zone(zone)
        .map_err(|why| capsule.error(&["law", "shear_zone"], why).into())
}

/// The law, from the capsule's library if that is still there.
fn find_own(capsule: &Capsule, opener: &Opener) -> Result<LoadedLaw, Error> {
    let search = SearchPath::of(opener, &[]);
    let part = &capsule.law;
    if !part.library.is_file() {
        return Ok(search.law(&part.id)?);
    }
    // `--isolate`, which is the default here, has the last word of where it is called.
    if let Some(foreign) = part.foreign() {
        return Ok(search.foreign_law(&part.id, &foreign)?);
    }
    let library = opener.open(&part.library)?;
    library.law(&part.id).ok_or_else(|| {
        Error::library(format!(
            "library {} has no law `{}`",
            part.library.display(),
            part.id
        ))
    })
}

fn build(capsule: &Capsule, loaded: &LoadedLaw) -> Result<Law, Error> {
    let hypothesis = capsule.hypothesis().ok_or_else(|| {
        let message = format!("there is no hypothesis `{}`", capsule.law.hypothesis);
        capsule.error(&["law", "hypothesis"], message)
    })?;
    let parameters = parameters(capsule, loaded)?;
    loaded.build(hypothesis, &parameters).map_err(|failure| {
        Error::library(format!(
            "law `{}` refuses its parameters: {}",
            capsule.law.id, failure.reason
        ))
    })
}

/// The parameters of a capsule in the order of the law's.
///
/// # Errors
/// One is missing, or unknown to the law.
pub(crate) fn parameters(capsule: &Capsule, law: &LoadedLaw) -> Result<Vec<f64>, law::Error> {
    let parameters = law.description().parameters.iter();
    let ids = parameters.map(|p| p.id.as_str());
    capsule.in_order(&capsule.parameters, ids, &["parameters"], "parameter")
}

/// The call, over a fraction of the increment.
fn update(
    law: &Law,
    call: &PointCall,
    operator: Operator,
    fraction: f64,
) -> Result<Updated, BatchFailure> {
    let gradient_end = if fraction < 1.0 {
        let ends = call.start.gradient0.iter().zip(&call.start.gradient1);
        ends.map(|(start, end)| start + fraction * (end - start))
            .collect()
    } else {
        call.start.gradient1.clone()
    };
    // The time as it was recorded, bit for bit, for the whole increment.
    let start = Start {
        gradient_end: (&gradient_end, Strided::rows(gradient_end.len())),
        time_increment: fraction * call.time_increment,
        ..call.as_start()
    };
    law.update(&start, operator)
}

/// Says what came out and whether it is what was recorded; the error that it stands for.
fn outcome(
    capsule: &Capsule,
    law: &Law,
    failure: &BatchFailure,
    report: &mut Report<'_>,
) -> Result<(), Error> {
    let found = OutcomePart::of(failure);
    let words = |part: &OutcomePart| {
        let factor = part
            .step_factor
            .map_or(String::new(), |factor| format!(", step factor {factor}"));
        format!("`{}`{factor}: {}", part.status, part.message)
    };
    // The message of a batch counts its points.
    let message = |part: &OutcomePart| -> String {
        let text = part.message.as_str();
        let counted = text.strip_prefix("point ").and_then(|rest| {
            let (number, rest) = rest.split_once(": ")?;
            number.bytes().all(|b| b.is_ascii_digit()).then_some(rest)
        });
        counted.unwrap_or(text).to_owned()
    };
    let same = found.status == capsule.outcome.status
        && message(&found) == message(&capsule.outcome)
        && found.step_factor.map(f64::to_bits) == capsule.outcome.step_factor.map(f64::to_bits);
    if same {
        report.say(&format!("as recorded: {}", words(&found)));
    } else {
        report.say(&format!("outcome   {}", words(&found)));
        report.say(&format!("recorded  {}", words(&capsule.outcome)));
    }
    let cannot_follow = !law.breaks_down(failure)
        && matches!(
            failure.outcome,
            Outcome::CutStep | Outcome::Domain | Outcome::Numeric
        );
    Err(Error::CallFails {
        law: law.description().id.clone(),
        outcome: status(failure.outcome),
        cannot_follow,
    })
}

/// The largest fraction of the increment that succeeds, found by halving.
fn bisect(succeeds: impl Fn(f64) -> bool, report: &mut Report<'_>) -> Option<f64> {
    let started = Instant::now();
    let mut good = 0.5;
    let mut bad = 1.0;
    while !succeeds(good) {
        bad = good;
        good *= 0.5;
        if good < SMALLEST || started.elapsed() > PATIENCE {
            report.say(&format!(
                "every fraction of the increment fails that was tried, down to {bad:.1e}"
            ));
            return None;
        }
    }
    for _ in 0..BISECTIONS {
        if started.elapsed() > PATIENCE {
            break;
        }
        let middle = 0.5 * (good + bad);
        if succeeds(middle) {
            good = middle;
        } else {
            bad = middle;
        }
    }
    report.say(&format!(
        "a fraction {good:.12} of the increment succeeds, {bad:.12} fails"
    ));
    Some(good)
}

/// Central differences of the fluxes around the end of a part of an increment.
struct Differences<'a> {
    law: &'a Law,
    call: &'a PointCall,
    fraction: f64,
    end: Vec<f64>,
    /// Largest component of the increment.
    reach: f64,
}

impl<'a> Differences<'a> {
    fn new(law: &'a Law, call: &'a PointCall, fraction: f64) -> Self {
        let ends = call.start.gradient0.iter().zip(&call.start.gradient1);
        let end = ends
            .clone()
            .map(|(start, end)| start + fraction * (end - start));
        let reach = ends.clone().fold(0.0_f64, |max, (start, end)| {
            max.max((fraction * (end - start)).abs())
        });
        Self {
            law,
            call,
            fraction,
            end: end.collect(),
            reach: if reach > 0.0 { reach } else { 1e-6 },
        }
    }

    /// How far a column of a tangent is off those of this size at most, and in which row; `None` where the law fails.
    fn off(&self, matrix: &[f64], column: usize, size: f64) -> Option<(f64, usize)> {
        let n = self.end.len();
        let h = size * self.reach;
        let side = |sign: f64| {
            let mut moved = self.end.clone();
            moved[column] += sign * h;
            let start = Start {
                gradient_end: (&moved, Strided::rows(moved.len())),
                time_increment: self.fraction * self.call.time_increment,
                ..self.call.as_start()
            };
            self.law.update(&start, Operator::None)
        };
        let (plus, minus) = (side(1.0).ok()?.0, side(-1.0).ok()?.0);
        let off = (0..n).map(|i| {
            let slope = (plus[i] - minus[i]) / (2.0 * h);
            ((slope - matrix[i * n + column]).abs(), i)
        });
        off.max_by(|a, b| a.0.total_cmp(&b.0))
    }
}

/// Compares the tangent with central differences of the fluxes, in words.
fn tangent(law: &Law, call: &PointCall, fraction: f64) -> String {
    let n = law.n_components();
    let matrix = match update(law, call, Operator::Consistent, fraction) {
        Ok((_, _, matrix)) => matrix,
        Err(failure) => return format!("no tangent to compare: {}", failure.message),
    };
    let largest = matrix.iter().fold(0.0_f64, |max, v| max.max(v.abs()));
    let differences = Differences::new(law, call, fraction);
    // The best differences of each column.
    let columns = (0..n).filter_map(|j| {
        let sizes = DIFFERENCES
            .iter()
            .filter_map(|size| differences.off(&matrix, j, *size));
        let (off, i) = sizes.min_by(|a, b| a.0.total_cmp(&b.0))?;
        Some((off, i, j))
    });
    let first_of_the_worst = |worst: (f64, usize, usize), other: (f64, usize, usize)| {
        if other.0 > worst.0 { other } else { worst }
    };
    let worst = columns.reduce(first_of_the_worst);
    let names = law.hypothesis().components();
    match worst {
        None => "the tangent cannot be compared: the law fails on both sides".to_owned(),
        Some((difference, i, j)) => format!(
            "tangent at {} of the increment: at most {:.1e} of its largest component off \
             differences of the law's own answers, in ({}, {})",
            if fraction < 1.0 {
                "that fraction"
            } else {
                "the end"
            },
            difference / largest.max(f64::MIN_POSITIVE),
            names[i],
            names[j]
        ),
    }
}

/// Fluxes and internal variables, one a line.
fn values(law: &Law, flux: &[f64], state: &[f64]) -> String {
    let (_, word) = words(law.hypothesis());
    let components = law.hypothesis().components().iter();
    let variables = law.formulation().internal_variables.iter();
    let mut text = String::new();
    for (name, value) in components.zip(flux) {
        let _ = writeln!(text, "  {:<20} {value:?}", format!("{word}_{name}"));
    }
    for (variable, value) in variables.zip(state) {
        let _ = writeln!(text, "  {:<20} {value:?}", variable.id);
    }
    text.truncate(text.trim_end().len());
    text
}
