//! Installed, not built: a folder without a repository above it, with the archive unpacked.
#![expect(
    clippy::missing_panics_doc,
    clippy::new_without_default,
    clippy::unwrap_used,
    reason = "part of the tests, which panic to fail"
)]

use crate::needs::compiler;
use crate::outcome::Outcome;
use dist::{Built, Metadata};
use std::collections::BTreeSet;
use std::env::{self, consts::EXE_SUFFIX};
use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;
use tempfile::TempDir;

/// Compilers that a test needs: variables, and what stands for them.
pub type Compilers = &'static [(&'static str, &'static str)];

/// Whether all are there; with a remark where one is not.
pub fn are_there(compilers: Compilers) -> bool {
    let found = compilers
        .iter()
        .map(|(variable, name)| compiler(variable, name));
    found.into_iter().all(|found| found.is_some())
}

/// The archive, unpacked.
#[derive(Debug)]
pub struct Place {
    /// Home and working folder are in it too.
    folder: TempDir,
    /// Parent of `bin` and the others.
    pub prefix: PathBuf,
}

/// The root of the repository.
pub fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// A file or folder of the cases.
pub fn case(name: impl AsRef<Path>) -> PathBuf {
    repository().join("cases").join(name)
}

/// Where cargo puts the laws' libraries.
pub fn deps() -> PathBuf {
    env::current_exe().unwrap().parent().unwrap().to_owned()
}

/// The program that cargo has built.
pub fn built_program() -> PathBuf {
    let program = deps().parent().unwrap().join(format!("pilum{EXE_SUFFIX}"));
    assert!(
        program.is_file(),
        "the program is missing: `cargo test --workspace` builds it, or `cargo build -p pilum` (with \
         the same profile)"
    );
    program
}

/// Makes the archive once, as `pilum-dist` does. Its path, and the name of the folder in it.
pub fn archive() -> &'static (PathBuf, String) {
    static ARCHIVE: OnceLock<(PathBuf, String)> = OnceLock::new();
    ARCHIVE.get_or_init(|| {
        let metadata = Metadata::of(&repository()).unwrap();
        let folder = deps().join("../../tmp/installed");
        let _ = fs::remove_dir_all(&folder);
        let laid_out = folder.join(metadata.name());
        let built = Built {
            program: built_program(),
            laws: deps(),
        };
        dist::lay_out(
            &repository(),
            &metadata,
            &built,
            dist::Kind::Archive,
            &laid_out,
        )
        .unwrap();
        let archive = folder.join(metadata.name() + ".tar.gz");
        dist::pack(&laid_out, &archive).unwrap();
        (archive, metadata.name())
    })
}

impl Place {
    /// Unpacks the archive as a user does.
    pub fn new() -> Self {
        let folder = TempDir::new().unwrap();
        let above = folder.path().ancestors().skip(1);
        for above in above {
            assert!(!above.join("Cargo.toml").exists(), "{}", above.display());
        }
        let (archive, name) = archive();
        for inner in ["opt", "home", "work"] {
            fs::create_dir(folder.path().join(inner)).unwrap();
        }
        let opt = folder.path().join("opt");
        let unpacked = Command::new("tar")
            .arg("xzf")
            .arg(archive)
            .arg("-C")
            .arg(&opt)
            .status();
        assert!(unpacked.unwrap().success());
        let prefix = opt.canonicalize().unwrap().join(name);
        Self { folder, prefix }
    }

    /// The folder that commands are given in.
    pub fn work(&self) -> PathBuf {
        self.folder.path().join("work")
    }

    /// All files below the prefix.
    pub fn files(&self) -> BTreeSet<String> {
        let mut files = BTreeSet::new();
        let mut open = vec![self.prefix.clone()];
        while let Some(folder) = open.pop() {
            for entry in fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                if path.is_dir() {
                    open.push(path);
                } else {
                    let name = path.strip_prefix(&self.prefix).unwrap();
                    files.insert(name.to_str().unwrap().to_owned());
                }
            }
        }
        files
    }

    /// Runs a line in a shell, in a folder below the working one. `PATH` has the installed program, then
    /// cargo itself, which then asks nothing of a home, then what this test has.
    pub fn shell(&self, folder: &str, line: &str) -> Outcome {
        self.shell_with(folder, line, &[])
    }

    /// The same, with more variables.
    pub fn shell_with(&self, folder: &str, line: &str, more: &[(&str, &str)]) -> Outcome {
        let cargo = Path::new(env!("CARGO")).parent().unwrap();
        let mut path = OsString::from(self.prefix.join("bin"));
        for part in [Some(cargo.into()), env::var_os("PATH")]
            .into_iter()
            .flatten()
        {
            path.push(":");
            path.push(part);
        }
        let mut command = Command::new("sh");
        command
            .args(["-c", line])
            .current_dir(self.work().join(folder))
            .env_clear()
            .env("PATH", path)
            .env("HOME", self.folder.path().join("home"))
            // Help is broken at this width.
            .env("COLUMNS", "100")
            .envs(more.iter().copied());
        Outcome::of(&mut command)
    }

    /// Runs a line that has to succeed. What it prints.
    #[track_caller]
    pub fn done(&self, folder: &str, line: &str) -> String {
        self.shell(folder, line).ended(0).stdout
    }
}
