//! What can go wrong, sorted by who has to act; the program's exit code follows.

use miette::{Diagnostic, NamedSource, SourceSpan};
use std::fmt;
use std::ops::Range;
use std::path::{Path, PathBuf};
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
        let text = std::fs::read_to_string(path).map_err(|source| Error::Unreadable {
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

    /// An error about the bytes `span`.
    pub fn error(&self, span: Range<usize>, message: impl Into<String>) -> InputError {
        let (path, start, text) = self.file(span.start);
        let span = span.start - start..span.end.saturating_sub(start).min(text.len());
        InputError {
            message: message.into(),
            label: String::new(),
            hint: None,
            span: span.into(),
            source_code: NamedSource::new(path.display().to_string(), text.to_owned())
                .with_language("TOML"),
        }
    }
}

/// An error in an input file, with its place.
#[derive(Clone, Debug, Error, Diagnostic)]
#[error("{message}")]
pub struct InputError {
    message: String,
    label: String,
    #[help]
    hint: Option<String>,
    #[label("{label}")]
    span: SourceSpan,
    #[source_code]
    source_code: NamedSource<String>,
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
            label: label.into(),
            ..self
        }
    }
}

/// Where in a run something happened.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
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
    #[error("cannot read {}: {source}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// Results cannot be written.
    #[error("cannot write {}: {source}", path.display())]
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

    /// The program's exit code: 1 bad input, 2 no equilibrium, 3 plugin trouble, 4 internal.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Input(_) | Self::Unreadable { .. } | Self::Usage(_) => 1,
            Self::NoEquilibrium { .. } => 2,
            Self::Plugin { .. } => 3,
            Self::Unwritable { .. } | Self::Internal(_) => 4,
        }
    }
}

/// The candidate closest to `name`, if any is close enough to be a slip of the pen.
pub fn nearest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    candidates
        .into_iter()
        .map(|candidate| (edit_distance(name, candidate), candidate))
        .filter(|(distance, candidate)| *distance <= 1 + candidate.len() / 3)
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
    }

    #[test]
    fn edit_distance_counts_single_changes() {
        assert_eq!(edit_distance("sand", "sand"), 0);
        assert_eq!(edit_distance("sand", "hand"), 1);
        assert_eq!(edit_distance("", "abc"), 3);
        assert_eq!(edit_distance("kitten", "sitting"), 3);
    }
}
