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

#[cfg(test)]
mod tests {
    use super::*;
    use serde::Deserialize;

    #[derive(Debug, Deserialize)]
    #[serde(rename_all = "snake_case")]
    enum Choice {
        One,
        Two,
    }

    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields)]
    #[expect(dead_code, reason = "only read")]
    struct Entry {
        a: f64,
    }

    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields)]
    #[expect(dead_code, reason = "only read")]
    struct File {
        n: Option<usize>,
        #[serde(alias = "r")]
        x: Option<[f64; 2]>,
        choice: Option<Spanned<Choice>>,
        entry: Option<Vec<Spanned<Entry>>>,
    }

    /// The message, and the hint.
    fn refused(text: &str) -> String {
        let error = parse::<File>(&Source::new("file.toml", text)).unwrap_err();
        let hint = error.help().map(|hint| format!("; {hint}"));
        format!("{error}{}", hint.unwrap_or_default())
    }

    #[test]
    fn what_does_not_fit_is_said_with_key_and_expectation() {
        const COUNT: &str = "expected a whole number, not negative";
        for (text, says) in [
            ("n = -1", format!("`n`: found the number -1, {COUNT}")),
            ("n = 2.5", format!("`n`: found the number 2.5, {COUNT}")),
            ("n = true", format!("`n`: found `true`, {COUNT}")),
            ("n = 2020-01-01", format!("`n`: found a date, {COUNT}")),
            ("n = { a = 1 }", format!("`n`: found a table, {COUNT}")),
            (
                "x = [1.0]",
                "`x`: found a list of 1, expected a list of 2".to_owned(),
            ),
            (
                "x = [1.0, \"a\"]",
                "found the text \"a\", expected a number".to_owned(),
            ),
            (
                "x = [1, 2]\nr = [1, 2]",
                "`x` is given twice; `r` is another name of `x`, and `z` of `y`".to_owned(),
            ),
            (
                "choice = 3",
                "`choice`: found the number 3, expected a text in quotes; there is: one, two"
                    .to_owned(),
            ),
            (
                "choice = \"tow\"",
                "`choice`: there is no `tow`; did you mean `two`? There is: one, two".to_owned(),
            ),
            (
                "[entry]\na = 1",
                "`entry` is a list of tables; each is written with double brackets: [[entry]]"
                    .to_owned(),
            ),
            ("[[entry]]", "missing key `a`".to_owned()),
            (
                "m = 1",
                "unknown key `m`; there is: n, r, x, choice, entry".to_owned(),
            ),
        ] {
            assert_eq!(refused(text), says, "{text}");
        }
    }
}
