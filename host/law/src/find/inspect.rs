//! What a library says about itself on disk. Nothing of it is executed, and it may be for another
//! kind of computer.

mod suppliers;

use crate::Error;
use crate::foreign::{self, Adapter};
use crate::needs::needs;
use crate::process::library_bytes::hexadecimal_sha256;
use abi::raw::{self, MagicBlock};
use abi::version;
use object::{Architecture, BinaryFormat, File, Object, ObjectSection, ObjectSymbol};
use object::{ReadRef, SymbolKind};
use serde::Serialize;
use std::collections::BTreeSet;
use std::fmt::{self, Write as _};
use std::path::{Path, PathBuf};
use text::file;

/// Symbols of the contract.
const CONTRACT: [&str; 4] = [
    "pilum_magic",
    "pilum_entry",
    "pilum_rust_layout",
    "pilum_rust_layout_1_1",
];
/// Symbols that linkers add.
const LINKER: [&str; 6] = [
    "_init",
    "_fini",
    "_edata",
    "_end",
    "__bss_start",
    "__dso_handle",
];

/// What was read from a library.
#[derive(Clone, Debug, Serialize)]
pub struct Inspection {
    /// The file.
    pub path: PathBuf,
    /// Its size in bytes.
    pub bytes: usize,
    /// Its SHA-256 in hexadecimal digits.
    pub sha256: String,
    /// `elf`, `mach-o` or `pe`.
    pub format: &'static str,
    /// Processor, such as `x86_64`.
    pub architecture: String,
    /// Address width.
    pub bits: u8,
    /// The handshake block, if it has one.
    pub handshake: Option<Handshake>,
    /// Laws in its manifest.
    pub laws: Vec<ManifestEntry>,
    /// Libraries that it needs.
    pub needs: Vec<String>,
    /// Folders that it asks the loader to search for them.
    pub search: Vec<String>,
    /// Symbols that others can use.
    pub exported: Vec<String>,
    /// Symbols that others must provide.
    pub undefined: Vec<String>,
    /// Those of them that this program provides: utility routines of Abaqus.
    pub from_pilum: Vec<String>,
    /// Those of them that nobody provides.
    pub missing: Vec<String>,
    /// Why this program could not use it, and what it should not have.
    pub remarks: Vec<String>,
}

/// The handshake block as it is in the file.
#[derive(Clone, Debug, Serialize)]
pub struct Handshake {
    /// Version of the contract, major and minor.
    pub abi: [u16; 2],
    /// Hash of the layout of the contract's types.
    pub layout_hash: String,
    /// What the library was built with.
    pub sdk: String,
    /// The field that keeps this program from using it.
    pub mismatch: Option<String>,
}

/// A line of the manifest.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct ManifestEntry {
    /// Id of the law.
    pub id: String,
    /// Version of the law.
    pub version: String,
}

/// Reads a library without executing it.
///
/// # Errors
/// [`text::Error::Unreadable`]; [`Error::Library`] for what is no library.
pub fn inspect(path: &Path) -> Result<Inspection, Error> {
    let bytes = file::read_library(path).map_err(|source| text::Error::Unreadable {
        path: path.to_owned(),
        source,
    })?;
    inspect_bytes(path, &bytes)
}

/// As [`inspect`], with the bytes of the file.
///
/// # Errors
/// It is no library.
pub fn inspect_bytes(path: &Path, bytes: &[u8]) -> Result<Inspection, Error> {
    let no_library =
        |why: &dyn fmt::Display| Error::library(format!("{} is no library: {why}", path.display()));
    let file = File::parse(bytes).map_err(|why| no_library(&why))?;
    let format = match file.format() {
        BinaryFormat::Elf => "elf",
        BinaryFormat::MachO => "mach-o",
        BinaryFormat::Pe => "pe",
        other => {
            return Err(no_library(&format!(
                "{other:?} is not a format of libraries"
            )));
        }
    };
    let (needs, search) = needs(&file, bytes).map_err(|why| no_library(&why))?;
    let (exported, undefined) = symbols(&file).map_err(|why| no_library(&why))?;
    let mut inspection = Inspection {
        path: path.to_owned(),
        bytes: bytes.len(),
        sha256: hexadecimal_sha256(bytes),
        format,
        architecture: architecture(file.architecture()),
        bits: if file.is_64() { 64 } else { 32 },
        handshake: handshake(&file),
        laws: manifest(&file).unwrap_or_default(),
        needs,
        search,
        exported,
        undefined,
        from_pilum: Vec::new(),
        missing: Vec::new(),
        remarks: Vec::new(),
    };
    inspection.remarks = inspection.remarks(&file);
    inspection.look_for_suppliers(&file);
    Ok(inspection)
}

impl Inspection {
    /// Whether it is a user subroutine of Abaqus, and no library of the contract.
    pub fn is_umat(&self) -> bool {
        let has = |name: &str| self.exported.iter().any(|other| other == name);
        let exports = || foreign::UMAT_SYMBOLS.into_iter().any(has);
        self.handshake.is_none() && (exports() || foreign::sidecar_of(&self.path).is_some())
    }

    /// The program it is made for, if it is no library of the contract and that can be seen from outside.
    pub fn adapter(&self) -> Option<Adapter> {
        if self.handshake.is_some() {
            return None;
        }
        let exports = |is: fn(&str) -> bool| self.exported.iter().any(|name| is(name));
        if self.is_umat() {
            Some(Adapter::Umat)
        } else if exports(|name| name.ends_with("_mfront_mkt")) {
            Some(Adapter::Mfront)
        } else {
            let is_model = |name: &str| name.trim_end_matches('_').eq_ignore_ascii_case("user_mod");
            exports(is_model).then_some(Adapter::Udsm)
        }
    }

    /// Says who provides the symbols that it leaves to others, if it is for this system.
    fn look_for_suppliers(&mut self, file: &File<'_>) {
        let is_ours = self.format == "elf" && self.architecture == std::env::consts::ARCH;
        if !is_ours || cfg!(not(target_os = "linux")) {
            return;
        }
        let suppliers = suppliers::of(&self.path, file, (&self.needs, &self.search));
        if !suppliers.not_found.is_empty() {
            self.remarks.push(format!(
                "not found, of the libraries that it needs: {}; what they provide is not known",
                suppliers.not_found.join(", ")
            ));
        }
        if !suppliers.missing.is_empty() {
            let hint = if self.is_umat() {
                ": it is refused, unless `externals = \"trap\"` says that they are never reached"
            } else {
                ": it cannot be opened"
            };
            let n = suppliers.missing.len();
            self.remarks
                .push(format!("nobody provides {n} of its symbols{hint}"));
        }
        (self.from_pilum, self.missing) = (suppliers.ours, suppliers.missing);
    }

    /// What this system cannot load.
    fn mismatches(&self, file: &File<'_>) -> Vec<String> {
        let mut remarks = Vec::new();
        let ours = std::env::consts::ARCH;
        if self.architecture != ours {
            remarks.push(format!(
                "it is for {}, this program for {ours}",
                self.architecture
            ));
        }
        let format = match std::env::consts::OS {
            "windows" => "pe",
            "macos" | "ios" => "mach-o",
            _ => "elf",
        };
        if self.format != format {
            remarks.push(format!(
                "it has the format {}, this system uses {format}",
                self.format
            ));
        }
        if file.kind() != object::ObjectKind::Dynamic {
            remarks.push(format!("it is no shared library: {:?}", file.kind()));
        }
        remarks
    }

    fn remarks(&self, file: &File<'_>) -> Vec<String> {
        let mut remarks = self.mismatches(file);
        match &self.handshake {
            None if self.is_umat() => remarks.push(match foreign::sidecar_of(&self.path) {
                Some(sidecar) => {
                    format!(
                        "a user subroutine of Abaqus, with the sidecar {}",
                        sidecar.display()
                    )
                }
                None => {
                    "a user subroutine of Abaqus, without a sidecar: `pilum new-sidecar` writes one"
                        .to_owned()
                }
            }),
            None => {
                remarks.push("it has no handshake block `pilum_magic`: no law library".to_owned());
            }
            Some(handshake) => remarks.extend(handshake.mismatch.clone()),
        }
        if self.handshake.is_some() {
            if !self.exported.iter().any(|name| name == "pilum_entry") {
                remarks.push("it has no function `pilum_entry`".to_owned());
            }
            if self.laws.is_empty() {
                remarks.push(
                    "it has no manifest: its laws are found only by the file's name".to_owned(),
                );
            }
        }
        let others: Vec<&str> = self
            .exported
            .iter()
            .map(String::as_str)
            .filter(|name| !CONTRACT.contains(name) && !LINKER.contains(name))
            .filter(|name| !self.is_for_other_programs(name))
            .filter(|_| !self.is_umat())
            .collect();
        if let [first, ..] = others.as_slice() {
            remarks.push(format!(
                "it exports {} symbols beside the contract's, such as `{first}`: hide them",
                others.len()
            ));
        }
        remarks
    }

    /// Entries of other programs: user materials, and behaviours of MFront's generic interface.
    fn is_for_other_programs(&self, name: &str) -> bool {
        let behaviours = self.exported.iter();
        let mut behaviours = behaviours.filter_map(|name| name.strip_suffix("_mfront_mkt"));
        matches!(name, "umat_" | "umat" | "UMAT" | "CALCULIX")
            || behaviours.any(|behaviour| {
                name.strip_prefix(behaviour)
                    .is_some_and(|rest| rest.starts_with('_'))
            })
    }
}

impl fmt::Display for Inspection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let list = |names: &[String]| match names {
            [] => "none".to_owned(),
            names => wrapped(names),
        };
        writeln!(f, "library       {}", self.path.display())?;
        writeln!(f, "sha256        {}", self.sha256)?;
        writeln!(
            f,
            "format        {}, {}, {} bit, {} bytes",
            self.format, self.architecture, self.bits, self.bytes
        )?;
        if let Some(Handshake {
            abi: [major, minor],
            layout_hash,
            sdk,
            ..
        }) = &self.handshake
        {
            writeln!(
                f,
                "contract      {major}.{minor}, layout {layout_hash}, built with {sdk}"
            )?;
        }
        let laws: Vec<String> = self
            .laws
            .iter()
            .map(|law| format!("{} {}", law.id, law.version))
            .collect();
        writeln!(f, "laws          {}", list(&laws))?;
        writeln!(f, "needs         {}", list(&self.needs))?;
        if !self.search.is_empty() {
            writeln!(f, "looks in      {}", list(&self.search))?;
        }
        writeln!(f, "exports       {}", list(&self.exported))?;
        write!(f, "undefined     {}", list(&self.undefined))?;
        for (what, names) in [("from Pilum", &self.from_pilum), ("missing", &self.missing)] {
            if !names.is_empty() {
                write!(f, "\n{what:14}{}", list(names))?;
            }
        }
        for remark in &self.remarks {
            write!(f, "\nremark        {remark}")?;
        }
        Ok(())
    }
}

/// Names in lines of readable length.
fn wrapped(names: &[String]) -> String {
    const INDENT: usize = 14;
    const LINE: usize = 100;
    let mut text = String::new();
    let mut column = INDENT;
    for (i, name) in names.iter().enumerate() {
        if i > 0 {
            let fits = column + 2 + name.chars().count() < LINE;
            let break_line = format!(",\n{:INDENT$}", "");
            text.push_str(if fits { ", " } else { &break_line });
            column = if fits { column + 2 } else { INDENT };
        }
        column += name.chars().count();
        text.push_str(name);
    }
    text
}

/// The name that Rust's target names use.
fn architecture(architecture: Architecture) -> String {
    match architecture {
        Architecture::X86_64 => "x86_64".to_owned(),
        Architecture::I386 => "x86".to_owned(),
        Architecture::Aarch64 => "aarch64".to_owned(),
        other => format!("{other:?}").to_lowercase(),
    }
}

/// Laws in the manifest section; `None` without one.
pub fn manifest<'data>(file: &File<'data, impl ReadRef<'data>>) -> Option<Vec<ManifestEntry>> {
    let section = file
        .section_by_name(".pilum")
        .or_else(|| file.section_by_name("__pilum"))?;
    let text = std::str::from_utf8(section.data().ok()?).ok()?;
    let mut lines = text.trim_end_matches('\0').lines();
    (lines.next()? == "pilum 1").then(|| {
        let entry = |line: &str| {
            let mut words = line.split_whitespace();
            Some(ManifestEntry {
                id: words.next()?.to_owned(),
                version: words.next().unwrap_or_default().to_owned(),
            })
        };
        lines.filter_map(entry).collect()
    })
}

/// The numbers of the block, but its text.
fn magic_block(bytes: &[u8], is_little_endian: bool) -> MagicBlock {
    let number = |at: usize, n: usize| {
        let bytes = &bytes[at..at + n];
        let digit = |all: u64, byte: &u8| all << 8 | u64::from(*byte);
        if is_little_endian {
            bytes.iter().rev().fold(0, digit)
        } else {
            bytes.iter().fold(0, digit)
        }
    };
    MagicBlock {
        struct_size: number(0, 4) as u32,
        magic: number(4, 4) as u32,
        abi_major: number(8, 2) as u16,
        abi_minor: number(10, 2) as u16,
        pointer_bytes: bytes[12],
        real_bytes: bytes[13],
        reserved: [0; 2],
        layout_hash: number(16, 8),
        sdk: [0; 40],
    }
}

/// The block that the file exports as `pilum_magic`.
fn handshake(file: &File<'_>) -> Option<Handshake> {
    let named = |symbol: &object::Symbol<'_, '_>| {
        symbol.is_definition()
            && symbol
                .name()
                .is_ok_and(|name| matches!(name, "pilum_magic" | "_pilum_magic"))
    };
    let address = file
        .dynamic_symbols()
        .chain(file.symbols())
        .find(named)
        .map(|symbol| symbol.address())
        .or_else(|| {
            let exports = file.exports().ok()?;
            let export = exports.iter().find(|e| e.name() == b"pilum_magic")?;
            Some(export.address())
        })?;
    let bytes = file
        .sections()
        .find_map(|section| section.data_range(address, 64).ok().flatten())?;
    let block = magic_block(bytes, file.is_little_endian());
    let sdk = &bytes[24..64];
    let sdk: Vec<u8> = sdk.iter().copied().take_while(|&byte| byte != 0).collect();
    (block.magic == raw::PILUM_MAGIC || block.magic == raw::PILUM_MAGIC.swap_bytes()).then(|| {
        Handshake {
            abi: [block.abi_major, block.abi_minor],
            layout_hash: format!("{:#018x}", block.layout_hash),
            sdk: String::from_utf8_lossy(&sdk).into_owned(),
            mismatch: version::check(&block).err().map(|why| why.to_string()),
        }
    })
}

/// Names of exported and of undefined symbols, sorted.
fn symbols(file: &File<'_>) -> object::Result<(Vec<String>, Vec<String>)> {
    let mut exported = BTreeSet::new();
    let mut undefined = BTreeSet::new();
    if file.format() == BinaryFormat::Elf {
        for symbol in file.dynamic_symbols() {
            let Ok(name) = symbol.name() else { continue };
            if name.is_empty() || symbol.kind() == SymbolKind::File {
                continue;
            }
            if symbol.is_undefined() {
                undefined.insert(name.to_owned());
            } else if symbol.is_global() {
                exported.insert(name.to_owned());
            }
        }
    } else {
        let text = |name: &[u8]| {
            let name = String::from_utf8_lossy(name).into_owned();
            let c_name = name
                .strip_prefix('_')
                .filter(|_| file.format() == BinaryFormat::MachO);
            c_name.map(str::to_owned).unwrap_or(name)
        };
        exported.extend(file.exports()?.iter().map(|export| text(export.name())));
        undefined.extend(file.imports()?.iter().map(|import| text(import.name())));
    }
    Ok((
        exported.into_iter().collect(),
        undefined.into_iter().collect(),
    ))
}

/// The inspection as JSON.
///
/// # Errors
/// [`text::Error::Internal`].
#[inline]
pub fn json(inspection: &Inspection) -> Result<String, Error> {
    let mut text =
        serde_json::to_string_pretty(inspection).map_err(|why| Error::internal(why.to_string()))?;
    let _ = writeln!(text);
    Ok(text)
}
