//! Libraries that are not known yet are tried in a child process first: what crashes, hangs or eats
//! all memory does so there.
//!
//! Libraries that passed are remembered by SHA-256 and program version, so that each is tried once.
//! Others are tried again every time.

use super::{End, Law, LoadedLaw, Moment, Opener, Operator, ParameterDescription, Start, Strided};
use crate::Error;
use crate::child::{self, Ending, Work};
use abi::Hypothesis;
use std::ffi::OsString;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// The hidden command of the child.
pub const COMMAND: &str = "probe-library";
/// How long the child may take.
const TIME: Duration = Duration::from_secs(5);
/// How much address space it may take, in bytes.
const MEMORY: u64 = 4 << 30;
/// In front of what the child says, since libraries may print too.
const MARK: &str = "pilum-probe: ";
/// Its last words where the library did all it was asked for.
const PASSED: &str = "passed";
/// Its last words where the library was refused in an orderly way.
const REFUSED: &str = "refused";
/// Points of a call.
const N_POINTS: usize = 3;

/// Tries a library in a child process, unless that was done. Orderly refusals are left to this
/// process, which finds the same.
///
/// # Errors
/// [`Error::Library`]: what the library did in the child. [`text::Error::Usage`]: there is not the memory for one.
pub(crate) fn vet(path: &Path, sha256: &str) -> Result<(), Error> {
    let verdict = verdict_path(sha256);
    if verdict.as_ref().is_some_and(|file| file.is_file()) {
        return Ok(());
    }
    let work = Work {
        arguments: vec![
            OsString::from(COMMAND),
            path.as_os_str().to_owned(),
            OsString::from(sha256),
        ],
        folder: None,
        variables: Vec::new(),
        time: TIME,
        memory: Some(MEMORY),
    };
    let outcome = child::run(&work).map_err(|why| {
        let library = path.display();
        if why.kind() == ErrorKind::OutOfMemory {
            let message = format!("not enough memory to try library {library} in a child process");
            return text::Error::Usage(message).into();
        }
        Error::library(format!(
            "library {library} cannot be tried in a child process: {why}"
        ))
    })?;
    let output = String::from_utf8_lossy(&outcome.stdout);
    let mut marked = output.lines().filter_map(|line| line.split_once(MARK));
    let last = marked.next_back().map_or("loading it", |(_, said)| said);
    match (outcome.ending, last) {
        (Ending::Exited(0), PASSED) => {
            if let Some(file) = verdict {
                remember(&file);
            }
            Ok(())
        }
        (Ending::Exited(0), REFUSED) => Ok(()),
        (ending, doing) => Err(Error::Library {
            message: format!(
                "library {} was tried in a child process and did not survive: {ending}, while \
                 {doing}",
                path.display()
            ),
            hint: Some(
                "`pilum check` finds out more; `--no-probe` opens it all the same, `--isolate` \
                 calls its laws in a process of their own"
                    .to_owned(),
            ),
        }),
    }
}

/// The file that stands for a library that passed. `None` where there is no place for it.
fn verdict_path(sha256: &str) -> Option<PathBuf> {
    let set = |name| {
        std::env::var_os(name)
            .map(PathBuf::from)
            .filter(|path| path.is_absolute())
    };
    let home = || {
        if cfg!(windows) {
            set("LOCALAPPDATA")
        } else if cfg!(target_os = "macos") {
            set("HOME").map(|home| home.join("Library/Caches"))
        } else {
            set("HOME").map(|home| home.join(".cache"))
        }
    };
    let cache = set("XDG_CACHE_HOME").or_else(home)?;
    let version = env!("CARGO_PKG_VERSION");
    Some(cache.join("pilum/probed").join(version).join(sha256))
}

/// A verdict that cannot be kept costs time, and nothing else.
fn remember(file: &Path) {
    if let Some(folder) = file.parent() {
        let _ = std::fs::create_dir_all(folder);
    }
    let _ = std::fs::write(file, "");
}

/// The child opens the library, reads its description, and calls each law a few times.
///
/// # Errors
/// [`text::Error::Internal`] if the child cannot set its limits or speak.
pub fn probe(path: &Path, sha256: &str, out: &mut dyn Write) -> Result<(), Error> {
    let speechless = |why: std::io::Error| Error::internal(why.to_string());
    child::enter().map_err(speechless)?;
    let mut say = |what: &str| {
        // A line of its own, whatever the library has printed.
        writeln!(out, "\n{MARK}{what}").and_then(|()| out.flush())
    };
    say("opening it").map_err(speechless)?;
    let same = |found: &str| {
        if found == sha256 {
            Ok(())
        } else {
            Err(Error::library("it was changed"))
        }
    };
    let Ok(library) = Opener::default().open_if(path, same) else {
        return say(REFUSED).map_err(speechless);
    };
    let ids: Vec<String> = library.laws().map(|law| law.id.clone()).collect();
    for law in ids.iter().filter_map(|id| library.law(id)) {
        for hypothesis in Hypothesis::ALL {
            if law.description().formulation(hypothesis).is_some() {
                let id = &law.description().id;
                say(&format!("calling law `{id}` under {}", hypothesis.name()))
                    .map_err(speechless)?;
                call(&law, hypothesis);
            }
        }
    }
    say(PASSED).map_err(speechless)
}

/// A few calls with plausible values. Whether the law agrees with them is no matter here.
fn call(law: &LoadedLaw, hypothesis: Hypothesis) {
    let parameters: Vec<f64> = law.description().parameters.iter().map(plausible).collect();
    let Ok(law) = law.build(hypothesis, &parameters) else {
        return;
    };
    let n = law.n_components();
    let rows = Strided::rows(n);
    let normal = if hypothesis.is_interface() { 1 } else { 3 };
    let compression = (0..n).map(|i| if i < normal { -100.0 } else { 0.0 });
    let flux: Vec<f64> = compression.cycle().take(n * N_POINTS).collect();
    let Ok(state) = law.initial_state(N_POINTS, (&flux, rows)) else {
        return;
    };
    for size in [0.0, 1e-6, -1e-3] {
        for operator in [Operator::None, Operator::Consistent, Operator::Elastic] {
            step(&law, operator, size, &flux, &state);
        }
    }
}

fn step(law: &Law, operator: Operator, size: f64, flux: &[f64], state: &[f64]) {
    let n = law.n_components();
    let rows = Strided::rows(n);
    let zero = vec![0.0; n * N_POINTS];
    let moved = vec![size; n * N_POINTS];
    let mut flux_end = flux.to_vec();
    let mut state_end = state.to_vec();
    let mut operators = vec![0.0; n * n * N_POINTS];
    let start = Start {
        n_points: N_POINTS,
        gradient: (&zero, rows),
        gradient_end: (&moved, rows),
        flux: (flux, rows),
        state,
        time: 0.0,
        time_increment: 1.0,
        moment: Moment::default(),
        sites: &[],
    };
    let end = End {
        flux: (&mut flux_end, rows),
        state: &mut state_end,
        operator: &mut operators,
    };
    let _ = law.integrate(&start, operator, end);
}

/// A value that a parameter may have; NaN: left out.
pub fn plausible(parameter: &ParameterDescription) -> f64 {
    if let Some(default) = parameter.default {
        return default;
    }
    if parameter.optional {
        return f64::NAN;
    }
    let (usual, bounds) = (parameter.usual, parameter.bounds);
    [
        0.5 * (usual.lower + usual.upper),
        usual.lower,
        usual.upper,
        0.5 * (bounds.lower + bounds.upper),
        bounds.lower + 1.0,
        bounds.upper - 1.0,
        1.0,
    ]
    .into_iter()
    .find(|value| value.is_finite() && bounds.contain(*value))
    .unwrap_or(0.0)
}
