//! Ground at rest and under water: weights, pore pressures, the stress before the first phase.
//!
//! Stresses of groups are effective. The pore pressure follows from the water table alone, so it is
//! a load: with total stresses σ' − p δ, equilibrium is
//!
//! - ∫ Bᵀ σ' dV = f + ∫ Bᵀ p δ dV (1)
//!
//! Weights, pore pressures and the water's pressure on the outline are nodal forces of a state
//! ([`Loading`]); between two states they change in proportion to the phase's course.

mod body_forces;
mod initial;
mod loading;
mod overburden;

pub use body_forces::Acting;
pub use initial::InitialStresses;
pub(crate) use initial::beside_joints;
pub(crate) use loading::unit_pressure;
pub use loading::{Loading, pressure_on};
pub use overburden::Columns;
