//! What the tests share: running cases from a text, tables of cases, reading results, tolerances, programs of others.

pub mod case;
pub mod driver;
pub mod figure;
pub mod links;
pub mod needs;
pub mod outcome;
pub mod place;
pub mod tolerance;
pub mod words;
