//! Phases of a library without calls of a law: loading, handshake, entry, description,
//! `destroy` of null, the end of the process.

use super::probed::refusal_of;
use crate::Error;
use abi::Hypothesis;
use law::capsule::LibraryCapsule;
use law::child::{self, Ending, Work};
use law::probe::call_log::Phase;
use law::trial::plausible;
use law::{LoadedLaw, Opener, Trust, hexadecimal_sha256, probe};
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;
use text::file;

/// Message about a library that exceeds its time limit.
const STUCK: &str = "the library does not return";
/// Message as soon as the library has returned; for the end of the process, before that.
const RETURNED: &str = "it returned";
const ENDS: &str = "the process ends now";

/// Does the same once more, in another process or, without isolation, in this one.
pub(super) fn replay(
    path: &Path,
    capsule: &LibraryCapsule,
    opener: &Opener,
    say: &mut dyn FnMut(&str),
) -> Result<(), Error> {
    let part = &capsule.library;
    let Some(limit) = opener.trust().isolate else {
        return inside(capsule, say);
    };
    let bytes = file::read_library(&part.path).map_err(|source| text::Error::Unreadable {
        path: part.path.clone(),
        source,
    })?;
    say(&format!(
        "library {}: {}",
        part.path.display(),
        part.phase.words()
    ));
    if hexadecimal_sha256(&bytes) != part.sha256 {
        say(&format!(
            "this is another library than that of the capsule: SHA-256 {}",
            part.sha256
        ));
    }
    say(&super::from(&capsule.origin));
    let (said, crash) = run(path, limit)?;
    said.lines().for_each(&mut *say);
    let recorded = &capsule.outcome;
    let Some(crash) = crash else {
        say(&format!(
            "nothing fails; it is recorded as `{}`: {}",
            recorded.status, recorded.message
        ));
        return Ok(());
    };
    if crash == recorded.message {
        say(&format!("as recorded: `{}`: {crash}", recorded.status));
    } else {
        say(&format!("outcome   `internal`: {crash}"));
        say(&format!(
            "recorded  `{}`: {}",
            recorded.status, recorded.message
        ));
    }
    Err(Error::library(format!(
        "library {} fails: {}",
        part.path.display(),
        part.phase.words()
    )))
}

/// Does what a capsule says in a separate process: what was said, and how the process ended if the
/// library ended it.
///
/// # Errors
/// There is no process, or the capsule cannot be used.
pub(crate) fn run(path: &Path, limit: Duration) -> Result<(String, Option<String>), Error> {
    let work = Work {
        arguments: vec!["replay".into(), path.into(), "--in-process".into()],
        folder: None,
        variables: Vec::new(),
        time: limit,
        memory: None,
    };
    let outcome = child::run(&work).map_err(|why| Error::internal(why.to_string()))?;
    let said = String::from_utf8_lossy(&outcome.stdout).into_owned();
    let has_returned = said.lines().any(|line| line == RETURNED || line == ENDS);
    let crash = match outcome.ending {
        Ending::TimedOut => Some(STUCK.to_owned()),
        Ending::Signal(_) => Some(format!("the library crashed: {}", outcome.ending)),
        Ending::Exited(0) if has_returned => None,
        Ending::Exited(_) => {
            // The program says why it could not come as far as that.
            if let (false, Some(why)) = (has_returned, refusal_of(&outcome)) {
                return Err(Error::usage(why));
            }
            Some(format!("the library ended its process: {}", outcome.ending))
        }
    };
    Ok((said, crash))
}

/// Does it in this process: what happens is to happen here.
fn inside(capsule: &LibraryCapsule, say: &mut dyn FnMut(&str)) -> Result<(), Error> {
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
    let is_end = part.phase == Phase::Exit;
    say(if is_end { ENDS } else { RETURNED });
    if let Some(why) = refused {
        say(&format!("it is refused: {why}"));
    }
    Ok(())
}

/// The laws of the library, called in this process.
fn laws(capsule: &LibraryCapsule) -> Result<Vec<LoadedLaw>, Error> {
    let opener = Opener::new(Trust {
        probe: false,
        isolate: None,
    });
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
