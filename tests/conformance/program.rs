//! The program, libraries compiled for it, and what it says of them.
#![expect(clippy::unwrap_used, clippy::panic, reason = "part of the tests")]

use serde_json::Value;
use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use tempfile::TempDir;
use tests::place::{built_program, deps};

/// Runs the program.
pub(crate) fn pilum(arguments: &[&str]) -> Output {
    pilum_in(Path::new(env!("CARGO_TARGET_TMPDIR")), arguments)
}

/// Runs the program in a folder.
pub(crate) fn pilum_in(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(built_program())
        .args(arguments)
        .current_dir(folder)
        .env_remove("PILUM_LAW_PATH")
        .output()
        .unwrap()
}

/// The library of a law in Rust.
pub(crate) fn library_of(law: &str) -> PathBuf {
    deps().join(format!("{DLL_PREFIX}{law}{DLL_SUFFIX}"))
}

/// A folder for libraries.
pub(crate) fn folder() -> TempDir {
    tempfile::tempdir().unwrap()
}

/// Compiles a fixture. `None`, with a remark, where there is no compiler.
pub(crate) fn compiled(fixture: &str, folder: &Path) -> Option<PathBuf> {
    let tests = Path::new(env!("CARGO_MANIFEST_DIR"));
    compiled_from(
        &tests.join(format!("fixtures/{fixture}.c")),
        &tests.join("../abi/include"),
        folder,
    )
}

/// Compiles the law of the fixtures with these definitions, which make `name` of it.
pub(crate) fn compiled_with(definitions: &str, name: &str, folder: &Path) -> Option<PathBuf> {
    let source = folder.join(format!("{name}.c"));
    std::fs::write(&source, format!("{definitions}\n#include \"law.h\"\n")).unwrap();
    let tests = Path::new(env!("CARGO_MANIFEST_DIR"));
    compiled_from(&source, &tests.join("../abi/include"), folder)
}

/// Compiles a source file with the headers of this folder.
pub(crate) fn compiled_from(source: &Path, headers: &Path, folder: &Path) -> Option<PathBuf> {
    let tests = Path::new(env!("CARGO_MANIFEST_DIR"));
    let fixture = source.file_stem().unwrap().to_str().unwrap();
    let library = folder.join(format!("{DLL_PREFIX}{fixture}{DLL_SUFFIX}"));
    let mut compiler = Command::new("cc");
    compiler
        .args(["-std=gnu11", "-O1", "-Wall", "-Werror", "-shared", "-fPIC"])
        .args(["-fvisibility=hidden", "-I"])
        .arg(headers)
        .arg("-I")
        .arg(tests.join("fixtures"))
        .arg(source)
        .arg("-o")
        .arg(&library)
        .arg("-lm");
    let output = tests::needs::output(&mut compiler)?;
    assert!(
        output.status.success(),
        "{fixture}: {}",
        String::from_utf8_lossy(&output.stderr)
    );
    Some(library)
}

/// What `pilum check --json` says.
#[derive(Debug)]
pub(crate) struct Report {
    pub(crate) code: Option<i32>,
    pub(crate) json: Value,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

/// Checks a library.
pub(crate) fn check(library: &Path, more: &[&str]) -> Report {
    // Calls that are found wrong would be written to the folder of the tests.
    let name = library.file_stem().unwrap().to_str().unwrap();
    let out = format!("{}/check/{name}", env!("CARGO_TARGET_TMPDIR"));
    let mut arguments = vec!["check", library.to_str().unwrap(), "--json", "--out", &out];
    arguments.extend(more);
    let output = pilum(&arguments);
    let stdout = String::from_utf8(output.stdout).unwrap();
    let stderr = String::from_utf8(output.stderr).unwrap();
    Report {
        code: output.status.code(),
        json: serde_json::from_str(&stdout)
            .unwrap_or_else(|why| panic!("{}: {why}: {stdout}{stderr}", library.display())),
        stdout,
        stderr,
    }
}

/// A message in one line.
pub(crate) fn words(message: &str) -> String {
    let words = message.split_whitespace();
    words.collect::<Vec<_>>().join(" ")
}

/// What `pilum` refuses to do.
pub(crate) fn refused(arguments: &[&str], code: i32) -> String {
    let output = pilum(arguments);
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {stderr}");
    assert!(output.stdout.is_empty(), "{arguments:?}");
    words(&stderr)
}

impl Report {
    /// Ids of the checks with one of these outcomes.
    pub(crate) fn with(&self, outcomes: &[&str]) -> Vec<String> {
        self.checks()
            .iter()
            .filter(|check| outcomes.contains(&check["outcome"].as_str().unwrap()))
            .map(|check| check["id"].as_str().unwrap().to_owned())
            .collect()
    }

    pub(crate) fn checks(&self) -> &Vec<Value> {
        self.json["checks"].as_array().unwrap()
    }

    /// The check with this id.
    pub(crate) fn check(&self, id: &str) -> &Value {
        let mut checks = self.checks().iter();
        checks.find(|check| check["id"] == id).unwrap()
    }
}

#[test]
fn a_missing_compiler_is_named() {
    let test = "minors::a_library_of_a_later_minor_version_gives_the_same_bits";
    tests::needs::assert_named(test, "`cc`");
}
