//! Calls that are written down before they are made, so that the last one is known however the process
//! ends; and what else runs of a library, on opening and at the end.

use super::Form;
use crate::call::PointStart;
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::{self, Seek, Write};
use std::path::Path;
use std::sync::{Mutex, OnceLock, PoisonError};

// Of the whole process by nature: it is the process that ends.
static KEPT: OnceLock<Mutex<Keeper>> = OnceLock::new();

/// The function of a law that is called.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Function {
    /// It fixes the parameters.
    Create,
    /// It gives initial internal variables.
    InitState,
    /// It carries points over an increment.
    Integrate,
    /// It frees what `create` has made.
    Destroy,
}

/// Activity of a library outside calls for points.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Phase {
    /// The system loads it, with its initialisers.
    Load,
    /// `pilum_magic` is read.
    Handshake,
    /// `pilum_entry` is called.
    Entry,
    /// Its result is read.
    Describe,
    /// `destroy` gets null.
    DestroyNull,
    /// The process ends, with what the library has put off until then.
    Exit,
}

impl Phase {
    /// The activity, in words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Load => "loading it",
            Self::Handshake => "reading `pilum_magic`",
            Self::Entry => "calling `pilum_entry`",
            Self::Describe => "reading the description",
            Self::DestroyNull => "calling `destroy` with null",
            Self::Exit => "ending the process",
        }
    }
}

/// A phase that has begun.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct KeptPhase {
    /// Which one.
    pub phase: Phase,
    /// The library is loaded from its file and not from the bytes that were hashed.
    pub from_file: bool,
    /// The law whose function is called.
    pub law: Option<String>,
}

impl KeptPhase {
    /// A phase that is no law's.
    pub fn new(phase: Phase, from_file: bool) -> Self {
        Self {
            phase,
            from_file,
            law: None,
        }
    }
}

/// What was begun last.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub enum Kept {
    /// A call of a law.
    Call(Box<KeptCall>),
    /// Something else.
    Phase(KeptPhase),
}

/// The place of the record, and the last call for points.
#[derive(Debug)]
struct Keeper {
    file: File,
    last: Option<KeptCall>,
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
    /// Values of the parameters.
    pub parameters: Vec<f64>,
    /// The points.
    pub points: Vec<PointStart>,
}

impl KeptCall {
    /// Whether it is one of the same instance, as far as that can be seen.
    fn is_of(&self, other: &Self) -> bool {
        let bits = |call: &Self| call.parameters.iter().map(|v| v.to_bits()).collect();
        let own = (&self.law, &self.hypothesis, bits(self));
        own == (&other.law, &other.hypothesis, bits(other) as Vec<u64>)
    }
}

impl Kept {
    /// What was begun last; `None` if nothing was.
    pub fn last(path: &Path) -> Option<Self> {
        // Bytes behind it are of earlier, longer records.
        let (last, _) = postcard::take_from_bytes(&std::fs::read(path).ok()?).ok()?;
        Some(last)
    }
}

/// Has calls of probes be written to this file from now on, each over the one before.
pub fn keep_in(file: File) {
    let _ = KEPT.set(Mutex::new(Keeper { file, last: None }));
}

/// Writes a call that is about to be made, if calls are kept. That of `destroy` has the points of the call
/// before, if its instance was asked for any.
///
/// # Errors
/// It cannot be written.
pub fn keep(call: impl FnOnce() -> KeptCall) -> io::Result<()> {
    let Some(keeper) = KEPT.get() else {
        return Ok(());
    };
    let mut keeper = keeper.lock().unwrap_or_else(PoisonError::into_inner);
    let mut call = call();
    if let (Function::Destroy, Some(last)) = (call.function, keeper.last.take())
        && call.is_of(&last)
    {
        (call.form, call.points) = (last.form, last.points);
    }
    let kept = Kept::Call(Box::new(call));
    keeper.write(&kept)?;
    if let Kept::Call(call) = kept
        && matches!(call.function, Function::InitState | Function::Integrate)
    {
        keeper.last = Some(*call);
    }
    Ok(())
}

/// Writes a phase that is about to begin, if calls are kept.
///
/// # Errors
/// It cannot be written.
pub fn keep_phase(phase: KeptPhase) -> io::Result<()> {
    let Some(keeper) = KEPT.get() else {
        return Ok(());
    };
    let mut keeper = keeper.lock().unwrap_or_else(PoisonError::into_inner);
    keeper.write(&Kept::Phase(phase))
}

impl Keeper {
    fn write(&mut self, kept: &Kept) -> io::Result<()> {
        let bytes = postcard::to_stdvec(kept).map_err(io::Error::other)?;
        self.file.rewind()?;
        self.file.write_all(&bytes)
    }
}
