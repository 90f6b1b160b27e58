//! Data that a library exports, read from its file without loading it.

use object::{Object, ObjectSection, ObjectSymbol, RelocationFlags, RelocationTarget, elf};
use std::collections::{BTreeSet, HashMap};

/// Longest text that is read, in bytes.
const LONGEST_TEXT: usize = 4096;
/// Most texts of a list.
const LONGEST_LIST: u16 = 256;

/// The exported data of an ELF library.
#[derive(Debug)]
pub(super) struct Symbols<'a> {
    file: object::File<'a>,
    addresses: HashMap<&'a str, u64>,
    /// Where the loader puts addresses, and which.
    pointers: HashMap<u64, u64>,
}

impl<'a> Symbols<'a> {
    /// Reads the symbol table.
    ///
    /// # Errors
    /// The defect of the file, in words.
    pub(super) fn read(bytes: &'a [u8]) -> Result<Self, String> {
        let file = object::File::parse(bytes).map_err(|why| format!("is no library: {why}"))?;
        if file.format() != object::BinaryFormat::Elf || !file.is_little_endian() || !file.is_64() {
            return Err(
                "is no 64-bit little-endian ELF file, the only kind that is read".to_owned(),
            );
        }
        let mut addresses = HashMap::new();
        for symbol in file.dynamic_symbols().filter(|s| !s.is_undefined()) {
            // A name outlives the table it is read from: both belong to the bytes.
            if let Ok(name) = symbol.name_bytes()
                && let Some(name) = within(bytes, name)
            {
                addresses.insert(name, symbol.address());
            }
        }
        let mut pointers = HashMap::new();
        for (place, relocation) in file.dynamic_relocations().into_iter().flatten() {
            let RelocationFlags::Elf { r_type } = relocation.flags() else {
                continue;
            };
            let base = match (r_type, relocation.target()) {
                (elf::R_X86_64_RELATIVE | elf::R_AARCH64_RELATIVE, _) => Some(0),
                (elf::R_X86_64_64 | elf::R_AARCH64_ABS64, RelocationTarget::Symbol(index)) => file
                    .dynamic_symbol_table()
                    .and_then(|table| {
                        object::ObjectSymbolTable::symbol_by_index(&table, index).ok()
                    })
                    .map(|symbol| symbol.address()),
                _ => None,
            };
            if let Some(base) = base {
                pointers.insert(place, base.wrapping_add_signed(relocation.addend()));
            }
        }
        Ok(Self {
            file,
            addresses,
            pointers,
        })
    }

    /// Names that start with what comes before `suffix`: `Law` for the symbol `Law_mfront_mkt`.
    pub(super) fn before(&self, suffix: &str) -> BTreeSet<&'a str> {
        let names = self.addresses.keys();
        names.filter_map(|name| name.strip_suffix(suffix)).collect()
    }

    /// Whether there is such a symbol.
    pub(super) fn has(&self, name: &str) -> bool {
        self.addresses.contains_key(name)
    }

    /// The bytes at a symbol; zeros where the file leaves them to the loader.
    fn bytes<const N: usize>(&self, address: u64) -> Option<[u8; N]> {
        self.file.sections().find_map(|section| {
            let inside = address
                .checked_sub(section.address())
                .and_then(|offset| section.size().checked_sub(offset))
                .is_some_and(|left| left >= N as u64);
            let kind = section.kind();
            if inside && kind == object::SectionKind::UninitializedData {
                return Some([0; N]);
            }
            section
                .data_range(address, N as u64)
                .ok()
                .flatten()?
                .try_into()
                .ok()
        })
    }

    /// `unsigned short`.
    pub(super) fn number(&self, name: &str) -> Option<u16> {
        self.bytes(*self.addresses.get(name)?)
            .map(u16::from_le_bytes)
    }

    /// `double`.
    pub(super) fn real(&self, name: &str) -> Option<f64> {
        self.bytes(*self.addresses.get(name)?)
            .map(f64::from_le_bytes)
    }

    /// `long double` as x86 has it: 64 bits of mantissa, with the leading one.
    pub(super) fn long_double(&self, name: &str) -> Option<f64> {
        if self.file.architecture() != object::Architecture::X86_64 {
            return None;
        }
        let bytes: [u8; 10] = self.bytes(*self.addresses.get(name)?)?;
        let (mantissa, top) = bytes.split_at(8);
        let mantissa = u64::from_le_bytes(mantissa.try_into().ok()?);
        let top = u16::from_le_bytes(top.try_into().ok()?);
        let sign = if top & 0x8000 == 0 { 1.0 } else { -1.0 };
        let exponent = i32::from(top & 0x7fff) - 16383 - 63;
        Some(if top & 0x7fff == 0x7fff {
            sign * f64::INFINITY
        } else {
            // In two steps, so that neither power overflows.
            let half = exponent / 2;
            sign * mantissa as f64 * 2f64.powi(half) * 2f64.powi(exponent - half)
        })
    }

    /// `const char *`.
    pub(super) fn text(&self, name: &str) -> Option<String> {
        self.text_at(*self.addresses.get(name)?)
    }

    /// The first `n` of `const char *[]`.
    pub(super) fn texts(&self, name: &str, n: u16) -> Option<Vec<String>> {
        let first = if n == 0 {
            0
        } else {
            *self.addresses.get(name)?
        };
        if n > LONGEST_LIST {
            return None;
        }
        (0..u64::from(n))
            .map(|i| self.text_at(first.checked_add(8 * i)?))
            .collect()
    }

    /// The first `n` of `int[]`.
    pub(super) fn integers(&self, name: &str, n: u16) -> Option<Vec<i32>> {
        let first = if n == 0 {
            0
        } else {
            *self.addresses.get(name)?
        };
        (0..u64::from(n))
            .map(|i| {
                self.bytes(first.checked_add(4 * i)?)
                    .map(i32::from_le_bytes)
            })
            .collect()
    }

    /// The text that the pointer at an address leads to.
    fn text_at(&self, place: u64) -> Option<String> {
        let address = match self.pointers.get(&place) {
            Some(address) => *address,
            None => u64::from_le_bytes(self.bytes(place)?),
        };
        let mut text = Vec::new();
        while text.len() < LONGEST_TEXT {
            match self.bytes::<1>(address.checked_add(text.len() as u64)?)? {
                [0] => return String::from_utf8(text).ok(),
                [byte] => text.push(byte),
            }
        }
        None
    }
}

/// The part of `all` that `part` is, as a text.
fn within<'a>(all: &'a [u8], part: &[u8]) -> Option<&'a str> {
    let start = (part.as_ptr() as usize).checked_sub(all.as_ptr() as usize)?;
    std::str::from_utf8(all.get(start..start + part.len())?).ok()
}
