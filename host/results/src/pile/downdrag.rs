//! Ground that drags the pile down: neutral plane, largest axial force, dragload.

use super::Station;
use super::rows::{Row, Span};

/// Friction below this share of the largest stress along the shaft is none.
const NONE: f64 = 1e-6;
/// The ground drags the pile down over this share of the shaft's length at least, or not at all.
const LEAST: f64 = 0.1;
/// Pieces of an element in which friction counts as of one direction.
const PIECES: usize = 64;

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
            let bend = Element::at(spans, rows, &friction, upper)
                .map_or(0.0, |element| element.bend(upper, t));
            return Self {
                neutral_plane: Some(plane),
                max_axial_force: forces[0] + t * (forces[1] - forces[0]) + bend,
                dragload: dragload(spans, rows, &friction, (upper, t)),
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

/// An element of the shaft, along which friction is a parabola.
struct Element {
    /// Its upper row; the middle and the lower one follow.
    first: usize,
    /// m².
    area: f64,
    /// At the three rows, kPa.
    friction: [f64; 3],
}

impl Element {
    /// The one between a row and the next.
    fn at(spans: &[Span], rows: &[Row], friction: &[f64], row: usize) -> Option<Self> {
        let below = &rows.get(row + 1)?.at;
        let is_next = |(span, part): &&(usize, usize)| below.contains(&(*span, part + 1));
        let &(span, part) = rows[row].at.iter().find(is_next)?;
        let first = row - part;
        Some(Self {
            first,
            area: spans[span].area,
            friction: *friction.get(first..)?.first_chunk()?,
        })
    }

    /// The force of friction on its part from the top to a share of its height, kN.
    fn force(&self, share: f64) -> f64 {
        let [a, m, b] = self.friction;
        let [slope, curvature] = [4.0 * m - 3.0 * a - b, 2.0 * (a - 2.0 * m + b)];
        self.area * share * (a + share * (slope / 2.0 + share * curvature / 3.0))
    }

    /// What the axial force at a part `t` of the way from a row to the next exceeds that on the straight line by, kN.
    fn bend(&self, row: usize, t: f64) -> f64 {
        let start = 0.5 * (row - self.first) as f64;
        let [above, here, below] = [0.0, 0.5 * t, 0.5].map(|further| self.force(start + further));
        t * (below - above) - (here - above)
    }
}

/// The downward friction above a place: row, and part of the way to the next.
fn dragload(spans: &[Span], rows: &[Row], friction: &[f64], (last, t): (usize, f64)) -> f64 {
    let mut sum = 0.0;
    let mut row = 0;
    while row <= last {
        let Some(element) = Element::at(spans, rows, friction, row) else {
            // Rows of two laws at one height, or no shaft.
            row += 1;
            continue;
        };
        let end = f64::min(1.0, 0.5 * ((last - row) as f64 + t));
        let above = &friction[row..=last.min(row + 2)];
        sum += if above.iter().all(|value| *value <= 0.0) {
            element.force(end)
        } else {
            let pieces = (PIECES as f64 * end).ceil() as usize;
            let at = |piece: usize| element.force(end * piece as f64 / pieces as f64);
            (0..pieces)
                .map(|piece| f64::min(at(piece + 1) - at(piece), 0.0))
                .sum()
        };
        row += 2;
    }
    -sum
}
