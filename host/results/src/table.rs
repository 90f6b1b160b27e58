//! Numbers as tables have them.

/// A number with 17 significant digits: reading it back gives the same bits.
pub fn number(value: f64) -> String {
    // The shortest digits that read back to the same bits, filled up: much faster than the first
    // 17 digits of the exact value, which are no more exact.
    let shortest = format!("{value:e}");
    let (digits, exponent) = shortest.split_once('e').unwrap_or((&shortest, "0"));
    let dot = if digits.contains('.') { "" } else { "." };
    let length = 18 + usize::from(value.is_sign_negative());
    let missing = length.saturating_sub(digits.len() + dot.len());
    format!("{digits}{dot}{:0<missing$}e{exponent}", "")
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
    }
}
