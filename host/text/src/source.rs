//! A text that a user wrote, and errors with their place in it.

use crate::setting::{key_at, key_in_setting};
use crate::{Error, Spanned, file, suggestion};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::string::FromUtf8Error;
use std::sync::Arc;
use thiserror::Error;

/// An input file with the files it is based on, kept for messages that point into them.
///
/// The texts stand one after the other, so that one span says file and place.
#[derive(Clone, Debug)]
pub struct Source {
    path: PathBuf,
    text: Arc<str>,
    /// Where each file starts in the text, in order, and behind the files each setting.
    files: Vec<(usize, PathBuf)>,
    /// How many of these are settings.
    n_settings: usize,
    /// It was made of values in memory: nobody has written its lines, and places in it are keys.
    is_in_memory: bool,
    /// The same of the settings.
    has_settings_in_memory: bool,
}

/// The name of a command-line setting in place of a file name.
const SETTING: &str = "--set";

impl Source {
    /// Reads a file.
    ///
    /// # Errors
    /// [`Error::Unreadable`].
    pub fn read(path: &Path) -> Result<Self, Error> {
        let text = file::read_text(path)
            .and_then(|bytes| String::from_utf8(bytes).map_err(|error| not_utf_8(&error)))
            .map_err(|source| Error::Unreadable {
                path: path.to_owned(),
                source,
            })?;
        Ok(Self::new(path, text))
    }

    /// Takes a text as if it came from a file of this name. A byte order mark is no part of it:
    /// columns count without it, and it may be in the middle once another file precedes.
    pub fn new(path: impl Into<PathBuf>, text: impl Into<Arc<str>>) -> Self {
        let path = path.into();
        let text = text.into();
        let unmarked = text.strip_prefix('\u{feff}').map(Arc::from);
        Self {
            files: vec![(0, path.clone())],
            path,
            text: unmarked.unwrap_or(text),
            n_settings: 0,
            is_in_memory: false,
            has_settings_in_memory: false,
        }
    }

    /// Takes a text that was made of values in memory, under this name.
    pub fn in_memory(name: &str, text: impl Into<Arc<str>>) -> Self {
        Self {
            is_in_memory: true,
            ..Self::new(name, text)
        }
    }

    /// This file with settings behind it that were values in memory.
    #[must_use]
    pub fn with_settings_in_memory(self, settings: &[String]) -> Self {
        Self {
            has_settings_in_memory: true,
            ..self.with_settings(settings)
        }
    }

    /// This file with settings of the command line behind it, `KEY=VALUE`, which override it.
    #[must_use]
    pub fn with_settings(self, settings: &[String]) -> Self {
        let mut text = self.text.to_string();
        let mut files = self.files;
        for setting in settings {
            text.push('\n');
            files.push((text.len(), SETTING.into()));
            text += setting;
        }
        Self {
            path: self.path,
            text: text.into(),
            files,
            n_settings: self.n_settings + settings.len(),
            ..self
        }
    }

    /// This file after the one it is based on.
    #[must_use]
    pub fn based_on(&self, base: &Self) -> Self {
        let offset = base.text.len() + 1;
        let own = self
            .files
            .iter()
            .map(|(start, path)| (start + offset, path.clone()));
        Self {
            path: self.path.clone(),
            text: format!("{}\n{}", base.text, self.text).into(),
            files: base.files.iter().cloned().chain(own).collect(),
            n_settings: self.n_settings,
            ..*self
        }
    }

    /// Path of the file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Text of the file, after those it is based on and before the settings.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The same without the settings.
    pub fn text_of_files(&self) -> &str {
        let end = self.files().last().map_or(0, |range| range.end);
        &self.text[..end]
    }

    /// Ranges of the files in the text.
    pub fn files(&self) -> impl Iterator<Item = Range<usize>> {
        self.parts().take(self.files.len() - self.n_settings)
    }

    /// Ranges of the settings in the text.
    pub fn settings(&self) -> impl Iterator<Item = Range<usize>> {
        self.parts().skip(self.files.len() - self.n_settings)
    }

    /// Place of the last setting that gives this key, or one below it; dots between the keys.
    pub fn setting_of(&self, path: &str) -> Option<Range<usize>> {
        let gives = |range: &Range<usize>| {
            let key = self.text[range.clone()].split('=').next();
            let below = key.and_then(|key| key.trim().strip_prefix(path));
            below.is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
        };
        self.settings().filter(gives).last()
    }

    /// Ranges of files and settings in the text.
    fn parts(&self) -> impl Iterator<Item = Range<usize>> {
        (0..self.files.len()).map(|number| {
            let end = self
                .files
                .get(number + 1)
                .map_or(self.text.len(), |(next, _)| next - 1);
            self.files[number].0..end
        })
    }

    /// The file a span lies in, where it starts, and its text.
    fn file(&self, at: usize) -> (&Path, usize, &str) {
        let number = self
            .files
            .iter()
            .rposition(|(start, _)| *start <= at)
            .unwrap_or(0);
        let range = self.parts().nth(number).unwrap_or_default();
        (&self.files[number].1, range.start, &self.text[range])
    }

    /// The file that paths written at a span are relative to: the one that it lies in, and of a
    /// setting the one that this overrides.
    pub fn path_at(&self, span: &Range<usize>) -> &Path {
        match self.file(span.start).0 {
            setting if setting == Path::new(SETTING) => &self.path,
            file => file,
        }
    }

    /// File, line and column (from 1) of the start of a span; the key where it was a value in memory.
    pub fn place(&self, span: &Range<usize>) -> String {
        let (path, start, text) = self.file(span.start);
        let is_setting = path == Path::new(SETTING);
        let key = match is_setting {
            true if self.has_settings_in_memory => key_in_setting(text, span.start - start),
            false if self.is_in_memory && path == self.path => key_at(text, span.start - start),
            _ => None,
        };
        if let Some(key) = key {
            return format!("`{key}`");
        }
        let (line, column) = line_and_column(text, span.start - start);
        format!("{}:{line}:{column}", path.display())
    }

    /// Marks a second place of an error, if it is in the same file.
    #[must_use]
    pub fn mark(
        &self,
        mut error: InputError,
        span: Range<usize>,
        label: impl Into<String>,
    ) -> InputError {
        let (path, start, text) = self.file(span.start);
        if error.path == path.display().to_string() && *error.text == *text {
            let span = span.start - start..span.end.saturating_sub(start).min(text.len());
            error.second = Some((span, label.into()));
        }
        error
    }

    /// The file of a name that a file has at a span: relative to the folder of that file.
    pub fn file_named(&self, name: &Path, span: &Range<usize>) -> PathBuf {
        let folder = self.path_at(span).parent();
        folder.unwrap_or(Path::new("")).join(name)
    }

    /// An error about a name that there is not, with those that there are.
    pub fn unknown<'a>(
        &self,
        kind: &str,
        name: &Spanned<String>,
        known: impl IntoIterator<Item = &'a str>,
    ) -> InputError {
        let message = format!("there is no {kind} `{}`", name.get_ref());
        let error = self.error(name.span(), message);
        error.hint(suggestion(name.get_ref(), known))
    }

    /// An error about the bytes `span`.
    pub fn error(&self, span: Range<usize>, message: impl Into<String>) -> InputError {
        let (path, start, text) = self.file(span.start);
        let span = span.start - start..span.end.saturating_sub(start).min(text.len());
        InputError {
            message: message.into(),
            label: None,
            hint: None,
            span,
            second: None,
            path: path.display().to_string(),
            text: text.into(),
        }
    }
}

/// Line and column of a byte, from 1.
fn line_and_column(text: &str, at: usize) -> (usize, usize) {
    let before = &text[..at.min(text.len())];
    let first = before.rfind('\n').map_or(0, |end| end + 1);
    let line = before.matches('\n').count() + 1;
    (line, before[first..].chars().count() + 1)
}

/// The place where a file ceases to be UTF-8, and what it could be instead.
fn not_utf_8(error: &FromUtf8Error) -> std::io::Error {
    let bytes = error.as_bytes();
    let at = error.utf8_error().valid_up_to();
    let line = bytes[..at].split(|&byte| byte == b'\n').count();
    let hint = match bytes {
        [0xff, 0xfe, ..] | [0xfe, 0xff, ..] => ": it looks like UTF-16, save it as UTF-8",
        _ if bytes.contains(&0) => ": it looks like a binary file",
        _ => ": save it as UTF-8",
    };
    std::io::Error::new(
        std::io::ErrorKind::InvalidData,
        format!(
            "line {line}: the byte {:#04x} is not UTF-8 text{hint}",
            bytes[at]
        ),
    )
}

/// An error in an input file, with its place.
#[derive(Clone, Debug, Error)]
#[error("{message}")]
pub struct InputError {
    message: String,
    pub(crate) label: Option<String>,
    hint: Option<String>,
    /// Its place, in bytes of the file's text.
    pub(crate) span: Range<usize>,
    /// Another place that it is about.
    pub(crate) second: Option<(Range<usize>, String)>,
    pub(crate) path: String,
    pub(crate) text: Arc<str>,
}

/// The line of a file that an error is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Line<'e> {
    /// Name of the file.
    pub file: &'e str,
    /// Line and column at which the place starts, from 1.
    pub at: (usize, usize),
    /// The line itself.
    pub text: &'e str,
    /// The label of the place.
    pub label: Option<&'e str>,
}

impl InputError {
    /// The line that it is about, for those who do not show it as [`crate::shown`] does.
    pub fn line(&self) -> Line<'_> {
        let at = line_and_column(&self.text, self.span.start);
        Line {
            file: &self.path,
            at,
            text: self.text.lines().nth(at.0 - 1).unwrap_or_default(),
            label: self.label.as_deref(),
        }
    }

    /// Its place as a setting would name it: the keys that lead there, dots between them, entries of lists by their
    /// `name` or their position from 1. `None` where no key is.
    pub fn key(&self) -> Option<String> {
        match self.setting() {
            Some((setting, at)) => key_in_setting(setting, at),
            None => key_at(&self.text, self.span.start),
        }
    }

    /// The place that it is about, in bytes of the file's text.
    pub fn span(&self) -> Range<usize> {
        self.span.clone()
    }

    /// A hint for the user, if one is known.
    pub fn help(&self) -> Option<&str> {
        self.hint.as_deref()
    }

    /// As [`Self::help`], to be added to.
    pub fn hint_mut(&mut self) -> &mut Option<String> {
        &mut self.hint
    }

    /// For an error in a command-line setting: that setting, and the place in it.
    pub fn setting(&self) -> Option<(&str, usize)> {
        (self.path == SETTING).then(|| (&*self.text, self.span.start))
    }

    /// The same mistake, at the place of another text that the present one was made from.
    #[must_use]
    pub fn moved_to(self, source: &Source, span: Range<usize>) -> Self {
        let moved = source.error(span, self.message);
        Self {
            hint: self.hint,
            label: self.label,
            ..moved
        }
    }

    /// Adds what the user could do.
    #[must_use]
    pub fn hint(self, hint: impl Into<String>) -> Self {
        Self {
            hint: Some(hint.into()),
            ..self
        }
    }

    /// Adds a label to the underlined place.
    #[must_use]
    pub fn label(self, label: impl Into<String>) -> Self {
        Self {
            label: Some(label.into()),
            ..self
        }
    }
}
