//! The Pilum host: a finite-element program that knows no constitutive law.

pub mod error;
pub mod input;
pub mod plugin;
