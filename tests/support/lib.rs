//! What the tests share: running cases from a text, reading results, tolerances.

pub mod case;
pub mod tolerance;
