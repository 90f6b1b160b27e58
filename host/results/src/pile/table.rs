//! `pile.csv`: what holds along the pile.

use super::{OF_STATION, State};
use crate::file::Extent;
use crate::table::{Cell, Table};
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
        let columns = ["phase", "increment"].into_iter().chain(OF_STATION);
        let table = Table::begin(folder.join("pile.csv"), columns, from)?;
        Ok(Self { table })
    }

    pub(crate) fn write(&mut self, place: &Place, state: &State) -> Result<(), Error> {
        for station in &state.stations {
            let cell = |name: &str| Cell::Number(station.named(name));
            let place = [Cell::Text(&place.phase), Cell::Count(place.increment)];
            self.table
                .row(place.into_iter().chain(OF_STATION.map(cell)));
        }
        self.table.flush()
    }
}
