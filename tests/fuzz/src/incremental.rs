//! The three files of an IncrementalDriver, with a line of three dashes between them.

use crate::shown;
use crate::ways_in;
use text::Source;

/// Parameters and internal variables that the files are read for.
const N: usize = 2;

pub(super) fn read(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else {
        return;
    };
    let mut files = text.splitn(3, "---\n");
    let names = ["test.inp", "parameters.inp", "initialconditions.inp"];
    let files = names.map(|name| Source::new(name, files.next().unwrap_or_default()));
    shown(ways_in::incremental(files.each_ref(), N));
}
