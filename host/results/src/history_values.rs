//! Columns of `history.csv` in the course of a simulation that nobody records.

use crate::OutputRequest;
use crate::pile::{Net, State};
use mechanics::Simulation;
use mechanics::simulation::Snapshot;
use std::sync::Arc;

/// What a case measures, and what its net columns depend on.
#[derive(Clone, Debug)]
pub struct HistoryValues {
    wanted: Arc<OutputRequest>,
    net: Net,
}

impl HistoryValues {
    /// Before the first phase.
    pub fn new(wanted: OutputRequest, simulation: &Simulation) -> Self {
        let pile = wanted.pile.as_ref();
        let state = pile.and_then(|pile| pile.state(&simulation.snapshot()));
        Self {
            wanted: Arc::new(wanted),
            net: Net::new(state.as_ref()),
        }
    }

    /// The value of a column in a state of this phase; `None` where it has none.
    pub fn quantity(&mut self, phase: &str, name: &str, snapshot: &Snapshot<'_>) -> Option<f64> {
        let number = self.wanted.columns().position(|other| other == name)?;
        let mut values = self.wanted.probes.values(snapshot);
        if let Some(mut state) = self.state(phase, snapshot) {
            self.net.complete(&mut state);
            values.extend(state.values());
        }
        values.get(number).copied().flatten()
    }

    /// The end of an increment of this phase.
    pub fn increment(&mut self, phase: &str, snapshot: &Snapshot<'_>) {
        let state = self.state(phase, snapshot);
        self.net.ends(state.as_ref());
    }

    /// Goes to the state that these values are of.
    pub fn go_to(&mut self, other: &Self) {
        self.net = other.net.clone();
    }

    fn state(&mut self, phase: &str, snapshot: &Snapshot<'_>) -> Option<State> {
        let pile = self.wanted.pile.as_ref()?;
        self.net.begins(phase, snapshot.problem, pile.shaft());
        pile.state(snapshot)
    }
}
