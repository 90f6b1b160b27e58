//! Phases of a library without calls of a law: loading, handshake, entry, description,
//! `destroy` of null, the end of the process.

use super::{Called, Reached, Report};
use crate::Error;
use abi::Hypothesis;
use law::capsule::LibraryCapsule;
use law::probe::call_log::Phase;
use law::trial::plausible;
use law::{LoadedLaw, Opener, hexadecimal_sha256, probe};
use std::path::Path;
use std::sync::Arc;
use text::file;

/// Does the same once more, in another process or, without isolation, in this one.
pub(super) fn replay(
    path: &Path,
    capsule: &LibraryCapsule,
    opener: &Opener,
    report: &mut Report<'_>,
) -> Result<(), Error> {
    let part = &capsule.library;
    let Some(limit) = opener.trust().isolate else {
        return inside(capsule, report);
    };
    let bytes = file::read_library(&part.path).map_err(|source| text::Error::Unreadable {
        path: part.path.clone(),
        source,
    })?;
    let (library, phase) = (part.path.display(), part.phase.words());
    report.say(&format!("library {library}: {phase}"));
    if hexadecimal_sha256(&bytes) != part.sha256 {
        report.say(&format!(
            "this is another library than that of the capsule: SHA-256 {}",
            part.sha256
        ));
    }
    report.say(&super::from(&capsule.origin));
    let there = Called::Library.elsewhere(path, limit)?;
    there.said.lines().for_each(|line| report.say(line));
    let recorded = &capsule.outcome;
    let Some(crash) = there.crash else {
        report.say(&format!(
            "nothing fails; it is recorded as `{}`: {}",
            recorded.status, recorded.message
        ));
        return Ok(());
    };
    report.compared(recorded, &crash);
    Err(Error::library(format!("library {library} fails: {phase}")))
}

/// Does it in this process: what happens is to happen here.
fn inside(capsule: &LibraryCapsule, report: &mut Report<'_>) -> Result<(), Error> {
    let part = &capsule.library;
    // What is refused in an orderly way has returned.
    let refused = match (part.phase, part.from_file) {
        (Phase::Load, true) => probe::open(&part.path).err(),
        (Phase::Handshake, true) => probe::shake_hands(&part.path).err(),
        (Phase::Entry, true) => probe::enter(&part.path).err(),
        (Phase::Load | Phase::Handshake | Phase::Entry | Phase::Describe, _) => {
            laws(capsule).err().map(|why| why.to_string())
        }
        (Phase::DestroyNull, _) => {
            let laws = laws(capsule)?;
            let id = part.law.as_deref().unwrap_or_default();
            let law = laws.iter().find(|law| law.description().id == id);
            let Some(law) = law else {
                let why = format!("library {} has no law `{id}`", part.path.display());
                return Err(Error::library(why));
            };
            law.destroy_nothing();
            None
        }
        (Phase::Exit, _) => begin(capsule).err().map(|why| why.to_string()),
    };
    report.say(match part.phase {
        Phase::Exit => "the process ends now",
        _ => "it returned",
    });
    if let Some(why) = refused {
        report.say(&format!("it is refused: {why}"));
    }
    report.reached(&Reached::Returned)
}

/// The laws of the library, called in this process.
fn laws(capsule: &LibraryCapsule) -> Result<Vec<LoadedLaw>, Error> {
    let opener = Opener::default();
    let library = match capsule.library.foreign() {
        Some(foreign) => opener.open_foreign(&foreign, |_| Ok(()))?,
        None => opener.open(&capsule.library.path)?,
    };
    let ids = library.laws().map(|law| law.id.clone());
    let laws = ids.filter_map(|id| Arc::clone(&library).law(&id));
    Ok(laws.collect())
}

/// Opens the library and builds its laws, so that there is something to be ended.
fn begin(capsule: &LibraryCapsule) -> Result<(), Error> {
    for law in laws(capsule)? {
        let parameters = law.description().parameters.iter();
        let parameters: Vec<f64> = parameters.map(plausible).collect();
        for hypothesis in Hypothesis::ALL {
            // Whether the law agrees with them is no matter here.
            let _ = law.build(hypothesis, &parameters);
        }
    }
    Ok(())
}
