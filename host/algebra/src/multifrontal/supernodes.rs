//! The order of elimination, and the supernodes that it makes.

use crate::order::{self, Order};
use crate::{Pattern, Singular};
use faer::Side;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::perm::PermRef;
use faer::sparse::SymbolicSparseColMatRef;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::linalg::{SupernodalThreshold, amd};

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
        let own;
        let among = if eliminated.len() == pattern.n() {
            pattern
        } else {
            own = pattern.among(eliminated);
            &own
        };
        let n = eliminated.len();
        let matrix =
            SymbolicSparseColMatRef::new_checked(n, n, &among.column_start, None, &among.rows);
        let settings = CholeskySymbolicParams {
            // Also of equations that are not coupled, which cost nothing.
            supernodal_flop_ratio_threshold: SupernodalThreshold(f64::NEG_INFINITY),
            ..Default::default()
        };
        let chosen = order::choose(pattern, eliminated, lines, || minimum_degree(matrix))?;
        let (forward, inverse);
        let ordering = match chosen {
            Order::MinimumDegree => SymmetricOrdering::Amd,
            Order::Given(order) => {
                inverse = order::places(&order);
                forward = order;
                SymmetricOrdering::Custom(PermRef::new_checked(&forward, &inverse, n))
            }
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
        let starts = supernodal.supernode_begin().iter();
        let starts = starts.map(|&start| start as usize);
        Ok(Self {
            order: order.iter().map(|&new| eliminated[new as usize]).collect(),
            starts: starts.chain([n]).collect(),
            rows: (0..supernodal.n_supernodes())
                .map(|s| supernodal.supernode(s).pattern().to_vec())
                .collect(),
        })
    }
}

/// Approximate minimum degree (Amestoy, Davis & Duff 1996).
fn minimum_degree(matrix: SymbolicSparseColMatRef<'_, u32>) -> Result<Vec<u32>, Singular> {
    let n = matrix.nrows();
    let entries = matrix.row_idx().len();
    let (mut forward, mut inverse) = (vec![0; n], vec![0; n]);
    let mut memory = MemBuffer::new(amd::order_scratch::<u32>(n, entries));
    amd::order(
        &mut forward,
        &mut inverse,
        matrix,
        amd::Control::default(),
        MemStack::new(&mut memory),
    )
    .map_err(|_| Singular)?;
    Ok(forward)
}
