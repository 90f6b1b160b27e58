//! State of the whole process, which is an interpreter and not the program.

use pyo3::prelude::*;
use std::path::PathBuf;

/// Names the program that is started where work needs a separate process, and next to which laws lie.
#[pyfunction]
pub(crate) fn stands_for(program: PathBuf) {
    law::child::stands_for(program);
}

/// Is called in a process that Python has forked: laws may be called there too.
#[pyfunction]
pub(crate) fn goes_on_as_copy() {
    #[cfg(unix)]
    law::current_call::goes_on_as_copy();
}
