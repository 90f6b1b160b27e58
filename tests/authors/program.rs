//! Running the program in a folder.

use std::env::{self, consts::EXE_SUFFIX};
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;

/// What became of a run of the program.
#[derive(Debug)]
pub(crate) struct Outcome {
    pub(crate) code: Option<i32>,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

impl Outcome {
    /// Whether the message contains a text, however its lines are broken.
    pub(crate) fn says(&self, text: &str) -> bool {
        let squeezed = |text: &str| -> String { text.split_whitespace().collect() };
        squeezed(&self.stderr).contains(&squeezed(text))
    }
}

/// Where cargo puts the laws' libraries.
fn deps() -> PathBuf {
    env::current_exe().unwrap().parent().unwrap().to_owned()
}

/// The folder of the program.
fn folder() -> PathBuf {
    let folder = deps().parent().unwrap().to_owned();
    assert!(
        folder.join(format!("pilum{EXE_SUFFIX}")).is_file(),
        "the program is missing: `cargo test --workspace` builds it, or `cargo build -p pilum` (with \
         the same profile)"
    );
    folder
}

fn run(command: &mut Command) -> Outcome {
    let output = command.output().unwrap();
    Outcome {
        code: output.status.code(),
        stdout: String::from_utf8(output.stdout).unwrap(),
        stderr: String::from_utf8(output.stderr).unwrap(),
    }
}

fn prepared(mut command: Command, place: &Path) -> Command {
    let mut path = OsString::from(folder());
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
    let mut command = prepared(Command::new(folder().join("pilum")), place);
    run(command.args(arguments))
}

/// Runs a line of a guide, with the program in the search path.
pub(crate) fn shell(place: &Path, line: &str) -> Outcome {
    let mut command = prepared(Command::new("sh"), place);
    run(command.args(["-c", line]))
}
