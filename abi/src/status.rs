//! The outcome of one call, on the Rust side of the boundary.

use crate::raw;

/// Outcome of a call or of one point, in words.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// Outputs are valid.
    Ok,
    /// Outputs are valid but inaccurate.
    Unreliable,
    /// Repeat with a smaller step.
    CutStep,
    /// The host broke the contract.
    Argument,
    /// A parameter is refused.
    Parameter,
    /// The law does not offer what was requested.
    Unsupported,
    /// Outside the law's domain.
    Domain,
    /// The local computation broke down.
    Numeric,
    /// A defect of the law; its instance is unusable from now on.
    Internal,
    /// A code that this version of the contract does not know: treated as a defect.
    Unknown(raw::Status),
}

impl Outcome {
    /// The outcome that a status code stands for.
    pub fn from_code(code: raw::Status) -> Self {
        match code {
            raw::PILUM_OK => Self::Ok,
            raw::PILUM_OK_UNRELIABLE => Self::Unreliable,
            raw::PILUM_CUT_STEP => Self::CutStep,
            raw::PILUM_E_ARGUMENT => Self::Argument,
            raw::PILUM_E_PARAMETER => Self::Parameter,
            raw::PILUM_E_UNSUPPORTED => Self::Unsupported,
            raw::PILUM_E_DOMAIN => Self::Domain,
            raw::PILUM_E_NUMERIC => Self::Numeric,
            raw::PILUM_E_INTERNAL => Self::Internal,
            other => Self::Unknown(other),
        }
    }

    /// Whether the outputs may be used.
    pub fn is_ok(self) -> bool {
        matches!(self, Self::Ok | Self::Unreliable)
    }
}

/// The more severe of two codes: errors (most negative worst) before `CUT_STEP` before
/// `OK_UNRELIABLE` before `OK`.
#[inline]
pub fn most_severe(a: raw::Status, b: raw::Status) -> raw::Status {
    if a < 0 || b < 0 { a.min(b) } else { a.max(b) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_outrank_cuts_and_cuts_outrank_doubts() {
        use raw::{
            PILUM_CUT_STEP, PILUM_E_DOMAIN, PILUM_E_INTERNAL, PILUM_OK, PILUM_OK_UNRELIABLE,
        };
        assert_eq!(
            most_severe(PILUM_OK, PILUM_OK_UNRELIABLE),
            PILUM_OK_UNRELIABLE
        );
        assert_eq!(
            most_severe(PILUM_CUT_STEP, PILUM_OK_UNRELIABLE),
            PILUM_CUT_STEP
        );
        assert_eq!(most_severe(PILUM_CUT_STEP, PILUM_E_DOMAIN), PILUM_E_DOMAIN);
        assert_eq!(
            most_severe(PILUM_E_INTERNAL, PILUM_E_DOMAIN),
            PILUM_E_INTERNAL
        );
    }
}
