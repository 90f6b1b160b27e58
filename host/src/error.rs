//! What can go wrong, sorted by who has to act; the program's exit code follows.

use crate::file;
use miette::{Diagnostic, LabeledSpan, NamedSource, SourceCode, SourceSpan};
use serde::{Deserialize, Serialize};
use std::fmt;
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
    /// Where each file starts in the text, in order.
    files: Vec<(usize, PathBuf)>,
}

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

    /// Takes a text as if it came from a file of this name.
    pub fn new(path: impl Into<PathBuf>, text: impl Into<Arc<str>>) -> Self {
        let path = path.into();
        Self {
            files: vec![(0, path.clone())],
            path,
            text: text.into(),
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
        }
    }

    /// Path of the file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Text of the file, after those it is based on.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Where the files stand in the text.
    pub fn files(&self) -> impl Iterator<Item = Range<usize>> {
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
        let range = self.files().nth(number).unwrap_or_default();
        (&self.files[number].1, range.start, &self.text[range])
    }

    /// The file a span lies in.
    pub fn path_at(&self, span: &Range<usize>) -> &Path {
        self.file(span.start).0
    }

    /// File, line and column (from 1) of the start of a span.
    pub fn place(&self, span: &Range<usize>) -> String {
        let (path, start, text) = self.file(span.start);
        let before = &text[..(span.start - start).min(text.len())];
        let line = before.matches('\n').count() + 1;
        let column = before
            .rsplit('\n')
            .next()
            .map_or(0, |line| line.chars().count())
            + 1;
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
        if error.source_code.name() == path.display().to_string() {
            let span = span.start - start..span.end.saturating_sub(start).min(text.len());
            error.second = Some((span.into(), label.into()));
        }
        error
    }

    /// An error about the bytes `span`.
    pub fn error(&self, span: Range<usize>, message: impl Into<String>) -> InputError {
        let (path, start, text) = self.file(span.start);
        let span = span.start - start..span.end.saturating_sub(start).min(text.len());
        InputError {
            message: message.into(),
            label: None,
            hint: None,
            span: span.into(),
            second: None,
            source_code: NamedSource::new(path.display().to_string(), text.to_owned())
                .with_language("TOML"),
        }
    }
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
    label: Option<String>,
    hint: Option<String>,
    span: SourceSpan,
    /// Another place that it is about.
    second: Option<(SourceSpan, String)>,
    source_code: NamedSource<String>,
}

impl Diagnostic for InputError {
    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        let hint = self.hint.as_ref()?;
        Some(Box::new(hint))
    }

    fn source_code(&self) -> Option<&dyn SourceCode> {
        Some(&self.source_code)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        let label = LabeledSpan::new_with_span(self.label.clone(), self.span);
        let second = self
            .second
            .iter()
            .map(|(span, label)| LabeledSpan::new_with_span(Some(label.clone()), *span));
        Some(Box::new(std::iter::once(label).chain(second)))
    }
}

impl InputError {
    /// Adds what the user could do.
    #[must_use]
    pub fn hint(self, hint: impl Into<String>) -> Self {
        Self {
            hint: Some(hint.into()),
            ..self
        }
    }

    /// Adds a word beside the underlined place.
    #[must_use]
    pub fn label(self, label: impl Into<String>) -> Self {
        Self {
            label: Some(label.into()),
            ..self
        }
    }
}

/// Where in a run something happened.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Place {
    /// Phase.
    pub phase: String,
    /// Increment within the phase, from 1.
    pub increment: usize,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "phase `{}`, increment {}", self.phase, self.increment)
    }
}

/// Any error of the host.
#[derive(Debug, Error, Diagnostic)]
#[non_exhaustive]
pub enum Error {
    /// An input file is wrong.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Input(#[from] Box<InputError>),
    /// An input file cannot be read.
    #[error("cannot read {}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// Results cannot be written.
    #[error("cannot write {}", path.display())]
    #[diagnostic(help("name another place for the results on the command line"))]
    Unwritable {
        /// The file or folder.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// Arguments of the command line are wrong.
    #[error("{0}")]
    Usage(String),
    /// A library cannot be used, or broke the contract.
    #[error("{message}")]
    Plugin {
        /// Library, law and reason.
        message: String,
        /// What the user could do.
        #[help]
        hint: Option<String>,
    },
    /// No equilibrium was found.
    #[error("{message}")]
    NoEquilibrium {
        /// Place and reason.
        message: String,
        /// What the user could do.
        #[help]
        hint: Option<String>,
    },
    /// The user stopped the run after a whole increment.
    #[error("{place}: stopped as asked; everything up to here is written")]
    #[diagnostic(help("go on with --resume"))]
    Interrupted {
        /// The last increment.
        place: Place,
    },
    /// The user stopped the work in the middle.
    #[error("{message}")]
    Stopped {
        /// Where it was stopped.
        message: String,
        /// How to go on.
        #[help]
        hint: Option<String>,
    },
    /// A defect of the program.
    #[error("internal error: {0}")]
    Internal(String),
}

impl From<InputError> for Error {
    fn from(error: InputError) -> Self {
        Self::Input(Box::new(error))
    }
}

impl Error {
    /// A plugin error without a hint.
    pub fn plugin(message: impl Into<String>) -> Self {
        Self::Plugin {
            message: message.into(),
            hint: None,
        }
    }

    /// Adds what the user could do.
    #[must_use]
    pub fn with_hint(self, more: &str) -> Self {
        let add = |hint: Option<String>| match hint {
            Some(hint) => Some(format!("{hint}; {more}")),
            None => Some(more.to_owned()),
        };
        match self {
            Self::Plugin { message, hint } => Self::Plugin {
                message,
                hint: add(hint),
            },
            Self::NoEquilibrium { message, hint } => Self::NoEquilibrium {
                message,
                hint: add(hint),
            },
            Self::Input(mut input) => {
                input.hint = add(input.hint.take());
                Self::Input(input)
            }
            other => other,
        }
    }

    /// Whether the user stopped the work: nothing is wrong with it.
    pub fn is_stop(&self) -> bool {
        matches!(self, Self::Interrupted { .. } | Self::Stopped { .. })
    }

    /// The program's exit code: 1 bad input (places that cannot be read or written included), 2 no equilibrium, 3 plugin trouble, 4 internal, 130 stopped as asked (as shells say it of Ctrl-C).
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Input(_) | Self::Unreadable { .. } | Self::Unwritable { .. } | Self::Usage(_) => {
                1
            }
            Self::NoEquilibrium { .. } => 2,
            Self::Plugin { .. } => 3,
            Self::Internal(_) => 4,
            Self::Interrupted { .. } | Self::Stopped { .. } => 130,
        }
    }
}

/// The candidate closest to `name`, if any is close enough to be a slip of the pen.
pub fn nearest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    // The distance takes the product of the lengths.
    const LONGEST: usize = 200;
    candidates
        .into_iter()
        .filter(|candidate| candidate.len().max(name.len()) <= LONGEST)
        .map(|candidate| (edit_distance(name, candidate), candidate))
        .filter(|(distance, candidate)| {
            *distance <= 1 + candidate.len() / 3 && *distance < candidate.len().max(name.len())
        })
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, candidate)| candidate)
}

/// `did you mean …?` and the whole list, for a name that is not among the candidates.
pub fn suggestion<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str> + Clone) -> String {
    let all: Vec<&str> = candidates.clone().into_iter().collect();
    let list = if all.is_empty() {
        "there is none".to_owned()
    } else {
        all.join(", ")
    };
    match nearest(name, candidates) {
        Some(near) => format!("did you mean `{near}`? There is: {list}"),
        None => format!("there is: {list}").replace("there is: there is none", "there is none"),
    }
}

/// Levenshtein distance.
fn edit_distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, ca) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, &cb) in b.iter().enumerate() {
            let substitute = diagonal + usize::from(ca != cb);
            diagonal = row[j + 1];
            row[j + 1] = substitute.min(row[j] + 1).min(row[j + 1] + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn suggests_the_nearest_name() {
        let names = ["young_modulus", "poisson_ratio"];
        assert_eq!(nearest("youngs_modulus", names), Some("young_modulus"));
        assert_eq!(nearest("cohesion", names), None);
        assert_eq!(nearest("w", ["x", "y"]), None);
    }

    #[test]
    fn edit_distance_counts_single_changes() {
        assert_eq!(edit_distance("sand", "sand"), 0);
        assert_eq!(edit_distance("sand", "hand"), 1);
        assert_eq!(edit_distance("", "abc"), 3);
        assert_eq!(edit_distance("kitten", "sitting"), 3);
    }
}
