//! How a run ended, for its summary.

use input::{Error, Kind};
use results::Ending;
use serde_json::json;

/// How a run ended, in a word and in its error's own.
pub fn ending(error: Option<&Error>) -> Ending {
    let Some(error) = error else {
        return Ending::done();
    };
    let status = match error.kind() {
        _ if matches!(error, Error::Killed { .. }) => "killed",
        Kind::NoEquilibrium => "no equilibrium",
        Kind::Library => "plugin trouble",
        Kind::Stopped => "interrupted",
        Kind::Input | Kind::Internal => "stopped",
    };
    Ending {
        status: status.to_owned(),
        error: Some(error.to_string()),
        mechanism: error.mechanism().map(|mechanism| json!(mechanism)),
    }
}

/// What of a run concerns the whole process.
pub(crate) mod process {
    /// Results are being written into a folder, or no longer.
    pub(crate) fn writes(folder: Option<&std::path::Path>) {
        #[cfg(unix)]
        crate::memory::writes(folder);
        #[cfg(not(unix))]
        let _ = folder;
    }
}
