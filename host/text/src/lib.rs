//! Files that people write, and the place of each mistake in them.
//!
//! A [`Source`] is a text with the files that it came from. The function [`parse`] turns it into
//! values or an [`InputError`] with file, line, key and what was expected. With [`base`] files build
//! on each other. Nothing here knows what the keys mean. [`digits`] writes the numbers of results.

pub mod base;
pub mod digits;
mod error;
mod error_display;
pub mod file;
mod misfit;
mod read;
mod setting;
mod source;
mod spanned;
mod suggest;
mod syntax;
mod value;
pub mod write;

pub use error::{Error, add_hint};
pub use error_display::shown;
pub use read::{Named, parse, parse_any_numbers};
pub use setting::key;
pub use source::{InputError, Line, Source};
pub use spanned::Spanned;
pub use suggest::{nearest, suggestion};

/// A number with its noun: `1 quad`, `2 quads`.
#[must_use]
pub fn counted(n: usize, noun: &str) -> String {
    format!("{n} {noun}{}", if n == 1 { "" } else { "s" })
}
