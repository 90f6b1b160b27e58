//! Trials that are done, kept next to the results: a study that is stopped goes on from them.
//!
//! The file has a line for the study it belongs to and one for each trial. A line that was cut off
//! when the program was killed is a trial that is made again.

use super::sampled::Sampled;
use super::trial::Trial;
use crate::Error;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use text::write::begin;

/// Name of the file in the folder of a study.
pub(super) const FILE_NAME: &str = "trials.jsonl";

/// The trials of one study.
#[derive(Debug)]
pub(super) struct Kept {
    path: PathBuf,
    file: File,
    done: BTreeMap<String, Trial>,
}

/// First line: what must be the same for a study to go on.
#[derive(Serialize, Deserialize)]
struct Head<'a> {
    study: Cow<'a, str>,
}

/// A trial. Its values are written by their bits, so that values read back unchanged, and a NaN
/// stays a NaN.
#[derive(Serialize, Deserialize)]
struct Line<'a> {
    settings: Cow<'a, str>,
    cpu_seconds: Cow<'a, str>,
    counts: Cow<'a, [u64]>,
    linear: Cow<'a, [bool]>,
    names: Cow<'a, [String]>,
    bits: Vec<Vec<Vec<u64>>>,
    zeros: Vec<u64>,
}

impl Kept {
    /// Begins the file of a study; `resume`: with what it holds.
    ///
    /// # Errors
    /// It cannot be read or written, or belongs to another study.
    pub(super) fn begin(folder: &Path, identity: &str, resume: bool) -> Result<Self, Error> {
        let path = folder.join(FILE_NAME);
        let unwritable = |source| text::Error::unwritable(&path, source);
        let done = if resume {
            read(&path, identity)?
        } else {
            BTreeMap::new()
        };
        std::fs::create_dir_all(folder).map_err(unwritable)?;
        let file = begin(&path).map_err(unwritable)?;
        let head = Head {
            study: identity.into(),
        };
        let mut kept = Self {
            path,
            file,
            done: BTreeMap::new(),
        };
        kept.line(&head)?;
        for (settings, trial) in done {
            kept.keep(settings, &trial)?;
        }
        Ok(kept)
    }

    /// How many trials are done.
    pub(super) fn len(&self) -> usize {
        self.done.len()
    }

    /// The trial with these settings.
    pub(super) fn find(&self, settings: &str) -> Option<&Trial> {
        self.done.get(settings)
    }

    /// Keeps a trial.
    ///
    /// # Errors
    /// [`text::Error::Unwritable`].
    pub(super) fn keep(&mut self, settings: String, trial: &Trial) -> Result<(), Error> {
        let bits = |row: &Vec<f64>| row.iter().map(|value| value.to_bits()).collect();
        let stretches = trial.rows.stretches.iter();
        self.line(&Line {
            settings: settings.as_str().into(),
            cpu_seconds: trial.seconds.to_string().into(),
            counts: trial.counts.as_slice().into(),
            linear: trial.linear.as_slice().into(),
            names: trial.rows.names.as_slice().into(),
            bits: stretches.map(|s| s.iter().map(bits).collect()).collect(),
            zeros: bits(&trial.rows.zeros),
        })?;
        self.done.insert(settings, trial.clone());
        Ok(())
    }

    /// The study has come to its end: nothing is left to go on from.
    pub(super) fn end(self) {
        // A file that cannot be removed is begun anew by the next study.
        let _ = std::fs::remove_file(&self.path);
    }

    fn line(&mut self, line: &impl Serialize) -> Result<(), Error> {
        let text = serde_json::to_string(line).map_err(|e| Error::internal(e.to_string()))?;
        writeln!(self.file, "{text}")
            .map_err(|source| text::Error::unwritable(&self.path, source).into())
    }
}

fn read(path: &Path, identity: &str) -> Result<BTreeMap<String, Trial>, Error> {
    let text = match std::fs::read_to_string(path) {
        Ok(text) => text,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(BTreeMap::new()),
        Err(source) => {
            let path = path.to_owned();
            return Err(text::Error::Unreadable { path, source }.into());
        }
    };
    let mut lines = text.lines();
    let head = lines
        .next()
        .and_then(|l| serde_json::from_str::<Head<'_>>(l).ok());
    if head.is_none_or(|head| head.study != identity) {
        return Err(Error::usage(format!(
            "{}: it belongs to another case or other settings, another version of the program, or \
             other libraries or sidecars; without --resume the study starts anew",
            path.display()
        )));
    }
    let lines = lines.filter_map(|line| serde_json::from_str::<Line<'_>>(line).ok());
    Ok(lines
        .map(|line| {
            let row = |row: Vec<u64>| row.into_iter().map(f64::from_bits).collect();
            let stretch = |stretch: Vec<Vec<u64>>| stretch.into_iter().map(row).collect();
            let trial = Trial {
                rows: Sampled {
                    names: line.names.into_owned(),
                    stretches: line.bits.into_iter().map(stretch).collect(),
                    zeros: row(line.zeros),
                },
                seconds: line.cpu_seconds.parse().unwrap_or(f64::NAN),
                counts: line.counts.into_owned(),
                linear: line.linear.into_owned(),
            };
            (line.settings.into_owned(), trial)
        })
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trial(value: f64) -> Trial {
        Trial {
            rows: Sampled {
                names: vec!["f".to_owned()],
                stretches: vec![vec![vec![value], vec![f64::NAN]]],
                zeros: vec![1e-8],
            },
            seconds: 0.25,
            counts: vec![3, 7],
            linear: vec![true],
        }
    }

    #[test]
    fn what_was_kept_is_found_again_to_the_last_bit() {
        let folder = std::env::temp_dir().join(format!("pilum_kept_{}", std::process::id()));
        let mut kept = Kept::begin(&folder, "this", false).unwrap();
        kept.keep("coarse".to_owned(), &trial(0.1 + 0.2)).unwrap();
        kept.keep("fine".to_owned(), &trial(1e-300)).unwrap();
        drop(kept);
        // The program was killed in the middle of the second one.
        let path = folder.join(FILE_NAME);
        let text = std::fs::read_to_string(&path).unwrap();
        std::fs::write(&path, &text[..text.len() - 9]).unwrap();

        assert!(Kept::begin(&folder, "other", true).is_err());
        let kept = Kept::begin(&folder, "this", true).unwrap();
        let found = kept.find("coarse").unwrap();
        assert_eq!(
            found.rows.stretches[0][0][0].to_bits(),
            (0.1_f64 + 0.2).to_bits()
        );
        assert!(found.rows.stretches[0][1][0].is_nan());
        assert_eq!(found.rows.zeros, [1e-8]);
        assert_eq!(
            (found.seconds, found.counts.as_slice()),
            (0.25, &[3, 7][..])
        );
        assert_eq!(found.linear, [true]);
        assert_eq!((kept.len(), kept.find("fine").is_none()), (1, true));
        kept.end();
        assert!(!path.exists());
        let _ = std::fs::remove_dir_all(folder);
    }
}
