//! Libraries as files: what `pilum inspect` says, the manifest, MFront's behaviours. Nothing of
//! them runs.

use crate::shown;
use crate::ways_in;
use input::Error;

pub(super) fn read(data: &[u8]) {
    if let Some(inspection) = shown(ways_in::inspection(data)) {
        assert!(!inspection.to_string().is_empty(), "nothing to say");
        shown(law::inspect::json(&inspection).map_err(Error::from));
    }
    ways_in::manifest(data);
    // Why it has none is a text.
    let _ = ways_in::behaviours(data);
}
