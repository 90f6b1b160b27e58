//! `profile.csv`: values along interfaces.
//!
//! Integration points of one element at the same position along the interface form a station; the
//! rows across the layer are numbered from one face to the other. The page shows the mean over the
//! rows, as probes do, or every row.

use super::budget::Budget;
use super::number_format::{Short, thinned};
use super::results::Times;
use super::table::{Row, Table};
use crate::ends;
use serde::Serialize;
use std::path::Path;
use text::Error;

/// So many times what is shown is kept in memory at most.
pub(super) const AHEAD: usize = 4;
/// Points of an element closer than this are at the same position, relative to the group's length.
const SAME_POSITION: f64 = 1e-6;
/// Columns every profile begins with.
pub(super) const COLUMNS: [&str; 8] = [
    "phase",
    "increment",
    "group",
    "element",
    "point",
    "x",
    "y",
    "s",
];

/// Profiles of a run.
#[derive(Debug, Serialize)]
pub(super) struct Profile {
    pub(super) groups: Vec<Interface>,
    /// Names of the quantities.
    pub(super) columns: Vec<String>,
    pub(super) increments: Vec<Place>,
    /// By quantity and increment; points station by station, row by row within each.
    values: Vec<Vec<Vec<Short>>>,
}

/// An interface and its stations.
#[derive(Debug, Serialize)]
pub(super) struct Interface {
    pub(super) name: String,
    /// Position along it, by station.
    s: Vec<Short>,
    /// Coordinate of every row across the layer; empty if it differs along the interface.
    across: Vec<Short>,
    /// Rows across the layer.
    rows: usize,
    /// It runs rather upwards than sideways.
    vertical: bool,
    /// Where its values begin.
    offset: usize,
}

/// An increment.
#[derive(Debug, Serialize)]
pub(super) struct Place {
    pub(super) phase: String,
    pub(super) increment: usize,
    pub(super) time: Short,
}

/// A point of the profile.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Point {
    pub(crate) group: String,
    /// Number of its element, from 1.
    pub(crate) element: usize,
    pub(crate) position: [f64; 2],
    pub(crate) s: f64,
}

/// An increment on its way into the page.
#[derive(Debug)]
pub(super) struct Block {
    /// Number among the complete increments.
    number: usize,
    pub(super) phase: usize,
    pub(super) increment: usize,
    /// The next increment is of another phase, as far as it is known.
    pub(super) ends_phase: bool,
    /// Row by row.
    pub(super) values: Vec<f64>,
}

/// The increments of a table. If there are too many, every second one is dropped while reading,
/// except the ends of phases and those where a quantity is lowest or highest.
#[derive(Debug, Default)]
pub(super) struct Blocks {
    pub(super) kept: Vec<Block>,
    /// Complete increments so far, and others.
    pub(super) n: usize,
    pub(super) n_broken: usize,
    pub(super) stride: usize,
    /// So many may be kept.
    pub(super) most: usize,
    /// Numbers of a row.
    pub(super) width: usize,
}

impl Blocks {
    pub(super) fn add(&mut self, phase: usize, increment: usize, values: Vec<f64>) {
        if let Some(last) = self.kept.last_mut() {
            last.ends_phase = last.phase != phase;
        }
        let number = self.n;
        self.n += 1;
        self.kept.push(Block {
            number,
            phase,
            increment,
            ends_phase: true,
            values,
        });
        if self.kept.len() > self.most {
            self.stride = 2 * self.stride.max(1);
            self.thin();
        }
    }

    /// Says how many increments of a file are not complete.
    pub(super) fn incomplete(&self, file: &str) -> Option<String> {
        (self.n_broken > 0).then(|| {
            format!(
                "{file}: {} of {} increments are not complete and left out",
                self.n_broken,
                self.n + self.n_broken
            )
        })
    }

    /// Indices of the profiles to show: at most `most`, including ends of phases and extremes.
    fn shown(&self, most: usize) -> Vec<usize> {
        let extreme = if self.kept.len() > most {
            self.extreme()
        } else {
            Vec::new()
        };
        let must = |i: usize| self.kept[i].ends_phase || extreme[i];
        thinned(self.kept.len(), most, must)
    }

    fn thin(&mut self) {
        let extreme = self.extreme();
        let (last, stride) = (self.n - 1, self.stride);
        let mut at = 0;
        self.kept.retain(|block| {
            let keeps = block.number.is_multiple_of(stride)
                || block.number == last
                || block.ends_phase
                || extreme[at];
            at += 1;
            keeps
        });
    }

    /// Among those kept, the places where a quantity is lowest or highest.
    fn extreme(&self) -> Vec<bool> {
        let mut extreme = vec![false; self.kept.len()];
        for column in 0..self.width {
            let (mut low, mut high) = ((f64::INFINITY, None), (f64::NEG_INFINITY, None));
            for (at, block) in self.kept.iter().enumerate() {
                for row in block.values.chunks_exact(self.width) {
                    // Comparisons with NaN are false.
                    if row[column] < low.0 {
                        low = (row[column], Some(at));
                    }
                    if row[column] > high.0 {
                        high = (row[column], Some(at));
                    }
                }
            }
            for at in [low.1, high.1].into_iter().flatten() {
                extreme[at] = true;
            }
        }
        extreme
    }
}

/// The rows of a table by increments.
#[derive(Debug)]
pub(crate) struct Profiles {
    /// Names of the quantities.
    columns: Vec<String>,
    phases: Vec<String>,
    /// Those of the first increment; `None` if they cannot be read.
    points: Option<Vec<Point>>,
    /// There was an increment before.
    has_points: bool,
    blocks: Blocks,
    /// Numbers that may go into the page.
    most: usize,
}

impl Profiles {
    /// Profiles of these quantities on a page of one run.
    pub(crate) fn of_one(columns: Vec<String>) -> Self {
        Self::new(columns, &Budget::of(1))
    }

    fn new(columns: Vec<String>, budget: &Budget) -> Self {
        Self {
            blocks: Blocks {
                width: columns.len(),
                ..Blocks::default()
            },
            columns,
            phases: Vec::new(),
            points: Some(Vec::new()),
            has_points: false,
            most: budget.profile,
        }
    }

    /// Whether a column is a quantity.
    pub(crate) fn shows(column: &str) -> bool {
        !COLUMNS.contains(&column)
    }

    /// An increment begins, of this phase.
    pub(crate) fn begin(&mut self, phase: &str) {
        if self.phases.last().is_none_or(|last| last != phase) {
            self.phases.push(phase.to_owned());
        }
    }

    /// Whether points are still to be told: those of the first increment are those of all.
    pub(crate) fn wants_points(&self) -> bool {
        !self.has_points
    }

    /// A point of the first increment; `None` if it cannot be read.
    pub(crate) fn add_point(&mut self, point: Option<Point>) {
        match (&mut self.points, point) {
            (Some(points), Some(point)) => points.push(point),
            _ => self.points = None,
        }
    }

    /// The increment that was begun ends, with the values of this many rows.
    pub(crate) fn end(&mut self, increment: usize, n_rows: usize, values: Vec<f64>) {
        if n_rows == 0 {
            return;
        }
        let n_points = self.points.as_ref().map_or(0, Vec::len);
        if !self.has_points {
            let size = (n_points * self.blocks.width).max(1);
            self.blocks.most = AHEAD * (self.most / size).max(1);
            self.has_points = true;
        }
        if n_rows == n_points {
            let phase = self.phases.len().saturating_sub(1);
            self.blocks.add(phase, increment, values);
        } else {
            self.blocks.n_broken += 1;
        }
    }

    /// Reads the values of all quantities.
    ///
    /// # Errors
    /// As [`Table::rows`].
    fn read(table: Table, budget: &Budget, notes: &mut Vec<String>) -> Result<Self, Error> {
        let at = COLUMNS.map(|name| table.position(name).unwrap_or_default());
        let [phase_at, increment_at, ..] = at;
        let names = table.columns().iter().enumerate();
        let (columns, names): (Vec<usize>, Vec<String>) = names
            .filter(|(_, name)| Self::shows(name))
            .map(|(column, name)| (column, name.clone()))
            .unzip();
        let mut profiles = Self::new(names, budget);
        let mut key: (Vec<u8>, Vec<u8>) = Default::default();
        let mut increment = 0;
        let mut values: Vec<f64> = Vec::new();
        let mut n_rows = 0;
        table.rows(notes, |row| {
            let is_new = key.0 != row.bytes(phase_at) || key.1 != row.bytes(increment_at);
            if is_new || n_rows == 0 {
                let next = Vec::with_capacity(values.len());
                profiles.end(increment, n_rows, std::mem::replace(&mut values, next));
                n_rows = 0;
                profiles.begin(&row.text(phase_at));
                key.0.clear();
                key.0.extend_from_slice(row.bytes(phase_at));
                key.1.clear();
                key.1.extend_from_slice(row.bytes(increment_at));
                increment = row.count(increment_at).unwrap_or_default();
            }
            n_rows += 1;
            if profiles.wants_points() {
                profiles.add_point(point(row, at));
            }
            values.extend(columns.iter().map(|&column| row.number(column)));
        })?;
        profiles.end(increment, n_rows, values);
        Ok(profiles)
    }
}

impl Profile {
    /// Reads a table with [`COLUMNS`]. `None` if there is nothing to show.
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
        let profiles = Profiles::read(table, budget, notes)?;
        Ok(Self::of(profiles, times, notes))
    }

    /// Excerpt of a table. `None` if that is nothing.
    pub(super) fn of(profiles: Profiles, times: &Times, notes: &mut Vec<String>) -> Option<Self> {
        let points = profiles.points.filter(|points| !points.is_empty())?;
        let (columns, blocks, most) = (profiles.columns, profiles.blocks, profiles.most);
        notes.extend(blocks.incomplete("profile.csv"));
        let size = points.len() * columns.len();
        if size > most {
            notes.push(format!(
                "profile.csv is not shown: {size} numbers for every increment are too many for \
                 this page"
            ));
            return None;
        }
        let shown = blocks.shown(most / size.max(1));
        if shown.len() < blocks.n {
            let (all, shown) = (blocks.n, shown.len());
            notes.push(format!(
                "of {all} profiles {shown} are shown; profile.csv has all"
            ));
        }
        let shown: Vec<&Block> = shown.iter().map(|&i| &blocks.kept[i]).collect();
        let (groups, order) = interfaces(&points);
        let width = columns.len();
        let values_at = |column: usize, block: &Block| -> Vec<Short> {
            let value = |&point: &usize| {
                let value = block.values[point * width + column];
                Short(value.is_finite().then_some(value))
            };
            order.iter().map(value).collect()
        };
        let places = shown.iter().map(|block| {
            let phase = profiles.phases[block.phase].clone();
            Place {
                time: Short(times.of(&phase, block.increment)),
                phase,
                increment: block.increment,
            }
        });
        let values =
            (0..width).map(|column| shown.iter().map(|block| values_at(column, block)).collect());
        Some(Self {
            increments: places.collect(),
            values: values.collect(),
            columns,
            groups,
        })
    }
}

/// The point of a row, `at` the columns of a profile.
fn point(row: &Row, at: [usize; 8]) -> Option<Point> {
    let [_, _, group, element, _, x, y, s] = at;
    let number = |column: usize| Some(row.number(column)).filter(|value| value.is_finite());
    Some(Point {
        group: row.text(group),
        element: row.count(element)?,
        position: [number(x)?, number(y)?],
        s: number(s)?,
    })
}

/// Interfaces, and the points in the order of their stations.
fn interfaces(points: &[Point]) -> (Vec<Interface>, Vec<usize>) {
    let mut names: Vec<&str> = Vec::new();
    for point in points {
        if !names.contains(&point.group.as_str()) {
            names.push(&point.group);
        }
    }
    let mut order = Vec::new();
    let mut groups = Vec::new();
    for name in names {
        let offset = order.len();
        let members: Vec<usize> = (0..points.len())
            .filter(|&i| points[i].group == name)
            .collect();
        let extent = |c: usize| extent(members.iter().map(|&i| points[i].position[c]));
        let vertical = extent(1) >= extent(0);
        let across = usize::from(!vertical);
        let stations = stations(points, &members, across, extent(usize::from(vertical)));
        let rows = stations[0].len();
        let columns = (0..rows).map(|row| stations.iter().map(move |s| points[s[row]].position));
        let rows_across: Option<Vec<Short>> = columns
            .map(|column| {
                let at: Vec<f64> = column.map(|position| position[across]).collect();
                let first = *at.first()?;
                let same = at
                    .iter()
                    .all(|x| (x - first).abs() <= 1e-9 * first.abs().max(1e-3));
                same.then_some(Short::from(first))
            })
            .collect();
        groups.push(Interface {
            name: name.to_owned(),
            s: stations
                .iter()
                .map(|station| Short::from(points[station[0]].s))
                .collect(),
            across: rows_across.unwrap_or_default(),
            rows,
            vertical,
            offset,
        });
        order.extend(stations.into_iter().flatten());
    }
    (groups, order)
}

/// Points of a group by position along the interface, each station's across it. If stations have
/// different numbers of points, every point is its own station.
fn stations(points: &[Point], members: &[usize], across: usize, length: f64) -> Vec<Vec<usize>> {
    let mut sorted = members.to_vec();
    sorted.sort_by(|&a, &b| {
        let (a, b) = (&points[a], &points[b]);
        a.element.cmp(&b.element).then(a.s.total_cmp(&b.s))
    });
    let mut stations: Vec<Vec<usize>> = Vec::new();
    for i in sorted {
        let point = &points[i];
        match stations.last_mut() {
            Some(station)
                if points[station[0]].element == point.element
                    && (points[station[0]].s - point.s).abs() <= SAME_POSITION * length =>
            {
                station.push(i);
            }
            _ => stations.push(vec![i]),
        }
    }
    let rows = stations[0].len();
    if stations.iter().any(|station| station.len() != rows) {
        stations = members.iter().map(|&i| vec![i]).collect();
    }
    for station in &mut stations {
        station.sort_by(|&a, &b| {
            let at = |i: usize| points[i].position[across];
            at(a).total_cmp(&at(b))
        });
    }
    stations.sort_by(|a, b| points[a[0]].s.total_cmp(&points[b[0]].s));
    stations
}

fn extent(values: impl Iterator<Item = f64>) -> f64 {
    let [low, high] = ends(values);
    high - low
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(element: usize, x: f64, y: f64) -> Point {
        Point {
            group: "shaft".to_owned(),
            element,
            position: [x, y],
            s: y,
        }
    }

    #[test]
    fn rows_across_the_layer_form_stations() {
        let points = [
            point(2, 0.011, 0.3),
            point(2, 0.010, 0.3),
            point(1, 0.010, 0.1),
            point(1, 0.011, 0.1),
            point(1, 0.010, 0.2),
            point(1, 0.011, 0.2),
        ];
        let (groups, order) = interfaces(&points);
        assert_eq!(order, [2, 3, 4, 5, 1, 0]);
        assert_eq!(groups[0].rows, 2);
        assert!(groups[0].vertical);
        assert_eq!(groups[0].across, [Short::from(0.010), Short::from(0.011)]);
    }

    #[test]
    fn ends_of_two_elements_at_one_position_stay_two_stations() {
        let points = [
            point(1, 0.0, 0.0),
            point(1, 0.0, 1.0),
            point(2, 0.0, 1.0),
            point(2, 0.0, 2.0),
        ];
        let (groups, order) = interfaces(&points);
        assert_eq!(groups[0].rows, 1);
        assert_eq!(groups[0].s.len(), 4);
        assert_eq!(order, [0, 1, 2, 3]);
    }
}
