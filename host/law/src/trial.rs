//! The child process that tries a library before it is opened for the first time (`process/vetting.rs`).

use crate::process::child;
use crate::process::vetting::{self, MARK, PASSED, REFUSED};
use crate::{Error, Law, LoadedLaw, Opener, Operator, ParameterDescription, Start, Strided};
use abi::Hypothesis;
use std::io::Write;
use std::path::Path;

/// The hidden command of the child.
pub const COMMAND: &str = vetting::COMMAND;
/// Points of a call.
const N_POINTS: usize = 3;

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
        let is_same = (found == sha256).then_some(());
        is_same.ok_or_else(|| Error::library("it was changed"))
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
    let start = Start {
        gradient: (&zero, rows),
        gradient_end: (&moved, rows),
        state,
        time_increment: 1.0,
        ..Start::of_fluxes(N_POINTS, (flux, rows))
    };
    let _ = law.update(&start, operator);
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
