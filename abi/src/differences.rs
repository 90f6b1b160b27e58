//! The consistent tangent by central differences, for laws that cannot be written for
//! [dual numbers](crate::dual).

use crate::law::Failure;

/// Length of a step, relative to the size over which a response bends: the cube root of the unit of
/// round-off, where what is cut off and what is rounded weigh the same.
const STEP: f64 = 6e-6;

/// The derivative of an update by its increment, row by row: two evaluations for each component.
/// `size` is a strain or jump over which the response bends, such as strength over stiffness. If
/// the response is smooth over 1e-5 of it and the update is exact to round-off, the error is about
/// 1e-10 of the stiffness. At a kink the result lies between those of its sides.
///
/// # Errors
/// What `update` fails with.
#[inline]
pub fn tangent<const N: usize>(
    increment: &[f64; N],
    size: f64,
    update: impl Fn(&[f64; N]) -> Result<[f64; N], Failure>,
) -> Result<[[f64; N]; N], Failure> {
    let mut operator = [[0.0; N]; N];
    let mut moved = *increment;
    for column in 0..N {
        moved[column] = increment[column] + STEP * size;
        let (up, above) = (moved[column], update(&moved)?);
        moved[column] = increment[column] - STEP * size;
        let (down, below) = (moved[column], update(&moved)?);
        moved[column] = increment[column];
        for row in 0..N {
            operator[row][column] = (above[row] - below[row]) / (up - down);
        }
    }
    Ok(operator)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dual::{self, Number};

    /// A bounded stiffness of 1e5 that depends on both components, with a stress of 100 besides;
    /// it bends over 1e-3.
    fn smooth<T: Number>([x, y]: [T; 2]) -> [T; 2] {
        let (a, b) = (x / 1e-3, y / 1e-3);
        [
            (a + b * 0.3).tanh() * 100.0 - 100.0,
            (a * a + 1.0).sqrt() * 50.0 + b.sin() * 30.0 + 20.0,
        ]
    }

    /// Correct size, and sizes ten times too large or too small.
    #[test]
    fn smooth_responses_are_differentiated_to_eight_digits() {
        for increment in [[0.0; 2], [1e-9, -2e-9], [5e-4, -3e-4], [1e-3, 2e-3]] {
            let (_, exact) = dual::tangent(&increment, |moved| Ok(smooth(moved))).unwrap();
            for (size, bound) in [(1e-3, 1e-9), (1e-2, 1e-8), (1e-4, 1e-8)] {
                let found = tangent(&increment, size, |moved| Ok(smooth(*moved))).unwrap();
                let pairs = found.as_flattened().iter().zip(exact.as_flattened());
                let error = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(error < bound * 1e5, "{increment:?}, size {size}: {error:e}");
            }
        }
    }

    #[test]
    fn a_failure_is_passed_on() {
        let failure = Failure::Domain("no");
        let refuse = |moved: &[f64; 1]| {
            if moved[0] > 0.0 {
                Err(failure)
            } else {
                Ok(*moved)
            }
        };
        assert_eq!(tangent(&[0.0], 1.0, refuse), Err(failure));
    }
}
