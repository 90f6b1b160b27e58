//! The state of a group: strains, stresses and internal variables of all points, before and during an increment; what
//! the group carries from one increment to the next, taken, held against the group, and taken up again.

mod probed_elements;
mod set_aside;

pub use probed_elements::Excerpted;
pub use set_aside::Aside;

use super::diagnosis::Bond;
use super::integration::{LawCalls, Origin, Pores};
use super::{Group, PER_TASK};
use crate::problem::Material;
use algebra::threads;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// Copies values of points.
pub(super) fn copy(from: &[f64], to: &mut [f64]) {
    let pieces = to.chunks_mut(4 * PER_TASK).zip(from.chunks(4 * PER_TASK));
    threads::each(pieces, |(to, from)| to.copy_from_slice(from));
}

/// Values of all points, before and during an increment.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Field {
    /// At the start of the increment.
    pub committed: Vec<f64>,
    /// As of the last iteration; empty before the first one of a phase.
    #[serde(skip)]
    pub trial: Vec<f64>,
}

impl Field {
    pub(in crate::group) fn new(committed: Vec<f64>) -> Self {
        Self {
            committed,
            trial: Vec::new(),
        }
    }

    /// Makes room for a trial state.
    pub(in crate::group) fn begin(&mut self) {
        if self.trial.len() != self.committed.len() {
            self.trial.clone_from(&self.committed);
        }
    }

    pub(in crate::group) fn commit(&mut self) {
        if !self.trial.is_empty() {
            copy(&self.trial, &mut self.committed);
        }
    }

    pub(in crate::group) fn forget_trial(&mut self) {
        self.trial = Vec::new();
    }
}

/// Committed state of a group: strains, stresses, internal variables, jumps of a layer, and pore
/// pressures.
#[derive(Clone, Debug)]
pub struct Committed(Vec<Vec<f64>>);

/// Bytes that a group keeps for its points.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Bytes {
    /// Strains, before and during an increment; of a thin layer also jumps.
    pub strain: usize,
    /// Stresses, before and during an increment.
    pub stress: usize,
    /// Internal variables, before and during an increment.
    pub internal: usize,
    /// Tangents.
    pub tangents: usize,
}

/// What a group carries from one increment to the next.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct GroupState<'g> {
    /// Name of the law in the case file.
    law: Cow<'g, str>,
    #[serde(with = "crate::numbers")]
    strain: Cow<'g, [f64]>,
    #[serde(with = "crate::numbers")]
    stress: Cow<'g, [f64]>,
    correction: Cow<'g, [f64]>,
    #[serde(with = "crate::numbers")]
    internal: Cow<'g, [f64]>,
    jump: Cow<'g, [f64]>,
    /// Elastic stiffnesses of a thin layer, of the stresses that its law started from.
    stiffness: Cow<'g, [[f64; 2]]>,
    law_calls: Cow<'g, [LawCalls]>,
    /// Tangents, where a matrix made of them is still in use.
    tangent: Option<Cow<'g, [f64]>>,
    pores: Option<Cow<'g, Pores>>,
    /// Stress-free strain.
    swelling: Option<Cow<'g, [f64]>>,
    origin: Origin,
    bond: Bond,
}

impl GroupState<'_> {
    /// A copy that borrows nothing from the group.
    pub fn into_owned(self) -> GroupState<'static> {
        GroupState {
            law: Cow::Owned(self.law.into_owned()),
            strain: Cow::Owned(self.strain.into_owned()),
            stress: Cow::Owned(self.stress.into_owned()),
            correction: Cow::Owned(self.correction.into_owned()),
            internal: Cow::Owned(self.internal.into_owned()),
            jump: Cow::Owned(self.jump.into_owned()),
            stiffness: Cow::Owned(self.stiffness.into_owned()),
            law_calls: Cow::Owned(self.law_calls.into_owned()),
            tangent: self.tangent.map(|tangent| Cow::Owned(tangent.into_owned())),
            pores: self.pores.map(|pores| Cow::Owned(pores.into_owned())),
            swelling: self.swelling.map(|strain| Cow::Owned(strain.into_owned())),
            origin: self.origin,
            bond: self.bond,
        }
    }
}

impl Group {
    /// The committed state; with the tangents of the last evaluation if they are wanted.
    pub fn state(&self, with_tangents: bool) -> GroupState<'_> {
        let (jump, stiffness) = self.of_layer();
        GroupState {
            law: (&self.law.name).into(),
            strain: (&self.strain.committed).into(),
            stress: (&self.stress.committed).into(),
            correction: (&self.correction).into(),
            internal: (&self.internal.committed).into(),
            jump: jump.into(),
            stiffness: stiffness.into(),
            law_calls: (&self.law_calls).into(),
            tangent: with_tangents.then(|| (&self.tangents.values).into()),
            pores: self.pores.as_ref().map(Cow::Borrowed),
            swelling: self.swelling.as_ref().map(|s| (&s.strain.committed).into()),
            origin: self.tangents.origin,
            bond: self.bond,
        }
    }

    /// Jumps of a thin layer, and its elastic stiffnesses; nothing of other groups.
    fn of_layer(&self) -> (&[f64], &[[f64; 2]]) {
        self.layer.as_ref().map_or((&[], &[]), |layer| {
            (&layer.jump.committed[..], &layer.stiffness[..])
        })
    }

    /// The law that a state names, if the state is one of this group.
    ///
    /// # Errors
    /// It is not, in words.
    pub fn check(&self, state: &GroupState<'_>, laws: &[Material]) -> Result<Material, String> {
        let wrong = || format!("the state is not that of group `{}`", self.name);
        let known = laws.iter().chain([&self.law]);
        let law = known.into_iter().find(|law| law.name == state.law);
        let law = law.cloned().ok_or_else(wrong)?;
        let n_internal = self.kinematics.n_points() * law.built.law.n_states();
        let (jump, stiffness) = self.of_layer();
        let swelling = self.swelling.as_ref();
        let swelling = swelling.map(|swelling| swelling.strain.committed.len());
        if state.strain.len() != self.strain.committed.len()
            || state.stress.len() != self.stress.committed.len()
            || !(state.correction.is_empty() || state.correction.len() == state.stress.len())
            || state.internal.len() != n_internal
            || state.jump.len() != jump.len()
            || state.stiffness.len() != stiffness.len()
            || state.swelling.as_ref().map(|strain| strain.len()) != swelling
        {
            return Err(wrong());
        }
        Ok(law)
    }

    /// Takes over a state that [`Self::state`] gave, with the law it names (`laws`: those that the
    /// group carries in the course of the case).
    ///
    /// # Errors
    /// The state is not that of this group, or its law has no elastic operator.
    pub fn restore(&mut self, state: GroupState<'_>, laws: &[Material]) -> Result<(), String> {
        let law = self.check(&state, laws)?;
        self.stress = Field::new(state.stress.into_owned());
        self.correction = state.correction.into_owned();
        self.pores = state.pores.map(Cow::into_owned);
        if let (Some(own), Some(strain)) = (&mut self.swelling, state.swelling) {
            own.strain = Field::new(strain.into_owned());
        }
        self.start_law(law, Some(state.internal.to_vec()))
            .map_err(|failure| failure.to_string())?;
        // Initial values that the case file gives held at the start of the law only.
        self.internal = Field::new(state.internal.into_owned());
        self.strain = Field::new(state.strain.into_owned());
        if let Some(layer) = &mut self.layer {
            layer.jump = Field::new(state.jump.into_owned());
            layer.stiffness = state.stiffness.into_owned();
        }
        if let Some(tangent) = state.tangent {
            if tangent.len() != self.tangents.values.len() {
                return Err(format!("the state is not that of group `{}`", self.name));
            }
            self.tangents.values = tangent.into_owned();
        }
        self.law_calls = state.law_calls.into_owned();
        self.tangents.origin = state.origin;
        self.bond = state.bond;
        self.forget_trial();
        Ok(())
    }

    /// Makes the trial state the committed one.
    pub fn commit(&mut self) {
        self.fields().for_each(Field::commit);
    }

    /// The committed state of all points, to be restored.
    pub fn committed(&self) -> Committed {
        let jump = self.layer.as_ref().map(|layer| &layer.jump);
        let excess = self.pores.as_ref().map(|pores| &pores.excess);
        let own = [&self.strain, &self.stress, &self.internal];
        let swelling = self.swelling.as_ref().map(|swelling| &swelling.strain);
        let fields = own.into_iter().chain(jump).chain(excess).chain(swelling);
        Committed(fields.map(|field| field.committed.clone()).collect())
    }

    /// Takes a committed state back.
    pub fn restore_committed(&mut self, committed: Committed) {
        for (field, committed) in self.fields().zip(committed.0) {
            field.committed = committed;
        }
    }

    /// Gives up the room of the trial state until the next one is computed.
    pub fn forget_trial(&mut self) {
        self.is_asked = false;
        self.fields().for_each(Field::forget_trial);
    }

    pub(super) fn fields(&mut self) -> impl Iterator<Item = &mut Field> {
        let jump = self.layer.as_mut().map(|layer| &mut layer.jump);
        let excess = self.pores.as_mut().map(|pores| &mut pores.excess);
        let others = [&mut self.strain, &mut self.stress, &mut self.internal];
        let swelling = self.swelling.as_mut().map(|swelling| &mut swelling.strain);
        others.into_iter().chain(jump).chain(excess).chain(swelling)
    }

    /// What the group keeps for its points. A trial state as large comes and goes.
    pub fn bytes(&self) -> Bytes {
        let field = |field: &Field| size_of_val(&*field.committed);
        let jumps = self.layer.as_ref().map_or(0, |layer| field(&layer.jump));
        Bytes {
            strain: field(&self.strain) + jumps,
            stress: field(&self.stress),
            internal: field(&self.internal),
            tangents: size_of_val(&*self.tangents.values),
        }
    }
}
