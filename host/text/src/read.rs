//! Reading TOML with the place of every error.

use crate::syntax::parse_table;
use crate::value::read_root;
use crate::{Error, Source};
use indexmap::IndexMap;
use serde::de::DeserializeOwned;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Reads a whole file. Unknown keys are errors if `T` says `deny_unknown_fields`.
///
/// # Errors
/// [`Error::Input`] at the place that does not fit, or at a number that is not finite.
pub fn parse<T: DeserializeOwned>(source: &Source) -> Result<T, Error> {
    let table = parse_table(source, source.text())?;
    refuse_infinite(source, table.get_ref())?;
    deserialize(source, table)
}

/// As [`parse`], of a file whose numbers need not be finite.
///
/// # Errors
/// [`Error::Input`] at the place that does not fit.
pub fn parse_any_numbers<T: DeserializeOwned>(source: &Source) -> Result<T, Error> {
    deserialize(source, parse_table(source, source.text())?)
}

/// Reads a table whose spans count in the text of a source.
fn deserialize<T: DeserializeOwned>(
    source: &Source,
    table: Spanned<DeTable<'_>>,
) -> Result<T, Error> {
    read_root(table).map_err(|misfit| misfit.input_error(source).into())
}

/// TOML has `nan` and `inf`; no quantity here has such a value.
pub(crate) fn refuse_infinite(source: &Source, table: &DeTable<'_>) -> Result<(), Error> {
    let mut entries = table.iter();
    entries.try_for_each(|(key, value)| refuse_infinite_in(source, key.get_ref(), value))
}

fn refuse_infinite_in(
    source: &Source,
    key: &str,
    value: &Spanned<DeValue<'_>>,
) -> Result<(), Error> {
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
            .try_for_each(|entry| refuse_infinite_in(source, key, entry)),
        DeValue::Table(table) => refuse_infinite(source, table),
        _ => Ok(()),
    }
}

/// Values by name, each with the place of name and value.
pub type Named<T> = IndexMap<crate::Spanned<String>, crate::Spanned<T>>;
