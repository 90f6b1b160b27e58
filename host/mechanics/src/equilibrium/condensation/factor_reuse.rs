//! Factors of linear parts, remembered for those that follow.

use crate::assembly::{System, Tie};
use crate::group::Group;
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
    /// Callback that receives, before a large piece of work, the bytes it takes and its name.
    pub announces: Option<fn(u64, &'static str)>,
    /// Nor, in the present one, another phase.
    pub(crate) is_last_phase: bool,
    /// The latest of the present run.
    latest: Option<Latest>,
}

/// A linear part of the present run.
#[derive(Debug)]
struct Latest {
    setup: Setup,
    numbered: Numbered,
}

/// What the matrix of a linear part follows from, on one mesh.
#[derive(Debug, PartialEq)]
pub(super) struct Setup {
    /// Bits of the tangents of every group that belongs to it: they are the same at all its points.
    tangents: Vec<Option<Vec<u64>>>,
    prescribed: Vec<bool>,
    ties: Vec<Tie>,
}

impl Setup {
    pub(super) fn of(
        (groups, condensed): (&[Group], &[bool]),
        prescribed: &[bool],
        ties: &[Tie],
    ) -> Self {
        let tangents = groups.iter().zip(condensed).map(|(group, condensed)| {
            let bits = group.tangents().iter().map(|value| value.to_bits());
            (*condensed && group.is_active).then(|| bits.collect())
        });
        Self {
            tangents: tangents.collect(),
            prescribed: prescribed.to_vec(),
            ties: ties.to_vec(),
        }
    }
}

/// A linear part with its unknowns, and its factors.
#[derive(Clone, Debug)]
pub(super) struct Numbered {
    pub(super) system: Arc<System>,
    /// For every unknown, whether it is not eliminated: on the boundary, or kept with it.
    pub(super) kept: Vec<bool>,
    pub(super) factors: Arc<Multifrontal>,
    /// Largest entry of the matrix.
    pub(super) stiffest: f64,
    /// 2-norm of its diagonal, and of the diagonal of the kept unknowns.
    pub(super) diagonal: [f64; 2],
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
            self.latest = None;
        }
    }

    /// Another run begins: what follows has another mesh, as far as is known here.
    pub(crate) fn begin_run(&mut self) {
        self.latest = None;
    }

    /// The linear part of an earlier phase of this run, if it is set up alike: neither its matrix nor its
    /// unknowns are made again.
    pub(super) fn same(&self, setup: &Setup) -> Option<Numbered> {
        let latest = self.latest.as_ref()?;
        (latest.setup == *setup).then(|| latest.numbered.clone())
    }

    /// Keeps a linear part for the phases that follow.
    pub(super) fn keep(&mut self, setup: Setup, numbered: &Numbered) {
        if self.may_recur() {
            let numbered = numbered.clone();
            self.latest = Some(Latest { setup, numbered });
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
