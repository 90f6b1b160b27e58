//! How near to its thresholds a check has come: the largest of what was found, as a part of what is
//! allowed. The report of a law shows the margins.

use std::cell::RefCell;
use std::collections::BTreeMap;

thread_local! {
    /// For the check in this thread: checks are children, or run one after the other.
    static NEAREST: RefCell<BTreeMap<&'static str, f64>> = const { RefCell::new(BTreeMap::new()) };
}

/// Notes a value, as a part of the threshold of this name.
pub(super) fn note(threshold: &'static str, part: f64) {
    if part.is_finite() {
        NEAREST.with_borrow_mut(|all| {
            let most = all.entry(threshold).or_insert(0.0);
            *most = most.max(part);
        });
    }
}

/// What was noted since the last time.
pub(super) fn take() -> BTreeMap<String, f64> {
    let all = NEAREST.take();
    let all = all.into_iter();
    // Of two digits: no more can be compared, and none of them is exact.
    all.map(|(name, part)| (name.to_owned(), rounded(part)))
        .collect()
}

fn rounded(part: f64) -> f64 {
    format!("{part:.1e}").parse().unwrap_or(part)
}

#[cfg(test)]
mod tests {
    use super::{note, take};

    #[test]
    fn the_largest_counts_and_is_taken_once() {
        for part in [0.2, 1.234e-3, f64::NAN, f64::INFINITY] {
            note("one", part);
        }
        note("other", 1.234e-3);
        let found: Vec<(String, f64)> = take().into_iter().collect();
        assert_eq!(
            found,
            [("one".to_owned(), 0.2), ("other".to_owned(), 1.2e-3)]
        );
        assert!(take().is_empty());
    }
}
