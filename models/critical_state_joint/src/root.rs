//! The root of a function of one number between two of its values of different sign.

const MAX_ITERATIONS: usize = 200;

/// The root of a function that is below zero at `low` and not below it at `high`, by Newton's method
/// from `start`, with bisection where it leaves the interval or does not halve its step. `f` returns
/// value and slope; a value within `noise` is zero.
#[inline]
pub(crate) fn between(
    mut low: f64,
    mut high: f64,
    start: f64,
    noise: f64,
    mut f: impl FnMut(f64) -> (f64, f64),
) -> f64 {
    let mut x = start;
    let mut last = high - low;
    for _ in 0..MAX_ITERATIONS {
        let (value, slope) = f(x);
        if value.abs() <= noise {
            break;
        }
        if value < 0.0 {
            low = low.max(x);
        } else {
            high = high.min(x);
        }
        let mut next = x - value / slope;
        if !(next > low && next < high) || (next - x).abs() > 0.5 * last {
            next = 0.5 * (low + high);
        }
        last = (next - x).abs();
        x = next;
        if last <= f64::EPSILON * x.abs() {
            break;
        }
    }
    x
}
