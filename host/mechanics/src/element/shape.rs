//! Shape functions of the 8-node quad and the 3-node line, and Gauss rules.

/// Points and weights of the Gauss rule with `n` points on (−1, 1); exact to degree 2n − 1.
///
/// # Panics
/// If `n` is not 1, 2 or 3.
#[expect(clippy::panic, reason = "`n` comes from this program's own tables")]
pub fn gauss(n: usize) -> (&'static [f64], &'static [f64]) {
    // 1/√3 and √(3/5).
    match n {
        1 => (&[0.0], &[2.0]),
        2 => (
            &[-0.577_350_269_189_625_8, 0.577_350_269_189_625_8],
            &[1.0, 1.0],
        ),
        3 => (
            &[-0.774_596_669_241_483_4, 0.0, 0.774_596_669_241_483_4],
            &[5.0 / 9.0, 8.0 / 9.0, 5.0 / 9.0],
        ),
        _ => panic!("there is no Gauss rule with {n} points here"),
    }
}

/// Shape functions of the 8-node quad at (ξ, η), and their derivatives by ξ and η.
pub(super) fn quad_shape(xi: f64, eta: f64) -> ([f64; 8], [[f64; 8]; 2]) {
    const CORNERS: [[f64; 2]; 4] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    let mut n = [0.0; 8];
    let mut d = [[0.0; 8]; 2];
    for (i, [a, b]) in CORNERS.into_iter().enumerate() {
        let (x, y) = (a * xi, b * eta);
        n[i] = 0.25 * (1.0 + x) * (1.0 + y) * (x + y - 1.0);
        d[0][i] = 0.25 * a * (1.0 + y) * (2.0 * x + y);
        d[1][i] = 0.25 * b * (1.0 + x) * (x + 2.0 * y);
    }
    for (i, b) in [(4, -1.0), (6, 1.0)] {
        n[i] = 0.5 * (1.0 - xi * xi) * (1.0 + b * eta);
        d[0][i] = -xi * (1.0 + b * eta);
        d[1][i] = 0.5 * b * (1.0 - xi * xi);
    }
    for (i, a) in [(5, 1.0), (7, -1.0)] {
        n[i] = 0.5 * (1.0 - eta * eta) * (1.0 + a * xi);
        d[0][i] = 0.5 * a * (1.0 - eta * eta);
        d[1][i] = -eta * (1.0 + a * xi);
    }
    (n, d)
}

/// Shape functions of the 3-node line (ends, middle) at ξ, and their derivatives.
pub fn line_shape(xi: f64) -> ([f64; 3], [f64; 3]) {
    (
        [0.5 * xi * (xi - 1.0), 0.5 * xi * (xi + 1.0), 1.0 - xi * xi],
        [xi - 0.5, xi + 0.5, -2.0 * xi],
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn shape_functions_sum_to_one_and_are_one_at_their_node() {
        let (n, d) = quad_shape(0.3, -0.7);
        assert_relative_eq!(n.iter().sum::<f64>(), 1.0, epsilon = 1e-15);
        for derivative in d {
            assert_relative_eq!(derivative.iter().sum::<f64>(), 0.0, epsilon = 1e-15);
        }
        let nodes = [
            (-1.0, -1.0),
            (1.0, -1.0),
            (1.0, 1.0),
            (-1.0, 1.0),
            (0.0, -1.0),
            (1.0, 0.0),
            (0.0, 1.0),
            (-1.0, 0.0),
        ];
        for (i, (xi, eta)) in nodes.into_iter().enumerate() {
            let (n, _) = quad_shape(xi, eta);
            for j in 0..8 {
                assert_relative_eq!(n[j], f64::from(u8::from(i == j)), epsilon = 1e-15);
            }
        }
    }

    #[test]
    fn derivatives_agree_with_differences() {
        let h = 1e-6;
        let (_, d) = quad_shape(0.3, -0.7);
        let (east, west) = (quad_shape(0.3 + h, -0.7).0, quad_shape(0.3 - h, -0.7).0);
        let (north, south) = (quad_shape(0.3, -0.7 + h).0, quad_shape(0.3, -0.7 - h).0);
        for i in 0..8 {
            assert_relative_eq!(d[0][i], (east[i] - west[i]) / (2.0 * h), epsilon = 1e-9);
            assert_relative_eq!(d[1][i], (north[i] - south[i]) / (2.0 * h), epsilon = 1e-9);
        }
    }

    #[test]
    fn gauss_rules_are_exact_to_degree_2n_minus_1() {
        for n in 1..=3 {
            let (points, weights) = gauss(n);
            for degree in 0..2 * n as i32 {
                let sum: f64 = points
                    .iter()
                    .zip(weights)
                    .map(|(x, w)| w * x.powi(degree))
                    .sum();
                let exact = if degree % 2 == 0 {
                    2.0 / f64::from(degree + 1)
                } else {
                    0.0
                };
                assert_relative_eq!(sum, exact, epsilon = 1e-14);
            }
        }
    }
}
