//! All that a simulation needs to go on from a whole increment as if it had never stopped.

use super::loads::Prescribed;
use super::{History, PhaseRecord, Simulation, UnderWay};
use crate::equilibrium::{Loads, Standing};
use crate::error::Error;
use crate::ground::Loading;
use crate::group::{Group, GroupState};
use crate::problem::Material;
use crate::settings::Method;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::collections::BTreeMap;

/// State of a simulation after a whole increment, or where one could not be finished. Copies are independent of each
/// other.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct State<'s> {
    /// Number of the phase, from 0.
    pub phase: usize,
    groups: Vec<GroupState<'s>>,
    #[serde(with = "crate::numbers")]
    displacement: Cow<'s, [f64]>,
    prescribed: Cow<'s, BTreeMap<usize, f64>>,
    loading: Cow<'s, [Loading; 2]>,
    #[serde(with = "crate::numbers")]
    force: Cow<'s, [f64]>,
    #[serde(with = "crate::numbers")]
    reaction: Cow<'s, [f64]>,
    /// Time at the start of the phase.
    time: f64,
    largest_force: f64,
    #[serde(with = "crate::numbers")]
    largest_forces: Cow<'s, [f64]>,
    course: Cow<'s, PhaseCourse>,
}

/// Progress of a phase.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct PhaseCourse {
    /// Loads of the phase.
    pub(super) loads: Loads,
    /// Whole increments done.
    pub(super) increment: usize,
    /// Load factor reached.
    pub(super) lambda: f64,
    /// Length of the next step.
    pub(super) step: f64,
    /// The last steps.
    pub(super) history: History,
    /// State of the condensed domain.
    pub(super) domain: Option<Standing>,
    /// A matrix of the groups' tangents is in use.
    pub(super) has_matrix: bool,
    /// Largest entry of the last matrix, whether it is in use or not.
    pub(super) largest: f64,
    /// The phase so far.
    pub(super) record: PhaseRecord,
    /// The current leg of the phase's course.
    pub(super) leg: usize,
    /// Prescribed displacements over the whole phase.
    pub(super) prescribed: Vec<Prescribed>,
    /// Difference between tied displacements and those that they follow.
    pub(super) offsets: Vec<f64>,
    /// The quantity that may end the phase, at its start and now, where it is there.
    pub(super) measured: Option<[f64; 2]>,
    /// Steps taken back for its sake.
    pub(super) taken_back: usize,
    /// It has ended the phase.
    pub(super) is_over: bool,
}

impl State<'_> {
    /// Whole increments of the phase that are done.
    pub fn increment(&self) -> usize {
        self.course.increment
    }

    /// How much of the phase is done, 0 to 1. After an increment that could not be finished it is more than that of the
    /// whole ones: the state is the last one in equilibrium.
    pub fn part_of_phase(&self) -> f64 {
        self.course.lambda
    }

    /// Steps taken back for the sake of the quantity that may end the phase.
    pub(super) fn taken_back(&self) -> usize {
        self.course.taken_back
    }

    /// One more, with what the phase has cost.
    pub(super) fn take_back_again(&mut self, record: PhaseRecord) {
        let course = self.course.to_mut();
        course.taken_back += 1;
        course.record = record;
    }

    /// A copy that borrows nothing from the simulation.
    pub fn into_owned(self) -> State<'static> {
        State {
            phase: self.phase,
            groups: self
                .groups
                .into_iter()
                .map(GroupState::into_owned)
                .collect(),
            displacement: Cow::Owned(self.displacement.into_owned()),
            prescribed: Cow::Owned(self.prescribed.into_owned()),
            loading: Cow::Owned(self.loading.into_owned()),
            force: Cow::Owned(self.force.into_owned()),
            reaction: Cow::Owned(self.reaction.into_owned()),
            time: self.time,
            largest_force: self.largest_force,
            largest_forces: Cow::Owned(self.largest_forces.into_owned()),
            course: Cow::Owned(self.course.into_owned()),
        }
    }
}

impl UnderWay {
    /// Completes what its course says of its equations.
    pub(super) fn note_course(&mut self, method: Method) {
        let (equations, course) = (&self.equations, &mut self.course);
        course.domain = equations.domain.as_ref().map(|d| d.standing().clone());
        course.has_matrix = equations.matrix.is_kept(method);
        course.largest = equations.matrix.largest();
        course.record = equations.counted_in(&self.record);
    }
}

impl Simulation {
    /// The present state, from the end of the first increment on: after the last whole increment, or the last one in
    /// equilibrium on the way through one that could not be finished. `None` before.
    pub fn state(&mut self) -> Option<State<'static>> {
        self.note_course();
        let state = self.borrowed_state().map(State::into_owned);
        self.forget_course();
        state
    }

    /// Completes what the course of the phase says of its equations.
    pub(super) fn note_course(&mut self) {
        let method = self.settings().method;
        if let Some(phase) = &mut self.under_way {
            phase.note_course(method);
        }
    }

    /// Gives up the copy that [`Self::note_course`] made.
    pub(super) fn forget_course(&mut self) {
        if let Some(phase) = &mut self.under_way {
            phase.course.domain = None;
        }
    }

    /// The state, after [`Self::note_course`].
    pub(super) fn borrowed_state(&self) -> Option<State<'_>> {
        let phase = self.under_way.as_ref().filter(|p| p.course.increment > 0)?;
        Some(self.state_in(phase))
    }

    /// The state in a phase whose course is complete.
    pub(super) fn state_in<'s>(&'s self, phase: &'s UnderWay) -> State<'s> {
        let has_matrix = phase.course.has_matrix;
        State {
            phase: phase.number,
            groups: self.groups.iter().map(|g| g.state(has_matrix)).collect(),
            displacement: (&self.displacement).into(),
            prescribed: Cow::Borrowed(&self.prescribed),
            loading: Cow::Borrowed(&self.loading),
            force: (&self.force).into(),
            reaction: (&self.reaction).into(),
            time: self.time,
            largest_force: self.largest_force,
            largest_forces: (&self.largest_forces).into(),
            course: Cow::Borrowed(&phase.course),
        }
    }

    /// Goes back, or on, to a state of a simulation of the same problem.
    ///
    /// # Errors
    /// [`Error::OtherState`] if it is of another problem; [`Error::Singular`].
    pub fn go_to(&mut self, state: State<'_>) -> Result<(), Error> {
        let n_dofs = self.displacement.len();
        let course = &state.course;
        let sizes = [
            &state.displacement[..],
            &state.force,
            &state.reaction,
            &state.largest_forces,
            &course.loads.force_start,
        ];
        let is_other = state.phase >= self.problem.phases.len()
            || state.groups.len() != self.groups.len()
            || sizes.iter().any(|v| v.len() != n_dofs)
            || course.increment > self.problem.phases[state.phase].increments;
        if is_other {
            let message = "the checkpoint is not that of this mesh; run without --resume";
            return Err(Error::OtherState(message.to_owned()));
        }
        let laws_of = |number: usize| -> Vec<Material> {
            let swaps = self.swaps.iter().flatten();
            let laws = swaps.filter(|(g, _)| *g == number);
            let first = self.first_materials[number].clone();
            laws.map(|(_, law)| law.clone()).chain([first]).collect()
        };
        let laws: Vec<Vec<Material>> = (0..self.groups.len()).map(laws_of).collect();
        // All of it fits, or nothing is touched.
        for (number, (group, state)) in self.groups.iter().zip(&state.groups).enumerate() {
            group
                .check(state, &laws[number])
                .map_err(Error::OtherState)?;
        }
        self.under_way = None;
        let groups = self.groups.iter_mut().zip(state.groups).enumerate();
        for (number, (group, state)) in groups {
            group
                .restore(state, &laws[number])
                .map_err(Error::OtherState)?;
        }
        self.displacement = state.displacement.into_owned();
        self.prescribed = state.prescribed.into_owned();
        self.loading = state.loading.into_owned();
        for (group, &is_active) in self.groups.iter_mut().zip(&self.loading[1].active) {
            group.is_active = is_active;
        }
        // What follows from them is found anew.
        let own = state.course.prescribed.iter().copied();
        let own = own
            .filter(|(dof, ..)| self.prescribed.contains_key(dof))
            .collect();
        let tied = self.tied_in(state.phase, own)?;
        (self.tied, self.led) = (tied.ties, tied.led);
        self.force = state.force.into_owned();
        self.reaction = state.reaction.into_owned();
        self.has_failed = false;
        self.time = state.time;
        self.largest_force = state.largest_force;
        self.largest_forces = state.largest_forces.into_owned();
        self.groups.iter_mut().for_each(Group::forget_trial);
        self.note_bodies(state.phase, &state.course);
        self.resume_phase(state.phase, state.course.into_owned())
    }
}
