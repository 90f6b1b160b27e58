//! The numerical factorisation: front after front, branches of the tree in parallel.

use super::kernels::{TASK, extend, pack, subtract_product, subtract_square};
use super::{Gathered, Kind, Multifrontal};
use crate::{Singular, dense};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor as cholesky_kernel;
use faer::linalg::triangular_solve as triangular;
use faer::prelude::{Reborrow, ReborrowMut};
use faer::{MatMut, Par, Spec};
use rayon::prelude::*;

/// Values of a matrix.
#[derive(Clone, Copy)]
enum Values<'v> {
    /// By place in the pattern.
    OfPattern(&'v [f64]),
    /// By entry of the fronts.
    OfFronts(&'v [f64]),
}

impl Multifrontal {
    /// Factorises a matrix of the analysed pattern.
    ///
    /// # Errors
    /// [`Singular`]: a pivot vanishes, or a symmetric matrix is not positive definite.
    pub fn factorise(&mut self, values: &[f64]) -> Result<(), Singular> {
        self.clear_schur();
        self.add_kept(values);
        self.eliminate_all(Values::OfPattern(values))
    }

    /// As [`Self::factorise`]; the Schur complement is added to a matrix of the kept equations
    /// (column-major).
    ///
    /// # Errors
    /// As [`Self::factorise`].
    pub fn factorise_onto(
        &mut self,
        block: impl Iterator<Item = f64>,
        values: &[f64],
    ) -> Result<(), Singular> {
        self.schur.clear();
        self.schur.extend(block);
        self.add_kept(values);
        self.eliminate_all(Values::OfPattern(values))
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
        self.eliminate_all(Values::OfFronts(&values.0))?;
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

    fn eliminate_all(&mut self, values: Values<'_>) -> Result<(), Singular> {
        let n = self.analysis.kept.len();
        let mut schur = std::mem::take(&mut self.schur);
        let analysis = &self.analysis;
        let updates: Vec<_> = analysis
            .roots
            .par_iter()
            .with_max_len(1)
            .map(|&root| self.branch(root, values).map(|update| (root, update)))
            .collect();
        for update in updates {
            let (root, update) = update?;
            let relative = &analysis.relative[analysis.fronts[root].rows.clone()];
            let m = relative.len();
            for (j, &column) in relative.iter().enumerate() {
                let first = if analysis.kind == Kind::Symmetric {
                    j
                } else {
                    0
                };
                for i in first..m {
                    schur[column as usize * n + relative[i] as usize] += update[j * m + i];
                }
            }
        }
        if analysis.kind == Kind::Symmetric {
            for j in 0..n {
                for i in j + 1..n {
                    schur[i * n + j] = schur[j * n + i];
                }
            }
        }
        self.schur = schur;
        Ok(())
    }

    /// Factorises a front after its descendants. Returns its update matrix.
    fn branch(&self, front: usize, values: Values<'_>) -> Result<Vec<f64>, Singular> {
        let shape = &self.analysis.fronts[front];
        // Deep trees are walked without recursion where there is nothing to gain.
        if shape.work < TASK {
            return self.small_branch(front, values);
        }
        let updates: Vec<Result<Vec<f64>, Singular>> = if shape.children.len() > 1 {
            shape
                .children
                .par_iter()
                .with_max_len(1)
                .map(|&child| self.branch(child, values))
                .collect()
        } else {
            let children = shape.children.iter();
            children.map(|&child| self.branch(child, values)).collect()
        };
        let updates = updates.into_iter().collect::<Result<Vec<_>, _>>()?;
        self.eliminate(front, values, &updates)
    }

    fn small_branch(&self, front: usize, values: Values<'_>) -> Result<Vec<f64>, Singular> {
        // Every front is visited twice: before its children, and after them.
        let mut todo = vec![(front, false)];
        let mut done: Vec<Vec<f64>> = Vec::new();
        while let Some((front, children_done)) = todo.pop() {
            let children = &self.analysis.fronts[front].children;
            if children_done || children.is_empty() {
                let updates = done.split_off(done.len() - children.len());
                done.push(self.eliminate(front, values, &updates)?);
            } else {
                todo.push((front, true));
                todo.extend(children.iter().rev().map(|&child| (child, false)));
            }
        }
        done.pop().ok_or(Singular)
    }

    /// Assembles a front from the matrix and the updates of its children, eliminates its pivots,
    /// and returns what it leaves to its parent (m × m, column-major; the lower half if symmetric).
    fn eliminate(
        &self,
        number: usize,
        values: Values<'_>,
        updates: &[Vec<f64>],
    ) -> Result<Vec<f64>, Singular> {
        let analysis = &self.analysis;
        let shape = &analysis.fronts[number];
        let (k, m) = (shape.pivots.len(), shape.rows.len());
        let n = k + m;
        let symmetric = analysis.kind == Kind::Symmetric;
        let mut guard = self.front(number);
        let front = &mut *guard;
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
        let mut update = vec![0.0; m * m];
        let (l, u) = front.values.split_at_mut(n * k);
        for (&child, of_child) in shape.children.iter().zip(updates) {
            let relative = &analysis.relative[analysis.fronts[child].rows.clone()];
            extend(relative, of_child, k, n, symmetric, l, u, &mut update);
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
            subtract_square(&mut update, m, below.rb());
            pack(&mut front.values, n, k);
            return Ok(update);
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
        subtract_product(&mut update, m, below.rb(), right.rb());
        Ok(update)
    }
}
