//! The system's compilers, where there are any.

use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
use std::path::{Path, PathBuf};
use std::process::Command;
use tests::needs::compiler;

/// Runs a command that has to succeed.
pub(crate) fn run(command: &mut Command) {
    let output = command.output().unwrap();
    assert!(
        output.status.success(),
        "{command:?}\n{}",
        String::from_utf8_lossy(&output.stderr)
    );
}

/// A folder or file of the repository.
pub(crate) fn repository(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path)
}

/// Builds a library from one source file of the repository or elsewhere, in the language that its
/// suffix says. `None`: there is no compiler.
pub(crate) fn library(source: &Path, name: &str, folder: &Path) -> Option<PathBuf> {
    let include = repository("abi/include");
    let to = folder.join(format!("{DLL_PREFIX}{name}{DLL_SUFFIX}"));
    let suffix = source.extension().unwrap().to_str().unwrap();
    let (compiler, flags): (_, &[&str]) = match suffix {
        "c" => (
            compiler("CC", "cc")?,
            &["-std=c11", "-Wpedantic", "-Wconversion"],
        ),
        "cpp" => (
            compiler("CXX", "c++")?,
            &["-std=c++17", "-Wpedantic", "-Wconversion"],
        ),
        "f90" => (
            compiler("FC", "gfortran")?,
            &["-std=f2018", "-frecursive", "-Wno-unused-dummy-argument"],
        ),
        _ => panic!("no language has the suffix {suffix}"),
    };
    let mut command = Command::new(compiler);
    command
        .args(flags)
        .args([
            "-O2",
            "-Wall",
            "-Wextra",
            "-Werror",
            "-fPIC",
            "-fvisibility=hidden",
            "-shared",
        ])
        .arg("-I")
        .arg(&include)
        .current_dir(folder);
    if suffix == "f90" {
        command.arg(include.join("pilum_law.f90"));
    }
    run(command.arg(source).arg("-o").arg(&to).arg("-lm"));
    Some(to)
}
