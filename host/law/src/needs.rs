//! Libraries that a library file needs, read from the files of both without executing anything.

use object::read::elf::{Dyn, ElfFile, FileHeader};
use object::read::macho::{MachHeader, MachOFile};
use object::read::pe::{ImageNtHeaders, PeFile};
use object::{File, LittleEndian, elf};
use std::collections::{HashSet, VecDeque};
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

/// Libraries that a file needs, and folders in which it wants them looked for.
pub(crate) fn needs(file: &File<'_>, bytes: &[u8]) -> object::Result<(Vec<String>, Vec<String>)> {
    match file {
        File::Elf32(elf) => elf_needs(elf, bytes),
        File::Elf64(elf) => elf_needs(elf, bytes),
        File::MachO32(macho) => macho_needs(macho),
        File::MachO64(macho) => macho_needs(macho),
        File::Pe32(pe) => pe_needs(pe),
        File::Pe64(pe) => pe_needs(pe),
        _ => Ok(Default::default()),
    }
}

fn elf_needs<Elf: FileHeader>(
    file: &ElfFile<'_, Elf>,
    bytes: &[u8],
) -> object::Result<(Vec<String>, Vec<String>)> {
    let endian = file.endian();
    let sections = file.elf_section_table();
    let (mut needs, mut search) = (Vec::new(), Vec::new());
    let Some((entries, strings)) = sections.dynamic(endian, bytes)? else {
        return Ok((needs, search));
    };
    let strings = sections.strings(endian, bytes, strings)?;
    for entry in entries {
        let list = match entry.tag32(endian) {
            Some(elf::DT_NEEDED) => &mut needs,
            Some(elf::DT_RPATH | elf::DT_RUNPATH) => &mut search,
            _ => continue,
        };
        let text = String::from_utf8_lossy(entry.string(endian, strings)?);
        list.extend(text.split(':').map(str::to_owned));
    }
    Ok((needs, search))
}

fn macho_needs<Mach: MachHeader>(
    file: &MachOFile<'_, Mach>,
) -> object::Result<(Vec<String>, Vec<String>)> {
    let endian = file.endian();
    let mut needs = Vec::new();
    let mut commands = file.macho_load_commands()?;
    while let Some(command) = commands.next()? {
        if let Some(library) = command.dylib()? {
            let name = command.string(endian, library.dylib.name)?;
            needs.push(String::from_utf8_lossy(name).into_owned());
        }
    }
    Ok((needs, Vec::new()))
}

fn pe_needs<Pe: ImageNtHeaders>(
    file: &PeFile<'_, Pe>,
) -> object::Result<(Vec<String>, Vec<String>)> {
    let mut needs = Vec::new();
    if let Some(table) = file.import_table()? {
        let mut libraries = table.descriptors()?;
        while let Some(library) = libraries.next()? {
            let name = table.name(library.name.get(LittleEndian))?;
            needs.push(String::from_utf8_lossy(name).into_owned());
        }
    }
    Ok((needs, Vec::new()))
}

/// Reads the libraries that one needs, and those that these need. Names of those that are not found.
pub(crate) fn each_supplier(
    path: &Path,
    (wanted, search): (&[String], &[String]),
    mut look: impl FnMut(&File<'_>, &[u8]),
) -> Vec<String> {
    let folders = folders();
    let mut not_found = Vec::new();
    let mut seen = HashSet::new();
    let mut queue: VecDeque<(String, Vec<PathBuf>)> = VecDeque::new();
    let own = expanded(search, path);
    queue.extend(wanted.iter().map(|name| (name.clone(), own.clone())));
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
        let (needs, search) = needs(&supplier, &bytes).unwrap_or_default();
        let next = expanded(&search, &path);
        queue.extend(needs.into_iter().map(|name| (name, next.clone())));
    }
    not_found
}

/// The folders that a library asks for, from where it lies.
pub(crate) fn expanded(search: &[String], library: &Path) -> Vec<PathBuf> {
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
