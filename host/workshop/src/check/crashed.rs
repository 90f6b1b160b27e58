//! Place of the crash of a check, found after it: a call, or a phase of the library.

use super::Subject;
use crate::Error;
use crate::replay::Called;
use law::capsule::{Capsule, LibraryCapsule, status};
use law::child::{self, Work};
use law::probe::call_log::{Kept, KeptCall, KeptPhase};
use std::ffi::OsString;
use std::path::Path;
use std::time::Duration;
use text::Source;
use text::write::replace;

/// Points of a batch that are tried one by one.
const ONE_BY_ONE: usize = 128;
/// How long the process takes that reads what was kept.
const READING: Duration = Duration::from_secs(30);

/// Makes what was begun last a capsule next to its file: what it lacks is the outcome.
///
/// # Errors
/// It cannot be written.
pub(super) fn tell(subject: &Subject, kept: &Path) -> Result<(), Error> {
    let capsule = match Kept::last(kept) {
        Some(Kept::Call(call)) => of_call(subject, &call).map(|capsule| capsule.to_string()),
        // Nothing of the library runs here: it may crash in that.
        Some(Kept::Phase(phase)) => of_phase(subject, phase).map(|capsule| capsule.to_string()),
        None => None,
    };
    match capsule {
        Some(text) => Ok(replace(&kept.with_extension("toml"), text)?),
        None => Ok(()),
    }
}

fn of_call(subject: &Subject, call: &KeptCall) -> Option<Capsule> {
    let (law, formulation, hypothesis) = subject.law_of(call).ok()??;
    Capsule::of_probe(
        &law,
        &formulation,
        (hypothesis, &call.parameters),
        (call.function, call.form),
        &call.points,
        &[],
    )
}

fn of_phase(subject: &Subject, phase: KeptPhase) -> Option<LibraryCapsule> {
    let sha256 = law::hexadecimal_sha256(&subject.bytes().ok()?);
    let foreign = subject.foreign();
    Some(LibraryCapsule::new(
        &subject.path,
        sha256,
        phase,
        foreign.as_ref(),
    ))
}

/// The text of a capsule of what was begun last, if that crashes once more by itself. `origin` says where
/// it happened, by key.
pub(super) fn repeated(
    tell: Vec<OsString>,
    kept: &Path,
    limit: Duration,
    origin: [(String, toml::Value); 2],
) -> Option<String> {
    child::run(&Work::new(tell, READING)).ok()?;
    let scratch = &kept.with_extension("toml");
    let source = Source::read(scratch).ok()?;
    let internal = status(abi::status::Outcome::Internal).to_owned();
    if let Some(mut capsule) = LibraryCapsule::of_source(&source).ok()? {
        capsule.outcome.message = Called::Library.elsewhere(scratch, limit).ok()?.crash?;
        capsule.outcome.status = internal;
        capsule.origin.extend(origin);
        return Some(capsule.to_string());
    }
    let (mut capsule, message) = smallest(source, scratch, limit)?;
    capsule.outcome.message = message;
    capsule.outcome.status = internal;
    capsule.origin.extend(origin);
    Some(capsule.to_string())
}

/// The capsule of a call, made as small as it can be, of one point that crashes alone, or else of its
/// whole batch; and how it crashes. `None` if it does not.
fn smallest(source: Source, scratch: &Path, limit: Duration) -> Option<(Capsule, String)> {
    let whole = Capsule::of_source(source).ok()?;
    let crash = |capsule: &Capsule| {
        capsule.write(scratch).ok()?;
        Called::Law.elsewhere(scratch, limit).ok()?.crash
    };
    let of_whole = crash(&whole)?;
    let mut singles = (0..whole.n_points().min(ONE_BY_ONE)).map(|i| whole.of_one(i));
    let single = (whole.n_points() > 1)
        .then(|| singles.find_map(|one| Some((crash(&one)?, one))))
        .flatten();
    let (message, capsule) = single.unwrap_or((of_whole, whole));
    Some((capsule, message))
}
