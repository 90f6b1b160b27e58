//! Numbers as tables have them.

use std::fmt;

/// Significant digits: reading them back gives the same bits.
const DIGITS: usize = 17;
/// Of the longest number: `-1.2345678901234567e-308`.
const LONGEST: usize = DIGITS + 7;

/// A number with 17 significant digits.
#[derive(Clone, Copy)]
pub(crate) struct Number {
    text: [u8; LONGEST],
    length: usize,
}

impl Number {
    /// The shortest digits that read back to the same bits, filled up with zeros: much faster than the first 17
    /// digits of the exact value, which are no more exact.
    pub(crate) fn of(value: f64) -> Self {
        let mut number = Self {
            text: [b'0'; LONGEST],
            length: 0,
        };
        if !value.is_finite() {
            let text = match value {
                f64::INFINITY => "inf",
                f64::NEG_INFINITY => "-inf",
                _ => "NaN",
            };
            number.push(text.as_bytes());
            return number;
        }
        if value.is_sign_negative() {
            number.push(b"-");
        }
        let mut buffer = zmij::Buffer::new();
        let shortest = buffer.format_finite(value.abs());
        let (digits, exponent) = shortest.split_once('e').unwrap_or((shortest, "0"));
        let (whole, fraction) = digits.split_once('.').unwrap_or((digits, ""));
        let exponent: i32 = exponent.parse().unwrap_or_default();
        if whole == "0" {
            let significant = fraction.trim_start_matches('0');
            let n_zeros = fraction.len() - significant.len();
            if significant.is_empty() {
                number.scientific("0", "", 0);
            } else {
                number.scientific(significant, "", exponent - 1 - n_zeros as i32);
            }
        } else {
            number.scientific(whole, fraction, exponent + whole.len() as i32 - 1);
        }
        number
    }

    /// Digits in two pieces, the first not empty; 17 of them, or with zeros from then on.
    fn scientific(&mut self, digits: &str, more: &str, exponent: i32) {
        let (first, rest) = digits.as_bytes().split_at(1);
        self.push(first);
        self.push(b".");
        let end = self.length + DIGITS - 1;
        self.push(rest);
        let more = more.as_bytes();
        self.push(&more[..more.len().min(end - self.length)]);
        self.length = end;
        self.push(if exponent < 0 { b"e-" } else { b"e" });
        let size = exponent.unsigned_abs();
        for (least, unit) in [(100, 100), (10, 10), (0, 1)] {
            if size >= least {
                self.push(&[b'0' + (size / unit % 10) as u8]);
            }
        }
    }

    fn push(&mut self, bytes: &[u8]) {
        let end = self.length + bytes.len();
        self.text[self.length..end].copy_from_slice(bytes);
        self.length = end;
    }

    /// Its characters, all of them ASCII.
    pub(crate) fn as_bytes(&self) -> &[u8] {
        &self.text[..self.length]
    }
}

impl fmt::Display for Number {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&String::from_utf8_lossy(self.as_bytes()))
    }
}

/// A number with 17 significant digits: reading it back gives the same bits.
pub fn number(value: f64) -> String {
    Number::of(value).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_17_digits_and_read_back() {
        let powers = (-323..=308).map(|exponent| 10_f64.powi(exponent));
        let neighbours = powers.clone().map(f64::next_down);
        let thirds = powers.clone().map(|power| power / 3.0);
        let values = [
            0.0,
            -0.0,
            1.0,
            -1.0,
            0.1,
            -2.5e-7,
            123_456_789.0,
            1.0 / 3.0,
            f64::MAX,
            f64::MIN_POSITIVE,
            5e-324,
            -1e22,
        ];
        for value in values
            .into_iter()
            .chain(powers)
            .chain(neighbours)
            .chain(thirds)
        {
            let text = number(value);
            let digits = text.split('e').next().unwrap();
            assert_eq!(
                digits.chars().filter(char::is_ascii_digit).count(),
                17,
                "{text}"
            );
            let back: f64 = text.parse().unwrap();
            assert_eq!(back.to_bits(), value.to_bits(), "{text}");
            // As the standard library has it, but for the zeros.
            let short = format!("{value:e}");
            let (shown, exponent) = short.split_once('e').unwrap();
            assert!(text.starts_with(shown), "{text} {short}");
            assert!(text.ends_with(&format!("e{exponent}")), "{text} {short}");
        }
        assert_eq!(number(-0.25), "-2.5000000000000000e-1");
        assert_eq!(number(0.0), "0.0000000000000000e0");
        assert_eq!(number(f64::NAN), "NaN");
        assert_eq!(number(f64::NEG_INFINITY), "-inf");
    }
}
