//! Warnings about an implausible pile.

use super::geometry::{SAME, sides};
use super::{Base, Pile};
use mechanics::Simulation;
use mechanics::problem::{Analysis, Axis, Formulation};
use std::collections::{BTreeMap, BTreeSet, HashMap};

impl Pile {
    /// Warnings about the pile before it is loaded.
    pub fn oddities(&self, simulation: &Simulation) -> Vec<String> {
        let mut said = self.of_head(simulation);
        said.extend(self.of_shaft(simulation));
        said.extend(self.beside_shaft(simulation));
        said.extend(self.half(simulation));
        said
    }

    /// Corners and middles of the sides of its elements, each once.
    fn sides(&self, simulation: &Simulation) -> Vec<[usize; 3]> {
        let mut found: BTreeMap<usize, [usize; 3]> = BTreeMap::new();
        for &group in &self.parts.groups {
            let kinematics = &simulation.groups()[group].kinematics;
            for element in 0..kinematics.n_elements() {
                let own = sides(kinematics.nodes(element), false);
                found.extend(own.into_iter().map(|side| (side[2], side)));
            }
        }
        found.into_values().collect()
    }

    /// A head that is not level, below the pile's top, or not all of it.
    fn of_head(&self, simulation: &Simulation) -> Vec<String> {
        let nodes = &simulation.problem().mesh.nodes;
        let close = SAME * self.length();
        let head: BTreeSet<usize> = self.geometry.head.iter().copied().collect();
        let name = &self.parts.head;
        let [low, high] = ends(head.iter().map(|&node| nodes[node][1]));
        if high - low > close {
            return vec![format!(
                "[pile]: head line `{name}` is not level, it reaches from z = {low:.4} to {high:.4} m: the pile's \
                 length counts from the highest"
            )];
        }
        let sides = self.sides(simulation);
        let own = || sides.iter().flatten().copied();
        let [_, top] = ends(own().map(|node| nodes[node][1]));
        if top > high + close {
            return vec![format!(
                "[pile]: the pile's groups reach up to z = {top:.4} m, above its head line `{name}` at {high:.4} m: \
                 what acts above the head counts as shaft"
            )];
        }
        let left_out = own().filter(|node| nodes[*node][1] > top - close && !head.contains(node));
        let x: Vec<f64> = left_out.map(|node| nodes[node][0]).collect();
        if x.is_empty() {
            return Vec::new();
        }
        let [from, to] = ends(x.into_iter());
        vec![format!(
            "[pile]: head line `{name}` leaves out part of the pile's top, from x = {from:.4} to {to:.4} m: what acts \
             there counts as shaft"
        )]
    }

    /// Elements of the shaft's groups that do not touch the pile.
    fn of_shaft(&self, simulation: &Simulation) -> Vec<String> {
        let mut said = Vec::new();
        for &number in &self.parts.shaft {
            let group = &simulation.groups()[number];
            let facets = &self.geometry.shaft;
            let touch = facets.iter().filter(|facet| facet.group == number).count();
            let all = group.kinematics.n_elements();
            if touch < all {
                said.push(format!(
                    "[pile]: {} of {all} elements of shaft `{}` do not touch the pile: they are no part of its shaft",
                    all - touch,
                    group.name
                ));
            }
        }
        said
    }

    /// Groups next to the pile that are neither its shaft nor below its base.
    fn beside_shaft(&self, simulation: &Simulation) -> Vec<String> {
        let (problem, groups) = (simulation.problem(), simulation.groups());
        let nodes = &problem.mesh.nodes;
        let ends_there: BTreeSet<usize> = self
            .geometry
            .head
            .iter()
            .chain(&self.geometry.base)
            .copied()
            .collect();
        let own: HashMap<usize, [usize; 3]> = self
            .sides(simulation)
            .into_iter()
            .filter(|side| !side.iter().all(|node| ends_there.contains(node)))
            .map(|side| (side[2], side))
            .collect();
        let mut said = Vec::new();
        for (number, group) in groups.iter().enumerate() {
            let is_named = self.parts.groups.contains(&number)
                || self.parts.shaft.contains(&number)
                || matches!(self.parts.base, Base::Group(base) if base == number);
            if is_named {
                continue;
            }
            let kinematics = &group.kinematics;
            let is_joint = group.formulation == Formulation::ZeroThickness;
            let touching = (0..kinematics.n_elements()).flat_map(|element| {
                let middles = sides(kinematics.nodes(element), is_joint);
                middles
                    .into_iter()
                    .filter_map(|[_, _, middle]| own.get(&middle))
            });
            let z: Vec<f64> = touching.flatten().map(|&node| nodes[node][1]).collect();
            if z.is_empty() {
                continue;
            }
            let [low, high] = ends(z.into_iter());
            said.push(format!(
                "[pile]: group `{}` touches the pile between z = {low:.4} and {high:.4} m and is not among its `shaft`: \
                 what holds the pile there counts as shaft, and has no friction in pile.csv",
                group.name
            ));
        }
        said
    }

    /// In plane strain a pile that is held sideways along its own line, as one half of a pile is on its
    /// plane of symmetry.
    fn half(&self, simulation: &Simulation) -> Option<String> {
        let problem = simulation.problem();
        if problem.analysis != Analysis::PlaneStrain || self.parts.diameter.is_some() {
            return None;
        }
        let held = problem
            .supports
            .iter()
            .filter(|s| s.fixed.contains(&Axis::X));
        let lines = held.filter_map(|support| problem.mesh.lines.get(&support.line));
        let held: BTreeSet<usize> = lines.flat_map(|line| line.nodes.iter().copied()).collect();
        let nodes = &problem.mesh.nodes;
        let upright = |[a, b, middle]: &[usize; 3]| {
            [a, b, middle].iter().all(|node| held.contains(*node))
                && (nodes[*a][0] - nodes[*b][0]).abs() < SAME * self.length()
        };
        let width = self.geometry.width;
        self.sides(simulation).iter().any(upright).then(|| {
            format!(
                "[pile]: the pile stands on a line that is held in x, as one half of a pile on its plane of symmetry: \
                 its loads are those of the half, and its criteria take the half's width of {width} m, unless \
                 `diameter` names another, such as {}",
                2.0 * width
            )
        })
    }
}

fn ends(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| {
        [low.min(value), high.max(value)]
    })
}
