//! What stands above a point, on the same vertical.

use crate::mesh::{Mesh, Solid};
use crate::problem::Water;

/// A node in the middle of an edge within this fraction of the edge's length makes it straight.
const STRAIGHT: f64 = 1e-12;

/// The elements of a mesh by the verticals that cross them.
#[derive(Debug)]
pub struct Columns<'m> {
    mesh: &'m Mesh,
    water: Option<&'m Water>,
    /// Unit weight of every solid above and below the water; `None` of one that is not there.
    weights: Vec<Option<[f64; 2]>>,
    /// Lower and upper corner of every solid.
    boxes: Vec<[[f64; 2]; 2]>,
    /// Solids by vertical strips of equal width.
    strips: Vec<Vec<u32>>,
    start: f64,
    width: f64,
}

impl<'m> Columns<'m> {
    /// Of a mesh whose groups have these unit weights (above and below the water, kN/m³); `None` of a
    /// group that is not there.
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
    /// on the same vertical, and of the water that stands on the uppermost.
    pub fn above(&self, [x, y]: [f64; 2]) -> f64 {
        let level = self.water.map(|water| water.level.at(x));
        let (mut sum, mut top) = (0.0, y);
        for &number in &self.strips[self.strip(x)] {
            let number = number as usize;
            let [low, high] = self.boxes[number];
            let Some([above_water, below_water]) = self.weights[number] else {
                continue;
            };
            if x < low[0] || x > high[0] || high[1] <= y {
                continue;
            }
            for part in self.crossings(&self.mesh.solids[number], x).chunks_exact(2) {
                let (from, to) = (part[0].max(y), part[1]);
                if to <= from {
                    continue;
                }
                top = top.max(to);
                let wet = level.map_or(from, |level| level.clamp(from, to));
                sum += below_water * (wet - from) + above_water * (to - wet);
            }
        }
        let stands = self.water.zip(level);
        sum + stands.map_or(0.0, |(water, level)| {
            water.unit_weight * (level - top).max(0.0)
        })
    }

    /// Where a vertical enters an element and leaves it, in turn from below: more than once where sides are
    /// hollow.
    fn crossings(&self, solid: &Solid, x: f64) -> Vec<f64> {
        let mut all = Vec::with_capacity(2);
        for edge in solid.edges() {
            let [a, b, m] = edge.map(|node| self.mesh.nodes[node]);
            // x(t) = x_m + t (x_b − x_a)/2 + t² (x_a + x_b − 2 x_m)/2, t from −1 to 1, and y likewise.
            let half = [0, 1].map(|c| 0.5 * (b[c] - a[c]));
            let bend = [0, 1].map(|c| 0.5 * (a[c] + b[c]) - m[c]);
            let is_straight = bend[0].hypot(bend[1]) <= STRAIGHT * half[0].hypot(half[1]);
            // Where x turns round.
            let turn = -0.5 * half[0] / bend[0];
            let turn = (!is_straight && turn.abs() < 1.0).then_some(turn);
            let at_turn = turn.map(|t| (t, m[0] + t * half[0] + t * t * bend[0]));
            let ends = [(-1.0, a[0])].into_iter().chain(at_turn);
            let ends: Vec<(f64, f64)> = ends.chain([(1.0, b[0])]).collect();
            for piece in ends.windows(2) {
                let [(t_0, x_0), (t_1, x_1)] = [piece[0], piece[1]];
                // Of two pieces that share an end the vertical through it crosses one, or both or neither
                // where it only touches them.
                if (x_0 <= x) == (x_1 <= x) {
                    continue;
                }
                let t = if is_straight {
                    (x - m[0]) / half[0]
                } else {
                    let middle = f64::midpoint(t_0, t_1);
                    let off = |t: &f64| (t - middle).abs();
                    let found = solutions(bend[0], half[0], m[0] - x).into_iter().flatten();
                    let nearest = found.min_by(|a, b| off(a).total_cmp(&off(b)));
                    nearest.unwrap_or(middle).clamp(t_0, t_1)
                };
                all.push(m[1] + t * half[1] + t * t * bend[1]);
            }
        }
        all.sort_unstable_by(f64::total_cmp);
        all
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
}
