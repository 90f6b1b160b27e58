//! The checkpoints of a run: when they are written, and what a run is made of.

use super::Run;
use crate::checkpoint::{Checkpoint, PhaseCourse, RunState};
use crate::error::Error;
use crate::group::{Group, GroupLaw};
use crate::output::Results;
use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Writes the checkpoints of a run.
pub(super) struct Keeper {
    identity: String,
    folder: PathBuf,
    every: Option<Duration>,
    last: Instant,
}

impl Keeper {
    /// Checkpoints in this folder, this long after one another; `None`: there are none.
    pub(super) fn new(identity: String, folder: &Path, every: Option<Duration>) -> Self {
        Self {
            identity,
            folder: folder.to_owned(),
            every,
            last: Instant::now(),
        }
    }

    /// What the folder's checkpoint holds, if there is one.
    ///
    /// # Errors
    /// It is damaged, or belongs to another run.
    pub(super) fn found(&self) -> Result<Option<Checkpoint<'static>>, Error> {
        Checkpoint::read(&self.folder, &self.identity)
    }

    /// Whether it is time for another checkpoint.
    pub(super) fn is_due(&self) -> bool {
        self.every.is_some_and(|every| self.last.elapsed() >= every)
    }

    pub(super) fn keep(
        &mut self,
        run: RunState<'_>,
        results: &Results,
        warnings: &[String],
    ) -> Result<(), Error> {
        if self.every.is_some() {
            let state = results.state()?;
            Checkpoint::new(&self.identity, state, warnings, Some(run)).write(&self.folder)?;
            self.last = Instant::now();
        }
        Ok(())
    }

    /// The last checkpoint: there is nothing left to do.
    pub(super) fn end(&self, results: &Results, warnings: &[String]) -> Result<(), Error> {
        if self.every.is_some() {
            let state = results.state()?;
            Checkpoint::new(&self.identity, state, warnings, None).write(&self.folder)?;
        }
        Ok(())
    }
}

impl Run<'_> {
    /// The state after a whole increment of a phase.
    pub(super) fn state<'s>(&'s self, phase: usize, course: &'s PhaseCourse) -> RunState<'s> {
        let state = |group: &'s Group| group.state(course.has_matrix);
        RunState {
            phase,
            groups: self.groups.iter().map(state).collect(),
            displacement: (&self.displacement).into(),
            prescribed: Cow::Borrowed(&self.prescribed),
            pressure: Cow::Borrowed(&self.pressure),
            force: (&self.force).into(),
            time: self.time,
            largest_force: self.largest_force,
            course: Cow::Borrowed(course),
        }
    }

    /// Takes over a state that [`Self::state`] gave. Returns where its phase stands.
    pub(super) fn restore(&mut self, state: RunState<'_>) -> Result<PhaseCourse, Error> {
        let n_dofs = self.displacement.len();
        let course = &state.course;
        let sizes = [
            &state.displacement[..],
            &state.force,
            &course.loads.force_start,
        ];
        if state.groups.len() != self.groups.len() || sizes.iter().any(|v| v.len() != n_dofs) {
            let message = "the checkpoint is not that of this mesh; run without --resume";
            return Err(Error::Usage(message.to_owned()));
        }
        let groups = self.groups.iter_mut().zip(state.groups).enumerate();
        for (number, (group, state)) in groups {
            let swaps = self.model.swaps.iter().flatten();
            let laws = swaps.filter(|(g, _)| *g == number);
            let laws: Vec<GroupLaw> = laws.map(|(_, law)| law.clone()).collect();
            group.restore(state, &laws).map_err(Error::Internal)?;
        }
        self.displacement = state.displacement.into_owned();
        self.prescribed = state.prescribed.into_owned();
        self.pressure = state.pressure.into_owned();
        self.force = state.force.into_owned();
        self.time = state.time;
        self.largest_force = state.largest_force;
        self.largest_forces.clone_from(&state.course.loads.largest);
        Ok(state.course.into_owned())
    }
}
