//! On systems without watched processes the program works in one process.

use crate::Error;
use law::Stop;
use std::io;
use std::path::Path;

/// No child can be had.
///
/// # Errors
/// None.
pub fn supervise(_again: bool, _mend: &dyn Fn(&Path, &Error)) -> Option<Result<u8, Error>> {
    None
}

/// Nobody to say it to.
pub fn end(_code: u8) {}

/// Nothing is done twice.
pub fn is_again() -> bool {
    false
}

/// Nobody to say it to.
pub fn begin_run(_apart: bool) {}

/// Nobody to say it to.
pub fn case_begun(_number: usize, _folder: &Path) {}

/// Nobody to say it to.
pub fn end_run() {}

/// Nothing is done twice.
pub fn was_begun(_number: usize) -> bool {
    false
}

/// Nobody watches.
pub fn stop() -> Option<Stop> {
    None
}

/// The standard output.
pub fn stdout() -> io::Stdout {
    io::stdout()
}
