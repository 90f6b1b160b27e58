//! `pile.csv`: what holds along a pile.

use super::budget::Budget;
use super::number_format::{Short, thinned};
use super::profile::{AHEAD, Block, Blocks, Place};
use super::results::Times;
use super::table::Table;
use crate::pile::OF_STATION;
use serde::Serialize;
use std::path::Path;
use text::Error;

/// Columns of the place of a row.
const PLACE: [&str; 2] = ["phase", "increment"];

/// The pile of a run.
#[derive(Debug, Serialize)]
pub(super) struct Pile {
    /// Stations from the head down.
    z: Vec<Short>,
    /// Names of the quantities.
    columns: Vec<&'static str>,
    increments: Vec<Place>,
    /// By quantity, increment and station.
    values: Vec<Vec<Vec<Short>>>,
}

/// The rows of a table, increment by increment.
struct Rows {
    phases: Vec<String>,
    /// Stations of the first increment, m.
    z: Vec<f64>,
    blocks: Blocks,
    /// Phase and increment whose rows are being read, with stations and values so far.
    now: Option<(usize, usize)>,
    stations: Vec<f64>,
    values: Vec<f64>,
}

impl Rows {
    fn read(path: &Path, budget: &Budget, notes: &mut Vec<String>) -> Result<Self, Error> {
        let table = Table::open(path, &[&PLACE[..], &OF_STATION].concat())?;
        let position = |name| table.position(name).unwrap_or_default();
        let [phase_at, increment_at] = PLACE.map(position);
        let [z_at, quantities @ ..] = OF_STATION.map(position);
        let mut rows = Self {
            phases: Vec::new(),
            z: Vec::new(),
            blocks: Blocks {
                width: quantities.len(),
                ..Blocks::default()
            },
            now: None,
            stations: Vec::new(),
            values: Vec::new(),
        };
        table.rows(notes, |row| {
            let increment = row.count(increment_at).unwrap_or_default();
            let phase = rows.phases.last().map(String::as_bytes);
            let is_new_phase = phase != Some(row.bytes(phase_at));
            if is_new_phase || rows.now.is_none_or(|(_, last)| last != increment) {
                rows.end_increment(budget);
                if is_new_phase {
                    rows.phases.push(row.text(phase_at));
                }
                rows.now = Some((rows.phases.len() - 1, increment));
            }
            rows.stations.push(row.number(z_at));
            let values = quantities.iter().map(|&column| row.number(column));
            rows.values.extend(values);
        })?;
        rows.end_increment(budget);
        Ok(rows)
    }

    fn end_increment(&mut self, budget: &Budget) {
        let Some((phase, increment)) = self.now else {
            return;
        };
        let blocks = &mut self.blocks;
        if self.z.is_empty() {
            self.z.clone_from(&self.stations);
            let size = self.z.len() * blocks.width;
            blocks.most = AHEAD * (budget.pile / size.max(1)).max(1);
        }
        if self.stations == self.z {
            blocks.add(phase, increment, std::mem::take(&mut self.values));
        } else {
            blocks.n_broken += 1;
        }
        self.stations.clear();
        self.values.clear();
    }
}

impl Pile {
    /// Reads a table. `None` if there is nothing to show.
    ///
    /// # Errors
    /// As [`Table::open`].
    pub(super) fn read(
        path: &Path,
        times: &Times,
        budget: &Budget,
        notes: &mut Vec<String>,
    ) -> Result<Option<Self>, Error> {
        let Rows {
            phases, z, blocks, ..
        } = Rows::read(path, budget, notes)?;
        let width = blocks.width;
        if z.is_empty() {
            return Ok(None);
        }
        notes.extend(blocks.incomplete("pile.csv"));
        let most = budget.pile / (z.len() * width).max(1);
        let must = |i: usize| blocks.kept[i].ends_phase;
        let shown = thinned(blocks.kept.len(), most, must);
        if shown.len() < blocks.n {
            notes.push(format!(
                "of {} increments of the pile {} are shown; pile.csv has all",
                blocks.n,
                shown.len()
            ));
        }
        let shown: Vec<&Block> = shown.iter().map(|&i| &blocks.kept[i]).collect();
        let short = |value: f64| Short(value.is_finite().then_some(value));
        let of = |column: usize, block: &Block| -> Vec<Short> {
            block
                .values
                .chunks_exact(width)
                .map(|station| short(station[column]))
                .collect()
        };
        let place = |block: &&Block| Place {
            time: Short(times.of(&phases[block.phase], block.increment)),
            phase: phases[block.phase].clone(),
            increment: block.increment,
        };
        let by_quantity =
            (0..width).map(|column| shown.iter().map(|block| of(column, block)).collect());
        Ok(Some(Self {
            columns: OF_STATION[1..].to_vec(),
            increments: shown.iter().map(place).collect(),
            values: by_quantity.collect(),
            z: z.into_iter().map(short).collect(),
        }))
    }
}
