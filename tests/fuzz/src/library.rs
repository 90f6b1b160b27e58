//! Libraries as files: what `pilum inspect` says, the manifest, MFront's behaviours. Nothing of
//! them runs.

use crate::shown;
use crate::ways_in;

pub(super) fn read(data: &[u8]) {
    if let Some(inspection) = shown(fuzzing::inspection(data)) {
        assert!(!inspection.to_string().is_empty(), "nothing to say");
        shown(law::inspect::json(&inspection));
    }
    fuzzing::manifest(data);
    // Why it has none is a text.
    let _ = fuzzing::behaviours(data);
}
