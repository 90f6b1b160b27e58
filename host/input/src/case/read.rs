//! A case, read from its file.

use super::CaseFile;
use crate::{Error, file_in, name_of};
use law::Opener;
use std::path::{Path, PathBuf};
use text::{Source, Spanned, base};

/// What a driver file looks like among case files.
const DRIVER: base::OtherKind = base::OtherKind {
    keys: &["hypothesis", "segment"],
    message: "this is a driver file, which leads a law at one point; expected a case file",
    command: "pilum point",
};

/// A case file and its text.
#[derive(Clone, Debug)]
pub struct Case {
    /// Text and path, for messages.
    pub source: Source,
    /// Contents.
    pub file: CaseFile,
    /// Name of the variant, if the file stands for several cases.
    pub variant: Option<String>,
    /// Settings for opening the libraries of its laws.
    pub opener: Opener,
}

impl Case {
    /// Reads a case file, or `case.toml` in a folder: one case, or one for each `[[variant]]`.
    ///
    /// # Errors
    /// [`text::Error::Unreadable`], or [`text::Error::Input`] at the place that does not fit.
    pub fn load(path: &Path) -> Result<Vec<Self>, Error> {
        Self::load_with(path, &[])
    }

    /// As [`Case::load`], with settings over what the file says, `KEY=VALUE`, in every variant.
    ///
    /// # Errors
    /// As [`Case::load`]; [`text::Error::Input`] at the place in a setting.
    pub fn load_with(path: &Path, settings: &[String]) -> Result<Vec<Self>, Error> {
        Self::of(Source::read(&file_in(path, "case"))?.with_settings(settings))
    }

    /// Takes the text of a case file.
    ///
    /// # Errors
    /// [`text::Error::Input`] at the place that does not fit.
    pub fn of(source: Source) -> Result<Vec<Self>, Error> {
        let opener = Opener::default();
        let (source, files) = base::read_kind(source, &DRIVER)?;
        let case = |(variant, file)| Self {
            source: source.clone(),
            file,
            variant,
            opener: opener.clone(),
        };
        Ok(files.into_iter().map(case).collect())
    }

    /// The case, its laws' libraries opened with this; by default with what neither probes nor
    /// isolates.
    #[must_use]
    pub fn opened_by(self, opener: &Opener) -> Self {
        Self {
            opener: opener.clone(),
            ..self
        }
    }

    /// Folder for the results if none is given: `results/<case>`, or `results/<case>/<variant>`.
    pub fn default_folder(&self) -> PathBuf {
        let folder = Path::new("results").join(self.name());
        self.variant
            .iter()
            .fold(folder, |folder, variant| folder.join(variant))
    }

    /// Name of the case: its folder if the file is called `case.toml`, else the file's stem.
    pub fn name(&self) -> String {
        name_of(self.source.path(), "case")
    }

    /// Elements of its grid; `None` where the mesh is in a file.
    pub fn n_elements(&self) -> Option<usize> {
        let mesh = &self.file.mesh;
        let [columns, rows] = [mesh.columns.as_ref()?, mesh.rows.as_ref()?].map(|parts| {
            let numbers = parts.get_ref().iter().map(|part| part.get_ref().n);
            numbers.fold(0, usize::saturating_add)
        });
        Some(columns.saturating_mul(rows))
    }

    /// Folders with law libraries, relative to the file that names them.
    ///
    /// # Errors
    /// [`text::Error::Input`] if there is no such folder.
    pub fn law_folders(&self) -> Result<Vec<PathBuf>, Error> {
        let folder = |written: &Spanned<PathBuf>| {
            let folder = self.source.file_named(written.get_ref(), &written.span());
            if folder.is_dir() {
                return Ok(folder);
            }
            let message = format!("`law_path`: there is no folder {}", folder.display());
            Err(self.source.error(written.span(), message).into())
        };
        self.file.law_path.iter().map(folder).collect()
    }
}
