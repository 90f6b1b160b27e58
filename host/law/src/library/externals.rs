//! Routines that a library calls and nobody supplies: their names, and traps in their place.
//!
//! A trap library is a small ELF file, made in memory, that exports the missing names. Each of them
//! says which one it is to [`trapped`], which ends the process. It is loaded before the library, so
//! that this finds them however it was linked (`-z now`) and whatever `LD_BIND_NOW` says.

use crate::needs::{expanded, needs};
use crate::process::library_bytes;
use libloading::os::unix::{Library, RTLD_GLOBAL, RTLD_LAZY, RTLD_LOCAL, RTLD_NOW};
use object::{Object, ObjectSymbol, RelocationFlags, RelocationTarget, elf};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::ffi::c_void;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use text::file;

/// Exit code of a process in which a trap was called.
const TRAPPED: i32 = 71;
/// Most names that one library may lack.
const MOST: usize = 10_000;
/// Largest page of any processor that traps are made for.
const PAGE: usize = 1 << 16;
/// Bytes of one trap.
const TRAP: usize = 32;

/// Names that a library needs and nobody supplies.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Missing {
    /// Symbols that are only called.
    pub(super) routines: BTreeSet<String>,
    /// Symbols that are also read, written or passed on; a trap cannot replace them.
    pub(super) data: BTreeSet<String>,
}

impl Missing {
    /// Why the library cannot be loaded.
    pub(super) fn refusal(&self) -> String {
        let mut parts = Vec::new();
        if !self.routines.is_empty() {
            parts.push(format!(
                "it calls what neither the libraries that it is linked with nor Pilum supply: {}. If \
                 that is never reached, `externals = \"trap\"` on the law lets it load: a call then \
                 ends the worker process and names the routine",
                list(&self.routines)
            ));
        }
        if !self.data.is_empty() {
            parts.push(format!(
                "it uses variables, or addresses of routines, that nobody supplies and no trap can \
                 stand for: {}",
                list(&self.data)
            ));
        }
        parts.join("; ")
    }
}

fn list(names: &BTreeSet<String>) -> String {
    let names: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
    names.join(", ")
}

/// What a library that cannot be loaded lacks. `None` if that is not known, or nothing: then something
/// else keeps it from being loaded.
pub(super) fn missing(path: &Path) -> Option<Missing> {
    let bytes = file::read_library(path).ok()?;
    let file = object::File::parse(&*bytes).ok()?;
    let undefined = undefined(&file)?;
    let (needs, search) = needs(&file, &bytes).ok()?;
    let folders = expanded(&search, path);
    let mut suppliers = vec![Library::this()];
    for name in &needs {
        suppliers.push(open_needed(name, &folders)?);
    }
    let mut missing = Missing::default();
    for (name, is_only_called) in undefined {
        let supplied = suppliers.iter().any(|library| {
            // SAFETY: the address is not used.
            unsafe { library.get::<*const c_void>(name.as_bytes()) }.is_ok()
        });
        if supplied {
            continue;
        }
        let those = if is_only_called {
            &mut missing.routines
        } else {
            &mut missing.data
        };
        those.insert(name);
    }
    // They stay open, like all libraries.
    std::mem::forget(suppliers);
    let n = missing.routines.len() + missing.data.len();
    (n > 0 && n <= MOST).then_some(missing)
}

/// Opens a library that another needs, where that one looks for it.
fn open_needed(name: &str, folders: &[PathBuf]) -> Option<Library> {
    let mut places = folders.iter().map(|folder| folder.join(name));
    let found = places.find(|path| path.is_file());
    let path = found.unwrap_or_else(|| PathBuf::from(name));
    // SAFETY: the library that the user named would have it loaded, too.
    super::apart(&path, || unsafe {
        Library::open(Some(&path), RTLD_LAZY | RTLD_LOCAL)
    })
    .ok()
}

/// Names that an ELF file must be given, and whether they are only called. Weak ones may be absent.
fn undefined(file: &object::File<'_>) -> Option<BTreeMap<String, bool>> {
    if file.format() != object::BinaryFormat::Elf {
        return None;
    }
    let mut names = BTreeMap::new();
    let mut by_index = HashMap::new();
    for symbol in file.dynamic_symbols() {
        if symbol.is_undefined() && !symbol.is_weak() {
            let name = symbol.name().ok().filter(|name| !name.is_empty());
            if let Some(name) = name {
                by_index.insert(symbol.index(), name.to_owned());
                names.insert(name.to_owned(), true);
            }
        }
    }
    for (_, relocation) in file.dynamic_relocations().into_iter().flatten() {
        let RelocationTarget::Symbol(index) = relocation.target() else {
            continue;
        };
        let is_call = matches!(
            relocation.flags(),
            RelocationFlags::Elf {
                r_type: elf::R_X86_64_JUMP_SLOT | elf::R_AARCH64_JUMP_SLOT
            }
        );
        if let Some(name) = by_index.get(&index).filter(|_| !is_call) {
            names.insert(name.clone(), false);
        }
    }
    Some(names)
}

static NAMES: OnceLock<Vec<String>> = OnceLock::new();

/// Supplies traps for these routines, once in a process: a worker, which has one law.
///
/// # Errors
/// Why there can be none, in words.
pub(super) fn trap(missing: &Missing) -> Result<(), String> {
    if !missing.data.is_empty() {
        let data = Missing {
            routines: BTreeSet::new(),
            data: missing.data.clone(),
        };
        return Err(data.refusal());
    }
    let names: Vec<String> = missing.routines.iter().cloned().collect();
    let target = trapped as extern "C" fn(u32) -> !;
    let library = trap_library(&names, target as usize as u64)
        .ok_or("there are no traps for this kind of processor")?;
    NAMES
        .set(names)
        .map_err(|_| "its process has traps already".to_owned())?;
    load_traps(&library)
}

#[cfg(target_os = "linux")]
fn load_traps(library: &[u8]) -> Result<(), String> {
    use std::os::fd::AsRawFd;
    let failed = |why: &dyn std::fmt::Display| format!("its traps cannot be loaded: {why}");
    let mut memory = library_bytes::memory_file("pilum_traps").map_err(|why| failed(&why))?;
    memory.write_all(library).map_err(|why| failed(&why))?;
    let path = format!("/proc/self/fd/{}", memory.as_raw_fd());
    // SAFETY: it is made here and has no initialisers.
    let library = unsafe { Library::open(Some(path), RTLD_NOW | RTLD_GLOBAL) };
    std::mem::forget((library.map_err(|why| failed(&why))?, memory));
    Ok(())
}

#[cfg(not(target_os = "linux"))]
fn load_traps(_: &[u8]) -> Result<(), String> {
    Err("traps need Linux".to_owned())
}

/// What all traps lead to.
extern "C" fn trapped(number: u32) -> ! {
    let names = NAMES.get().map(Vec::as_slice).unwrap_or_default();
    let name = names.get(number as usize).map_or("?", String::as_str);
    let _ = writeln!(
        std::io::stderr(),
        "the routine calls `{name}`, which nobody supplies"
    );
    std::process::exit(TRAPPED)
}

/// An ELF library whose functions call the one at `target` with their numbers.
fn trap_library(names: &[String], target: u64) -> Option<Vec<u8>> {
    const HEADERS: usize = 64 + 4 * 56;
    let machine = if cfg!(target_arch = "x86_64") {
        elf::EM_X86_64
    } else if cfg!(target_arch = "aarch64") {
        elf::EM_AARCH64
    } else {
        return None;
    };
    let (mut strings, mut starts) = (vec![0], Vec::new());
    for name in names {
        starts.push(strings.len());
        strings.extend(name.as_bytes());
        strings.push(0);
    }
    let n_symbols = names.len() + 1;
    let symbols_at = HEADERS;
    let hash_at = symbols_at + 24 * n_symbols;
    let strings_at = hash_at + 4 * (3 + n_symbols);
    let traps_at = (strings_at + strings.len()).next_multiple_of(TRAP);
    let end = traps_at + TRAP * names.len();
    let dynamic_at = end.next_multiple_of(PAGE);
    let dynamic: [[u64; 2]; 6] = [
        [elf::DT_HASH.into(), hash_at as u64],
        [elf::DT_STRTAB.into(), strings_at as u64],
        [elf::DT_SYMTAB.into(), symbols_at as u64],
        [elf::DT_STRSZ.into(), strings.len() as u64],
        [elf::DT_SYMENT.into(), 24],
        [elf::DT_NULL.into(), 0],
    ];
    let dynamic_size = size_of_val(&dynamic);

    let mut out = Words::default();
    headers(&mut out, machine, end, (dynamic_at, dynamic_size));
    out.up_to(symbols_at + 24);
    symbols(&mut out, &starts, traps_at);
    out.0.extend(strings);
    for number in 0..names.len() {
        out.up_to(traps_at + TRAP * number);
        trap_code(&mut out, number as u32, target);
    }
    out.up_to(dynamic_at);
    for [tag, value] in dynamic {
        out.u64(tag).u64(value);
    }
    Some(out.0)
}

/// The headers of an ELF library of this length that is executed, and of the dynamic part behind it.
fn headers(out: &mut Words, machine: u16, end: usize, (dynamic_at, dynamic_size): (usize, usize)) {
    out.0.extend(elf::ELFMAG);
    out.0
        .extend([elf::ELFCLASS64, elf::ELFDATA2LSB, elf::EV_CURRENT, 0]);
    out.u64(0).u16(elf::ET_DYN).u16(machine).u32(1);
    // No entry; program headers; no sections.
    out.u64(0).u64(64).u64(0).u32(0);
    out.u16(64).u16(56).u16(4).u16(64).u16(0).u16(0);
    let (read, write, execute) = (elf::PF_R, elf::PF_W, elf::PF_X);
    for (kind, flags, at, size, align) in [
        (elf::PT_LOAD, read | execute, 0, end, PAGE),
        (elf::PT_LOAD, read | write, dynamic_at, dynamic_size, PAGE),
        (elf::PT_DYNAMIC, read | write, dynamic_at, dynamic_size, 8),
        (elf::PT_GNU_STACK, read | write, 0, 0, 16),
    ] {
        let (at, size) = (at as u64, size as u64);
        out.u32(kind).u32(flags).u64(at).u64(at).u64(at);
        out.u64(size).u64(size).u64(align as u64);
    }
}

/// Symbols of the traps behind the first one, which is none, and their hash table.
fn symbols(out: &mut Words, names_at: &[usize], traps_at: usize) {
    for (number, name_at) in names_at.iter().enumerate() {
        out.u32(*name_at as u32);
        out.0.extend([elf::STB_GLOBAL << 4 | elf::STT_FUNC, 0]);
        // Any section there is: the symbol is defined.
        out.u16(1);
        out.u64((traps_at + TRAP * number) as u64).u64(TRAP as u64);
    }
    // One bucket, with all symbols in a chain.
    let n = names_at.len() + 1;
    out.u32(1).u32(n as u32).u32(1).u32(0);
    for number in 1..n {
        out.u32(((number + 1) % n) as u32);
    }
}

/// target(number), without coming back.
fn trap_code(out: &mut Words, number: u32, target: u64) {
    if cfg!(target_arch = "x86_64") {
        // mov edi, number; movabs rax, target; jmp rax
        out.0.push(0xbf);
        out.u32(number);
        out.0.extend([0x48, 0xb8]);
        out.u64(target);
        out.0.extend([0xff, 0xe0]);
    } else {
        let half = |value: u64, i: u32| ((value >> (16 * i)) & 0xffff) as u32;
        // movz w0, movk w0; movz x16, three movk x16; br x16
        out.u32(0x5280_0000 | half(number.into(), 0) << 5);
        out.u32(0x72a0_0000 | half(number.into(), 1) << 5);
        out.u32(0xd280_0010 | half(target, 0) << 5);
        for i in 1..4 {
            out.u32(0xf280_0010 | i << 21 | half(target, i) << 5);
        }
        out.u32(0xd61f_0200);
    }
}

/// Little-endian bytes, one value after the other.
#[derive(Debug, Default)]
struct Words(Vec<u8>);

impl Words {
    fn u16(&mut self, value: u16) -> &mut Self {
        self.0.extend(value.to_le_bytes());
        self
    }

    fn u32(&mut self, value: u32) -> &mut Self {
        self.0.extend(value.to_le_bytes());
        self
    }

    fn u64(&mut self, value: u64) -> &mut Self {
        self.0.extend(value.to_le_bytes());
        self
    }

    /// Zeros up to this place.
    fn up_to(&mut self, place: usize) {
        self.0.resize(place, 0);
    }
}
