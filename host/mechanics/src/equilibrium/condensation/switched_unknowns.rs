//! Unknowns that some phases of a run prescribe and others do not, such as those of a pile head that is free
//! while the ground is confined and is then pushed down.
//!
//! They are kept with the boundary in all phases: the factors of the interior serve them all. With S
//! condensed onto boundary b, those that are prescribed now h, and those that are free now f,
//!
//! - S_ff Δu_f = Δλ r'_f − S_fb Δu_b − S_fh Δu_h, Δu_h = Δλ ū_h
//!
//! so that the boundary sees
//!
//! - (S_bb + S_bf T) Δu_b = Δλ (r'_b − S_bh ū_h − S_bf t_f) + Δf_b, T = −S_ff⁻¹ S_fb,
//!   t_f = S_ff⁻¹ (r'_f − S_fh ū_h)
//!
//! and Δu_f = Δλ t_f + T Δu_b.

use crate::assembly::System;
use crate::group::Group;
use algebra::{Factors, Singular, add_product};

/// They are kept if they are at most this fraction of the unknowns where condensed groups and others meet: all
/// dense work grows with them.
const FEW: f64 = 0.125;

/// Degrees of freedom that are prescribed.
#[derive(Clone, Copy, Debug)]
pub struct Held<'h> {
    /// In the present phase.
    pub now: &'h [bool],
    /// In some phases of the run, but not in all of them.
    pub sometimes: &'h [bool],
}

impl Held<'_> {
    /// Those of some phases only, if that saves time with the groups that are `condensed`; else none.
    pub(super) fn kept(&self, (groups, condensed): (&[Group], &[bool])) -> Vec<bool> {
        let mut nodes = [
            vec![false; self.now.len() / 2],
            vec![false; self.now.len() / 2],
        ];
        let numbered = groups.iter().zip(condensed);
        for (group, &condensed) in numbered.filter(|(group, _)| group.is_active) {
            for node in group.nodes() {
                nodes[usize::from(condensed)][node] = true;
            }
        }
        let [others, own] = nodes;
        let shared = own
            .iter()
            .zip(&others)
            .filter(|(own, other)| **own && **other);
        let numbered = self.sometimes.iter().enumerate();
        let kept: Vec<bool> = numbered.map(|(dof, is)| *is && own[dof / 2]).collect();
        let n_kept = kept.iter().filter(|is| **is).count();
        if n_kept as f64 <= FEW * 2.0 * shared.count() as f64 {
            kept
        } else {
            vec![false; kept.len()]
        }
    }

    /// Those of the present phase without the ones that are kept.
    pub(super) fn but_for(&self, kept: &[bool]) -> Vec<bool> {
        self.now
            .iter()
            .zip(kept)
            .map(|(now, kept)| *now && !kept)
            .collect()
    }
}

/// The unknowns kept with the boundary in one phase.
#[derive(Debug)]
pub(super) struct Aside {
    /// Number of all that are kept.
    n: usize,
    /// Places of the boundary among them, ascending.
    boundary: Vec<usize>,
    /// Places of those that are prescribed.
    held: Vec<usize>,
    /// Their degrees of freedom, ascending.
    held_dofs: Vec<usize>,
    /// Places of those that are free.
    free: Vec<usize>,
    /// S_ff.
    factors: Factors,
    /// T, column by column.
    follows: Vec<f64>,
    /// ū_h and t_f, at their places.
    rate: Vec<f64>,
}

impl Aside {
    /// From the stiffness of all that is kept, column-major, and their degrees of freedom; with the boundary's
    /// own stiffness.
    ///
    /// # Errors
    /// [`Singular`] if what is free is held by nothing.
    pub(super) fn new(
        stiffness: &[f64],
        dofs: &[usize],
        prescribed: &[bool],
        rest: &System,
    ) -> Result<(Self, Vec<f64>), Singular> {
        let n = dofs.len();
        let (mut boundary, mut held, mut free) = (Vec::new(), Vec::new(), Vec::new());
        for (place, dof) in dofs.iter().enumerate() {
            if prescribed[*dof] {
                held.push(place);
            } else if rest.boundary().binary_search(dof).is_ok() {
                boundary.push(place);
            } else {
                free.push(place);
            }
        }
        let part = |rows: &[usize], columns: &[usize]| -> Vec<f64> {
            let columns = columns.iter().map(|&column| &stiffness[column * n..][..n]);
            columns
                .flat_map(|column| rows.iter().map(|&row| column[row]))
                .collect()
        };
        let factors = Factors::new(part(&free, &free), free.len())?;
        let mut own = part(&boundary, &boundary);
        let mut follows = Vec::new();
        if !free.is_empty() {
            let towards_free = part(&boundary, &free);
            for (column, own) in boundary
                .iter()
                .zip(own.chunks_exact_mut(boundary.len().max(1)))
            {
                let column = &stiffness[column * n..][..n];
                let right: Vec<f64> = free.iter().map(|&row| -column[row]).collect();
                let follow = factors.solve(&right);
                add_product(towards_free.chunks_exact(own.len()), &follow, own);
                follows.extend(follow);
            }
        }
        let aside = Self {
            n,
            held_dofs: held.iter().map(|&place| dofs[place]).collect(),
            boundary,
            held,
            free,
            factors,
            follows,
            rate: vec![0.0; n],
        };
        Ok((aside, own))
    }

    /// Forces per λ on the boundary, from those on all that is kept, r', and the displacements per λ that are
    /// prescribed, by degree of freedom.
    pub(super) fn condense(
        &mut self,
        stiffness: &[f64],
        forces: &[f64],
        prescribed: &[f64],
    ) -> Vec<f64> {
        let mut left = forces.to_vec();
        let mut take_off = |places: &[usize], rates: &[f64]| {
            let columns = places
                .iter()
                .map(|&place| &stiffness[place * self.n..][..self.n]);
            let moved: Vec<f64> = rates.iter().map(|rate| -rate).collect();
            add_product(columns, &moved, &mut left);
            at(&self.free, &left)
        };
        let of_held: Vec<f64> = self.held_dofs.iter().map(|&dof| prescribed[dof]).collect();
        let right = take_off(&self.held, &of_held);
        let of_free = self.factors.solve(&right);
        take_off(&self.free, &of_free);
        put(&self.held, &of_held, &mut self.rate);
        put(&self.free, &of_free, &mut self.rate);
        at(&self.boundary, &left)
    }

    /// How far all that is kept has moved while λ rose and the boundary moved.
    pub(super) fn moved(&self, rise: f64, boundary: &[f64]) -> Vec<f64> {
        let mut moved: Vec<f64> = self.rate.iter().map(|rate| rise * rate).collect();
        let mut free = at(&self.free, &moved);
        if !free.is_empty() {
            add_product(self.follows.chunks_exact(free.len()), boundary, &mut free);
        }
        put(&self.free, &free, &mut moved);
        put(&self.boundary, boundary, &mut moved);
        moved
    }

    /// How far it moves under forces on all that is kept, if the boundary stays.
    pub(super) fn corrections(&self, forces: &[f64]) -> Vec<f64> {
        let mut moved = vec![0.0; self.n];
        put(
            &self.free,
            &self.factors.solve(&at(&self.free, forces)),
            &mut moved,
        );
        moved
    }
}

/// Values at some places.
fn at(places: &[usize], values: &[f64]) -> Vec<f64> {
    places.iter().map(|&place| values[place]).collect()
}

/// Puts values at their places.
fn put(places: &[usize], values: &[f64], to: &mut [f64]) {
    for (&place, value) in places.iter().zip(values) {
        to[place] = *value;
    }
}
