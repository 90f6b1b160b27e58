//! Repeating the call of a capsule: what comes out, how far the increment can be followed, and
//! whether the tangent is the derivative of the update.

pub(crate) mod library;
pub(crate) mod probed;

use crate::Error;
use crate::check::recheck;
use abi::status::Outcome;
use law::capsule::{Capsule, LibraryCapsule, OutcomePart, status};
use law::{
    BatchFailure, End, Law, LoadedLaw, Opener, Operator, PointCall, Request, SearchPath, Start,
    Strided, words,
};
use std::fmt::Write as _;
use std::path::Path;
use std::time::{Duration, Instant};
use text::Source;

/// Smallest fraction of the increment that is tried.
const SMALLEST: f64 = 1.0 / (1 << 20) as f64;
/// Bisections between a fraction that succeeds and one that fails.
const BISECTIONS: usize = 40;
/// How long halving may go on: a law may hang at each fraction.
const PATIENCE: Duration = Duration::from_secs(30);
/// Sizes of differences relative to the increment; the better agreement counts.
const DIFFERENCES: [f64; 3] = [1e-3, 1e-5, 1e-7];

/// Fluxes, internal variables, operator.
type Answer = (Vec<f64>, Vec<f64>, Vec<f64>);

/// Repeats the call of a capsule and reports on it.
///
/// # Errors
/// The capsule or its law cannot be used; or, after the report, the call fails as before:
/// [`Error::CallFails`].
pub fn replay(path: &Path, opener: &Opener, say: &mut dyn FnMut(&str)) -> Result<(), Error> {
    let source = Source::read(path)?;
    if let Some(capsule) = LibraryCapsule::of_source(&source)? {
        return library::replay(path, &capsule, opener, say);
    }
    let capsule = Capsule::of_source(source)?;
    if capsule.probe.is_some() {
        return probed::replay(path, &capsule, opener, say);
    }
    let loaded = find(&capsule, opener)?;
    repeat(&capsule, &loaded, say)?;
    // The call succeeds: whether that is what a check has found wrong is for the check to say.
    recheck::ask(path, &capsule, (loaded.library().path(), opener), say)
}

/// Repeats the call with this law.
#[doc(hidden)]
pub fn repeat(
    capsule: &Capsule,
    loaded: &LoadedLaw,
    say: &mut dyn FnMut(&str),
) -> Result<(), Error> {
    let description = loaded.description();
    say(&format!(
        "law `{}` {} of {}, {}",
        description.id,
        description.version,
        loaded.library().path().display(),
        capsule.law.hypothesis
    ));
    if loaded.library().sha256() != capsule.law.sha256 {
        say(&format!(
            "this is another library than that of the capsule: version {}, SHA-256 {}",
            capsule.law.version, capsule.law.sha256
        ));
    }
    say(&from(&capsule.origin));
    let law = build(capsule, loaded)?;
    let outcome = compare(capsule, &law, say);
    law.take_notes().iter().for_each(|note| say(note));
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
fn compare(capsule: &Capsule, law: &Law, say: &mut dyn FnMut(&str)) -> Result<(), Error> {
    let call = capsule.point_call(law)?;
    if call.request == Request::InitialState {
        return match law.initial_state(1, (&call.flux, Strided::rows(call.flux.len()))) {
            Ok(state) => {
                say("the law starts from this state");
                say(&values(law, &[], &state));
                Ok(())
            }
            Err(failure) => outcome(capsule, law, &failure, say),
        };
    }
    let failure = match update(law, &call, call.request, 1.0) {
        Ok((flux, state, _)) => {
            say(&format!(
                "the call succeeds; it is recorded as `{}`: {}",
                capsule.outcome.status, capsule.outcome.message
            ));
            say(&values(law, &flux, &state));
            say(&tangent(law, &call, 1.0));
            return Ok(());
        }
        Err(failure) => failure,
    };
    let outcome = outcome(capsule, law, &failure, say);
    let succeeds = |fraction| update(law, &call, call.request, fraction).is_ok();
    if let Some(fraction) = bisect(succeeds, say) {
        say(&tangent(law, &call, fraction));
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
    let ids = loaded.description().parameters.iter();
    let ids = ids.map(|p| p.id.as_str());
    let parameters = capsule.in_order(&capsule.parameters, ids, &["parameters"], "parameter")?;
    loaded.build(hypothesis, &parameters).map_err(|failure| {
        Error::library(format!(
            "law `{}` refuses its parameters: {}",
            capsule.law.id, failure.reason
        ))
    })
}

/// The call, over a fraction of the increment.
fn update(
    law: &Law,
    call: &PointCall,
    request: Request,
    fraction: f64,
) -> Result<Answer, BatchFailure> {
    let gradient_end = if fraction < 1.0 {
        let ends = call.gradient.iter().zip(&call.gradient_end);
        ends.map(|(start, end)| start + fraction * (end - start))
            .collect()
    } else {
        call.gradient_end.clone()
    };
    // The time as it was recorded, bit for bit, for the whole increment.
    let time_increment = fraction * call.time_increment;
    update_to(law, call, request, &gradient_end, time_increment)
}

fn update_to(
    law: &Law,
    call: &PointCall,
    request: Request,
    gradient_end: &[f64],
    time_increment: f64,
) -> Result<Answer, BatchFailure> {
    let n = law.n_components();
    let rows = Strided::rows(n);
    let operator = match request {
        Request::Update(operator) => operator,
        Request::InitialState => Operator::None,
    };
    let (mut flux, mut state) = (vec![0.0; n], vec![0.0; law.n_states()]);
    let mut matrix = vec![0.0; n * n];
    let start = Start {
        n_points: 1,
        gradient: (&call.gradient, rows),
        gradient_end: (gradient_end, rows),
        flux: (&call.flux, rows),
        state: &call.state,
        time: call.time,
        time_increment,
        moment: call.moment,
        sites: &[call.site],
    };
    let end = End {
        flux: (&mut flux, rows),
        state: &mut state,
        operator: &mut matrix,
    };
    law.integrate(&start, operator, end)?;
    Ok((flux, state, matrix))
}

/// Says what came out and whether it is what was recorded; the error that it stands for.
fn outcome(
    capsule: &Capsule,
    law: &Law,
    failure: &BatchFailure,
    say: &mut dyn FnMut(&str),
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
        say(&format!("as recorded: {}", words(&found)));
    } else {
        say(&format!("outcome   {}", words(&found)));
        say(&format!("recorded  {}", words(&capsule.outcome)));
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
fn bisect(succeeds: impl Fn(f64) -> bool, say: &mut dyn FnMut(&str)) -> Option<f64> {
    let started = Instant::now();
    let mut good = 0.5;
    let mut bad = 1.0;
    while !succeeds(good) {
        bad = good;
        good *= 0.5;
        if good < SMALLEST || started.elapsed() > PATIENCE {
            say(&format!(
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
    say(&format!(
        "a fraction {good:.12} of the increment succeeds, {bad:.12} fails"
    ));
    Some(good)
}

/// Compares the tangent with central differences of the fluxes, in words.
fn tangent(law: &Law, call: &PointCall, fraction: f64) -> String {
    let consistent = Request::Update(Operator::Consistent);
    let n = law.n_components();
    let matrix = match update(law, call, consistent, fraction) {
        Ok((_, _, matrix)) => matrix,
        Err(failure) => return format!("no tangent to compare: {}", failure.message),
    };
    let largest = matrix.iter().fold(0.0_f64, |max, v| max.max(v.abs()));
    let ends = call.gradient.iter().zip(&call.gradient_end);
    let end: Vec<f64> = ends
        .clone()
        .map(|(start, end)| start + fraction * (end - start))
        .collect();
    let reach = ends.fold(0.0_f64, |max, (start, end)| {
        max.max((fraction * (end - start)).abs())
    });
    let reach = if reach > 0.0 { reach } else { 1e-6 };
    let mut worst: Option<(f64, usize, usize)> = None;
    for j in 0..n {
        let column = DIFFERENCES
            .iter()
            .filter_map(|size| {
                let h = size * reach;
                let side = |sign: f64| {
                    let mut moved = end.clone();
                    moved[j] += sign * h;
                    let time_increment = fraction * call.time_increment;
                    let request = Request::Update(Operator::None);
                    update_to(law, call, request, &moved, time_increment)
                };
                let (plus, minus) = (side(1.0).ok()?.0, side(-1.0).ok()?.0);
                let difference = |i: usize| {
                    let slope = (plus[i] - minus[i]) / (2.0 * h);
                    (slope - matrix[i * n + j]).abs()
                };
                (0..n)
                    .map(|i| (difference(i), i))
                    .max_by(|a, b| a.0.total_cmp(&b.0))
            })
            .min_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((difference, i)) = column
            && worst.is_none_or(|(worst, ..)| difference > worst)
        {
            worst = Some((difference, i, j));
        }
    }
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
