//! A pile: the force in it, what holds it along its shaft and at its base, how it settles; `pile.csv`,
//! its columns of `history.csv`, and its resistance.
//! Loads are in kN here; in plane strain they are per metre, kN/m.
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

mod compliance;
mod criteria;
mod cycles;
mod downdrag;
mod friction;
mod geometry;
mod net;
mod plausibility;
mod plunge;
mod record;
mod rows;
mod section;
mod split;
mod table;

pub use criteria::{Criterion, Curve, Resistances};
pub use downdrag::Downdrag;
pub use geometry::Misfit;
pub(crate) use net::Net;
pub(crate) use record::{Kept, Record};

use crate::probe::Sizes;
use geometry::{Facet, Geometry};
use mechanics::Simulation;
use mechanics::group::Group;
use mechanics::problem::{Analysis, Formulation};
use mechanics::simulation::{Part, Snapshot};
use rows::Row;
use split::Split;
use table::Stations;

/// Columns of `history.csv` that a pile has.
pub const COLUMNS: [&str; 10] = [
    "pile_head_load",
    "pile_shaft_load",
    "pile_base_load",
    "pile_settlement",
    "pile_head_load_net",
    "pile_shaft_load_net",
    "pile_base_load_net",
    "pile_neutral_plane",
    "pile_max_axial_force",
    "pile_dragload",
];

/// Whether a column is a length, m; the others are forces.
pub(crate) fn is_length(column: &str) -> bool {
    matches!(column, "pile_settlement" | "pile_neutral_plane")
}

/// How large the columns could be, by what is in the model.
pub(crate) fn sizes(of: &Sizes) -> [f64; COLUMNS.len()] {
    COLUMNS.map(|column| {
        if is_length(column) {
            of.length
        } else {
            of.force
        }
    })
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
    /// Loads of head, shaft and base, kN.
    pub(crate) fn of_parts(&self) -> [f64; 3] {
        [self.head, self.shaft, self.base]
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
    /// Change of the axial force since the last reset, kN.
    pub axial_force_net: Option<f64>,
    /// Change of the friction since the last reset, kPa.
    pub shaft_friction_net: Option<f64>,
}

/// Quantities of a [`Station`]: columns of `pile.csv`, and choices for figures along the pile.
pub const OF_STATION: [&str; 8] = [
    "z",
    "axial_force",
    "shaft_friction",
    "normal_stress",
    "slip",
    "settlement",
    "axial_force_net",
    "shaft_friction_net",
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
            "axial_force_net" => self.axial_force_net,
            "shaft_friction_net" => self.shaft_friction_net,
            _ => None,
        }
    }
}

/// A pile in one state.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    /// Its loads.
    pub loads: Loads,
    /// Change of head, shaft and base load since the last reset, kN.
    pub net: Option<[f64; 3]>,
    /// Effect of ground that drags it down.
    pub downdrag: Downdrag,
    /// From the head to the base.
    pub stations: Vec<Station>,
}

impl State {
    /// In the order of [`COLUMNS`]. Before the pile's interfaces are there it has no forces of its own.
    pub fn values(&self) -> [Option<f64>; COLUMNS.len()] {
        let gross = |force: f64| self.net.and(Some(force));
        let [head, shaft, base] = self.loads.of_parts().map(gross);
        let net = |part: usize| self.net.map(|net| net[part]);
        [
            head,
            shaft,
            base,
            Some(self.loads.settlement),
            net(0),
            net(1),
            net(2),
            self.net.and(self.downdrag.neutral_plane),
            gross(self.downdrag.max_axial_force),
            gross(self.downdrag.dragload),
        ]
    }
}

/// What holds at a facet of the shaft: upward forces on the pile's nodes, of the facet alone.
struct Held<'g> {
    facet: &'g Facet,
    forces: [f64; 3],
}

/// Adds what acts on a group from outside, kN by degree of freedom; gives its weight, downward, kN.
fn add_external(snapshot: &Snapshot<'_>, number: usize, outer: &mut [f64]) -> f64 {
    let group = &snapshot.groups[number];
    let weight = snapshot.acting.weight_of(number, snapshot.problem, group);
    let pores = snapshot
        .acting
        .pore_forces_of(number, snapshot.problem, group);
    let forces = group.forces(outer.len()).into_iter().zip(pores);
    for (outer, ((force, pore), weight)) in outer.iter_mut().zip(forces.zip(&weight)) {
        *outer += force - pore - weight;
    }
    -weight.iter().skip(1).step_by(2).sum::<f64>()
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
        let nodes = self.geometry.rows.iter().flat_map(|row| &row.nodes);
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

    /// Numbers of the groups along its shaft.
    pub(crate) fn shaft(&self) -> &[usize] {
        &self.parts.shaft
    }

    /// The outer forces on those of its groups that are there, divided, and the weights of these.
    fn split(&self, snapshot: &Snapshot<'_>, there: &[usize]) -> (Split<'_>, Vec<(usize, f64)>) {
        let n_dofs = 2 * snapshot.problem.mesh.nodes.len();
        let mut outer = vec![0.0; n_dofs];
        let external = |&group: &usize| (group, add_external(snapshot, group, &mut outer));
        let weights = there.iter().map(external).collect();
        let mut held = Self::held(snapshot, &self.geometry.shaft, n_dofs);
        self.take_from_ground(snapshot, &mut held);
        let outer = |node: usize| outer[2 * node + 1];
        (Split::new(&self.geometry, &held, outer), weights)
    }

    /// The pile in a state, without net forces; `None` if it is absent.
    pub fn state(&self, snapshot: &Snapshot<'_>) -> Option<State> {
        let mut there = self.parts.groups.clone();
        there.retain(|&group| snapshot.groups[group].is_active);
        if there.is_empty() {
            return None;
        }
        let geometry = &self.geometry;
        let (split, weights) = self.split(snapshot, &there);
        let y = |node: &usize| snapshot.displacement[2 * node + 1];
        let settlement =
            |nodes: &[usize]| -nodes.iter().map(y).sum::<f64>() / nodes.len().max(1) as f64;
        let loads = Loads {
            head: split.head,
            shaft: split.shaft,
            base: split.base,
            settlement: settlement(&geometry.rows[0].nodes),
            weight: weights.iter().map(|(_, weight)| weight).sum(),
        };
        let along = friction::along(snapshot, geometry, &split);
        let last = geometry.rows.len() - 1;
        let station = |(number, row): (usize, &Row)| {
            let axial_force = match number {
                0 => loads.head,
                _ if number == last => loads.base,
                _ => {
                    let above = split.above(row.z, snapshot) + self.bend(row, &along);
                    loads.head + self.weight_above(snapshot, &weights, row.z) - above
                }
            };
            let mut parts = row.at.iter();
            let held = parts.find_map(|&(span, part)| along[span].map(|held| held[part]));
            Station {
                z: row.z,
                axial_force,
                shaft_friction: held.map(|held| held[0]),
                normal_stress: held.map(|held| held[1]),
                slip: held.map(|held| held[2]),
                settlement: settlement(&row.nodes),
                axial_force_net: None,
                shaft_friction_net: None,
            }
        };
        let stations: Vec<Station> = geometry.rows.iter().enumerate().map(station).collect();
        Some(State {
            loads,
            net: None,
            downdrag: Downdrag::of(&geometry.spans, &geometry.rows, &stations),
            stations,
        })
    }

    /// Half the difference between the friction forces of an element's upper and lower halves, kN; 0 if the row is not
    /// in its middle. Friction is a parabola within an element.
    fn bend(&self, row: &Row, along: &[Option<[friction::Skin; 3]>]) -> f64 {
        let middle = row.at.iter().find(|(_, part)| *part == 1);
        let of = |&(span, _): &(usize, usize)| {
            let [top, _, bottom] = along[span]?.map(|held| held[0]);
            Some(self.geometry.spans[span].area * (top - bottom) / 8.0)
        };
        middle.and_then(of).unwrap_or(0.0)
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
        held.sort_unstable_by_key(|held| held.facet.number);
        held
    }

    /// If an absent interface begins at the head, its faces move as one. The force of the ground on
    /// the pile there follows from the ground's own forces.
    fn take_from_ground(&self, snapshot: &Snapshot<'_>, held: &mut [Held<'_>]) {
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
                    let outer = taken.get_or_insert_with(|| self.outer_of_ground(snapshot));
                    forces[i] = -outer[2 * opposite[i] + 1];
                }
            }
        }
    }

    /// What the pile exerts on all other solids, and what holds them, by degree of freedom: all that acts on
    /// them from outside, less what acts on lines and as water on the outline.
    fn outer_of_ground(&self, snapshot: &Snapshot<'_>) -> Vec<f64> {
        let outline = snapshot.acting.on_outline(snapshot.problem);
        let mut outer: Vec<f64> = outline.iter().map(|force| -force).collect();
        for (number, group) in snapshot.groups.iter().enumerate() {
            let is_joint = group.formulation == Formulation::ZeroThickness;
            if !group.is_active || is_joint || self.parts.groups.contains(&number) {
                continue;
            }
            add_external(snapshot, number, &mut outer);
        }
        outer
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
