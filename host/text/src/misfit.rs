//! Why a value does not fit the type that it is read into: the terms of serde as data, with their
//! place, and the words of this program for them.

use crate::{InputError, Source, suggestion};
use serde::de::{self, Expected, Unexpected};
use std::fmt::{self, Display, Formatter};
use std::ops::Range;

/// A value that does not fit.
#[derive(Debug)]
pub(crate) struct Misfit {
    pub(crate) kind: Kind,
    /// Its place, once that is known.
    span: Option<Range<usize>>,
    /// The key whose value it is. An entry of a list has none.
    key: Option<String>,
}

/// Kinds of misfits.
#[derive(Debug)]
pub(crate) enum Kind {
    /// There is no such key.
    UnknownKey {
        name: String,
        known: &'static [&'static str],
    },
    /// There is no such choice.
    UnknownChoice {
        name: String,
        known: &'static [&'static str],
    },
    /// Something else than a text stands where a choice is expected.
    NoChoice {
        found: String,
        known: &'static [&'static str],
    },
    MissingKey(&'static str),
    /// Two names of a key are given.
    KeyTwice(&'static str),
    /// A table stands where a list is expected.
    TableForList,
    /// A value of another type, or of another length.
    Wrong {
        found: String,
        expected: String,
    },
    /// The message of a type about its values.
    Other(String),
}

impl Misfit {
    pub(crate) fn new(kind: Kind) -> Self {
        Self {
            kind,
            span: None,
            key: None,
        }
    }

    pub(crate) fn wrong(found: impl Into<String>, expected: impl Display) -> Self {
        Self::new(Kind::Wrong {
            found: found.into(),
            expected: expected.to_string(),
        })
    }

    /// The same of the value that stands here, unless its place is known: then it is further inside.
    pub(crate) fn at(mut self, span: &Range<usize>) -> Self {
        self.span.get_or_insert_with(|| span.clone());
        self
    }

    /// The same of the value that stands here, where this was asked for.
    pub(crate) fn of(mut self, span: &Range<usize>, asked: impl Display) -> Self {
        if let (None, Kind::Wrong { expected, .. }) = (&self.span, &mut self.kind) {
            *expected = asked.to_string();
        }
        self.at(span)
    }

    /// The same of the value that stands here and has this key.
    pub(crate) fn of_key(mut self, span: &Range<usize>, key: &str) -> Self {
        if self.span.get_or_insert_with(|| span.clone()) == span {
            self.key.get_or_insert_with(|| key.to_owned());
        }
        self
    }

    /// Its place.
    pub(crate) fn span(&self) -> Option<Range<usize>> {
        self.span.clone()
    }

    /// The error with its place; of one about a whole table the first line at most.
    pub(crate) fn input_error(&self, source: &Source) -> InputError {
        self.input_error_in(source, &[], "")
    }

    /// The same where `more` keys may stand than the reader knows, and of whom a missing key is.
    pub(crate) fn input_error_in(&self, source: &Source, more: &[&str], whose: &str) -> InputError {
        let span = first_line(source, self.span());
        let at = |message: String| source.error(span.clone(), message);
        let of_key = |message: String| match &self.key {
            Some(key) => at(format!("`{key}`: {message}")),
            None => at(message),
        };
        match &self.kind {
            Kind::UnknownKey { name, known } => {
                let known = known.iter().chain(more).copied();
                at(format!("unknown key `{name}`")).hint(suggestion(name, known))
            }
            Kind::UnknownChoice { name, known } => of_key(format!("there is no `{name}`"))
                .hint(suggestion(name, known.iter().copied())),
            Kind::NoChoice { found, known } => {
                of_key(format!("found {found}, expected a text in quotes"))
                    .hint(suggestion("", known.iter().copied()))
            }
            Kind::MissingKey(name) => at(format!("missing key `{name}`{whose}")),
            Kind::KeyTwice(name) => at(format!("`{name}` is given twice"))
                .hint("`r` is another name of `x`, and `z` of `y`"),
            Kind::TableForList => match single_brackets(source.text(), span.start) {
                Some(name) => at(format!("`{name}` is a list of tables"))
                    .hint(format!("each is written with double brackets: [[{name}]]")),
                None => of_key(format!("found a table, expected {LIST}")),
            },
            Kind::Wrong { found, expected } => {
                of_key(format!("found {found}, expected {expected}"))
            }
            Kind::Other(message) => of_key(message.clone()),
        }
    }
}

/// A list, in words.
pub(crate) const LIST: &str = "a list in brackets";

/// A place, up to the end of its first line.
pub(crate) fn first_line(source: &Source, span: Option<Range<usize>>) -> Range<usize> {
    let span = span.unwrap_or(0..0);
    let underlined = source.text().get(span.clone()).unwrap_or_default();
    let length = underlined.find('\n').unwrap_or(underlined.len());
    span.start..span.start + length
}

/// The name of a table `[name]` that starts here, if it is written with single brackets.
fn single_brackets(text: &str, at: usize) -> Option<&str> {
    let line = text.get(at..)?.lines().next()?;
    let name = line.trim().strip_prefix('[')?;
    let (name, _) = name.split_once(']')?;
    (!name.starts_with('[')).then_some(name.trim())
}

/// A value in words.
fn found(value: &Unexpected<'_>) -> String {
    match value {
        Unexpected::Bool(value) => format!("`{value}`"),
        Unexpected::Unsigned(number) => format!("the number {number}"),
        Unexpected::Signed(number) => format!("the number {number}"),
        Unexpected::Float(number) => format!("the number {number:?}"),
        Unexpected::Str(text) => format!("the text {text:?}"),
        Unexpected::Map => "a table".to_owned(),
        Unexpected::Seq => "a list".to_owned(),
        other => other.to_string(),
    }
}

impl de::Error for Misfit {
    fn custom<T: Display>(message: T) -> Self {
        Self::new(Kind::Other(message.to_string()))
    }

    fn invalid_type(value: Unexpected<'_>, expected: &dyn Expected) -> Self {
        Self::wrong(found(&value), expected)
    }

    fn invalid_value(value: Unexpected<'_>, expected: &dyn Expected) -> Self {
        Self::wrong(found(&value), expected)
    }

    fn invalid_length(length: usize, expected: &dyn Expected) -> Self {
        Self::wrong(format!("a list of {length}"), expected)
    }

    fn unknown_variant(name: &str, known: &'static [&'static str]) -> Self {
        let name = name.to_owned();
        Self::new(Kind::UnknownChoice { name, known })
    }

    fn unknown_field(name: &str, known: &'static [&'static str]) -> Self {
        let name = name.to_owned();
        Self::new(Kind::UnknownKey { name, known })
    }

    fn missing_field(name: &'static str) -> Self {
        Self::new(Kind::MissingKey(name))
    }

    fn duplicate_field(name: &'static str) -> Self {
        Self::new(Kind::KeyTwice(name))
    }
}

impl Display for Misfit {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write!(f, "{:?}", self.kind)
    }
}

impl std::error::Error for Misfit {}
