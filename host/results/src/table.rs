//! Numbers as tables have them.

use std::fmt::Write as _;

/// What a number without any digit behind its point lacks.
const REST: &str = ".0000000000000000";

/// A number with 17 significant digits: reading it back gives the same bits.
pub fn number(value: f64) -> String {
    // The shortest digits that read back to the same bits, filled up: much faster than the first
    // 17 digits of the exact value, which are no more exact.
    let mut text = String::with_capacity("-1.2345678901234567e-308".len());
    // A string takes whatever is written.
    let _ = write!(text, "{value:e}");
    if let Some(end) = text.find('e') {
        let digits = end - usize::from(value.is_sign_negative());
        // One digit, or one with a point and more.
        text.insert_str(end, REST.get(digits - 1..).unwrap_or_default());
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_17_digits_and_read_back() {
        let values = [
            0.0,
            -0.0,
            1.0,
            -1.0,
            0.1,
            -2.5e-7,
            1.0 / 3.0,
            f64::MAX,
            f64::MIN_POSITIVE,
            5e-324,
            -1e22,
        ];
        for value in values {
            let text = number(value);
            let digits = text.split('e').next().unwrap();
            assert_eq!(
                digits.chars().filter(char::is_ascii_digit).count(),
                17,
                "{text}"
            );
            let back: f64 = text.parse().unwrap();
            assert_eq!(back.to_bits(), value.to_bits(), "{text}");
        }
        assert_eq!(number(-0.25), "-2.5000000000000000e-1");
        assert_eq!(number(f64::NAN), "NaN");
    }
}
