//! What a phase may end at: a column of `history.csv`, measured while the phase goes on.

use super::Recorder;
use crate::pile::COLUMNS;
use mechanics::simulation::Snapshot;

impl Recorder {
    /// The value of a column in a state; `None` where it has none.
    pub fn quantity(&self, name: &str, snapshot: &Snapshot<'_>) -> Option<f64> {
        let of_pile = self.pile.iter().flat_map(|_| COLUMNS);
        let mut names = self.probes.names().chain(of_pile);
        let number = names.position(|other| other == name)?;
        self.values_of(snapshot).0.get(number).copied().flatten()
    }
}
