//! Checkpoints of a run.

use super::Options;
use mechanics::State;
use results::{Checkpoint, Recorder};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// After a checkpoint a run goes on for this many times what it took: a large state is not written over and over.
/// Not where one is wanted after every increment.
const AT_LEAST: u32 = 20;

/// Writes the checkpoints of a run.
pub(super) struct Keeper {
    identity: String,
    folder: PathBuf,
    options: Options,
    last: Instant,
    /// How long the last one took.
    took: Duration,
}

impl Keeper {
    /// Checkpoints in this folder.
    pub(super) fn new(identity: String, folder: &Path, options: Options) -> Self {
        Self {
            identity,
            folder: folder.to_owned(),
            options,
            last: Instant::now(),
            took: Duration::ZERO,
        }
    }

    /// Content of the folder's checkpoint, if it exists and the run is to go on from it.
    pub(super) fn found(&self) -> Result<Option<Checkpoint<'static>>, text::Error> {
        if !self.options.resume {
            return Ok(None);
        }
        Checkpoint::read(&self.folder, &self.identity)
    }

    /// Whether it is time for another checkpoint.
    pub(super) fn is_due(&self) -> bool {
        let pause = |every: Duration| match every {
            Duration::ZERO => every,
            _ => every.max(AT_LEAST * self.took),
        };
        let every = self.options.checkpoints;
        every.is_some_and(|every| self.last.elapsed() >= pause(every))
    }

    pub(super) fn keep(
        &mut self,
        state: &State<'_>,
        results: &Recorder,
        warnings: &[String],
    ) -> Result<(), text::Error> {
        if self.options.checkpoints.is_some() {
            let start = Instant::now();
            let so_far = results.state()?;
            Checkpoint::new(&self.identity, so_far, warnings, Some(state)).write(&self.folder)?;
            self.last = Instant::now();
            self.took = self.last - start;
        }
        Ok(())
    }

    /// The last checkpoint: there is nothing left to do.
    pub(super) fn end(&self, results: &Recorder, warnings: &[String]) -> Result<(), text::Error> {
        if self.options.checkpoints.is_some() && !self.options.ends_without {
            let so_far = results.state()?;
            Checkpoint::new(&self.identity, so_far, warnings, None).write(&self.folder)?;
        }
        Ok(())
    }
}
