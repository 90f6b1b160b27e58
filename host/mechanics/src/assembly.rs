//! From elements to equations: which displacements are unknown, the sparse pattern of the
//! tangent matrix, and its values.
//!
//! A degree of freedom is `2 * node + component`. It is free (it has an equation), prescribed,
//! or tied: a combination of others, as the mid-thickness nodes of a thin layer with mean strain.

mod bodies;
mod elements;

pub use bodies::{Bodies, SHARED, norms};
pub use elements::Elements;

use crate::group::Group;
use algebra::{Pattern, threads};
use elements::{ElementMatrix, PIECE};
use std::sync::Arc;

/// A degree of freedom that follows others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tie {
    /// The one that follows.
    pub dof: usize,
    /// Those it follows, and their weights.
    pub masters: [(usize, f64); 2],
}

impl Tie {
    /// One that moves as another one does.
    pub(crate) fn alike(dof: usize, master: usize) -> Self {
        let masters = [(master, 1.0), (master, 0.0)];
        Self { dof, masters }
    }
}

/// Moves forces at tied degrees of freedom to those they follow.
pub fn fold(ties: &[Tie], force: &mut [f64]) {
    for tie in ties {
        let tied = std::mem::take(&mut force[tie.dof]);
        for (master, weight) in tie.masters {
            force[master] += weight * tied;
        }
    }
}

/// For every degree of freedom, whether elements at these nodes use it: those that are tied use what they follow.
pub(crate) fn used(nodes: impl Iterator<Item = usize>, ties: &[Tie], n_dofs: usize) -> Vec<bool> {
    let mut used = vec![false; n_dofs];
    for node in nodes {
        used[2 * node..2 * node + 2].fill(true);
    }
    let followed = ties.iter().filter(|tie| used[tie.dof]);
    let masters: Vec<usize> = followed
        .flat_map(|tie| tie.masters.map(|(master, _)| master))
        .collect();
    for master in masters {
        used[master] = true;
    }
    for tie in ties {
        used[tie.dof] = false;
    }
    used
}

/// Gives tied degrees of freedom the values that follow from the others.
fn follow(ties: &[Tie], displacement: &mut [f64]) {
    for tie in ties {
        displacement[tie.dof] = tie.masters.iter().map(|&(m, w)| w * displacement[m]).sum();
    }
}

/// Unknowns and pattern of one phase, of all groups or of some.
#[derive(Debug)]
pub struct System {
    /// Equation of every degree of freedom; `None` if it is prescribed, tied or unused.
    equation: Vec<Option<usize>>,
    /// Degree of freedom of every equation.
    free: Vec<usize>,
    ties: Vec<Tie>,
    /// For every group, its elements; an empty list if the group does not take part.
    elements: Vec<Vec<ElementMap>>,
    /// Degrees of freedom that are shared with a condensed domain.
    boundary: Vec<usize>,
    /// Pattern of the matrix of the groups.
    pub pattern: Arc<Pattern>,
}

/// The degrees of freedom that take part in the iterations, used by the groups or prescribed: those
/// inside a large condensed domain are not touched. A vector *by place* has an entry for each.
#[derive(Debug)]
pub struct Places {
    /// Degrees of freedom, ascending.
    dofs: Vec<usize>,
    /// Place of every equation.
    pub free: Vec<usize>,
    /// Number of degrees of freedom, with those that take no part.
    n_dofs: usize,
    /// Places of the boundary.
    pub boundary: Vec<usize>,
    /// Places of prescribed degrees of freedom.
    pub prescribed: Vec<usize>,
    /// Whose they are.
    pub bodies: PlacesOfBodies,
    ties: Vec<Tie>,
}

/// The body of each item; the lists are empty if there is only one body.
#[derive(Debug, Default)]
pub struct PlacesOfBodies {
    /// How many bodies there are.
    pub n: usize,
    /// Body of every place.
    pub of_place: Vec<u32>,
    /// Body of every equation.
    pub of_equation: Vec<u32>,
    /// Body of every degree of freedom.
    pub of_dof: Vec<u32>,
    /// Body of every element, group by group.
    pub of_element: Vec<Vec<u32>>,
    /// Places that several bodies have in common.
    pub shared: Vec<usize>,
    /// Largest side of every body.
    pub extents: Vec<f64>,
}

impl Places {
    /// For a system.
    pub fn new(system: &System, prescribed: &[bool]) -> Self {
        let mut takes_part = prescribed.to_vec();
        for &dof in system.elements.iter().flatten().flat_map(|map| &map.dofs) {
            takes_part[dof] = true;
        }
        // Ties of other groups may follow degrees of freedom that have no place.
        let has_masters = |tie: &&Tie| tie.masters.iter().all(|&(master, _)| takes_part[master]);
        let ties: Vec<Tie> = system.ties.iter().filter(has_masters).copied().collect();
        for tie in &ties {
            takes_part[tie.dof] = true;
        }
        let dofs: Vec<usize> = (0..prescribed.len())
            .filter(|&dof| takes_part[dof])
            .collect();
        let place = |dof: &usize| dofs.partition_point(|other| other < dof);
        let is_prescribed = |place: &usize| prescribed[dofs[*place]];
        Self {
            free: system.free.iter().map(place).collect(),
            boundary: system.boundary.iter().map(place).collect(),
            prescribed: (0..dofs.len()).filter(is_prescribed).collect(),
            ties: ties
                .iter()
                .map(|tie| Tie {
                    dof: place(&tie.dof),
                    masters: tie.masters.map(|(master, weight)| (place(&master), weight)),
                })
                .collect(),
            n_dofs: prescribed.len(),
            bodies: PlacesOfBodies::default(),
            dofs,
        }
    }

    /// The same, with what belongs to which body.
    #[must_use]
    pub fn of(self, bodies: &Bodies, system: &System) -> Self {
        let of_place = bodies.of(self.dofs.iter().copied());
        let bodies = PlacesOfBodies {
            n: bodies.n().max(1),
            shared: (0..of_place.len())
                .filter(|&place| of_place[place] == SHARED)
                .collect(),
            of_place,
            of_element: bodies.of_elements().to_vec(),
            of_equation: bodies.of(system.free.iter().copied()),
            of_dof: bodies.of(0..self.n_dofs),
            extents: bodies.extents().to_vec(),
        };
        Self { bodies, ..self }
    }

    /// Degree of freedom of a place.
    pub fn dof(&self, place: usize) -> usize {
        self.dofs[place]
    }

    /// Number of degrees of freedom, with those that take no part.
    pub fn n_dofs(&self) -> usize {
        self.n_dofs
    }

    /// Number of places.
    pub fn n(&self) -> usize {
        self.dofs.len()
    }

    /// A vector by place, from one by degree of freedom.
    pub fn gather(&self, values: &[f64]) -> Vec<f64> {
        self.dofs.iter().map(|&dof| values[dof]).collect()
    }

    /// Puts a vector by place where its degrees of freedom stand.
    pub fn scatter(&self, values: &[f64], to: &mut [f64]) {
        for (&dof, value) in self.dofs.iter().zip(values) {
            to[dof] = *value;
        }
    }

    /// Adds a vector by place to one by degree of freedom.
    pub fn add(&self, values: &[f64], to: &mut [f64]) {
        for (&dof, value) in self.dofs.iter().zip(values) {
            to[dof] += value;
        }
    }

    /// A vector by place, from one by degree of freedom that is left zero.
    pub fn take(&self, values: &mut [f64]) -> Vec<f64> {
        let taken = self
            .dofs
            .iter()
            .map(|&dof| std::mem::take(&mut values[dof]));
        taken.collect()
    }

    /// Gives tied degrees of freedom the values that follow from the others.
    pub fn follow(&self, displacement: &mut [f64]) {
        follow(&self.ties, displacement);
    }

    /// Moves forces at tied degrees of freedom to those they follow.
    pub fn fold(&self, force: &mut [f64]) {
        fold(&self.ties, force);
    }
}

/// How an element's matrix goes into the system's.
#[derive(Debug)]
struct ElementMap {
    /// Degrees of freedom after ties.
    dofs: Vec<usize>,
    /// Rows: the element's own degrees of freedom; columns: `dofs`. `None`: the same.
    transform: Option<Vec<f64>>,
    /// Position in the matrix of every pair of `dofs`, row-major; `u32::MAX` if not free.
    slots: Vec<u32>,
    /// The first and the last position.
    span: [u32; 2],
}

impl System {
    /// Numbers the unknowns of the groups that take part: all degrees of freedom they use that
    /// are neither prescribed nor tied. They may share some with a `domain` of other groups.
    pub fn new(
        groups: &[Group],
        takes_part: impl Fn(usize, &Group) -> bool,
        prescribed: &[bool],
        ties: &[Tie],
        domain: Option<&System>,
    ) -> Self {
        Self::new_with(groups, takes_part, prescribed, ties, domain, |_| ()).0
    }

    /// The same, and what becomes of its pattern and its unknowns while its elements find their places in the pattern.
    pub fn new_with<R: Send>(
        groups: &[Group],
        takes_part: impl Fn(usize, &Group) -> bool,
        prescribed: &[bool],
        ties: &[Tie],
        domain: Option<&System>,
        act: impl FnOnce(&Self) -> R + Send,
    ) -> (Self, R) {
        let n_dofs = prescribed.len();
        let mut tie_of = vec![None; n_dofs];
        for (i, tie) in ties.iter().enumerate() {
            tie_of[tie.dof] = Some(i);
        }
        let maps = |(number, group): (usize, &Group)| -> Vec<ElementMap> {
            let kinematics = &group.kinematics;
            let map = |element| ElementMap::new(kinematics.nodes(element), &tie_of, ties);
            let n = usize::from(takes_part(number, group)) * kinematics.n_elements();
            (0..n).map(map).collect()
        };
        let elements: Vec<_> = groups.iter().enumerate().map(maps).collect();
        let numbered = groups.iter().enumerate();
        let taking_part = numbered.filter(|(number, group)| takes_part(*number, group));
        let nodes = taking_part.flat_map(|(_, group)| group.nodes());
        let used = used(nodes, ties, n_dofs);
        let is_free = |&dof: &usize| used[dof] && !prescribed[dof];
        let free: Vec<usize> = (0..n_dofs).filter(is_free).collect();
        let mut equation = vec![None; n_dofs];
        for (number, &dof) in free.iter().enumerate() {
            equation[dof] = Some(number);
        }
        let is_shared = |dof: &usize| domain.is_some_and(|domain| domain.equation[*dof].is_some());
        let boundary: Vec<usize> = free.iter().copied().filter(is_shared).collect();
        let of_elements = elements.iter().flatten().map(|map| map.dofs.as_slice());
        let pattern = Pattern::new(free.len(), &equation, of_elements);
        let mut system = Self {
            equation,
            free,
            ties: ties.to_vec(),
            elements,
            boundary,
            pattern: Arc::new(pattern),
        };
        let (result, slots) = rayon::join(|| act(&system), || system.slots());
        let maps = system.elements.iter_mut().flatten();
        for (map, (slots, span)) in maps.zip(slots.into_iter().flatten()) {
            (map.slots, map.span) = (slots, span);
        }
        (system, result)
    }

    /// For all elements, in pieces: the positions of their entries in the matrix, and the first and the last of them.
    fn slots(&self) -> Vec<Vec<(Vec<u32>, [u32; 2])>> {
        let pieces = self.elements.iter().flat_map(|maps| maps.chunks(PIECE));
        let of_map = |map: &ElementMap| {
            let slots = find_slots(&map.dofs, &self.equation, &self.pattern);
            let filled = slots.iter().filter(|&&slot| slot != u32::MAX);
            let span = filled.fold([u32::MAX, 0], |[first, last], &slot| {
                [first.min(slot), last.max(slot)]
            });
            (slots, span)
        };
        threads::map(pieces, |maps| maps.iter().map(of_map).collect())
    }

    /// Whether a group takes part.
    pub fn includes(&self, group: usize) -> bool {
        !self.elements[group].is_empty()
    }

    /// Nodal forces of the stresses that the groups start from, by degree of freedom; before ties.
    pub fn carried(&self, groups: &[Group]) -> Vec<f64> {
        let mut forces = vec![0.0; self.n_dofs()];
        for (_, group) in groups
            .iter()
            .enumerate()
            .filter(|(number, _)| self.includes(*number))
        {
            group.kinematics.add_forces(&group.carried(), &mut forces);
        }
        forces
    }

    /// Degrees of freedom of a group's elements, after ties; some of them several times.
    pub fn dofs_of(&self, group: usize) -> impl Iterator<Item = usize> {
        self.elements[group]
            .iter()
            .flat_map(|map| &map.dofs)
            .copied()
    }

    /// The degrees of freedom that one follows from: itself, or those it is tied to.
    pub fn masters(&self, dof: usize) -> Vec<usize> {
        let tie = self.ties.iter().find(|tie| tie.dof == dof);
        tie.map_or(vec![dof], |tie| {
            tie.masters.map(|(master, _)| master).to_vec()
        })
    }

    /// Mesh lines of the unknowns, from those of the nodes.
    pub fn lines(&self, of_nodes: &[[u32; 2]]) -> Vec<[u32; 2]> {
        self.free.iter().map(|&dof| of_nodes[dof / 2]).collect()
    }

    /// Gives up what only the matrix needs, which will not be assembled again. Returns its pattern.
    pub fn forget_matrix(&mut self) -> Arc<Pattern> {
        for map in self.elements.iter_mut().flatten() {
            map.slots = Vec::new();
        }
        std::mem::take(&mut self.pattern)
    }

    /// Equation of a degree of freedom.
    pub fn equation(&self, dof: usize) -> Option<usize> {
        self.equation[dof]
    }

    /// Degrees of freedom that the groups share with the condensed domain.
    pub fn boundary(&self) -> &[usize] {
        &self.boundary
    }

    /// Number of equations.
    pub fn n_equations(&self) -> usize {
        self.free.len()
    }

    /// Number of degrees of freedom.
    pub fn n_dofs(&self) -> usize {
        self.equation.len()
    }

    /// Degrees of freedom of the equations.
    pub fn free(&self) -> &[usize] {
        &self.free
    }

    /// Gives tied degrees of freedom the values that follow from the others.
    pub fn follow(&self, displacement: &mut [f64]) {
        follow(&self.ties, displacement);
    }

    /// Moves forces at tied degrees of freedom to those they follow.
    pub fn fold(&self, force: &mut [f64]) {
        fold(&self.ties, force);
    }

    /// Adds the forces that increments of prescribed displacements cause at constant tangent to
    /// `forces`, by equation.
    pub fn prescribed_forces(&self, groups: &[Group], increment: &[f64], forces: &mut [f64]) {
        let mut matrix = ElementMatrix::default();
        for (group, maps) in groups.iter().zip(&self.elements) {
            for (e, map) in maps.iter().enumerate() {
                let moves =
                    |dof: &usize| self.equation[*dof].is_none() && increment[*dof].abs() > 0.0;
                if !map.dofs.iter().any(moves) {
                    continue;
                }
                let n = map.dofs.len();
                let matrix = matrix.of(group, e, map);
                for (i, row) in map.dofs.iter().map(|&dof| self.equation[dof]).enumerate() {
                    let Some(row) = row else { continue };
                    for (j, dof) in map.dofs.iter().enumerate() {
                        if self.equation[*dof].is_none() {
                            forces[row] += matrix[i * n + j] * increment[*dof];
                        }
                    }
                }
            }
        }
    }
}

impl ElementMap {
    fn new(nodes: &[usize], tie_of: &[Option<usize>], ties: &[Tie]) -> Self {
        let own: Vec<usize> = nodes.iter().flat_map(|&n| [2 * n, 2 * n + 1]).collect();
        if own.iter().all(|&dof| tie_of[dof].is_none()) {
            return Self {
                dofs: own,
                transform: None,
                slots: Vec::new(),
                span: [u32::MAX, 0],
            };
        }
        let expand = |dof: usize| match tie_of[dof] {
            Some(i) => ties[i].masters.to_vec(),
            None => vec![(dof, 1.0)],
        };
        let mut dofs: Vec<usize> = Vec::new();
        for (master, _) in own.iter().flat_map(|&dof| expand(dof)) {
            if !dofs.contains(&master) {
                dofs.push(master);
            }
        }
        let mut transform = vec![0.0; own.len() * dofs.len()];
        for (i, &dof) in own.iter().enumerate() {
            for (master, weight) in expand(dof) {
                let j = dofs.iter().position(|&d| d == master).unwrap_or_default();
                transform[i * dofs.len() + j] += weight;
            }
        }
        Self {
            dofs,
            transform: Some(transform),
            slots: Vec::new(),
            span: [u32::MAX, 0],
        }
    }
}

/// Positions in the matrix of every pair of degrees of freedom, row-major.
fn find_slots(dofs: &[usize], equation: &[Option<usize>], pattern: &Pattern) -> Vec<u32> {
    let n = dofs.len();
    let mut slots = vec![u32::MAX; n * n];
    // In the order of the rows of a column, so that one pass through it meets them all.
    let mut sorted: Vec<(u32, usize)> = (0..n)
        .filter_map(|i| Some((equation[dofs[i]]? as u32, i)))
        .collect();
    sorted.sort_unstable();
    let mut before: Option<(u32, usize)> = None;
    for &(column, j) in &sorted {
        let start = pattern.column_start[column as usize];
        let rows = pattern.column(column as usize);
        // The second unknown of a node has the rows of the first.
        let alike = before.filter(|(other, _)| pattern.column(*other as usize) == rows);
        before = Some((column, j));
        if let Some((other, of_other)) = alike {
            let apart = start - pattern.column_start[other as usize];
            for &(_, i) in &sorted {
                let slot = slots[i * n + of_other];
                if slot != u32::MAX {
                    slots[i * n + j] = slot + apart;
                }
            }
            continue;
        }
        let mut at = 0;
        for &(row, i) in &sorted {
            at += rows[at..].iter().take_while(|&&other| other < row).count();
            if rows.get(at) == Some(&row) {
                slots[i * n + j] = start + at as u32;
            }
        }
    }
    slots
}
