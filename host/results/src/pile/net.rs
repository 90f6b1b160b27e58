//! Net forces: the change of a pile's forces since the last phase with `reset_displacements`.

use super::State;
use mechanics::Problem;
use serde::{Deserialize, Serialize};

/// Forces of a pile in one state.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Forces {
    /// Loads of head, shaft and base, kN.
    loads: [f64; 3],
    /// Axial force and shaft friction by row.
    rows: Vec<[f64; 2]>,
}

impl Forces {
    fn of(state: &State) -> Self {
        let stations = state.stations.iter();
        let row =
            |station: &super::Station| [station.axial_force, station.shaft_friction.unwrap_or(0.0)];
        Self {
            loads: state.loads.of_parts(),
            rows: stations.map(row).collect(),
        }
    }
}

/// The state that net forces are measured from.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Net {
    phase: Option<String>,
    from: Option<Forces>,
    /// The state that the phase before ended with; `None`: the pile was not there.
    last: Option<Forces>,
}

impl Net {
    /// Before the first phase.
    pub(crate) fn new(state: Option<&State>) -> Self {
        Self {
            last: state.map(Forces::of),
            ..Self::default()
        }
    }

    /// A state of this phase is about to be looked at. `shaft`: groups of the pile's shaft.
    pub(crate) fn begins(&mut self, phase: &str, problem: &Problem, shaft: &[usize]) {
        if self.phase.as_deref() == Some(phase) {
            return;
        }
        let is_active = |&group: &usize| problem.groups[group].is_active;
        if self.phase.is_none() && shaft.iter().any(is_active) {
            self.from = Some(Forces::default());
        }
        self.phase = Some(phase.to_owned());
        let phase = problem.phases.iter().find(|other| other.name == phase);
        let (resets, activates) = phase.map_or((false, false), |phase| {
            let activates = shaft.iter().any(|group| phase.activate.contains(group));
            (phase.reset_displacements, activates)
        });
        if resets || activates && self.from.is_none() {
            self.from = Some(self.last.clone().unwrap_or_default());
        }
    }

    /// Gives a state its net forces.
    pub(crate) fn complete(&self, state: &mut State) {
        let Some(from) = &self.from else {
            return;
        };
        let loads = state.loads.of_parts();
        state.net = Some(std::array::from_fn(|i| loads[i] - from.loads[i]));
        for (number, station) in state.stations.iter_mut().enumerate() {
            let [axial_force, friction] = from.rows.get(number).copied().unwrap_or_default();
            station.axial_force_net = Some(station.axial_force - axial_force);
            station.shaft_friction_net = station.shaft_friction.map(|value| value - friction);
        }
    }

    /// The end of an increment.
    pub(crate) fn ends(&mut self, state: Option<&State>) {
        self.last = state.map(Forces::of);
    }
}
