//! The order of elimination, and the supernodes that it makes.

use crate::{Pattern, Singular, dissection};
use faer::Side;
use faer::perm::PermRef;
use faer::sparse::SymbolicSparseColMatRef;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky,
};

/// Unknowns from which on nested dissection is used: as much work as after minimum degree at 10⁴
/// unknowns, a fifth less at 6·10⁵.
const WORTH_DISSECTING: usize = 5_000;

/// The order of elimination and the supernodes of part of the equations.
pub(super) struct Supernodes {
    pub(super) order: Vec<u32>,
    /// Where each supernode starts in the order, and the end.
    pub(super) starts: Vec<usize>,
    /// Rows below each: positions in the order, ascending.
    pub(super) rows: Vec<Vec<u32>>,
}

impl Supernodes {
    /// Orders by nested dissection, or by approximate minimum degree, and amalgamates.
    pub(super) fn new(
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
