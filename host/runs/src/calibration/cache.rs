//! Computations that are done, kept next to the results: a calibration that is stopped, or killed, goes on from
//! them.
//!
//! The search takes the same way every time. So nothing of the search itself is kept, but what each
//! computation of a test came to: the same command takes the same way again, for nothing as far as it
//! has gone before. The file has a line for what it belongs to and one for each computation. A line that
//! was cut off when the program was killed is a computation that is made again.

use crate::Error;
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::fs::{File, TryLockError};
use std::io::{Read as _, Seek as _, SeekFrom, Write as _};
use std::path::{Path, PathBuf};
use text::write::begin;

/// Name of the file in the folder of a calibration.
pub(super) const FILE_NAME: &str = "computations.jsonl";

/// What was computed of a test: values at its measured points, or their derivatives by the values of some parameters.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub(super) struct Key {
    pub(super) test: usize,
    /// Values of its parameters, by their bits.
    pub(super) at: Vec<u64>,
    /// The parameters that derivatives are by; none of values.
    pub(super) by: Vec<usize>,
}

/// A column of values for each parameter, one of values; or why none exist.
pub(super) type Columns = Result<Vec<Vec<f64>>, String>;

/// First line: what must be the same.
#[derive(Serialize, Deserialize)]
struct Head {
    calibration: String,
}

/// A computation. Values are written by their bits, so that what is read is what was computed.
#[derive(Serialize, Deserialize)]
struct Line {
    key: Key,
    bits: Result<Vec<Vec<u64>>, String>,
}

/// The computations of one calibration.
#[derive(Debug, Default)]
pub(super) struct Kept {
    file: Option<(PathBuf, File)>,
    done: HashMap<Key, Columns>,
    /// How many of them are of an earlier call.
    pub(super) of_before: usize,
    /// The folder had those of something else.
    pub(super) were_others: bool,
}

impl Kept {
    /// Takes over what an earlier call has kept in this folder, and keeps what is computed from now on, what
    /// was computed before in this call, too.
    ///
    /// # Errors
    /// Another process has the file; it cannot be read or written.
    pub(super) fn in_folder(
        &mut self,
        folder: &Path,
        identity: &str,
        anew: bool,
    ) -> Result<(), Error> {
        let path = folder.join(FILE_NAME);
        let unwritable = |source| text::Error::unwritable(&path, source);
        // Nothing is written through a link.
        let is_plain = path.symlink_metadata().is_ok_and(|found| found.is_file());
        let mut file = if is_plain {
            let mut options = File::options();
            options.read(true).write(true).open(&path)
        } else {
            std::fs::create_dir_all(folder).map_err(unwritable)?;
            begin(&path)
        }
        .map_err(unwritable)?;
        if let Err(TryLockError::WouldBlock) = file.try_lock() {
            let message = format!("{}: another process calibrates there", folder.display());
            return Err(Error::usage(message));
        }
        let mut text = Vec::new();
        file.read_to_end(&mut text).map_err(unwritable)?;
        let earlier = if anew { None } else { read(&text, identity) };
        self.were_others = earlier.is_none() && !anew && !text.is_empty();
        let earlier = earlier.unwrap_or_default();
        // All is written anew: what was cut off, or belongs to something else, is gone.
        file.set_len(0).map_err(unwritable)?;
        file.seek(SeekFrom::Start(0)).map_err(unwritable)?;
        self.file = Some((path, file));
        let own = std::mem::take(&mut self.done);
        self.of_before = earlier.len();
        let head = Head {
            calibration: identity.to_owned(),
        };
        let mut lines = line(&head)?;
        self.done.extend(earlier);
        self.done.extend(own);
        for (key, columns) in &self.done {
            lines += &line_of(key, columns)?;
        }
        self.write(&lines)
    }

    /// What was computed.
    pub(super) fn find(&self, key: &Key) -> Option<&Columns> {
        self.done.get(key)
    }

    /// How many computations there are, in this call and before.
    pub(super) fn len(&self) -> usize {
        self.done.len()
    }

    /// Keeps what was computed.
    ///
    /// # Errors
    /// [`text::Error::Unwritable`].
    pub(super) fn keep(&mut self, key: Key, columns: Columns) -> Result<(), Error> {
        if self.file.is_some() {
            let line = line_of(&key, &columns)?;
            self.write(&line)?;
        }
        self.done.insert(key, columns);
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

/// Removes the file: the calibration has come to its end.
pub(super) fn remove(folder: &Path) {
    // What cannot be removed is taken over by the next call, which finds the same with it.
    let _ = std::fs::remove_file(folder.join(FILE_NAME));
}

fn line(of: &impl Serialize) -> Result<String, Error> {
    let text = serde_json::to_string(of).map_err(|error| Error::internal(error.to_string()))?;
    Ok(text + "\n")
}

fn line_of(key: &Key, columns: &Columns) -> Result<String, Error> {
    let bits = |column: &Vec<f64>| column.iter().map(|value| value.to_bits()).collect();
    line(&Line {
        key: key.clone(),
        bits: columns
            .as_ref()
            .map(|columns| columns.iter().map(bits).collect())
            .map_err(Clone::clone),
    })
}

/// The computations in a text; `None` if they are of something else.
fn read(text: &[u8], identity: &str) -> Option<HashMap<Key, Columns>> {
    let mut lines = text.split(|&byte| byte == b'\n');
    let head: Head = serde_json::from_slice(lines.next()?).ok()?;
    let lines = lines.filter_map(|line| serde_json::from_slice::<Line>(line).ok());
    let column = |bits: Vec<u64>| bits.into_iter().map(f64::from_bits).collect();
    let columns = |line: Line| {
        let columns = line.bits.map(|all| all.into_iter().map(column).collect());
        (line.key, columns)
    };
    (head.calibration == identity).then(|| lines.map(columns).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(value: f64) -> Key {
        Key {
            test: 1,
            at: vec![value.to_bits()],
            by: Vec::new(),
        }
    }

    #[test]
    fn what_was_kept_is_found_again_to_the_last_bit() {
        let name = format!("pilum_computations_{}", std::process::id());
        let folder = std::env::temp_dir().join(name);
        let mut kept = Kept::default();
        // Before it has a folder.
        kept.keep(key(0.5), Err("no equilibrium".to_owned()))
            .unwrap();
        kept.in_folder(&folder, "this", false).unwrap();
        let columns = vec![vec![0.1 + 0.2, f64::NAN], vec![1e-300, -0.0]];
        kept.keep(key(1.0), Ok(columns.clone())).unwrap();
        kept.keep(key(2.0), Ok(columns.clone())).unwrap();
        let other = Kept::default().in_folder(&folder, "this", false);
        assert!(other.unwrap_err().to_string().contains("another process"));
        drop(kept);
        // The program was killed in the middle of the last one.
        let path = folder.join(FILE_NAME);
        let text = std::fs::read(&path).unwrap();
        let last = text.len() - 20;
        std::fs::write(&path, &text[..last]).unwrap();
        let mut kept = Kept::default();
        kept.in_folder(&folder, "this", false).unwrap();
        assert_eq!((kept.of_before, kept.len()), (2, 2));
        assert_eq!(
            kept.find(&key(0.5)),
            Some(&Err("no equilibrium".to_owned()))
        );
        let bits =
            |all: &[Vec<f64>]| -> Vec<u64> { all.concat().iter().map(|v| v.to_bits()).collect() };
        let found = kept.find(&key(1.0)).unwrap().as_ref().unwrap();
        assert_eq!(bits(found), bits(&columns));
        assert_eq!(kept.find(&key(2.0)), None);
        drop(kept);
        for (identity, anew, others) in [("this", true, false), ("other", false, true)] {
            let mut kept = Kept::default();
            kept.in_folder(&folder, identity, anew).unwrap();
            assert_eq!((kept.len(), kept.were_others), (0, others));
        }
        remove(&folder);
        assert!(!path.exists());
        let _ = std::fs::remove_dir_all(folder);
    }
}
