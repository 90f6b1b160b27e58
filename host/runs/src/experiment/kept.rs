//! Computed results, kept in a folder: work that is stopped, or killed, goes on from there.
//!
//! The file has a line for what it belongs to and one for each result. A line that was cut off when the program was
//! killed is a result that is computed again.

use crate::Error;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::fs::{File, TryLockError};
use std::hash::Hash;
use std::io::{Read as _, Seek as _, SeekFrom, Write as _};
use std::path::{Path, PathBuf};
use text::write::begin;

/// Treatment of the results that an earlier call has kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Earlier {
    /// It is forgotten.
    Forget,
    /// It is taken over, but forgotten if it belongs to something else.
    TakeOver,
    /// It is taken over, and an error if it belongs to something else.
    GoOn,
}

/// Results by what they are of; in memory alone without a folder.
#[derive(Debug)]
pub(crate) struct Kept<K, V> {
    file: Option<(PathBuf, File)>,
    done: HashMap<K, V>,
    /// How many of them are of an earlier call.
    pub(crate) of_before: usize,
    /// The folder had those of something else.
    pub(crate) were_others: bool,
}

impl<K, V> Default for Kept<K, V> {
    fn default() -> Self {
        Self {
            file: None,
            done: HashMap::new(),
            of_before: 0,
            were_others: false,
        }
    }
}

/// First line: what must be the same.
#[derive(Serialize, Deserialize)]
struct Head {
    belongs_to: String,
}

#[derive(Serialize)]
struct Line<'a, K, V>(&'a K, &'a V);

impl<K, V> Kept<K, V>
where
    K: Eq + Hash + Serialize + DeserializeOwned,
    V: Serialize + DeserializeOwned,
{
    /// Keeps results in a file of a folder, with what an earlier call has kept there. `doing` says what is done there.
    ///
    /// # Errors
    /// Another process has the file; it cannot be read or written, or belongs to something else.
    pub(crate) fn in_folder(
        folder: &Path,
        (name, doing): (&str, &str),
        identity: &str,
        earlier: Earlier,
    ) -> Result<Self, Error> {
        let path = folder.join(name);
        let unwritable = |source| text::Error::unwritable(&path, source);
        let mut file = open(folder, &path).map_err(unwritable)?;
        if let Err(TryLockError::WouldBlock) = file.try_lock() {
            let message = format!("{}: another process {doing} there", folder.display());
            return Err(Error::usage(message));
        }
        let mut text = Vec::new();
        file.read_to_end(&mut text).map_err(unwritable)?;
        let found = match earlier {
            Earlier::Forget => Some(HashMap::new()),
            _ if text.is_empty() => Some(HashMap::new()),
            _ => read(&text, identity),
        };
        let were_others = found.is_none();
        if were_others && earlier == Earlier::GoOn {
            return Err(Error::usage(format!(
                "{}: it belongs to another case or other settings, another version of the program, or \
                 other libraries or sidecars; without --resume the study starts anew",
                path.display()
            )));
        }
        let found = found.unwrap_or_default();
        // All is written anew: what was cut off, or belongs to something else, is gone.
        file.set_len(0).map_err(unwritable)?;
        file.seek(SeekFrom::Start(0)).map_err(unwritable)?;
        let head = Head {
            belongs_to: identity.to_owned(),
        };
        let mut lines = line(&head)?;
        for (key, value) in &found {
            lines += &line(&Line(key, value))?;
        }
        let mut kept = Self {
            file: Some((path, file)),
            of_before: found.len(),
            done: found,
            were_others,
        };
        kept.write(&lines)?;
        Ok(kept)
    }

    /// What was computed.
    pub(crate) fn find(&self, key: &K) -> Option<&V> {
        self.done.get(key)
    }

    /// How many results there are, of this call and before.
    pub(crate) fn len(&self) -> usize {
        self.done.len()
    }

    /// Keeps what was computed.
    ///
    /// # Errors
    /// [`text::Error::Unwritable`].
    pub(crate) fn keep(&mut self, key: K, value: V) -> Result<(), Error> {
        if self.file.is_some() {
            self.write(&line(&Line(&key, &value))?)?;
        }
        self.done.insert(key, value);
        Ok(())
    }

    /// One call of the system for each line: a kill leaves whole ones.
    fn write(&mut self, lines: &str) -> Result<(), Error> {
        let Some((path, file)) = &mut self.file else {
            return Ok(());
        };
        file.write_all(lines.as_bytes())
            .map_err(|source| text::Error::unwritable(path, source).into())
    }
}

fn line(of: &impl Serialize) -> Result<String, Error> {
    let text = serde_json::to_string(of).map_err(|error| Error::internal(error.to_string()))?;
    Ok(text + "\n")
}

/// The results in a text; `None` if they are of something else.
fn read<K, V>(text: &[u8], identity: &str) -> Option<HashMap<K, V>>
where
    K: Eq + Hash + DeserializeOwned,
    V: DeserializeOwned,
{
    let mut lines = text.split(|&byte| byte == b'\n');
    let head: Head = serde_json::from_slice(lines.next()?).ok()?;
    let lines = lines.filter_map(|line| serde_json::from_slice(line).ok());
    (head.belongs_to == identity).then(|| lines.collect())
}

/// Opens a file to read and write it. Nothing is written through a link.
fn open(folder: &Path, path: &Path) -> std::io::Result<File> {
    let is_plain = path.symlink_metadata().is_ok_and(|found| found.is_file());
    if is_plain {
        return File::options().read(true).write(true).open(path);
    }
    std::fs::create_dir_all(folder)?;
    begin(path)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiment::{Counts, Rows, Trial};

    const FILE: (&str, &str) = ("results.jsonl", "works");

    fn trial(value: f64) -> Trial {
        Trial {
            rows: Rows {
                names: vec!["f".to_owned()],
                stretches: vec![vec![vec![value], vec![f64::NAN]]],
                zeros: vec![1e-8],
            },
            seconds: 0.25,
            counts: Counts {
                iterations: 3,
                cut_backs: 7,
                ..Counts::default()
            },
            linear: vec![true],
        }
    }

    #[test]
    fn what_was_kept_is_found_again_to_the_last_bit() {
        let folder = std::env::temp_dir().join(format!("pilum_kept_{}", std::process::id()));
        let open = |identity, earlier| Kept::in_folder(&folder, FILE, identity, earlier);
        let mut kept = open("this", Earlier::TakeOver).unwrap();
        kept.keep("coarse".to_owned(), trial(0.1 + 0.2)).unwrap();
        kept.keep("fine".to_owned(), trial(1e-300)).unwrap();
        let other = open("this", Earlier::TakeOver).unwrap_err();
        assert!(other.to_string().ends_with("another process works there"));
        drop(kept);
        // The program was killed in the middle of the second one.
        let path = folder.join(FILE.0);
        let text = std::fs::read_to_string(&path).unwrap();
        std::fs::write(&path, &text[..text.len() - 9]).unwrap();

        assert!(open("other", Earlier::GoOn).is_err());
        let kept = open("this", Earlier::GoOn).unwrap();
        assert_eq!((kept.of_before, kept.len()), (1, 1));
        let found = kept.find(&"coarse".to_owned()).unwrap();
        let rows = &found.rows.stretches[0];
        assert_eq!(rows[0][0].to_bits(), (0.1_f64 + 0.2).to_bits());
        assert!(rows[1][0].is_nan());
        assert_eq!(found.rows.zeros, [1e-8]);
        assert_eq!(found.seconds.to_bits(), 0.25_f64.to_bits());
        assert_eq!((found.counts.iterations, found.counts.cut_backs), (3, 7));
        assert_eq!(found.linear, [true]);
        assert!(kept.find(&"fine".to_owned()).is_none());
        drop(kept);
        for (identity, earlier, others) in [
            ("this", Earlier::Forget, false),
            ("other", Earlier::TakeOver, true),
        ] {
            let kept = open(identity, earlier).unwrap();
            assert_eq!((kept.len(), kept.were_others), (0, others));
        }
        let _ = std::fs::remove_dir_all(folder);
    }
}
