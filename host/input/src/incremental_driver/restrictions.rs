//! `*ObeyRestrictions`: sums of changes of stresses and strains.

use super::lines::{Lines, real};
use crate::Error;
use point::{N_MAX, Restrictions};

/// Six lines like `-sd1 + 3.0*sd3 + 2e4*ed2 = -10`: sums of changes of stresses `sd1` to `sd6` and of
/// strains `ed1` to `ed6` over the step. A remark begins with `#` or `!`.
pub(super) fn restrictions(lines: &mut Lines<'_>) -> Result<Restrictions, Error> {
    let mut restrictions = Restrictions::default();
    for i in 0..N_MAX {
        let (at, line) = lines.expect("a restriction, of which there are six")?;
        let text = line.split(['#', '!']).next().unwrap_or_default();
        let Some((left, right)) = text.split_once('=') else {
            return lines.refuse(at, "a restriction has a `=`");
        };
        let packed = |text: &str| text.split_whitespace().collect::<String>();
        restrictions.change[i] = match real(&packed(right)) {
            Some(value) if !right.contains(':') => value,
            _ => {
                let message = format!("`{}` is no number", right.trim());
                return lines.refuse(at, message);
            }
        };
        for (sign, term) in terms(&packed(left)) {
            let (factor, name) = match term.split_once('*') {
                Some((factor, name)) => (real(factor), name),
                None => (Some(1.0), term),
            };
            let number = name.get(2..).and_then(|number| number.parse().ok());
            let row = match (name.get(..2), number, factor) {
                (Some("sd"), Some(1..=6), Some(_)) => &mut restrictions.stress[i],
                (Some("ed"), Some(1..=6), Some(_)) => &mut restrictions.strain[i],
                _ => {
                    let message = format!("`{term}` is no change, or a number times one");
                    let error = lines.source.error(at, message);
                    let hint = "sd1 to sd6 are the changes of stresses 11 22 33 12 13 23, ed1 to ed6 of \
                                strains, γ for shear";
                    return Err(error.hint(hint).into());
                }
            };
            row[number.unwrap_or(1) - 1] += sign * factor.unwrap_or_default();
        }
        let row = restrictions.stress[i].iter().chain(&restrictions.strain[i]);
        if row.into_iter().all(|factor| *factor == 0.0) {
            return lines.refuse(at, "the restriction restricts nothing");
        }
    }
    Ok(restrictions)
}

/// The summands of a sum, with their signs. A sign within a number like `1e-3` is part of it.
fn terms(sum: &str) -> Vec<(f64, &str)> {
    let bytes = sum.as_bytes();
    let is_exponent = |at: usize| {
        let digit = |i: usize| {
            bytes
                .get(i)
                .is_some_and(|c| c.is_ascii_digit() || *c == b'.')
        };
        at >= 2 && matches!(bytes[at - 1], b'e' | b'E' | b'd' | b'D') && digit(at - 2)
    };
    let mut starts: Vec<usize> = (0..bytes.len())
        .filter(|&i| matches!(bytes[i], b'+' | b'-') && !is_exponent(i))
        .collect();
    if starts.first() != Some(&0) {
        starts.insert(0, 0);
    }
    let ends = starts.iter().skip(1).copied().chain([sum.len()]);
    let pieces = starts
        .iter()
        .zip(ends)
        .map(|(start, end)| &sum[*start..end]);
    pieces
        .map(|piece| match piece.strip_prefix('-') {
            Some(term) => (-1.0, term),
            None => (1.0, piece.strip_prefix('+').unwrap_or(piece)),
        })
        .collect()
}
