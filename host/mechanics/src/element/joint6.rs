//! Zero-thickness elements of three double nodes.

use super::reference::{gauss, line_shape};
use super::{Axes, Kinematics, Traction, depth};
use crate::mesh::Joint;
use crate::problem::{Analysis, Integration};
use std::ops::Range;

/// Zero-thickness elements of one group.
#[derive(Debug)]
pub struct Joint6 {
    /// Three nodes of the minus side, then the three opposite them.
    nodes: Vec<[usize; 6]>,
    axes: Vec<Axes>,
    lengths: Vec<f64>,
    points_per_element: usize,
    points: Vec<Point>,
    /// Elements whose points are their nodes, and whose nodal forces are not exact where a traction is linear: where
    /// they lie.
    inexact: Vec<Option<Side>>,
    analysis: Analysis,
}

/// Where the nodes of an element lie, and how.
#[derive(Clone, Copy, Debug)]
struct Side {
    at: [[f64; 2]; 3],
    chord: Axes,
    is_straight: bool,
}

impl Side {
    fn new(at: [[f64; 2]; 3]) -> Self {
        let along = [at[1][0] - at[0][0], at[1][1] - at[0][1]];
        let chord = Axes::of_facet(along);
        let rise = [0, 1].map(|c| at[2][c] - f64::midpoint(at[0][c], at[1][c]));
        let off = (rise[0] * chord.across[0] + rise[1] * chord.across[1]).abs();
        Self {
            at,
            chord,
            is_straight: off <= STRAIGHT * along[0].hypot(along[1]),
        }
    }

    /// The point at ξ whose weight there is this one.
    fn point(&self, analysis: Analysis, xi: f64, weight: f64) -> Point {
        let (n, d) = line_shape(xi);
        let sum = |f: &[f64; 3], c: usize| -> f64 { (0..3).map(|i| f[i] * self.at[i][c]).sum() };
        let position = [sum(&n, 0), sum(&n, 1)];
        let direction = [sum(&d, 0), sum(&d, 1)];
        let length = direction[0].hypot(direction[1]);
        let axes = if self.is_straight {
            self.chord
        } else {
            self.chord.turned_along(direction)
        };
        Point {
            n,
            weight: weight * length * depth(analysis, position[0]),
            position,
            axes,
        }
    }

    /// Directions at the nodes of the arc through them. Those of the element's own curve are off by 2·10⁻³ at the ends
    /// of an arc of 22°, and others in the element that follows. At an end the arc is turned from the chord to the
    /// middle by as much as that one is from the chord of the other half.
    fn along_arc(&self) -> [[f64; 2]; 3] {
        let [a, b, m] = self.at;
        let to = |from: [f64; 2], to: [f64; 2]| [to[0] - from[0], to[1] - from[1]];
        let [first, second, whole] = [to(a, m), to(m, b), to(a, b)];
        // Angles are added and subtracted as those of complex numbers u v / w.
        let turned = |u: [f64; 2], v: [f64; 2], w: [f64; 2]| {
            let [x, y] = [u[0] * v[0] - u[1] * v[1], u[0] * v[1] + u[1] * v[0]];
            [x * w[0] + y * w[1], y * w[0] - x * w[1]]
        };
        [
            turned(first, whole, second),
            turned(second, whole, first),
            turned(first, second, whole),
        ]
    }

    /// Simpson's rule is exact to the third degree: for N t r where t is linear and the radius constant.
    fn is_exact(&self, analysis: Analysis) -> bool {
        let [a, b, _] = self.at.map(|at| at[0]);
        let is_upright = (b - a).abs() <= STRAIGHT * a.abs();
        self.is_straight && (analysis == Analysis::PlaneStrain || is_upright)
    }
}

/// An integration point: jump = Σ N (u⁺ − u⁻).
#[derive(Clone, Debug)]
struct Point {
    n: [f64; 3],
    weight: f64,
    position: [f64; 2],
    axes: Axes,
}

/// An end is on the axis of symmetry within this part of the element's length.
const ON_AXIS: f64 = 1e-9;
/// A side whose middle lies off its chord by less than this part of it is straight.
const STRAIGHT: f64 = 1e-12;
/// Tractions that differ by less, as a part of the element's largest, are the same.
const SAME: f64 = 1e-12;

/// Places and weights of integration points along an element.
fn rule(integration: Integration, reaches_axis: bool) -> (&'static [f64], &'static [f64]) {
    match integration {
        Integration::Full => gauss(3),
        Integration::Reduced => gauss(2),
        // A node on the axis stands for no area: nothing would hold its two sides together.
        _ if reaches_axis => gauss(3),
        // Simpson's rule.
        _ => (&[-1.0, 1.0, 0.0], &[1.0 / 3.0, 1.0 / 3.0, 4.0 / 3.0]),
    }
}

impl Joint6 {
    /// Elements with Gauss points, or with the nodes as points; those that reach the axis of symmetry have
    /// three Gauss points instead of the nodes.
    pub fn new(
        analysis: Analysis,
        coordinates: &[[f64; 2]],
        joints: &[Joint],
        integration: Integration,
    ) -> Self {
        let mut points = Vec::new();
        let mut axes = Vec::new();
        let mut lengths = Vec::new();
        let mut inexact = Vec::new();
        for joint in joints {
            let side = Side::new(joint.minus.map(|n| coordinates[n]));
            let [start, end, _] = side.at;
            axes.push(side.chord);
            let chord_length = (end[0] - start[0]).hypot(end[1] - start[1]);
            lengths.push(chord_length);
            let reaches_axis = analysis == Analysis::Axisymmetric
                && start[0].min(end[0]) <= ON_AXIS * chord_length;
            let (xi, weights) = rule(integration, reaches_axis);
            let of_rule = xi.iter().zip(weights);
            let own = of_rule.map(|(&xi, &weight)| side.point(analysis, xi, weight));
            let mut own: Vec<Point> = own.collect();
            let is_at_nodes = integration == Integration::Nodes && !reaches_axis;
            if is_at_nodes && !side.is_straight {
                for (point, direction) in own.iter_mut().zip(side.along_arc()) {
                    point.axes = side.chord.turned_along(direction);
                }
            }
            points.extend(own);
            inexact.push((is_at_nodes && !side.is_exact(analysis)).then_some(side));
        }
        let nodes = joints
            .iter()
            .map(|j| std::array::from_fn(|i| if i < 3 { j.minus[i] } else { j.plus[i - 3] }))
            .collect();
        Self {
            nodes,
            axes,
            lengths,
            points_per_element: rule(integration, false).0.len(),
            points,
            inexact,
            analysis,
        }
    }

    fn own(&self, element: usize) -> &[Point] {
        &self.points[self.points_of(element)]
    }
}

impl Kinematics for Joint6 {
    fn n_elements(&self) -> usize {
        self.nodes.len()
    }

    fn n_points(&self) -> usize {
        self.points.len()
    }

    fn points_of(&self, element: usize) -> Range<usize> {
        element * self.points_per_element..(element + 1) * self.points_per_element
    }

    fn place_of(&self, point: usize) -> (usize, usize) {
        let n = self.points_per_element;
        (point / n, point % n)
    }

    fn n_components(&self) -> usize {
        2
    }

    fn nodes(&self, element: usize) -> &[usize] {
        &self.nodes[element]
    }

    fn position(&self, point: usize) -> [f64; 2] {
        self.points[point].position
    }

    fn weight(&self, point: usize) -> f64 {
        self.points[point].weight
    }

    fn volumes(&self, _element: usize) -> &[f64] {
        &[]
    }

    fn length(&self, element: usize) -> f64 {
        self.lengths[element]
    }

    fn axes(&self, element: usize) -> Axes {
        self.axes[element]
    }

    fn axes_at(&self, point: usize) -> Axes {
        self.points[point].axes
    }

    fn add_gradients(&self, displacement: &[f64], out: &mut [f64]) {
        let mut jumps = out.chunks_exact_mut(2);
        for (element, nodes) in self.nodes.iter().enumerate() {
            let u = |node: usize, c: usize| displacement[2 * node + c];
            for (point, jump) in self.own(element).iter().zip(&mut jumps) {
                let opening: [f64; 2] = std::array::from_fn(|c| {
                    (0..3)
                        .map(|i| point.n[i] * (u(nodes[i + 3], c) - u(nodes[i], c)))
                        .sum()
                });
                let axes = &point.axes;
                jump[0] += axes.across[0] * opening[0] + axes.across[1] * opening[1];
                jump[1] += axes.along[0] * opening[0] + axes.along[1] * opening[1];
            }
        }
    }

    fn add_forces(&self, flux: &[f64], force: &mut [f64]) {
        let mut tractions = flux.chunks_exact(2);
        for (element, nodes) in self.nodes.iter().enumerate() {
            for (point, t) in self.own(element).iter().zip(&mut tractions) {
                for c in 0..2 {
                    let traction = point.axes.across[c] * t[0] + point.axes.along[c] * t[1];
                    for i in 0..3 {
                        let f = point.weight * point.n[i] * traction;
                        force[2 * nodes[i] + c] -= f;
                        force[2 * nodes[i + 3] + c] += f;
                    }
                }
            }
        }
    }

    fn gathered(&self, element: usize, traction: Traction<'_>) -> Option<Vec<[f64; 2]>> {
        let side = self.inexact[element]?;
        let global = |point: &Point| {
            let [normal, shear] = traction(point.position, &point.axes);
            let Axes { along, across } = point.axes;
            [0, 1].map(|c| across[c] * normal + along[c] * shear)
        };
        // Of the seventh degree on a curve: N 2, σ 2, the normal 1, r 2.
        let mut forces = [[0.0; 2]; 3];
        let (xi, weights) = gauss(4);
        for (&xi, &weight) in xi.iter().zip(weights) {
            let point = side.point(self.analysis, xi, weight);
            let traction = global(&point);
            for (force, n) in forces.iter_mut().zip(point.n) {
                (0..2).for_each(|c| force[c] += point.weight * n * traction[c]);
            }
        }
        let own = self.own(element);
        let at_points = own.iter().map(|p| traction(p.position, &p.axes));
        let at_points: Vec<[f64; 2]> = at_points.collect();
        let sizes = at_points.iter().flatten().map(|t| t.abs());
        let size = sizes.fold(0.0, f64::max);
        let at_node = |((point, force), found): ((&Point, [f64; 2]), &[f64; 2])| {
            let along = |axis: [f64; 2]| (axis[0] * force[0] + axis[1] * force[1]) / point.weight;
            let exact = [along(point.axes.across), along(point.axes.along)];
            // Rounding is no difference.
            let is_other = (0..2).any(|c| (exact[c] - found[c]).abs() > SAME * size);
            if is_other { exact } else { *found }
        };
        Some(
            own.iter()
                .zip(forces)
                .zip(&at_points)
                .map(at_node)
                .collect(),
        )
    }

    fn stiffness(&self, element: usize, tangent: &[f64], out: &mut [f64]) {
        out.fill(0.0);
        for (point, tangent) in self.own(element).iter().zip(tangent.chunks_exact(4)) {
            let directions = [point.axes.across, point.axes.along];
            // The law's 2 × 2 tangent in global axes.
            let d = |c: usize, e: usize| -> f64 {
                let pairs = (0..2).flat_map(|i| (0..2).map(move |j| (i, j)));
                pairs
                    .map(|(i, j)| directions[i][c] * tangent[2 * i + j] * directions[j][e])
                    .sum()
            };
            let d = [[d(0, 0), d(0, 1)], [d(1, 0), d(1, 1)]];
            for i in 0..6 {
                for j in 0..6 {
                    let sign = if (i < 3) == (j < 3) { 1.0 } else { -1.0 };
                    let weight = sign * point.weight * point.n[i % 3] * point.n[j % 3];
                    for c in 0..2 {
                        for e in 0..2 {
                            out[(2 * i + c) * 12 + 2 * j + e] += weight * d[c][e];
                        }
                    }
                }
            }
        }
    }
}
