//! Driver files, and short paths of them with the laws of this repository.

use crate::ways_in;
use crate::{shown, source};

/// Longer paths are read alone.
const MOST_INCREMENTS: usize = 20;
/// Variants that are looked at.
const MOST_VARIANTS: usize = 2;

pub(super) fn read(data: &[u8]) {
    let Some(source) = source(data) else { return };
    // An adapter opens whatever library is named.
    if source.text().contains("adapter") {
        return;
    }
    let drivers = shown(ways_in::drivers(source)).unwrap_or_default();
    for driver in drivers.iter().take(MOST_VARIANTS) {
        if driver.point().n_increments() > MOST_INCREMENTS {
            continue;
        }
        shown(driver.run(|row| {
            let mut values = row.gradient.iter().chain(row.flux).chain(row.internal);
            assert!(values.all(|value| value.is_finite()), "a row is not finite");
        }));
    }
}
