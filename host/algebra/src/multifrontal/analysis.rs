//! Symbolic analysis of a pattern: the order of elimination, the fronts, and the place of every
//! entry of a matrix.

use super::Kind;
use super::supernodes::Supernodes;
use super::updates::{Run, add_runs};
use crate::{Pattern, Singular, threads};
use std::ops::Range;

/// The order of elimination and the shape of everything that follows from it.
#[derive(Debug)]
pub(super) struct Analysis {
    pub(super) kind: Kind,
    /// Equations that are eliminated, in this order.
    pub(super) order: Vec<u32>,
    /// Equations that are kept.
    pub(super) kept: Vec<u32>,
    pub(super) fronts: Vec<Shape>,
    /// Rows below the pivot block of all fronts: positions in `order`, then, counted on, in `kept`.
    pub(super) rows: Vec<u32>,
    /// Their positions in the parents' fronts; without a parent, in `kept`.
    pub(super) runs: Vec<Run>,
    /// Entries of the matrix by front: their places in the pattern, and where they go.
    pub(super) sources: Vec<u32>,
    pub(super) targets: Vec<u32>,
    /// Entries between kept equations; targets in the column-major Schur complement.
    pub(super) kept_entries: Vec<Entry>,
    pub(super) roots: Vec<usize>,
    /// Floating-point operations of all of them, as L U.
    work: f64,
    /// Branches that are solved with at the same time; the same for any number of threads.
    pub(super) branches: Vec<Branch>,
    /// Fronts of no branch, in levels that come one after the other: those above others first, and of each level none
    /// above another one.
    pub(super) top: Vec<Vec<usize>>,
    /// Position of every pivot among those of its branch.
    pub(super) in_branch: Vec<u32>,
}

/// A front with all its descendants.
#[derive(Debug, Default)]
pub(super) struct Branch {
    /// Ascending: it is the last one.
    pub(super) fronts: Vec<usize>,
    /// How many pivots they have.
    pub(super) n_pivots: usize,
}

/// Operations from which on solutions are shared among threads and not everything is kept for other matrices, and the
/// largest share of a branch.
const WORTH_SHARING: f64 = 2e7;
const LARGEST_SHARE: f64 = 0.125;

/// Share of all operations from which on what a front leaves is worth keeping: less is soon computed again. Kept by all
/// fronts it would take more memory than the factors.
const WORTH_KEEPING: f64 = 1.0 / 64.0;

/// Tasks that fronts are shared among where their entries are placed.
const TASKS: usize = 16;

/// Place of an entry between kept equations.
#[derive(Clone, Copy, Debug)]
pub(super) struct Entry {
    pub(super) source: u32,
    pub(super) target: u32,
}

/// A supernode with the rows it touches.
#[derive(Debug)]
pub(super) struct Shape {
    /// Positions of its pivots.
    pub(super) pivots: Range<usize>,
    /// Within `rows`.
    pub(super) rows: Range<usize>,
    /// Within `runs`.
    pub(super) runs: Range<usize>,
    /// Within `sources` and `targets`.
    pub(super) entries: Range<usize>,
    pub(super) children: Vec<usize>,
    /// Floating-point operations of it and its descendants.
    pub(super) work: f64,
}

impl Analysis {
    pub(super) fn new(
        pattern: &Pattern,
        kind: Kind,
        kept: &[bool],
        lines: Option<&[[u32; 2]]>,
    ) -> Result<Self, Singular> {
        let eliminated: Vec<u32> = (0..kept.len() as u32)
            .filter(|&equation| !kept[equation as usize])
            .collect();
        let kept: Vec<u32> = (0..kept.len() as u32)
            .filter(|&equation| kept[equation as usize])
            .collect();
        let mut analysis = Self {
            kind,
            order: Vec::new(),
            kept,
            fronts: Vec::new(),
            rows: Vec::new(),
            runs: Vec::new(),
            sources: Vec::new(),
            targets: Vec::new(),
            kept_entries: Vec::new(),
            roots: Vec::new(),
            work: 0.0,
            branches: Vec::new(),
            top: Vec::new(),
            in_branch: Vec::new(),
        };
        // Where every equation stands: eliminated ones first, kept ones after them.
        let mut position = vec![0_u32; eliminated.len() + analysis.kept.len()];
        for (at, &equation) in (eliminated.len() as u32..).zip(&analysis.kept) {
            position[equation as usize] = at;
        }
        if !eliminated.is_empty() {
            // For entries above the diagonal rows of the matrix are needed: the transposed pattern is the same.
            let transpose = || (kind == Kind::Unsymmetric).then(|| pattern.transposed_places());
            let find = || Supernodes::new(pattern, &eliminated, lines);
            let (supernodes, transposed) = rayon::join(find, transpose);
            let supernodes = supernodes?;
            analysis.order = supernodes.order;
            for (at, &equation) in (0..).zip(&analysis.order) {
                position[equation as usize] = at;
            }
            analysis.add_fronts(pattern, &position, &supernodes.starts, &supernodes.rows);
            analysis.place_entries(pattern, transposed.as_deref(), &position);
        }
        analysis.add_kept_entries(pattern, &position);
        Ok(analysis)
    }

    /// Floating-point operations of a factorisation.
    pub(super) fn operations(&self) -> f64 {
        let share = match self.kind {
            Kind::Symmetric => 0.5,
            Kind::Unsymmetric => 1.0,
        };
        share * self.work
    }

    /// Whether what a front leaves is kept for other matrices: by all fronts where there is little to do.
    pub(super) fn is_worth_keeping(&self, shape: &Shape) -> bool {
        self.work < WORTH_SHARING || shape.work >= WORTH_KEEPING * self.work
    }

    /// Memory of what is kept for other matrices.
    pub(super) fn bytes_worth_keeping(&self) -> u64 {
        let kept = self
            .fronts
            .iter()
            .filter(|shape| self.is_worth_keeping(shape));
        let words = kept.map(|shape| (shape.rows.len() as u64).pow(2));
        words.sum::<u64>() * size_of::<f64>() as u64
    }

    /// Memory that a factorisation takes: factors, the Schur complement, and the updates that wait
    /// for their parents, one branch after the other.
    pub(super) fn bytes(&self) -> u64 {
        let square = |n: usize| (n * n) as u64;
        let mut factors = 0;
        let mut peaks: Vec<u64> = Vec::with_capacity(self.fronts.len());
        // Children come before their parents.
        for shape in &self.fronts {
            let (k, m) = (shape.pivots.len(), shape.rows.len());
            factors += match self.kind {
                Kind::Symmetric => square(k) + (k * m) as u64,
                Kind::Unsymmetric => square(k) + 2 * (k * m) as u64,
            };
            let (mut waiting, mut peak) = (0, 0);
            for &child in &shape.children {
                peak = peak.max(waiting + peaks[child]);
                waiting += square(self.fronts[child].rows.len());
            }
            peaks.push(peak.max(waiting + square(m)));
        }
        let peak = self.roots.iter().map(|&root| peaks[root]).max();
        let words = factors + peak.unwrap_or(0) + square(self.kept.len());
        words * size_of::<f64>() as u64
    }

    fn add_fronts(
        &mut self,
        pattern: &Pattern,
        position: &[u32],
        starts: &[usize],
        eliminated_rows: &[Vec<u32>],
    ) {
        let (mut children, parent) = self.tree(starts, eliminated_rows);
        let mut touched_by = vec![u32::MAX; self.kept.len()];
        for front in 0..eliminated_rows.len() {
            let pivots = starts[front]..starts[front + 1];
            let marks = (touched_by.as_mut_slice(), front as u32);
            let columns = (pattern, position);
            let touched = self.touched(columns, pivots.clone(), &children[front], marks);
            let start = self.rows.len();
            self.rows.extend_from_slice(&eliminated_rows[front]);
            self.rows.extend(touched);
            let rows = start..self.rows.len();
            let (k, m) = (pivots.len() as f64, rows.len() as f64);
            let own = work(k, m);
            let below: f64 = children[front]
                .iter()
                .map(|&child: &usize| self.fronts[child].work)
                .sum();
            self.fronts.push(Shape {
                pivots,
                rows,
                runs: 0..0,
                entries: 0..0,
                children: std::mem::take(&mut children[front]),
                work: own + below,
            });
        }
        let of_roots = self.roots.iter().map(|&root| self.fronts[root].work);
        self.work = of_roots.sum();
        self.find_branches(&parent);
        self.place_rows(&parent);
    }

    /// Children and parent of each front: the parent eliminates the first row that the front leaves.
    fn tree(
        &mut self,
        starts: &[usize],
        rows: &[Vec<u32>],
    ) -> (Vec<Vec<usize>>, Vec<Option<usize>>) {
        let mut front_of = vec![0; self.order.len()];
        for (front, pivots) in starts.windows(2).enumerate() {
            front_of[pivots[0]..pivots[1]].fill(front);
        }
        let mut children = vec![Vec::new(); rows.len()];
        let mut parent = vec![None; rows.len()];
        for (front, rows) in rows.iter().enumerate() {
            match rows.first() {
                Some(&row) => {
                    let above = front_of[row as usize];
                    children[above].push(front);
                    parent[front] = Some(above);
                }
                None => self.roots.push(front),
            }
        }
        (children, parent)
    }

    /// Rows of kept equations that a front touches, its own, and those of its children. `touched_by`: the last
    /// front that has touched each.
    fn touched(
        &self,
        (pattern, position): (&Pattern, &[u32]),
        pivots: Range<usize>,
        children: &[usize],
        (touched_by, front): (&mut [u32], u32),
    ) -> Vec<u32> {
        let n_eliminated = self.order.len();
        let of_children = children.iter();
        let of_children = of_children.flat_map(|&child| &self.rows[self.fronts_rows(child)]);
        let equations = self.order[pivots].iter();
        let own = equations.flat_map(|&equation| pattern.column(equation as usize));
        let own = own.map(|&row| position[row as usize]);
        let all = of_children.copied().chain(own);
        let mut touched = Vec::new();
        for row in all.filter(|&row| row as usize >= n_eliminated) {
            if std::mem::replace(&mut touched_by[row as usize - n_eliminated], front) != front {
                touched.push(row);
            }
        }
        touched.sort_unstable();
        touched
    }

    /// Shares the fronts among branches and what is above them.
    fn find_branches(&mut self, parent: &[Option<usize>]) {
        let fronts = &self.fronts;
        let largest = if self.work > WORTH_SHARING {
            LARGEST_SHARE * self.work
        } else {
            0.0
        };
        // Parents come after their children.
        let mut branch_of = vec![None; fronts.len()];
        let mut n_branches = 0;
        for front in (0..fronts.len()).rev() {
            branch_of[front] = parent[front].and_then(|parent| branch_of[parent]);
            if branch_of[front].is_none() && fronts[front].work <= largest {
                branch_of[front] = Some(n_branches);
                n_branches += 1;
            }
        }
        // By the distance from the root; where nothing is shared every front is a level.
        let mut level = vec![0; fronts.len()];
        for front in (0..fronts.len()).rev() {
            level[front] = if largest > 0.0 {
                parent[front].map_or(0, |parent| level[parent] + 1)
            } else {
                fronts.len() - 1 - front
            };
        }
        self.branches.resize_with(n_branches, Branch::default);
        self.in_branch = vec![0; self.order.len()];
        for (front, branch) in branch_of.into_iter().enumerate() {
            let Some(branch) = branch else {
                let n_levels = self.top.len().max(level[front] + 1);
                self.top.resize_with(n_levels, Vec::new);
                self.top[level[front]].push(front);
                continue;
            };
            let branch = &mut self.branches[branch];
            for pivot in fronts[front].pivots.clone() {
                self.in_branch[pivot] = branch.n_pivots as u32;
                branch.n_pivots += 1;
            }
            branch.fronts.push(front);
        }
    }

    fn fronts_rows(&self, front: usize) -> Range<usize> {
        self.fronts[front].rows.clone()
    }

    /// Positions of the rows of every front in its parent's.
    fn place_rows(&mut self, parent: &[Option<usize>]) {
        let n_eliminated = self.order.len();
        let mut place = vec![0_u32; n_eliminated + self.kept.len()];
        for front in 0..self.fronts.len() {
            let Shape { pivots, rows, .. } = &self.fronts[front];
            let k = pivots.len();
            self.place_front(pivots.clone(), rows.clone(), &mut place);
            for at in 0..self.fronts[front].children.len() {
                let child = self.fronts[front].children[at];
                self.add_runs(child, k, |row| place[row as usize]);
            }
        }
        for (front, parent) in parent.iter().enumerate() {
            if parent.is_none() {
                self.add_runs(front, 0, |row| row - n_eliminated as u32);
            }
        }
    }

    fn add_runs(&mut self, front: usize, k: usize, place: impl Fn(u32) -> u32) {
        let start = self.runs.len();
        let rows = self.rows[self.fronts_rows(front)].iter();
        add_runs(rows.map(|&row| place(row)), k, &mut self.runs);
        self.fronts[front].runs = start..self.runs.len();
    }

    /// Numbers the rows of one front.
    fn place_front(&self, pivots: Range<usize>, rows: Range<usize>, place: &mut [u32]) {
        let k = pivots.len() as u32;
        for (at, pivot) in (0..).zip(pivots) {
            place[pivot] = at;
        }
        for (at, &row) in (k..).zip(&self.rows[rows]) {
            place[row as usize] = at;
        }
    }

    /// Where the entries of the matrix go: each to the front that eliminates its row or its
    /// column first. `transposed` are the places across the diagonal, in a matrix that is not symmetric.
    fn place_entries(&mut self, pattern: &Pattern, transposed: Option<&[u32]>, position: &[u32]) {
        let per_task = self.fronts.len().div_ceil(TASKS).max(1);
        let numbers: Vec<usize> = (0..self.fronts.len()).collect();
        let counted = threads::map(numbers.chunks(per_task), |fronts| {
            let count = |&front: &usize| {
                let shape = &self.fronts[front];
                let counts =
                    |(_, _, row)| 1 + usize::from(transposed.is_some() && row >= shape.pivots.end);
                self.entries_of(shape, pattern, position).map(counts).sum()
            };
            let counts: Vec<usize> = fronts.iter().map(count).collect();
            counts
        });
        let mut n_entries = 0;
        for (shape, n) in self.fronts.iter_mut().zip(counted.iter().flatten()) {
            shape.entries = n_entries..n_entries + n;
            n_entries += n;
        }
        // What is new is given by the system as it is written, which takes as long as writing.
        let (mut sources, mut targets) = (vec![0; n_entries], vec![0; n_entries]);
        let (mut of_sources, mut of_targets) = (sources.as_mut_slice(), targets.as_mut_slice());
        let tasks = numbers.chunks(per_task).zip(&counted);
        let tasks = tasks.map(|(fronts, counts)| {
            let len = counts.iter().sum();
            let (sources, targets);
            (sources, of_sources) = std::mem::take(&mut of_sources).split_at_mut(len);
            (targets, of_targets) = std::mem::take(&mut of_targets).split_at_mut(len);
            (fronts, sources, targets)
        });
        threads::each(tasks, |(fronts, sources, targets)| {
            let mut place = vec![0_u32; position.len()];
            let mut places = sources.iter_mut().zip(targets);
            let mut entries = Vec::new();
            for &front in fronts {
                let shape = &self.fronts[front];
                self.place_front(shape.pivots.clone(), shape.rows.clone(), &mut place);
                let all = self.entries_of(shape, pattern, position);
                put_in_order(shape, all, transposed, &place, &mut entries);
                for (&entry, (source, target)) in entries.iter().zip(&mut places) {
                    (*source, *target) = ((entry >> u32::BITS) as u32, entry as u32);
                }
            }
        });
        (self.sources, self.targets) = (sources, targets);
    }

    /// Entries in the columns of the pivots of a front: which of the pivots, the position of the entry in the pattern,
    /// and the position of its row. If the matrix is symmetric, those of the lower half only.
    fn entries_of(
        &self,
        shape: &Shape,
        pattern: &Pattern,
        position: &[u32],
    ) -> impl Iterator<Item = (usize, usize, usize)> {
        let pivots = shape.pivots.clone();
        let is_symmetric = self.kind == Kind::Symmetric;
        pivots.clone().enumerate().flat_map(move |(column, pivot)| {
            let first = if is_symmetric { pivot } else { pivots.start };
            let places = pattern.places(self.order[pivot] as usize);
            places.filter_map(move |at| {
                let row = position[pattern.rows[at] as usize] as usize;
                (row >= first).then_some((column, at, row))
            })
        })
    }

    fn add_kept_entries(&mut self, pattern: &Pattern, position: &[u32]) {
        let (n_eliminated, n) = (self.order.len(), self.kept.len());
        for (column, &equation) in self.kept.iter().enumerate() {
            for at in pattern.places(equation as usize) {
                let row = position[pattern.rows[at] as usize] as usize;
                if row >= n_eliminated {
                    let row = row - n_eliminated;
                    if self.kind == Kind::Unsymmetric || row >= column {
                        self.kept_entries.push(Entry {
                            source: at as u32,
                            target: (column * n + row) as u32,
                        });
                    }
                }
            }
        }
    }
}

/// Entries of a front whose rows have these places in it: where they come from and, in the lower half of the number,
/// where they go; in the order of their addresses.
fn put_in_order(
    shape: &Shape,
    of_columns: impl Iterator<Item = (usize, usize, usize)>,
    transposed: Option<&[u32]>,
    place: &[u32],
    entries: &mut Vec<u64>,
) {
    let (k, n) = (shape.pivots.len(), shape.pivots.len() + shape.rows.len());
    let entry = |source: u32, target: usize| {
        debug_assert!(u32::try_from(target).is_ok());
        u64::from(source) << u32::BITS | target as u64
    };
    entries.clear();
    for (column, at, row) in of_columns {
        let in_front = place[row] as usize;
        entries.push(entry(at as u32, column * n + in_front));
        // The entry across the diagonal, in the row of this pivot.
        if let Some(transposed) = transposed
            && row >= shape.pivots.end
        {
            let target = n * k + (in_front - k) * k + column;
            entries.push(entry(transposed[at], target));
        }
    }
    entries.sort_unstable();
}

/// Floating-point operations that eliminate k pivots with m rows below them, as L U; of a symmetric
/// matrix half of them are done.
pub(crate) fn work(k: f64, m: f64) -> f64 {
    2.0 / 3.0 * k * k * k + 2.0 * k * k * m + 2.0 * k * m * m
}
