//! Settings of the command line: `KEY=VALUE` over what a file says, in the file's own syntax.
//!
//! The key is the dotted path of the file. An entry of an array has its position there, from 1, or
//! its `name` if it has one: `phase.2.increments=80`, `phase.loading.increments=80`.

use crate::base::{merge_value, name};
use crate::misfit::{Kind, Misfit};
use crate::syntax::syntax_error;
use crate::value::in_words;
use crate::{Error, InputError, Source, suggestion};
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeString, DeTable, DeValue};

/// A setting that was read.
#[derive(Debug)]
pub(crate) struct Setting<'i> {
    /// Its place.
    range: Range<usize>,
    keys: Vec<Spanned<DeString<'i>>>,
    value: Spanned<DeValue<'i>>,
}

/// A table that a setting has created, because the file lacks it.
#[derive(Debug)]
pub(crate) struct Made {
    /// Place of the setting.
    range: Range<usize>,
    /// The hint if it is incomplete: the existing table that was probably meant.
    error: InputError,
}

impl Made {
    /// What to say instead of an error about what the table lacks.
    pub(crate) fn instead_of(&self, misfit: &Misfit) -> Option<Error> {
        let is_here = self.range.contains(&misfit.span()?.start);
        let lacks = matches!(misfit.kind, Kind::MissingKey(_));
        (is_here && lacks).then(|| self.error.clone().into())
    }
}

impl<'i> Setting<'i> {
    /// Reads the setting that stands here in a source. `text` is the setting, with blanks before it
    /// so that its spans count in the source.
    ///
    /// # Errors
    /// [`Error::Input`] at the place that does not fit.
    pub(crate) fn read(source: &Source, range: Range<usize>, text: &'i str) -> Result<Self, Error> {
        let Some(equals) = equals_sign(text) else {
            let message = format!("`{}` is no setting, expected KEY=VALUE", text.trim_start());
            return Err(source
                .error(range, message)
                .hint("such as --set solver.max_iterations=40")
                .into());
        };
        let keys = keys(source, &text[..equals])?;
        refuse_keys_of_files(source, &keys)?;
        let value = match DeTable::parse(text) {
            Ok(table) => only_value(table, keys.len()).ok_or_else(|| {
                let message = "one key and one value are expected; --set may be repeated";
                source.error(range.clone(), message)
            })?,
            Err(error) => {
                bare_word(source, range.start, equals + 1..range.end).map_err(|refused| {
                    refused.unwrap_or_else(|| syntax_error(source, text, &error).into())
                })?
            }
        };
        Ok(Self { range, keys, value })
    }

    /// Puts the setting over what a file says. Returns a table that it had to make, if it did.
    ///
    /// # Errors
    /// [`Error::Input`] if the path leads nowhere.
    pub(crate) fn apply(
        &self,
        source: &Source,
        file: &mut DeTable<'i>,
    ) -> Result<Option<Made>, Error> {
        self.put_into(source, file, 0)
    }

    /// Puts it into the table that the first `n` of its keys lead to.
    fn put_into(
        &self,
        source: &Source,
        table: &mut DeTable<'i>,
        depth: usize,
    ) -> Result<Option<Made>, Error> {
        let key = &self.keys[depth];
        let is_last = depth + 1 == self.keys.len();
        if let Some(below) = table.get_mut(key.get_ref().as_ref()) {
            if is_last {
                merge_value(below, self.value.clone());
                return Ok(None);
            }
            return self.put_below(source, below, depth + 1);
        }
        if is_last {
            table.insert(key.clone(), self.value.clone());
            return Ok(None);
        }
        let known: Vec<&str> = table.keys().map(|key| key.get_ref().as_ref()).collect();
        let error = source
            .error(
                key.span(),
                format!("there is no `{}`", self.path(depth + 1)),
            )
            .hint(suggestion(key.get_ref(), known));
        let mut made = DeTable::new();
        self.put_into(source, &mut made, depth + 1)?;
        let span = key.span().start..self.range.end;
        table.insert(key.clone(), Spanned::new(span, DeValue::Table(made)));
        Ok(Some(Made {
            range: self.range.clone(),
            error,
        }))
    }

    /// Puts it below the value that the first `n` of its keys lead to.
    fn put_below(
        &self,
        source: &Source,
        value: &mut Spanned<DeValue<'i>>,
        depth: usize,
    ) -> Result<Option<Made>, Error> {
        let key = &self.keys[depth];
        match value.get_mut() {
            DeValue::Table(table) => self.put_into(source, table, depth),
            DeValue::Array(entries) => {
                let position = position(entries.iter().map(name), key.get_ref());
                let names: Vec<String> = entries.iter().filter_map(name).collect();
                let n = entries.len();
                let Some(entry) = position.and_then(|position| entries.get_mut(position)) else {
                    return Err(self.no_entry(source, depth, n, &names));
                };
                if depth + 1 == self.keys.len() {
                    merge_value(entry, self.value.clone());
                    return Ok(None);
                }
                self.put_below(source, entry, depth + 1)
            }
            other => {
                let message = format!(
                    "there is no `{}`: `{}` is {}",
                    self.path(depth + 1),
                    self.path(depth),
                    in_words(other)
                );
                Err(source.error(key.span(), message).into())
            }
        }
    }

    /// The error of a key that leads to none of the `n` entries of a list.
    fn no_entry(&self, source: &Source, depth: usize, n: usize, names: &[String]) -> Error {
        let key = &self.keys[depth];
        let message = format!(
            "there is no `{}`: `{}` has {n} {}",
            self.path(depth + 1),
            self.path(depth),
            if n == 1 { "entry" } else { "entries" }
        );
        let error = source.error(key.span(), message);
        if names.is_empty() {
            let hint = "an entry has its position here, from 1";
            return error.hint(hint).into();
        }
        let names = names.iter().map(String::as_str).collect::<Vec<_>>();
        error.hint(suggestion(key.get_ref(), names)).into()
    }

    /// The first of its keys as they are written.
    fn path(&self, n: usize) -> String {
        let keys: Vec<String> = self.keys[..n].iter().map(|k| key(k.get_ref())).collect();
        keys.join(".")
    }
}

/// A key as it is written in a dotted path: in quotes where it has to be.
pub fn key(name: &str) -> String {
    let is_part = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if !name.is_empty() && name.chars().all(is_part) {
        return name.to_owned();
    }
    toml::Value::from(name).to_string()
}

/// The keys that lead to a byte of a text, as a setting has them: to the value or the key there, else to the
/// table whose header does. `None` if no key leads there, or the text is no TOML.
pub(crate) fn key_at(text: &str, at: usize) -> Option<String> {
    let table = DeTable::parse(text).ok()?;
    path_in(table.get_ref(), at).map(|(_, path)| path)
}

/// The same of a setting: its whole key at least.
pub(crate) fn key_in_setting(text: &str, at: usize) -> Option<String> {
    let equals = equals_sign(text)?;
    key_at(text, at.max(equals + 1)).or_else(|| Some(text[..equals].trim().to_owned()))
}

/// The deepest key or value in a table that a byte lies in: how deep, and the keys that lead there.
fn path_in(table: &DeTable<'_>, at: usize) -> Option<(usize, String)> {
    let entries = table.iter().filter_map(|(name, value)| {
        let path = key(name.get_ref());
        let own = is_in(&name.span(), at).then(|| (0, path.clone()));
        path_at(value, &path, at).or(own)
    });
    entries.max()
}

/// The same in a value that these keys lead to.
fn path_at(value: &Spanned<DeValue<'_>>, path: &str, at: usize) -> Option<(usize, String)> {
    let below = match value.get_ref() {
        DeValue::Table(table) => {
            path_in(table, at).map(|(depth, rest)| (depth, format!("{path}.{rest}")))
        }
        DeValue::Array(entries) => {
            let entries = entries.iter().enumerate().filter_map(|(number, entry)| {
                let part = name(entry).map_or_else(|| (number + 1).to_string(), |name| key(&name));
                path_at(entry, &format!("{path}.{part}"), at)
            });
            entries.max()
        }
        _ => None,
    };
    let own = || is_in(&value.span(), at).then(|| (0, path.to_owned()));
    below.map(|(depth, path)| (depth + 1, path)).or_else(own)
}

fn is_in(span: &Range<usize>, at: usize) -> bool {
    (span.start..=span.end).contains(&at)
}

/// The entry of an array that a key stands for: its position from 1, or its name.
fn position(mut names: impl ExactSizeIterator<Item = Option<String>>, key: &str) -> Option<usize> {
    match key.parse::<usize>() {
        Ok(number) if (1..=names.len()).contains(&number) => Some(number - 1),
        _ => names.position(|name| name.as_deref() == Some(key)),
    }
}

/// Where the key ends: the first equals sign outside quotes.
fn equals_sign(text: &str) -> Option<usize> {
    let mut quote = None;
    for (at, c) in text.char_indices() {
        match (quote, c) {
            (None, '=') => return Some(at),
            (None, '"' | '\'') => quote = Some(c),
            (Some(open), c) if open == c => quote = None,
            _ => {}
        }
    }
    None
}

/// A dotted path whose names with blanks are in quotes; `None` if there is no such name, or if some
/// are quoted already.
fn with_quotes(path: &str) -> Option<String> {
    let path = path.trim();
    if path.contains(['"', '\'']) || !path.contains(char::is_whitespace) {
        return None;
    }
    let names = path.split('.').map(|name| key(name.trim()));
    Some(names.collect::<Vec<_>>().join("."))
}

/// The keys of a dotted path.
fn keys<'i>(source: &Source, path: &str) -> Result<Vec<Spanned<DeString<'i>>>, Error> {
    let text = format!("{path}=0");
    let table = DeTable::parse(&text).map_err(|error| match with_quotes(path) {
        Some(quoted) => source
            .error(
                path.len() - path.trim_start().len()..path.len(),
                "a name with blanks stands in quotes",
            )
            .hint(format!(
                "quotes of the shell around those of the name: --set '{quoted}=…'"
            )),
        None => syntax_error(source, &text, &error),
    })?;
    let mut keys = Vec::new();
    let mut below = Some(table.get_ref());
    while let Some(table) = below {
        below = None;
        for (key, value) in table {
            let name = DeString::from(key.get_ref().to_string());
            keys.push(Spanned::new(key.span(), name));
            if let DeValue::Table(table) = value.get_ref() {
                below = Some(table);
            }
        }
    }
    Ok(keys)
}

/// Refuses what is no setting of a case but says what the file stands for.
fn refuse_keys_of_files(source: &Source, keys: &[Spanned<DeString<'_>>]) -> Result<(), Error> {
    let Some(first) = keys.first() else {
        return Ok(());
    };
    let hint = match first.get_ref().as_ref() {
        "base" => "name the file that is based on it",
        "variant" => "a setting holds for every variant; --variant chooses one",
        _ => return Ok(()),
    };
    let message = format!("`{}` cannot be set", first.get_ref());
    Err(source.error(first.span(), message).hint(hint).into())
}

/// The value of a table that has only this one, `n` keys deep.
fn only_value(table: Spanned<DeTable<'_>>, depth: usize) -> Option<Spanned<DeValue<'_>>> {
    let span = table.span();
    let mut value = Spanned::new(span, DeValue::Table(table.into_inner()));
    for _ in 0..depth {
        let DeValue::Table(table) = value.into_inner() else {
            return None;
        };
        let mut entries = table.into_iter();
        let (_, only) = entries.next()?;
        if entries.next().is_some() {
            return None;
        }
        value = only;
    }
    Some(value)
}

/// A word or a path without quotes stands for a text. Other texts that start like one get a
/// separate error. `start` is where the setting starts.
fn bare_word<'i>(
    source: &Source,
    start: usize,
    range: Range<usize>,
) -> Result<Spanned<DeValue<'i>>, Option<Error>> {
    let text = &source.text()[range.clone()];
    let word = text.trim();
    let at = range.start + text.len() - text.trim_start().len();
    let span = at..at + word.len();
    if word.is_empty() {
        let error = source.error(span, "there is no value after the `=`");
        return Err(Some(error.into()));
    }
    // A path stands for itself, as a word does.
    let is_path = word.starts_with(['.', '/']) && word.contains('/');
    if !is_path && !word.starts_with(|c: char| c.is_alphabetic()) {
        return Err(None);
    }
    let is_part = |c: char| c.is_alphanumeric() || "_-./".contains(c);
    if word.chars().all(is_part) {
        return Ok(Spanned::new(span, DeValue::String(word.to_owned().into())));
    }
    let message = format!("`{word}` is no TOML value, and no single word, which stands for a text");
    let hint = format!(
        "a text needs quotes, and the whole those of the shell: --set '{}{}'",
        &source.text()[start..range.start],
        toml::Value::from(word)
    );
    Err(Some(source.error(span, message).hint(hint).into()))
}

#[cfg(test)]
mod tests {
    use crate::{Source, base};
    use toml::{Table, Value};

    const FILE: &str = "a = 1\nlist = [1, 2]\n[table]\nb = 2\n\
                        [[phase]]\nname = \"one\"\nn = 1\n[[phase]]\nname = \"two\"\nn = 2\n";

    fn with(file: &str, settings: &[&str]) -> Result<Vec<Table>, String> {
        let settings: Vec<String> = settings.iter().map(|s| (*s).to_owned()).collect();
        let source = Source::new("file.toml", file).with_settings(&settings);
        match base::read::<Table>(source) {
            Ok((_, files)) => Ok(files.into_iter().map(|(_, table)| table).collect()),
            Err(crate::Error::Input(error)) => {
                let hint = error
                    .help()
                    .map(|hint| format!("; {hint}"))
                    .unwrap_or_default();
                Err(format!("{error}{hint}"))
            }
            Err(error) => Err(error.to_string()),
        }
    }

    fn only(setting: &str) -> Table {
        with(FILE, &[setting]).unwrap().remove(0)
    }

    #[test]
    fn a_setting_overrides_the_file() {
        assert_eq!(only("a=3")["a"], Value::from(3));
        assert_eq!(
            only(" table.b = \"x y\" # why")["table"]["b"],
            Value::from("x y")
        );
        assert_eq!(only("table.c.d=1.5")["table"]["c"]["d"], Value::from(1.5));
        assert_eq!(only("table={ c = 4 }")["table"]["b"], Value::from(2));
        assert_eq!(only("list=[7]")["list"], Value::from(vec![7]));
        assert_eq!(only("list.2=7")["list"], Value::from(vec![1, 7]));
        assert_eq!(only("\"a=b\".c=true")["a=b"]["c"], Value::from(true));
        // The later one wins.
        let file = with(FILE, &["a=3", "a=4"]).unwrap().remove(0);
        assert_eq!(file["a"], Value::from(4));
    }

    #[test]
    fn a_word_without_quotes_is_a_text() {
        assert_eq!(only("a=arc-length")["a"], Value::from("arc-length"));
        assert_eq!(only("a= soil_2.v1 ")["a"], Value::from("soil_2.v1"));
        for path in ["./x", "../laws/libx.so", "/tmp/x.so", "laws/libx.so"] {
            assert_eq!(only(&format!("a={path}"))["a"], Value::from(path));
        }
        // What is neither stays what it is.
        assert!(with(FILE, &["a=./two words"]).is_err() && with(FILE, &["a=.5"]).is_err());
        let refused = with(FILE, &["a=two words"]).unwrap_err();
        assert_eq!(
            refused,
            "`two words` is no TOML value, and no single word, which stands for a text; \
             a text needs quotes, and the whole those of the shell: --set 'a=\"two words\"'"
        );
    }

    #[test]
    fn paths_that_lead_nowhere_are_refused() {
        let rows = r"
phase.3.n=1 | there is no `phase.3`: `phase` has 2 entries; there is: one, two
phase.twoo.n=1 | there is no `phase.twoo`: `phase` has 2 entries; did you mean `two`? There is: one, two
list.0=1 | there is no `list.0`: `list` has 2 entries; an entry has its position here, from 1
a.b=1 | there is no `a.b`: `a` is the number 1
base=b | `base` cannot be set; name the file that is based on it
variant.1.a=1 | `variant` cannot be set; a setting holds for every variant; --variant chooses one
a=1\nb=2 | one key and one value are expected; --set may be repeated
a= | there is no value after the `=`
a | `a` is no setting, expected KEY=VALUE; such as --set solver.max_iterations=40";
        for row in rows.trim().lines() {
            let (setting, says) = row.split_once(" | ").unwrap();
            let setting = setting.replace("\\n", "\n");
            assert_eq!(with(FILE, &[&setting]).unwrap_err(), says, "{setting}");
        }
    }

    #[test]
    fn values_in_memory_have_their_keys_as_places() {
        let file = "a = 1\n[table]\nb = [1, 22]\n[[phase]]\nname = \"one\"\nn = 1\n[[phase]]\nn = { x = 2 }\n";
        let source = Source::in_memory("case", file);
        let settings = ["table.c=3".to_owned(), "phase.one.\"a b\"=4".to_owned()];
        let source = source.with_settings_in_memory(&settings);
        let place = |text: &str| {
            let at = source.text().find(text).unwrap();
            source.place(&(at..at + 1))
        };
        assert_eq!(place("a = 1"), "`a`");
        assert_eq!(place("b = "), "`table.b`");
        assert_eq!(place("22"), "`table.b.2`");
        assert_eq!(place("n = 1"), "`phase.one.n`");
        assert_eq!(place("2 }"), "`phase.2.n.x`");
        assert_eq!(place("3"), "`table.c`");
        assert_eq!(place("4"), "`phase.one.\"a b\"`");
        let at = source.text().find("table.c").unwrap();
        let error = source.error(at + 8..at + 9, "no");
        assert_eq!(error.key().as_deref(), Some("table.c"));
        // A file has lines, whatever its settings are.
        let source = Source::new("case", file).with_settings_in_memory(&settings);
        assert_eq!(source.place(&(0..1)), "case:1:1");
        assert_eq!(source.place(&(at..at + 1)), "`table.c`");
    }

    #[test]
    fn places_are_those_in_the_setting() {
        let source = Source::new("file.toml", "a = 1\n");
        let source = source.with_settings(&["x=1".to_owned(), "yy=2".to_owned()]);
        let places: Vec<_> = source
            .settings()
            .map(|range| source.place(&range))
            .collect();
        assert_eq!(places, ["--set:1:1", "--set:1:1"]);
        let second = source.settings().nth(1).unwrap();
        assert_eq!(&source.text()[second.clone()], "yy=2");
        assert_eq!(source.path_at(&second), std::path::Path::new("file.toml"));
        assert_eq!(source.text_of_files(), "a = 1\n");
        // What a file is based on stands before it, its settings behind.
        let source = source.based_on(&Source::new("base.toml", "b = 2\n"));
        assert_eq!(source.text_of_files(), "b = 2\n\na = 1\n");
        assert_eq!(source.files().count(), 2);
        assert_eq!(source.settings().count(), 2);
    }
}
