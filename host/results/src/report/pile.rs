//! `pile.csv`: what holds along a pile.

use super::budget::Budget;
use super::number_format::{Short, thinned};
use super::profile::{AHEAD, Block, Blocks, Place};
use super::results::Times;
use super::table::Table;
use serde::Serialize;
use std::path::Path;
use text::Error;

/// Columns that the table has to have: place, station, quantities.
const COLUMNS: [&str; 10] = [
    "phase",
    "increment",
    "z",
    "axial_force",
    "shaft_friction",
    "normal_stress",
    "slip",
    "settlement",
    "axial_force_net",
    "shaft_friction_net",
];

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
        let table = Table::open(path, &COLUMNS)?;
        let at = COLUMNS.map(|name| table.position(name).unwrap_or_default());
        let [phase_at, increment_at, z_at, ..] = at;
        let quantities = &at[3..];
        let width = quantities.len();
        let mut phases: Vec<String> = Vec::new();
        let mut z: Vec<f64> = Vec::new();
        let mut blocks = Blocks {
            width,
            ..Blocks::default()
        };
        // The increment whose rows are being read, with its stations and values.
        let mut now: Option<(usize, usize)> = None;
        let (mut stations, mut values) = (Vec::new(), Vec::new());
        let mut end =
            |now: Option<(usize, usize)>, stations: &mut Vec<f64>, values: &mut Vec<f64>| {
                let Some((phase, increment)) = now else {
                    return;
                };
                if z.is_empty() {
                    z.clone_from(stations);
                    blocks.most = AHEAD * (budget.pile / (z.len() * width).max(1)).max(1);
                }
                if *stations == z {
                    blocks.add(phase, increment, std::mem::take(values));
                } else {
                    blocks.n_broken += 1;
                }
                stations.clear();
                values.clear();
            };
        table.rows(notes, |row| {
            let increment = row.count(increment_at).unwrap_or_default();
            let is_new_phase = phases.last().map(String::as_bytes) != Some(row.bytes(phase_at));
            if is_new_phase || now.is_none_or(|(_, last)| last != increment) {
                end(now, &mut stations, &mut values);
                if is_new_phase {
                    phases.push(row.text(phase_at));
                }
                now = Some((phases.len() - 1, increment));
            }
            stations.push(row.number(z_at));
            values.extend(quantities.iter().map(|&column| row.number(column)));
        })?;
        end(now, &mut stations, &mut values);
        if z.is_empty() {
            return Ok(None);
        }
        if blocks.n_broken > 0 {
            notes.push(format!(
                "pile.csv: {} of {} increments are not complete and left out",
                blocks.n_broken,
                blocks.n + blocks.n_broken
            ));
        }
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
            columns: COLUMNS[3..].to_vec(),
            increments: shown.iter().map(place).collect(),
            values: by_quantity.collect(),
            z: z.into_iter().map(short).collect(),
        }))
    }
}
