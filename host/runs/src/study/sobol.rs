//! The points of Sobol': a sequence that fills the unit cube evenly. Each of 2^k equal parts of a
//! coordinate holds one of the first 2^k points, and many boxes of several coordinates hold as many
//! points as is their due.
//!
//! Direction numbers: `new-joe-kuo-6.21201` of S. Joe & F. Y. Kuo, "Constructing Sobol sequences with better
//! two-dimensional projections", SIAM J. Sci. Comput. 30, 2635–2654 (2008). Order of the points: the Gray
//! code of I. A. Antonov & V. M. Saleev (1979), in which they are published.

/// For every dimension behind the first: degree of the primitive polynomial, its inner coefficients as the
/// bits of a number, initial direction numbers.
const DIRECTIONS: [(u32, u32, &[u32]); 30] = [
    (1, 0, &[1]),
    (2, 1, &[1, 3]),
    (3, 1, &[1, 3, 1]),
    (3, 2, &[1, 1, 1]),
    (4, 1, &[1, 1, 3, 3]),
    (4, 4, &[1, 3, 5, 13]),
    (5, 2, &[1, 1, 5, 5, 17]),
    (5, 4, &[1, 1, 5, 5, 5]),
    (5, 7, &[1, 1, 7, 11, 19]),
    (5, 11, &[1, 1, 5, 1, 1]),
    (5, 13, &[1, 1, 1, 3, 11]),
    (5, 14, &[1, 3, 5, 5, 31]),
    (6, 1, &[1, 3, 3, 9, 7, 49]),
    (6, 13, &[1, 1, 1, 15, 21, 21]),
    (6, 16, &[1, 3, 1, 13, 27, 49]),
    (6, 19, &[1, 1, 1, 15, 7, 5]),
    (6, 22, &[1, 3, 1, 15, 13, 25]),
    (6, 25, &[1, 1, 5, 5, 19, 61]),
    (7, 1, &[1, 3, 7, 11, 23, 15, 103]),
    (7, 4, &[1, 3, 7, 13, 13, 15, 69]),
    (7, 7, &[1, 1, 3, 13, 7, 35, 63]),
    (7, 8, &[1, 3, 5, 9, 1, 25, 53]),
    (7, 14, &[1, 3, 1, 13, 9, 35, 107]),
    (7, 19, &[1, 3, 1, 5, 27, 61, 31]),
    (7, 21, &[1, 1, 5, 11, 19, 41, 61]),
    (7, 28, &[1, 3, 5, 3, 3, 13, 69]),
    (7, 31, &[1, 1, 7, 13, 1, 19, 1]),
    (7, 32, &[1, 3, 7, 5, 13, 19, 59]),
    (7, 37, &[1, 1, 3, 9, 25, 29, 41]),
    (7, 41, &[1, 3, 5, 13, 23, 1, 55]),
];

/// Most coordinates of a point.
pub(super) const MOST_DIMENSIONS: usize = DIRECTIONS.len() + 1;

/// Binary digits of a coordinate.
const DIGITS: usize = 32;

/// The direction numbers of a dimension, from 0.
fn directions(dimension: usize) -> [u32; DIGITS] {
    let mut v = [0; DIGITS];
    let Some(&(degree, inner, first)) = dimension.checked_sub(1).and_then(|d| DIRECTIONS.get(d))
    else {
        return std::array::from_fn(|i| 1 << (DIGITS - 1 - i));
    };
    let s = degree as usize;
    for i in 0..DIGITS {
        v[i] = if i < s {
            first[i] << (DIGITS - 1 - i)
        } else {
            let own = v[i - s] ^ (v[i - s] >> s);
            (1..s).fold(own, |sum, k| {
                let is_in = (inner >> (s - 1 - k)) & 1;
                sum ^ (is_in * v[i - k])
            })
        };
    }
    v
}

/// One coordinate of the first `n` points, from the origin on, all combined with `shift` (exclusive or). This random
/// digital shift keeps them as even, and moves them away from the corner of all least values (P. L'Ecuyer & C.
/// Lemieux, "Recent advances in randomized quasi-Monte Carlo methods", in: Modeling uncertainty, Kluwer 2002,
/// 419–474).
pub(super) fn coordinate(dimension: usize, n: usize, shift: u32) -> Vec<f64> {
    let directions = directions(dimension);
    let mut x = 0_u32;
    let points = (0..n).map(|i| {
        if i > 0 {
            x ^= directions[i.trailing_zeros() as usize];
        }
        f64::from(x ^ shift) / 2_f64.powi(DIGITS as i32)
    });
    points.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The first ten points in three dimensions, as Joe & Kuo print them with their numbers.
    #[test]
    fn the_first_points_are_the_published_ones() {
        let published = [
            [0.0, 0.0, 0.0],
            [0.5, 0.5, 0.5],
            [0.75, 0.25, 0.25],
            [0.25, 0.75, 0.75],
            [0.375, 0.375, 0.625],
            [0.875, 0.875, 0.125],
            [0.625, 0.125, 0.875],
            [0.125, 0.625, 0.375],
            [0.1875, 0.3125, 0.9375],
            [0.6875, 0.8125, 0.4375],
        ];
        for dimension in 0..3 {
            let expected = published.map(|point| point[dimension]);
            assert_eq!(coordinate(dimension, 10, 0), expected, "{dimension}");
        }
    }

    /// What makes a direction number one: odd, and below 2^i.
    #[test]
    fn direction_numbers_are_odd_and_small() {
        for (degree, inner, first) in DIRECTIONS {
            assert_eq!(first.len(), degree as usize);
            assert!(inner < 1 << (degree - 1));
            for (i, m) in first.iter().enumerate() {
                assert!(m % 2 == 1 && *m < 2 << i, "{first:?}");
            }
        }
    }

    /// One of the first 2^k points lies in each of 2^k equal parts, in every dimension, shifted or not.
    #[test]
    fn each_coordinate_has_one_point_in_each_part() {
        for dimension in 0..MOST_DIMENSIONS {
            for shift in [0, 0x9e37_79b9] {
                for k in [1, 4, 10] {
                    let n = 1 << k;
                    let points = coordinate(dimension, n, shift);
                    let mut seen = vec![0; n];
                    for x in points {
                        seen[(x * n as f64) as usize] += 1;
                    }
                    assert!(seen.iter().all(|&count| count == 1), "{dimension} {k}");
                }
            }
        }
    }

    /// The first two coordinates are a (0, 2)-sequence: of 2^k points one lies in each box of area 2^−k.
    #[test]
    fn two_coordinates_have_one_point_in_each_box() {
        let n = 256_usize;
        let [x, y] = [coordinate(0, n, 0), coordinate(1, n, 0)];
        for a in 0..=8 {
            let (wide, high) = (1 << a, n >> a);
            let mut seen = vec![0; n];
            for (x, y) in x.iter().zip(&y) {
                seen[(x * f64::from(wide)) as usize * high + (y * high as f64) as usize] += 1;
            }
            assert!(seen.iter().all(|&count| count == 1), "{a}");
        }
    }

    /// ∏ (1 + (x_i − ½) / i²) has the integral 1 over the cube. The error falls nearly as 1/n, not as 1/√n:
    /// random points would leave about 0.3/√n.
    #[test]
    fn integrals_are_those_of_even_points() {
        for dimensions in [3, 10, MOST_DIMENSIONS] {
            let error = |n: usize| {
                let mut product = vec![1.0; n];
                for d in 0..dimensions {
                    let weight = ((d + 1) as f64).powi(2);
                    let points = coordinate(d, n, 0);
                    for (p, x) in product.iter_mut().zip(points) {
                        *p *= 1.0 + (x - 0.5) / weight;
                    }
                }
                (product.iter().sum::<f64>() / n as f64 - 1.0).abs()
            };
            let [coarse, fine] = [error(1 << 8), error(1 << 14)];
            // 0.3/√n would be 0.0023 and a factor of 8.
            assert!(
                fine < 1e-4 && fine < coarse / 24.0,
                "{dimensions}: {coarse} {fine}"
            );
        }
    }
}
