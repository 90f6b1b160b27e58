//! The Pilum host: a finite-element program that knows no constitutive law.

pub mod error;
pub mod input;
pub mod plugin;
pub mod point;
pub mod case;
pub mod mesh;
pub mod element;
pub mod assembly;
pub mod group;
pub mod solver;
pub mod model;
pub mod output;
pub mod probe;
pub mod run;
