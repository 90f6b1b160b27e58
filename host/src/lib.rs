//! The Pilum host: a finite-element program that knows no constitutive law.

pub mod assembly;
pub mod case;
pub mod element;
pub mod error;
pub mod group;
pub mod input;
pub mod mesh;
pub mod model;
pub mod output;
pub mod plugin;
pub mod point;
pub mod probe;
pub mod run;
pub mod solver;
