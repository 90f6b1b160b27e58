//! What acts on a model, and the nodal forces of it.

use crate::element::{depth, gauss, line_shape};
use crate::group::Group;
use crate::mesh::{Mesh, Solid};
use crate::problem::{Analysis, Axis, Formulation, Phase, Problem, Profile, Water};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, HashMap, HashSet};

/// What acts on a model at one time.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Loading {
    /// Pressures by line, kPa.
    pub pressure: BTreeMap<String, Profile>,
    /// Forces by line, kN or kN/m.
    pub force: BTreeMap<String, [f64; 2]>,
    /// Unit weights of every group above and below the water, kN/m³.
    pub unit_weight: Vec<[f64; 2]>,
    /// Stress-free strains of every group since the start, components 11 22 33.
    pub strain: Vec<[f64; 3]>,
    /// Water table.
    pub water_level: Option<Profile>,
    /// For every group, whether it is active.
    pub active: Vec<bool>,
    /// Lines whose supports have been given up, with the components.
    pub freed: BTreeMap<String, [bool; 2]>,
}

impl Loading {
    /// Before the first phase: weights and water act, pressures and forces do not yet.
    pub fn before(problem: &Problem) -> Self {
        let weight = |group: &crate::problem::ElementGroup| {
            let dry = group.unit_weight;
            [dry, group.saturated_unit_weight.unwrap_or(dry)]
        };
        Self {
            unit_weight: problem.groups.iter().map(weight).collect(),
            strain: vec![[0.0; 3]; problem.groups.len()],
            water_level: problem.water.as_ref().map(|water| water.level.clone()),
            active: problem.active_after(0),
            ..Self::default()
        }
    }

    /// At the end of a phase that starts here.
    #[must_use]
    pub fn changed_by(&self, phase: &Phase) -> Self {
        let mut changed = self.clone();
        phase.switch(&mut changed.active);
        for &(group, weight) in &phase.unit_weight {
            changed.unit_weight[group] = [weight; 2];
        }
        for &(group, strain) in &phase.strain {
            changed.strain[group] = strain;
        }
        if let (Some(level), Some(_)) = (&phase.water_level, &changed.water_level) {
            changed.water_level = Some(level.clone());
        }
        for pressure in &phase.pressure {
            let (line, value) = (pressure.line.clone(), pressure.value.clone());
            changed.pressure.insert(line, value);
        }
        for free in &phase.free {
            let freed = changed.freed.entry(free.line.clone()).or_default();
            for axis in &free.components {
                freed[usize::from(*axis == Axis::Y)] = true;
            }
        }
        for force in &phase.force {
            let total = changed.force.entry(force.line.clone()).or_default();
            total[0] = force.x.unwrap_or(total[0]);
            total[1] = force.y.unwrap_or(total[1]);
        }
        changed
    }

    /// What acts a part of the way to another loading. What is there is that of the other.
    #[must_use]
    pub fn towards(&self, other: &Self, part: f64) -> Self {
        let between = |a: f64, b: f64| a + part * (b - a);
        let pressure = |(line, end): (&String, &Profile)| {
            let none = Profile::from(0.0);
            let start = self.pressure.get(line).unwrap_or(&none);
            (line.clone(), start.towards(end, part))
        };
        let force = |(line, end): (&String, &[f64; 2])| {
            let start = self.force.get(line).copied().unwrap_or_default();
            (line.clone(), [0, 1].map(|c| between(start[c], end[c])))
        };
        let weights = self.unit_weight.iter().zip(&other.unit_weight);
        let strains = self.strain.iter().zip(&other.strain);
        Self {
            pressure: other.pressure.iter().map(pressure).collect(),
            force: other.force.iter().map(force).collect(),
            unit_weight: weights
                .map(|(a, b)| [0, 1].map(|c| between(a[c], b[c])))
                .collect(),
            strain: strains
                .map(|(a, b)| [0, 1, 2].map(|c| between(a[c], b[c])))
                .collect(),
            water_level: match (&self.water_level, &other.water_level) {
                (Some(a), Some(b)) if a != b => Some(a.towards(b, part)),
                (_, level) => level.clone(),
            },
            active: other.active.clone(),
            freed: other.freed.clone(),
        }
    }

    /// The water at this time.
    pub fn water(&self, problem: &Problem) -> Option<Water> {
        let unit_weight = problem.water.as_ref()?.unit_weight;
        let level = self.water_level.clone()?;
        Some(Water { level, unit_weight })
    }

    /// Nodal forces, by degree of freedom.
    pub fn forces(&self, problem: &Problem, groups: &[Group]) -> Vec<f64> {
        let mut force = vec![0.0; 2 * problem.mesh.nodes.len()];
        self.add_lines(problem, &mut force);
        let water = self.water(problem);
        self.add_weights(problem, groups, water.as_ref(), &mut force);
        if let Some(water) = &water {
            for (number, group) in groups.iter().enumerate() {
                if self.active[number] && problem.groups[number].pore_water {
                    group.add_pore_forces(water, None, &mut force);
                }
            }
            self.add_outer_water(problem, water, &mut force);
        }
        force
    }

    /// Adds the nodal forces of pressures and forces on lines.
    fn add_lines(&self, problem: &Problem, force: &mut [f64]) {
        let (mesh, analysis) = (&problem.mesh, problem.analysis);
        for (line, value) in &self.pressure {
            let Some(line) = mesh.lines.get(line) else {
                continue;
            };
            // Beside ground that is not there the line has the edges of both sides.
            let is_there = |(solid, _): &&(usize, usize)| self.active[mesh.solids[*solid].group];
            let mut edges: Vec<(usize, usize)> =
                line.edges.iter().filter(is_there).copied().collect();
            leave_out_touching(mesh, &mut edges);
            let own = pressure_on(analysis, mesh, &edges, value);
            force
                .iter_mut()
                .zip(own)
                .for_each(|(force, own)| *force += own);
        }
        let solids = mesh.solids.iter();
        let present = solids.filter(|solid| self.active[solid.group] && !self.force.is_empty());
        let present: HashSet<usize> = present.flat_map(Solid::nodes).copied().collect();
        for (line, total) in &self.force {
            add_spread(problem, line, *total, &present, force);
        }
    }

    /// Adds the nodal forces of what acts on lines and, as water, on the outline.
    pub(super) fn add_outline(&self, problem: &Problem, force: &mut [f64]) {
        self.add_lines(problem, force);
        if let Some(water) = self.water(problem) {
            self.add_outer_water(problem, &water, force);
        }
    }

    /// Weights of all solids that are there.
    fn add_weights(
        &self,
        problem: &Problem,
        groups: &[Group],
        water: Option<&Water>,
        force: &mut [f64],
    ) {
        for (number, group) in groups.iter().enumerate() {
            self.add_weight_of(problem, (number, group), None, water, force);
        }
    }

    /// Weight of a group, or of some of its elements, if it is there.
    pub(super) fn add_weight_of(
        &self,
        problem: &Problem,
        (number, group): (usize, &Group),
        elements: Option<&[usize]>,
        water: Option<&Water>,
        force: &mut [f64],
    ) {
        let [dry, wet] = self.unit_weight[number];
        let is_solid = group.formulation != Formulation::ZeroThickness;
        if !self.active[number] || !is_solid || (dry == 0.0 && wet == 0.0) {
            return;
        }
        let counts: Option<HashSet<usize>> = elements.map(|all| all.iter().copied().collect());
        let solids = problem.mesh.solids.iter().enumerate();
        let own = solids.filter(|(_, solid)| solid.group == number);
        let mut cut = Vec::new();
        for (element, (solid, _)) in own.enumerate() {
            if counts
                .as_ref()
                .is_some_and(|counts| !counts.contains(&element))
            {
                continue;
            }
            let nodes = group.kinematics.nodes(element);
            let height = |node: usize| {
                let [x, y] = problem.mesh.nodes[node];
                water.map_or(f64::INFINITY, |water| y - water.level.at(x))
            };
            let heights = nodes.iter().map(|&node| height(node));
            let (low, high) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), h| {
                (a.min(h), b.max(h))
            });
            let weight = if high <= 0.0 {
                wet
            } else if low >= 0.0 || dry.to_bits() == wet.to_bits() {
                dry
            } else {
                cut.push((element, solid));
                continue;
            };
            for (node, volume) in nodes.iter().zip(group.kinematics.volumes(element)) {
                force[2 * node + 1] -= weight * volume;
            }
        }
        if let Some(water) = water.filter(|_| !cut.is_empty()) {
            add_cut_weights(problem, group, &cut, [dry, wet], water, force);
        }
    }

    /// Whether there may be weight or pore water in a group.
    pub(super) fn acts_in(&self, number: usize, problem: &Problem) -> bool {
        let weighs = self.unit_weight[number].iter().any(|weight| *weight != 0.0);
        weighs || (problem.groups[number].pore_water && self.water(problem).is_some())
    }

    /// Adds the nodal forces of weight and pore water in a group, or in some of its elements.
    pub(super) fn add_bodies(
        &self,
        problem: &Problem,
        (number, group): (usize, &Group),
        elements: Option<&[usize]>,
        force: &mut [f64],
    ) {
        let water = self.water(problem);
        self.add_weight_of(problem, (number, group), elements, water.as_ref(), force);
        if let Some(water) = &water
            && self.active[number]
            && problem.groups[number].pore_water
        {
            group.add_pore_forces(water, elements, force);
        }
    }

    /// The water's pressure on the outline of what is there, but for supported lines: where a support has
    /// been given up, it acts unless another component holds the edge against it.
    fn add_outer_water(&self, problem: &Problem, water: &Water, force: &mut [f64]) {
        let mesh = &problem.mesh;
        let mut sides: HashMap<usize, (usize, (usize, usize))> = HashMap::new();
        for (number, solid) in mesh.solids.iter().enumerate() {
            if self.active[solid.group] {
                for (edge, [_, _, middle]) in solid.edges().enumerate() {
                    sides.entry(middle).or_insert((0, (number, edge))).0 += 1;
                }
            }
        }
        let is_there: HashSet<usize> = sides.keys().copied().collect();
        // Faces of an interface touch each other.
        for joint in &mesh.joints {
            if [joint.minus[2], joint.plus[2]]
                .iter()
                .all(|middle| is_there.contains(middle))
            {
                sides.remove(&joint.minus[2]);
                sides.remove(&joint.plus[2]);
            }
        }
        self.take_supported(problem, &mut sides);
        let mut outline: Vec<(usize, usize)> = sides
            .into_values()
            .filter_map(|(count, edge)| (count == 1).then_some(edge))
            .collect();
        outline.sort_unstable();
        for edge in outline {
            let mut nodes = mesh.edge(edge).into_iter();
            if nodes.all(|node| water.pressure(mesh.nodes[node]) <= 0.0) {
                continue;
            }
            let surface = std::iter::once(|at: [f64; 2]| at[1] - water.level.at(at[0]));
            let pressure =
                |at: [f64; 2], inward: [f64; 2]| inward.map(|part| part * water.pressure(at));
            over_edge(mesh, problem.analysis, edge, surface, force, pressure);
        }
    }

    /// Takes from the sides of elements, by their middles, those that supports hold.
    fn take_supported<S>(&self, problem: &Problem, sides: &mut HashMap<usize, S>) {
        let mesh = &problem.mesh;
        let lines = self.freed.iter();
        let freed = lines.flat_map(|(line, freed)| {
            let nodes = mesh.lines.get(line).into_iter().flat_map(|l| &l.nodes);
            nodes.flat_map(move |&node| (0..2).filter(|&c| freed[c]).map(move |c| (node, c)))
        });
        let freed: HashSet<(usize, usize)> = freed.collect();
        for support in &problem.supports {
            let line = mesh.lines.get(&support.line);
            for &edge in line.iter().flat_map(|line| &line.edges) {
                let [a, b, middle] = mesh.edge(edge);
                let fixed = support.fixed.iter();
                let fixed: Vec<usize> = fixed.map(|axis| usize::from(*axis == Axis::Y)).collect();
                let is_freed = |c: &usize| freed.contains(&(middle, *c));
                // The normal's component x is the edge's y.
                let along = |c: usize| (mesh.nodes[b][c] - mesh.nodes[a][c]).abs();
                let holds = |c: usize| along(1 - c) > 1e-9 * along(c);
                let is_held = fixed.iter().any(|c| !is_freed(c) && holds(*c));
                if is_held || !fixed.iter().any(is_freed) {
                    sides.remove(&middle);
                }
            }
        }
    }
}

/// Weights of elements that contain the water table; `elements`: numbers within the group and among the solids. They
/// balance the vertical stress of the same ground, −σ_22 = γ (level − y) with γ of either side, so that ground at rest
/// stays at rest.
fn add_cut_weights(
    problem: &Problem,
    group: &Group,
    elements: &[(usize, usize)],
    [dry, wet]: [f64; 2],
    water: &Water,
    force: &mut [f64],
) {
    let (mesh, analysis) = (&problem.mesh, problem.analysis);
    let stress = |at: [f64; 2]| {
        let depth = water.level.at(at[0]) - at[1];
        depth * if depth > 0.0 { wet } else { dry }
    };
    let kinematics = &group.kinematics;
    let mut flux = vec![0.0; 4 * kinematics.n_points()];
    for &(element, solid) in elements {
        let axes = kinematics.axes(element);
        for point in kinematics.points_of(element) {
            let vertical = [0.0, -stress(kinematics.position(point)), 0.0, 0.0];
            flux[4 * point..4 * point + 4].copy_from_slice(&axes.stress_from_global(vertical));
        }
        for edge in 0..mesh.solids[solid].n_corners() {
            let surface = std::iter::once(|at: [f64; 2]| at[1] - water.level.at(at[0]));
            over_edge(
                mesh,
                analysis,
                (solid, edge),
                surface,
                force,
                |at, inward| [0.0, -inward[1] * stress(at)],
            );
        }
    }
    kinematics.add_forces(&flux, force);
}

/// Leaves out edges that an interface joins to each other: what is between them is no surface, whether their faces
/// move alike or not.
fn leave_out_touching(mesh: &Mesh, edges: &mut Vec<(usize, usize)>) {
    if mesh.joints.is_empty() {
        return;
    }
    let own: HashSet<usize> = edges.iter().map(|&edge| mesh.edge(edge)[2]).collect();
    let faces = mesh.joints.iter();
    let faces = faces.map(|joint| [joint.minus[2], joint.plus[2]]);
    let touch = faces.filter(|faces| faces.iter().all(|face| own.contains(face)));
    let touch: HashSet<usize> = touch.flatten().collect();
    edges.retain(|&edge| !touch.contains(&mesh.edge(edge)[2]));
}

/// Adds a force that is spread evenly over a line; on a point, evenly over its nodes. The share of nodes and edges
/// whose ground is removed, which are not among the nodes `present`, goes with it.
fn add_spread(
    problem: &Problem,
    line: &str,
    total: [f64; 2],
    present: &HashSet<usize>,
    force: &mut [f64],
) {
    let (mesh, analysis) = (&problem.mesh, problem.analysis);
    let Some(line) = mesh.lines.get(line) else {
        return;
    };
    if line.edges.is_empty() {
        for &node in line.nodes.iter().filter(|node| present.contains(node)) {
            for c in 0..2 {
                force[2 * node + c] += total[c] / line.nodes.len() as f64;
            }
        }
        return;
    }
    let none = || std::iter::empty::<fn([f64; 2]) -> f64>();
    // Of each node, the area of the line, and of its part where there is ground.
    let mut areas = vec![0.0; force.len()];
    for &edge in &line.edges {
        let is_present = present.contains(&mesh.edge(edge)[2]);
        over_edge(mesh, analysis, edge, none(), &mut areas, |_, inward| {
            let length = inward[0].hypot(inward[1]);
            [length, if is_present { length } else { 0.0 }]
        });
    }
    let whole: f64 = areas.iter().step_by(2).sum();
    for node in 0..mesh.nodes.len() {
        for c in 0..2 {
            force[2 * node + c] += total[c] * areas[2 * node + 1] / whole;
        }
    }
}

/// Nodal forces of a pressure on edges.
pub fn pressure_on(
    analysis: Analysis,
    mesh: &Mesh,
    edges: &[(usize, usize)],
    value: &Profile,
) -> Vec<f64> {
    if value.is_constant() {
        let mut unit = unit_pressure(analysis, mesh, edges);
        let value = value.at(0.0);
        for force in &mut unit {
            *force *= value;
        }
        return unit;
    }
    let kinks: Vec<f64> = value.points().iter().map(|&[y, _]| y).collect();
    let mut own = vec![0.0; 2 * mesh.nodes.len()];
    for &edge in edges {
        let kinks = kinks.iter().map(|&y| move |at: [f64; 2]| at[1] - y);
        over_edge(mesh, analysis, edge, kinks, &mut own, |at, inward| {
            inward.map(|part| part * value.at(at[1]))
        });
    }
    own
}

/// Nodal forces of a unit pressure on a boundary line.
pub(crate) fn unit_pressure(analysis: Analysis, mesh: &Mesh, edges: &[(usize, usize)]) -> Vec<f64> {
    let mut force = vec![0.0; 2 * mesh.nodes.len()];
    let none = || std::iter::empty::<fn([f64; 2]) -> f64>();
    for &edge in edges {
        over_edge(mesh, analysis, edge, none(), &mut force, |_, inward| inward);
    }
    force
}

/// Adds the nodal forces of a traction on an edge. `traction` gives it at a place, times the length of
/// the inward vector it is handed: dS of the edge, into the element. It may have a kink where one of
/// `kinks` changes its sign.
fn over_edge<K: Fn([f64; 2]) -> f64>(
    mesh: &Mesh,
    analysis: Analysis,
    edge: (usize, usize),
    kinks: impl Iterator<Item = K>,
    force: &mut [f64],
    traction: impl Fn([f64; 2], [f64; 2]) -> [f64; 2],
) {
    let nodes = mesh.edge(edge);
    let at =
        |f: &[f64; 3], c: usize| -> f64 { (0..3).map(|i| f[i] * mesh.nodes[nodes[i]][c]).sum() };
    let place = |xi: f64| {
        let (n, _) = line_shape(xi);
        [at(&n, 0), at(&n, 1)]
    };
    let mut ends: Vec<f64> = kinks
        .filter_map(|kink| root(|xi| kink(place(xi))))
        .collect();
    ends.extend([-1.0, 1.0]);
    ends.sort_unstable_by(f64::total_cmp);
    for piece in ends.windows(2) {
        let half = 0.5 * (piece[1] - piece[0]);
        let (points, weights) = gauss(3);
        for (&point, weight) in points.iter().zip(weights) {
            let xi = if ends.len() == 2 {
                point
            } else {
                0.5 * (piece[0] + piece[1]) + half * point
            };
            let (n, d) = line_shape(xi);
            // Edges run counter-clockwise: (dy, −dx) points outward, the pressure inward.
            let inward = [-at(&d, 1), at(&d, 0)];
            let weight = half * weight * depth(analysis, at(&n, 0));
            let traction = traction([at(&n, 0), at(&n, 1)], inward);
            for i in 0..3 {
                for c in 0..2 {
                    force[2 * nodes[i] + c] += weight * n[i] * traction[c];
                }
            }
        }
    }
}

/// Where a function changes its sign between −1 and 1.
fn root(f: impl Fn(f64) -> f64) -> Option<f64> {
    let (mut low, mut high) = (-1.0, 1.0);
    let sign = f(low) > 0.0;
    if (f(high) > 0.0) == sign {
        return None;
    }
    // To the last bit.
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if (f(middle) > 0.0) == sign {
            low = middle;
        } else {
            high = middle;
        }
    }
    let at = 0.5 * (low + high);
    (at > -1.0 && at < 1.0).then_some(at)
}
