#![doc = include_str!("../LAW.md")]
#![forbid(unsafe_code)]
#![expect(non_snake_case, reason = "the letters of the paper: K_n is k_n σ_ni^N")]

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
bridges::export!(interface Mepi,
    properties: [KN KT N Mu0 MuP MuC0 A C0 T],
    parameters: [P0 SigmaNi Scheme Substeps SchemeTolerance]);
bridges::export!(interface MepiSoftening,
    properties: [KN KT N Mu0 MuP MuC0 A C0 T MuR A0 UTp],
    parameters: [P0 SigmaNi Peak Scheme Substeps SchemeTolerance]);
