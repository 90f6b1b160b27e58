//! Sizes of vectors.

pub(super) fn same(a: &[f64], b: &[f64]) -> bool {
    let mut pairs = a.iter().zip(b);
    pairs.all(|(a, b)| a.to_bits() == b.to_bits())
}

pub(super) fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |max, v| max.max(v.abs()))
}

/// Euclidean norm without overflow.
pub(super) fn norm(values: &[f64]) -> f64 {
    let scale = largest(values);
    if scale > 0.0 && scale.is_finite() {
        let sum: f64 = values.iter().map(|v| (v / scale) * (v / scale)).sum();
        scale * sum.sqrt()
    } else {
        scale
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn the_norm_does_not_overflow() {
        assert_relative_eq!(norm(&[3e200, 4e200]), 5e200, max_relative = 1e-15);
        assert!(norm(&[]).abs() == 0.0);
    }
}
