//! Sparse linear equations: which factorisation, and the check of solutions.

use crate::Pattern;
use crate::dense::{self, Exchanges, largest};
use crate::multifrontal::{Before, Kind, Multifrontal};
use crate::product::{add_product, add_symmetric_product};
use crate::threads;
use faer::prelude::Solve;
use faer::sparse::linalg::solvers::{Lu, SymbolicLu};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{ColMut, MatMut};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Largest backward error of an accepted solution.
const BACKWARD_ERROR: f64 = 1e-10;
/// Columns of a matrix that one thread copies at a time.
const PER_TASK: usize = 4096;

/// A square dense matrix, column-major, which several may hold.
#[derive(Clone, Debug)]
pub enum Dense {
    /// The Schur complement of these factors.
    SchurOf(Arc<Multifrontal>),
    /// These values.
    Of(Arc<Vec<f64>>),
    /// These values of a symmetric matrix.
    Symmetric(Arc<Vec<f64>>),
}

impl Dense {
    /// Its entries.
    pub fn values(&self) -> &[f64] {
        match self {
            Self::SchurOf(factors) => factors.schur(),
            Self::Of(values) | Self::Symmetric(values) => values,
        }
    }

    /// to += K u.
    pub fn add_product(&self, u: &[f64], to: &mut [f64]) {
        let is_symmetric = match self {
            Self::SchurOf(factors) => factors.is_symmetric(),
            Self::Of(_) => false,
            Self::Symmetric(_) => true,
        };
        if is_symmetric {
            add_symmetric_product(self.values(), u, to);
        } else {
            add_product(self.values().chunks_exact(u.len().max(1)), u, to);
        }
    }
}

/// A dense block of the matrix: the condensed stiffness of a domain.
#[derive(Clone, Debug)]
pub struct Block {
    /// Its equations, ascending.
    equations: Vec<usize>,
    matrix: Dense,
    /// Sums of the absolute values of its rows.
    row_sums: Vec<f64>,
}

impl Block {
    /// A matrix on these equations, which are as many as its rows.
    pub fn new(equations: Vec<usize>, matrix: Dense) -> Self {
        let mut row_sums = vec![0.0; equations.len()];
        for column in matrix.values().chunks_exact(equations.len().max(1)) {
            for (sum, value) in row_sums.iter_mut().zip(column) {
                *sum += value.abs();
            }
        }
        Self {
            equations,
            matrix,
            row_sums,
        }
    }

    /// Column-major.
    fn values(&self) -> &[f64] {
        self.matrix.values()
    }
}

/// Sparse equations of one pattern, with a dense block on some of them.
///
/// A multifrontal factorisation does the work; where its
/// restricted row exchanges lose accuracy, `faer`'s LU with full row exchanges takes over.
#[derive(Debug)]
pub struct LinearSolver {
    pattern: Arc<Pattern>,
    block: Option<Block>,
    multifrontal: Multifrontal,
    /// Row exchanges among the equations of the block, which are eliminated last.
    exchanges: Exchanges,
    values: Vec<f64>,
    /// Room that the values of the matrix before the last one took.
    room: Vec<f64>,
    /// The last matrix has been factorised by the multifrontal method.
    factorised: bool,
    /// A solution with the last matrix was accurate at once; those that follow are not checked.
    proven: bool,
    row_exchanges: Option<RowExchanges>,
    /// Numerical factorisations so far.
    pub factorisations: u64,
    /// How many of them needed full row exchanges.
    pub fallbacks: u64,
}

/// The other method.
#[derive(Debug)]
struct RowExchanges {
    /// Pattern of matrix and block together.
    pattern: Arc<Pattern>,
    symbolic: SymbolicLu<u32>,
    factors: Option<Lu<u32, f64>>,
}

/// The last matrix of a [`LinearSolver`], which is to be there again after others.
#[derive(Debug)]
pub struct LastMatrix {
    values: Vec<f64>,
    factorised: bool,
    proven: bool,
    /// Factorisations and fallbacks so far.
    counts: [u64; 2],
}

/// The matrix is singular, or so close to it that a solution would be noise.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Singular;

impl LinearSolver {
    /// Analyses a pattern. Matrices that are `symmetric` have to be positive definite. `lines` are
    /// the mesh lines on which the unknowns lie, see [`crate::mesh_lines`].
    ///
    /// # Errors
    /// [`Singular`] if the pattern alone makes the matrix singular, or memory runs out.
    pub fn new(
        pattern: &Arc<Pattern>,
        symmetric: bool,
        lines: Option<&[[u32; 2]]>,
    ) -> Result<Self, Singular> {
        let kind = if symmetric {
            Kind::Symmetric
        } else {
            Kind::Unsymmetric
        };
        Self::of_kind(kind, pattern, lines, None)
    }

    /// As [`Self::new`] for matrices that are not symmetric, with a dense block.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with_block(
        pattern: &Arc<Pattern>,
        lines: Option<&[[u32; 2]]>,
        block: Block,
    ) -> Result<Self, Singular> {
        Self::of_kind(Kind::Unsymmetric, pattern, lines, Some(block))
    }

    fn of_kind(
        kind: Kind,
        pattern: &Arc<Pattern>,
        lines: Option<&[[u32; 2]]>,
        block: Option<Block>,
    ) -> Result<Self, Singular> {
        let mut kept = vec![false; pattern.n()];
        for &equation in block.iter().flat_map(|block| &block.equations) {
            kept[equation] = true;
        }
        let multifrontal = Multifrontal::new(pattern, kind, &kept, lines)?;
        Ok(Self::of(multifrontal, Arc::clone(pattern), block))
    }

    /// Another solver for other matrices of the same equations, which need not be symmetric. If these need not either,
    /// nothing is analysed again.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn another(&self) -> Result<Self, Singular> {
        if self.multifrontal.is_symmetric() {
            return Self::of_kind(Kind::Unsymmetric, &self.pattern, None, self.block.clone());
        }
        let (pattern, block) = (Arc::clone(&self.pattern), self.block.clone());
        Ok(Self::of(self.multifrontal.alike(), pattern, block))
    }

    fn of(multifrontal: Multifrontal, pattern: Arc<Pattern>, block: Option<Block>) -> Self {
        Self {
            multifrontal,
            pattern,
            block,
            exchanges: Exchanges::default(),
            values: Vec::new(),
            room: Vec::new(),
            factorised: false,
            proven: false,
            row_exchanges: None,
            factorisations: 0,
            fallbacks: 0,
        }
    }

    /// Keeps from now on what makes matrices cheap that differ from the last one in some entries only.
    pub fn expect_others(&mut self) {
        self.multifrontal.expect_others();
    }

    /// Bytes that a factorisation takes, by the analysis, and what is kept for other matrices.
    pub fn bytes(&self) -> u64 {
        self.multifrontal.bytes()
    }

    /// Floating-point operations of a factorisation, by the analysis; the block's not among them.
    pub fn operations(&self) -> f64 {
        self.multifrontal.operations()
    }

    /// Room for the values of the next matrix: memory that is new every time is given by the system page by
    /// page (4 % of the CPU time of `bonded_pile` on `m20k`).
    pub fn room(&mut self) -> Vec<f64> {
        std::mem::take(&mut self.room)
    }

    /// Factorises the matrix with these values and the unchanged block.
    ///
    /// # Errors
    /// [`Singular`].
    pub fn factorise(&mut self, values: Vec<f64>) -> Result<(), Singular> {
        let before = std::mem::replace(&mut self.values, values);
        let outcome = self.factorise_after(&Before::Values(&before));
        self.room = before;
        outcome
    }

    /// As [`Self::factorise`], for the same bits with less work: the values differ from those of the last
    /// matrix at most where row and column belong to equations that have `changed`.
    ///
    /// # Errors
    /// [`Singular`].
    pub fn factorise_changed(&mut self, values: &[f64], changed: &[bool]) -> Result<(), Singular> {
        let mut rest = self.values.as_mut_slice();
        let columns: Vec<usize> = (0..changed.len()).collect();
        let parts = columns.chunks(PER_TASK).map(|columns| {
            let (first, last) = (columns[0], columns[columns.len() - 1]);
            let places = self.pattern.places(first).start..self.pattern.places(last).end;
            let own;
            (own, rest) = std::mem::take(&mut rest).split_at_mut(places.len());
            (columns, places.start, own)
        });
        threads::each(parts, |(columns, start, own)| {
            for &column in columns.iter().filter(|&&column| changed[column]) {
                let places = self.pattern.places(column);
                let to = &mut own[places.start - start..places.end - start];
                to.copy_from_slice(&values[places]);
            }
        });
        self.factorise_after(&Before::But(changed))
    }

    fn factorise_after(&mut self, before: &Before<'_>) -> Result<(), Singular> {
        self.proven = false;
        if let Some(other) = &mut self.row_exchanges {
            other.factors = None;
        }
        if self.pattern.n() == 0 {
            self.factorised = true;
            return Ok(());
        }
        self.factorisations += 1;
        self.factorised = self.factorise_fast(before).is_ok();
        if self.factorised {
            Ok(())
        } else {
            self.fall_back()
        }
    }

    /// The last matrix, for [`Self::put_back`] once others, which need not be symmetric, have been factorised in its
    /// place: two factorisations at a time take twice the memory. `None` if they need [another](Self::another) solver.
    pub fn set_aside(&self) -> Option<LastMatrix> {
        (!self.multifrontal.is_symmetric()).then(|| LastMatrix {
            values: self.values.clone(),
            factorised: self.factorised,
            proven: self.proven,
            counts: [self.factorisations, self.fallbacks],
        })
    }

    /// Factorises a matrix that was set aside once more, to the same bits, if it is still `wanted`. Nothing since then
    /// is counted.
    ///
    /// # Errors
    /// [`Singular`].
    pub fn put_back(&mut self, last: LastMatrix, wanted: bool) -> Result<(), Singular> {
        let outcome = match wanted {
            false => Ok(()),
            true if last.factorised => self.factorise(last.values),
            true => {
                self.values = last.values;
                self.fall_back()
            }
        };
        self.proven = wanted && last.proven;
        [self.factorisations, self.fallbacks] = last.counts;
        outcome
    }

    /// Lets the next solution be checked, whatever the last ones were like.
    pub fn check_next(&mut self) {
        self.proven = false;
    }

    /// Whether the last matrix needed full row exchanges.
    pub fn has_fallen_back(&self) -> bool {
        !self.factorised
    }

    /// Factorises with row exchanges inside supernodes only, and among the equations of the block.
    fn factorise_fast(&mut self, before: &Before<'_>) -> Result<(), Singular> {
        let Some(block) = &self.block else {
            return self.multifrontal.factorise_after(before, &self.values);
        };
        self.multifrontal
            .factorise_onto(block.values(), before, &self.values)?;
        let n = block.equations.len();
        let matrix = MatMut::from_column_major_slice_mut(self.multifrontal.schur_mut(), n, n);
        dense::factorise(matrix, &mut self.exchanges)
    }

    /// Whether an equation outside the block has no entry but zeros.
    fn has_empty_column(&self) -> bool {
        let in_block = |column: usize| {
            let mut blocks = self.block.iter();
            blocks.any(|block| block.equations.binary_search(&column).is_ok())
        };
        (0..self.pattern.n()).any(|column| {
            let mut values = self.values[self.pattern.places(column)].iter();
            values.all(|value| *value == 0.0) && !in_block(column)
        })
    }

    /// Factorises with full row exchanges, which take several times the memory.
    fn fall_back(&mut self) -> Result<(), Singular> {
        self.factorised = false;
        if self.has_empty_column() {
            return Err(Singular);
        }
        self.fallbacks += 1;
        self.multifrontal.forget();
        let (pattern, values) = self.with_block_entries();
        let other = match &mut self.row_exchanges {
            Some(other) => other,
            none => none.insert(RowExchanges {
                symbolic: SymbolicLu::try_new(symbolic(&pattern)).map_err(|_| Singular)?,
                pattern,
                factors: None,
            }),
        };
        let matrix = SparseColMatRef::new(symbolic(&other.pattern), &values);
        let factors = Lu::try_new_with_symbolic(other.symbolic.clone(), matrix);
        other.factors = Some(factors.map_err(|_| Singular)?);
        Ok(())
    }

    /// Matrix and block as one sparse matrix.
    fn with_block_entries(&self) -> (Arc<Pattern>, Vec<f64>) {
        let Some(block) = &self.block else {
            return (Arc::clone(&self.pattern), self.values.clone());
        };
        let mut pattern = Pattern {
            column_start: vec![0],
            rows: Vec::new(),
        };
        let mut values = Vec::new();
        let mut columns = block
            .equations
            .iter()
            .zip(block.values().chunks_exact(block.equations.len().max(1)));
        let mut next = columns.next();
        for column in 0..self.pattern.n() {
            let own = self.pattern.places(column);
            let own = own.map(|at| (self.pattern.rows[at], self.values[at]));
            let mut entries: BTreeMap<u32, f64> = own.collect();
            if let Some((&equation, of_block)) = next
                && equation == column
            {
                for (&row, value) in block.equations.iter().zip(of_block) {
                    *entries.entry(row as u32).or_default() += value;
                }
                next = columns.next();
            }
            pattern.rows.extend(entries.keys());
            values.extend(entries.values());
            pattern.column_start.push(pattern.rows.len() as u32);
        }
        (Arc::new(pattern), values)
    }

    /// Solves for one right-hand side, refines the solution where that helps, and checks its
    /// backward error; of a matrix whose first solution was accurate, only that.
    ///
    /// # Errors
    /// [`Singular`] if the matrix was never factorised or the solution is not one.
    pub fn solve(&mut self, right: &[f64]) -> Result<Vec<f64>, Singular> {
        if self.proven {
            let x = self.solve_once(right)?;
            let is_finite = x.iter().all(|value| value.is_finite());
            return if is_finite { Ok(x) } else { Err(Singular) };
        }
        if self.factorised {
            if let Ok(x) = self.refined(right) {
                return Ok(x);
            }
            self.fall_back()?;
        }
        self.refined(right)
    }

    fn refined(&mut self, right: &[f64]) -> Result<Vec<f64>, Singular> {
        let mut x = self.solve_once(right)?;
        for refinements in 0..3 {
            let (residual, error) = self.residual(right, &x);
            if !error.is_finite() {
                return Err(Singular);
            }
            if error <= BACKWARD_ERROR {
                self.proven = refinements == 0 && right.iter().any(|value| value.abs() > 0.0);
                return Ok(x);
            }
            let correction = self.solve_once(&residual)?;
            x.iter_mut().zip(&correction).for_each(|(x, r)| *x += r);
        }
        Err(Singular)
    }

    fn solve_once(&self, right: &[f64]) -> Result<Vec<f64>, Singular> {
        if self.factorised {
            // Where nothing is to be answered, nothing is to be eliminated.
            let wanted: Vec<bool> = right.iter().map(|value| value.abs() > 0.0).collect();
            let fronts = self.multifrontal.fronts_of(&wanted);
            let (y, mut kept) = self.multifrontal.forward(right, Some(&fronts));
            if self.block.is_some() {
                kept = dense::solve(self.multifrontal.schur(), &self.exchanges, &kept);
            }
            return Ok(self.multifrontal.backward(&y, &kept, None));
        }
        let other = self
            .row_exchanges
            .as_ref()
            .and_then(|other| other.factors.as_ref());
        let mut x = right.to_vec();
        other
            .ok_or(Singular)?
            .solve_in_place(ColMut::from_slice_mut(&mut x));
        Ok(x)
    }

    /// b − A x, and the backward error ‖b − A x‖ / (‖A‖‖x‖ + ‖b‖) in maximum norms, or a larger value that is
    /// small enough, too.
    fn residual(&self, right: &[f64], x: &[f64]) -> (Vec<f64>, f64) {
        let product = self.pattern.multiply(&self.values, x);
        let both = right.iter().zip(product);
        let mut residual: Vec<f64> = both.map(|(right, product)| right - product).collect();
        if let Some(block) = &self.block {
            let at = block.equations.iter();
            let own: Vec<f64> = at.clone().map(|&column| x[column]).collect();
            let mut product = vec![0.0; own.len()];
            block.matrix.add_product(&own, &mut product);
            for (&row, product) in at.zip(product) {
                residual[row] -= product;
            }
        }
        if !residual.iter().chain(x).all(|v| v.is_finite()) {
            return (residual, f64::NAN);
        }
        let (left, right) = (largest(&residual), largest(right));
        // The matrix's norm costs as much as the product, and is seldom needed.
        let mut scale = right;
        if left > BACKWARD_ERROR * scale {
            scale += self.norm() * largest(x);
        }
        let error = if scale > 0.0 { left / scale } else { 0.0 };
        (residual, error)
    }

    /// Largest sum of the absolute values of a row.
    fn norm(&self) -> f64 {
        let sizes = |value: f64, _| [value.abs()];
        let [mut row_sums] = self.pattern.add_up(&self.values, sizes);
        if let Some(block) = &self.block {
            for (&row, row_sum) in block.equations.iter().zip(&block.row_sums) {
                row_sums[row] += row_sum;
            }
        }
        largest(&row_sums)
    }
}

/// The pattern in faer's terms.
fn symbolic(pattern: &Pattern) -> SymbolicSparseColMatRef<'_, u32> {
    let n = pattern.n();
    SymbolicSparseColMatRef::new_checked(n, n, &pattern.column_start, None, &pattern.rows)
}

#[cfg(test)]
mod tests;
