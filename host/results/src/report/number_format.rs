//! Numbers as the page shows them.

use serde::{Serialize, Serializer};

/// A number in the page's JSON: seven digits; null if it is missing or not finite.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Short(pub(super) Option<f64>);

impl From<f64> for Short {
    fn from(value: f64) -> Self {
        Self(Some(value))
    }
}

impl Serialize for Short {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Some(value) = self.0.filter(|value| value.is_finite()) else {
            return serializer.serialize_none();
        };
        let value = rounded(value, 7);
        if value.fract() == 0.0 && value.abs() < 1e9 {
            serializer.serialize_i64(value as i64)
        } else {
            serializer.serialize_f64(value)
        }
    }
}

/// Powers of ten. Those from 1 on are exact.
const POWERS: [f64; 45] = [
    1e-22, 1e-21, 1e-20, 1e-19, 1e-18, 1e-17, 1e-16, 1e-15, 1e-14, 1e-13, 1e-12, 1e-11, 1e-10,
    1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7,
    1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22,
];
/// Position of 1 among them.
const ONE: usize = 22;

/// The power of ten of the first digit; of what is less than a last bit from a power of ten either of both.
fn exponent(size: f64) -> i32 {
    if (POWERS[0]..POWERS[2 * ONE]).contains(&size) {
        POWERS.partition_point(|power| *power <= size) as i32 - 1 - ONE as i32
    } else {
        size.log10().floor() as i32
    }
}

/// A number with this many digits.
fn rounded(value: f64, digits: i32) -> f64 {
    if value == 0.0 || !value.is_finite() {
        return value;
    }
    let places = digits - 1 - exponent(value.abs());
    let known = POWERS.get(ONE + places.unsigned_abs() as usize);
    let power = known.copied().unwrap_or(f64::NAN);
    // Powers of ten up to 10²² are exact: quotient and product are what the digits read as.
    match places {
        0..=22 => (value * power).round() / power,
        -22..0 => (value / power).round() * power,
        _ => format!("{value:.*e}", digits as usize - 1)
            .parse()
            .unwrap_or(value),
    }
}

/// A number in a table: six digits.
pub(super) fn display(value: f64) -> String {
    let value = rounded(value, 6);
    if value == 0.0 || (1e-4..1e7).contains(&value.abs()) {
        format!("{value}")
    } else {
        format!("{value:e}")
    }
}

/// Entries of `n` to show if at most about `most` can be: evenly spaced, the first and the
/// last included, and those that must be, unless they alone are too many.
pub(super) fn thinned(n: usize, most: usize, must: impl Fn(usize) -> bool) -> Vec<usize> {
    if n <= most {
        return (0..n).collect();
    }
    let stride = n.div_ceil(most.max(1)).max(1);
    let fits = (0..n).filter(|&i| must(i)).count() <= most.max(1);
    (0..n)
        .filter(|&i| i == 0 && most > 1 || (n - 1 - i).is_multiple_of(stride) || fits && must(i))
        .collect()
}

/// Minima and maxima of columns, by each of this many parts of the rows: what a curve's peaks
/// are made of. Not ascending.
pub(super) fn extremes(columns: &[Vec<f64>], n_rows: usize, parts: usize) -> Vec<usize> {
    let length = n_rows.div_ceil(parts.max(1)).max(1);
    let mut found = Vec::new();
    for column in columns {
        for (part, values) in column.chunks(length).enumerate() {
            let numbers = || values.iter().enumerate().filter(|(_, v)| v.is_finite());
            let ends = [
                numbers().min_by(|a, b| a.1.total_cmp(b.1)),
                numbers().max_by(|a, b| a.1.total_cmp(b.1)),
            ];
            let ends = ends.into_iter().flatten();
            found.extend(ends.map(|(row, _)| part * length + row));
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_never_nan() {
        let json = |value: f64| serde_json::to_string(&Short::from(value)).unwrap();
        assert_eq!(json(1.0 / 3.0), "0.3333333");
        assert_eq!(json(-100.0), "-100");
        assert_eq!(json(-0.0), "0");
        assert_eq!(json(1.234_567_89e-12), "1.234568e-12");
        assert_eq!(json(f64::NAN), "null");
        assert_eq!(json(f64::NEG_INFINITY), "null");
        assert_eq!(serde_json::to_string(&Short(None)).unwrap(), "null");
    }

    #[test]
    fn digits_are_those_of_the_decimal_number() {
        for exponent in -40..40 {
            for digits in [
                1.0,
                1.234_567_4,
                9.999_999_7,
                6.022_140_76,
                std::f64::consts::PI,
            ] {
                for value in [digits, -digits].map(|value| value * 10_f64.powi(exponent)) {
                    let written: f64 = format!("{value:.6e}").parse().unwrap();
                    assert_eq!(rounded(value, 7).to_bits(), written.to_bits(), "{value:e}");
                }
            }
        }
        assert_eq!(
            rounded(f64::MIN_POSITIVE, 7).to_bits(),
            2.225_074e-308_f64.to_bits()
        );
    }

    #[test]
    fn tables_have_six_digits() {
        assert_eq!(display(8.967_888_247), "8.96789");
        assert_eq!(display(210e6), "2.1e8");
        assert_eq!(display(-2.03e-11), "-2.03e-11");
        assert_eq!(display(0.0), "0");
    }

    #[test]
    fn thinning_keeps_the_last_and_what_it_must() {
        assert_eq!(thinned(3, 10, |_| false), [0, 1, 2]);
        assert_eq!(thinned(10, 3, |i| i == 2), [0, 1, 2, 5, 9]);
        assert_eq!(thinned(10, 1, |_| true), [9]);
        assert!(thinned(0, 3, |_| true).is_empty());
    }

    #[test]
    fn extremes_of_every_part_are_found() {
        let hill = vec![0.0, 3.0, 1.0, f64::NAN, 5.0, -1.0];
        let mut found = extremes(&[hill], 6, 2);
        found.sort_unstable();
        assert_eq!(found, [0, 1, 4, 5]);
        assert!(extremes(&[vec![f64::NAN]], 1, 1).is_empty());
        assert!(extremes(&[vec![]], 0, 3).is_empty());
    }
}
