//! What rounding leaves of forces that should cancel.

use super::Newton;
use super::outcome::Iteration;
use super::residual::{Balance, Task};
use crate::assembly::norms;
use law::Operator;

/// The displacement criterion is waived where the residual is this far below its tolerance: a
/// linear step ends after one correction, which is as large as the increment itself.
pub(super) const EXACT: f64 = 1e-3;
/// Largest relative residual that may be round-off.
pub(crate) const STILL_SMALL: f64 = 1e-6;
/// Round-off that a state may have, in changes of its forces by the last bit of the displacement
/// increments.
pub(in crate::equilibrium) const ACCEPTED_ROUND_OFF: f64 = 8.0;
/// Round-off of K u, relative to the forces it is the difference of.
pub(crate) const ROUND_OFF: f64 = 64.0 * f64::EPSILON;

/// Relative residual so small that the last correction adds no information. If the tolerance is near round-off of the
/// forces in play, that is round-off: in a body that need not move, the increment is round-off too and does not measure
/// corrections.
pub(super) fn exact(force_tolerance: f64) -> f64 {
    (EXACT * force_tolerance).max(ROUND_OFF.min(force_tolerance))
}

/// The reference of a residual for which what rounding leaves of these forces is exact.
pub(crate) fn reference_of_round_off(forces: f64, force_tolerance: f64) -> f64 {
    ROUND_OFF / exact(force_tolerance) * forces
}

impl Newton<'_> {
    /// Whether a small residual is one that the last bit of the displacement increments makes, so
    /// that no iteration can lessen it: in all bodies that are not in equilibrium anyway after the
    /// last iteration. A residual within its tolerance while corrections go on is not round-off.
    /// The trial state stays.
    pub(in crate::equilibrium) fn is_round_off(
        &mut self,
        increment: &[f64],
        (balance, last): (&Balance, &Iteration),
        task: &Task,
    ) -> bool {
        if balance.relative > STILL_SMALL || balance.away.contains(&true) {
            return false;
        }
        let operator = self.kept.tangents;
        let mut scattered = last_bit_scattered(increment);
        self.equations.places.follow(&mut scattered);
        let moved = self.evaluate(&scattered, task, Operator::None);
        let again = self.evaluate(increment, task, operator);
        let (Ok(moved), Ok(_)) = (moved, again) else {
            return false;
        };
        let pairs = moved.residual.iter().zip(&balance.residual);
        let change: Vec<f64> = pairs.map(|(a, b)| a - b).collect();
        // The noise of a stiff body excuses nothing in another one.
        let bodies = &self.equations.places.bodies;
        let of = |vector: &[f64]| norms(&bodies.of_equation, bodies.n, vector);
        let sizes = of(&balance.residual).into_iter().zip(of(&change));
        sizes
            .zip(self.in_equilibrium(balance, last))
            .all(|((left, noise), is_there)| is_there || left <= ACCEPTED_ROUND_OFF * noise)
    }
}

/// Displacement increments larger or smaller by their last bit, as the sum over many elements
/// scatters them.
pub(in crate::equilibrium) fn last_bit_scattered(increment: &[f64]) -> Vec<f64> {
    // The top bit of a multiple of 2⁶⁴ / golden ratio: a scatter of signs, the same every time.
    let sign = |i: usize| {
        let top = (i as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 63;
        1.0 - 2.0 * top as f64
    };
    let numbered = increment.iter().enumerate();
    let scattered = numbered.map(|(i, u)| u * (1.0 + sign(i) * f64::EPSILON));
    scattered.collect()
}
