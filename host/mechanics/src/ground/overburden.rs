//! Overburden: the weight above a point, on the same vertical.

use crate::mesh::{Mesh, Solid};
use crate::problem::Water;

/// A node in the middle of an edge within this fraction of the edge's length makes it straight.
const STRAIGHT: f64 = 1e-12;

/// The elements of a mesh by the verticals that cross them.
#[derive(Debug)]
pub struct Columns<'m> {
    mesh: &'m Mesh,
    water: Option<&'m Water>,
    /// Unit weight of every solid above and below the water; `None` for an inactive one.
    weights: Vec<Option<[f64; 2]>>,
    /// Lower and upper corner of every solid.
    boxes: Vec<[[f64; 2]; 2]>,
    /// Solids by vertical strips of equal width.
    strips: Vec<Vec<u32>>,
    start: f64,
    width: f64,
}

impl<'m> Columns<'m> {
    /// Columns of a mesh whose groups have these unit weights (above and below the water, kN/m³); `None` for an
    /// inactive group.
    pub fn new(
        mesh: &'m Mesh,
        water: Option<&'m Water>,
        weight: impl Fn(usize) -> Option<[f64; 2]>,
    ) -> Self {
        let extent = |solid: &Solid| {
            let mut corners = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
            for &node in solid.nodes() {
                for c in 0..2 {
                    corners[0][c] = corners[0][c].min(mesh.nodes[node][c]);
                    corners[1][c] = corners[1][c].max(mesh.nodes[node][c]);
                }
            }
            corners
        };
        let boxes: Vec<[[f64; 2]; 2]> = mesh.solids.iter().map(extent).collect();
        let least = |c: usize| boxes.iter().map(|b| b[0][c]).fold(f64::INFINITY, f64::min);
        let most = |c: usize| {
            boxes
                .iter()
                .map(|b| b[1][c])
                .fold(f64::NEG_INFINITY, f64::max)
        };
        // About as many strips as a square of elements has columns, twice over.
        let n = 1 + 2 * (boxes.len() as f64).sqrt() as usize;
        let (start, width) = (
            least(0),
            ((most(0) - least(0)) / n as f64).max(f64::MIN_POSITIVE),
        );
        let mut columns = Self {
            mesh,
            water,
            weights: mesh
                .solids
                .iter()
                .map(|solid| weight(solid.group))
                .collect(),
            boxes,
            strips: vec![Vec::new(); n],
            start,
            width,
        };
        for number in 0..columns.boxes.len() {
            let [low, high] = columns.boxes[number].map(|corner| columns.strip(corner[0]));
            for strip in &mut columns.strips[low..=high] {
                strip.push(number as u32);
            }
        }
        columns
    }

    fn strip(&self, x: f64) -> usize {
        let last = self.strips.len() - 1;
        (((x - self.start) / self.width) as usize).min(last)
    }

    /// Total vertical stress at a point, compression positive, kPa: the weight of all elements above it
    /// on the same vertical, and of free water on the uppermost.
    pub fn above(&self, [x, y]: [f64; 2]) -> f64 {
        let level = self.water.map(|water| water.level.at(x));
        let (mut sum, mut top) = (0.0, y);
        self.for_chords_above([x, y], |_, [above_water, below_water], [from, to]| {
            top = top.max(to);
            let wet = level.map_or(from, |level| level.clamp(from, to));
            sum += below_water * (wet - from) + above_water * (to - wet);
        });
        let stands = self.water.zip(level);
        sum + stands.map_or(0.0, |(water, level)| {
            water.unit_weight * (level - top).max(0.0)
        })
    }

    /// What `of` says of the lowest group above a point, on the same vertical, of which it says anything.
    pub(super) fn nearest_above(
        &self,
        at: [f64; 2],
        of: impl Fn(usize) -> Option<f64>,
    ) -> Option<f64> {
        let mut nearest: Option<(f64, f64)> = None;
        self.for_chords_above(at, |number, _, [from, _]| {
            if let Some(said) = of(self.mesh.solids[number].group)
                && nearest.is_none_or(|(lowest, _)| from < lowest)
            {
                nearest = Some((from, said));
            }
        });
        nearest.map(|(_, said)| said)
    }

    /// Calls with every element that is there above a point, its unit weights, and between which heights
    /// the vertical runs in it.
    fn for_chords_above(&self, [x, y]: [f64; 2], mut call: impl FnMut(usize, [f64; 2], [f64; 2])) {
        for &number in &self.strips[self.strip(x)] {
            let number = number as usize;
            let [low, high] = self.boxes[number];
            let Some(weights) = self.weights[number] else {
                continue;
            };
            if x < low[0] || x > high[0] || high[1] <= y {
                continue;
            }
            let mut crossings = self.crossings(&self.mesh.solids[number], x);
            for &[from, to] in crossings.chords() {
                let from = from.max(y);
                if to > from {
                    call(number, weights, [from, to]);
                }
            }
        }
    }

    /// Where a vertical crosses the outline of an element.
    fn crossings(&self, solid: &Solid, x: f64) -> Crossings {
        let mut found = Crossings::default();
        for edge in solid.edges() {
            let [a, b, m] = edge.map(|node| self.mesh.nodes[node]);
            // An edge lies between its ends and where its tangents there meet.
            let reach = [a[0], b[0], 2.0 * m[0] - 0.5 * (a[0] + b[0])];
            if reach.iter().all(|at| *at > x) || reach.iter().all(|at| *at < x) {
                continue;
            }
            // x(t) = x_m + t (x_b − x_a)/2 + t² (x_a + x_b − 2 x_m)/2, t from −1 to 1, and y likewise.
            let half = [0, 1].map(|c| 0.5 * (b[c] - a[c]));
            let bend = [0, 1].map(|c| 0.5 * (a[c] + b[c]) - m[c]);
            let length = half[0].hypot(half[1]);
            if bend[0].hypot(bend[1]) <= STRAIGHT * length {
                if crosses(a[0], b[0], x) {
                    found.add(m[1] + (x - m[0]) / half[0] * half[1]);
                }
                continue;
            }
            // Two pieces along which x only grows or only falls, or one.
            let turn = -0.5 * half[0] / bend[0];
            let is_one = turn.is_nan() || turn.abs() >= 1.0;
            let turn = if is_one { 1.0 } else { turn };
            let at_turn = if is_one {
                b[0]
            } else {
                m[0] + turn * (half[0] + turn * bend[0])
            };
            for ([start, end], [from, to]) in [
                ([a[0], at_turn], [-1.0, turn]),
                ([at_turn, b[0]], [turn, 1.0]),
            ] {
                if !crosses(start, end, x) {
                    continue;
                }
                let off = |t: f64| (t.clamp(from, to) - t).abs();
                let roots = solutions(bend[0], half[0], m[0] - x);
                let t = roots.into_iter().flatten();
                let t = t.min_by(|a, b| off(*a).total_cmp(&off(*b)));
                let t = t.unwrap_or(turn).clamp(from, to);
                found.add(m[1] + t * half[1] + t * t * bend[1]);
            }
        }
        found
    }
}

/// Whether the vertical at x crosses a piece of an outline between these. The vertical through the common end of two
/// pieces crosses one of them, or both or neither if they turn back there.
fn crosses(start: f64, end: f64, x: f64) -> bool {
    (start <= x) != (end <= x)
}

/// Heights at which a vertical crosses the outline of an element: twice for each of at most 4 sides.
#[derive(Debug, Default)]
struct Crossings {
    heights: [f64; 8],
    n: usize,
}

impl Crossings {
    fn add(&mut self, height: f64) {
        self.heights[self.n] = height;
        self.n += 1;
    }

    /// Intervals of the vertical inside the elements: every second one between the crossings.
    fn chords(&mut self) -> &[[f64; 2]] {
        let heights = &mut self.heights[..self.n];
        heights.sort_unstable_by(f64::total_cmp);
        heights.as_chunks().0
    }
}

/// Real solutions of a t² + b t + c = 0.
fn solutions(a: f64, b: f64, c: f64) -> [Option<f64>; 2] {
    let discriminant = b * b - 4.0 * a * c;
    if discriminant < 0.0 {
        return [None, None];
    }
    // Without cancellation; where a is tiny the second one is far away.
    let q = -0.5 * (b + discriminant.sqrt().copysign(b));
    let finite = |t: f64| t.is_finite().then_some(t);
    [finite(c / q), finite(q / a)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::problem::Profile;

    fn water(level: f64) -> Water {
        Water {
            level: Profile::from(level),
            unit_weight: 10.0,
        }
    }

    #[test]
    fn layers_and_water_are_added_up() {
        // Two layers, 3 m of 20 (22 below water) over 4 m of 18 (19).
        let mesh = Mesh::grid(&[0.0, 1.0, 2.5], &[0.0, 1.5, 4.0, 7.0], |_, row| {
            usize::from(row == 2)
        });
        let weight = |group| Some([[18.0, 19.0], [20.0, 22.0]][group]);
        let dry = Columns::new(&mesh, None, weight);
        assert!((dry.above([0.3, 0.5]) - (60.0 + 18.0 * 3.5)).abs() < 1e-12);
        let water_table = water(5.0);
        let wet = Columns::new(&mesh, Some(&water_table), weight);
        assert!((wet.above([2.2, 0.5]) - (40.0 + 22.0 + 19.0 * 3.5)).abs() < 1e-12);
        // A lake of 2 m.
        let lake = water(9.0);
        let flooded = Columns::new(&mesh, Some(&lake), weight);
        assert!((flooded.above([0.1, 6.0]) - (20.0 + 22.0)).abs() < 1e-12);
        // Without the upper layer the water stands on the lower one.
        let only = Columns::new(&mesh, Some(&water_table), |group| {
            (group == 0).then_some([18.0, 19.0])
        });
        assert!((only.above([0.1, 3.0]) - (10.0 + 19.0)).abs() < 1e-12);
    }

    /// Two columns of 2 m, 20 and 10 kN/m³, between them a side that is hollow: x = 1 + 0.6 η (1 − η) with y = 2 η.
    #[test]
    fn a_vertical_may_cross_an_element_twice() {
        let mut mesh = Mesh::grid(&[0.0, 1.0, 2.0], &[0.0, 2.0], |column, _| column);
        let middle = mesh.solids[0].nodes()[5];
        mesh.nodes[middle][0] = 1.15;
        let weight = |group: usize| Some([[20.0, 10.0][group]; 2]);
        let columns = Columns::new(&mesh, None, weight);
        // x = 1.1 lies left of the side from η = 0.211 to 0.789.
        let root = (0.25_f64 - 0.1 / 0.6).sqrt();
        let light = 2.0 * (1.0 - 2.0 * root);
        let exact = 10.0 * light + 20.0 * (2.0 - light);
        assert!((columns.above([1.1, 0.0]) - exact).abs() < 1e-12);
        // Through the ends of the side, on both sides of it.
        assert!((columns.above([0.5, 0.0]) - 40.0).abs() < 1e-12);
        assert!((columns.above([1.5, 0.0]) - 20.0).abs() < 1e-12);
        let uniform = Columns::new(&mesh, None, |_| Some([10.0; 2]));
        for x in [1.0, 1.05, 1.15, 1.15 + 1e-12] {
            assert!((uniform.above([x, 0.0]) - 20.0).abs() < 1e-6, "{x}");
        }
    }

    #[test]
    fn curved_sides_are_followed() {
        // A quad whose upper side is the parabola y = 1 + x (1 − x).
        let mut mesh = Mesh::grid(&[0.0, 1.0], &[0.0, 1.0], |_, _| 0);
        let middle = mesh.solids[0].nodes()[6];
        mesh.nodes[middle][1] = 1.25;
        let columns = Columns::new(&mesh, None, |_| Some([10.0, 10.0]));
        for x in [0.1, 0.35, 0.5, 0.8] {
            let height = 1.0 + x * (1.0 - x);
            assert!(
                (columns.above([x, 0.0]) - 10.0 * height).abs() < 1e-12,
                "{x}"
            );
        }
    }

    /// Ground around a circle: the elements outside are entered twice by verticals next to its springline,
    /// and what stands above a point is the whole height all the same.
    #[test]
    fn a_concave_side_is_entered_twice() {
        for n in [8, 12, 20, 28] {
            let mut mesh = Mesh::default();
            let angle = |i: usize| std::f64::consts::TAU * (i as f64 + 0.5) / n as f64;
            let on = |radius: f64, phi: f64| [radius * phi.cos(), radius * phi.sin()];
            // Rings of nodes: inner corners and middles, outer ones, and those between; the middle point.
            let ring = |mesh: &mut Mesh, radius: f64| -> Vec<usize> {
                (0..2 * n)
                    .map(|i| {
                        let phi = angle(0) + std::f64::consts::PI * i as f64 / n as f64;
                        mesh.nodes.push(on(radius, phi));
                        mesh.nodes.len() - 1
                    })
                    .collect()
            };
            let (middle, inner, outer) = (
                ring(&mut mesh, 1.0),
                ring(&mut mesh, 2.0),
                ring(&mut mesh, 4.0),
            );
            let between = ring(&mut mesh, 3.0);
            mesh.nodes.push([0.0, 0.0]);
            let centre = mesh.nodes.len() - 1;
            for i in 0..n {
                let (a, m, b) = (2 * i, 2 * i + 1, (2 * i + 2) % (2 * n));
                let sector = [centre, inner[a], inner[b], middle[a], inner[m], middle[b]];
                mesh.solids.push(Solid::triangle(sector, 0));
                let quad = [
                    inner[a], outer[a], outer[b], inner[b], between[a], outer[m], between[b],
                    inner[m],
                ];
                mesh.solids.push(Solid::quad(quad, 0));
            }
            let columns = Columns::new(&mesh, None, |_| Some([10.0, 10.0]));
            for i in 0..400 {
                let x = -2.2 + 4.4 * f64::from(i) / 399.0;
                // The outline alone: what is there between it and a point does not depend on the circle.
                let whole = columns.above([x, -4.0]);
                let low = columns.above([x, 0.0]);
                let height = 2.0 * low / 10.0;
                assert!(
                    (whole / 10.0 - height).abs() < 1e-9,
                    "{n}, {x}: {whole} {height}"
                );
                let up = columns.above([x, 1.0]);
                assert!((low - up - 10.0).abs() < 1e-9, "{n}, {x}: {low} {up}");
            }
        }
    }
}
