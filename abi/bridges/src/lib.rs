//! Laws in the terms of other programs. What a law's library exports next to the contract: the entries
//! of Abaqus and CalculiX user materials and MFront's generic behaviours, from the same two traits.
//! `abi/interoperability.md` says what each program makes of them.
#![expect(
    unsafe_code,
    clippy::multiple_unsafe_ops_per_block,
    reason = "other programs' side of the C boundary; offset and access are one operation"
)]

pub mod calculix;
pub mod laws;
pub mod mfront;
pub mod point;
#[cfg(feature = "sources")]
pub mod sources;
pub mod umat;

/// What the macros name of the contract.
#[doc(hidden)]
pub use abi;

/// Exports a law to other programs, next to [`abi::export_laws!`]:
/// `bridges::export!(continuum Soil);` exports the MFront behaviour `Soil`, and the entries of
/// Abaqus and CalculiX user materials; `bridges::export!(interface Joint);` the behaviour
/// `Joint`. A law that does not offer all of the hypotheses names those it offers, in MFront's
/// words: `bridges::export!(continuum Layer in PlaneStrain Axisymmetrical);`.
///
/// To export defaults and bounds too, list the names of all material properties and parameters, in
/// their order and in MFront's spelling. A wrong name does not compile: `bridges::export!(interface
/// Joint, properties: [NormalStiffness], parameters: [Cohesion]);`.
///
/// A library holds one entry for user materials: with several laws for solids, name the one that
/// it is for with [`export_umat!`](crate::export_umat), and export the behaviours of all of them with
/// [`export_mfront!`](crate::export_mfront).
#[macro_export]
macro_rules! export {
    (continuum $law:ident $($hypotheses:tt)*) => {
        $crate::export_mfront!(continuum $law $($hypotheses)*);
        $crate::export_umat!($law);
    };
    (interface $law:ident $($names:tt)*) => {
        $crate::export_mfront!(interface $law $($names)*);
    };
}
