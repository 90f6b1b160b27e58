//! `profile.csv`: values along interfaces.
//!
//! Integration points of one element at the same position along the interface form a station; the
//! rows across the layer are numbered from one face to the other. The page shows the mean over the
//! rows, as probes do, or every row.

use super::short::{Short, thinned};
use super::table::Table;
use serde::Serialize;
use std::collections::HashMap;

/// About so many numbers are shown; of a longer profile some increments are left out.
const MOST_VALUES: usize = 400_000;
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

impl Profile {
    /// Takes over a table with [`COLUMNS`]. `time` gives the time of an increment.
    pub(super) fn new(
        table: &Table,
        time: &HashMap<(String, usize), f64>,
        notes: &mut Vec<String>,
    ) -> Option<Self> {
        let [phase, increment, ..] = COLUMNS.map(|name| table.position(name).unwrap_or(0));
        let key = |row: usize| (table.text(row, phase), table.text(row, increment));
        let mut blocks: Vec<std::ops::Range<usize>> = Vec::new();
        for row in 0..table.n_rows() {
            match blocks.last_mut() {
                Some(block) if key(block.start) == key(row) => block.end = row + 1,
                _ => blocks.push(row..row + 1),
            }
        }
        let points = points(table, blocks.first()?.clone())?;
        let complete = |block: &std::ops::Range<usize>| block.len() == points.len();
        let n = blocks.len();
        blocks.retain(complete);
        if blocks.len() < n {
            notes.push(format!(
                "profile.csv: {} of {n} increments are not complete and left out",
                n - blocks.len()
            ));
        }
        let columns: Vec<usize> = (0..table.columns().len())
            .filter(|&column| !COLUMNS.contains(&table.columns()[column].as_str()))
            .collect();
        let most = MOST_VALUES / (points.len() * columns.len()).max(1);
        let ends_phase = |i: usize| {
            let next = blocks.get(i + 1).map(|block| key(block.start).0);
            next != Some(key(blocks[i].start).0)
        };
        let shown = thinned(blocks.len(), most, ends_phase);
        if shown.len() < blocks.len() {
            notes.push(format!(
                "of {} profiles {} are shown; profile.csv has all",
                blocks.len(),
                shown.len()
            ));
        }
        let (groups, order) = interfaces(&points);
        let values_at = |column: usize, block: usize| {
            let start = blocks[block].start;
            let value = |&point: &usize| Short(table.number(start + point, column));
            order.iter().map(value).collect()
        };
        let places = shown.iter().map(|&block| {
            let (phase, increment) = key(blocks[block].start);
            let increment = increment.parse().unwrap_or(0);
            Place {
                time: Short(time.get(&(phase.to_owned(), increment)).copied()),
                phase: phase.to_owned(),
                increment,
            }
        });
        let values = columns
            .iter()
            .map(|&column| shown.iter().map(|&i| values_at(column, i)).collect());
        Some(Self {
            increments: places.collect(),
            values: values.collect(),
            columns: columns
                .iter()
                .map(|&column| table.columns()[column].clone())
                .collect(),
            groups,
        })
    }
}

fn points(table: &Table, rows: std::ops::Range<usize>) -> Option<Vec<Point>> {
    let [_, _, group, element, _, x, y, s] =
        COLUMNS.map(|name| table.position(name).unwrap_or_default());
    rows.map(|row| {
        Some(Point {
            group: table.text(row, group).to_owned(),
            element: table.count(row, element)?,
            position: [table.number(row, x)?, table.number(row, y)?],
            s: table.number(row, s)?,
        })
    })
    .collect()
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
