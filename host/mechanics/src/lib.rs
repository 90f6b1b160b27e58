//! The mechanics of a simulation, in memory: a [`Problem`] as plain values, elements and their laws, and
//! a [`Simulation`] that leads them from equilibrium to equilibrium.
//!
//! Nothing here knows a file, a format or a path. What is to be computed comes in as values, what happens
//! goes out to whoever [`Watch`]es, and what goes wrong comes back as data ([`Error`]).
//!
//! In the order in which data flows: [`problem`] and [`mesh`]; [`model`], which makes [`group`]s of
//! [`element`]s of them; [`assembly`] and [`equilibrium`]; [`simulation`].

pub mod assembly;
pub mod element;
pub mod equilibrium;
mod error;
pub mod group;
pub mod mesh;
pub mod model;
pub mod problem;
pub mod settings;
pub mod simulation;

pub use error::{Error, NoEquilibrium, Place};
pub use mesh::Mesh;
pub use model::Model;
pub use problem::{Material, Problem};
pub use settings::Settings;
pub use simulation::{Simulation, State, Watch};
