//! A problem as plain values, as other programs take it. Units: kN, m, kPa; tension positive. Forces are of the whole
//! turn in axisymmetry, kN/m in plane strain. Components 0 and 1 are x (r) and y (z); stresses 11 22 33 12.

use crate::limits::{self, NotCarried};
use crate::{Error, Program};
use input::Case;
use input::probes;
use law::BuiltLaw;
use mechanics::Simulation;
use mechanics::element::Kind;
use mechanics::ground::Loading;
use mechanics::problem::{
    Analysis, Axis, ElementGroup, InitialStress, Integration, Phase, Problem,
};
use results::output_request::Reduce;
use results::probe;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

/// The problem.
#[derive(Debug, Serialize, Deserialize)]
pub struct Model {
    /// The program that it was written for.
    pub program: Program,
    /// Name of the case.
    pub case: String,
    /// Variant of it.
    pub variant: Option<String>,
    /// Title of the case.
    pub title: String,
    /// Whether x is r and y is z; else plane strain of unit thickness.
    pub axisymmetric: bool,
    /// Coordinates, m.
    pub nodes: Vec<[f64; 2]>,
    /// Elements.
    pub elements: Vec<Element>,
    /// Groups of elements.
    pub groups: Vec<Group>,
    /// Increments.
    pub steps: Vec<Step>,
    /// Prescribed displacements; a degree of freedom is in one of them at most.
    pub held: Vec<Held>,
    /// Nodal forces; all of them act together.
    pub loads: Vec<Load>,
    /// Columns of the table of results.
    pub probes: Vec<Probe>,
    /// What is not carried.
    pub not_carried: Vec<NotCarried>,
}

/// An element.
#[derive(Debug, Serialize, Deserialize)]
pub struct Element {
    /// Number of its group.
    pub group: usize,
    /// Corners counter-clockwise, then the middles of the sides that follow them, then inner nodes; from 0.
    pub nodes: Vec<usize>,
}

/// A group of elements.
#[derive(Debug, Serialize, Deserialize)]
pub struct Group {
    /// Its name.
    pub name: String,
    /// Id of its law.
    pub law: String,
    /// The law's library.
    pub library: PathBuf,
    /// The law's parameters in declared order.
    pub parameters: Vec<Parameter>,
    /// Number of the law's internal variables.
    pub n_internal: usize,
    /// Effective stress at the start, kPa.
    pub initial_stress: [f64; 4],
    /// Whether it has 2 × 2 points (triangles 3), else 3 × 3.
    pub reduced: bool,
}

/// A parameter of a law.
#[derive(Debug, Serialize, Deserialize)]
pub struct Parameter {
    /// Its id.
    pub id: String,
    /// Its value; none if it was left out.
    pub value: Option<f64>,
    /// Whether the law has a default for it, or goes without.
    pub may_be_left_out: bool,
    /// Whether it was left out.
    pub by_default: bool,
}

/// An increment.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Step {
    /// Name of its phase.
    pub phase: String,
    /// Its number in the phase, from 1.
    pub increment: usize,
    /// Time at its end.
    pub time: f64,
    /// Displacements are counted from the end of this step; none: from the start.
    pub counted_from: Option<usize>,
}

/// Displacements of nodes that are prescribed at all times.
#[derive(Debug, Serialize, Deserialize)]
pub struct Held {
    /// Name of the line.
    pub line: String,
    /// Component.
    pub component: usize,
    /// Its nodes.
    pub nodes: Vec<usize>,
    /// Values at the end of each step since the start of the first, m.
    pub values: Vec<f64>,
}

/// Forces on nodes, that grow together.
#[derive(Debug, Serialize, Deserialize)]
pub struct Load {
    /// Phase that brings them.
    pub name: String,
    /// Whether they belong to the loads of the case, which reactions are less.
    pub is_external: bool,
    /// Nodes.
    pub nodes: Vec<usize>,
    /// Forces on them.
    pub forces: Vec<[f64; 2]>,
    /// Factor at the end of each step, after that at the start.
    pub factors: Vec<f64>,
}

/// A column of the table of results.
#[derive(Debug, Serialize, Deserialize)]
pub struct Probe {
    /// Its name.
    pub name: String,
    /// What it is.
    pub quantity: Quantity,
}

/// What a column is.
#[derive(Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// A displacement of nodes, m.
    Displacement(AtNodes),
    /// Sum of internal less external forces.
    Reaction(AtNodes),
    /// Sum of earlier columns with factors.
    Combination(Vec<(String, f64)>),
}

/// A component at nodes.
#[derive(Debug, Serialize, Deserialize)]
pub struct AtNodes {
    /// The nodes.
    pub nodes: Vec<usize>,
    /// Component.
    pub component: usize,
    /// `mean`, `min`, `max` or `sum`.
    pub reduce: String,
    /// Factor.
    pub scale: f64,
}

impl Model {
    /// What of a case the program can take.
    ///
    /// # Errors
    /// [`text::Error::Input`] at the key that cannot be carried; those of the case.
    pub fn of(case: &Case, program: Program) -> Result<Self, Error> {
        let posed = case.pose()?;
        let mut not_carried = limits::check(case, &posed.problem, program)?;
        let simulation = Simulation::new(posed.problem).map_err(|error| case.place(error))?;
        let problem = simulation.problem();
        let (probes, left) = probes_of(case, &simulation)?;
        not_carried.extend(left);
        let held = held(problem);
        let steps = steps(problem);
        let solids = problem.mesh.solids.iter();
        Ok(Self {
            program,
            case: case.name(),
            variant: case.variant.clone(),
            title: case.file.title.clone(),
            axisymmetric: problem.analysis == Analysis::Axisymmetric,
            nodes: problem.mesh.nodes.clone(),
            elements: solids
                .map(|solid| Element {
                    group: solid.group,
                    nodes: solid.nodes().to_vec(),
                })
                .collect(),
            groups: problem.groups.iter().map(Group::of).collect(),
            loads: loads(&simulation, &held, program),
            held,
            steps,
            probes,
            not_carried,
        })
    }

    /// Cell of VTK's files for an element.
    pub(crate) fn vtk(element: &Element) -> u8 {
        Kind::with_nodes(element.nodes.len()).map_or(0, |kind| kind.vtk)
    }

    /// Sum of the external forces of nodes in a component at a step.
    pub(crate) fn external(&self, step: usize, at: &AtNodes) -> f64 {
        let own: BTreeSet<usize> = at.nodes.iter().copied().collect();
        let external = self.loads.iter().filter(|load| load.is_external);
        external
            .map(|load| {
                let all = load.nodes.iter().zip(&load.forces);
                let here = all.filter(|(node, _)| own.contains(node));
                let sum: f64 = here.map(|(_, force)| force[at.component]).sum();
                load.factors[step + 1] * sum
            })
            .sum()
    }
}

/// The initial stress where it is the same everywhere.
pub(crate) fn constant(stress: Option<&InitialStress>) -> Option<[f64; 4]> {
    match stress {
        None => Some([0.0; 4]),
        Some(InitialStress::Constant(stress)) => Some(*stress),
        Some(_) => None,
    }
}

impl Group {
    fn of(group: &ElementGroup) -> Self {
        let law = &group.material.built.law;
        Self {
            name: group.name.clone(),
            law: law.description().id.clone(),
            library: std::path::absolute(law.library().path())
                .unwrap_or_else(|_| law.library().path().to_owned()),
            parameters: parameters(&group.material.built),
            n_internal: law.n_states(),
            initial_stress: constant(group.initial_stress.as_ref()).unwrap_or_default(),
            reduced: group.integration == Some(Integration::Reduced),
        }
    }

    /// Young's modulus in kPa and Poisson's ratio, if the law has no other parameter and no memory.
    pub(crate) fn elastic(&self) -> Option<[f64; 2]> {
        match self.parameters.as_slice() {
            [e, nu] if self.n_internal == 0 => {
                let is = e.id == "young_modulus" && nu.id == "poisson_ratio";
                Some([e.value?, nu.value?]).filter(|_| is)
            }
            _ => None,
        }
    }
}

/// Parameters of a law in declared order.
pub(crate) fn parameters(built: &BuiltLaw) -> Vec<Parameter> {
    let declared = built.law.description().parameters.iter();
    let of = |(declared, used): (&law::ParameterDescription, &law::UsedParameter)| Parameter {
        id: used.id.clone(),
        value: used.value.is_finite().then_some(used.value),
        may_be_left_out: declared.optional || declared.default.is_some(),
        by_default: used.by_default,
    };
    declared.zip(&built.parameters).map(of).collect()
}

/// Shares of the time of a phase at the ends of its increments.
fn shares(phase: &Phase) -> impl Iterator<Item = f64> + use<> {
    let n = phase.increments;
    (1..=n).map(move |k| k as f64 / n as f64)
}

/// Factor on the changes of a phase after a share of its time.
fn factor(phase: &Phase, share: f64) -> f64 {
    let course = &phase.course;
    let after = course.iter().position(|[time, _]| *time >= share);
    match (after, course.last()) {
        (Some(i), _) if i > 0 => {
            let ([t_0, f_0], [t_1, f_1]) = (course[i - 1], course[i]);
            f_0 + (share - t_0) / (t_1 - t_0) * (f_1 - f_0)
        }
        (Some(i), _) => course[i][1],
        (None, Some(last)) => last[1],
        (None, None) => share,
    }
}

fn steps(problem: &Problem) -> Vec<Step> {
    let mut steps: Vec<Step> = Vec::new();
    let (mut start, mut counted_from) = (0.0, None);
    for phase in &problem.phases {
        if phase.reset_displacements {
            counted_from = steps.len().checked_sub(1);
        }
        for (share, increment) in shares(phase).zip(1..) {
            steps.push(Step {
                phase: phase.name.clone(),
                increment,
                time: start + share * phase.length(),
                counted_from,
            });
        }
        start += phase.length();
    }
    steps
}

/// Displacements of supports and of all phases.
fn held(problem: &Problem) -> Vec<Held> {
    let mut lines: BTreeMap<(usize, &str, usize), Vec<f64>> = BTreeMap::new();
    let n = problem.phases.iter().map(|phase| phase.increments).sum();
    let number = |axis: Axis| usize::from(axis == Axis::Y);
    for (order, support) in problem.supports.iter().enumerate() {
        for axis in &support.fixed {
            lines.insert((order, &support.line, number(*axis)), vec![0.0; n]);
        }
    }
    let order = problem.supports.len();
    let mut done = 0;
    // Values by line since the start, and where their count starts.
    let mut now: BTreeMap<(&str, usize), [f64; 2]> = BTreeMap::new();
    for phase in &problem.phases {
        if phase.reset_displacements {
            now.values_mut()
                .for_each(|[value, origin]| *origin = *value);
        }
        let start = now.clone();
        for given in &phase.displacement {
            for (component, value) in [given.x, given.y].into_iter().enumerate() {
                if let Some(value) = value {
                    let [total, origin] = now.entry((&given.line, component)).or_default();
                    *total = *origin + value;
                }
            }
        }
        for (&(line, component), [end, _]) in &now {
            let from = start
                .get(&(line, component))
                .map_or(0.0, |[value, _]| *value);
            let values = lines
                .entry((order, line, component))
                .or_insert_with(|| vec![0.0; n]);
            for (value, share) in values[done..].iter_mut().zip(shares(phase)) {
                *value = from + factor(phase, share) * (end - from);
            }
        }
        done += phase.increments;
        for (key, held) in &mut now {
            if let Some(values) = lines.get(&(order, key.0, key.1)) {
                held[0] = values[done - 1];
            }
        }
    }
    let mut taken = BTreeSet::new();
    // What a phase says counts more than a support.
    let all = lines
        .into_iter()
        .rev()
        .map(|((_, line, component), values)| {
            let nodes = problem.mesh.lines.get(line).into_iter();
            let nodes = nodes.flat_map(|line| line.nodes.iter().copied());
            Held {
                line: line.to_owned(),
                component,
                nodes: nodes
                    .filter(|&node| taken.insert((node, component)))
                    .collect(),
                values,
            }
        });
    let mut all: Vec<Held> = all.filter(|held| !held.nodes.is_empty()).collect();
    all.reverse();
    all
}

/// Nodal forces: those before the first phase, what each phase changes, and what the initial stress lacks to balance
/// them, which the first phase takes away.
fn loads(simulation: &Simulation, held: &[Held], program: Program) -> Vec<Load> {
    let problem = simulation.problem();
    let n_dofs = 2 * problem.mesh.nodes.len();
    let mut internal = vec![0.0; n_dofs];
    for group in simulation.groups() {
        let own = group.forces(n_dofs);
        internal
            .iter_mut()
            .zip(own)
            .for_each(|(sum, own)| *sum += own);
    }
    let n: usize = problem.phases.iter().map(|phase| phase.increments).sum();
    let mut loading = Loading::before(problem);
    let mut acting = loading.forces(problem, simulation.groups());
    let always = vec![1.0; n + 1];
    let mut loads = Vec::new();
    let mut lacking: Vec<f64> = internal.iter().zip(&acting).map(|(a, b)| a - b).collect();
    for held in held {
        held.nodes
            .iter()
            .for_each(|node| lacking[2 * node + held.component] = 0.0);
    }
    loads.push(Load::of(
        "before the first phase",
        true,
        &acting,
        always.clone(),
    ));
    if let Some(first) = problem.phases.first() {
        let mut factors = vec![0.0; n + 1];
        factors[0] = 1.0;
        for (factor, share) in factors[1..].iter_mut().zip(shares(first)) {
            *factor = 1.0 - share;
        }
        loads.push(Load::of(
            "balance of the initial stress",
            false,
            &lacking,
            factors,
        ));
    }
    if program.starts_free_of_stress() {
        let against: Vec<f64> = internal.iter().map(|force| -force).collect();
        loads.push(Load::of("initial stress", true, &against, always));
    }
    let mut done = 0;
    for phase in &problem.phases {
        loading = loading.changed_by(phase);
        let next = loading.forces(problem, simulation.groups());
        let change: Vec<f64> = next.iter().zip(&acting).map(|(a, b)| a - b).collect();
        let mut factors = vec![0.0; done + 1];
        factors.extend(shares(phase).map(|share| factor(phase, share)));
        let last = factors.last().copied().unwrap_or_default();
        factors.resize(n + 1, last);
        loads.push(Load::of(&phase.name, true, &change, factors));
        acting = next;
        done += phase.increments;
    }
    loads.retain(|load| !load.nodes.is_empty());
    loads
}

impl Load {
    /// The forces that are not 0, of forces by degree of freedom.
    fn of(name: &str, is_external: bool, forces: &[f64], factors: Vec<f64>) -> Self {
        let pairs = forces.chunks_exact(2).map(|pair| [pair[0], pair[1]]);
        let acts = |(_, force): &(usize, [f64; 2])| force.iter().any(|force| *force != 0.0);
        let (nodes, forces) = pairs.enumerate().filter(acts).unzip();
        Self {
            name: name.to_owned(),
            is_external,
            nodes,
            forces,
            factors,
        }
    }
}

/// Probes at nodes, and those that are not carried.
fn probes_of(case: &Case, simulation: &Simulation) -> Result<(Vec<Probe>, Vec<NotCarried>), Error> {
    let resolved = probes::resolve(case, simulation)?;
    let (mut carried, mut left): (Vec<Probe>, Vec<NotCarried>) = (Vec::new(), Vec::new());
    let names: Vec<&str> = resolved.names().collect();
    for (name, probe) in resolved.iter() {
        let quantity = match probe {
            probe::Probe::Displacement {
                nodes,
                component,
                reduce,
                scale,
            } => Some(Quantity::Displacement(AtNodes {
                nodes: nodes.clone(),
                component: *component,
                reduce: word(*reduce).to_owned(),
                scale: *scale,
            })),
            probe::Probe::Force {
                nodes,
                component,
                group: None,
                scale,
                ..
            } => Some(Quantity::Reaction(AtNodes {
                nodes: nodes.clone(),
                component: *component,
                reduce: "sum".to_owned(),
                scale: *scale,
            })),
            probe::Probe::Combination(terms) => {
                let named = terms
                    .iter()
                    .map(|&(i, factor)| (names[i].to_owned(), factor));
                let named: Vec<(String, f64)> = named.collect();
                let is_there = |(name, _): &(String, f64)| carried.iter().any(|p| p.name == *name);
                named
                    .iter()
                    .all(is_there)
                    .then_some(Quantity::Combination(named))
            }
            _ => None,
        };
        match quantity {
            Some(quantity) => carried.push(Probe {
                name: name.to_owned(),
                quantity,
            }),
            None => left.push(limits::probe(case, name)),
        }
    }
    Ok((carried, left))
}

fn word(reduce: Reduce) -> &'static str {
    match reduce {
        Reduce::Min => "min",
        Reduce::Max => "max",
        Reduce::Sum => "sum",
        Reduce::Mean | Reduce::Average | Reduce::Integral => "mean",
    }
}
