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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_part_has_one_number() {
        for (n, seed) in [(1, 0), (7, 3), (100, 42), (1000, u64::MAX >> 1)] {
            let mut seen = vec![0; n];
            for x in stratified(n, &mut Random::of(seed, 1)) {
                seen[(x * n as f64) as usize] += 1;
            }
            assert!(seen.iter().all(|&count| count == 1), "{n} {seed}");
        }
        let of = |seed, dimension| stratified(9, &mut Random::of(seed, dimension));
        assert_eq!(of(7, 0), of(7, 0));
        assert_ne!(of(7, 0), of(8, 0));
        assert_ne!(of(7, 0), of(7, 1));
    }
}
