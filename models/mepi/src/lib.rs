#![doc = include_str!("../LAW.md")]
#![forbid(unsafe_code)]

mod bounds;
mod contact;
mod first_root;
mod hardening;
mod interface;
mod mepi;
mod mepi_softening;
mod return_mapping;
mod substeps;
#[cfg(test)]
mod tests;

pub use interface::State;
pub use mepi::Mepi;
pub use mepi_softening::MepiSoftening;

abi::export_laws!(interface Mepi, interface MepiSoftening);
abi::export_foreign!(interface Mepi);
abi::export_foreign!(interface MepiSoftening);
