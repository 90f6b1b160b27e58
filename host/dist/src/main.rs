//! `cargo run --release -p pilum-dist` builds program and laws, and makes the archive of them in `target/dist`.
//! With a folder, `cargo run --release -p pilum-dist -- ~/.local`, it installs into that folder instead;
//! `--wheel FOLDER` lays out there what a Python package has in it (`host/python/wheel.sh`).
#![expect(
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "a program for the command line"
)]

use dist::{Built, Error, Kind, Metadata};
use std::env;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

const USAGE: &str = "cargo run --release -p pilum-dist [-- [--wheel] PREFIX]\n\
    makes target/dist/pilum-VERSION-PLATFORM.tar.gz, or installs into the folder PREFIX; with --wheel what is in a \
    Python package";

fn main() -> ExitCode {
    let mut arguments = env::args_os().skip(1).peekable();
    let is_wheel = arguments.next_if(|first| first == "--wheel").is_some();
    let kind = if is_wheel { Kind::Wheel } else { Kind::Archive };
    let prefix = arguments.next();
    let asks = |name: &str| prefix.as_ref().is_some_and(|prefix| prefix == name);
    if asks("--help") || asks("-h") {
        println!("{USAGE}");
        return ExitCode::SUCCESS;
    }
    let is_option = prefix
        .as_ref()
        .is_some_and(|prefix| prefix.to_string_lossy().starts_with('-'));
    if is_option || arguments.next().is_some() || (is_wheel && prefix.is_none()) {
        eprintln!("{USAGE}");
        return ExitCode::from(1);
    }
    match run(kind, prefix.map(PathBuf::from).as_deref()) {
        Ok(said) => {
            println!("{said}");
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("{error}");
            ExitCode::from(1)
        }
    }
}

fn run(kind: Kind, prefix: Option<&Path>) -> Result<String, Error> {
    let repository = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    build(&repository)?;
    let metadata = Metadata::of(&repository)?;
    let target = &metadata.target;
    let built = Built::of(&target.join("release"));
    if let Some(prefix) = prefix {
        dist::lay_out(&repository, &metadata, &built, kind, prefix)?;
        let program = prefix.join("bin/pilum");
        return Ok(format!("{} is installed", program.display()));
    }
    let folder = target.join("dist").join(metadata.name());
    // What an earlier version had is not packed again.
    match std::fs::remove_dir_all(&folder) {
        Err(source) if source.kind() != std::io::ErrorKind::NotFound => {
            return Err(Error::File {
                path: folder,
                source,
            });
        }
        _ => {}
    }
    dist::lay_out(&repository, &metadata, &built, kind, &folder)?;
    let archive = target.join("dist").join(metadata.name() + ".tar.gz");
    dist::pack(&folder, &archive)?;
    let shown = archive.canonicalize().unwrap_or(archive);
    Ok(shown.display().to_string())
}

/// As the README's commands build it, so that nothing is built twice.
fn build(repository: &Path) -> Result<(), Error> {
    let mut command = Command::new(env::var_os("CARGO").unwrap_or("cargo".into()));
    command.args(["build", "--release"]).current_dir(repository);
    let failed = |why: String| Error::Command {
        command: "cargo build --release".to_owned(),
        why,
    };
    match command.status() {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(failed(status.to_string())),
        Err(why) => Err(failed(why.to_string())),
    }
}
