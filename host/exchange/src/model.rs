//! A problem as plain values, as other programs take it. Units: kN, m, kPa; tension positive. Forces are of the whole
//! turn in axisymmetry, kN/m in plane strain. Components 0 and 1 are x (r) and y (z); stresses 11 22 33 12.

use crate::course::{held, loads, steps};
use crate::limits::{self, NotCarried};
use crate::{Error, Program, columns};
use input::Case;
use law::BuiltLaw;
use mechanics::Simulation;
use mechanics::element::Kind;
use mechanics::problem::{Analysis, ElementGroup, InitialStress, Integration};
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
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
    /// Keys that are left out.
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
    /// Its quantity.
    pub quantity: Quantity,
}

/// Quantity of a column.
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
        let axisymmetric = problem.analysis == Analysis::Axisymmetric;
        let of_sector = program == Program::Calculix && axisymmetric;
        let (probes, left) = columns::of(case, &simulation, of_sector)?;
        not_carried.extend(left);
        let held = held(problem);
        let loads = loads(&simulation, &held, program);
        if of_sector {
            not_carried.extend(limits::radial_forces(case, &held, &loads));
        }
        let steps = steps(problem);
        let solids = problem.mesh.solids.iter();
        Ok(Self {
            program,
            case: case.name(),
            variant: case.variant.clone(),
            title: case.file.title.clone(),
            axisymmetric,
            nodes: problem.mesh.nodes.clone(),
            elements: solids
                .map(|solid| Element {
                    group: solid.group,
                    nodes: solid.nodes().to_vec(),
                })
                .collect(),
            groups: problem.groups.iter().map(Group::of).collect(),
            loads,
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
