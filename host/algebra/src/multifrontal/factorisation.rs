//! The numerical factorisation: front after front, branches of the tree in parallel.

use super::kernels::{WORTHWHILE, extend, pack, subtract_product, subtract_square};
use super::{Front, Gathered, Kind, Multifrontal};
use crate::{Singular, dense};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor as cholesky_kernel;
use faer::linalg::triangular_solve as triangular;
use faer::prelude::{Reborrow, ReborrowMut};
use faer::{MatMut, Par, Spec};
use rayon::prelude::*;
use std::sync::PoisonError;

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
        self.factorise_after(&[], values)
    }

    /// As [`Self::factorise`], for the same bits with less work: `before` are the values of the
    /// last matrix.
    ///
    /// # Errors
    /// As [`Self::factorise`].
    pub fn factorise_after(&mut self, before: &[f64], values: &[f64]) -> Result<(), Singular> {
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
        block: impl Iterator<Item = f64>,
        before: &[f64],
        values: &[f64],
    ) -> Result<(), Singular> {
        self.schur.clear();
        self.schur.extend(block);
        self.add_kept(values);
        self.eliminate_all(before, Values::OfPattern(values))
    }

    /// Takes what counts of the values of the last matrix there will be, and gives up what only
    /// another one would need.
    pub fn gather(&mut self, values: &[f64]) -> Gathered {
        self.clear_schur();
        self.add_kept(values);
        self.analysis.kept_entries = Vec::new();
        let sources = std::mem::take(&mut self.analysis.sources);
        Gathered(sources.iter().map(|&at| values[at as usize]).collect())
    }

    /// Factorises the last matrix.
    ///
    /// # Errors
    /// As [`Self::factorise`].
    pub fn factorise_gathered(&mut self, values: &Gathered) -> Result<(), Singular> {
        self.eliminate_all(&[], Values::OfFronts(&values.0))?;
        self.analysis.targets = Vec::new();
        self.analysis.relative = Vec::new();
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

    /// What becomes of every front after a matrix with the values `before`.
    fn tasks(&mut self, before: &[f64], values: Values<'_>) -> Vec<Task> {
        let (shapes, sources) = (&self.analysis.fronts, &self.analysis.sources);
        let mut tasks = vec![Task::Compute; shapes.len()];
        let Values::OfPattern(values) = values else {
            return tasks;
        };
        if !self.is_complete || before.len() != values.len() {
            return tasks;
        }
        let is_same = |&at: &u32| before[at as usize].to_bits() == values[at as usize].to_bits();
        // Children come before their parents.
        for (front, shape) in shapes.iter().enumerate() {
            if sources[shape.entries.clone()].iter().all(is_same)
                && shape.children.iter().all(|&c| tasks[c] == Task::TakeOver)
            {
                tasks[front] = Task::TakeOver;
            }
        }
        // The Schur complement is added up anew, and so is what a computed front takes from below.
        let fronts = &mut self.fronts;
        let mut want = |front: usize, tasks: &mut Vec<Task>| {
            let front_of = fronts[front]
                .get_mut()
                .unwrap_or_else(PoisonError::into_inner);
            if tasks[front] == Task::TakeOver && !front_of.is_retained {
                tasks[front] = Task::Restore;
            }
        };
        for &root in &self.analysis.roots {
            if !shapes[root].rows.is_empty() {
                want(root, &mut tasks);
            }
        }
        for (front, shape) in shapes.iter().enumerate().rev() {
            if tasks[front] != Task::TakeOver {
                for &child in &shape.children {
                    want(child, &mut tasks);
                }
            }
        }
        tasks
    }

    fn eliminate_all(&mut self, before: &[f64], values: Values<'_>) -> Result<(), Singular> {
        let tasks = self.tasks(before, values);
        self.is_complete = false;
        self.computed = tasks.iter().filter(|&&task| task != Task::TakeOver).count();
        let n = self.analysis.kept.len();
        let mut schur = std::mem::take(&mut self.schur);
        let analysis = &self.analysis;
        let results: Vec<_> = analysis
            .roots
            .par_iter()
            .with_max_len(1)
            .map(|&root| self.branch(root, &tasks, values))
            .collect();
        results.into_iter().collect::<Result<(), _>>()?;
        for &root in &analysis.roots {
            let relative = &analysis.relative[analysis.fronts[root].rows.clone()];
            let m = relative.len();
            let mut front = self.front(root);
            for (j, &column) in relative.iter().enumerate() {
                let first = if analysis.kind == Kind::Symmetric {
                    j
                } else {
                    0
                };
                for i in first..m {
                    schur[column as usize * n + relative[i] as usize] += front.update[j * m + i];
                }
            }
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
        self.eliminate(front, tasks[front], values)
    }

    fn small_branch(
        &self,
        front: usize,
        tasks: &[Task],
        values: Values<'_>,
    ) -> Result<(), Singular> {
        // Every front is visited twice: before its children, and after them.
        let mut todo = vec![(front, false)];
        while let Some((front, children_done)) = todo.pop() {
            if tasks[front] == Task::TakeOver {
                continue;
            }
            let children = &self.analysis.fronts[front].children;
            if children_done || children.is_empty() {
                self.eliminate(front, tasks[front], values)?;
            } else {
                todo.push((front, true));
                todo.extend(children.iter().rev().map(|&child| (child, false)));
            }
        }
        Ok(())
    }

    /// Assembles a front from the matrix and the updates of its children, and eliminates its pivots.
    fn eliminate(&self, number: usize, task: Task, values: Values<'_>) -> Result<(), Singular> {
        let analysis = &self.analysis;
        let shape = &analysis.fronts[number];
        let (k, m) = (shape.pivots.len(), shape.rows.len());
        let n = k + m;
        let symmetric = analysis.kind == Kind::Symmetric;
        let mut guard = self.front(number);
        let front = &mut *guard;
        front.is_retained = task == Task::Restore;
        front.values.clear();
        front
            .values
            .resize(if symmetric { n * k } else { n * k + k * m }, 0.0);
        let targets = &analysis.targets[shape.entries.clone()];
        match values {
            Values::OfPattern(values) => {
                let sources = &analysis.sources[shape.entries.clone()];
                for (&target, &source) in targets.iter().zip(sources) {
                    front.values[target as usize] += values[source as usize];
                }
            }
            Values::OfFronts(values) => {
                for (&target, value) in targets.iter().zip(&values[shape.entries.clone()]) {
                    front.values[target as usize] += value;
                }
            }
        }
        front.update = vec![0.0; m * m];
        let update = &mut front.update;
        let (l, u) = front.values.split_at_mut(n * k);
        for &child in &shape.children {
            let relative = &analysis.relative[analysis.fronts[child].rows.clone()];
            let mut child = self.front(child);
            extend(relative, &child.update, k, n, symmetric, l, u, update);
            child.update_is_taken();
        }
        let mut lower = MatMut::from_column_major_slice_mut(l, n, k);
        let (mut pivots, mut below) = lower.rb_mut().split_at_row_mut(k);
        if symmetric {
            let scratch =
                cholesky_kernel::cholesky_in_place_scratch::<f64>(k, Par::Seq, Spec::default());
            let mut memory = MemBuffer::new(scratch);
            cholesky_kernel::cholesky_in_place(
                pivots.rb_mut(),
                cholesky_kernel::LltRegularization::default(),
                Par::Seq,
                MemStack::new(&mut memory),
                Spec::default(),
            )
            .map_err(|_| Singular)?;
            triangular::solve_lower_triangular_in_place(
                pivots.rb(),
                below.rb_mut().transpose_mut(),
                Par::Seq,
            );
            subtract_square(update, m, below.rb());
            pack(&mut front.values, n, k);
            return Ok(());
        }
        dense::factorise(pivots.rb_mut(), &mut front.exchanges)?;
        let mut exchanged = vec![0.0; k];
        for column in u.chunks_exact_mut(k) {
            for (value, &from) in exchanged.iter_mut().zip(&front.exchanges.forward) {
                *value = column[from];
            }
            column.copy_from_slice(&exchanged);
        }
        let mut right = MatMut::from_column_major_slice_mut(u, k, m);
        triangular::solve_unit_lower_triangular_in_place(pivots.rb(), right.rb_mut(), Par::Seq);
        triangular::solve_lower_triangular_in_place(
            pivots.rb().transpose(),
            below.rb_mut().transpose_mut(),
            Par::Seq,
        );
        subtract_product(update, m, below.rb(), right.rb());
        Ok(())
    }
}
