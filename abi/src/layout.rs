//! The second, Rust-to-Rust check: `abi_stable` compares the types of host and library field by
//! field, through function pointers too. Libraries in other languages never see it.

use crate::descriptor::c_str;
use crate::raw::{Plugin, RustLayout};
use abi_stable::StableAbi;
use abi_stable::abi_stability::abi_checking::check_layout_compatibility;
use abi_stable::type_layout::TypeLayout;
use std::ffi::CStr;
use std::mem::size_of;

/// Name of the symbol under which a Rust library exports [`RUST_LAYOUT`]. It carries the minor
/// version: `abi_stable` takes types that have grown for others, so only equal minors are compared.
pub const SYMBOL: &str = "pilum_rust_layout_1_0";

/// Version of `abi_stable` whose description of layouts is used.
pub const ABI_STABLE_VERSION: &CStr = c_str("0.11.3\0");

/// What this crate's build of the contract looks like to `abi_stable`.
pub const LAYOUT: &TypeLayout = <Plugin as StableAbi>::LAYOUT;

/// The block that a Rust library exports as [`SYMBOL`].
pub const RUST_LAYOUT: RustLayout = RustLayout {
    struct_size: size_of::<RustLayout>() as u32,
    reserved: 0,
    abi_stable_version: ABI_STABLE_VERSION.as_ptr(),
    layout: std::ptr::from_ref(LAYOUT).cast(),
};

/// Compares a library's layout with the host's.
///
/// # Errors
/// What differs, in the words of `abi_stable`.
pub fn check(theirs: &'static TypeLayout) -> Result<(), String> {
    check_layout_compatibility(LAYOUT, theirs).map_err(|difference| difference.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_symbol_carries_the_version() {
        let (major, minor) = (crate::raw::PILUM_ABI_MAJOR, crate::raw::PILUM_ABI_MINOR);
        assert_eq!(SYMBOL, format!("pilum_rust_layout_{major}_{minor}"));
    }

    #[test]
    fn the_layout_agrees_with_itself() {
        assert_eq!(check(LAYOUT), Ok(()));
    }

    #[test]
    fn another_type_is_told_apart() {
        assert!(check(<crate::raw::Law as StableAbi>::LAYOUT).is_err());
    }
}
