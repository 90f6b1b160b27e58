//! The last steps of a phase, and the prediction of the next one.

use crate::equilibrium::{Guess, StepSuccess};
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

/// Highest degree of the polynomial that displacement increments are extrapolated by.
const DEGREE: usize = 3;
/// A polynomial is used if its error in the latest step would have been at most this fraction of
/// that of the increments as they were.
const BETTER: f64 = 0.5;
/// Errors below this fraction of the increments are noise, which polynomials amplify.
const NOISE: f64 = 1e-10;
/// Steps whose lengths differ by less than this fraction are equally long.
const EQUAL: f64 = 1e-9;

/// Steps in equilibrium.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct History {
    /// The latest first.
    steps: VecDeque<Step>,
    /// What the first correction of the latest step that needed one left of the residual, as a
    /// fraction.
    contraction: Option<f64>,
    /// The latest step was a motion of many viscous steps.
    was_motion: bool,
}

/// A step in equilibrium.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Step {
    /// Change of the load factor.
    length: f64,
    /// Displacement increments, by place.
    increment: Vec<f64>,
}

impl History {
    /// Takes a step over.
    pub(super) fn add(&mut self, length: f64, success: StepSuccess) {
        if let [start, first, ..] = success.iterations.as_slice() {
            let is_plain = first.step_length >= 1.0 && first.viscosity <= 0.0;
            self.contraction = is_plain.then(|| first.residual / start.residual);
        }
        self.was_motion = success.was_motion;
        // One more than the polynomial takes: what it would have made of the latest step.
        self.steps.truncate(DEGREE + 1);
        self.steps.push_front(Step {
            length,
            increment: success.increment,
        });
    }

    /// Length and displacement increments (by place) of the latest step.
    pub(super) fn latest(&self) -> Option<(f64, &[f64])> {
        let step = self.steps.front()?;
        Some((step.length, &step.increment))
    }

    /// Predicted increments of a step of this length. They are extrapolated by the polynomial that would have predicted
    /// the latest ones best, or in proportion to the latest if the last steps were not equally long.
    pub(super) fn guess(&self, length: f64) -> Option<Guess> {
        let latest = self.steps.front()?;
        let is_equal = |step: &&Step| (step.length - length).abs() <= EQUAL * length;
        let n_equal = self.steps.iter().take_while(is_equal).count();
        let ratio = length / latest.length;
        let error = |degree: usize| {
            let predicted = self.extrapolated(1, degree);
            let pairs = predicted.iter().zip(&latest.increment);
            pairs.map(|(p, u)| (p - u) * (p - u)).sum::<f64>()
        };
        // A polynomial of degree d takes d + 1 steps, besides the latest. Where the path is smooth,
        // the higher ones are much better.
        let errors: Vec<f64> = (0..n_equal.saturating_sub(1)).map(error).collect();
        let size: f64 = latest.increment.iter().map(|u| u * u).sum();
        let is_better = |degree: &usize| {
            errors[0] > NOISE * NOISE * size && errors[*degree] <= BETTER * BETTER * errors[0]
        };
        let degree = (1..errors.len())
            .filter(is_better)
            .min_by(|&a, &b| errors[a].total_cmp(&errors[b]))
            .unwrap_or(0);
        let increment = match degree {
            0 => latest.increment.iter().map(|u| ratio * u).collect(),
            _ => self.extrapolated(0, degree),
        };
        Some(Guess {
            increment,
            contraction: self.contraction,
            was_motion: self.was_motion,
        })
    }

    /// Increments that follow those of the steps from number `first` on.
    fn extrapolated(&self, first: usize, degree: usize) -> Vec<f64> {
        // Weights (d + 1 over i + 1) with alternating signs: the next difference vanishes.
        let mut sum = vec![0.0; self.steps[first].increment.len()];
        let mut weight = 1.0;
        for (i, step) in self.steps.range(first..=first + degree).enumerate() {
            weight *= -((degree + 1 - i) as f64) / (i + 1) as f64;
            for (sum, u) in sum.iter_mut().zip(&step.increment) {
                *sum -= weight * u;
            }
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::equilibrium::LedBy;

    /// Steps of length 1 with these increments of one displacement, and what is guessed next.
    fn guess(increments: &[f64], length: f64) -> Option<f64> {
        let mut history = History::default();
        for &u in increments {
            let success = StepSuccess {
                increment: vec![u],
                iterations: Vec::new(),
                unreliable: None,
                led_by: LedBy::Newton,
                was_kept: false,
                was_motion: false,
                tolerated: 0.0,
                round_off: 0.0,
                scales: Vec::new(),
                open: None,
            };
            history.add(1.0, success);
        }
        let guess = history.guess(length)?;
        Some(guess.increment[0])
    }

    #[test]
    fn nothing_is_guessed_from_nothing() {
        assert_eq!(guess(&[], 1.0), None);
    }

    #[test]
    fn steps_of_other_lengths_are_guessed_in_proportion() {
        assert_eq!(guess(&[1.0, 4.0, 9.0, 16.0], 0.5), Some(8.0));
    }

    #[test]
    fn a_smooth_path_is_extrapolated() {
        // A straight line, a parabola, a cubic: as soon as the steps before tell which.
        assert_eq!(guess(&[1.0, 2.0], 1.0), Some(2.0));
        assert_eq!(guess(&[1.0, 2.0, 3.0], 1.0), Some(4.0));
        assert_eq!(guess(&[1.0, 4.0, 9.0, 16.0], 1.0), Some(25.0));
        assert_eq!(guess(&[1.0, 8.0, 27.0, 64.0, 125.0], 1.0), Some(216.0));
    }

    #[test]
    fn noise_is_not_extrapolated() {
        assert_eq!(guess(&[1.0 + 1e-12, 1.0 - 1e-12, 1.0], 1.0), Some(1.0));
        assert_eq!(guess(&[1.0, 9.0, 2.0, 7.0], 1.0), Some(7.0));
    }
}
