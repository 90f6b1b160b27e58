//! The archive that is installed: which files of the repository and of cargo's output go where. Its layout
//! is that of `/usr/local`; it can be unpacked there or anywhere else. The program finds its laws relative
//! to itself; pkg-config and CMake find the headers relative to their files.
//!
//! ```text
//! bin/pilum
//! lib/pilum/                 laws
//! lib/pkgconfig/pilum.pc     for build systems of laws
//! lib/cmake/pilum/
//! include/pilum/             the contract in C and C++
//! share/pilum/               the contract in Fortran, symbols for linkers, all cases
//! share/man, share/bash-completion, share/zsh, share/fish
//! share/doc/pilum/           pages, licences
//! ```

mod error;
mod licences;
mod metadata;
mod pages;

pub use error::Error;
pub use metadata::Metadata;

use crate::pages::Places;
use std::env::consts::{DLL_PREFIX, DLL_SUFFIX, EXE_SUFFIX};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Release build of cargo.
#[derive(Clone, Debug)]
pub struct Built {
    /// The program.
    pub program: PathBuf,
    /// The folder of the laws' libraries.
    pub laws: PathBuf,
}

impl Built {
    /// As `cargo build --release` leaves it in a folder, such as `target/release`.
    pub fn of(folder: &Path) -> Self {
        Self {
            program: folder.join(format!("pilum{EXE_SUFFIX}")),
            laws: folder.to_owned(),
        }
    }
}

/// A page, file or folder of the repository, and the folder that it goes to.
const FILES: [(&str, &str); 15] = [
    ("abi/include/pilum_law.h", "include/pilum"),
    ("abi/include/pilum_point.h", "include/pilum"),
    ("abi/include/pilum_law.hpp", "include/pilum"),
    ("abi/include/pilum_law.f90", "share/pilum"),
    ("abi/include/exports.map", "share/pilum"),
    ("cases", "share/pilum/cases"),
    ("LICENSE-MIT", "share/doc/pilum"),
    ("LICENSE-APACHE", "share/doc/pilum"),
    ("CHANGELOG.md", "share/doc/pilum"),
    // Pages keep their places among each other, for their links.
    ("abi/README.md", "share/doc/pilum/abi"),
    ("abi/interoperability.md", "share/doc/pilum/abi"),
    ("host/README.md", "share/doc/pilum/host"),
    ("host/docs", "share/doc/pilum/host/docs"),
    (
        "host/docs/tutorial/my_pile.msh",
        "share/pilum/cases/tutorial",
    ),
    ("models/README.md", "share/doc/pilum/models"),
];

/// The layout.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Layout of a system installation.
    Archive,
    /// Content of a Python package besides its extension module.
    Wheel,
}

impl Kind {
    /// The package whose library is there too.
    fn library(self) -> Option<&'static str> {
        (self == Self::Wheel).then_some("pilum-python")
    }
}

/// Where `man` looks for the pages of the program and of its commands.
const MANUAL: &str = "share/man/man1";

/// Output of the program, and its file.
const PRINTED: [(&[&str], &str); 3] = [
    (
        &["completions", "bash"],
        "share/bash-completion/completions/pilum",
    ),
    (&["completions", "zsh"], "share/zsh/site-functions/_pilum"),
    (
        &["completions", "fish"],
        "share/fish/vendor_completions.d/pilum.fish",
    ),
];

/// Texts that are written for the archive; `@VERSION@` stands for the version.
const WRITTEN: [(&str, &str); 4] = [
    (include_str!("pilum.pc.txt"), "lib/pkgconfig/pilum.pc"),
    (
        include_str!("pilum-config.cmake.txt"),
        "lib/cmake/pilum/pilum-config.cmake",
    ),
    (
        include_str!("pilum-config-version.cmake.txt"),
        "lib/cmake/pilum/pilum-config-version.cmake",
    ),
    (include_str!("README.md.txt"), "share/doc/pilum/README.md"),
];

/// Lays all files out below a folder, which is made; files of an earlier version are replaced. A wheel has neither
/// manual pages nor completions, which no shell would find in it.
///
/// # Errors
/// [`Error::File`] if a file cannot be read or written, [`Error::Command`] if the program does not run,
/// [`Error::NotBuilt`] if it or a law is missing.
pub fn lay_out(
    repository: &Path,
    metadata: &Metadata,
    built: &Built,
    kind: Kind,
    into: &Path,
) -> Result<(), Error> {
    let program = into.join(format!("bin/pilum{EXE_SUFFIX}"));
    copy_built(&built.program, &program)?;
    for law in metadata.laws() {
        let name = format!("{DLL_PREFIX}{law}{DLL_SUFFIX}");
        copy_built(&built.laws.join(&name), &into.join("lib/pilum").join(&name))?;
    }
    let places = places(repository, metadata)?;
    for (from, to) in &places {
        let (path, to) = (repository.join(from), into.join(to));
        let is_page = from.extension().is_some_and(|e| e == "md" || e == "ipynb");
        if is_page {
            let text = fs::read_to_string(&path).map_err(Error::of(&path))?;
            let text = pages::moved(&text, from, &places, repository);
            write(&to, text.as_bytes())?;
        } else {
            copy(&path, &to)?;
        }
    }
    if kind == Kind::Archive {
        let manual = into.join(MANUAL);
        fs::create_dir_all(&manual).map_err(Error::of(&manual))?;
        output(Command::new(&program).args(["man", "--into"]).arg(&manual))?;
        for (arguments, to) in PRINTED {
            let printed = output(Command::new(&program).args(arguments))?;
            write(&into.join(to), &printed)?;
        }
    }
    for (text, to) in WRITTEN {
        let text = text.replace("@VERSION@", &metadata.version);
        write(&into.join(to), text.as_bytes())?;
    }
    let pages = into.join("share/doc/pilum");
    licences::write(repository, metadata, kind.library(), &pages)
}

/// Packs a folder as `tar.gz`, with its name as the first part of every path. The same files give the same
/// bytes: owners and times are left out, names are sorted.
///
/// # Errors
/// [`Error::File`]
pub fn pack(folder: &Path, archive: &Path) -> Result<(), Error> {
    let unwritable = Error::of(archive);
    let top = PathBuf::from(folder.file_name().unwrap_or_default());
    let file = fs::File::create(archive).map_err(&unwritable)?;
    let zipped = flate2::GzBuilder::new().write(file, flate2::Compression::best());
    let mut tar = tar::Builder::new(zipped);
    for path in below(folder)? {
        let inner = path.strip_prefix(folder).unwrap_or(&path);
        let content = fs::read(&path).map_err(Error::of(&path))?;
        let mut header = tar::Header::new_gnu();
        let is_script = inner.extension().is_some_and(|ending| ending == "sh");
        let is_program = is_script || inner.starts_with("bin") || inner.starts_with("lib/pilum");
        header.set_mode(if is_program { 0o755 } else { 0o644 });
        header.set_size(content.len() as u64);
        header.set_mtime(0);
        tar.append_data(&mut header, top.join(inner), content.as_slice())
            .map_err(&unwritable)?;
    }
    let zipped = tar.into_inner().map_err(&unwritable)?;
    zipped.finish().map_err(&unwritable)?;
    Ok(())
}

/// All files below a folder, sorted.
fn below(folder: &Path) -> Result<Vec<PathBuf>, Error> {
    let mut found = Vec::new();
    let entries = fs::read_dir(folder).map_err(Error::of(folder))?;
    for entry in entries {
        let path = entry.map_err(Error::of(folder))?.path();
        if path.is_dir() {
            found.extend(below(&path)?);
        } else {
            found.push(path);
        }
    }
    found.sort();
    Ok(found)
}

/// Every file of the repository that is in the archive, and where.
fn places(repository: &Path, metadata: &Metadata) -> Result<Places, Error> {
    let mut places = Places::new();
    for law in metadata.laws() {
        let page = PathBuf::from(format!("models/{law}/LAW.md"));
        let to = Path::new("share/doc/pilum").join(&page);
        places.insert(page, to);
    }
    for (from, to) in FILES {
        let path = repository.join(from);
        if path.is_dir() {
            let files = below(&path)?;
            let inner = files
                .iter()
                .filter_map(|file| file.strip_prefix(&path).ok());
            for inner in inner.filter(|file| is_for_users(file)) {
                places.insert(Path::new(from).join(inner), Path::new(to).join(inner));
            }
        } else {
            let name = path.file_name().unwrap_or_default();
            places.insert(from.into(), Path::new(to).join(name));
        }
    }
    Ok(places)
}

/// Files that users read or run. Others may lie in the repository that a run has left.
fn is_for_users(file: &Path) -> bool {
    let is_left = file.components().any(|part| part.as_os_str() == "results");
    let endings = [
        "md", "ipynb", "toml", "csv", "svg", "msh", "geo", "py", "sh", "sbatch", "txt", "f90",
        "inc",
    ];
    let ending = file.extension().and_then(|ending| ending.to_str());
    !is_left && (file.ends_with("Snakefile") || ending.is_some_and(|e| endings.contains(&e)))
}

fn copy_built(from: &Path, to: &Path) -> Result<(), Error> {
    if from.is_file() {
        // A program that runs cannot be written to, but its file can be taken away.
        let _ = fs::remove_file(to);
        copy(from, to)
    } else {
        Err(Error::NotBuilt(from.to_owned()))
    }
}

fn copy(from: &Path, to: &Path) -> Result<(), Error> {
    make_folder_of(to)?;
    fs::copy(from, to).map_err(Error::of(from))?;
    Ok(())
}

fn write(to: &Path, text: &[u8]) -> Result<(), Error> {
    make_folder_of(to)?;
    fs::write(to, text).map_err(Error::of(to))
}

fn make_folder_of(path: &Path) -> Result<(), Error> {
    let folder = path.parent().unwrap_or(path);
    fs::create_dir_all(folder).map_err(Error::of(folder))
}

/// What a command prints.
fn output(command: &mut Command) -> Result<Vec<u8>, Error> {
    let output = command.output();
    let why = match output {
        Ok(output) if output.status.success() => return Ok(output.stdout),
        Ok(output) => String::from_utf8_lossy(&output.stderr).into_owned(),
        Err(why) => why.to_string(),
    };
    let command = format!("{command:?}");
    Err(Error::Command { command, why })
}
