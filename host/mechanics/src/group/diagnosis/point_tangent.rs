//! The tangent of one point, held against differences of the law's own answers.

use crate::group::Group;
use law::Operator;

/// Sizes of the differences, relative to the increment of the gradients.
const DIFFERENCES: [f64; 4] = [1e-2, 1e-3, 1e-4, 1e-6];
/// Share of the largest entry that a tangent may be off before it is called wrong: differences
/// across a branch of the law are.
const WRONG: f64 = 0.1;

/// Defect of a law's tangent at a point.
#[derive(Clone, Debug, PartialEq)]
pub enum Fault {
    /// The tangent is not the derivative of the law's stress: difference, relative to the largest
    /// entry, and the components.
    Tangent(f64, [String; 2]),
    /// The tangent is not what the stress does as the increment goes on: difference, relative to
    /// the larger of both. An elastic tangent of a law that flows is like that: it is the slope of
    /// unloading.
    Onward(f64),
    /// The stress answers a strain with the opposite sign: the slope, and the component.
    Sign(f64, String),
}

impl std::fmt::Display for Fault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Tangent(relative, [row, column]) => write!(
                f,
                "the tangent of the law differs from differences of its own stress by {:.0} % in \
                 ({row}, {column}): Newton iterations cannot settle with it",
                100.0 * relative
            ),
            Self::Onward(relative) => write!(
                f,
                "the tangent of the law differs by {:.0} % from what its stress does as the increment \
                 goes on (an elastic tangent of a law that flows does): `tangents = \"differences\"` does \
                 without it",
                100.0 * relative
            ),
            Self::Sign(slope, component) => write!(
                f,
                "the law answers with the wrong sign: a strain (jump) in {component} lowers its own \
                 stress (traction), by {slope:.3e} per unit"
            ),
        }
    }
}

impl Group {
    /// Defect of the law's tangent at a point, if any, from its last start to its last end.
    pub fn tangent_fault(&self, point: usize, time: f64, time_increment: f64) -> Option<Fault> {
        let law = &self.law.built.law;
        let n = law.n_components();
        let gradient = self.gradient();
        let start = gradient.committed.get(n * point..n * (point + 1))?;
        let end = gradient.trial.get(n * point..n * (point + 1))?;
        let answer = |end: &[f64], operator: Operator| {
            self.answer(point, end, operator, (time, time_increment))
        };
        let (here, matrix) = answer(end, Operator::Consistent)?;
        let moves = start.iter().zip(end).map(|(a, b)| (b - a).abs());
        let reach = moves.fold(0.0, f64::max);
        let reach = if reach > 0.0 { reach } else { 1e-6 };
        // Of every entry the slope that comes closest to the tangent: one side of a kink may be
        // all that it is the derivative of.
        let mut slopes = vec![f64::INFINITY; n * n];
        let sizes = DIFFERENCES.iter().map(|size| size * reach);
        for j in 0..n {
            for h in sizes.clone().flat_map(|h| [h, -h]) {
                let mut moved = end.to_vec();
                moved[j] += h;
                let Some((there, _)) = answer(&moved, Operator::None) else {
                    continue;
                };
                for i in 0..n {
                    let slope = (there[i] - here[i]) / (moved[j] - end[j]);
                    let closest = &mut slopes[i * n + j];
                    if (slope - matrix[i * n + j]).abs() < (*closest - matrix[i * n + j]).abs() {
                        *closest = slope;
                    }
                }
            }
        }
        let names = law.hypothesis().components();
        let name = |i: usize| names[i].to_string();
        let onward: Vec<f64> = start.iter().zip(end).map(|(a, b)| b - a).collect();
        let slope_onward = |size: &f64| {
            let moved: Vec<f64> = end.iter().zip(&onward).map(|(e, d)| e + size * d).collect();
            let (there, _) = answer(&moved, Operator::None)?;
            let differences = there.iter().zip(&here).map(|(a, b)| a - b);
            Some(differences.map(|difference| difference / size).collect())
        };
        let slopes_onward: Vec<Vec<f64>> = DIFFERENCES.iter().filter_map(slope_onward).collect();
        let of_entries = fault(n, &matrix, &slopes);
        let of_entries = of_entries.map(|fault| match fault {
            (relative, [i, j]) if i != n => Fault::Tangent(relative, [name(i), name(j)]),
            (slope, [_, j]) => Fault::Sign(slope, name(j)),
        });
        of_entries.or_else(|| off_onward(&matrix, &onward, &slopes_onward).map(Fault::Onward))
    }
}

/// How far the tangent times the increment is from all of some slopes of the stress along it, if that
/// is too far.
fn off_onward(matrix: &[f64], onward: &[f64], slopes: &[Vec<f64>]) -> Option<f64> {
    let n = onward.len();
    let norm = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let expected: Vec<f64> = matrix
        .chunks_exact(n)
        .map(|row| row.iter().zip(onward).map(|(c, d)| c * d).sum())
        .collect();
    let off = slopes.iter().map(|slope| {
        let difference: Vec<f64> = slope.iter().zip(&expected).map(|(a, b)| a - b).collect();
        norm(&difference) / norm(slope).max(norm(&expected)).max(f64::MIN_POSITIVE)
    });
    let least = off.fold(f64::INFINITY, f64::min);
    (least.is_finite() && least > WRONG).then_some(least)
}

/// The worst entry of a tangent compared with slopes of the stress, and its place; or, if it is
/// right and no stress opposes its own strain, the smallest slope, its component, and `n`.
fn fault(n: usize, matrix: &[f64], slopes: &[f64]) -> Option<(f64, [usize; 2])> {
    let known = |at: &usize| slopes[*at].is_finite();
    let largest = (0..n * n).filter(known).fold(0.0_f64, |m, at| {
        m.max(matrix[at].abs()).max(slopes[at].abs())
    });
    if largest <= 0.0 {
        return None;
    }
    let off = |at: usize| (slopes[at] - matrix[at]).abs() / largest;
    let worst = (0..n * n)
        .filter(known)
        .max_by(|&a, &b| off(a).total_cmp(&off(b)))?;
    if off(worst) > WRONG {
        return Some((off(worst), [worst / n, worst % n]));
    }
    let own = |i: usize| slopes[i * n + i];
    let least = (0..n).min_by(|&a, &b| own(a).total_cmp(&own(b)))?;
    let none_opposes = (0..n).all(|i| own(i) <= 0.0);
    (none_opposes && own(least) < -WRONG * largest).then(|| (own(least), [n, least]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tangent_is_held_against_slopes() {
        let right = [4.0, 1.0, 1.0, 2.0];
        assert_eq!(fault(2, &right, &right), None);
        // A shear stiffness with the sign reversed is twice itself off.
        let reversed = [4.0, 1.0, 1.0, -2.0];
        assert_eq!(fault(2, &reversed, &right), Some((1.0, [1, 1])));
        // Softening in shear is no fault; a normal stress that helps its strain is one.
        let softening = [4.0, 1.0, 1.0, -2.0];
        assert_eq!(fault(2, &softening, &softening), None);
        let wrong = [-4.0, 0.0, 0.0, -2.0];
        assert_eq!(fault(2, &wrong, &wrong), Some((-4.0, [2, 0])));
        // Nothing is known where the law fails on both sides.
        assert_eq!(fault(1, &[1.0], &[f64::INFINITY]), None);
    }

    #[test]
    fn an_elastic_tangent_of_a_law_that_flows_is_told_by_its_increment() {
        // Along the increment (1, 0) the stress rises by a tenth of what the tangent says.
        let matrix = [10.0, 0.0, 0.0, 5.0];
        let off = off_onward(&matrix, &[1.0, 0.0], &[vec![1.0, 0.0], vec![1.1, 0.0]]);
        assert!((off.unwrap() - 0.89).abs() < 1e-12);
        let right = off_onward(&matrix, &[1.0, 0.0], &[vec![1.0, 0.0], vec![9.99, 0.0]]);
        assert_eq!(right, None);
    }
}
