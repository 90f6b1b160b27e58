#![doc = include_str!("../LAW.md")]
#![forbid(unsafe_code)]

mod curve;
mod qz_curve;
#[cfg(test)]
mod tests;
mod tz_curve;

pub use qz_curve::QzCurve;
pub use tz_curve::TzCurve;

abi::export_laws!(interface TzCurve, interface QzCurve);
bridges::export!(interface TzCurve,
    properties: [PressuremeterModulus Diameter Soil ShaftFriction NormalStiffness],
    parameters: []);
bridges::export!(interface QzCurve,
    properties: [PressuremeterModulus Diameter Soil BaseResistance ShearStiffness],
    parameters: []);
