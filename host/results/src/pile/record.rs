//! A pile in the course of a run: its table, its net forces, its load–settlement curve.

use super::{Curve, Net, Pile, Resistances, State, Stations, cycles};
use crate::file::Extent;
use mechanics::simulation::Snapshot;
use mechanics::{NoEquilibrium, Place, Simulation};
use serde::{Deserialize, Serialize};
use std::path::Path;
use text::Error;

/// A pile, as it is written.
#[derive(Debug)]
pub(crate) struct Record {
    pub(crate) pile: Pile,
    stations: Stations,
    net: Net,
    curve: Curve,
    /// Compliance of the joints of its shaft in the present phase.
    compliance: Vec<Option<f64>>,
    /// Phases that settlements are counted from.
    resets: Vec<String>,
    /// Phases before the pile is in place.
    too_early: Vec<String>,
    /// Phases that prescribe the settlement of the head.
    moving: Vec<String>,
}

/// How far it had come at a checkpoint.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Kept {
    pub(crate) table: Extent,
    net: Net,
    curve: Curve,
    compliance: Vec<Option<f64>>,
}

impl Record {
    /// Before the first phase, or as it was kept.
    ///
    /// # Errors
    /// [`Error::Unwritable`].
    pub(crate) fn begin(
        pile: Pile,
        folder: &Path,
        simulation: &Simulation,
        from: Option<&Kept>,
    ) -> Result<Self, Error> {
        let phases = simulation.problem().phases.iter();
        let resets = phases.filter(|phase| phase.reset_displacements);
        let first = || Net::new(pile.state(&simulation.snapshot()).as_ref());
        Ok(Self {
            stations: Stations::begin(folder, from.map(|kept| kept.table))?,
            net: from.map_or_else(first, |kept| kept.net.clone()),
            curve: from.map(|kept| kept.curve.clone()).unwrap_or_default(),
            compliance: from.map(|kept| kept.compliance.clone()).unwrap_or_default(),
            resets: resets.map(|phase| phase.name.clone()).collect(),
            too_early: pile.phases_too_early(simulation.problem()),
            moving: pile.phases_that_move_the_head(simulation.problem()),
            pile,
        })
    }

    /// After waiting until the table is on the disk.
    ///
    /// # Errors
    /// [`Error::Unwritable`].
    pub(crate) fn kept(&self) -> Result<Kept, Error> {
        Ok(Kept {
            table: self.stations.table.sync()?,
            net: self.net.clone(),
            curve: self.curve.clone(),
            compliance: self.compliance.clone(),
        })
    }

    /// A state of this phase is about to be looked at.
    pub(crate) fn begins(&mut self, phase: &str, snapshot: &Snapshot<'_>) {
        self.net.begins(phase, snapshot.problem, self.pile.shaft());
    }

    /// The pile with its net forces; `None` if it is absent.
    pub(crate) fn state(&self, snapshot: &Snapshot<'_>) -> Option<State> {
        let mut state = self.pile.state(snapshot)?;
        self.net.complete(&mut state);
        Some(state)
    }

    /// Takes its state after an increment.
    ///
    /// # Errors
    /// [`Error::Unwritable`].
    pub(crate) fn add(
        &mut self,
        place: &Place,
        state: Option<&State>,
        snapshot: &Snapshot<'_>,
    ) -> Result<(), Error> {
        self.net.ends(state);
        let Some(state) = state else {
            return Ok(());
        };
        self.stations.write(place, state)?;
        if self.curve.begins(&place.phase) {
            let resets = self.resets.contains(&place.phase);
            let is_in_place = !self.too_early.contains(&place.phase);
            let moves_head = self.moving.contains(&place.phase);
            let stiffness = self.pile.stiffness(snapshot.groups);
            let of_phase = [resets, is_in_place, moves_head];
            self.curve.phase(&place.phase, of_phase, stiffness);
            if is_in_place {
                self.compliance = self.pile.compliance(snapshot.groups);
            } else {
                self.compliance.clear();
            }
        }
        let slip = if self.compliance.is_empty() {
            None
        } else {
            self.pile.elastic_slip(state, &self.compliance)
        };
        self.curve.add(state, slip);
        Ok(())
    }

    /// At which load of its head it found no further equilibrium.
    pub(crate) fn plunge(&self, simulation: &Simulation, none: &NoEquilibrium) -> Option<String> {
        self.pile.plunge(simulation, none, &self.curve)
    }

    /// Unit of its forces.
    pub(crate) fn unit(&self) -> &'static str {
        self.pile.geometry.analysis.force_unit()
    }

    pub(crate) fn resistances(&self) -> Resistances {
        self.curve.resistances(&self.pile)
    }

    /// A warning if much of the settlement is elastic slip of the shaft's joints.
    pub(crate) fn soft_shaft(&self) -> Option<String> {
        self.curve.soft_shaft()
    }

    /// Largest force out of balance, as a share of the pile's largest load, in words.
    pub(crate) fn out_of_balance(&self, residual: impl Fn(&str) -> Option<f64>) -> Option<String> {
        self.curve.out_of_balance(residual, self.unit())
    }

    /// Writes the table of its cycles.
    ///
    /// # Errors
    /// [`Error::Unwritable`].
    pub(crate) fn finish(&self, folder: &Path) -> Result<(), Error> {
        cycles::write(folder, &self.curve)
    }
}
