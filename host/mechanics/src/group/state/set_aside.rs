//! The state of a group, put aside while another step is tried from the same start.

use crate::group::{Field, Group};

/// State of a group after a step: committed and trial values of all fields, and tangents.
#[derive(Debug)]
pub struct Aside {
    fields: Vec<Field>,
    tangent: Vec<f64>,
}

impl Group {
    /// A copy of the committed and the trial state.
    pub fn put_aside(&mut self) -> Aside {
        Aside {
            fields: self.fields().map(|field| field.clone()).collect(),
            tangent: self.tangents.values.clone(),
        }
    }

    /// Takes the copy back.
    pub fn take_back(&mut self, aside: Aside) {
        for (field, kept) in self.fields().zip(aside.fields) {
            *field = kept;
        }
        self.tangents.values = aside.tangent;
    }

    /// Adds the nodal forces of the committed state.
    pub fn add_carried(&mut self, forces: &mut [f64]) {
        self.kinematics.add_forces(&self.carried(), forces);
    }

    /// Adds the nodal forces of the trial state, as they would be if it were committed.
    pub fn add_trial_forces(&mut self, forces: &mut [f64]) {
        let committed = self.committed();
        self.commit();
        self.add_carried(forces);
        self.restore_committed(committed);
    }
}
