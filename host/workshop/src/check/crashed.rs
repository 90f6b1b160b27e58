//! The call that a check has crashed in, found once it is over.

use super::Subject;
use crate::Error;
use crate::replay::probed;
use law::capsule::{Capsule, status};
use law::child::{self, Work};
use law::probe::kept::KeptCall;
use std::ffi::OsString;
use std::path::Path;
use std::time::Duration;
use text::write::replace;

/// Points of a batch that are tried one by one.
const ONE_BY_ONE: usize = 128;
/// How long the process takes that reads what was kept.
const READING: Duration = Duration::from_secs(30);

/// Makes the call that was made last a capsule beside its file: what it lacks is the outcome.
///
/// # Errors
/// It cannot be written.
pub(super) fn tell(subject: &Subject, kept: &Path) -> Result<(), Error> {
    match capsule(subject, kept) {
        Some(text) => Ok(replace(&kept.with_extension("toml"), text)?),
        None => Ok(()),
    }
}

fn capsule(subject: &Subject, kept: &Path) -> Option<String> {
    let call = KeptCall::last(kept)?;
    let laws = subject.laws().ok()?;
    let law = laws.iter().find(|law| law.description().id == call.law)?;
    let mut hypotheses = super::specimen::hypotheses(law).into_iter();
    let (formulation, hypothesis) = hypotheses.find(|(_, h)| h.name() == call.hypothesis)?;
    let with = (hypothesis, call.parameters());
    let capsule = Capsule::of_probe(
        law,
        &formulation,
        (with.0, &with.1),
        (call.function, call.form),
        &call.points(),
        &[],
    );
    Some(capsule?.to_string())
}

/// The capsule of the last call, made as small as it can be: of one point that crashes alone, or else of
/// its whole batch. `None` if it does not crash again.
pub(super) fn repeated(tell: Vec<OsString>, kept: &Path, limit: Duration) -> Option<Capsule> {
    let work = Work {
        arguments: tell,
        folder: None,
        time: READING,
        memory: None,
    };
    child::run(&work).ok()?;
    let scratch = &kept.with_extension("toml");
    let whole = Capsule::read(scratch).ok()?;
    let crash = |capsule: &Capsule| {
        capsule.write(scratch).ok()?;
        probed::run(scratch, limit).ok()?.1
    };
    let of_whole = crash(&whole)?;
    let mut singles = (0..whole.n_points().min(ONE_BY_ONE)).map(|i| whole.of_one(i));
    let single = (whole.n_points() > 1)
        .then(|| singles.find_map(|one| Some((crash(&one)?, one))))
        .flatten();
    let (message, mut capsule) = single.unwrap_or((of_whole, whole));
    status(abi::status::Outcome::Internal).clone_into(&mut capsule.outcome.status);
    capsule.outcome.message = message;
    Some(capsule)
}
