//! Running the program in a folder.

use std::env;
use std::ffi::OsString;
use std::path::Path;
use std::process::Command;
use tests::outcome::Outcome;
use tests::place::{built_program, deps};

fn prepared(mut command: Command, place: &Path) -> Command {
    let mut path = OsString::from(built_program().parent().unwrap());
    if let Some(more) = env::var_os("PATH") {
        path.push(":");
        path.push(more);
    }
    command
        .current_dir(place)
        .env("PATH", path)
        .env("PILUM_LAW_PATH", deps())
        .env("NO_COLOR", "1")
        // Help is broken at this width.
        .env("COLUMNS", "100")
        // A project builds where it says, and without a network.
        .env("CARGO_NET_OFFLINE", "true")
        .env_remove("CARGO_TARGET_DIR")
        .env_remove("CARGO_BUILD_TARGET_DIR")
        .env_remove("RUST_BACKTRACE");
    command
}

/// Runs the program with these arguments.
pub(crate) fn pilum(place: &Path, arguments: &[&str]) -> Outcome {
    let mut command = prepared(Command::new(built_program()), place);
    Outcome::of(command.args(arguments))
}

/// Runs a line of a guide, with the program in the search path.
pub(crate) fn shell(place: &Path, line: &str) -> Outcome {
    let mut command = prepared(Command::new("sh"), place);
    Outcome::of(command.args(["-c", line]))
}
