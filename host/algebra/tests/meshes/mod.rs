//! Meshes for tests and benches, as patterns of matrices with two unknowns a node.

use algebra::Pattern;
use std::collections::HashMap;

/// Elements by their nodes, and where nodes lie.
pub(crate) struct Mesh {
    pub(crate) positions: Vec<[f64; 2]>,
    pub(crate) elements: Vec<Vec<usize>>,
}

/// Numbers that look random, the same ones every time (SplitMix64).
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let x = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ (x >> 31)
    }

    /// Between −1 and 1.
    fn signed(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }
}

/// 8-node quads in `n` columns and rows, numbered row by row.
pub(crate) fn grid(n: usize) -> Mesh {
    quads(n, |x, y| [x, y])
}

/// The quads of [`grid`], corners shifted by up to a quarter of a cell, nodes numbered at random.
pub(crate) fn scattered_quads(n: usize) -> Mesh {
    let mut numbers = Numbers(5);
    let mesh = quads(n, shifted(&mut Numbers(7), [n, n], |x, y| [x, y]));
    mesh.renumbered(&mut numbers)
}

/// 6-node triangles: the cells of a grid of `n` columns and rows, cut along either diagonal at
/// random, numbered row by row.
pub(crate) fn regular(n: usize) -> Mesh {
    triangles([n, n], |x, y| [x, y])
}

/// The triangles of [`regular`], corners shifted by up to a quarter of a cell, nodes numbered at
/// random.
pub(crate) fn scattered(n: usize) -> Mesh {
    let mesh = triangles([n, n], shifted(&mut Numbers(7), [n, n], |x, y| [x, y]));
    mesh.renumbered(&mut Numbers(5))
}

/// As [`scattered`], cells ever smaller towards a corner, down to 1/200 of the largest.
pub(crate) fn graded(n: usize) -> Mesh {
    let small = |t: f64| (200.0_f64.powf(t) - 1.0) / 199.0;
    let size = [2 * n / 3, 3 * n / 2];
    let place = move |x, y| [small(x), small(y)];
    let mesh = triangles(size, shifted(&mut Numbers(7), size, place));
    mesh.renumbered(&mut Numbers(5))
}

fn shifted(
    numbers: &mut Numbers,
    [columns, rows]: [usize; 2],
    place: impl Fn(f64, f64) -> [f64; 2],
) -> impl FnMut(f64, f64) -> [f64; 2] {
    move |x, y| {
        let (dx, dy) = (numbers.signed(), numbers.signed());
        place(x + 0.25 * dx / columns as f64, y + 0.25 * dy / rows as f64)
    }
}

fn quads(n: usize, place: impl FnMut(f64, f64) -> [f64; 2]) -> Mesh {
    let mut mesh = Corners::new([n, n], place);
    for j in 0..n {
        for i in 0..n {
            let cell = mesh.cell(i, j);
            mesh.elements.push(cell.to_vec());
        }
    }
    mesh.with_middles()
}

fn triangles([columns, rows]: [usize; 2], place: impl FnMut(f64, f64) -> [f64; 2]) -> Mesh {
    let mut numbers = Numbers(3);
    let mut mesh = Corners::new([columns, rows], place);
    for j in 0..rows {
        for i in 0..columns {
            let [a, b, c, d] = mesh.cell(i, j);
            mesh.elements.extend(if numbers.below(2) == 0 {
                [vec![a, b, c], vec![a, c, d]]
            } else {
                [vec![a, b, d], vec![b, c, d]]
            });
        }
    }
    mesh.with_middles()
}

/// Corners and which of them make elements.
struct Corners {
    columns: usize,
    positions: Vec<[f64; 2]>,
    elements: Vec<Vec<usize>>,
}

impl Corners {
    fn new([columns, rows]: [usize; 2], mut place: impl FnMut(f64, f64) -> [f64; 2]) -> Self {
        let mut positions = Vec::new();
        for j in 0..=rows {
            for i in 0..=columns {
                positions.push(place(i as f64 / columns as f64, j as f64 / rows as f64));
            }
        }
        Self {
            columns,
            positions,
            elements: Vec::new(),
        }
    }

    /// Counter-clockwise.
    fn cell(&self, i: usize, j: usize) -> [usize; 4] {
        let corners = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)];
        corners.map(|(i, j)| j * (self.columns + 1) + i)
    }

    /// A node in the middle of every edge.
    fn with_middles(self) -> Mesh {
        let mut positions = self.positions;
        let mut middles = HashMap::new();
        let mut elements = self.elements;
        for nodes in &mut elements {
            let n = nodes.len();
            for i in 0..n {
                let (a, b) = (nodes[i], nodes[(i + 1) % n]);
                let middle = *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                    positions.push([0, 1].map(|c| f64::midpoint(positions[a][c], positions[b][c])));
                    positions.len() - 1
                });
                nodes.push(middle);
            }
        }
        Mesh {
            positions,
            elements,
        }
    }
}

impl Mesh {
    fn renumbered(self, numbers: &mut Numbers) -> Self {
        let n = self.positions.len();
        let mut new: Vec<usize> = (0..n).collect();
        for last in (1..n).rev() {
            new.swap(last, numbers.below(last + 1));
        }
        let mut positions = vec![[0.0; 2]; n];
        for (old, at) in self.positions.into_iter().enumerate() {
            positions[new[old]] = at;
        }
        let elements = self.elements.into_iter();
        Self {
            positions,
            elements: elements
                .map(|nodes| nodes.iter().map(|&node| new[node]).collect())
                .collect(),
        }
    }

    /// The pattern of two unknowns a node, none of them held.
    pub(crate) fn pattern(&self) -> Pattern {
        let n = 2 * self.positions.len();
        let equation: Vec<Option<usize>> = (0..n).map(Some).collect();
        let both = |nodes: &Vec<usize>| {
            nodes
                .iter()
                .flat_map(|&node| [2 * node, 2 * node + 1])
                .collect()
        };
        let elements: Vec<Vec<usize>> = self.elements.iter().map(both).collect();
        Pattern::new(n, &equation, elements.iter().map(Vec::as_slice))
    }

    /// Mesh lines of the unknowns.
    pub(crate) fn lines(&self) -> Vec<[u32; 2]> {
        let lines = algebra::mesh_lines(&self.positions).into_iter();
        lines.flat_map(|line| [line, line]).collect()
    }
}

/// Values of a matrix that is positive definite, symmetric but for `skew`.
pub(crate) fn values(pattern: &Pattern, skew: f64) -> Vec<f64> {
    let mut values = Vec::with_capacity(pattern.rows.len());
    for column in 0..pattern.n() {
        let rows = pattern.column(column);
        for &row in rows {
            let row = row as usize;
            let (low, high) = (row.min(column), row.max(column));
            let coupling = -1.0 - 0.1 * ((31 * low + 17 * high) % 11) as f64;
            values.push(match row.cmp(&column) {
                std::cmp::Ordering::Equal => 0.01 + 1.6 * (rows.len() - 1) as f64,
                std::cmp::Ordering::Greater => coupling * (1.0 + skew),
                std::cmp::Ordering::Less => coupling * (1.0 - skew),
            });
        }
    }
    values
}
