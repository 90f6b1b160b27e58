#![doc = include_str!("../README.md")]

pub mod access;
pub mod descriptor;
pub mod differences;
pub mod dual;
pub mod export;
pub mod friction;
pub mod law;
#[cfg(feature = "abi_stable")]
pub mod layout;
pub mod raw;
pub mod reclosure;
#[cfg(feature = "sources")]
pub mod sources;
pub mod status;
pub mod substepping;
pub mod version;

pub use descriptor::{Description, Hypothesis, InternalVariables, Parameter, Parameters, Variable};
pub use law::{
    ContinuumLaw, Failure, HasTangent, InterfaceLaw, InterfacePoint, InterfaceRates,
    InterfaceResponse, Refusal, SolidPoint, SolidResponse, Tangent,
};
