//! Errors of the TOML reader and of serde in the words of this program.

use crate::{InputError, Source, suggestion};
use std::ops::Range;
use toml::de::DeValue;

/// The error with its place, the key where one is concerned, and a hint where one is known.
pub(super) fn reword(source: &Source, error: &toml::de::Error) -> InputError {
    let span = first_line(source, error);
    let message = error.message().trim();
    let at = |message: String| source.error(span.clone(), message);
    let of_key = |message: String| match key_before(source.text(), span.start) {
        Some(key) => at(format!("`{key}`: {message}")),
        None => at(message),
    };
    if let Some(error) = unknown_key(source, error, &[]) {
        return error;
    }
    if let Some((name, known)) = unknown(message, "unknown variant ") {
        return of_key(format!("there is no `{name}`")).hint(suggestion(name, known));
    }
    if let Some(error) = missing_key(source, error, "") {
        return error;
    }
    if let Some(name) = message.strip_prefix("duplicate field ") {
        return at(format!("{name} is given twice"))
            .hint("`r` is another name of `x`, and `z` of `y`");
    }
    if message == "duplicate key" {
        return duplicate(source, span);
    }
    let found = ["invalid type: ", "invalid value: ", "invalid length "]
        .iter()
        .find_map(|start| message.strip_prefix(start))
        .and_then(|rest| rest.split_once(", expected "));
    match found {
        Some(("map", "a sequence")) if single_brackets(source.text(), span.start).is_some() => {
            let name = single_brackets(source.text(), span.start).unwrap_or_default();
            at(format!("`{name}` is a list of tables"))
                .hint(format!("each is written with double brackets: [[{name}]]"))
        }
        Some((found, expected)) => of_key(format!(
            "found {}, expected {}",
            found_in_words(found),
            expected_in_words(expected)
        )),
        None if message.starts_with("expected") || message.contains(" is outside ") => {
            of_key(message.to_owned())
        }
        None if comma_at(source, span.start).is_some() => {
            let number = comma_at(source, span.start).unwrap_or_default();
            let point = number.replace(',', ".");
            at(format!("`{number}` has a decimal comma")).hint(format!(
                "is a decimal point meant? `{point}`, not `{number}`"
            ))
        }
        None => match meant(source, span.start, message) {
            Some(hint) => at(message.to_owned()).hint(hint),
            None => at(message.to_owned()),
        },
    }
}

/// The place of an error; of one about a whole table its first line at most.
fn first_line(source: &Source, error: &toml::de::Error) -> Range<usize> {
    let span = error.span().unwrap_or(0..0);
    let underlined = source.text().get(span.clone()).unwrap_or_default();
    let length = underlined.find('\n').unwrap_or(underlined.len());
    span.start..span.start + length
}

/// The error of a key that there is not; `more` keys may be there than the reader knows.
pub(super) fn unknown_key(
    source: &Source,
    error: &toml::de::Error,
    more: &[&str],
) -> Option<InputError> {
    let (name, mut known) = unknown(error.message().trim(), "unknown field ")?;
    known.extend(more);
    let message = format!("unknown key `{name}`");
    let error = source.error(first_line(source, error), message);
    Some(error.hint(suggestion(name, known)))
}

/// The error of a key that is not given, `whose` it is.
pub(super) fn missing_key(
    source: &Source,
    error: &toml::de::Error,
    whose: &str,
) -> Option<InputError> {
    let name = error.message().trim().strip_prefix("missing field ")?;
    let message = format!("missing key {name}{whose}");
    Some(source.error(first_line(source, error), message))
}

/// Whether the value is of no type that a choice can be written as.
pub(super) fn expects_choice(error: &toml::de::Error) -> bool {
    let message = error.message().trim();
    message.starts_with("wanted string") || message.starts_with("wanted exactly 1 element")
}

/// A value that is no text, in words.
pub(super) fn value_in_words(value: &DeValue<'_>) -> String {
    match value {
        DeValue::Integer(number) => format!("the number {}", number.as_str()),
        DeValue::Float(number) => format!("the number {}", number.as_str()),
        DeValue::Boolean(value) => format!("`{value}`"),
        DeValue::Array(_) => "a list".to_owned(),
        DeValue::Table(_) => "a table".to_owned(),
        DeValue::Datetime(_) => "a date".to_owned(),
        DeValue::String(_) => "a text".to_owned(),
    }
}

/// The error of what was found in place of a choice, from the one of a text that is no choice.
pub(super) fn no_choice(source: &Source, refused: &toml::de::Error, found: &str) -> InputError {
    let span = refused.span().unwrap_or(0..0);
    let key = key_before(source.text(), span.start);
    let key = key.map_or(String::new(), |key| format!("`{key}`: "));
    let message = format!("{key}found {found}, expected a text in quotes");
    let error = source.error(span, message);
    match unknown(refused.message().trim(), "unknown variant ") {
        Some((name, known)) => error.hint(suggestion(name, known)),
        None => error,
    }
}

/// A number with a decimal comma where the syntax breaks.
fn comma_at(source: &Source, at: usize) -> Option<String> {
    decimal_comma(source.text().get(..at)?, source.text().get(at..)?)
}

/// What was probably meant where the syntax breaks.
fn meant(source: &Source, at: usize, message: &str) -> Option<String> {
    let before = source.text().get(..at)?;
    if message.contains("basic string") || message.contains("literal string, expected `'`") {
        return Some("a quotation mark is missing at the end of the text".to_owned());
    }
    let (brace, close) = if message.contains("inline table") || message.contains("key-value pairs")
    {
        ('{', '}')
    } else if message.contains("array") {
        ('[', ']')
    } else {
        return None;
    };
    // The last one that is still open, if its line has ended.
    let mut depth = 0_usize;
    let open = before.char_indices().rev().find(|(_, c)| {
        if *c == close {
            depth += 1;
        } else if *c == brace {
            if depth == 0 {
                return true;
            }
            depth -= 1;
        }
        false
    });
    let (open, _) = open?;
    before[open..].contains('\n').then(|| {
        let place = source.place(&(open..open + 1));
        format!("the `{brace}` at {place} is still open here: is a `{close}` missing?")
    })
}

/// A number such as `1,5` or `1,5e-3` that ends where the text is divided, or has its comma there.
fn decimal_comma(before: &str, after: &str) -> Option<String> {
    let is_part = |c: char| c.is_ascii_digit() || "eE_+-".contains(c);
    // What stands behind the comma.
    let decimals = |text: &str| {
        let is_number = text.starts_with(|c: char| c.is_ascii_digit())
            && text.replace('_', "").parse::<f64>().is_ok();
        is_number.then(|| text.to_owned())
    };
    let whole = |text: &str| {
        let start = text.trim_end_matches(|c: char| c.is_ascii_digit()).len();
        (start < text.len()).then(|| text[start..].to_owned())
    };
    if let Some(rest) = after.strip_prefix(',') {
        let end = rest.find(|c| !is_part(c)).unwrap_or(rest.len());
        if let Some(decimals) = decimals(&rest[..end]) {
            return Some(format!("{},{decimals}", whole(before)?));
        }
    }
    let before = before.trim_end();
    let start = before.trim_end_matches(is_part).len();
    let decimals = decimals(&before[start..])?;
    let whole = whole(before[..start].strip_suffix(',')?)?;
    Some(format!("{whole},{decimals}"))
}

/// The name of a table `[name]` that starts here, if it is written with single brackets.
fn single_brackets(text: &str, at: usize) -> Option<&str> {
    let line = text.get(at..)?.lines().next()?;
    let name = line.trim().strip_prefix('[')?;
    let (name, _) = name.split_once(']')?;
    (!name.starts_with('[')).then_some(name.trim())
}

/// Name and candidates of "… `name`, expected one of `a`, `b`".
fn unknown<'a>(message: &'a str, start: &str) -> Option<(&'a str, Vec<&'a str>)> {
    let quoted: Vec<&str> = message
        .strip_prefix(start)?
        .split('`')
        .skip(1)
        .step_by(2)
        .collect();
    let (name, known) = quoted.split_first()?;
    Some((name, known.to_vec()))
}

/// A key that stands twice, or a list of tables one of which is written as a single table.
fn duplicate(source: &Source, span: Range<usize>) -> InputError {
    let text = source.text();
    let name = text.get(span.clone()).unwrap_or_default().to_owned();
    let is_list = text[..span.start.min(text.len())]
        .lines()
        .next_back()
        .is_some_and(|l| l.starts_with("[["));
    let error = source.error(span, format!("`{name}` stands here for the second time"));
    if is_list {
        error.hint("if there are several, each is written with double brackets, as here")
    } else {
        error
    }
}

/// The key whose value starts here, unless the value is an entry of a list.
fn key_before(text: &str, value: usize) -> Option<&str> {
    let before = text.get(..value)?.trim_end().strip_suffix('=')?.trim_end();
    let is_part = |c: char| c.is_alphanumeric() || c == '_' || c == '-';
    let key = &before[before.trim_end_matches(is_part).len()..];
    (!key.is_empty()).then_some(key)
}

fn found_in_words(found: &str) -> String {
    let value = found.split('`').nth(1);
    match (found.split(' ').next(), value) {
        (Some("floating" | "integer"), Some(number)) => format!("the number {number}"),
        (Some("boolean"), Some(value)) => format!("`{value}`"),
        (Some("map"), _) => "a table".to_owned(),
        (Some("sequence"), _) => "a list".to_owned(),
        (Some("string"), _) => format!("the text {}", found.trim_start_matches("string ")),
        (Some(length), _) if length.parse::<usize>().is_ok() => format!("a list of {length}"),
        _ => found.to_owned(),
    }
}

fn expected_in_words(expected: &str) -> String {
    match expected {
        "usize" | "u32" | "u64" => "a whole number, not negative".to_owned(),
        "i64" => "a whole number".to_owned(),
        "f64" => "a number".to_owned(),
        "a boolean" => "true or false".to_owned(),
        "a string" => "a text in quotes".to_owned(),
        "a sequence" => "a list in brackets".to_owned(),
        "a map" => "a table".to_owned(),
        _ if expected.starts_with("struct ") => "a table".to_owned(),
        _ => match expected.strip_prefix("an array of length ") {
            Some(length) => format!("a list of {length}"),
            None => expected.to_owned(),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_the_key_of_a_value() {
        let text = "a.first = 1\nlist = [ 2, { second=3 } ]";
        let key = |value: char| text.find(value).and_then(|at| key_before(text, at));
        assert_eq!(key('1'), Some("first"));
        assert_eq!(key('2'), None);
        assert_eq!(key('3'), Some("second"));
    }

    #[test]
    fn recognises_decimal_commas() {
        let text = |before, after| decimal_comma(before, after);
        assert_eq!(text("E = 1", ",5\n").as_deref(), Some("1,5"));
        assert_eq!(text("p = { E = 21,5", ", nu").as_deref(), Some("21,5"));
        assert_eq!(text("p = { E = 1,5 ", "}").as_deref(), Some("1,5"));
        assert_eq!(text("p = { E = 1,5e3", ", nu").as_deref(), Some("1,5e3"));
        assert_eq!(text("p = { z = -0,5e-3 ", "}").as_deref(), Some("0,5e-3"));
        assert_eq!(text("z = -0", ",5e-3\n").as_deref(), Some("0,5e-3"));
        assert_eq!(text("p = { E = 1, ", "}"), None);
        assert_eq!(text("p = { E = 1,e3", ", nu"), None);
        assert_eq!(text("E = 1", "\n"), None);
    }

    #[test]
    fn reads_the_names_in_a_message() {
        let message = "unknown field `a`, expected one of `b`, `c`";
        assert_eq!(
            unknown(message, "unknown field "),
            Some(("a", vec!["b", "c"]))
        );
        assert_eq!(unknown(message, "unknown variant "), None);
    }
}
