//! Keys that a file may leave out, with their places.

use std::ops::Range;
use text::Spanned;

/// A key that may be left out.
pub(crate) trait Given<T> {
    /// Its value.
    fn value(&self) -> Option<T>
    where
        T: Copy;

    /// Place of its value.
    fn place(&self) -> Option<Range<usize>>;
}

impl<T> Given<T> for Option<Spanned<T>> {
    fn value(&self) -> Option<T>
    where
        T: Copy,
    {
        self.as_ref().map(|given| *given.get_ref())
    }

    fn place(&self) -> Option<Range<usize>> {
        self.as_ref().map(Spanned::span)
    }
}
