//! The balance of all forces on a model: reactions and loads add up to nothing, in each direction
//! and, in the plane, in their moments.
//!
//! The forces inside a body cancel by geometry, whatever the stresses are; so what is left of the
//! sum of reactions and loads is the sum of the residuals r at the unknowns. With n of them and
//! ‖r‖ ≤ τ F, where F are the forces that the residual was measured against,
//!
//! - |Σ r| ≤ √n ‖r‖ ≤ √n τ F,
//!
//! and for moments the same times the farthest lever. F is what is given to the step, not what the
//! iterate makes of it. For several bodies, each with its own F, it is √ΣF². The sums are those that
//! a user sees in the results, plus what is still carried of the forces out of balance at the start.

use crate::equilibrium::{Imbalance, ROUND_OFF, STILL_SMALL};
use crate::problem::Analysis;

/// Forces on a model and what may be left of their sum.
#[derive(Clone, Debug, Default)]
pub(super) struct Balance {
    /// Forces x and y and their moment: of supports, and of loads.
    reactions: [f64; 3],
    loads: [f64; 3],
    /// Sum of the squares of all forces.
    squares: f64,
    /// Unknowns.
    n: usize,
    /// Square of the longest lever.
    lever_square: f64,
}

/// What the residual was measured against, and with what tolerance.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bound {
    pub(super) scale: f64,
    pub(super) tolerance: f64,
    /// The forces of a condensed domain are among those that are added up: they were held against
    /// themselves, and may be much larger than those of the rest.
    pub(super) with_domain: bool,
    /// Forces whose last bit stands for that of the displacements: largest stiffness of a condensed
    /// domain times displacements.
    pub(super) last_bit: f64,
}

impl Balance {
    /// A force at a degree of freedom, with its place relative to the model's middle.
    fn add(&mut self, dof: usize, [x, y]: [f64; 2], force: f64, is_prescribed: bool) {
        let lever = if dof.is_multiple_of(2) { -y } else { x };
        let sums = if is_prescribed {
            &mut self.reactions
        } else {
            self.n += 1;
            &mut self.loads
        };
        sums[dof % 2] += force;
        sums[2] += lever * force;
        self.squares += force * force;
        self.lever_square = self.lever_square.max(x * x + y * y);
    }

    /// The sums that do not balance.
    fn complaint(&self, components: &[usize], bound: Bound) -> Option<Imbalance> {
        let n = f64::sqrt(self.n.max(1) as f64);
        // Stresses of a domain follow from displacements since the start of the phase, whose last
        // bits the iterations do not see.
        let tolerance = if bound.with_domain {
            bound.tolerance.max(STILL_SMALL)
        } else {
            bound.tolerance
        };
        let own = self.squares.sqrt();
        let scale = if bound.with_domain {
            own.max(bound.scale)
        } else {
            bound.scale
        };
        let allowed = n * (tolerance * scale + ROUND_OFF * own.max(scale).max(bound.last_bit));
        let lever = |c: usize| {
            if c == 2 {
                self.lever_square.sqrt()
            } else {
                1.0
            }
        };
        let is_off = |&&c: &&usize| {
            let lever = lever(c);
            let left = self.reactions[c] + self.loads[c];
            left.is_nan() || left.abs() > lever * allowed
        };
        let c = *components.iter().find(is_off)?;
        Some(Imbalance {
            component: c,
            reactions: self.reactions[c],
            loads: self.loads[c],
            allowed: lever(c) * allowed,
        })
    }
}

/// The forces to be balanced.
#[derive(Clone, Copy, Debug)]
pub(super) struct Model<'m> {
    pub(super) analysis: Analysis,
    pub(super) nodes: &'m [[f64; 2]],
    /// Rotations call forth no stresses, so that moments have to balance.
    pub(super) turns_freely: bool,
}

/// The imbalance: internal forces at supports, loads at the unknowns.
pub(super) fn complaint(
    model: Model<'_>,
    supports: impl Iterator<Item = (usize, f64)>,
    unknowns: impl Iterator<Item = (usize, f64)>,
    bound: Bound,
) -> Option<Imbalance> {
    let mut balance = Balance::default();
    let components: &[usize] = match (model.analysis, model.turns_freely) {
        // Radial forces balance those around the circumference.
        (Analysis::Axisymmetric, _) => &[1],
        (_, true) => &[0, 1, 2],
        (_, false) => &[0, 1],
    };
    let n = model.nodes.len().max(1) as f64;
    // Moments are counted about it.
    let middle = if components.contains(&2) {
        [0, 1].map(|c| model.nodes.iter().map(|node| node[c]).sum::<f64>() / n)
    } else {
        [0.0; 2]
    };
    let mut add = |(dof, force): (usize, f64), is_prescribed| {
        let node = model.nodes[dof / 2];
        let at = [node[0] - middle[0], node[1] - middle[1]];
        balance.add(dof, at, force, is_prescribed);
    };
    supports.for_each(|support| add(support, true));
    unknowns.for_each(|unknown| add(unknown, false));
    balance.complaint(components, bound)
}

#[cfg(test)]
mod tests {
    use super::*;

    const NODES: [[f64; 2]; 3] = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0]];
    const BOUND: Bound = Bound {
        scale: 10.0,
        tolerance: 1e-6,
        with_domain: false,
        last_bit: 0.0,
    };

    /// A beam held at both ends of its lower side, with a force at the third node.
    fn beam(supports: [f64; 3], load: [f64; 2], analysis: Analysis) -> Option<Imbalance> {
        let model = Model {
            analysis,
            nodes: &NODES,
            turns_freely: true,
        };
        let supports = [0, 1, 3].into_iter().zip(supports);
        let loads = [4, 5].into_iter().zip(load);
        complaint(model, supports, loads, BOUND)
    }

    #[test]
    fn forces_and_moments_balance() {
        // H = 4 at height 1: the pair of supports takes its moment over the length 2.
        assert_eq!(
            beam([-4.0, -2.0, 2.0], [4.0, 0.0], Analysis::PlaneStrain),
            None
        );
    }

    #[test]
    fn what_does_not_is_named_with_both_sums() {
        let off = beam([-4.0, -2.0, 2.1], [4.0, 0.0], Analysis::PlaneStrain);
        let off = off.unwrap().to_string();
        assert!(off.starts_with("the forces in y do not balance"), "{off}");
        assert!(off.contains("reactions 1.0"), "{off}");
        // Forces balance, moments do not.
        let off = beam([-4.0, 2.0, -2.0], [4.0, 0.0], Analysis::PlaneStrain);
        let off = off.unwrap().to_string();
        assert!(off.starts_with("the moments do not balance"), "{off}");
        // Radial forces and their moments need not.
        assert_eq!(
            beam([-5.0, 2.0, -2.0], [4.0, 0.0], Analysis::Axisymmetric),
            None
        );
        assert!(beam([-4.0, f64::NAN, 2.0], [4.0, 0.0], Analysis::PlaneStrain).is_some());
    }

    #[test]
    fn what_the_tolerance_leaves_is_no_complaint() {
        // √2 unknowns · 1e-6 · 10 = 1.4e-5.
        let with = |rest| beam([-4.0 + rest, -2.0, 2.0], [4.0, 0.0], Analysis::PlaneStrain);
        assert_eq!(with(1.3e-5), None);
        assert!(with(1.5e-5).is_some());
    }
}
