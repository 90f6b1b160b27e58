//! Matrices of elements, and the matrix they add up to.

use super::{ElementMap, System};
use crate::group::Group;
use algebra::{largest, threads};
use std::ops::Range;

/// Elements that one thread takes at a time.
pub(super) const PIECE: usize = 256;
/// Pieces that are computed before their matrices are added up.
const ROUND: usize = 4;
/// Parts of the columns that are added up at the same time.
const PARTS: usize = 4;

/// Matrices of the elements of a [`System`] and their sum, for the next time they are added up.
#[derive(Debug, Default)]
pub struct Elements {
    /// For every group.
    pieces: Vec<Vec<Piece>>,
    values: Vec<f64>,
    largest: Vec<f64>,
    changed: Vec<bool>,
}

impl Elements {
    /// The matrix, by place in the system's pattern.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Largest absolute value of every column.
    pub fn largest(&self) -> &[f64] {
        &self.largest
    }

    /// For every equation, whether its row and its column may differ from those of the time before; an
    /// entry differs only where both of its equations may.
    pub fn changed(&self) -> &[bool] {
        &self.changed
    }

    /// The matrix, which no longer exists.
    pub fn take(&mut self) -> Vec<f64> {
        std::mem::take(&mut self.values)
    }

    /// Bytes of what is kept.
    pub fn bytes(&self) -> u64 {
        let of_piece = |piece: &Piece| {
            let tangents = piece.tangents.as_deref().unwrap_or_default();
            size_of_val(&*piece.matrices) + size_of_val(tangents)
        };
        let of_pieces: usize = self.pieces.iter().flatten().map(of_piece).sum();
        (of_pieces + size_of_val(&*self.values) + size_of_val(&*self.largest)) as u64
    }
}

impl System {
    /// The tangent matrix from the groups' tangents.
    pub fn assemble(&self, groups: &[Group], values: &mut Vec<f64>) {
        values.clear();
        values.resize(self.pattern.rows.len(), 0.0);
        let mut pieces: Vec<Piece> = (0..ROUND).map(|_| Piece::default()).collect();
        for (group, maps) in groups.iter().zip(&self.elements) {
            for (round, maps) in maps.chunks(ROUND * PIECE).enumerate() {
                for piece in &mut pieces {
                    piece.matrices.clear();
                }
                renew(group, ROUND * PIECE * round, maps, &mut pieces);
                let parts = self.parts(values, &mut []);
                each(parts, maps.len() > PIECE, |mut part| {
                    part.add_all(maps, &pieces);
                });
            }
        }
    }

    /// Whether its matrix is always the same: all groups that take part are linear.
    pub fn is_constant(&self, groups: &[Group]) -> bool {
        let mut included = (groups.iter().enumerate()).filter(|(number, _)| self.includes(*number));
        included.all(|(_, group)| group.is_linear())
    }

    /// Bytes of the [`Elements`] that the system keeps from one matrix to the next, if there is a next one:
    /// matrices, and tangents that may change.
    pub fn bytes_of_elements(&self, groups: &[Group]) -> u64 {
        if self.is_constant(groups) {
            return 0;
        }
        let of_group = |(group, maps): (&Group, &Vec<ElementMap>)| {
            let matrices: usize = maps.iter().map(|map| map.slots.len()).sum();
            let times = if group.constant_tangents().is_some() {
                maps.len().div_ceil(PIECE)
            } else {
                usize::from(!maps.is_empty())
            };
            matrices + times * group.tangents().len()
        };
        let of_groups: usize = groups.iter().zip(&self.elements).map(of_group).sum();
        let numbers = of_groups + self.pattern.rows.len() + self.free.len();
        (numbers * size_of::<f64>()) as u64
    }

    /// As [`Self::assemble`], for the same bits with less work: matrices of elements whose tangents
    /// are those of the last time are still there, and so are sums of nothing else. `kept` is one of
    /// this system alone. If the matrix never changes, nothing else is kept.
    pub fn assemble_after(&self, kept: &mut Elements, groups: &[Group]) {
        let Elements {
            pieces,
            values,
            largest,
            changed,
        } = kept;
        if self.is_constant(groups) {
            self.assemble(groups, values);
            let columns = (0..self.free.len()).map(|column| self.pattern.places(column));
            *largest = columns
                .map(|places| algebra::largest(&values[places]))
                .collect();
            *changed = vec![true; self.free.len()];
            return;
        }
        let is_new = pieces.is_empty();
        pieces.resize_with(groups.len(), Vec::new);
        changed.clear();
        changed.resize(self.free.len(), is_new);
        values.resize(self.pattern.rows.len(), 0.0);
        largest.resize(self.free.len(), 0.0);
        for ((group, maps), pieces) in groups.iter().zip(&self.elements).zip(&mut *pieces) {
            pieces.resize_with(maps.len().div_ceil(PIECE), Piece::kept);
            renew(group, 0, maps, pieces);
            let renewed = pieces.iter().flat_map(|piece| &piece.renewed);
            for dof in renewed.flat_map(|&element| &maps[element].dofs) {
                if let Some(equation) = self.equation[*dof] {
                    changed[equation] = true;
                }
            }
        }
        let is_shared = self.elements.iter().map(Vec::len).sum::<usize>() > PIECE;
        each(self.parts(values, largest), is_shared, |mut part| {
            part.clear(self, changed);
            for (maps, pieces) in self.elements.iter().zip(&*pieces) {
                part.add(self, changed, (maps, pieces));
            }
            part.measure(self, changed);
        });
    }

    /// Whether what [`Self::assemble_after`] has added up last is the matrix of the tangents that the groups hold.
    pub fn is_sum_of_tangents(&self, kept: &Elements, groups: &[Group]) -> bool {
        if kept.pieces.is_empty() {
            return false;
        }
        let of_groups = groups.iter().zip(&self.elements).zip(&kept.pieces);
        let pieces = of_groups.flat_map(|((group, maps), pieces)| {
            let elements = (0..maps.len()).step_by(PIECE);
            elements.zip(pieces).map(move |(first, piece)| {
                let last = maps.len().min(first + PIECE);
                (group, first..last, piece)
            })
        });
        let is_of_tangents = |(group, elements, piece): (&Group, _, &Piece)| {
            let kept = piece.tangents.as_deref().unwrap_or_default();
            match group.constant_tangents() {
                Some(constant) => is_same(kept, constant),
                None => is_same(kept, group.tangents_of(elements)),
            }
        };
        threads::map(pieces, is_of_tangents)
            .into_iter()
            .all(|is| is)
    }

    /// The values of the matrix, and what is there for every column, in parts of some columns.
    fn parts<'v>(&self, mut values: &'v mut [f64], mut largest: &'v mut [f64]) -> Vec<Part<'v>> {
        let starts = &self.pattern.column_start;
        let mut columns = 0..0;
        let mut parts = Vec::with_capacity(PARTS);
        for part in 1..=PARTS {
            columns = columns.end..part * self.free.len() / PARTS;
            let [start, end] = [columns.start, columns.end].map(|column| starts[column]);
            let (own, of_columns);
            (own, values) = values.split_at_mut((end - start) as usize);
            (of_columns, largest) = largest.split_at_mut(columns.len().min(largest.len()));
            parts.push(Part {
                columns: columns.clone(),
                start,
                values: own,
                largest: of_columns,
            });
        }
        parts
    }
}

/// Does something with every part, on several threads if that is worth it.
fn each(parts: Vec<Part<'_>>, is_shared: bool, act: impl Fn(Part<'_>) + Send + Sync) {
    if is_shared {
        threads::each(parts, act);
    } else {
        parts.into_iter().for_each(act);
    }
}

/// Computes the matrices of the elements of a group from the `first` on that are not there yet.
fn renew(group: &Group, first: usize, maps: &[ElementMap], pieces: &mut [Piece]) {
    // What is not worth sharing is one piece, which no other thread is woken for.
    let each = pieces.iter_mut().zip(maps.chunks(PIECE)).enumerate();
    threads::each(each, |(piece, (kept, maps))| {
        kept.renew(group, first + PIECE * piece, maps);
    });
}

/// Part of a matrix: some columns.
struct Part<'v> {
    columns: Range<usize>,
    /// Position of the first value.
    start: u32,
    values: &'v mut [f64],
    /// Largest absolute value of every column.
    largest: &'v mut [f64],
}

impl Part<'_> {
    /// Those of its columns that have changed, and the positions of their values in this part.
    fn changed<'s>(
        &self,
        system: &'s System,
        changed: &'s [bool],
    ) -> impl Iterator<Item = (usize, Range<usize>)> + use<'s> {
        let start = self.start as usize;
        self.columns
            .clone()
            .filter(|&column| changed[column])
            .map(move |column| {
                let places = system.pattern.places(column);
                (column, places.start - start..places.end - start)
            })
    }

    fn clear(&mut self, system: &System, changed: &[bool]) {
        for (_, places) in self.changed(system, changed) {
            self.values[places].fill(0.0);
        }
    }

    fn measure(&mut self, system: &System, changed: &[bool]) {
        for (column, places) in self.changed(system, changed) {
            self.largest[column - self.columns.start] = largest(&self.values[places]);
        }
    }

    /// Elements share entries: they are added in one order, whoever computed them.
    fn matrices<'m>(
        &self,
        maps: &'m [ElementMap],
        pieces: &'m [Piece],
    ) -> impl Iterator<Item = (&'m ElementMap, &'m [f64])> + use<'m> {
        let (start, end) = (self.start, self.start + self.values.len() as u32);
        let pieces = maps.chunks(PIECE).zip(pieces);
        let matrices = pieces.flat_map(|(maps, piece)| {
            let mut rest = piece.matrices.as_slice();
            maps.iter().map(move |map| {
                let own;
                (own, rest) = rest.split_at(map.slots.len());
                (map, own)
            })
        });
        matrices.filter(move |(map, _)| {
            let [first, last] = map.span;
            first < end && last >= start
        })
    }

    fn add_all(&mut self, maps: &[ElementMap], pieces: &[Piece]) {
        for (map, matrix) in self.matrices(maps, pieces) {
            for (&slot, value) in map.slots.iter().zip(matrix) {
                self.add_one(slot, *value);
            }
        }
    }

    /// Adds what belongs to columns that have changed.
    fn add(
        &mut self,
        system: &System,
        changed: &[bool],
        (maps, pieces): (&[ElementMap], &[Piece]),
    ) {
        let has_changed =
            |dof: &usize| system.equation[*dof].is_none_or(|equation| changed[equation]);
        for (map, matrix) in self.matrices(maps, pieces) {
            let n = map.dofs.len();
            let n_changed = map.dofs.iter().filter(|dof| has_changed(dof)).count();
            if n_changed == n {
                for (&slot, value) in map.slots.iter().zip(matrix) {
                    self.add_one(slot, *value);
                }
            } else if n_changed > 0 {
                for j in (0..n).filter(|&j| has_changed(&map.dofs[j])) {
                    let of_column = map.slots[j..].iter().zip(&matrix[j..]).step_by(n);
                    of_column.for_each(|(&slot, value)| self.add_one(slot, *value));
                }
            }
        }
    }

    #[inline]
    fn add_one(&mut self, slot: u32, value: f64) {
        // Positions before this part wrap around, as those of no equation do.
        let at = slot.wrapping_sub(self.start) as usize;
        if let Some(sum) = self.values.get_mut(at) {
            *sum += value;
        }
    }
}

/// Matrices of some elements, one after the other.
#[derive(Debug, Default)]
struct Piece {
    matrices: Vec<f64>,
    /// The tangents they were computed from, if they are kept; once if they are the same at all points.
    tangents: Option<Vec<f64>>,
    /// Elements of the group whose matrices are not those of the time before.
    renewed: Vec<usize>,
}

impl Piece {
    fn kept() -> Self {
        Self {
            tangents: Some(Vec::new()),
            ..Self::default()
        }
    }

    /// Computes the matrices of the elements from the `first` on whose tangents have changed.
    fn renew(&mut self, group: &Group, first: usize, maps: &[ElementMap]) {
        self.renewed.clear();
        let constant = group.constant_tangents();
        let is_known = |now| {
            self.tangents
                .as_deref()
                .is_some_and(|before| is_same(before, now))
        };
        if constant.is_some_and(is_known) {
            return;
        }
        let mut matrix = ElementMatrix::default();
        if self.matrices.is_empty() || constant.is_some() {
            self.matrices.clear();
            for (e, map) in (first..).zip(maps) {
                self.matrices.extend_from_slice(matrix.of(group, e, map));
            }
            if let Some(tangents) = &mut self.tangents {
                tangents.clear();
                match constant {
                    Some(constant) => tangents.extend_from_slice(constant),
                    None => (first..first + maps.len())
                        .for_each(|e| tangents.extend_from_slice(group.element_tangents(e))),
                }
            }
            self.renewed.extend(first..first + maps.len());
            return;
        }
        let mut matrices = self.matrices.as_mut_slice();
        let mut tangents = self.tangents.as_deref_mut().unwrap_or_default();
        for (e, map) in (first..).zip(maps) {
            let now = group.element_tangents(e);
            let (own, before);
            (own, matrices) = matrices.split_at_mut(map.slots.len());
            (before, tangents) = tangents.split_at_mut(now.len());
            if !is_same(before, now) {
                before.copy_from_slice(now);
                own.copy_from_slice(matrix.of(group, e, map));
                self.renewed.push(e);
            }
        }
    }
}

/// To the bit.
fn is_same(a: &[f64], b: &[f64]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits())
}

/// Room for the matrix of one element.
#[derive(Default)]
pub(super) struct ElementMatrix {
    own: Vec<f64>,
    tied: Vec<f64>,
}

impl ElementMatrix {
    /// An element's tangent matrix by the degrees of freedom of its map, row-major.
    pub(super) fn of(&mut self, group: &Group, element: usize, map: &ElementMap) -> &[f64] {
        let n_own = 2 * group.kinematics.nodes(element).len();
        self.own.resize(n_own * n_own, 0.0);
        let tangents = group.element_tangents(element);
        group.kinematics.stiffness(element, tangents, &mut self.own);
        match &map.transform {
            None => &self.own,
            Some(transform) => {
                congruent(&self.own, transform, n_own, map.dofs.len(), &mut self.tied);
                &self.tied
            }
        }
    }
}

/// Tᵀ K T, with K n×n and T n×m, both row-major.
fn congruent(k: &[f64], t: &[f64], n: usize, m: usize, out: &mut Vec<f64>) {
    let mut kt = vec![0.0; n * m];
    for i in 0..n {
        for l in 0..n {
            for j in 0..m {
                kt[i * m + j] += k[i * n + l] * t[l * m + j];
            }
        }
    }
    out.clear();
    out.resize(m * m, 0.0);
    for l in 0..n {
        for i in 0..m {
            for j in 0..m {
                out[i * m + j] += t[l * m + i] * kt[l * m + j];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_congruent_product_keeps_the_energy() {
        // uᵀKu with u = T v equals vᵀ(TᵀKT)v.
        let k = [4.0, 1.0, 2.0, 3.0];
        let t = [1.0, 0.5, -1.0, 0.0, 2.0, 1.0];
        let v = [1.0, 2.0, 3.0];
        let mut out = Vec::new();
        congruent(&k, &t, 2, 3, &mut out);
        let u: Vec<f64> = (0..2)
            .map(|i| (0..3).map(|j| t[i * 3 + j] * v[j]).sum())
            .collect();
        let own: f64 = (0..2)
            .flat_map(|i| (0..2).map(move |j| (i, j)))
            .map(|(i, j)| u[i] * k[i * 2 + j] * u[j])
            .sum();
        let reduced: f64 = (0..3)
            .flat_map(|i| (0..3).map(move |j| (i, j)))
            .map(|(i, j)| v[i] * out[i * 3 + j] * v[j])
            .sum();
        assert!((own - reduced).abs() < 1e-13 * own.abs());
    }
}
