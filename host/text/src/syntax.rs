//! Texts that are no TOML: the place where the syntax breaks, and what was probably meant.

use crate::misfit::first_line;
use crate::{Error, InputError, Source};
use std::ops::Range;
use toml::Spanned;
use toml::de::DeTable;
use toml_parser::lexer::{Token, TokenKind};
use toml_parser::parser::{RecursionGuard, parse_document};

/// As deep as the reader goes into a text.
const DEEPEST: u32 = 80;

/// Reads a text whose spans count in a source.
///
/// # Errors
/// [`Error::Input`] where the syntax breaks.
pub(crate) fn parse_table<'i>(
    source: &Source,
    text: &'i str,
) -> Result<Spanned<DeTable<'i>>, Error> {
    DeTable::parse(text).map_err(|error| syntax_error(source, text, &error).into())
}

/// An error of the reader of a text, with what was probably meant.
pub(crate) fn syntax_error(source: &Source, text: &str, error: &toml::de::Error) -> InputError {
    let span = first_line(source, error.span());
    if is_duplicate(text, &span) {
        return duplicate(source, span);
    }
    if let Some(number) = comma_at(text, span.start) {
        let point = number.replace(',', ".");
        return source
            .error(span, format!("`{number}` has a decimal comma"))
            .hint(format!(
                "is a decimal point meant? `{point}`, not `{number}`"
            ));
    }
    let hint = meant(source, text, span.start);
    let error = source.error(span, error.message().trim());
    match hint {
        Some(hint) => error.hint(hint),
        None => error,
    }
}

/// Whether a key stands here that stood there before: any other in its place is no mistake.
fn is_duplicate(text: &str, span: &Range<usize>) -> bool {
    let is_key = |text: &&str| DeTable::parse(&format!("{text}=0")).is_ok();
    if !text.get(span.clone()).as_ref().is_some_and(is_key) {
        return false;
    }
    let is_last = !text[span.end..].trim_start().starts_with('.');
    let mut other = "_".to_owned();
    while text.contains(&other) {
        other.push('_');
    }
    let mended = [&text[..span.start], &other, &text[span.end..]].concat();
    let next = DeTable::parse(&mended).err().and_then(|error| error.span());
    is_last && next.is_none_or(|next| next.start > span.start)
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

/// A number with a decimal comma where the syntax breaks.
fn comma_at(text: &str, at: usize) -> Option<String> {
    decimal_comma(text.get(..at)?, text.get(at..)?)
}

/// What was probably meant where the syntax breaks.
fn meant(source: &Source, text: &str, at: usize) -> Option<String> {
    let tokens = toml_parser::Source::new(text).lex().into_vec();
    let is_open_here = |token: &Token| {
        let span = token.span();
        (span.start()..=span.end()).contains(&at) && lacks_its_end(token, text)
    };
    if tokens.iter().any(is_open_here) {
        return Some("a quotation mark is missing at the end of the text".to_owned());
    }
    let mut errors: Vec<toml_parser::ParseError> = Vec::new();
    let receiver = &mut ();
    parse_document(
        &tokens,
        &mut RecursionGuard::new(receiver, DEEPEST),
        &mut errors,
    );
    let is_here = |error: &&toml_parser::ParseError| {
        let place = error.unexpected();
        place.is_some_and(|place| place.start() == at)
    };
    let open = errors.iter().find(is_here)?.context()?;
    let open = open.start()..open.end();
    let (brace, close) = match text.get(open.clone())? {
        "{" => ('{', '}'),
        "[" => ('[', ']'),
        _ => return None,
    };
    // The line of the one that is open has ended.
    text.get(open.start..at)?.contains('\n').then(|| {
        let place = source.place(&open);
        format!("the `{brace}` at {place} is still open here: is a `{close}` missing?")
    })
}

/// Whether a token is a text in quotes without the last of them.
fn lacks_its_end(token: &Token, text: &str) -> bool {
    let quotes = match token.kind() {
        TokenKind::BasicString => "\"",
        TokenKind::LiteralString => "'",
        TokenKind::MlBasicString => "\"\"\"",
        TokenKind::MlLiteralString => "'''",
        _ => return false,
    };
    let span = token.span();
    let inside = text[span.start()..span.end()].strip_prefix(quotes);
    !inside.is_some_and(|inside| inside.ends_with(quotes))
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

#[cfg(test)]
mod tests {
    use super::*;

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
    fn a_key_that_stands_twice_is_told_from_other_mistakes() {
        let second = |text: &str| {
            let error = DeTable::parse(text).unwrap_err();
            is_duplicate(text, &error.span().unwrap())
        };
        assert!(second("a = 1\nb = 2\na = 3\n"));
        assert!(second("[t]\na = 1\n[t]\n"));
        assert!(second("t = { a = 1, a = 2 }\n"));
        assert!(!second("a = 1\na.b = 2\n"));
        assert!(!second("a = [01]\n"));
        assert!(!second("a = 1\nb\n"));
        assert!(!second("α = 1\n"));
    }
}
