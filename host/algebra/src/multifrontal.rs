//! Multifrontal factorisation of matrices whose pattern is symmetric, whatever their values.
//!
//! The equations are put in an order that keeps fill low and gathered in supernodes. A supernode and its descendants
//! pass a dense update matrix to later equations. So all work is in dense kernels, a new matrix of the same pattern
//! needs no new analysis, and branches of the tree of supernodes are independent of each other (Duff & Reid 1983; Liu
//! 1992).
//!
//! Some equations may be *kept*: they are not eliminated, and the factorisation yields their Schur complement S = K_kk
//! − K_ke K_ee⁻¹ K_ek. That is static condensation.
//!
//! A matrix that differs from the last one in some entries only costs the supernodes that eliminate them and those
//! above; updates of the others are reused, bit for bit. So only the yielding part of a body costs time. Large
//! supernodes keep their updates if [other matrices follow](Multifrontal::expect_others). Small ones next to changed
//! ones compute theirs once more, with all below, and keep it until they change themselves.
//!
//! Symmetric matrices are factorised as L Lᵀ and have to be positive definite; others as L U with
//! row exchanges inside a supernode only. The caller checks the first solution by its residual and
//! has another method at hand for matrices that need more.

mod analysis;
mod factorisation;
mod kernels;
mod solution;
mod substitution;
mod supernodes;
mod updates;

pub(crate) use analysis::work;

use crate::{Pattern, Singular, dense};
use analysis::Analysis;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use updates::Pile;

/// Which half of the matrix counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// L Lᵀ of a positive definite matrix, of which the lower half is read.
    Symmetric,
    /// L U.
    Unsymmetric,
}

/// The factors of one supernode.
#[derive(Debug, Default)]
struct Front {
    /// L below U₁₁ (n × k, column-major), then U₁₂ (k × m, column-major). If symmetric, the columns
    /// of L from the diagonal on.
    values: Vec<f64>,
    /// Row exchanges inside the pivot block.
    exchanges: dense::Exchanges,
    /// Its Schur complement (m × m, column-major; the lower half if symmetric), until the parent
    /// has taken it.
    update: Vec<f64>,
    /// The update stays for the next matrix, once it is there.
    is_retained: bool,
}

/// Data of the last matrix that the next one can reuse.
#[derive(Clone, Copy, Debug)]
pub enum Before<'m> {
    /// Its values.
    Values(&'m [f64]),
    /// Its values are the same but where both equations are among these.
    But(&'m [bool]),
}

/// Values of a matrix that count, in the order in which the fronts take them.
#[derive(Debug)]
pub struct Gathered(Vec<f64>);

/// A factorised matrix.
#[derive(Debug)]
pub struct Multifrontal {
    analysis: Arc<Analysis>,
    fronts: Vec<Mutex<Front>>,
    /// Where the updates of small branches wait, for one thread each.
    memory: Mutex<Vec<[Pile; 2]>>,
    schur: Vec<f64>,
    /// Keeps whatever other matrices can reuse.
    others_follow: bool,
    /// All fronts hold the factors of one matrix.
    is_complete: bool,
    /// Fronts that the last factorisation computed.
    computed: usize,
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
        Ok(Self::of(Arc::new(analysis)))
    }

    fn of(analysis: Arc<Analysis>) -> Self {
        Self {
            fronts: analysis.fronts.iter().map(|_| Mutex::default()).collect(),
            analysis,
            memory: Mutex::default(),
            schur: Vec::new(),
            others_follow: false,
            is_complete: false,
            computed: 0,
        }
    }

    /// Another factorisation of the same pattern, kind and order, for other matrices. Not of one that has been
    /// gathered.
    #[must_use]
    pub fn alike(&self) -> Self {
        Self::of(Arc::clone(&self.analysis))
    }

    /// Keeps from now on what makes other matrices cheap that differ from the last one in some entries only.
    pub fn expect_others(&mut self) {
        self.others_follow = true;
    }

    /// Gives up all factors.
    pub(crate) fn forget(&mut self) {
        self.is_complete = false;
        self.memory = Mutex::default();
        self.fronts.fill_with(Mutex::default);
    }

    /// Bytes that a factorisation takes, by the analysis, and what is kept for other matrices.
    pub fn bytes(&self) -> u64 {
        let kept = if self.others_follow {
            self.analysis.bytes_worth_keeping()
        } else {
            0
        };
        self.analysis.bytes() + kept
    }

    /// Floating-point operations of a factorisation, by the analysis.
    pub fn operations(&self) -> f64 {
        self.analysis.operations()
    }

    /// Share of the supernodes that the last factorisation computed; the rest was taken over.
    pub fn computed(&self) -> f64 {
        self.computed as f64 / self.fronts.len().max(1) as f64
    }

    /// Whether the matrix is symmetric, and so its Schur complement.
    pub fn is_symmetric(&self) -> bool {
        self.analysis.kind == Kind::Symmetric
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

    fn front(&self, front: usize) -> MutexGuard<'_, Front> {
        self.fronts[front]
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
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

    /// Equations with an entry that differs between two matrices.
    fn differing(pattern: &Pattern, a: &[f64], b: &[f64]) -> Vec<bool> {
        let mut differing = vec![false; pattern.n()];
        for column in 0..pattern.n() {
            for at in pattern
                .places(column)
                .filter(|&at| a[at].to_bits() != b[at].to_bits())
            {
                differing[column] = true;
                differing[pattern.rows[at] as usize] = true;
            }
        }
        differing
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
    fn gives_the_same_bits_where_some_entries_have_changed() {
        for (skew, kind) in [(0.0, Kind::Symmetric), (0.3, Kind::Unsymmetric)] {
            for keeps in [false, true] {
                let (pattern, values, _) = grid(30, skew);
                let kept: Vec<bool> = (0..pattern.n()).map(|i| keeps && i % 30 == 6).collect();
                let analysed = || Multifrontal::new(&pattern, kind, &kept, None).unwrap();
                let solution = |factors: &Multifrontal| {
                    let (y, left) = factors.forward(&right_side(pattern.n()), None);
                    (factors.schur().to_vec(), factors.backward(&y, &left, None))
                };
                let (mut factors, mut told) = (analysed(), analysed());
                let mut before = values.clone();
                factors.factorise(&before).unwrap();
                told.factorise(&before).unwrap();
                // A corner yields (what the others leave is computed once more), goes on,
                // spreads, unloads, changes in one equation, not at all, and everywhere.
                for (equations, factor, most) in [
                    (0..40, 1.5, 1.0),
                    (0..40, 2.0, 0.5),
                    (0..200, 1.7, 1.0),
                    (0..40, 1.3, 0.7),
                    (7..8, 1.9, 0.5),
                    (7..8, 1.9, 0.2),
                    (0..900, 1.1, 1.0),
                ] {
                    let mut now = values.clone();
                    for equation in equations {
                        for at in pattern.places(equation) {
                            if pattern.rows[at] as usize == equation {
                                now[at] *= factor;
                            }
                        }
                    }
                    factors
                        .factorise_after(&Before::Values(&before), &now)
                        .unwrap();
                    let changed = differing(&pattern, &before, &now);
                    told.factorise_after(&Before::But(&changed), &now).unwrap();
                    let mut anew = analysed();
                    anew.factorise(&now).unwrap();
                    assert_eq!(solution(&factors), solution(&anew));
                    assert_eq!(solution(&told), solution(&anew));
                    for computed in [factors.computed(), told.computed()] {
                        assert!(computed <= most, "{computed} of {most}");
                    }
                    before = now;
                }
            }
        }
    }

    #[test]
    fn what_large_fronts_leave_is_kept_where_other_matrices_follow() {
        let mesh = crate::meshes::grid(60);
        let (pattern, lines) = (mesh.pattern(), mesh.lines());
        let values = crate::meshes::values(&pattern, 0.2);
        let kept = vec![false; pattern.n()];
        let analysed = || Multifrontal::new(&pattern, Kind::Unsymmetric, &kept, Some(&lines));
        // Where a corner yields.
        let mut now = values.clone();
        for at in (0..20).flat_map(|equation| pattern.places(equation)) {
            now[at] *= if pattern.rows[at] < 20 { 1.5 } else { 1.0 };
        }
        let solution = |factors: &Multifrontal| {
            let (y, left) = factors.forward(&right_side(pattern.n()), None);
            factors.backward(&y, &left, None)
        };
        let mut anew = analysed().unwrap();
        anew.factorise(&now).unwrap();
        for others_follow in [false, true] {
            let mut factors = analysed().unwrap();
            let bytes = factors.bytes();
            if others_follow {
                factors.expect_others();
            }
            assert_eq!(factors.bytes() > bytes, others_follow);
            factors.factorise(&values).unwrap();
            factors
                .factorise_after(&Before::Values(&values), &now)
                .unwrap();
            // Beside the way to the root a few small fronts are computed once more, with those below them.
            let most = if others_follow { 0.1 } else { 1.0 };
            assert!(factors.computed() <= most, "{}", factors.computed());
            assert_eq!(factors.computed() < 1.0, others_follow);
            assert_eq!(solution(&factors), solution(&anew));
            factors
                .factorise_after(&Before::Values(&now), &values)
                .unwrap();
            assert!(factors.computed() < 0.02, "{}", factors.computed());
        }
    }

    #[test]
    fn begins_anew_after_a_singular_matrix() {
        let (pattern, values, _) = grid(12, 0.3);
        let mut factors =
            Multifrontal::new(&pattern, Kind::Unsymmetric, &vec![false; pattern.n()], None)
                .unwrap();
        factors.factorise(&values).unwrap();
        let mut singular = values.clone();
        for at in pattern.places(70) {
            singular[at] = 0.0;
        }
        let outcome = factors.factorise_after(&Before::Values(&values), &singular);
        assert_eq!(outcome, Err(Singular));
        factors
            .factorise_after(&Before::Values(&singular), &values)
            .unwrap();
        assert!(factors.computed() >= 1.0);
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
