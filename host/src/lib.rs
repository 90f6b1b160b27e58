//! The Pilum host: a finite-element program that knows no constitutive law.
//!
//! In the order in which data flows: a [`case`] file, its [`mesh`], the laws from their libraries
//! ([`plugin`], built by [`input`]), both joined in a [`model`] of [`group`]s of [`element`]s;
//! [`run`] leads it through phases and increments with [`assembly`] and [`solver`]; [`probe`]s and
//! [`output`] write what comes out. Beside them: [`point`], one law at one integration point, and
//! [`laws`], what there is to know about a law, and [`trade_off`], what accuracy costs;
//! [`mod@check`] says whether a library keeps the contract. What may crash or hang runs in a
//! [`child`] process.

pub mod assembly;
pub mod case;
pub mod check;
pub mod child;
pub mod element;
pub mod error;
pub mod group;
pub mod input;
pub mod laws;
pub mod mesh;
pub mod model;
pub mod output;
pub mod plugin;
pub mod point;
pub mod probe;
pub mod report;
pub mod run;
pub mod solver;
pub mod trade_off;
