//! Lines as Fortran reads them.

use super::MAX_INCREMENTS;
use crate::Error;
use std::ops::Range;
use text::Source;

/// Lines of a file, with their places.
pub(super) struct Lines<'a> {
    pub(super) source: &'a Source,
    rest: std::vec::IntoIter<(Range<usize>, &'a str)>,
    end: usize,
}

impl<'a> Lines<'a> {
    pub(super) fn new(source: &'a Source) -> Self {
        let text = source.text();
        let mut at = 0;
        let mut lines = Vec::new();
        for line in text.split_inclusive('\n') {
            let shown = line.trim_end();
            lines.push((at..at + shown.len(), shown));
            at += line.len();
        }
        Self {
            source,
            rest: lines.into_iter(),
            end: text.len(),
        }
    }

    /// The next line that is not blank.
    pub(super) fn next(&mut self) -> Option<(Range<usize>, &'a str)> {
        self.rest.find(|(_, line)| !line.trim().is_empty())
    }

    pub(super) fn expect(&mut self, what: &str) -> Result<(Range<usize>, &'a str), Error> {
        self.next().ok_or_else(|| {
            let message = format!("the file ends where {what} is expected");
            self.source.error(self.end..self.end, message).into()
        })
    }

    /// `N` numbers at the start of the next line.
    pub(super) fn numbers<const N: usize>(
        &mut self,
        what: &str,
    ) -> Result<(Range<usize>, [f64; N]), Error> {
        let (at, line) = self.expect(what)?;
        let numbers = self.numbers_of(&at, line, what)?;
        Ok((at, numbers))
    }

    /// `N` numbers at the start of a line.
    pub(super) fn numbers_of<const N: usize>(
        &self,
        at: &Range<usize>,
        line: &str,
        what: &str,
    ) -> Result<[f64; N], Error> {
        let mut words = line
            .split(|c: char| c.is_whitespace() || c == ',')
            .filter(|word| !word.is_empty());
        let mut numbers = [0.0; N];
        for number in &mut numbers {
            let Some(value) = words.next().and_then(real) else {
                return self.refuse(at.clone(), format!("expected {what}"));
            };
            *number = value;
        }
        match words.next().filter(|word| real(word).is_some()) {
            None => Ok(numbers),
            Some(word) => self.refuse(
                at.clone(),
                format!("`{word}` is a number too many, expected {what}"),
            ),
        }
    }

    pub(super) fn count(&mut self, what: &str) -> Result<usize, Error> {
        let (at, [n]) = self.numbers(what)?;
        self.whole(&at, n, what)
    }

    pub(super) fn whole(&self, at: &Range<usize>, n: f64, what: &str) -> Result<usize, Error> {
        if n.fract() == 0.0 && (0.0..=MAX_INCREMENTS as f64).contains(&n) {
            return Ok(n as usize);
        }
        let message = format!("{n} is no number for {what}");
        Err(self.source.error(at.clone(), message).into())
    }

    pub(super) fn refuse<T>(
        &self,
        at: Range<usize>,
        message: impl Into<String>,
    ) -> Result<T, Error> {
        Err(self.source.error(at, message).into())
    }
}

/// A number as Fortran writes it: `1.5d-3` too. A colon ends it.
pub(super) fn real(word: &str) -> Option<f64> {
    let word = word.split(':').next()?.replace(['d', 'D'], "e");
    word.parse().ok().filter(|value: &f64| value.is_finite())
}
