//! What belongs to the whole process, which is an interpreter and not the program.

use pyo3::prelude::*;
use std::path::PathBuf;

/// Names the program that is started where work needs a process of its own, and beside which laws lie.
#[pyfunction]
pub(crate) fn stands_for(program: PathBuf) {
    law::child::stands_for(program);
}

/// Is called in a process that Python has forked: laws may be called there too.
#[pyfunction]
pub(crate) fn goes_on_as_copy() {
    #[cfg(unix)]
    law::calls::goes_on_as_copy();
}
