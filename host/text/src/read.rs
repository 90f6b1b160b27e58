//! Reading TOML with the place of every error.

use crate::toml_errors;
use crate::{Error, Source};
use indexmap::IndexMap;
use serde::de::DeserializeOwned;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Reads a whole file. Unknown keys are errors if `T` says `deny_unknown_fields`.
///
/// # Errors
/// [`Error::Input`] at the place that does not fit.
pub fn parse<T: DeserializeOwned>(source: &Source) -> Result<T, Error> {
    let table = DeTable::parse(source.text()).map_err(|error| toml_error(source, &error))?;
    deserialize(source, table)
}

/// Reads a table whose spans count in the text of a source.
///
/// # Errors
/// [`Error::Input`] at the place that does not fit, or at a number that is not finite.
pub fn deserialize<T: DeserializeOwned>(
    source: &Source,
    table: Spanned<DeTable<'_>>,
) -> Result<T, Error> {
    deserialize_or(source, table, |_| None)
}

/// As [`deserialize`]; `explain` may know better what an error comes from.
pub(crate) fn deserialize_or<T: DeserializeOwned>(
    source: &Source,
    table: Spanned<DeTable<'_>>,
    explain: impl Fn(&toml::de::Error) -> Option<Error>,
) -> Result<T, Error> {
    for (key, value) in table.get_ref() {
        refuse_infinite(source, key.get_ref(), value)?;
    }
    let again = (source.text().len() <= MOST_COPIED).then(|| table.clone());
    T::deserialize(toml::Deserializer::from(table)).map_err(|error| {
        let choices = || again.and_then(|table| choice_error::<T>(source, table, &error));
        let better = explain(&error).or_else(choices);
        better.unwrap_or_else(|| toml_error(source, &error))
    })
}

/// Longest text, in bytes, whose contents are kept a second time for the sake of a message.
const MOST_COPIED: usize = 1 << 20;

/// The error of a value that stands where a choice is expected and is no text. The error for an
/// unknown word lists the choices.
fn choice_error<T: DeserializeOwned>(
    source: &Source,
    mut table: Spanned<DeTable<'_>>,
    error: &toml::de::Error,
) -> Option<Error> {
    let span = error
        .span()
        .filter(|_| toml_errors::expects_choice(error))?;
    let mut values = table.get_mut().iter_mut().map(|(_, value)| value);
    let value = value_at(&mut values, &span)?.get_mut();
    let found = toml_errors::value_in_words(value);
    *value = DeValue::String("".into());
    let refused = T::deserialize(toml::Deserializer::from(table)).err()?;
    (refused.span()? == span).then(|| toml_errors::no_choice(source, &refused, &found).into())
}

/// The value at this place of the text.
fn value_at<'t, 'i: 't>(
    values: &mut dyn Iterator<Item = &'t mut Spanned<DeValue<'i>>>,
    span: &Range<usize>,
) -> Option<&'t mut Spanned<DeValue<'i>>> {
    for value in values {
        if value.span() == *span {
            return Some(value);
        }
        let found = match value.get_mut() {
            DeValue::Array(entries) => value_at(&mut entries.iter_mut(), span),
            DeValue::Table(table) => value_at(&mut table.iter_mut().map(|(_, value)| value), span),
            _ => None,
        };
        if found.is_some() {
            return found;
        }
    }
    None
}

/// An error of the TOML reader, at its place.
pub fn toml_error(source: &Source, error: &toml::de::Error) -> Error {
    toml_errors::reword(source, error).into()
}

/// TOML has `nan` and `inf`; no quantity here has such a value.
fn refuse_infinite(source: &Source, key: &str, value: &Spanned<DeValue<'_>>) -> Result<(), Error> {
    match value.get_ref() {
        DeValue::Float(float) => {
            let text = float.as_str();
            if matches!(text.trim_start_matches(['+', '-']), "nan" | "inf") {
                let message = format!("`{key}`: {text} is no finite number");
                return Err(source.error(value.span(), message).into());
            }
            Ok(())
        }
        DeValue::Array(entries) => entries
            .iter()
            .try_for_each(|entry| refuse_infinite(source, key, entry)),
        DeValue::Table(table) => table
            .iter()
            .try_for_each(|(key, value)| refuse_infinite(source, key.get_ref(), value)),
        _ => Ok(()),
    }
}

/// Values by name, each with the place of name and value.
pub type Named<T> = IndexMap<Spanned<String>, Spanned<T>>;
