//! The quantity that ends a phase: a column of `history.csv`, evaluated after every step.

use super::Recorder;
use crate::pile::COLUMNS;
use mechanics::simulation::Snapshot;

impl Recorder {
    /// The value of a column in a state of this phase; `None` where it has none.
    pub fn quantity(&mut self, phase: &str, name: &str, snapshot: &Snapshot<'_>) -> Option<f64> {
        self.begins(phase, snapshot);
        let of_pile = self.pile.iter().flat_map(|_| COLUMNS);
        let mut names = self.probes.names().chain(of_pile);
        let number = names.position(|other| other == name)?;
        self.values_of(snapshot).0.get(number).copied().flatten()
    }
}
