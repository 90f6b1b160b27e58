//! Numbers of tables and fields as text. A run writes millions of them.

/// Significant digits: reading them back gives the same bits.
const DIGITS: usize = 17;

/// The shortest decimal digits that read back to the same bits.
struct Shortest {
    /// Filled up with zeros.
    digits: [u8; DIGITS],
    /// So many of them are shown where they are not filled up, at least one.
    n: usize,
    /// Power of ten of the first.
    exponent: i32,
}

impl Shortest {
    /// Those of a finite number's size.
    fn of(value: f64) -> Self {
        let mut buffer = zmij::Buffer::new();
        let text = buffer.format_finite(value.abs()).as_bytes();
        let find = |text: &[u8], wanted: u8| text.iter().position(|&byte| byte == wanted);
        let (mantissa, power) = match find(text, b'e') {
            Some(at) => (&text[..at], whole(&text[at + 1..])),
            None => (text, 0),
        };
        let (before, after) = match find(mantissa, b'.') {
            Some(at) => (&mantissa[..at], &mantissa[at + 1..]),
            None => (mantissa, &[][..]),
        };
        let mut shortest = Self {
            digits: [b'0'; DIGITS],
            n: 1,
            exponent: 0,
        };
        if before != b"0" {
            shortest.exponent = power + before.len() as i32 - 1;
            let n = shortest.take(before, 0);
            shortest.take(after, n);
        } else if let Some(zeros) = after.iter().position(|&byte| byte != b'0') {
            shortest.exponent = power - 1 - zeros as i32;
            shortest.take(&after[zeros..], 0);
        }
        let last = shortest.digits.iter().rposition(|&digit| digit != b'0');
        shortest.n = last.map_or(1, |last| last + 1);
        shortest
    }

    /// Takes digits from this place on; the place after them. Zeros at the end need no place.
    fn take(&mut self, digits: &[u8], from: usize) -> usize {
        let end = (from + digits.len()).min(DIGITS);
        self.digits[from..end].copy_from_slice(&digits[..end - from]);
        end
    }
}

/// A whole number, with its sign.
fn whole(text: &[u8]) -> i32 {
    let sign = if text.starts_with(b"-") { -1 } else { 1 };
    let digits = text.iter().skip_while(|byte| !byte.is_ascii_digit());
    let value = |value: i32, digit: &u8| 10 * value + i32::from(digit - b'0');
    sign * digits.fold(0, value)
}

/// Appends a number with 17 significant digits: the shortest that read back to the same bits, filled up with
/// zeros. That is much faster than the first 17 digits of the exact value, which are no more exact.
pub fn push(text: &mut Vec<u8>, value: f64) {
    push_digits(text, value, |_| DIGITS);
}

/// Appends a number in the form of `{:e}`: the shortest digits that read back to the same bits.
pub fn push_shortest(text: &mut Vec<u8>, value: f64) {
    push_digits(text, value, |shortest| shortest.n);
}

fn push_digits(text: &mut Vec<u8>, value: f64, n: impl Fn(&Shortest) -> usize) {
    if !value.is_finite() {
        text.extend_from_slice(match value {
            f64::INFINITY => b"inf",
            f64::NEG_INFINITY => b"-inf",
            _ => b"NaN",
        });
        return;
    }
    if value.is_sign_negative() {
        text.push(b'-');
    }
    let shortest = Shortest::of(value);
    let (first, rest) = shortest.digits[..n(&shortest)].split_at(1);
    text.extend_from_slice(first);
    if !rest.is_empty() {
        text.push(b'.');
        text.extend_from_slice(rest);
    }
    text.push(b'e');
    if shortest.exponent < 0 {
        text.push(b'-');
    }
    push_count(text, shortest.exponent.unsigned_abs() as usize);
}

/// Appends a whole number.
pub fn push_count(text: &mut Vec<u8>, count: usize) {
    // The largest has 20 digits.
    let mut digits = [b'0'; 20];
    let (mut at, mut left) = (digits.len() - 1, count);
    digits[at] += (left % 10) as u8;
    while left >= 10 {
        left /= 10;
        at -= 1;
        digits[at] += (left % 10) as u8;
    }
    text.extend_from_slice(&digits[at..]);
}

/// A number with 17 significant digits: reading it back gives the same bits.
pub fn number(value: f64) -> String {
    let mut text = Vec::with_capacity(DIGITS + 7);
    push(&mut text, value);
    String::from_utf8_lossy(&text).into_owned()
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
            let mut shortest = Vec::new();
            push_shortest(&mut shortest, value);
            assert_eq!(shortest, short.as_bytes());
            let (shown, exponent) = short.split_once('e').unwrap();
            assert!(text.starts_with(shown), "{text} {short}");
            assert!(text.ends_with(&format!("e{exponent}")), "{text} {short}");
        }
        assert_eq!(number(-0.25), "-2.5000000000000000e-1");
        assert_eq!(number(0.0), "0.0000000000000000e0");
        assert_eq!(number(f64::NAN), "NaN");
        assert_eq!(number(f64::NEG_INFINITY), "-inf");
    }

    #[test]
    fn shortest_digits_are_as_many_as_those_of_the_standard_library() {
        // Bits of all kinds, by a multiplicative sequence.
        let mut bits = 1_u64;
        for _ in 0..100_000 {
            bits = bits.wrapping_mul(0x5851_f42d_4c95_7f2d).wrapping_add(1);
            let value = f64::from_bits(bits.rotate_left(11));
            let mut text = Vec::new();
            push_shortest(&mut text, value);
            let text = String::from_utf8(text).unwrap();
            // Of two that are as near to it either will do.
            let back: f64 = text.parse().unwrap();
            assert!(
                back.to_bits() == value.to_bits() || value.is_nan(),
                "{text}"
            );
            assert_eq!(text.len(), format!("{value:e}").len(), "{text}");
        }
    }
}
