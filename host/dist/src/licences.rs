//! Licences of everything that is in the program and in the laws.

use crate::metadata::Package;
use crate::{Error, Metadata, copy, output};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// How names of files with licences begin.
const NAMES: [&str; 6] = [
    "LICENSE",
    "LICENCE",
    "COPYING",
    "COPYRIGHT",
    "NOTICE",
    "UNLICENSE",
];

/// Writes `licences.txt` into a folder: every package of the program, of the laws and of a library next to them with
/// its licence, then the texts, each once. The licences of Rust's own library follow, if the
/// toolchain has them.
pub(crate) fn write(
    repository: &Path,
    metadata: &Metadata,
    library: Option<&str>,
    folder: &Path,
) -> Result<(), Error> {
    let mut list = format!(
        "Pilum {} is free software under the MIT licence or the Apache licence 2.0, at your choice: \
         LICENSE-MIT and\nLICENSE-APACHE beside this file. Program and laws contain the standard library of \
         Rust (MIT OR Apache-2.0) and these\nlibraries of others, whose sources are at the addresses given; \
         reports contain uPlot (MIT).\n\n",
        metadata.version
    );
    // Texts, with those who have them.
    let mut texts: BTreeMap<String, Vec<String>> = BTreeMap::new();
    let linked = metadata.linked(library);
    for package in linked.iter().filter(|package| package.is_foreign) {
        let Package { name, version, .. } = package;
        let address = package.repository.as_deref().unwrap_or("");
        let _ = writeln!(list, "{name} {version}: {}  {address}", package.licence);
        let files = files(&package.folder)?;
        if files.is_empty() {
            let by = match package.authors.join(", ") {
                authors if authors.is_empty() => "its authors".to_owned(),
                authors => authors,
            };
            let _ = writeln!(
                list,
                "  Copyright (c) {by}. It comes without a text of its own: see those of the same licence."
            );
        }
        for path in files {
            let of = texts.entry(text_of(&path)?).or_default();
            of.push(format!("{name} {version}"));
        }
    }
    let uplot = repository.join("host/results/src/report/vendor/LICENSE-uPlot");
    let of = texts.entry(text_of(&uplot)?).or_default();
    of.push("uPlot".to_owned());
    for (text, of) in texts {
        let line = "-".repeat(100);
        let _ = write!(list, "\n{line}\n{}:\n\n{text}\n", of.join(", "));
    }
    let to = folder.join("licences.txt");
    fs::write(&to, list).map_err(Error::of(&to))?;
    copy_of_rust(repository, folder)
}

/// The text of a licence.
fn text_of(path: &Path) -> Result<String, Error> {
    let text = fs::read_to_string(path).map_err(Error::of(path))?;
    Ok(text.replace('\r', "").trim_end().to_owned())
}

/// Copies the licences of Rust's own library, if the toolchain has them.
fn copy_of_rust(repository: &Path, folder: &Path) -> Result<(), Error> {
    let mut rustc = Command::new("rustc");
    let rustc = rustc.args(["--print", "sysroot"]).current_dir(repository);
    let sysroot = output(rustc)?;
    let sysroot = PathBuf::from(String::from_utf8_lossy(&sysroot).trim_end());
    let of_rust = sysroot.join("share/doc/rust/COPYRIGHT-library.html");
    if of_rust.is_file() {
        copy(&of_rust, &folder.join("licences-of-rust.html"))?;
    }
    Ok(())
}

/// Files with licences of a package.
fn files(folder: &Path) -> Result<Vec<PathBuf>, Error> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).map_err(Error::of(folder))? {
        let path = entry.map_err(Error::of(folder))?.path();
        let name = path
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .to_uppercase();
        if path.is_file() && NAMES.iter().any(|start| name.starts_with(start)) {
            found.push(path);
        }
    }
    found.sort();
    Ok(found)
}
