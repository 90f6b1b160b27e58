//! Input files that differ from another by a few lines: `base = "path"`.
//!
//! The file's keys override those of its base: tables are merged key by key, entries of arrays
//! that have a `name` (such as phases) are merged by name, everything else replaces. Each entry of
//! `[[variant]]` overrides the file in the same way, which then stands for as many files. Settings
//! of the command line come last: they override all of it, in every variant.

use crate::misfit::Misfit;
use crate::read::refuse_infinite;
use crate::setting::Setting;
use crate::syntax::parse_table;
use crate::value::read_root;
use crate::{Error, Source};
use serde::de::DeserializeOwned;
use std::collections::HashMap;
use std::ops::Range;
use std::path::Path;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Most bytes of a file times its variants: each holds all of it.
const MOST_TOGETHER: usize = 64 << 20;
/// Longest chain of bases.
const LONGEST_CHAIN: usize = 8;

/// The contents of a file, by the name of the variant if there are any.
pub type Variants<T> = Vec<(Option<String>, T)>;

/// A file of another kind, told by a key that only that one has.
#[derive(Clone, Copy, Debug)]
pub struct OtherKind {
    /// Top-level keys that give it away.
    pub keys: &'static [&'static str],
    /// The kind of file found and the kind expected.
    pub message: &'static str,
    /// The command that takes it.
    pub command: &'static str,
}

/// As [`read`]; a file of the other kind is called so instead of the first key that does not fit.
///
/// # Errors
/// [`Error::Input`] at the place that does not fit; [`Error::Unreadable`].
pub fn read_kind<T: DeserializeOwned>(
    source: Source,
    other: &OtherKind,
) -> Result<(Source, Variants<T>), Error> {
    let given = source.clone();
    read(source).map_err(|error| {
        let Ok(source) = with_bases(given, LONGEST_CHAIN) else {
            return error;
        };
        let texts = source.files();
        let spans = texts.filter_map(|range| {
            let text = "\n".repeat(range.start) + &source.text()[range];
            let table = DeTable::parse(&text).ok()?;
            let keys = table.get_ref().keys();
            let mut found = keys.filter(|key| other.keys.contains(&key.get_ref().as_ref()));
            let key = found.next()?;
            Some((key.get_ref().to_string(), key.span()))
        });
        // The file itself comes after those it is based on.
        match spans.last() {
            None => error,
            Some((key, span)) => source
                .error(span, format!("`{key}`: {}", other.message))
                .hint(format!(
                    "`{} {}` takes it",
                    other.command,
                    source.path().display()
                ))
                .into(),
        }
    })
}

/// Reads a file with what it is based on.
///
/// # Errors
/// [`Error::Input`] at the place that does not fit; [`Error::Unreadable`].
pub fn read<T: DeserializeOwned>(source: Source) -> Result<(Source, Variants<T>), Error> {
    let source = with_bases(source, LONGEST_CHAIN)?;
    let files = merged(&source)?;
    Ok((source, files))
}

/// The tables of files as one, later ones over earlier ones.
fn together<'t>(source: &Source, files: &'t [String]) -> Result<Spanned<DeTable<'t>>, Error> {
    let mut merged: Option<Spanned<DeTable<'_>>> = None;
    for text in files {
        let mut table = parse_table(source, text)?;
        table.get_mut().remove("base");
        match &mut merged {
            None => merged = Some(table),
            Some(merged) => merge(merged.get_mut(), table.into_inner()),
        }
    }
    merged.ok_or_else(|| Error::Internal("a source without files".to_owned()))
}

/// The name of a variant, and what it changes.
fn named_variant<'t>(
    source: &Source,
    variant: Spanned<DeValue<'t>>,
) -> Result<(String, DeTable<'t>), Error> {
    let (span, given) = (variant.span(), name(&variant));
    let (Some(name), DeValue::Table(mut over)) = (given, variant.into_inner()) else {
        return Err(source.error(span, "a [[variant]] needs a `name`").into());
    };
    let plain = |c: char| c.is_ascii_alphanumeric() || "_-.".contains(c);
    if !name.starts_with(|c: char| c.is_ascii_alphanumeric()) || !name.chars().all(plain) {
        let message = format!("`{name}` cannot be a folder's name: letters, digits, _ - .");
        return Err(source.error(span, message).into());
    }
    over.remove("name");
    if let Some((key, _)) = over.iter().find(|(key, _)| key.get_ref() == "base") {
        let message = "a variant has no `base`: it differs from the file that it stands in";
        let error = source.error(key.span(), message);
        let error = error.hint("the `base` stands at the top of the file");
        return Err(error.into());
    }
    Ok((name, over))
}

/// Reads a file that stands behind those that it is based on.
///
/// # Errors
/// [`Error::Input`] at the place that does not fit.
pub fn merged<T: DeserializeOwned>(source: &Source) -> Result<Variants<T>, Error> {
    // Blank lines instead of the files before each one keep spans counting from the start.
    let files = source.files();
    let files = files.map(|range| "\n".repeat(range.start) + &source.text()[range]);
    let files: Vec<String> = files.collect();
    let texts = source.settings().map(|range| {
        let text = " ".repeat(range.start) + &source.text()[range.clone()];
        (range, text)
    });
    let texts: Vec<_> = texts.collect();
    let settings = texts
        .iter()
        .map(|(range, text)| Setting::read(source, range.clone(), text))
        .collect::<Result<Vec<_>, _>>()?;
    let mut merged = together(source, &files)?;
    let Some(variants) = merged.get_mut().remove("variant") else {
        let file = with_settings(source, merged, &settings, None)?;
        return Ok(vec![(None, file)]);
    };
    let span = variants.span();
    let DeValue::Array(variants) = variants.into_inner() else {
        let error = source.error(span, "variants are written as [[variant]]");
        return Err(error.into());
    };
    if variants.len().saturating_mul(source.text().len()) > MOST_TOGETHER {
        let message = format!(
            "{} variants of a file of {} kB: at most {} MB are read, all variants together",
            variants.len(),
            source.text().len() >> 10,
            MOST_TOGETHER >> 20
        );
        return Err(source.error(span, message).into());
    }
    let mut files: Variants<T> = Vec::new();
    for variant in variants {
        let span = variant.span();
        let (name, over) = named_variant(source, variant)?;
        if files.iter().any(|(other, _)| other.as_ref() == Some(&name)) {
            let message = format!("two variants are called `{name}`");
            return Err(source.error(span, message).into());
        }
        let own: Vec<Range<usize>> = over.keys().map(Spanned::span).collect();
        let mut table = merged.clone();
        merge(table.get_mut(), over);
        let read = with_settings(source, table, &settings, Some((&name, &own)))?;
        files.push((Some(name), read));
    }
    Ok(files)
}

/// The contents of a file with settings over it; of a variant with its name, and the places of the keys
/// that are its own.
fn with_settings<'i, T: DeserializeOwned>(
    source: &Source,
    mut table: Spanned<DeTable<'i>>,
    settings: &[Setting<'i>],
    variant: Option<(&str, &[Range<usize>])>,
) -> Result<T, Error> {
    let mut made = Vec::new();
    for setting in settings {
        made.extend(setting.apply(source, table.get_mut())?);
    }
    let own = variant.map_or(&[][..], |(_, own)| own);
    let keys = table.get_ref().keys().map(Spanned::span);
    let of_file: Vec<Range<usize>> = keys.filter(|key| !own.contains(key)).collect();
    refuse_infinite(source, table.get_ref())?;
    read_root(table).map_err(|misfit: Misfit| {
        if let Some(error) = made.iter().find_map(|made| made.instead_of(&misfit)) {
            return error;
        }
        if misfit.span().is_some_and(|span| of_file.contains(&span)) {
            // Those are taken out before the rest is read.
            let more = ["variant", "base"];
            return misfit.input_error_in(source, &more, "").into();
        }
        let whose = variant.map(|(name, _)| format!(" in variant `{name}`"));
        let whose = whose.unwrap_or_default();
        misfit.input_error_in(source, &[], &whose).into()
    })
}

/// The file after its base, that after its own, and so on.
fn with_bases(source: Source, chain: usize) -> Result<Source, Error> {
    let table = parse_table(&source, source.text_of_files())?;
    let Some((_, base)) = table
        .get_ref()
        .iter()
        .find(|(key, _)| key.get_ref() == "base")
    else {
        return Ok(source);
    };
    let DeValue::String(path) = base.get_ref() else {
        return Err(source
            .error(base.span(), "`base` is the path of a case file")
            .into());
    };
    if chain == 0 {
        let message = format!("more than {LONGEST_CHAIN} files are based on each other");
        return Err(source.error(base.span(), message).into());
    }
    let path = source
        .path()
        .parent()
        .unwrap_or(Path::new("."))
        .join(path.as_ref());
    let read = Source::read(&path).map_err(|error| {
        let why = std::error::Error::source(&error).map_or(String::new(), |why| format!(": {why}"));
        source.error(
            base.span(),
            format!("the base cannot be used: {error}{why}"),
        )
    })?;
    Ok(source.based_on(&with_bases(read, chain - 1)?))
}

/// Puts the entries of a table over those of another.
fn merge<'i>(under: &mut DeTable<'i>, over: DeTable<'i>) {
    for (key, value) in over {
        match under.get_mut(key.get_ref().as_ref()) {
            None => {
                under.insert(key, value);
            }
            Some(below) => merge_value(below, value),
        }
    }
}

/// Puts a value over another: what is no table and no list of named entries replaces it.
pub(crate) fn merge_value<'i>(below: &mut Spanned<DeValue<'i>>, value: Spanned<DeValue<'i>>) {
    let span = value.span();
    match (below.get_mut(), value.into_inner()) {
        (DeValue::Table(below), DeValue::Table(value)) => merge(below, value),
        (DeValue::Array(below), DeValue::Array(value))
            if below
                .iter()
                .chain(value.iter())
                .all(|entry| name(entry).is_some()) =>
        {
            let mut places = HashMap::new();
            for (place, entry) in below.iter().enumerate() {
                places.entry(name(entry)).or_insert(place);
            }
            for entry in value {
                let place = *places.entry(name(&entry)).or_insert(below.len());
                match below.get_mut(place) {
                    Some(same) => merge_value(same, entry),
                    None => below.push(entry),
                }
            }
        }
        (_, value) => *below = Spanned::new(span, value),
    }
}

/// The `name` of an entry of an array of tables.
pub(crate) fn name(entry: &Spanned<DeValue<'_>>) -> Option<String> {
    match entry.get_ref() {
        DeValue::Table(table) => match table.get("name")?.get_ref() {
            DeValue::String(name) => Some(name.to_string()),
            _ => None,
        },
        _ => None,
    }
}
