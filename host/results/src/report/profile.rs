//! `profile.csv`: values along interfaces.
//!
//! Integration points of one element at the same position along the interface form a station; the
//! rows across the layer are numbered from one face to the other. The page shows the mean over the
//! rows, as probes do, or every row.

use super::budget::Budget;
use super::results::Times;
use super::short::{Short, thinned};
use super::table::{Row, Table};
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
struct Point {
    group: String,
    element: usize,
    position: [f64; 2],
    s: f64,
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

/// The increments of a table. Of too many, every second is forgotten while they are read, but
/// for the ends of phases and those where a quantity is lowest or highest.
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

    /// Of those that are kept, where a quantity is lowest or highest.
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
struct Profiles {
    phases: Vec<String>,
    /// Those of the first increment; `None` if they cannot be read.
    points: Option<Vec<Point>>,
    blocks: Blocks,
}

impl Profiles {
    /// Reads the values of these columns.
    ///
    /// # Errors
    /// As [`Table::rows`].
    fn read(
        table: Table,
        at: [usize; COLUMNS.len()],
        columns: &[usize],
        budget: &Budget,
        notes: &mut Vec<String>,
    ) -> Result<Self, Error> {
        let [phase_at, increment_at, ..] = at;
        let mut phases: Vec<String> = Vec::new();
        // The first increment says which points there are.
        let mut points: Option<Vec<Point>> = Some(Vec::new());
        let mut blocks = Blocks {
            width: columns.len(),
            ..Blocks::default()
        };
        let mut key: (Vec<u8>, Vec<u8>) = Default::default();
        let mut increment = 0;
        let mut values: Vec<f64> = Vec::new();
        let (mut n_rows, mut is_first) = (0, true);
        let mut end = |values: &mut Vec<f64>,
                       n_rows: usize,
                       place: (usize, usize),
                       points: &Option<Vec<Point>>,
                       is_first: bool| {
            let n_points = points.as_ref().map_or(0, Vec::len);
            if is_first {
                let size = (n_points * blocks.width).max(1);
                blocks.most = AHEAD * (budget.profile / size).max(1);
            }
            if n_rows == n_points {
                let next = Vec::with_capacity(values.len());
                blocks.add(place.0, place.1, std::mem::replace(values, next));
            } else {
                blocks.n_broken += 1;
                values.clear();
            }
        };
        table.rows(notes, |row| {
            let is_new = key.0 != row.bytes(phase_at) || key.1 != row.bytes(increment_at);
            if is_new || n_rows == 0 {
                if n_rows > 0 {
                    let place = (phases.len() - 1, increment);
                    end(&mut values, n_rows, place, &points, is_first);
                    is_first = false;
                }
                n_rows = 0;
                if phases.last().map(String::as_bytes) != Some(row.bytes(phase_at)) {
                    phases.push(row.text(phase_at));
                }
                key.0.clear();
                key.0.extend_from_slice(row.bytes(phase_at));
                key.1.clear();
                key.1.extend_from_slice(row.bytes(increment_at));
                increment = row.count(increment_at).unwrap_or_default();
            }
            n_rows += 1;
            if is_first && let Some(known) = &mut points {
                match point(row, at) {
                    Some(point) => known.push(point),
                    None => points = None,
                }
            }
            values.extend(columns.iter().map(|&column| row.number(column)));
        })?;
        if n_rows > 0 {
            end(
                &mut values,
                n_rows,
                (phases.len() - 1, increment),
                &points,
                is_first,
            );
        }
        Ok(Self {
            phases,
            points,
            blocks,
        })
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
        let at = COLUMNS.map(|name| table.position(name).unwrap_or_default());
        let columns: Vec<usize> = (0..table.columns().len())
            .filter(|&column| !COLUMNS.contains(&table.columns()[column].as_str()))
            .collect();
        let names: Vec<String> = columns
            .iter()
            .map(|&column| table.columns()[column].clone())
            .collect();
        let Profiles {
            phases,
            points,
            blocks,
        } = Profiles::read(table, at, &columns, budget, notes)?;
        let Some(points) = points.filter(|points| !points.is_empty()) else {
            return Ok(None);
        };
        if blocks.n_broken > 0 {
            notes.push(format!(
                "profile.csv: {} of {} increments are not complete and left out",
                blocks.n_broken,
                blocks.n + blocks.n_broken
            ));
        }
        let size = points.len() * columns.len();
        if size > budget.profile {
            notes.push(format!(
                "profile.csv is not shown: {size} numbers for every increment are too many for \
                 this page"
            ));
            return Ok(None);
        }
        let most = budget.profile / size.max(1);
        let extreme = if blocks.kept.len() > most {
            blocks.extreme()
        } else {
            Vec::new()
        };
        let must = |i: usize| blocks.kept[i].ends_phase || extreme[i];
        let shown = thinned(blocks.kept.len(), most, must);
        if shown.len() < blocks.n {
            notes.push(format!(
                "of {} profiles {} are shown; profile.csv has all",
                blocks.n,
                shown.len()
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
            let phase = phases[block.phase].clone();
            Place {
                time: Short(times.of(&phase, block.increment)),
                phase,
                increment: block.increment,
            }
        });
        let values =
            (0..width).map(|column| shown.iter().map(|block| values_at(column, block)).collect());
        Ok(Some(Self {
            increments: places.collect(),
            values: values.collect(),
            columns: names,
            groups,
        }))
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
/// different numbers of points, every point is a station of its own.
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
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
        (low.min(value), high.max(value))
    });
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
