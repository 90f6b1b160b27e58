//! The mechanics of a simulation, in memory: a [`Problem`] as plain values, elements and their laws, and
//! a [`Simulation`] that leads them from equilibrium to equilibrium.
//!
//! Nothing here knows a file, a format or a path. The problem comes in as values, progress goes out to whoever
//! [`Watch`]es, and errors come back as data ([`Error`]).
//!
//! In the order in which data flows: [`problem`] and [`mesh`]; [`model`], which makes [`group`]s of
//! [`element`]s of them, in the [`ground`], and the [`check`]s above it; [`assembly`] and [`equilibrium`];
//! [`simulation`].
//!
//! A slice of a pile, 0.2 m high, in elastic ground behind a thin layer of Coulomb's friction: the
//! ground presses on it, and it is pushed down by two millimetres.
//!
//! ```
//! use law::{Hypothesis, SearchPath};
//! use mechanics::problem::*;
//! use mechanics::{Material, Mesh, Problem, Simulation};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let target = std::env::var("CARGO_TARGET_DIR")
//! #     .unwrap_or_else(|_| concat!(env!("CARGO_MANIFEST_DIR"), "/../../target").to_owned());
//! # let folders = ["release", "debug"].map(|name| format!("{target}/{name}").into());
//! let laws = SearchPath::new(&folders);
//! let elastic = |name: &str, e: f64| -> Result<Material, Box<dyn std::error::Error>> {
//!     let values = [("young_modulus", e.into()), ("poisson_ratio", 0.3.into())];
//!     let law = laws.law("elastic")?.with(Hypothesis::Axisymmetric, &values)?;
//!     Ok(Material::new(name, law))
//! };
//! let friction = laws.law("coulomb_joint")?.with(
//!     Hypothesis::Interface2d,
//!     &[
//!         ("normal_stiffness", 1e7.into()),
//!         ("shear_stiffness", 1e6.into()),
//!         ("cohesion", 0.0.into()),
//!         ("friction_angle", 30.0.into()),
//!         ("dilatancy_angle", 0.0.into()),
//!     ],
//! )?;
//!
//! // Columns: pile, layer, ground.
//! let r = [0.0, 0.1, 0.11, 0.2, 0.5, 1.0];
//! let mut mesh = Mesh::grid(&r, &[0.0, 0.2], |column, _| column.min(2));
//! for (name, c, at) in [("outside", 0, 1.0), ("bottom", 1, 0.0), ("top", 1, 0.2)] {
//!     mesh.name_line(name, |edge| edge.iter().all(|node| node[c] == at));
//! }
//! mesh.name_line("head", |edge| edge.iter().all(|node| node[1] == 0.2 && node[0] <= 0.1));
//!
//! let mut problem = Problem::new(Analysis::Axisymmetric, mesh);
//! let joint = Material::new("friction", friction);
//! problem.groups = vec![
//!     ElementGroup::new("pile", Formulation::Solid, elastic("steel", 2e8)?),
//!     ElementGroup::new("shaft", Formulation::ThinLayer, joint),
//!     ElementGroup::new("ground", Formulation::Solid, elastic("sand", 5e4)?),
//! ];
//! for group in &mut problem.groups {
//!     group.initial_stress = Some([-100.0, 0.0, -100.0, 0.0].into());
//! }
//! // A slice of something long: nothing moves outward.
//! let lines = [("outside", vec![Axis::X, Axis::Y]), ("bottom", vec![Axis::X]), ("top", vec![Axis::X])];
//! problem.supports = lines.map(|(line, fixed)| Support { line: line.to_owned(), fixed }).to_vec();
//! let mut push = Phase::new("push", 10);
//! push.displacement = vec![Displacement { line: "head".to_owned(), x: None, y: Some(-2e-3) }];
//! problem.phases = vec![push];
//!
//! let mut simulation = Simulation::new(problem)?;
//! let mut curve = Vec::new();
//! while let Some(increment) = simulation.step()? {
//!     curve.push((increment.time, -simulation.reaction_of("head").unwrap()[1]));
//! }
//! // The shaft yields at σ tan φ over its middle surface, 2π · 0.105 m · 0.2 m.
//! let shaft = 100.0 * 30f64.to_radians().tan() * std::f64::consts::TAU * 0.105 * 0.2;
//! assert!((curve.last().unwrap().1 / shaft - 1.0).abs() < 0.05, "{curve:?}, {shaft}");
//! # Ok(())
//! # }
//! ```

pub mod assembly;
pub mod check;
pub mod element;
pub mod equilibrium;
mod error;
pub mod ground;
pub mod group;
mod joined;
pub mod mesh;
pub mod model;
mod numbers;
pub mod problem;
pub mod recovery;
pub mod settings;
pub mod simulation;

pub use error::{Error, NoEquilibrium, Place};
pub use mesh::Mesh;
pub use model::Model;
pub use problem::{Material, Problem};
pub use settings::Settings;
pub use simulation::{Simulation, State, Watch};
