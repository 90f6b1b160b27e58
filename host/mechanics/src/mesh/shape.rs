//! Areas and angles of solid elements, which of them cannot be computed, and lengths of lines.

use super::{Line, Mesh, Solid};
use crate::element::Axes;
use crate::element::kind::Elements;
use crate::problem::{Analysis, Integration};
use std::collections::HashSet;
use std::f64::consts::TAU;

impl Mesh {
    /// Nodes of a line's edges (first end, second end, middle); once where two bodies meet.
    pub fn edges_once(&self, line: &Line) -> Vec<[usize; 3]> {
        let mut seen = HashSet::new();
        let all = line.edges.iter().map(|&edge| self.edge(edge));
        all.filter(|[_, _, middle]| seen.insert(self.nodes[*middle].map(f64::to_bits)))
            .collect()
    }

    /// Length of an edge from its first end over its middle to its second end, m.
    pub fn length(&self, [a, b, middle]: [usize; 3]) -> f64 {
        let to = |a: usize, b: usize| {
            f64::hypot(
                self.nodes[b][0] - self.nodes[a][0],
                self.nodes[b][1] - self.nodes[a][1],
            )
        };
        to(a, middle) + to(middle, b)
    }

    /// How far the middle node of an edge (first end, second end, middle) lies off the middle between its ends: along it
    /// and across it, as parts of their distance.
    pub fn off_middle(&self, edge: [usize; 3]) -> [f64; 2] {
        let [a, b, m] = edge.map(|node| self.nodes[node]);
        let along = [0, 1].map(|c| b[c] - a[c]);
        let off = [0, 1].map(|c| m[c] - f64::midpoint(a[c], b[c]));
        let square = along[0] * along[0] + along[1] * along[1];
        let dot = along[0] * off[0] + along[1] * off[1];
        [dot, cross(along, off)].map(|part| (part / square).abs())
    }
}

impl Solid {
    /// Its area with its sides as parabolas, m²; negative if it goes round clockwise. `at` are coordinates of all
    /// nodes, m.
    pub fn area(&self, at: &[[f64; 2]]) -> f64 {
        let origin = at[self.nodes()[0]];
        let sides = self.edges().map(|side| {
            let [a, b, middle] = side.map(|node| [0, 1].map(|c| at[node][c] - origin[c]));
            let along = [0, 1].map(|c| b[c] - a[c]);
            let rise = [0, 1].map(|c| middle[c] - 0.5 * (a[c] + b[c]));
            // Below the chord, and between it and the parabola.
            0.5 * cross(a, b) + 2.0 / 3.0 * cross(rise, along)
        });
        sides.sum()
    }

    /// Angles at its corners between the tangents of its sides, from 0 to 2π. Beyond π the Jacobian is negative there.
    /// `at` are coordinates of all nodes, m.
    pub fn angles(&self, at: &[[f64; 2]]) -> impl Iterator<Item = f64> {
        let tangent = |corner: usize, other: usize, middle: usize| {
            [0, 1].map(|c| 4.0 * at[middle][c] - 3.0 * at[corner][c] - at[other][c])
        };
        let sides: Vec<[usize; 3]> = self.edges().collect();
        let last = sides.len() - 1;
        (0..=last).map(move |number| {
            let [corner, next, middle] = sides[number];
            let [before, _, middle_before] = sides[if number == 0 { last } else { number - 1 }];
            let ahead = tangent(corner, next, middle);
            let back = tangent(corner, before, middle_before);
            let dot = ahead[0] * back[0] + ahead[1] * back[1];
            cross(ahead, back).atan2(dot).rem_euclid(TAU)
        })
    }

    /// Its scaled Jacobian: the least sine of its angles and of those between lines of its coordinates at its other nodes,
    /// of a triangle times 2/√3; 1 for a square and an equilateral triangle, 0 or less where the Jacobian is not positive
    /// at a node. `at` are coordinates of all nodes, m.
    pub fn scaled_jacobian(&self, at: &[[f64; 2]]) -> f64 {
        let scale = if self.n_corners() == 3 {
            2.0 / 3.0_f64.sqrt()
        } else {
            1.0
        };
        let places: Vec<[f64; 2]> = self.nodes().iter().map(|&node| at[node]).collect();
        let beyond_corners = self.kind.places[self.n_corners()..].iter();
        let beyond_corners = beyond_corners.map(|&place| {
            let [xi, eta] = (self.kind.tangents)(place, &places);
            // In a triangle the third side is a line of its coordinates too.
            let third = if self.n_corners() == 3 {
                f64::hypot(eta[0] - xi[0], eta[1] - xi[1])
            } else {
                0.0
            };
            let mut lengths = [f64::hypot(xi[0], xi[1]), f64::hypot(eta[0], eta[1]), third];
            lengths.sort_by(f64::total_cmp);
            cross(xi, eta) / (lengths[1] * lengths[2])
        });
        let sines = self.angles(at).map(f64::sin).chain(beyond_corners);
        scale * sines.fold(f64::INFINITY, f64::min)
    }

    /// Whether no group can have it: a Jacobian is not positive, or it reaches across the axis. `at` are coordinates
    /// of all nodes, m.
    pub fn is_degenerate(&self, analysis: Analysis, at: &[[f64; 2]]) -> bool {
        let places: Vec<[f64; 2]> = self.nodes().iter().map(|&node| at[node]).collect();
        let points = (self.kind.points)(Integration::Full, &places);
        let points = points.unwrap_or(self.kind.fine);
        let built = (self.kind.build)(Elements {
            analysis,
            coordinates: at,
            nodes: &[self.nodes()],
            axes: vec![Axes::GLOBAL],
            points: &|_| points,
        });
        built.is_err()
    }
}

fn cross(p: [f64; 2], q: [f64; 2]) -> f64 {
    p[0] * q[1] - p[1] * q[0]
}
