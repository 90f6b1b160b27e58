//! Tolerances and where they come from.

use std::fmt::Display;

/// A few hundred operations in double precision, relative to the largest number in play.
pub const ROUND_OFF: f64 = 1e-12;
/// Equilibrium: the solver's default force tolerance with a margin for its norm.
pub const EQUILIBRIUM: f64 = 1e-8;
/// What the point driver's tolerance of 1e-10 leaves, relative to the stress or strain in play.
pub const DRIVER: f64 = 1e-9;

/// Asserts |found − expected| ≤ tolerance.
///
/// # Panics
/// With both numbers, otherwise.
#[track_caller]
pub fn near(found: f64, expected: f64, tolerance: f64) {
    close("value", found, expected, tolerance);
}

/// The same of what has a name.
///
/// # Panics
/// With name and numbers, otherwise.
#[track_caller]
pub fn close(what: impl Display, found: f64, expected: f64, tolerance: f64) {
    assert!(
        (found - expected).abs() <= tolerance,
        "{what}: {found:e}, expected {expected:e} within {tolerance:e}"
    );
}
