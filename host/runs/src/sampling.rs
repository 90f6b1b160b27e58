//! Points that random numbers spread.

use results::random::Random;

/// One coordinate of a Latin hypercube: one number in each of n equal parts of 0 to 1, in random order.
pub(crate) fn stratified(n: usize, random: &mut Random) -> Vec<f64> {
    let mut order: Vec<usize> = (0..n).collect();
    for i in (1..n).rev() {
        order.swap(i, random.below(i + 1));
    }
    let inside = |part: usize| {
        let x = (part as f64 + random.fraction()) / n as f64;
        // Rounding must not carry it into the next part.
        x.min(((part + 1) as f64 / n as f64).next_down())
    };
    order.into_iter().map(inside).collect()
}
