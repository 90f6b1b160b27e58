//! A pile: the force in it, what holds it along its shaft and at its base, how it settles; `pile.csv`,
//! its columns of `history.csv`, and its resistance.
//!
//! Everything follows from the equilibrium of the pile's elements. The external force on them, node
//! by node, upward positive, is
//!
//! - E = ∫ Bᵀ σ' dV − ∫ Bᵀ p δ dV − W (1)
//!
//! with the hydrostatic pore pressure p and the nodal forces W of the weight. The inner forces add up to
//! nothing, whatever the stresses are, so that −ΣE = ΣW to round-off: with the head's share downward and
//! the others upward, head + weight = shaft + base. A node that head and shaft, or shaft and base, have
//! in common is divided by what the interface's own element exerts on it; all else of the node is the
//! head's, or the base's.

mod criteria;
mod geometry;
mod plausibility;
mod plunge;
mod table;

pub use criteria::{Curve, Resistances};
pub use geometry::Misfit;
pub(crate) use table::Stations;

use crate::probe::Sizes;
use geometry::{Facet, Geometry};
use mechanics::Simulation;
use mechanics::group::Group;
use mechanics::problem::{Analysis, Formulation};
use mechanics::simulation::{Part, Snapshot};

/// Columns of `history.csv` that a pile has.
pub const COLUMNS: [&str; 4] = [
    "pile_head_load",
    "pile_shaft_load",
    "pile_base_load",
    "pile_settlement",
];

/// How large the columns could be, by what is in the model.
pub(crate) fn sizes(of: &Sizes) -> [f64; 4] {
    [of.force, of.force, of.force, of.length]
}

/// The pile that a case names.
#[derive(Clone, Debug)]
pub struct Parts {
    /// Numbers of its groups.
    pub groups: Vec<usize>,
    /// Numbers of the interface groups along its shaft.
    pub shaft: Vec<usize>,
    /// Its base.
    pub base: Base,
    /// Line of its head.
    pub head: String,
    /// Diameter (plane strain: width), m; that of the base if left out.
    pub diameter: Option<f64>,
}

/// Where a pile ends below.
#[derive(Clone, Debug)]
pub enum Base {
    /// An interface: number of the group.
    Group(usize),
    /// A line.
    Line(String),
}

/// A pile in a mesh.
#[derive(Debug)]
pub struct Pile {
    parts: Parts,
    geometry: Geometry,
}

/// The loads of a pile in one state: kN, compression positive; settlement in m, downward positive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Loads {
    /// On its head.
    pub head: f64,
    /// What holds it along its shaft.
    pub shaft: f64,
    /// What holds it at its base.
    pub base: f64,
    /// For the head.
    pub settlement: f64,
    /// Its weight.
    pub weight: f64,
}

impl Loads {
    /// In the order of [`COLUMNS`].
    pub fn values(&self) -> [f64; 4] {
        [self.head, self.shaft, self.base, self.settlement]
    }
}

/// A place along a pile.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Station {
    /// Where, m.
    pub z: f64,
    /// kN, compression positive.
    pub axial_force: f64,
    /// kPa, positive where the ground holds a pile that is pushed down. `None` where no shaft is.
    pub shaft_friction: Option<f64>,
    /// Effective, kPa, compression positive.
    pub normal_stress: Option<f64>,
    /// m, positive where the pile went down against the ground.
    pub slip: Option<f64>,
    /// m.
    pub settlement: f64,
}

/// Quantities of a [`Station`]: columns of `pile.csv`, and choices for figures along the pile.
pub const OF_STATION: [&str; 6] = [
    "z",
    "axial_force",
    "shaft_friction",
    "normal_stress",
    "slip",
    "settlement",
];

impl Station {
    /// One of [`OF_STATION`], if the station has it.
    pub(crate) fn named(&self, name: &str) -> Option<f64> {
        match name {
            "z" => Some(self.z),
            "axial_force" => Some(self.axial_force),
            "shaft_friction" => self.shaft_friction,
            "normal_stress" => self.normal_stress,
            "slip" => self.slip,
            "settlement" => Some(self.settlement),
            _ => None,
        }
    }
}

/// A pile in one state.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    /// Its loads.
    pub loads: Loads,
    /// From the head to the base.
    pub stations: Vec<Station>,
}

/// What holds at a facet of the shaft: upward forces on the pile's nodes, of the facet alone.
struct Held<'g> {
    facet: &'g Facet,
    forces: [f64; 3],
}

impl Pile {
    /// The pile within the mesh of a simulation.
    ///
    /// # Errors
    /// The mismatch.
    pub fn new(parts: Parts, simulation: &Simulation) -> Result<Self, Misfit> {
        let geometry = Geometry::new(&parts, simulation)?;
        Ok(Self { parts, geometry })
    }

    /// Its diameter (plane strain: width), m.
    pub fn diameter(&self) -> f64 {
        self.parts.diameter.unwrap_or(self.geometry.width)
    }

    /// Its name, in words.
    pub fn description(&self, groups: &[Group]) -> String {
        let names = |numbers: &[usize]| {
            let names = numbers
                .iter()
                .map(|&number| format!("`{}`", groups[number].name));
            names.collect::<Vec<_>>().join(", ")
        };
        let base = match &self.parts.base {
            Base::Group(group) => names(&[*group]),
            Base::Line(line) => format!("line `{line}`"),
        };
        format!(
            "pile {}: shaft {}, base {base}, head line `{}`; length {:.4} m, {} {:.4} m for the criteria \
             of its resistance",
            names(&self.parts.groups),
            names(&self.parts.shaft),
            self.parts.head,
            self.length(),
            match self.geometry.analysis {
                Analysis::Axisymmetric => "diameter",
                Analysis::PlaneStrain => "width",
            },
            self.diameter()
        )
    }

    /// Its length, m.
    pub fn length(&self) -> f64 {
        self.geometry.length()
    }

    /// What it looks at, added to what others do.
    pub fn looks_at(&self, part: &mut Part, simulation: &Simulation) {
        let Parts {
            groups,
            shaft,
            base,
            ..
        } = &self.parts;
        for &group in groups.iter().chain(shaft) {
            part.groups[group] = true;
        }
        if let Base::Group(group) = base {
            part.groups[*group] = true;
        }
        // What the ground exerts at a head whose interface is not there.
        let starts_closed = |group: &usize| !simulation.problem().groups[*group].is_active;
        if shaft.iter().any(starts_closed) {
            part.groups.fill(true);
        }
        let nodes = self.geometry.settle.iter().flatten();
        part.dofs.extend(nodes.map(|node| 2 * node + 1));
    }

    /// Stiffness E A of the section at its head, kN, with E of the laws' elastic operators; plane strain:
    /// per metre. `None` if there is no pile, or a law has no such operator.
    pub fn stiffness(&self, groups: &[Group]) -> Option<f64> {
        let mut sum = 0.0;
        for &(area, group, element) in &self.geometry.head_sides {
            let group = &groups[group];
            if group.is_active {
                let point = group.kinematics.points_of(element).start;
                sum += area * criteria::modulus(&group.elastic_operator(point)?)?;
            }
        }
        (sum > 0.0).then_some(sum)
    }

    /// The pile in a state; `None` if it is absent.
    pub fn state(&self, snapshot: &Snapshot<'_>) -> Option<State> {
        let Snapshot {
            groups, problem, ..
        } = snapshot;
        let mut there = self.parts.groups.clone();
        there.retain(|&group| groups[group].is_active);
        if there.is_empty() {
            return None;
        }
        let n_dofs = 2 * problem.mesh.nodes.len();
        // What acts from outside (1), and the weight of each group, downward.
        let mut outer = vec![0.0; n_dofs];
        let mut weights = Vec::new();
        for &number in &there {
            let group = &groups[number];
            let weight = snapshot.acting.weight_of(number, problem, group);
            let pores = snapshot.acting.pore_forces_of(number, problem, group);
            let forces = group.forces(n_dofs).into_iter().zip(pores).zip(&weight);
            for (outer, ((force, pore), weight)) in outer.iter_mut().zip(forces) {
                *outer += force - pore - weight;
            }
            weights.push((number, -weight.iter().skip(1).step_by(2).sum::<f64>()));
        }
        let outer = |node: usize| outer[2 * node + 1];
        let geometry = &self.geometry;
        let mut held = Self::held(snapshot, &geometry.shaft, n_dofs);
        self.take_from_ground(snapshot, &mut held, n_dofs);
        let split = Split::new(geometry, &held, outer);
        let weight: f64 = weights.iter().map(|(_, weight)| weight).sum();
        let y = |node: &usize| snapshot.displacement[2 * node + 1];
        let settlements: Vec<f64> = geometry
            .settle
            .iter()
            .map(|nodes| -nodes.iter().map(y).sum::<f64>() / nodes.len().max(1) as f64)
            .collect();
        let loads = Loads {
            head: split.head,
            shaft: split.shaft,
            base: split.base,
            settlement: settlements[0],
            weight,
        };
        let stations = geometry.stations.iter().zip(settlements).enumerate();
        let last = geometry.stations.len() - 1;
        let station = |(number, (&z, settlement)): (usize, (&f64, f64))| {
            let axial_force = match number {
                0 => loads.head,
                _ if number == last => loads.base,
                _ => {
                    loads.head + self.weight_above(snapshot, &weights, z) - split.above(z, snapshot)
                }
            };
            let [shaft_friction, normal_stress, slip] = self.at(snapshot, &split, z);
            Station {
                z,
                axial_force,
                shaft_friction,
                normal_stress,
                slip,
                settlement,
            }
        };
        let stations = stations.map(station).collect();
        Some(State { loads, stations })
    }

    /// Weight above z of groups, given the weight of all of each.
    fn weight_above(&self, snapshot: &Snapshot<'_>, weights: &[(usize, f64)], z: f64) -> f64 {
        let of_group = |&(group, whole): &(usize, f64)| {
            let above = |z: f64| -> f64 {
                let parts = snapshot.acting.parts().into_iter();
                let of =
                    parts
                        .filter(|(loading, _)| loading.active[group])
                        .map(|(loading, share)| {
                            let water = loading.water(snapshot.problem);
                            let level = |x: f64| water.as_ref().map(|water| water.level.at(x));
                            let unit = loading.unit_weight[group];
                            share * self.geometry.weight_above(group, z, unit, level)
                        });
                of.sum()
            };
            let all = above(f64::NEG_INFINITY);
            if all == 0.0 {
                0.0
            } else {
                whole * (above(z) / all)
            }
        };
        weights.iter().map(of_group).sum()
    }

    /// What elements of interfaces exert on the pile.
    fn held<'g>(snapshot: &Snapshot<'_>, facets: &'g [Facet], n_dofs: usize) -> Vec<Held<'g>> {
        let mut held = Vec::new();
        let mut passes: Vec<(usize, usize)> = facets
            .iter()
            .map(|facet| (facet.group, facet.colour))
            .collect();
        passes.sort_unstable();
        passes.dedup();
        for (number, colour) in passes {
            let group = &snapshot.groups[number];
            let own = || {
                facets
                    .iter()
                    .filter(|f| (f.group, f.colour) == (number, colour))
            };
            let n = group.kinematics.n_components();
            let mut flux = vec![0.0; n * group.kinematics.n_points()];
            let carried = group.carried();
            for facet in own() {
                let (acting, problem) = (snapshot.acting, snapshot.problem);
                let pressure = |at| acting.pore_pressure(number, problem, at);
                let pores = group.pore_flux(facet.element, pressure);
                let points = group.kinematics.points_of(facet.element);
                for (point, pores) in points.zip(pores.chunks_exact(n)) {
                    let flux = &mut flux[n * point..n * (point + 1)];
                    if group.is_active {
                        flux.copy_from_slice(&carried[n * point..n * (point + 1)]);
                        flux.iter_mut().zip(pores).for_each(|(f, pore)| *f -= pore);
                    } else if group.formulation == Formulation::ZeroThickness {
                        flux.copy_from_slice(&beside(snapshot, facet, point));
                    }
                }
            }
            let mut force = vec![0.0; n_dofs];
            group.kinematics.add_forces(&flux, &mut force);
            held.extend(own().map(|facet| Held {
                facet,
                forces: facet.nodes.map(|node| -force[2 * node + 1]),
            }));
        }
        held
    }

    /// If an absent interface begins at the head, its faces move as one. The force of the ground on
    /// the pile there follows from the ground's own forces.
    fn take_from_ground(&self, snapshot: &Snapshot<'_>, held: &mut [Held<'_>], n_dofs: usize) {
        let head = &self.geometry.head;
        let mut taken: Option<Vec<f64>> = None;
        for Held { facet, forces } in held {
            let Some(opposite) = facet
                .opposite
                .filter(|_| !snapshot.groups[facet.group].is_active)
            else {
                continue;
            };
            for (i, node) in facet.nodes.iter().enumerate() {
                if head.contains(node) {
                    let outer = taken.get_or_insert_with(|| self.outer_of_ground(snapshot, n_dofs));
                    forces[i] = -outer[2 * opposite[i] + 1];
                }
            }
        }
    }

    /// What the pile exerts on all other solids, and what holds them, by degree of freedom: all that acts on
    /// them from outside, less what acts on lines and as water on the outline.
    fn outer_of_ground(&self, snapshot: &Snapshot<'_>, n_dofs: usize) -> Vec<f64> {
        let outline = snapshot.acting.on_outline(snapshot.problem);
        let mut outer: Vec<f64> = outline.iter().map(|force| -force).collect();
        for (number, group) in snapshot.groups.iter().enumerate() {
            let is_joint = group.formulation == Formulation::ZeroThickness;
            if !group.is_active || is_joint || self.parts.groups.contains(&number) {
                continue;
            }
            let weight = snapshot.acting.weight_of(number, snapshot.problem, group);
            let pores = snapshot
                .acting
                .pore_forces_of(number, snapshot.problem, group);
            let forces = group.forces(n_dofs).into_iter().zip(pores).zip(weight);
            for (outer, ((force, pore), weight)) in outer.iter_mut().zip(forces) {
                *outer += force - pore - weight;
            }
        }
        outer
    }

    /// Friction, effective normal stress (compression positive) and slip at a station: means over the
    /// elements of the shaft there, weighted by their girth (a tube holds more outside than inside). The
    /// value of an element is the mean at its nearest integration points.
    fn at(&self, snapshot: &Snapshot<'_>, split: &Split<'_>, z: f64) -> [Option<f64>; 3] {
        let close = 1e-9 * self.geometry.length();
        let there = split.segments.iter();
        let there = there.filter(|(facet, _)| facet.z[0] - close <= z && z <= facet.z[1] + close);
        let mut sums = [0.0; 3];
        let mut whole = 0.0;
        for (facet, force) in there {
            let group = &snapshot.groups[facet.group];
            let height = |point: usize| (group.kinematics.position(point)[1] - z).abs();
            let points = group.kinematics.points_of(facet.element);
            let nearest = points.clone().map(height).fold(f64::INFINITY, f64::min);
            let points: Vec<usize> = points
                .filter(|&point| height(point) <= nearest + close)
                .collect();
            let mut own = [0.0; 3];
            for &point in &points {
                let values = if !group.is_active {
                    let [normal, _] = beside(snapshot, facet, point);
                    let at = group.kinematics.position(point);
                    let pore = pressure_beside(snapshot, facet, at);
                    [force / facet.area, -normal - pore, 0.0]
                } else if let Some((jump, traction)) = group.jump_and_traction(point) {
                    [facet.sign * traction[1], -traction[0], facet.sign * jump[1]]
                } else {
                    continue;
                };
                own.iter_mut()
                    .zip(values)
                    .for_each(|(own, value)| *own += value);
            }
            let n = points.len().max(1) as f64;
            let girth = facet.area / f64::max(facet.z[1] - facet.z[0], close);
            sums.iter_mut()
                .zip(own)
                .for_each(|(sum, own)| *sum += girth * own / n);
            whole += girth;
        }
        sums.map(|sum| (whole > 0.0).then(|| sum / whole))
    }
}

/// Total stress of the pile next to a point of an interface that is absent, on its facet: normal,
/// tension positive, and shear, kPa.
fn beside(snapshot: &Snapshot<'_>, facet: &Facet, point: usize) -> [f64; 2] {
    let kinematics = &snapshot.groups[facet.group].kinematics;
    let (number, element) = facet.beside;
    let at = kinematics.position(point);
    let pile = &snapshot.groups[number];
    let mut stress = pile.carried_at(element, at);
    let pore = snapshot.acting.pore_pressure(number, snapshot.problem, at);
    stress[..3]
        .iter_mut()
        .for_each(|component| *component -= pore);
    let [_, normal, _, shear] = kinematics.axes_at(point).stress_from_global(stress);
    [normal, shear]
}

/// Pore pressure that an interface which is absent would have between its faces.
fn pressure_beside(snapshot: &Snapshot<'_>, facet: &Facet, at: [f64; 2]) -> f64 {
    let problem = snapshot.problem;
    if !problem.groups[facet.group].pore_water {
        return 0.0;
    }
    let of = |(loading, share): (&mechanics::ground::Loading, f64)| {
        share
            * loading
                .water(problem)
                .map_or(0.0, |water| water.pressure(at))
    };
    snapshot.acting.parts().into_iter().map(of).sum()
}

/// The outer forces on the pile, divided among head, shaft and base.
struct Split<'g> {
    head: f64,
    shaft: f64,
    base: f64,
    /// Upward force of every element of the shaft.
    segments: Vec<(&'g Facet, f64)>,
    /// Node and upward force of all that is neither head, shaft nor base.
    others: Vec<(usize, f64)>,
}

impl<'g> Split<'g> {
    fn new(geometry: &'g Geometry, held: &[Held<'g>], outer: impl Fn(usize) -> f64) -> Self {
        use std::collections::{HashMap, HashSet};
        let head: HashSet<usize> = geometry.head.iter().copied().collect();
        let base: HashSet<usize> = geometry.base.iter().copied().collect();
        // Of every node of the shaft: what its elements exert, and their area.
        let mut at_nodes: HashMap<usize, [f64; 2]> = HashMap::new();
        for Held { facet, forces } in held {
            for (node, force) in facet.nodes.iter().zip(forces) {
                let at_node = at_nodes.entry(*node).or_default();
                at_node[0] += force;
                at_node[1] += facet.area;
            }
        }
        let segment = |Held { facet, forces }: &Held<'g>| {
            let of_node = |(node, force): (&usize, &f64)| {
                if head.contains(node) || base.contains(node) {
                    return *force;
                }
                // What the elements leave of it is shared by their areas.
                let [sum, area] = at_nodes[node];
                force + (outer(*node) - sum) * facet.area / area
            };
            (*facet, facet.nodes.iter().zip(forces).map(of_node).sum())
        };
        let segments: Vec<(&Facet, f64)> = held.iter().map(segment).collect();
        let others: Vec<(usize, f64)> = geometry
            .others
            .iter()
            .map(|&node| (node, outer(node)))
            .collect();
        let left = |node: &usize| outer(*node) - at_nodes.get(node).map_or(0.0, |[sum, _]| *sum);
        let of_base = geometry.base.iter().filter(|node| !head.contains(node));
        Self {
            head: -geometry.head.iter().map(left).sum::<f64>(),
            base: of_base.map(left).sum(),
            shaft: segments.iter().map(|(_, force)| force).sum::<f64>()
                + others.iter().map(|(_, force)| force).sum::<f64>(),
            segments,
            others,
        }
    }

    /// What holds the pile above z, between head and base.
    fn above(&self, z: f64, snapshot: &Snapshot<'_>) -> f64 {
        let part = |(facet, force): &(&Facet, f64)| {
            let [low, high] = facet.z;
            let above = if high > low {
                ((high - z) / (high - low)).clamp(0.0, 1.0)
            } else {
                f64::from(high > z)
            };
            // Stations stand at the ends of elements, but for round-off.
            let above = if above < 1e-9 {
                0.0
            } else if above > 1.0 - 1e-9 {
                1.0
            } else {
                above
            };
            force * above
        };
        let others = self.others.iter();
        let others = others.filter(|(node, _)| snapshot.mesh.nodes[*node][1] > z);
        self.segments.iter().map(part).sum::<f64>() + others.map(|(_, force)| force).sum::<f64>()
    }
}
