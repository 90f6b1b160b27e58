//! Folders for files that routines write in addition to their results: each worker of a law has a
//! separate one.

use super::printed::say;
use std::io;
use std::os::unix::fs::DirBuilderExt;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU32, Ordering};

/// The folder of a law, with one for each of its workers.
#[derive(Debug)]
pub(super) struct Scratch {
    folder: PathBuf,
    /// Id of the law.
    law: String,
    /// It stays when the law is done with.
    is_kept: bool,
    workers: AtomicU32,
}

impl Scratch {
    /// An empty folder among the temporary files, for this user only.
    ///
    /// # Errors
    /// That of the system.
    pub(super) fn new(law: &str, is_kept: bool) -> io::Result<Self> {
        static NUMBER: AtomicU32 = AtomicU32::new(0);
        loop {
            let number = NUMBER.fetch_add(1, Ordering::Relaxed);
            let name = format!("pilum_{law}_{}_{number}", std::process::id());
            let folder = std::path::absolute(std::env::temp_dir().join(name))?;
            match private().create(&folder) {
                Ok(()) => {
                    return Ok(Self {
                        folder,
                        law: law.to_owned(),
                        is_kept,
                        workers: AtomicU32::new(0),
                    });
                }
                // Of an earlier process with the same number, or not ours.
                Err(why) if why.kind() == io::ErrorKind::AlreadyExists => {}
                Err(why) => return Err(why),
            }
        }
    }

    /// The folder of another worker.
    ///
    /// # Errors
    /// That of the system.
    pub(super) fn of_worker(&self) -> io::Result<PathBuf> {
        let number = self.workers.fetch_add(1, Ordering::Relaxed) + 1;
        let folder = self.folder.join(format!("worker_{number}"));
        private().create(&folder)?;
        Ok(folder)
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        if !self.is_kept {
            let _ = std::fs::remove_dir_all(&self.folder);
            return;
        }
        // Those in which nothing was left.
        for number in 1..=*self.workers.get_mut() {
            let _ = std::fs::remove_dir(self.folder.join(format!("worker_{number}")));
        }
        let (law, folder) = (&self.law, self.folder.display());
        if std::fs::remove_dir(&self.folder).is_ok() {
            say(&format!("law `{law}` left no scratch files"));
        } else {
            say(&format!("scratch files of law `{law}` in {folder}"));
        }
    }
}

fn private() -> std::fs::DirBuilder {
    let mut builder = std::fs::DirBuilder::new();
    builder.mode(0o700);
    builder
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_are_removed_unless_they_are_kept() {
        for (is_kept, writes, remains) in [
            (false, true, false),
            (true, true, true),
            (true, false, false),
        ] {
            let scratch = Scratch::new("test", is_kept).unwrap();
            let folder = scratch.folder.clone();
            let [first, second] = [(); 2].map(|()| scratch.of_worker().unwrap());
            assert_ne!(first, second);
            if writes {
                std::fs::write(second.join("fort.7"), "left").unwrap();
            }
            drop(scratch);
            assert_eq!(folder.exists(), remains);
            assert_eq!(second.join("fort.7").exists(), remains);
            assert!(!first.exists(), "nothing was left there");
            let _ = std::fs::remove_dir_all(folder);
        }
    }
}
