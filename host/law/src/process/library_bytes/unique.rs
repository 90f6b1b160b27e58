//! Variables that C++ has only once in a process (`STB_GNU_UNIQUE`): inline variables, statics of inline functions, of
//! templates and of classes. Whatever library or copy of one asks for such a name is given the one that was loaded first.
//! In the copy of a library that is loaded they become ordinary symbols, so that every image has its own. Those of
//! the compiler's library, and of libraries that this one is linked with, stay as they are: they are meant to be shared.

use crate::needs::{each_supplier, needs};
use object::read::elf::{FileHeader, SectionHeader, Sym};
use object::{Endianness, ReadCache, ReadRef, elf};
use std::collections::BTreeSet;
use std::fs::File;
use std::io;
use std::os::unix::fs::FileExt;
use std::path::Path;

/// How the names of the compiler's library begin, behind what marks statics of functions and their guards.
const SHARED: [&str; 8] = [
    "St",
    "NSt",
    "NKSt",
    "N9__gnu_cxx",
    "NK9__gnu_cxx",
    "Ns",
    "NSs",
    "NKSs",
];
/// Bytes before the binding in an entry of the table.
const BINDING: u64 = 4;

/// Offset in the file of the binding of such a variable, its type, and its name.
type Unique = (u64, u8, String);

/// Makes them ordinary in a copy of the library at `path`. A file that cannot be read as one is left to the loader.
///
/// # Errors
/// The copy cannot be written.
pub(super) fn make_ordinary(copy: &File, path: &Path) -> io::Result<()> {
    let Ok(all) = unique(&ReadCache::new(copy)) else {
        return Ok(());
    };
    let mut own: Vec<Unique> = all.into_iter().filter(|one| !is_shared(&one.2)).collect();
    if own.is_empty() {
        return Ok(());
    }
    let linked = of_linked(path);
    own.retain(|(_, _, name)| !linked.contains(name));
    for (at, kind, _) in own {
        copy.write_all_at(&[elf::STB_GLOBAL << 4 | kind], at)?;
    }
    Ok(())
}

/// The variables in an ELF file.
fn unique<'data>(data: impl ReadRef<'data>) -> object::Result<Vec<Unique>> {
    let header = elf::FileHeader64::<Endianness>::parse(data)?;
    let endian = header.endian()?;
    let sections = header.sections(endian, data)?;
    let symbols = sections.symbols(endian, data, elf::SHT_DYNSYM)?;
    let Ok(table) = sections.section(symbols.section()) else {
        return Ok(Vec::new());
    };
    let first = table.sh_offset(endian);
    let size = size_of::<elf::Sym64<Endianness>>() as u64;
    let mut all = Vec::new();
    for (index, symbol) in symbols.enumerate() {
        if symbol.st_bind() == elf::STB_GNU_UNIQUE && !symbol.is_undefined(endian) {
            let name = symbols.symbol_name(endian, symbol)?;
            let at = first + size * index.0 as u64 + BINDING;
            all.push((
                at,
                symbol.st_type(),
                String::from_utf8_lossy(name).into_owned(),
            ));
        }
    }
    Ok(all)
}

/// Whether a name is one of the compiler's library.
fn is_shared(name: &str) -> bool {
    let Some(name) = name.strip_prefix("_Z") else {
        return false;
    };
    let name = ["GV", "TH", "TW"]
        .iter()
        .find_map(|mark| name.strip_prefix(mark))
        .unwrap_or(name);
    let name = name.trim_start_matches('Z');
    SHARED.iter().any(|start| name.starts_with(start))
}

/// Names of such variables in the libraries that this one is linked with.
fn of_linked(path: &Path) -> BTreeSet<String> {
    let mut names = BTreeSet::new();
    let Ok(bytes) = text::file::read_library(path) else {
        return names;
    };
    let file = object::File::parse(&*bytes).ok();
    let wanted = file.and_then(|file| needs(&file, &bytes).ok());
    if let Some((needs, search)) = wanted {
        each_supplier(path, (&needs, &search), |_, bytes| {
            names.extend(unique(bytes).into_iter().flatten().map(|(_, _, name)| name));
        });
    }
    names
}

#[cfg(test)]
mod tests {
    use super::is_shared;

    #[test]
    fn what_the_compilers_library_has_stays_shared() {
        let rows = "
shared _ZNSt7num_putIcSt19ostreambuf_iteratorIcSt11char_traitsIcEEE2idE
shared _ZGVNSt7num_getIcSt19istreambuf_iteratorIcSt11char_traitsIcEEE2idE
shared _ZNSs4_Rep20_S_empty_rep_storageE
shared _ZZN9__gnu_cxx18__common_pool_baseINS_6__poolELb1EE16_S_initialize_onceEvE6__init
own _ZGVZN4pile5firstEdE1v
own _ZZ5firstdE1v
own _ZN5Joint10parametersE
own _ZN4KeptIiE7modulusE
own calls";
        for row in rows.trim().lines() {
            let (kind, name) = row.split_once(' ').unwrap();
            assert_eq!(is_shared(name), kind == "shared", "{name}");
        }
    }
}
