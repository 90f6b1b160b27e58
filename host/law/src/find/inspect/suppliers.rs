//! Who gives a library the symbols that it leaves to others: the libraries that it needs, Pilum, or
//! nobody. Their files are read; nothing of them runs.

use crate::library::abaqus;
use crate::needs::each_supplier;
use object::{File, Object, ObjectSymbol};
use std::collections::BTreeSet;
use std::path::Path;

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
    suppliers.not_found = each_supplier(path, (needs, search), |supplier, _| {
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
