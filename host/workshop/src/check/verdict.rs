//! The finding of a check: outcome, words, and the call that it is about.

use abi::raw;
use law::capsule::Capsule;
use law::probe::NO_OUTCOME;
use serde::{Deserialize, Serialize};

/// How a check ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Outcome {
    Passed,
    Warning,
    Failed,
    Crashed,
    Skipped,
}

impl Outcome {
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Passed => "passed",
            Self::Warning => "warning",
            Self::Failed => "failed",
            Self::Crashed => "crashed",
            Self::Skipped => "skipped",
        }
    }

    pub(super) fn is_bad(self) -> bool {
        matches!(self, Self::Failed | Self::Crashed)
    }
}

/// Finding of a check that has not passed.
#[derive(Clone, Debug)]
pub(super) struct Verdict {
    pub(super) outcome: Outcome,
    pub(super) why: String,
    /// The call that it is about.
    pub(super) capsule: Option<Box<Capsule>>,
}

/// Details of what was tried, or what is wrong.
pub(super) type Found = Result<String, Verdict>;

impl Verdict {
    fn of(outcome: Outcome, why: impl Into<String>) -> Self {
        Self {
            outcome,
            why: why.into(),
            capsule: None,
        }
    }

    /// A warning where it was a failure.
    pub(super) fn milder(mut self) -> Self {
        if self.outcome == Outcome::Failed {
            self.outcome = Outcome::Warning;
        }
        self
    }
}

pub(super) fn failed(why: impl Into<String>) -> Verdict {
    Verdict::of(Outcome::Failed, why)
}

pub(super) fn skipped(why: impl Into<String>) -> Verdict {
    Verdict::of(Outcome::Skipped, why)
}

pub(super) fn warned(why: impl Into<String>) -> Verdict {
    Verdict::of(Outcome::Warning, why)
}

/// How many of something were compared; skipped if none were.
pub(super) fn counted(n: usize, what: &str, none: &str) -> Found {
    if n == 0 {
        Err(skipped(none))
    } else {
        Ok(format!("{n} {what}"))
    }
}

impl From<std::io::Error> for Verdict {
    fn from(why: std::io::Error) -> Self {
        skipped(format!("the check cannot be set up: {why}"))
    }
}

/// A status as the header calls it, with its number.
pub(super) fn status_name(status: raw::Status) -> String {
    let name = match status {
        NO_OUTCOME => return "no outcome".to_owned(),
        raw::PILUM_OK => "PILUM_OK",
        raw::PILUM_OK_UNRELIABLE => "PILUM_OK_UNRELIABLE",
        raw::PILUM_CUT_STEP => "PILUM_CUT_STEP",
        raw::PILUM_E_ARGUMENT => "PILUM_E_ARGUMENT",
        raw::PILUM_E_PARAMETER => "PILUM_E_PARAMETER",
        raw::PILUM_E_UNSUPPORTED => "PILUM_E_UNSUPPORTED",
        raw::PILUM_E_DOMAIN => "PILUM_E_DOMAIN",
        raw::PILUM_E_NUMERIC => "PILUM_E_NUMERIC",
        raw::PILUM_E_INTERNAL => "PILUM_E_INTERNAL",
        _ => {
            return format!(
                "the unknown status {status} (the contract has {} to {})",
                raw::PILUM_E_INTERNAL,
                raw::PILUM_CUT_STEP
            );
        }
    };
    format!("{name} ({status})")
}

/// A failure in words: its status, and what the law says of it.
pub(crate) fn refusal(status: raw::Status, message: Option<&str>) -> String {
    let name = status_name(status);
    match message {
        Some(message) if !message.is_empty() => format!("{name}: {message}"),
        _ => format!("{name}, without a message"),
    }
}

/// The same of a whole message buffer.
pub(crate) fn refusal_in(status: raw::Status, buffer: &[u8]) -> String {
    let text = buffer.split(|&byte| byte == 0).next();
    refusal(status, text.map(String::from_utf8_lossy).as_deref())
}
