//! Anderson acceleration: corrections with a matrix that is kept, improved by what the last ones
//! achieved (D. G. Anderson, J. ACM 12, 1965).
//!
//! With a kept matrix K the correction f(u) = K⁻¹ r(u) vanishes at equilibrium, but moving by f
//! approaches it slowly. The last moves s_i changed f by y_i. As if f were linear between them,
//!
//!   δ = f − Σ γ_i (s_i + y_i),   γ from min ‖f − Σ γ_i y_i‖,
//!
//! first goes where f would be least and moves by what is left of f from there.
//!
//! The matrix is renewed where even so there is no progress.

use super::norm;
use super::outcome::Iteration;

/// Moves that are remembered.
const DEPTH: usize = 5;
/// A y_i that is a combination of others up to this share of itself says nothing new.
const INDEPENDENT: f64 = 1e-6;
/// The matrix is renewed where this many iterations (the state before them included) have not brought
/// the residual down to this fraction.
const PATIENCE: usize = 6;
const PROGRESS: f64 = 0.1;

/// Moves so far, the last one at the end.
#[derive(Debug, Default)]
pub(in crate::equilibrium) struct Acceleration {
    /// s_i and y_i, by place.
    moves: Vec<[Vec<f64>; 2]>,
    /// f, and the move taken from there.
    last: Option<[Vec<f64>; 2]>,
    /// Where the iterations with the present matrix start.
    since: usize,
}

impl Acceleration {
    /// Without moves, for a matrix that has been renewed at this iteration.
    pub(in crate::equilibrium) fn since(iteration: usize) -> Self {
        Self {
            since: iteration,
            ..Self::default()
        }
    }

    /// Whether there are no moves to learn from.
    pub(in crate::equilibrium) fn is_empty(&self) -> bool {
        self.moves.is_empty()
    }

    /// Where the iterations with the present matrix start.
    pub(in crate::equilibrium) fn begins(&self) -> usize {
        self.since
    }

    /// Whether the iterations with the present matrix make too little progress.
    pub(in crate::equilibrium) fn stalls(&self, iterations: &[Iteration]) -> bool {
        let Some([before, .., last]) = iterations[self.since..].last_chunk::<PATIENCE>() else {
            return false;
        };
        last.residual > PROGRESS * before.residual
    }

    /// δ from f.
    pub(in crate::equilibrium) fn improve(&mut self, correction: Vec<f64>) -> Vec<f64> {
        if let Some([before, moved]) = self.last.take() {
            if self.moves.len() == DEPTH {
                self.moves.remove(0);
            }
            self.moves.push([moved, difference(&correction, &before)]);
        }
        // Gram–Schmidt, the latest move first; s is carried along with y.
        let mut basis: Vec<[Vec<f64>; 2]> = Vec::new();
        let mut improved = correction.clone();
        let mut rest = correction.clone();
        for [s, y] in self.moves.iter().rev() {
            let (mut s, mut y) = (s.clone(), y.clone());
            let size = norm(&y);
            for [s_done, y_done] in &basis {
                let share = dot(&y, y_done);
                subtract(&mut y, share, y_done);
                subtract(&mut s, share, s_done);
            }
            let left = norm(&y);
            if left <= INDEPENDENT * size {
                continue;
            }
            for value in s.iter_mut().chain(&mut y) {
                *value /= left;
            }
            let gamma = dot(&rest, &y);
            subtract(&mut rest, gamma, &y);
            subtract(&mut improved, gamma, &y);
            subtract(&mut improved, gamma, &s);
            basis.push([s, y]);
        }
        self.last = Some([correction, Vec::new()]);
        improved
    }

    /// This share of δ was taken.
    pub(in crate::equilibrium) fn took(&mut self, improved: &[f64], share: f64) {
        if let Some([_, moved]) = &mut self.last {
            moved.extend(improved.iter().map(|d| share * d));
        }
    }
}

fn difference(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

/// Scalar product.
pub(in crate::equilibrium) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// a −= factor · b.
fn subtract(a: &mut [f64], factor: f64, b: &[f64]) {
    for (a, b) in a.iter_mut().zip(b) {
        *a -= factor * b;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// f = b − A u with a matrix that plain moves by f diverge with.
    fn f(u: &[f64]) -> Vec<f64> {
        let a = [[3.0, 1.0, 0.0], [-1.0, 2.0, 0.5], [0.0, 0.5, 1.5]];
        let product = a.map(|row| dot(&row, u));
        difference(&[1.0, 2.0, 3.0], &product)
    }

    #[test]
    fn linear_equations_of_n_unknowns_take_n_moves_and_one() {
        let mut u = vec![0.0; 3];
        let mut acceleration = Acceleration::default();
        let mut sizes = Vec::new();
        for _ in 0..5 {
            let correction = f(&u);
            sizes.push(norm(&correction));
            let moved = acceleration.improve(correction);
            for (u, d) in u.iter_mut().zip(&moved) {
                *u += d;
            }
            acceleration.took(&moved, 1.0);
        }
        assert!(sizes[3] > 1e-3 && sizes[4] < 1e-12, "{sizes:?}");
    }

    #[test]
    fn a_matrix_stalls_that_was_given_time_and_made_no_progress() {
        let iteration = |residual| Iteration {
            residual,
            correction: None,
            step_length: 1.0,
            viscosity: 0.0,
        };
        let slow = [1.0, 0.9, 0.8, 0.6, 0.4, 0.2].map(iteration);
        assert!(Acceleration::default().stalls(&slow));
        assert!(!Acceleration::since(1).stalls(&slow));
        let fast = [1.0, 0.9, 0.8, 0.6, 0.4, 0.09].map(iteration);
        assert!(!Acceleration::default().stalls(&fast));
    }

    #[test]
    fn a_move_that_says_nothing_new_is_left_out() {
        let mut acceleration = Acceleration::default();
        let first = acceleration.improve(vec![2.0, 0.0]);
        acceleration.took(&first, 1.0);
        // The secant through f(0) = 2 and f(2) = 1 meets zero two further on.
        let second = acceleration.improve(vec![1.0, 0.0]);
        assert_eq!(second, [2.0, 0.0]);
        acceleration.took(&second, 0.5);
        // f(3) = 1/2 is on the same line.
        let third = acceleration.improve(vec![0.5, 0.0]);
        assert!((third[0] - 1.0).abs() < 1e-12, "{third:?}");
    }
}
