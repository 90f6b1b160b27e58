//! Problems as input of other finite-element programs, and their results as tables like those of a run.
//!
//! A case becomes a [`Model`] of plain values, without what cannot be carried; one writer for each program turns it
//! into files. All loads are nodal forces, so that no program's convention for pressures or weights matters.

mod calculix;
mod columns;
mod course;
mod dolfinx;
mod import;
mod kratos;
mod limits;
mod model;
mod opengeosys;
mod vtu;

pub use import::import;
pub use limits::NotCarried;
pub use model::Model;

use input::{Case, Error};
use serde::{Deserialize, Serialize};
use std::path::Path;
use text::write::replace;

/// Other files of an export and its results: whole names, and beginnings.
const NAMES: [&str; 6] = [
    "result.pvd",
    "history.csv",
    "summary.json",
    "report.html",
    "nodes.csv",
    "bulk.vtu",
];
const STARTS: [&str; 6] = [
    "model.",
    "result_",
    "held_",
    "load_",
    "run_kratos",
    "run_dolfinx",
];
/// Name of the model's file in the folder.
const MODEL: &str = "model.json";

/// A program that a case can be written for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Program {
    /// OpenGeoSys, with laws by MFront's generic interface.
    Ogs,
    /// Kratos GeoMechanics, with laws as user materials of Abaqus.
    Kratos,
    /// CalculiX; linear elastic laws only.
    Calculix,
    /// DOLFINx, with laws by Pilum's package for Python.
    Dolfinx,
}

impl Program {
    /// Name in words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ogs => "OpenGeoSys",
            Self::Kratos => "Kratos",
            Self::Calculix => "CalculiX",
            Self::Dolfinx => "DOLFINx",
        }
    }

    /// Whether its elements start free of stress here: the initial stress of linear elastic ground is carried as the
    /// nodal forces that balance it.
    pub(crate) fn starts_free_of_stress(self) -> bool {
        matches!(self, Self::Kratos | Self::Calculix)
    }

    /// The command that runs the files, in their folder.
    pub fn command(self) -> &'static str {
        match self {
            Self::Ogs => "ogs model.prj -o .",
            Self::Kratos => "python run_kratos.py",
            Self::Calculix => "ccx model",
            Self::Dolfinx => "python run_dolfinx.py",
        }
    }
}

/// Writes the files for a program, and `model.json` that [`import()`] needs, into a folder. Returns what is not
/// carried although the rest is.
///
/// # Errors
/// [`text::Error::Input`] at the key that cannot be carried; [`text::Error::Unwritable`]; errors of the case.
pub fn export(case: &Case, to: Program, folder: &Path) -> Result<Vec<NotCarried>, Error> {
    let model = Model::of(case, to)?;
    let unwritable = |error| text::Error::unwritable(folder, error);
    std::fs::create_dir_all(folder).map_err(unwritable)?;
    forget(folder).map_err(unwritable)?;
    let text = serde_json::to_string(&model).map_err(|error| Error::internal(error.to_string()))?;
    replace(&folder.join(MODEL), text)?;
    let files = match to {
        Program::Ogs => opengeosys::files(&model),
        Program::Kratos => kratos::files(),
        Program::Calculix => calculix::files(&model),
        Program::Dolfinx => dolfinx::files(),
    };
    for (name, text) in files {
        replace(&folder.join(name), text)?;
    }
    Ok(model.not_carried)
}

/// Removes input and results of an earlier export, which would be read as those of this one.
fn forget(folder: &Path) -> std::io::Result<()> {
    if !folder.join(MODEL).is_file() {
        return Ok(());
    }
    for entry in std::fs::read_dir(folder)? {
        let entry = entry?;
        let name = entry.file_name();
        let name = name.to_string_lossy();
        let is_ours = NAMES.contains(&&*name) || STARTS.iter().any(|start| name.starts_with(start));
        if is_ours && entry.file_type()?.is_file() {
            std::fs::remove_file(entry.path())?;
        }
    }
    Ok(())
}
