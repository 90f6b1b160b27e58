//! `checkpoint.bin` in a results folder: what a run needs to go on from a whole increment as if it
//! had never stopped.
//!
//! The file is written whole or not at all, and carries a checksum and the identity of its run:
//! program, case and libraries. What the results files held at that moment is part of it.

use crate::case::Case;
use crate::error::{Error, Place};
use crate::group::GroupState;
use crate::model::Model;
use crate::output::{PhaseRecord, ResultsState, unwritable};
use crate::plugin::hexadecimal_sha256;
use crate::run::History;
use crate::solver::{Loads, Standing};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs::File;
use std::io::Write as _;
use std::path::Path;

/// Name of the file in a results folder.
pub const FILE_NAME: &str = "checkpoint.bin";

/// First bytes of the file: the format and its version.
const HEAD: &[u8] = b"pilum checkpoint 3\n";

/// A run after a whole increment.
#[derive(Debug, Serialize, Deserialize)]
pub struct Checkpoint {
    identity: String,
    /// The results so far.
    pub results: ResultsState,
    /// Warnings so far.
    pub warnings: Vec<String>,
    /// The run; `None` if it has come to its end.
    pub run: Option<RunState>,
}

/// State of a run.
#[derive(Debug, Serialize, Deserialize)]
pub struct RunState {
    /// Number of the phase, from 0.
    pub phase: usize,
    /// Groups.
    pub groups: Vec<GroupState>,
    /// Displacements by degree of freedom.
    pub displacement: Vec<f64>,
    /// Prescribed displacements by degree of freedom.
    pub prescribed: BTreeMap<usize, f64>,
    /// Pressures by line.
    pub pressure: BTreeMap<String, f64>,
    /// External forces by degree of freedom.
    pub force: Vec<f64>,
    /// Pseudo-time at the start of the phase.
    pub time: f64,
    /// Largest of the forces (2-norms) at the start of any phase so far.
    pub largest_force: f64,
    /// Where the phase stands.
    pub course: PhaseCourse,
}

/// Where a phase stands.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct PhaseCourse {
    /// Loads of the phase.
    pub loads: Loads,
    /// Whole increments done.
    pub increment: usize,
    /// Load factor reached.
    pub lambda: f64,
    /// Length of the next step.
    pub step: f64,
    /// The last steps.
    pub history: History,
    /// Where the linear domain stands.
    pub domain: Option<Standing>,
    /// A matrix of the groups' tangents is in use.
    pub has_matrix: bool,
    /// The phase so far.
    pub record: PhaseRecord,
}

impl Checkpoint {
    /// A checkpoint of this case.
    pub fn new(
        identity: &str,
        results: ResultsState,
        warnings: &[String],
        run: Option<RunState>,
    ) -> Self {
        Self {
            identity: identity.to_owned(),
            results,
            warnings: warnings.to_vec(),
            run,
        }
    }

    /// Writes it into a results folder, in place of an earlier one, and waits for the disk.
    ///
    /// # Errors
    /// [`Error::Unwritable`]; the earlier one is still there.
    pub fn write(&self, folder: &Path) -> Result<(), Error> {
        let body = postcard::to_stdvec(self).map_err(|e| Error::Internal(e.to_string()))?;
        let path = folder.join(FILE_NAME);
        let partial = folder.join(format!("{FILE_NAME}.part"));
        let written = File::create(&partial).and_then(|mut file| {
            file.write_all(HEAD)?;
            file.write_all(hexadecimal_sha256(&body).as_bytes())?;
            file.write_all(&body)?;
            file.sync_all()
        });
        written
            .and_then(|()| std::fs::rename(&partial, &path))
            .map_err(|error| {
                let _ = std::fs::remove_file(&partial);
                unwritable(&path, error)
            })
    }

    /// Reads the checkpoint of a run of this identity; `None` if there is none.
    ///
    /// # Errors
    /// It cannot be read, is damaged, or belongs to another run.
    pub fn read(folder: &Path, identity: &str) -> Result<Option<Self>, Error> {
        let path = folder.join(FILE_NAME);
        let bytes = match std::fs::read(&path) {
            Ok(bytes) => bytes,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            Err(source) => return Err(Error::Unreadable { path, source }),
        };
        let refused = |why: &str| {
            Error::Usage(format!(
                "{}: {why}; run without --resume to start anew",
                path.display()
            ))
        };
        let checkpoint = decode(&bytes).ok_or_else(|| refused("the file is damaged"))?;
        if checkpoint.identity != identity {
            return Err(refused(
                "it belongs to another case, another version of the program, or other libraries or \
                 sidecars",
            ));
        }
        Ok(Some(checkpoint))
    }

    /// The increment it was made after, for messages.
    pub fn place(&self, case: &Case) -> Option<Place> {
        let run = self.run.as_ref()?;
        Some(Place {
            phase: case.file.phases.get(run.phase)?.name.get_ref().clone(),
            increment: run.course.increment,
        })
    }
}

fn decode(bytes: &[u8]) -> Option<Checkpoint> {
    let rest = bytes.strip_prefix(HEAD)?;
    let (checksum, body) = rest.split_at_checked(64)?;
    (hexadecimal_sha256(body).as_bytes() == checksum).then_some(())?;
    postcard::from_bytes(body).ok()
}

/// What must be the same for a run to go on: the program, the case with its variant, the bytes of
/// its libraries and of their sidecars, and the parameters.
pub fn identity(case: &Case, model: &Model) -> String {
    let mut text = format!("pilum {}\n", env!("CARGO_PKG_VERSION"));
    text += case.variant.as_deref().unwrap_or_default();
    text += "\n";
    for ((name, hypothesis), built) in &model.laws {
        let library = built.law.library();
        let (sha256, sidecar) = (library.sha256(), library.sidecar_sha256());
        // What a sidecar says of a library is not part of its bytes.
        let sidecar = sidecar.unwrap_or_default();
        let _ = writeln!(text, "{name} {hypothesis} {sha256} {sidecar}");
        for parameter in &built.parameters {
            let _ = writeln!(text, "{} {:x}", parameter.id, parameter.value.to_bits());
        }
    }
    let _ = writeln!(text, "{:?}", case.file.chosen);
    text += case.source.text();
    hexadecimal_sha256(text.as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn damaged_files_are_none() {
        assert!(decode(b"").is_none());
        assert!(decode(HEAD).is_none());
        let mut bytes = HEAD.to_vec();
        bytes.extend(hexadecimal_sha256(b"nonsense").as_bytes());
        bytes.extend(b"nonsense");
        assert!(decode(&bytes).is_none());
    }
}
