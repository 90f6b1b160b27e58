//! Calls that are written down before they are made, so that the last one is known however the process
//! ends.

use super::{Form, PointStart};
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::{self, Seek, Write};
use std::path::Path;
use std::sync::{Mutex, OnceLock, PoisonError};

// Of the whole process by nature: it is the process that ends.
static FILE: OnceLock<Mutex<File>> = OnceLock::new();
/// Digits that tell how long the text behind them is; what is behind that is of earlier calls.
const DIGITS: usize = 12;

/// Which function of a law is called.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Function {
    /// It fixes the parameters.
    Create,
    /// It gives initial internal variables.
    InitState,
    /// It carries points over an increment.
    Integrate,
}

/// A call of a law, to the last bit.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct KeptCall {
    /// Id of the law.
    pub law: String,
    /// Name of the hypothesis.
    pub hypothesis: String,
    /// Which function.
    pub function: Function,
    /// How it is called.
    pub form: Form,
    parameters: Vec<u64>,
    points: Vec<[Vec<u64>; 4]>,
}

impl KeptCall {
    /// A call for these points.
    pub fn new(
        (law, hypothesis): (&str, &str),
        function: Function,
        form: Form,
        parameters: &[f64],
        points: &[PointStart],
    ) -> Self {
        let bits = |values: &[f64]| -> Vec<u64> { values.iter().map(|v| v.to_bits()).collect() };
        let of_point =
            |p: &PointStart| [&p.gradient0, &p.gradient1, &p.flux0, &p.state0].map(|v| bits(v));
        Self {
            law: law.to_owned(),
            hypothesis: hypothesis.to_owned(),
            function,
            form,
            parameters: bits(parameters),
            points: points.iter().map(of_point).collect(),
        }
    }

    /// The call that was made last; `None` if there is none.
    pub fn last(path: &Path) -> Option<Self> {
        let bytes = std::fs::read(path).ok()?;
        let (length, rest) = bytes.split_at_checked(DIGITS)?;
        let length: usize = std::str::from_utf8(length).ok()?.parse().ok()?;
        serde_json::from_slice(rest.get(..length)?).ok()
    }

    /// Values of the parameters.
    pub fn parameters(&self) -> Vec<f64> {
        numbers(&self.parameters)
    }

    /// The points.
    pub fn points(&self) -> Vec<PointStart> {
        let points = self.points.iter();
        points
            .map(|[gradient0, gradient1, flux0, state0]| PointStart {
                gradient0: numbers(gradient0),
                gradient1: numbers(gradient1),
                flux0: numbers(flux0),
                state0: numbers(state0),
            })
            .collect()
    }
}

fn numbers(bits: &[u64]) -> Vec<f64> {
    bits.iter().map(|bits| f64::from_bits(*bits)).collect()
}

/// Has calls of probes be written to this file from now on, each over the one before.
pub fn keep_in(file: File) {
    let _ = FILE.set(Mutex::new(file));
}

/// Writes a call that is about to be made, if calls are kept.
///
/// # Errors
/// It cannot be written.
pub fn keep(call: impl FnOnce() -> KeptCall) -> io::Result<()> {
    let Some(file) = FILE.get() else {
        return Ok(());
    };
    let text = serde_json::to_string(&call())?;
    let mut file = file.lock().unwrap_or_else(PoisonError::into_inner);
    file.rewind()?;
    file.write_all(format!("{:0DIGITS$}{text}", text.len()).as_bytes())
}
