//! `pile.csv`: what holds along the pile.

use super::State;
use crate::file::Extent;
use crate::recorder::Table;
use crate::table::number;
use mechanics::Place;
use std::path::Path;
use text::Error;

/// `pile.csv`: a row for every station and increment.
#[derive(Debug)]
pub(crate) struct Stations {
    pub(crate) table: Table,
}

impl Stations {
    /// As [`Table::begin`].
    pub(crate) fn begin(folder: &Path, from: Option<Extent>) -> Result<Self, Error> {
        let columns = [
            "phase",
            "increment",
            "z",
            "axial_force",
            "shaft_friction",
            "normal_stress",
            "slip",
            "settlement",
        ];
        let table = Table::begin(folder.join("pile.csv"), columns, from)?;
        Ok(Self { table })
    }

    pub(crate) fn write(&mut self, place: &Place, state: &State) -> Result<(), Error> {
        for station in &state.stations {
            let optional = |value: Option<f64>| value.map(number).unwrap_or_default();
            self.table.row([
                place.phase.clone(),
                place.increment.to_string(),
                number(station.z),
                number(station.axial_force),
                optional(station.shaft_friction),
                optional(station.normal_stress),
                optional(station.slip),
                number(station.settlement),
            ])?;
        }
        self.table.flush()
    }
}
