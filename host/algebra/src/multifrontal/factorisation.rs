//! The numerical factorisation: front after front, branches of the tree in parallel.

use super::analysis::{Analysis, Shape};
use super::kernels::{
    WORTHWHILE, factorise_symmetric, factorise_unsymmetric, half, leave_product, leave_square, pack,
};
use super::updates::{OnPivots, OnRest, Pile, Update};
use super::{Before, Front, Gathered, Kind, Multifrontal};
use crate::Singular;
use crate::dense::Exchanges;
use crate::threads;
use faer::MatRef;
use pulp::Arch;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Fronts whose entries one thread compares at a time.
const PER_TASK: usize = 64;
/// Entries that children leave to their parent from which on they are added on several threads.
const ADDED: usize = 1 << 16;
/// Numbers of a front that one thread sets to zero at a time.
const LARGE: usize = 1 << 16;

/// Values of a matrix.
#[derive(Clone, Copy)]
enum Values<'v> {
    /// By place in the pattern.
    OfPattern(&'v [f64]),
    /// By entry of the fronts.
    OfFronts(&'v [f64]),
}

/// What becomes of a front.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Task {
    /// Its factors and its update are those of the last matrix.
    TakeOver,
    /// As [`Self::TakeOver`], but its update is gone and wanted again, and kept from now on.
    Restore,
    /// The same for the sake of a front that is restored itself: not kept for that.
    Repeat,
    /// Its entries have changed, or those of a descendant.
    Compute,
}

impl Front {
    /// The parent has taken what this front leaves.
    fn update_is_taken(&mut self) {
        if !self.is_retained {
            self.update = Vec::new();
        }
    }
}

impl Multifrontal {
    /// Factorises a matrix of the analysed pattern.
    ///
    /// # Errors
    /// [`Singular`]: a pivot vanishes, or a symmetric matrix is not positive definite.
    pub fn factorise(&mut self, values: &[f64]) -> Result<(), Singular> {
        self.factorise_after(&Before::Values(&[]), values)
    }

    /// As [`Self::factorise`], for the same bits with less work.
    ///
    /// # Errors
    /// As [`Self::factorise`].
    pub fn factorise_after(&mut self, before: &Before<'_>, values: &[f64]) -> Result<(), Singular> {
        self.clear_schur();
        self.add_kept(values);
        self.eliminate_all(before, Values::OfPattern(values))
    }

    /// As [`Self::factorise_after`]; the Schur complement is added to a matrix of the kept equations
    /// (column-major).
    ///
    /// # Errors
    /// As [`Self::factorise`].
    pub fn factorise_onto(
        &mut self,
        block: &[f64],
        before: &Before<'_>,
        values: &[f64],
    ) -> Result<(), Singular> {
        self.schur.clear();
        self.schur.extend_from_slice(block);
        self.add_kept(values);
        self.eliminate_all(before, Values::OfPattern(values))
    }

    /// Takes what counts of the values of the last matrix there will be, and gives up what only
    /// another one would need.
    pub fn gather(&mut self, values: &[f64]) -> Gathered {
        self.clear_schur();
        self.add_kept(values);
        let sources = self.analysis.sources.iter();
        let gathered = Gathered(sources.map(|&at| values[at as usize]).collect());
        if let Some(analysis) = Arc::get_mut(&mut self.analysis) {
            analysis.kept_entries = Vec::new();
            analysis.sources = Vec::new();
        }
        gathered
    }

    /// Factorises the last matrix.
    ///
    /// # Errors
    /// As [`Self::factorise`].
    pub fn factorise_gathered(&mut self, values: &Gathered) -> Result<(), Singular> {
        self.eliminate_all(&Before::Values(&[]), Values::OfFronts(&values.0))?;
        if let Some(analysis) = Arc::get_mut(&mut self.analysis) {
            analysis.targets = Vec::new();
            analysis.runs = Vec::new();
        }
        self.memory = Mutex::default();
        Ok(())
    }

    fn clear_schur(&mut self) {
        let n = self.analysis.kept.len();
        self.schur.clear();
        self.schur.resize(n * n, 0.0);
    }

    /// Adds the entries between kept equations to the Schur complement.
    fn add_kept(&mut self, values: &[f64]) {
        for entry in &self.analysis.kept_entries {
            self.schur[entry.target as usize] += values[entry.source as usize];
        }
    }

    /// For every front, whether its entries equal those of the last matrix.
    fn unchanged(&self, before: &Before<'_>, values: &[f64]) -> Vec<bool> {
        let (shapes, sources) = (&self.analysis.fronts, &self.analysis.sources);
        match before {
            Before::Values(before) if before.len() == values.len() => {
                let is_same =
                    |&at: &u32| before[at as usize].to_bits() == values[at as usize].to_bits();
                let stays = |shape: &Shape| sources[shape.entries.clone()].iter().all(is_same);
                let of_task =
                    |shapes: &[Shape]| -> Vec<bool> { shapes.iter().map(stays).collect() };
                threads::map(shapes.chunks(PER_TASK), of_task).concat()
            }
            Before::Values(_) => vec![false; shapes.len()],
            // An entry of a front has a pivot for its row or its column.
            Before::But(changed) => {
                let stays = |shape: &Shape| {
                    let pivots = &self.analysis.order[shape.pivots.clone()];
                    pivots.iter().all(|&equation| !changed[equation as usize])
                };
                shapes.iter().map(stays).collect()
            }
        }
    }

    /// What becomes of every front after the last matrix.
    fn tasks(&mut self, before: &Before<'_>, values: Values<'_>) -> Vec<Task> {
        let shapes = &self.analysis.fronts;
        let mut tasks = vec![Task::Compute; shapes.len()];
        let Values::OfPattern(values) = values else {
            return tasks;
        };
        if !self.is_complete {
            return tasks;
        }
        let stays = self.unchanged(before, values);
        // Children come before their parents.
        for (front, shape) in shapes.iter().enumerate() {
            if stays[front] && shape.children.iter().all(|&c| tasks[c] == Task::TakeOver) {
                tasks[front] = Task::TakeOver;
            }
        }
        // The Schur complement is added up anew, and so is what a computed front takes from below.
        let fronts = &mut self.fronts;
        let mut want = |front: usize, task: Task, tasks: &mut Vec<Task>| {
            let front_of = fronts[front]
                .get_mut()
                .unwrap_or_else(PoisonError::into_inner);
            if tasks[front] == Task::TakeOver && !front_of.is_retained {
                tasks[front] = task;
            }
        };
        for &root in &self.analysis.roots {
            if !shapes[root].rows.is_empty() {
                want(root, Task::Restore, &mut tasks);
            }
        }
        for (front, shape) in shapes.iter().enumerate().rev() {
            let of_children = match tasks[front] {
                Task::TakeOver => continue,
                Task::Compute => Task::Restore,
                Task::Restore | Task::Repeat => Task::Repeat,
            };
            for &child in &shape.children {
                want(child, of_children, &mut tasks);
            }
        }
        tasks
    }

    fn eliminate_all(&mut self, before: &Before<'_>, values: Values<'_>) -> Result<(), Singular> {
        let tasks = self.tasks(before, values);
        self.is_complete = false;
        self.computed = tasks.iter().filter(|&&task| task != Task::TakeOver).count();
        let n = self.analysis.kept.len();
        let mut schur = std::mem::take(&mut self.schur);
        let analysis = &self.analysis;
        threads::stay_awake();
        let results: Vec<_> = analysis
            .roots
            .par_iter()
            .with_max_len(1)
            .map(|&root| self.branch(root, &tasks, values))
            .collect();
        results.into_iter().collect::<Result<(), _>>()?;
        for &root in &analysis.roots {
            let mut front = self.front(root);
            Arch::new().dispatch(OnRest {
                updates: &[self.update_of(root, &front.update)],
                columns: 0..n,
                target: &mut schur,
                m: n,
                k: 0,
            });
            front.update_is_taken();
        }
        if analysis.kind == Kind::Symmetric {
            for j in 0..n {
                for i in j + 1..n {
                    schur[i * n + j] = schur[j * n + i];
                }
            }
        }
        self.schur = schur;
        self.is_complete = true;
        Ok(())
    }

    /// Factorises a front after its descendants, where that is its task.
    fn branch(&self, front: usize, tasks: &[Task], values: Values<'_>) -> Result<(), Singular> {
        if tasks[front] == Task::TakeOver {
            return Ok(());
        }
        let shape = &self.analysis.fronts[front];
        // Deep trees are walked without recursion where there is nothing to gain.
        if shape.work < WORTHWHILE {
            return self.small_branch(front, tasks, values);
        }
        if shape.children.len() > 1 {
            let results: Vec<_> = shape
                .children
                .par_iter()
                .with_max_len(1)
                .map(|&child| self.branch(child, tasks, values))
                .collect();
            results.into_iter().collect::<Result<(), _>>()?;
        } else if let Some(&child) = shape.children.first() {
            self.branch(child, tasks, values)?;
        }
        self.eliminate(front, tasks[front], values, None, &mut Pile::default())
    }

    fn small_branch(
        &self,
        front: usize,
        tasks: &[Task],
        values: Values<'_>,
    ) -> Result<(), Singular> {
        let mut piles = self.memory().pop().unwrap_or_default();
        piles.iter_mut().for_each(Pile::clear);
        // Every front is visited twice: before its children, and after them. What those leave is on
        // one pile, what it leaves itself on the other.
        let mut todo = vec![(front, 0, false)];
        while let Some((front, depth, children_done)) = todo.pop() {
            if tasks[front] == Task::TakeOver {
                continue;
            }
            let children = &self.analysis.fronts[front].children;
            if children_done || children.is_empty() {
                let [even, odd] = &mut piles;
                let (own, of_children) = if depth % 2 == 0 {
                    (even, odd)
                } else {
                    (odd, even)
                };
                let own = (depth > 0).then_some(own);
                self.eliminate(front, tasks[front], values, own, of_children)?;
            } else {
                todo.push((front, depth, true));
                let children = children.iter().rev();
                todo.extend(children.map(|&child| (child, depth + 1, false)));
            }
        }
        self.memory().push(piles);
        Ok(())
    }

    fn memory(&self) -> MutexGuard<'_, Vec<[Pile; 2]>> {
        self.memory.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn update_of<'u>(&'u self, front: usize, values: &'u [f64]) -> Update<'u> {
        let shape = &self.analysis.fronts[front];
        Update {
            values,
            size: shape.rows.len(),
            runs: &self.analysis.runs[shape.runs.clone()],
            is_symmetric: self.analysis.kind == Kind::Symmetric,
        }
    }

    /// Assembles a front from the matrix and the updates of its children, and eliminates its pivots.
    /// Its Schur complement goes to the pile, unless it is to be kept. The Schur complements of its
    /// children are with them, or last on their pile.
    fn eliminate(
        &self,
        number: usize,
        task: Task,
        values: Values<'_>,
        own: Option<&mut Pile>,
        of_children: &mut Pile,
    ) -> Result<(), Singular> {
        let analysis = &self.analysis;
        let shape = &analysis.fronts[number];
        let (k, m) = (shape.pivots.len(), shape.rows.len());
        let mut guard = self.front(number);
        let front = &mut *guard;
        front.is_retained =
            task == Task::Restore || self.others_follow && analysis.is_worth_keeping(shape);
        front.assemble(analysis, shape, values);
        let mut children: Vec<_> = shape.children.iter().map(|&c| self.front(c)).collect();
        let numbered = || shape.children.iter().zip(&children);
        let on_pile = numbered().filter(|(_, child)| child.update.is_empty());
        let size_of = |child: usize| analysis.fronts[child].rows.len().pow(2);
        let on_pile: usize = on_pile.map(|(&number, _)| size_of(number)).sum();
        let own = own.filter(|_| !front.is_retained);
        let update = room(&mut front.update, own, m * m);
        let mut from_pile = of_children.last(on_pile);
        let updates: Vec<Update<'_>> = numbered()
            .map(|(&number, child)| {
                let values = if child.update.is_empty() {
                    from_pile.split_off(..size_of(number)).unwrap_or_default()
                } else {
                    &child.update
                };
                self.update_of(number, values)
            })
            .collect();
        let parts = (&mut *front.values, update, &mut front.exchanges);
        eliminate_pivots(analysis.kind, parts, (k, m), &updates)?;
        of_children.remove(on_pile);
        for child in &mut children {
            child.update_is_taken();
        }
        if analysis.kind == Kind::Symmetric {
            pack(&mut front.values, k + m, k);
        }
        Ok(())
    }
}

/// Room for what a front leaves: on a pile if there is one, else its own.
fn room<'f>(update: &'f mut Vec<f64>, pile: Option<&'f mut Pile>, len: usize) -> &'f mut [f64] {
    if let Some(pile) = pile {
        *update = Vec::new();
        pile.add(len)
    } else {
        update.resize(len, 0.0);
        update
    }
}

/// Eliminates the k pivots of a front with m rows below them: its columns and rows, what it leaves,
/// and its row exchanges; `updates` are those of its children.
fn eliminate_pivots(
    kind: Kind,
    (values, update, exchanges): (&mut [f64], &mut [f64], &mut Exchanges),
    (k, m): (usize, usize),
    updates: &[Update<'_>],
) -> Result<(), Singular> {
    let n = k + m;
    let (l, u) = values.split_at_mut(n * k);
    let columns = 0..n;
    add_to_pivots(OnPivots {
        updates,
        columns,
        l,
        u,
        n,
        k,
    });
    let add = |columns: Range<usize>, target: &mut [f64]| {
        Arch::new().dispatch(OnRest {
            updates,
            columns,
            target,
            m,
            k,
        });
    };
    match kind {
        Kind::Symmetric => {
            factorise_symmetric(l, n, k)?;
            leave_square(update, below(l, n, k), add);
        }
        Kind::Unsymmetric => {
            factorise_unsymmetric(l, u, n, k, exchanges)?;
            let u = MatRef::from_column_major_slice(u, k, m);
            leave_product(update, below(l, n, k), u, add);
        }
    }
    Ok(())
}

/// The entries below the pivots.
fn below(l: &[f64], n: usize, k: usize) -> MatRef<'_, f64> {
    MatRef::from_column_major_slice(l, n, k).split_at_row(k).1
}

/// Adds what the children leave, in parallel where it pays.
fn add_to_pivots(all: OnPivots<'_>) {
    let sizes = all.updates.iter().map(|update| update.size.pow(2));
    if sizes.sum::<usize>() < ADDED {
        return Arch::new().dispatch(all);
    }
    let (n, k) = (all.n, all.k);
    let [pivots, others] = all.split(k);
    let [a, b] = pivots.split(half(k));
    let [c, d] = others.split(k + half(n - k));
    threads::each([a, b, c, d], |part| Arch::new().dispatch(part));
}

impl Front {
    /// Takes the entries of the matrix.
    fn assemble(&mut self, analysis: &Analysis, shape: &Shape, values: Values<'_>) {
        let (k, m) = (shape.pivots.len(), shape.rows.len());
        let len = match analysis.kind {
            Kind::Symmetric => (k + m) * k,
            Kind::Unsymmetric => (k + 2 * m) * k,
        };
        if self.values.len() == len && len >= 2 * LARGE {
            threads::each(self.values.chunks_mut(LARGE), |part| part.fill(0.0));
        } else {
            self.values.clear();
            self.values.resize(len, 0.0);
        }
        let targets = &analysis.targets[shape.entries.clone()];
        match values {
            Values::OfPattern(values) => {
                let sources = &analysis.sources[shape.entries.clone()];
                for (&target, &source) in targets.iter().zip(sources) {
                    self.values[target as usize] = values[source as usize];
                }
            }
            Values::OfFronts(values) => {
                for (&target, &value) in targets.iter().zip(&values[shape.entries.clone()]) {
                    self.values[target as usize] = value;
                }
            }
        }
    }
}
