//! Multifrontal factorisation of matrices whose pattern is symmetric, whatever their values.
//!
//! The equations are put in an order that keeps fill low and gathered in supernodes; what a
//! supernode and its descendants leave to later equations is a dense update matrix. So all work is
//! in dense kernels, a new matrix of the same pattern needs no new analysis, and branches of the
//! tree of supernodes are independent of each other (Duff & Reid 1983; Liu 1992).
//!
//! Some equations may be *kept*: they are not eliminated, and their Schur complement
//! S = K_kk − K_ke K_ee⁻¹ K_ek is what the factorisation leaves behind. That is static
//! condensation.
//!
//! Symmetric matrices are factorised as L Lᵀ and have to be positive definite; others as L U with
//! row exchanges inside a supernode only. The caller checks the first solution by its residual and
//! has another method at hand for matrices that need more.

use crate::Pattern;
use crate::{Singular, dense, dissection};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor as cholesky_kernel;
use faer::linalg::matmul::matmul;
use faer::linalg::matmul::triangular::{BlockStructure, matmul as triangular_matmul};
use faer::linalg::triangular_solve as triangular;
use faer::perm::PermRef;
use faer::prelude::{Reborrow, ReborrowMut};
use faer::sparse::SymbolicSparseColMatRef;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::{Accum, MatMut, MatRef, Par, Side, Spec};
use rayon::prelude::*;
use std::ops::Range;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Branches with fewer floating-point operations than this are not worth a task of their own.
const TASK: f64 = 4e6;
/// Unknowns from which on nested dissection is used: as much work as after minimum degree at 10⁴
/// unknowns, a fifth less at 6·10⁵.
const WORTH_DISSECTING: usize = 5_000;
/// Columns of an update matrix that are computed as one piece. Fixed, so that the result is the
/// same for any number of threads.
const PIECE: usize = 256;

/// Which half of the matrix counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// L Lᵀ of a positive definite matrix, of which the lower half is read.
    Symmetric,
    /// L U.
    Unsymmetric,
}

/// The order of elimination and the shape of everything that follows from it.
#[derive(Debug)]
struct Analysis {
    kind: Kind,
    /// Equations that are eliminated, in this order.
    order: Vec<u32>,
    /// Equations that are kept.
    kept: Vec<u32>,
    fronts: Vec<Shape>,
    /// Rows below the pivot block of all fronts: positions in `order`, then, counted on, in `kept`.
    rows: Vec<u32>,
    /// Where each of them stands in the parent's front; without a parent, in `kept`.
    relative: Vec<u32>,
    /// Entries of the matrix by front: their places in the pattern, and where they go.
    sources: Vec<u32>,
    targets: Vec<u32>,
    /// Entries between kept equations; targets in the column-major Schur complement.
    kept_entries: Vec<Entry>,
    roots: Vec<usize>,
}

/// Where an entry between kept equations goes.
#[derive(Clone, Copy, Debug)]
struct Entry {
    source: u32,
    target: u32,
}

/// A supernode with the rows it touches.
#[derive(Debug)]
struct Shape {
    /// Positions of its pivots.
    pivots: Range<usize>,
    /// Within `rows`.
    rows: Range<usize>,
    /// Within `sources` and `targets`.
    entries: Range<usize>,
    children: Vec<usize>,
    /// Floating-point operations of it and its descendants.
    work: f64,
}

/// The factors of one supernode.
#[derive(Debug, Default)]
struct Front {
    /// L below U₁₁ (n × k, column-major), then U₁₂ (k × m, column-major). If symmetric, the columns
    /// of L from the diagonal on.
    values: Vec<f64>,
    /// Row exchanges inside the pivot block.
    exchanges: dense::Exchanges,
}

/// Values of a matrix.
#[derive(Clone, Copy)]
enum Values<'v> {
    /// By place in the pattern.
    OfPattern(&'v [f64]),
    /// By entry of the fronts.
    OfFronts(&'v [f64]),
}

/// Values of a matrix that count, in the order in which the fronts take them.
#[derive(Debug)]
pub struct Gathered(Vec<f64>);

/// A factorised matrix.
#[derive(Debug)]
pub struct Multifrontal {
    analysis: Analysis,
    fronts: Vec<Mutex<Front>>,
    schur: Vec<f64>,
}

impl Multifrontal {
    /// Analyses a pattern. `kept` says of every equation whether it is kept, `lines` on which mesh
    /// lines it lies; without them the order of elimination is found from the pattern alone.
    ///
    /// # Errors
    /// [`Singular`] if the pattern alone makes the matrix singular, or memory runs out.
    pub fn new(
        pattern: &Pattern,
        kind: Kind,
        kept: &[bool],
        lines: Option<&[[u32; 2]]>,
    ) -> Result<Self, Singular> {
        let analysis = Analysis::new(pattern, kind, kept, lines)?;
        let fronts = analysis.fronts.iter().map(|_| Mutex::default()).collect();
        Ok(Self {
            analysis,
            fronts,
            schur: Vec::new(),
        })
    }

    /// Bytes that a factorisation takes, by the analysis.
    pub fn bytes(&self) -> u64 {
        self.analysis.bytes()
    }

    /// Kept equations, in the order of the Schur complement.
    pub fn kept(&self) -> &[u32] {
        &self.analysis.kept
    }

    /// The Schur complement of the kept equations, column-major; of a symmetric matrix both
    /// halves.
    pub fn schur(&self) -> &[f64] {
        &self.schur
    }

    /// As [`Self::schur`], to be worked on.
    pub fn schur_mut(&mut self) -> &mut [f64] {
        &mut self.schur
    }

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

    fn front(&self, front: usize) -> MutexGuard<'_, Front> {
        self.fronts[front]
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
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

    /// The supernodes that give the values of some equations: theirs, and all above them.
    pub fn fronts_of(&self, wanted: &[bool]) -> Vec<bool> {
        let analysis = &self.analysis;
        let mut fronts: Vec<bool> = Vec::with_capacity(analysis.fronts.len());
        // Children come before their parents.
        for shape in &analysis.fronts {
            let own = &analysis.order[shape.pivots.clone()];
            fronts.push(
                own.iter().any(|&equation| wanted[equation as usize])
                    || shape.children.iter().any(|&child| fronts[child]),
            );
        }
        fronts
    }

    /// Eliminates the right-hand side (by equation): L y = b for the eliminated equations, and
    /// what is left for the kept ones. Where it vanishes outside some supernodes, those and the
    /// ones above them suffice.
    pub fn forward(&self, right: &[f64], fronts: Option<&[bool]>) -> (Vec<f64>, Vec<f64>) {
        let analysis = &self.analysis;
        let n_eliminated = analysis.order.len();
        let all = analysis.order.iter().chain(&analysis.kept);
        let mut y: Vec<f64> = all.map(|&equation| right[equation as usize]).collect();
        let mut own = Vec::new();
        let numbered = analysis.fronts.iter().enumerate();
        for (number, shape) in numbered.filter(|(number, _)| fronts.is_none_or(|f| f[*number])) {
            let front = self.front(number);
            let k = shape.pivots.len();
            let rows = &analysis.rows[shape.rows.clone()];
            let n = k + rows.len();
            own.clear();
            let start = shape.pivots.start;
            match analysis.kind {
                Kind::Symmetric => own.extend_from_slice(&y[shape.pivots.clone()]),
                Kind::Unsymmetric => {
                    let exchanged = front.exchanges.forward.iter();
                    own.extend(exchanged.map(|&from| y[start + from]));
                }
            }
            own.resize(n, 0.0);
            for j in 0..k {
                let start = match analysis.kind {
                    Kind::Symmetric => packed(n, j),
                    Kind::Unsymmetric => j * n + j,
                };
                let column = &front.values[start..start + n - j];
                if analysis.kind == Kind::Symmetric {
                    own[j] /= column[0];
                }
                let x = own[j];
                for (value, l) in own[j + 1..].iter_mut().zip(&column[1..]) {
                    *value -= l * x;
                }
            }
            y[shape.pivots.clone()].copy_from_slice(&own[..k]);
            for (&row, value) in rows.iter().zip(&own[k..]) {
                y[row as usize] += value;
            }
        }
        let kept = y.split_off(n_eliminated);
        (y, kept)
    }

    /// Values of all equations from `y` of [`Self::forward`] and those of the kept ones.
    /// Only those of some supernodes, see [`Self::fronts_of`]; the others mean nothing.
    pub fn backward(&self, y: &[f64], kept: &[f64], fronts: Option<&[bool]>) -> Vec<f64> {
        let analysis = &self.analysis;
        let mut x = [y, kept].concat();
        let mut own = Vec::new();
        let numbered = analysis.fronts.iter().enumerate().rev();
        for (number, shape) in numbered.filter(|(number, _)| fronts.is_none_or(|f| f[*number])) {
            let front = self.front(number);
            let k = shape.pivots.len();
            let rows = &analysis.rows[shape.rows.clone()];
            let n = k + rows.len();
            own.clear();
            own.extend_from_slice(&x[shape.pivots.clone()]);
            match analysis.kind {
                Kind::Symmetric => {
                    let below: Vec<f64> = rows.iter().map(|&row| x[row as usize]).collect();
                    for j in (0..k).rev() {
                        let column = &front.values[packed(n, j)..packed(n, j + 1)];
                        let from_below = dot(&column[k - j..], &below);
                        let from_own = dot(&column[1..k - j], &own[j + 1..]);
                        own[j] = (own[j] - from_below - from_own) / column[0];
                    }
                }
                Kind::Unsymmetric => {
                    let (l, u) = front.values.split_at(n * k);
                    for (column, &row) in u.chunks_exact(k).zip(rows) {
                        let value = x[row as usize];
                        for (own, u) in own.iter_mut().zip(column) {
                            *own -= u * value;
                        }
                    }
                    for j in (0..k).rev() {
                        let column = &l[j * n..j * n + k];
                        own[j] /= column[j];
                        let value = own[j];
                        for (own, u) in own[..j].iter_mut().zip(column) {
                            *own -= u * value;
                        }
                    }
                }
            }
            x[shape.pivots.clone()].copy_from_slice(&own);
        }
        let mut result = vec![0.0; x.len()];
        let all = analysis.order.iter().chain(&analysis.kept);
        for (&equation, value) in all.zip(x) {
            result[equation as usize] = value;
        }
        result
    }
}

/// a·b, added up in eight sums that can be worked on at once.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let (a, of_a) = a.as_chunks::<8>();
    let (b, of_b) = b.as_chunks::<8>();
    let mut sums = [0.0; 8];
    for (a, b) in a.iter().zip(b) {
        for i in 0..8 {
            sums[i] += a[i] * b[i];
        }
    }
    let rest: f64 = of_a.iter().zip(of_b).map(|(a, b)| a * b).sum();
    sums.iter().sum::<f64>() + rest
}

/// Where column j of a packed L of n rows starts.
fn packed(n: usize, j: usize) -> usize {
    j * (2 * n + 1 - j) / 2
}

/// Moves the columns of L (n × k) together, without what stands above the diagonal.
fn pack(values: &mut Vec<f64>, n: usize, k: usize) {
    for j in 1..k {
        values.copy_within(j * n + j..(j + 1) * n, packed(n, j));
    }
    values.truncate(packed(n, k));
    values.shrink_to_fit();
}

/// Adds a child's update to its parent's front (L: n × k, U: k × m) and update (m × m).
#[expect(clippy::too_many_arguments, reason = "one front, in its three parts")]
fn extend(
    relative: &[u32],
    of_child: &[f64],
    k: usize,
    n: usize,
    symmetric: bool,
    l: &mut [f64],
    u: &mut [f64],
    update: &mut [f64],
) {
    let size = relative.len();
    let m = n - k;
    let inside = relative.partition_point(|&at| (at as usize) < k);
    for (j, &column) in relative.iter().enumerate() {
        let source = &of_child[j * size..(j + 1) * size];
        let column = column as usize;
        let first = if symmetric { j } else { 0 };
        if column < k {
            let target = &mut l[column * n..(column + 1) * n];
            for (value, &row) in source[first..].iter().zip(&relative[first..]) {
                target[row as usize] += value;
            }
        } else {
            let column = column - k;
            if !symmetric {
                let target = &mut u[column * k..(column + 1) * k];
                for (value, &row) in source[..inside].iter().zip(&relative[..inside]) {
                    target[row as usize] += value;
                }
            }
            let first = first.max(inside);
            let target = &mut update[column * m..(column + 1) * m];
            for (value, &row) in source[first..].iter().zip(&relative[first..]) {
                target[row as usize - k] += value;
            }
        }
    }
}

/// update −= L Lᵀ, lower half.
fn subtract_square(update: &mut [f64], m: usize, l: MatRef<'_, f64>) {
    let piece = |(number, columns): (usize, &mut [f64])| {
        let start = number * PIECE;
        let width = columns.len() / m;
        let mut target = MatMut::from_column_major_slice_mut(columns, m, width);
        let (mut square, mut rest) = target
            .rb_mut()
            .subrows_mut(start, m - start)
            .split_at_row_mut(width);
        let (of_square, of_rest) = l.subrows(start, m - start).split_at_row(width);
        triangular_matmul(
            square.rb_mut(),
            BlockStructure::TriangularLower,
            Accum::Add,
            of_square,
            BlockStructure::Rectangular,
            of_square.transpose(),
            BlockStructure::Rectangular,
            -1.0,
            Par::Seq,
        );
        matmul(
            rest.rb_mut(),
            Accum::Add,
            of_rest,
            of_square.transpose(),
            -1.0,
            Par::Seq,
        );
    };
    in_pieces(update, m, l.ncols(), piece);
}

/// update −= L U.
fn subtract_product(update: &mut [f64], m: usize, l: MatRef<'_, f64>, u: MatRef<'_, f64>) {
    let piece = |(number, columns): (usize, &mut [f64])| {
        let width = columns.len() / m;
        let target = MatMut::from_column_major_slice_mut(columns, m, width);
        let right = u.subcols(number * PIECE, width);
        matmul(target, Accum::Add, l, right, -1.0, Par::Seq);
    };
    in_pieces(update, m, l.ncols(), piece);
}

/// Applies a function to pieces of the columns of an m × m matrix, in parallel where it pays.
fn in_pieces(
    update: &mut [f64],
    m: usize,
    k: usize,
    piece: impl Fn((usize, &mut [f64])) + Send + Sync,
) {
    if m == 0 {
        return;
    }
    if m > PIECE && 2.0 * (m * m) as f64 * k as f64 > TASK {
        update
            .par_chunks_mut(PIECE * m)
            .enumerate()
            .with_max_len(1)
            .for_each(piece);
    } else {
        update.chunks_mut(PIECE * m).enumerate().for_each(piece);
    }
}

impl Analysis {
    fn new(
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
            relative: Vec::new(),
            sources: Vec::new(),
            targets: Vec::new(),
            kept_entries: Vec::new(),
            roots: Vec::new(),
        };
        // Where every equation stands: eliminated ones first, kept ones after them.
        let mut position = vec![0_u32; eliminated.len() + analysis.kept.len()];
        for (at, &equation) in (eliminated.len() as u32..).zip(&analysis.kept) {
            position[equation as usize] = at;
        }
        if !eliminated.is_empty() {
            let supernodes = Supernodes::new(pattern, &eliminated, lines)?;
            analysis.order = supernodes.order;
            for (at, &equation) in (0..).zip(&analysis.order) {
                position[equation as usize] = at;
            }
            analysis.add_fronts(pattern, &position, &supernodes.starts, &supernodes.rows);
        }
        analysis.add_kept_entries(pattern, &position);
        Ok(analysis)
    }

    /// Memory that a factorisation takes: factors, the Schur complement, and the updates that wait
    /// for their parents, one branch after the other.
    fn bytes(&self) -> u64 {
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
        let n_eliminated = self.order.len();
        let n_fronts = eliminated_rows.len();
        let mut front_of = vec![0_u32; n_eliminated];
        for front in 0..n_fronts {
            front_of[starts[front]..starts[front + 1]].fill(front as u32);
        }
        let mut children = vec![Vec::new(); n_fronts];
        let mut parent = vec![None; n_fronts];
        for (front, rows) in eliminated_rows.iter().enumerate() {
            match rows.first() {
                Some(&row) => {
                    let above = front_of[row as usize] as usize;
                    children[above].push(front);
                    parent[front] = Some(above);
                }
                None => self.roots.push(front),
            }
        }
        // Kept equations that a front touches: its own, and those of its children.
        let mut touched_by = vec![u32::MAX; self.kept.len()];
        for front in 0..n_fronts {
            let pivots = starts[front]..starts[front + 1];
            let mut touched = Vec::new();
            let mut touch = |row: u32, touched: &mut Vec<u32>| {
                let mark = &mut touched_by[row as usize - n_eliminated];
                if *mark != front as u32 {
                    *mark = front as u32;
                    touched.push(row);
                }
            };
            for &child in &children[front] {
                for &row in &self.rows[self.fronts_rows(child)] {
                    if row as usize >= n_eliminated {
                        touch(row, &mut touched);
                    }
                }
            }
            for &equation in &self.order[pivots.clone()] {
                for &row in pattern.column(equation as usize) {
                    let row = position[row as usize];
                    if row as usize >= n_eliminated {
                        touch(row, &mut touched);
                    }
                }
            }
            touched.sort_unstable();
            let start = self.rows.len();
            self.rows.extend_from_slice(&eliminated_rows[front]);
            self.rows.extend(touched);
            let rows = start..self.rows.len();
            let (k, m) = (pivots.len() as f64, rows.len() as f64);
            let own = 2.0 / 3.0 * k * k * k + 2.0 * k * k * m + 2.0 * k * m * m;
            let below: f64 = children[front]
                .iter()
                .map(|&child: &usize| self.fronts[child].work)
                .sum();
            self.fronts.push(Shape {
                pivots,
                rows,
                entries: 0..0,
                children: std::mem::take(&mut children[front]),
                work: own + below,
            });
        }
        self.place_rows(&parent);
        self.place_entries(pattern, position);
    }

    fn fronts_rows(&self, front: usize) -> Range<usize> {
        self.fronts[front].rows.clone()
    }

    /// Where the rows of every front stand in its parent's.
    fn place_rows(&mut self, parent: &[Option<usize>]) {
        let n_eliminated = self.order.len();
        self.relative = vec![0; self.rows.len()];
        let mut place = vec![0_u32; n_eliminated + self.kept.len()];
        for front in 0..self.fronts.len() {
            let Shape {
                pivots,
                rows,
                children,
                ..
            } = &self.fronts[front];
            self.place_front(pivots.clone(), rows.clone(), &mut place);
            for &child in children {
                let of_child = self.fronts_rows(child);
                for at in of_child {
                    self.relative[at] = place[self.rows[at] as usize];
                }
            }
        }
        for (front, parent) in parent.iter().enumerate() {
            if parent.is_none() {
                for at in self.fronts_rows(front) {
                    self.relative[at] = self.rows[at] - n_eliminated as u32;
                }
            }
        }
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
    /// column first.
    fn place_entries(&mut self, pattern: &Pattern, position: &[u32]) {
        // Rows of the matrix, for entries above the diagonal: the transposed pattern is the same.
        let transposed = (self.kind == Kind::Unsymmetric).then(|| pattern.transposed_places());
        let mut place = vec![0_u32; position.len()];
        let (mut sources, mut targets) = (Vec::new(), Vec::new());
        for front in 0..self.fronts.len() {
            let Shape { pivots, rows, .. } = &self.fronts[front];
            let (pivots, rows) = (pivots.clone(), rows.clone());
            let (k, n) = (pivots.len(), pivots.len() + rows.len());
            self.place_front(pivots.clone(), rows, &mut place);
            let start = targets.len();
            for (column, pivot) in pivots.clone().enumerate() {
                let equation = self.order[pivot] as usize;
                for at in pattern.places(equation) {
                    let row = position[pattern.rows[at] as usize] as usize;
                    let lower = self.kind == Kind::Unsymmetric || row >= pivot;
                    if row >= pivots.start && lower {
                        let target = column * n + place[row] as usize;
                        sources.push(at as u32);
                        targets.push(target as u32);
                    }
                    // The entry across the diagonal, in the row of this pivot.
                    if let Some(transposed) = &transposed
                        && row >= pivots.end
                    {
                        let target = n * k + (place[row] as usize - k) * k + column;
                        sources.push(transposed[at]);
                        targets.push(target as u32);
                    }
                }
            }
            self.fronts[front].entries = start..targets.len();
        }
        (self.sources, self.targets) = (sources, targets);
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

/// The order of elimination and the supernodes of part of the equations.
struct Supernodes {
    order: Vec<u32>,
    /// Where each supernode starts in the order, and the end.
    starts: Vec<usize>,
    /// Rows below each: positions in the order, ascending.
    rows: Vec<Vec<u32>>,
}

impl Supernodes {
    /// Orders by nested dissection, or by approximate minimum degree, and amalgamates.
    fn new(
        pattern: &Pattern,
        eliminated: &[u32],
        lines: Option<&[[u32; 2]]>,
    ) -> Result<Self, Singular> {
        let mut number = vec![u32::MAX; pattern.n()];
        for (new, &equation) in (0..).zip(eliminated) {
            number[equation as usize] = new;
        }
        let mut column_start = vec![0_u32];
        let mut rows = Vec::new();
        for &equation in eliminated {
            let column = pattern.column(equation as usize).iter();
            rows.extend(
                column
                    .map(|&row| number[row as usize])
                    .filter(|&row| row != u32::MAX),
            );
            column_start.push(rows.len() as u32);
        }
        let n = eliminated.len();
        let matrix = SymbolicSparseColMatRef::new_checked(n, n, &column_start, None, &rows);
        let settings = CholeskySymbolicParams {
            // Also of equations that are not coupled, which cost nothing.
            supernodal_flop_ratio_threshold: SupernodalThreshold(f64::NEG_INFINITY),
            ..Default::default()
        };
        // Chains of unknowns between kept ones: minimum degree would not see those.
        let lines = lines.filter(|_| n >= WORTH_DISSECTING || n < pattern.n());
        let (mut forward, mut inverse) = (Vec::new(), vec![0; n]);
        if let Some(lines) = lines {
            let of_eliminated = eliminated.iter().map(|&equation| lines[equation as usize]);
            forward = dissection::order(&of_eliminated.collect::<Vec<_>>());
            for (at, &unknown) in (0..).zip(&forward) {
                inverse[unknown as usize] = at;
            }
        }
        let ordering = if lines.is_some() {
            SymmetricOrdering::Custom(PermRef::new_checked(&forward, &inverse, n))
        } else {
            SymmetricOrdering::Amd
        };
        let symbolic: SymbolicCholesky<u32> =
            factorize_symbolic_cholesky(matrix, Side::Lower, ordering, settings)
                .map_err(|_| Singular)?;
        let SymbolicCholeskyRaw::Supernodal(supernodal) = symbolic.raw() else {
            return Err(Singular);
        };
        let order = match symbolic.perm() {
            Some(order) => order.arrays().0.to_vec(),
            None => (0..n as u32).collect(),
        };
        let starts = supernodal
            .supernode_begin()
            .iter()
            .map(|&start| start as usize);
        Ok(Self {
            order: order.iter().map(|&new| eliminated[new as usize]).collect(),
            starts: starts.chain([n]).collect(),
            rows: (0..supernodal.n_supernodes())
                .map(|s| supernodal.supernode(s).pattern().to_vec())
                .collect(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    /// A grid of `n` × `n` equations, each tied to its neighbours; `skew` makes it unsymmetric.
    fn grid(n: usize, skew: f64) -> (Pattern, Vec<f64>, DMatrix<f64>) {
        let at = |i: usize, j: usize| i * n + j;
        let mut dense = DMatrix::zeros(n * n, n * n);
        for i in 0..n {
            for j in 0..n {
                let noise = ((7 * i + 3 * j) % 5) as f64 / 10.0;
                dense[(at(i, j), at(i, j))] = 7.1 + noise;
                for (k, l) in [(i + 1, j), (i, j + 1), (i + 1, j + 1)] {
                    if k < n && l < n {
                        dense[(at(i, j), at(k, l))] = -1.0 - skew * (1.0 + noise);
                        dense[(at(k, l), at(i, j))] = -1.0 + skew;
                    }
                }
            }
        }
        let mut pattern = Pattern {
            column_start: vec![0],
            rows: Vec::new(),
        };
        let mut values = Vec::new();
        for column in 0..n * n {
            for row in 0..n * n {
                if dense[(row, column)] != 0.0 {
                    pattern.rows.push(row as u32);
                    values.push(dense[(row, column)]);
                }
            }
            pattern.column_start.push(pattern.rows.len() as u32);
        }
        (pattern, values, dense)
    }

    fn right_side(n: usize) -> Vec<f64> {
        (0..n).map(|i| ((13 * i) % 7) as f64 - 2.5).collect()
    }

    fn check_solution(skew: f64, kind: Kind) {
        let (pattern, values, dense) = grid(14, skew);
        let n = pattern.n();
        let mut factors = Multifrontal::new(&pattern, kind, &vec![false; n], None).unwrap();
        factors.factorise(&values).unwrap();
        let right = right_side(n);
        let (y, kept) = factors.forward(&right, None);
        let x = DVector::from_vec(factors.backward(&y, &kept, None));
        let residual = dense * x - DVector::from_vec(right);
        assert!(residual.amax() < 1e-12, "{}", residual.amax());
    }

    #[test]
    fn solves_symmetric_and_unsymmetric_equations() {
        check_solution(0.0, Kind::Symmetric);
        check_solution(0.0, Kind::Unsymmetric);
        check_solution(0.3, Kind::Unsymmetric);
    }

    #[test]
    fn condenses_onto_kept_equations() {
        for (skew, kind) in [(0.0, Kind::Symmetric), (0.3, Kind::Unsymmetric)] {
            let (pattern, values, dense) = grid(9, skew);
            let n = pattern.n();
            // A line through the middle, and a corner.
            let kept: Vec<bool> = (0..n).map(|i| i / 9 == 4 || i == 80).collect();
            let mut factors = Multifrontal::new(&pattern, kind, &kept, None).unwrap();
            factors.factorise(&values).unwrap();
            let inside = |want: bool| (0..n).filter(|&i| kept[i] == want).collect::<Vec<_>>();
            let (e, k) = (inside(false), inside(true));
            let part =
                |rows: &[usize], columns: &[usize]| dense.select_rows(rows).select_columns(columns);
            let inverse = part(&e, &e).try_inverse().unwrap();
            let schur = part(&k, &k) - part(&k, &e) * &inverse * part(&e, &k);
            let own = DMatrix::from_column_slice(k.len(), k.len(), factors.schur());
            assert!((schur.clone() - own).amax() < 1e-12);
            // The condensed equations have the same solution.
            let right = right_side(n);
            let (y, left) = factors.forward(&right, None);
            let of_kept = schur.lu().solve(&DVector::from_vec(left)).unwrap();
            let x = DVector::from_vec(factors.backward(&y, of_kept.as_slice(), None));
            let residual = dense * x - DVector::from_vec(right);
            assert!(residual.amax() < 1e-11, "{}", residual.amax());
        }
    }

    #[test]
    fn gives_the_same_bits_for_the_last_matrix() {
        for (skew, kind) in [(0.0, Kind::Symmetric), (0.3, Kind::Unsymmetric)] {
            let (pattern, values, _) = grid(14, skew);
            let kept: Vec<bool> = (0..pattern.n()).map(|i| i % 14 == 6).collect();
            let analysed = || Multifrontal::new(&pattern, kind, &kept, None).unwrap();
            let solution = |factors: &Multifrontal| {
                let (y, left) = factors.forward(&right_side(pattern.n()), None);
                (factors.schur().to_vec(), factors.backward(&y, &left, None))
            };
            let mut factors = analysed();
            // What an earlier matrix left behind does not count.
            let earlier: Vec<f64> = values.iter().map(|value| 3.0 * value).collect();
            factors.factorise(&earlier).unwrap();
            factors.factorise(&values).unwrap();
            let mut last = analysed();
            let gathered = last.gather(&values);
            last.factorise_gathered(&gathered).unwrap();
            assert_eq!(solution(&factors), solution(&last));
        }
    }

    #[test]
    fn gives_the_same_bits_with_one_thread_and_two() {
        let (pattern, values, _) = grid(40, 0.3);
        let n = pattern.n();
        let solve = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap();
            pool.install(|| {
                let mut factors =
                    Multifrontal::new(&pattern, Kind::Unsymmetric, &vec![false; n], None).unwrap();
                factors.factorise(&values).unwrap();
                let (y, kept) = factors.forward(&right_side(n), None);
                factors.backward(&y, &kept, None)
            })
        };
        assert_eq!(solve(1), solve(2));
    }

    #[test]
    fn refuses_what_it_cannot_factorise() {
        let (pattern, mut values, _) = grid(5, 0.0);
        let none = vec![false; pattern.n()];
        let mut cholesky = Multifrontal::new(&pattern, Kind::Symmetric, &none, None).unwrap();
        for value in &mut values {
            *value = -*value;
        }
        assert_eq!(cholesky.factorise(&values), Err(Singular));
        let mut lu = Multifrontal::new(&pattern, Kind::Unsymmetric, &none, None).unwrap();
        assert_eq!(lu.factorise(&vec![0.0; values.len()]), Err(Singular));
    }

    #[test]
    fn has_nothing_to_do_without_equations() {
        let pattern = Pattern {
            column_start: vec![0],
            rows: Vec::new(),
        };
        let mut factors = Multifrontal::new(&pattern, Kind::Unsymmetric, &[], None).unwrap();
        factors.factorise(&[]).unwrap();
        assert_eq!(factors.forward(&[], None), (vec![], vec![]));
    }
}
