//! From elements to equations: which displacements are unknown, the sparse pattern of the
//! tangent matrix, and its values.
//!
//! A degree of freedom is `2 * node + component`. It is free (it has an equation), prescribed,
//! or tied: a combination of others, as the mid-thickness nodes of a thin layer with mean strain.

use crate::group::Group;

/// A degree of freedom that follows others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tie {
    /// The one that follows.
    pub dof: usize,
    /// Those it follows, and their weights.
    pub masters: [(usize, f64); 2],
}

/// Compressed columns: row numbers, sorted, of every column.
#[derive(Clone, Debug, Default)]
pub struct Pattern {
    /// Start of every column, and the end.
    pub column_start: Vec<usize>,
    /// Row numbers.
    pub rows: Vec<usize>,
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

/// Unknowns and pattern of one phase.
#[derive(Debug)]
pub struct System {
    /// Equation of every degree of freedom; `None` if it is prescribed, tied or unused.
    equation: Vec<Option<usize>>,
    /// Degree of freedom of every equation.
    free: Vec<usize>,
    ties: Vec<Tie>,
    /// Of every group, its elements.
    elements: Vec<Vec<ElementMap>>,
    /// Pattern of the matrix.
    pub pattern: Pattern,
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
}

impl System {
    /// Numbers the unknowns: all used degrees of freedom that are neither prescribed nor tied.
    pub fn new(n_nodes: usize, groups: &[Group], prescribed: &[bool], ties: &[Tie]) -> Self {
        let n_dofs = 2 * n_nodes;
        let mut tie_of = vec![None; n_dofs];
        for (i, tie) in ties.iter().enumerate() {
            tie_of[tie.dof] = Some(i);
        }
        let mut elements: Vec<Vec<ElementMap>> = groups
            .iter()
            .map(|group| {
                let numbers = 0..group.kinematics.n_elements();
                numbers
                    .map(|e| ElementMap::new(group.kinematics.nodes(e), &tie_of, ties))
                    .collect()
            })
            .collect();
        let mut used = vec![false; n_dofs];
        for map in elements.iter().flatten() {
            for &dof in &map.dofs {
                used[dof] = true;
            }
        }
        let mut equation = vec![None; n_dofs];
        let mut free = Vec::new();
        for dof in 0..n_dofs {
            if used[dof] && !prescribed[dof] && tie_of[dof].is_none() {
                equation[dof] = Some(free.len());
                free.push(dof);
            }
        }
        let pattern = Pattern::new(free.len(), &equation, &elements);
        for map in elements.iter_mut().flatten() {
            map.find_slots(&equation, &pattern);
        }
        Self {
            equation,
            free,
            ties: ties.to_vec(),
            elements,
            pattern,
        }
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
        for tie in &self.ties {
            displacement[tie.dof] = tie.masters.iter().map(|&(m, w)| w * displacement[m]).sum();
        }
    }

    /// Moves forces at tied degrees of freedom to those they follow.
    pub fn fold(&self, force: &mut [f64]) {
        fold(&self.ties, force);
    }

    /// The tangent matrix from the groups' tangents. If increments of prescribed displacements
    /// are given, adds the forces they cause at constant tangent to `coupling`, by equation.
    pub fn assemble(
        &self,
        groups: &[Group],
        values: &mut Vec<f64>,
        mut prescribed: Option<(&[f64], &mut [f64])>,
    ) {
        values.clear();
        values.resize(self.pattern.rows.len(), 0.0);
        let mut own = Vec::new();
        let mut tied = Vec::new();
        for (group, maps) in groups.iter().zip(&self.elements) {
            for (e, map) in maps.iter().enumerate() {
                let n_own = 2 * group.kinematics.nodes(e).len();
                own.resize(n_own * n_own, 0.0);
                group
                    .kinematics
                    .stiffness(e, group.element_tangents(e), &mut own);
                let n = map.dofs.len();
                let matrix = match &map.transform {
                    None => &own,
                    Some(transform) => {
                        congruent(&own, transform, n_own, n, &mut tied);
                        &tied
                    }
                };
                for (slot, value) in map.slots.iter().zip(matrix) {
                    if *slot != u32::MAX {
                        values[*slot as usize] += value;
                    }
                }
                if let Some((increment, coupling)) = &mut prescribed {
                    for i in 0..n {
                        let Some(row) = self.equation[map.dofs[i]] else {
                            continue;
                        };
                        for j in 0..n {
                            if self.equation[map.dofs[j]].is_none() {
                                coupling[row] += matrix[i * n + j] * increment[map.dofs[j]];
                            }
                        }
                    }
                }
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

impl ElementMap {
    fn new(nodes: &[usize], tie_of: &[Option<usize>], ties: &[Tie]) -> Self {
        let own: Vec<usize> = nodes.iter().flat_map(|&n| [2 * n, 2 * n + 1]).collect();
        if own.iter().all(|&dof| tie_of[dof].is_none()) {
            return Self {
                dofs: own,
                transform: None,
                slots: Vec::new(),
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
        }
    }

    fn find_slots(&mut self, equation: &[Option<usize>], pattern: &Pattern) {
        let n = self.dofs.len();
        self.slots = vec![u32::MAX; n * n];
        for (j, &column) in self.dofs.iter().enumerate() {
            let Some(column) = equation[column] else {
                continue;
            };
            let start = pattern.column_start[column];
            let rows = &pattern.rows[start..pattern.column_start[column + 1]];
            for (i, &row) in self.dofs.iter().enumerate() {
                if let Some(at) = equation[row].and_then(|row| rows.binary_search(&row).ok()) {
                    self.slots[i * n + j] = (start + at) as u32;
                }
            }
        }
    }
}

impl Pattern {
    fn new(n: usize, equation: &[Option<usize>], elements: &[Vec<ElementMap>]) -> Self {
        // Elements of every column, then their rows, sorted and each once.
        let mut columns: Vec<Vec<usize>> = vec![Vec::new(); n];
        for map in elements.iter().flatten() {
            let equations: Vec<usize> = map.dofs.iter().filter_map(|&dof| equation[dof]).collect();
            for &column in &equations {
                columns[column].extend_from_slice(&equations);
            }
        }
        let mut pattern = Self {
            column_start: vec![0],
            rows: Vec::new(),
        };
        for mut rows in columns {
            rows.sort_unstable();
            rows.dedup();
            pattern.rows.append(&mut rows);
            pattern.column_start.push(pattern.rows.len());
        }
        pattern
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
