//! Who gives a library the symbols that it leaves to others: the libraries that it needs, Pilum, or
//! nobody. Their files are read; nothing of them runs.

use crate::library::abaqus;
use object::{File, Object, ObjectSymbol};
use std::collections::{BTreeSet, HashSet, VecDeque};
use std::path::{Path, PathBuf};
use text::file;

/// Most libraries that are read for one.
const MOST: usize = 200;
/// Default folders of loaders.
const USUAL: [&str; 6] = [
    "/lib/x86_64-linux-gnu",
    "/usr/lib/x86_64-linux-gnu",
    "/lib64",
    "/usr/lib64",
    "/lib",
    "/usr/lib",
];

/// Who supplies what.
#[derive(Debug, Default)]
pub(super) struct Suppliers {
    /// Names that Pilum supplies: utility routines of Abaqus.
    pub(super) ours: Vec<String>,
    /// Names that nobody supplies.
    pub(super) missing: Vec<String>,
    /// Libraries that are needed and not found: what they supply is not known.
    pub(super) not_found: Vec<String>,
}

/// Looks for what an ELF library of this system leaves to others.
pub(super) fn of(
    path: &Path,
    library: &File<'_>,
    (needs, search): (&[String], &[String]),
) -> Suppliers {
    let mut wanted: BTreeSet<String> = library
        .dynamic_symbols()
        .filter(|symbol| symbol.is_undefined() && !symbol.is_weak())
        .filter_map(|symbol| Some(symbol.name().ok()?.to_owned()))
        .filter(|name| !name.is_empty())
        .collect();
    let ours = abaqus::NAMES.into_iter();
    let ours = ours.filter(|name| wanted.remove(*name)).map(str::to_owned);
    let mut suppliers = Suppliers {
        ours: ours.collect(),
        ..Suppliers::default()
    };
    suppliers.not_found = each(path, (needs, search), |supplier, _| {
        for symbol in supplier.dynamic_symbols() {
            if !symbol.is_undefined()
                && let Ok(name) = symbol.name()
            {
                wanted.remove(name);
            }
        }
    });
    if suppliers.not_found.is_empty() {
        suppliers.missing = wanted.into_iter().collect();
    }
    suppliers
}

/// Reads the libraries that one needs, and those that these need. Names of those that are not found.
pub(super) fn each(
    path: &Path,
    (needs, search): (&[String], &[String]),
    mut look: impl FnMut(&File<'_>, &[u8]),
) -> Vec<String> {
    let folders = folders();
    let mut not_found = Vec::new();
    let mut seen = HashSet::new();
    let mut queue: VecDeque<(String, Vec<PathBuf>)> = VecDeque::new();
    let own = expanded(search, path);
    queue.extend(needs.iter().map(|name| (name.clone(), own.clone())));
    while let Some((name, own)) = queue.pop_front() {
        if seen.len() >= MOST || !seen.insert(name.clone()) {
            continue;
        }
        let mut places = own.iter().chain(&folders).map(|folder| folder.join(&name));
        let read = |path: PathBuf| Some((file::read_library(&path).ok()?, path));
        let found = places.find(|path| path.is_file()).and_then(read);
        let Some((bytes, path)) = found else {
            not_found.push(name);
            continue;
        };
        let Ok(supplier) = File::parse(&*bytes) else {
            not_found.push(name);
            continue;
        };
        look(&supplier, &bytes);
        let (needs, search) = super::needs(&supplier, &bytes).unwrap_or_default();
        let next = expanded(&search, &path);
        queue.extend(needs.into_iter().map(|name| (name, next.clone())));
    }
    not_found
}

/// The folders that a library asks for, from where it lies.
fn expanded(search: &[String], library: &Path) -> Vec<PathBuf> {
    let origin = library.parent().unwrap_or(Path::new("")).to_string_lossy();
    let folder = |folder: &String| {
        let folder = folder.replace("${ORIGIN}", &origin);
        PathBuf::from(folder.replace("$ORIGIN", &origin))
    };
    search.iter().map(folder).collect()
}

/// Where the loader looks for all libraries.
fn folders() -> Vec<PathBuf> {
    let mut folders = Vec::new();
    if let Some(list) = std::env::var_os("LD_LIBRARY_PATH") {
        folders.extend(std::env::split_paths(&list).filter(|path| !path.as_os_str().is_empty()));
    }
    let listed = std::fs::read_dir("/etc/ld.so.conf.d").into_iter().flatten();
    let mut files: Vec<PathBuf> = listed.flatten().map(|entry| entry.path()).collect();
    files.sort();
    files.insert(0, PathBuf::from("/etc/ld.so.conf"));
    for file in files {
        let text = std::fs::read_to_string(file).unwrap_or_default();
        let lines = text.lines().map(str::trim);
        folders.extend(
            lines
                .filter(|line| line.starts_with('/'))
                .map(PathBuf::from),
        );
    }
    folders.extend(USUAL.map(PathBuf::from));
    folders
}
