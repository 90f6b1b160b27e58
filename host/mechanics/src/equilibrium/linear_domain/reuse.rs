//! Factors of linear parts, remembered for those that follow.

use algebra::{Kind, Multifrontal, Pattern};
use std::collections::VecDeque;
use std::sync::Arc;

/// Matrices whose factors are remembered.
const REMEMBERED: usize = 3;

/// Factors of the linear parts that were condensed last, for phases and cases with the same ones:
/// another interface law on the same mesh, the same law under other loads.
#[derive(Debug, Default)]
pub struct Reuse {
    /// The latest last.
    known: VecDeque<Condensed>,
    /// No other run follows.
    pub is_last_run: bool,
    /// Who is told beforehand how many bytes a large piece of work takes, and what it is.
    pub announces: Option<fn(u64, &'static str)>,
    /// Nor, in the present one, another phase.
    pub(crate) is_last_phase: bool,
}

/// A matrix and what became of it.
#[derive(Debug)]
pub(super) struct Condensed {
    pub(super) kind: Kind,
    pub(super) pattern: Arc<Pattern>,
    pub(super) values: Vec<f64>,
    pub(super) kept: Vec<bool>,
    pub(super) factors: Arc<Multifrontal>,
}

impl Reuse {
    /// Says how many bytes a large piece of work takes.
    pub(crate) fn announce(&self, bytes: u64, what: &'static str) {
        if let Some(announces) = self.announces {
            announces(bytes, what);
        }
    }

    /// Whether anything follows that may find what is remembered.
    pub(super) fn may_recur(&self) -> bool {
        !(self.is_last_run && self.is_last_phase)
    }

    /// Gives up what nothing that follows can find.
    pub(crate) fn forget(&mut self) {
        if !self.may_recur() {
            self.known.clear();
        }
    }

    /// The factors of a matrix that is known, to the bit.
    pub(super) fn find(
        &self,
        kind: Kind,
        pattern: &Pattern,
        values: &[f64],
        kept: &[bool],
    ) -> Option<Arc<Multifrontal>> {
        let same = |known: &&Condensed| {
            known.kind == kind
                && known.kept == kept
                && *known.pattern == *pattern
                && known
                    .values
                    .iter()
                    .map(|v| v.to_bits())
                    .eq(values.iter().map(|v| v.to_bits()))
        };
        let known = self.known.iter().find(same)?;
        Some(Arc::clone(&known.factors))
    }

    pub(super) fn remember(&mut self, condensed: Condensed) {
        if self.known.len() == REMEMBERED {
            self.known.pop_front();
        }
        self.known.push_back(condensed);
    }
}
