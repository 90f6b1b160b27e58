//! Ground that drags the pile down: neutral plane, largest axial force, dragload.

use super::Station;
use super::rows::{Row, Span};

/// Friction below this share of the largest stress along the shaft is none.
const NONE: f64 = 1e-6;
/// The ground drags the pile down over this share of the shaft's length at least, or not at all.
const LEAST: f64 = 0.1;

/// Effect on a pile of ground that settles more than the pile.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Downdrag {
    /// Height at which friction changes from downward above to upward below, m.
    pub neutral_plane: Option<f64>,
    /// There; without it the largest, kN.
    pub max_axial_force: f64,
    /// The downward friction above it, kN, positive.
    pub dragload: f64,
}

impl Downdrag {
    /// That of a pile in a state.
    pub(super) fn of(spans: &[Span], rows: &[Row], stations: &[Station]) -> Self {
        let forces = stations.iter().map(|station| station.axial_force);
        let none = Self {
            max_axial_force: forces.fold(f64::NEG_INFINITY, f64::max),
            ..Self::default()
        };
        let friction = friction(stations);
        let length: f64 = spans
            .iter()
            .filter(|span| !span.is_gap())
            .map(|span| span.z[0] - span.z[1])
            .sum();
        let z = |row: usize| stations[row].z;
        for upper in (0..friction.len().saturating_sub(1)).rev() {
            let pair = [friction[upper], friction[upper + 1]];
            let below = friction[upper + 1..].iter().find(|value| **value != 0.0);
            if !(pair[0] < 0.0 && pair[1] >= 0.0 && below.is_some_and(|value| *value > 0.0)) {
                continue;
            }
            let t = pair[0] / (pair[0] - pair[1]);
            let plane = z(upper) + t * (z(upper + 1) - z(upper));
            let top = (0..upper).rev().find(|&row| friction[row] >= 0.0);
            let top = top.map_or(z(0), |row| {
                let [a, b] = [friction[row], friction[row + 1]];
                z(row) + a / (a - b) * (z(row + 1) - z(row))
            });
            if top - plane < LEAST * length {
                continue;
            }
            let forces = [upper, upper + 1].map(|row| stations[row].axial_force);
            let piece = piece(spans, rows, upper);
            // Between the two rows friction is linear, and the force is a parabola.
            let bend = 0.5 * piece * (pair[1] - pair[0]) * t * (1.0 - t);
            return Self {
                neutral_plane: Some(plane),
                max_axial_force: forces[0] + t * (forces[1] - forces[0]) + bend,
                dragload: dragload(spans, rows, &friction, upper),
            };
        }
        none
    }
}

/// Friction at each station, without round-off.
fn friction(stations: &[Station]) -> Vec<f64> {
    let stresses = stations
        .iter()
        .flat_map(|station| [station.shaft_friction, station.normal_stress]);
    let largest = stresses.flatten().fold(0.0, |m: f64, v| m.max(v.abs()));
    let of = |station: &Station| {
        let value = station.shaft_friction;
        value.filter(|value| value.abs() > NONE * largest)
    };
    stations.iter().map(|s| of(s).unwrap_or(0.0)).collect()
}

/// Area of the shaft between a row and the next, m².
fn piece(spans: &[Span], rows: &[Row], upper: usize) -> f64 {
    let of = |row: &Row| row.at.iter().map(|(span, _)| *span).collect::<Vec<_>>();
    let below = of(&rows[upper + 1]);
    let both = of(&rows[upper])
        .into_iter()
        .find(|span| below.contains(span));
    let is_height = rows[upper].z > rows[upper + 1].z;
    both.filter(|_| is_height)
        .map_or(0.0, |span| 0.5 * spans[span].area)
}

/// The downward friction down to the one between a row and the next.
fn dragload(spans: &[Span], rows: &[Row], friction: &[f64], last: usize) -> f64 {
    let mut sum = 0.0;
    let mut row = 0;
    while row <= last {
        let area = piece(spans, rows, row);
        let of_three = friction[row..].first_chunk();
        // The three rows of an element along which the ground only drags down are integrated by Simpson's rule.
        let is_element = rows[row + 1].at.iter().any(|(_, part)| *part == 1);
        if let Some(&[a, m, b]) = of_three
            && is_element
            && row < last
            && a.max(m).max(b) <= 0.0
        {
            sum += 2.0 * area * (a + 4.0 * m + b) / 6.0;
            row += 2;
            continue;
        }
        let [a, b] = [friction[row], friction[row + 1]];
        let [low, high] = [a.min(b), a.max(b)];
        sum += area
            * if low >= 0.0 {
                0.0
            } else if high <= 0.0 {
                f64::midpoint(a, b)
            } else {
                -0.5 * low * low / (high - low)
            };
        row += 1;
    }
    -sum
}
