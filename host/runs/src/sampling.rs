//! Random numbers that are the same everywhere and for ever, and points that they spread.

/// SplitMix64 (G. L. Steele, D. Lea & C. H. Flood, OOPSLA 2014).
#[derive(Clone, Debug)]
pub(crate) struct Random(u64);

impl Random {
    /// Numbers of their own for each dimension: one more dimension leaves those of the others alone.
    pub(crate) fn of(seed: u64, dimension: usize) -> Self {
        let mut seeds = Self(seed);
        for _ in 0..dimension {
            seeds.next();
        }
        Self(seeds.next())
    }

    /// The next number.
    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// At least 0 and below 1.
    fn fraction(&mut self) -> f64 {
        (self.next() >> 11) as f64 / 2_f64.powi(53)
    }

    fn below(&mut self, n: usize) -> usize {
        ((u128::from(self.next()) * n as u128) >> 64) as usize
    }
}

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

    /// The first numbers of the reference implementation (S. Vigna) from the seed 1234567.
    #[test]
    fn random_numbers_are_the_published_ones() {
        let mut random = Random(1_234_567);
        let published = [
            6_457_827_717_110_365_317,
            3_203_168_211_198_807_973,
            9_817_491_932_198_370_423,
            4_593_380_528_125_082_431,
            16_408_922_859_458_223_821,
        ];
        assert_eq!(std::array::from_fn(|_| random.next()), published);
    }

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
