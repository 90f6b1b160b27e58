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

    /// The line that steps have in common: number of increments, most iterations and time, and every how many
    /// increments a state is written, after a colon if at all.
    pub(super) fn step(&mut self) -> Result<(Range<usize>, [f64; 3], usize), Error> {
        let what = "number of increments, most iterations, time of the step";
        let (at, line) = self.expect(what)?;
        if let Some((_, change)) = line.split_once('T')
            && words(change).next().and_then(real).is_some()
        {
            return self.refuse(
                at,
                "a change of temperature, after `T`, is not understood here",
            );
        }
        // A colon behind other words, or before them, is part of a remark.
        let parts = line.split_once(':').filter(|(numbers, every)| {
            let is_number = words(every).next().is_some_and(|word| real(word).is_some());
            is_number && words(numbers).count() <= 3
        });
        let Some((numbers, every)) = parts else {
            let numbers = self.numbers_of(&at, line, what)?;
            return Ok((at, numbers, 1));
        };
        let numbers = self.numbers_of(&at, numbers, what)?;
        let what = "every how many increments a state is written, after the colon";
        let [every] = self.numbers_of(&at, every, what)?;
        let every = self.whole(&at, every, what)?;
        Ok((at, numbers, every.max(1)))
    }

    /// `N` numbers at the start of a line.
    pub(super) fn numbers_of<const N: usize>(
        &self,
        at: &Range<usize>,
        line: &str,
        what: &str,
    ) -> Result<[f64; N], Error> {
        let mut words = words(line);
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

/// What blanks and commas separate.
fn words(line: &str) -> impl Iterator<Item = &str> {
    let words = line.split(|c: char| c.is_whitespace() || c == ',');
    words.filter(|word| !word.is_empty())
}

/// A number as Fortran writes it: `1.5d-3` too. A colon ends it.
pub(super) fn real(word: &str) -> Option<f64> {
    let word = word.split(':').next()?.replace(['d', 'D'], "e");
    word.parse().ok().filter(|value: &f64| value.is_finite())
}
