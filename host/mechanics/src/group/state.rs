//! What a group carries from one increment to the next: taken, held against the group, and taken up again.

use super::broken_bonds::Bond;
use super::water::Pores;
use super::{Field, Group, LawCalls, Origin};
use crate::problem::Material;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

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
            tangent: with_tangents.then(|| (&self.tangent).into()),
            pores: self.pores.as_ref().map(Cow::Borrowed),
            origin: self.origin,
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
        if state.strain.len() != self.strain.committed.len()
            || state.stress.len() != self.stress.committed.len()
            || !(state.correction.is_empty() || state.correction.len() == state.stress.len())
            || state.internal.len() != n_internal
            || state.jump.len() != jump.len()
            || state.stiffness.len() != stiffness.len()
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
            if tangent.len() != self.tangent.len() {
                return Err(format!("the state is not that of group `{}`", self.name));
            }
            self.tangent = tangent.into_owned();
        }
        self.law_calls = state.law_calls.into_owned();
        self.origin = state.origin;
        self.bond = state.bond;
        self.forget_trial();
        Ok(())
    }
}
