//! Double-double numbers: about 31 digits, by the crate `qd`, and what it lacks.

use qd::Quad;

/// A number of twice the digits.
pub(crate) type Wide = Quad<f64>;

/// A double unchanged.
pub(crate) fn wide(value: f64) -> Wide {
    Quad(value, 0.0)
}

/// Square root, of 0 too.
pub(crate) fn sqrt(x: Wide) -> Wide {
    if x.0 <= 0.0 { wide(0.0) } else { x.sqrt() }
}

/// Sine and cosine of an angle from 0 to 90 degrees. Near 90 the complement is taken, which is exact
/// for a double.
pub(crate) fn sin_cos(degrees: f64) -> (Wide, Wide) {
    let series = |degrees: f64| {
        let x = wide(degrees) * Wide::PI / wide(180.0);
        let (mut sin, mut cos) = (wide(0.0), wide(0.0));
        let mut term = wide(1.0);
        for k in 0..40 {
            let sum = if k % 2 == 0 { &mut cos } else { &mut sin };
            *sum = if k % 4 < 2 { *sum + term } else { *sum - term };
            term = term * x / wide(f64::from(k + 1));
        }
        (sin, cos)
    };
    if degrees > 45.0 {
        let (sin, cos) = series(90.0 - degrees);
        (cos, sin)
    } else {
        series(degrees)
    }
}

/// Eigenvalues of a symmetric matrix and their unit vectors, column by column, by Jacobi rotations.
pub(crate) fn eigen(mut a: [[Wide; 3]; 3]) -> ([Wide; 3], [[Wide; 3]; 3]) {
    let one = wide(1.0);
    let mut v = [[wide(0.0); 3]; 3];
    for (i, row) in v.iter_mut().enumerate() {
        row[i] = one;
    }
    let largest = a.iter().flatten().map(|x| x.0.abs()).fold(0.0, f64::max);
    for _ in 0..40 {
        let off = a[0][1].0.abs().max(a[0][2].0.abs()).max(a[1][2].0.abs());
        if off <= 1e-33 * largest {
            break;
        }
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if a[p][q].0 == 0.0 {
                continue;
            }
            let ratio = (a[q][q] - a[p][p]) / (a[p][q] * wide(2.0));
            let root = sqrt(ratio * ratio + one);
            let tan = if ratio.0 >= 0.0 {
                one / (ratio + root)
            } else {
                -one / (root - ratio)
            };
            let cos = one / sqrt(tan * tan + one);
            let sin = tan * cos;
            for k in 0..3 {
                let (x, y) = (a[k][p], a[k][q]);
                a[k][p] = cos * x - sin * y;
                a[k][q] = sin * x + cos * y;
            }
            for k in 0..3 {
                let (x, y) = (a[p][k], a[q][k]);
                a[p][k] = cos * x - sin * y;
                a[q][k] = sin * x + cos * y;
            }
            for row in &mut v {
                let (x, y) = (row[p], row[q]);
                row[p] = cos * x - sin * y;
                row[q] = sin * x + cos * y;
            }
        }
    }
    ([a[0][0], a[1][1], a[2][2]], v)
}

#[test]
fn has_twice_the_digits() {
    // e to 32 digits, in two doubles.
    let e = wide(1.0).exp() - Quad(std::f64::consts::E, 1.445_646_891_729_250_2e-16);
    assert!(e.0.abs() < 1e-30, "{e:?}");
    let half = sin_cos(30.0).0 - wide(0.5);
    assert!(half.0.abs() < 1e-31, "{half:?}");
    let third = sin_cos(60.0).0 - sqrt(wide(0.75));
    assert!(third.0.abs() < 1e-31, "{third:?}");
    let (sin, cos) = sin_cos(89.999_999);
    assert!((sin * sin + cos * cos - wide(1.0)).0.abs() < 1e-31);
    let a = [[2.0, 1.0, 0.5], [1.0, 2.0, 0.25], [0.5, 0.25, 1.0]].map(|r| r.map(wide));
    let (values, v) = eigen(a);
    for i in 0..3 {
        for j in 0..3 {
            let back = (0..3).fold(wide(0.0), |s, k| s + v[i][k] * values[k] * v[j][k]);
            assert!((back - a[i][j]).0.abs() < 1e-30);
        }
    }
}
