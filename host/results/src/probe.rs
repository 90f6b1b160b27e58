//! Probes: numbers that a case asks for after every increment.

mod section;
mod size;

use crate::output_request::Reduce;
use crate::pressures::Pressure;
use mechanics::assembly::fold;
use mechanics::group::{Group, tied_nodes};
use mechanics::simulation::{Part, Simulation, Snapshot};
pub use section::{Section, section};
pub use size::Sizes;

/// Probes, in order.
#[derive(Debug, Default)]
pub struct Probes {
    probes: Vec<(String, Probe)>,
}

/// A number of every increment.
#[derive(Clone, Debug)]
pub enum Probe {
    /// A quantity of integration points.
    Points {
        /// Number of the group.
        group: usize,
        /// Numbers of the points within the group.
        points: Vec<usize>,
        /// Weight of each point; empty if all count alike.
        weights: Vec<f64>,
        /// What of them.
        quantity: PointQuantity,
        /// How their values become one.
        reduce: Reduce,
        /// Factor.
        scale: f64,
    },
    /// Displacement component of nodes.
    Displacement {
        /// The nodes.
        nodes: Vec<usize>,
        /// 0: x (r); 1: y (z).
        component: usize,
        /// How their values become one.
        reduce: Reduce,
        /// Factor.
        scale: f64,
    },
    /// Sum of forces at nodes: the reaction; or what a group, or some of its elements, receive from others
    /// there: internal forces less those of weight and pore water within them.
    Force {
        /// The nodes.
        nodes: Vec<usize>,
        /// 0: x (r); 1: y (z).
        component: usize,
        /// The group; all of them if absent.
        group: Option<usize>,
        /// Elements of it, by number within the group; all if absent.
        elements: Option<Vec<usize>>,
        /// Factor.
        scale: f64,
    },
    /// What zero-thickness elements along a line hand on from one side to the other, with the water between
    /// their faces.
    HandedOn {
        /// Number of the group.
        group: usize,
        /// Elements, by number within the group.
        elements: Vec<usize>,
        /// 0: x (r); 1: y (z).
        component: usize,
        /// Factor.
        scale: f64,
    },
    /// Sum of earlier probes with factors.
    Combination(Vec<(usize, f64)>),
}

/// A quantity of an integration point.
#[derive(Clone, Debug, PartialEq)]
pub enum PointQuantity {
    /// Stress component 11, 22, 33 or 12 in global axes, kPa.
    Stress(usize),
    /// Strain component, γ for 12.
    Strain(usize),
    /// Jump, normal or tangential, m.
    Jump(usize),
    /// Traction, normal or tangential, kPa.
    Traction(usize),
    /// Pore pressure, excess pore pressure or a total stress, kPa.
    Pressure(Pressure),
    /// An internal variable.
    Internal(String),
}

impl Probes {
    /// Adds a probe after those that there are.
    pub fn push(&mut self, name: impl Into<String>, probe: Probe) {
        self.probes.push((name.into(), probe));
    }

    /// Names, in order.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.probes.iter().map(|(name, _)| name.as_str())
    }

    /// Probes with their names, in order.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &Probe)> {
        self.probes
            .iter()
            .map(|(name, probe)| (name.as_str(), probe))
    }

    /// Narrows forces of groups at nodes to the elements that may have a part in them.
    pub fn narrow(&mut self, simulation: &Simulation) {
        for (_, probe) in &mut self.probes {
            if let Probe::Force {
                nodes,
                group: Some(group),
                elements: elements @ None,
                ..
            } = probe
            {
                let at = simulation.gathering(nodes);
                *elements = Some(simulation.groups()[*group].elements_at(&at).collect());
            }
        }
    }

    /// What the probes look at: groups, the elements at which they sum forces, and the degrees of freedom of
    /// nodes whose displacements they give.
    pub fn looks_at(&self, simulation: &Simulation) -> Part {
        let groups = simulation.groups();
        let mut part = Part {
            groups: vec![false; groups.len()],
            elements: vec![Vec::new(); groups.len()],
            dofs: Vec::new(),
        };
        for (_, probe) in &self.probes {
            match probe {
                Probe::Points { group, .. } | Probe::HandedOn { group, .. } => {
                    part.groups[*group] = true;
                }
                Probe::Displacement {
                    nodes, component, ..
                } => part.dofs.extend(nodes.iter().map(|n| 2 * n + component)),
                // A reaction is that of all elements at the nodes.
                Probe::Force { nodes, group, .. } => {
                    let at = simulation.gathering(nodes);
                    for (number, own) in groups.iter().enumerate() {
                        if group.is_none_or(|group| group == number) {
                            part.elements[number].extend(own.elements_at(&at));
                        }
                    }
                }
                Probe::Combination(_) => {}
            }
        }
        for elements in &mut part.elements {
            elements.sort_unstable();
            elements.dedup();
        }
        part
    }

    /// The first probe whose value is too large for a number.
    pub fn overflow(&self, values: &[Option<f64>]) -> Option<&str> {
        let overflows = |value: &Option<f64>| value.is_some_and(|value| !value.is_finite());
        let number = values.iter().position(overflows)?;
        Some(&self.probes[number].0)
    }

    /// Values, in order. `None`: the quantity does not exist now (an internal variable of another
    /// law, a group that is not active).
    pub fn values(&self, snapshot: &Snapshot<'_>) -> Vec<Option<f64>> {
        let mut values: Vec<Option<f64>> = Vec::new();
        for (_, probe) in &self.probes {
            values.push(probe.value(snapshot, &values));
        }
        values
    }
}

impl Probe {
    fn value(&self, snapshot: &Snapshot<'_>, earlier: &[Option<f64>]) -> Option<f64> {
        match self {
            Self::Points {
                group,
                points,
                weights,
                quantity,
                reduce,
                scale,
            } => {
                active(snapshot, *group)?;
                let of = |&point: &usize| quantity.at(snapshot, *group, point);
                let values = points.iter().map(of);
                reduced(*reduce, values, weights).map(|value| scale * value)
            }
            Self::Displacement {
                nodes,
                component,
                reduce,
                scale,
            } => {
                let of = |&n: &usize| Some(snapshot.displacement[2 * n + component]);
                let values = nodes.iter().map(of);
                reduced(*reduce, values, &[]).map(|value| scale * value)
            }
            Self::Force {
                nodes,
                component,
                group,
                elements,
                scale,
            } => {
                let of = (*group, elements.as_deref());
                Some(scale * force(snapshot, (nodes, *component), of)?)
            }
            Self::HandedOn {
                group,
                elements,
                component,
                scale,
            } => {
                let tractions = active(snapshot, *group)?.handed_on(elements, *component);
                Some(scale * (tractions + water_between(snapshot, *group, elements, *component)))
            }
            Self::Combination(terms) => terms
                .iter()
                .map(|&(i, factor)| earlier[i].map(|v| factor * v))
                .sum(),
        }
    }
}

/// A component of the force on nodes: the reaction, or what others exert on elements of a group.
fn force(
    snapshot: &Snapshot<'_>,
    (nodes, component): (&[usize], usize),
    (group, elements): (Option<usize>, Option<&[usize]>),
) -> Option<f64> {
    let sum = |nodes: &[usize], forces: &[f64]| -> f64 {
        nodes.iter().map(|&n| forces[2 * n + component]).sum()
    };
    let Some(group) = group else {
        let nodes = tied_nodes(snapshot.groups, nodes);
        return Some(sum(&nodes, snapshot.reaction));
    };
    let forces = forces_of_others(snapshot, group, elements)?;
    Some(sum(nodes, &forces))
}

/// What others exert on a group, or on some of its elements, by degree of freedom.
fn forces_of_others(
    snapshot: &Snapshot<'_>,
    number: usize,
    elements: Option<&[usize]>,
) -> Option<Vec<f64>> {
    let group = active(snapshot, number)?;
    let n_dofs = snapshot.displacement.len();
    let mut forces = match elements {
        None => group.forces(n_dofs),
        Some(elements) => group.forces_of(elements, n_dofs),
    };
    // Weight and pore water act within the elements; the rest comes from others.
    let (acting, problem) = (snapshot.acting, snapshot.problem);
    let within = acting.in_bodies(problem, (number, group), elements);
    for (force, within) in forces.iter_mut().zip(within.unwrap_or_default()) {
        *force -= within;
    }
    fold(snapshot.ties, &mut forces);
    Some(forces)
}

/// The group of this number if it is there.
fn active<'s>(snapshot: &Snapshot<'s>, number: usize) -> Option<&'s Group> {
    let group = snapshot.groups.get(number)?;
    group.is_active.then_some(group)
}

/// Force of the water between faces on the side of smaller coordinates, kN.
fn water_between(
    snapshot: &Snapshot<'_>,
    number: usize,
    elements: &[usize],
    component: usize,
) -> f64 {
    let group = &snapshot.groups[number];
    let pressure = |at| snapshot.acting.pore_pressure(number, snapshot.problem, at);
    let of_element = |&element: &usize| {
        let pores = group.pore_flux(element, pressure);
        let of_point = |(point, pore): (usize, &[f64])| {
            let (axes, weight) = (
                group.kinematics.axes_at(point),
                group.kinematics.weight(point),
            );
            weight * axes.across[component] * pore[0] + weight * axes.along[component] * pore[1]
        };
        let points = group.kinematics.points_of(element);
        points
            .zip(pores.chunks_exact(2))
            .map(of_point)
            .collect::<Vec<f64>>()
    };
    elements.iter().flat_map(of_element).sum()
}

impl PointQuantity {
    fn at(&self, snapshot: &Snapshot<'_>, number: usize, point: usize) -> Option<f64> {
        let group = &snapshot.groups[number];
        match self {
            Self::Stress(c) => group.global_stress(point).map(|s| s[*c]),
            Self::Strain(c) => group.global_strain(point).map(|e| e[*c]),
            Self::Jump(c) => group.jump_and_traction(point).map(|(jump, _)| jump[*c]),
            Self::Traction(c) => group
                .jump_and_traction(point)
                .map(|(_, traction)| traction[*c]),
            Self::Pressure(quantity) => quantity.at(snapshot, number, point),
            Self::Internal(id) => group.internal_variable(point, id),
        }
    }

    /// Weight of a point: its volume, or for tractions, jumps and internal variables of a layer or
    /// interface its area (in axisymmetry of the whole turn).
    pub fn weight(&self, group: &Group, point: usize) -> f64 {
        let weight = group.kinematics.weight(point);
        match (self, group.thickness(point)) {
            (Self::Jump(_) | Self::Traction(_) | Self::Internal(_), Some(thickness)) => {
                weight / thickness
            }
            _ => weight,
        }
    }
}

/// `None` if there is no value or one of them is missing.
fn reduced(
    reduce: Reduce,
    values: impl Iterator<Item = Option<f64>>,
    weights: &[f64],
) -> Option<f64> {
    let values: Option<Vec<f64>> = values.collect();
    let values = values.filter(|v| !v.is_empty())?;
    let sum: f64 = values.iter().sum();
    let integral = || values.iter().zip(weights).map(|(v, w)| v * w).sum::<f64>();
    Some(match reduce {
        Reduce::Average => integral() / weights.iter().sum::<f64>(),
        Reduce::Integral => integral(),
        Reduce::Sum => sum,
        Reduce::Mean => sum / values.len() as f64,
        Reduce::Min => values.iter().copied().fold(f64::INFINITY, f64::min),
        Reduce::Max => values.iter().copied().fold(f64::NEG_INFINITY, f64::max),
    })
}
