//! How much a page shows, so that it opens in a browser however much there is.
//!
//! A number takes nine bytes of the page on average. A curve on a screen looks the same with four
//! points for every pixel column (the first, the lowest, the highest, the last of those that fall
//! there), and a wide chart has 1250: 5 000 rows.

/// More runs than this are too many to name in a legend or in the head of a table.
pub(super) const MANY: usize = 10;

/// Rows of a curve that a screen can show.
const ROWS: usize = 5_000;

/// Numbers of one run that go into the page, by what they belong to.
#[derive(Clone, Copy, Debug)]
pub(super) struct Budget {
    history: usize,
    /// Values along interfaces.
    pub(super) profile: usize,
    /// Values along a pile.
    pub(super) pile: usize,
    /// Fields; of the first time alone may be `mesh`.
    pub(super) fields: usize,
    /// A mesh with the fields of one time; of a larger one there are no contours.
    pub(super) mesh: usize,
    /// Iterations.
    pub(super) iterations: usize,
}

impl Budget {
    /// For each of this many runs on a page.
    pub(super) fn of(n_runs: usize) -> Self {
        let whole = Self {
            history: 400_000,
            profile: 400_000,
            pile: 100_000,
            fields: 600_000,
            mesh: 2_400_000,
            iterations: 20_000,
        };
        // 4 MB in all, so that a page of a hundred runs stays below 5 MB.
        let of_many = Self {
            history: 200_000,
            profile: 130_000,
            pile: 20_000,
            fields: 30_000,
            mesh: 30_000,
            iterations: 10_000,
        };
        let all = if n_runs > MANY { of_many } else { whole };
        let n = n_runs.max(1);
        Self {
            history: all.history / n,
            profile: all.profile / n,
            pile: all.pile / n,
            fields: all.fields / n,
            mesh: all.mesh / n,
            iterations: all.iterations / n,
        }
    }

    /// Rows of a history with this many columns.
    pub(super) fn history_rows(&self, columns: usize) -> usize {
        (self.history / columns.max(1)).clamp(2, ROWS)
    }
}
