//! A problem as plain values: mesh, groups with their laws, supports, phases with their
//! loads, settings. Units: kN, m, kPa; tension positive.

mod ground;
pub(crate) mod tied_dofs;

pub use ground::{AtRest, Drainage, Ground, InitialStress, Profile, Ratio, Water};

use crate::mesh::Mesh;
use crate::settings::Settings;
use law::BuiltLaw;
use schemars::JsonSchema;
use serde::Deserialize;
use std::sync::Arc;

/// A problem. It says what there is and what happens to it, and can be changed until a
/// [`Simulation`](crate::Simulation) is made of it.
#[derive(Clone, Debug)]
pub struct Problem {
    /// Kinematics of the plane.
    pub analysis: Analysis,
    /// Nodes, elements, named lines.
    pub mesh: Mesh,
    /// Groups of elements; elements of the mesh name them by number.
    pub groups: Vec<ElementGroup>,
    /// Ground water; none by default.
    pub water: Option<Water>,
    /// Displacements held at zero from the start.
    pub supports: Vec<Support>,
    /// Loading phases, in order.
    pub phases: Vec<Phase>,
    /// How equilibrium is sought.
    pub settings: Settings,
}

impl Problem {
    /// A problem without groups, supports and phases yet.
    pub fn new(analysis: Analysis, mesh: Mesh) -> Self {
        Self {
            analysis,
            mesh,
            groups: Vec::new(),
            water: None,
            supports: Vec::new(),
            phases: Vec::new(),
            settings: Settings::default(),
        }
    }

    /// For every group, whether it is active after this many phases.
    pub fn active_after(&self, phases: usize) -> Vec<bool> {
        let mut active: Vec<bool> = self.groups.iter().map(|group| group.is_active).collect();
        for phase in &self.phases[..phases] {
            phase.switch(&mut active);
        }
        active
    }

    /// Whether there is ground water in any phase.
    pub fn has_water(&self) -> bool {
        self.water.is_some() || self.phases.iter().any(|phase| phase.water_level.is_some())
    }

    /// Whether pore water leaves a group in a phase, by their numbers: what was last said of it.
    pub fn drainage(&self, group: usize, phase: usize) -> Drainage {
        let said = self.phases.iter().take(phase + 1);
        let mut said = said.flat_map(|phase| &phase.drainage).rev();
        let last = said.find(|(of, _)| *of == group);
        last.map_or(self.groups[group].drainage, |(_, drainage)| *drainage)
    }

    /// Whether there are pressures in pores in any phase: of ground water, or of undrained ground.
    pub fn has_pore_pressure(&self) -> bool {
        let is_undrained = |drainage: &Drainage| *drainage == Drainage::Undrained;
        let of_phases = self.phases.iter().flat_map(|phase| &phase.drainage);
        self.has_water()
            || self
                .groups
                .iter()
                .any(|group| is_undrained(&group.drainage))
            || of_phases
                .into_iter()
                .any(|(_, drainage)| is_undrained(drainage))
    }
}

/// A law with its values, as groups use it.
#[derive(Clone, Debug)]
pub struct Material {
    /// Its name, for messages and results; phases that give a group a material of the same law keep
    /// its internal variables.
    pub name: String,
    /// The law.
    pub built: Arc<BuiltLaw>,
    /// Initial values of internal variables that override the law's own, by number.
    pub initial: Vec<(usize, f64)>,
    /// Parameters that vary from element to element, by name; `built` has their values somewhere.
    pub varying: Vec<(String, Variation)>,
}

/// Values of a parameter that varies from element to element.
#[derive(Clone, Debug, PartialEq)]
pub enum Variation {
    /// Over the height y (z): each element takes the value at its centre.
    Height(Profile),
    /// One value for each element of a group, in their order.
    Elements(Vec<f64>),
}

impl Material {
    /// A law under a name.
    pub fn new(name: impl Into<String>, built: impl Into<Arc<BuiltLaw>>) -> Self {
        Self {
            name: name.into(),
            built: built.into(),
            initial: Vec::new(),
            varying: Vec::new(),
        }
    }
}

/// A group of elements.
#[derive(Clone, Debug)]
pub struct ElementGroup {
    /// Name, for messages and results.
    pub name: String,
    /// What the elements do.
    pub formulation: Formulation,
    /// Their law before the first phase, or in it if it takes another.
    pub material: Material,
    /// Points at which the law is evaluated; `None`: all Gauss points of solids and layers, the nodes of zero-thickness
    /// elements.
    pub integration: Option<Integration>,
    /// Thin layer: direction across the layer; `None`: that of the shorter sides.
    pub normal: Option<Axis>,
    /// Thin layer with an interface law: elasticity along the layer; `None`: that of (18), (19).
    pub in_plane: Option<InPlane>,
    /// Effective stress before the first phase. `None`: zero; of zero-thickness elements that of the
    /// ground on their two sides.
    pub initial_stress: Option<InitialStress>,
    /// Weight of the ground above the water, kN/m³.
    pub unit_weight: f64,
    /// Weight of the ground below the water, kN/m³. `None`: the same.
    pub saturated_unit_weight: Option<f64>,
    /// Water fills its pores below the water table: the law sees effective stresses.
    pub pore_water: bool,
    /// Active from the start; else a phase may activate it.
    pub is_active: bool,
    /// Whether pore water leaves freely.
    pub drainage: Drainage,
    /// Poisson's ratio of undrained ground, which gives the stiffness of its pore water:
    /// K_w/n = 2G (1 + ν_u)/(3 (1 − 2ν_u)) − K'.
    pub undrained_poisson_ratio: f64,
}

impl ElementGroup {
    /// A group with what is usual for its formulation.
    pub fn new(name: impl Into<String>, formulation: Formulation, material: Material) -> Self {
        Self {
            name: name.into(),
            formulation,
            material,
            integration: None,
            normal: None,
            in_plane: None,
            initial_stress: None,
            unit_weight: 0.0,
            saturated_unit_weight: None,
            pore_water: true,
            is_active: true,
            drainage: Drainage::Drained,
            undrained_poisson_ratio: 0.495,
        }
    }
}

/// Displacements of a line held at zero.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Support {
    /// The line.
    pub line: String,
    /// The components.
    pub fixed: Vec<Axis>,
}

/// A loading phase. Loads and prescribed displacements stay until a later phase changes them.
#[derive(Clone, Debug)]
pub struct Phase {
    /// Name, for messages and results.
    pub name: String,
    /// Number of equal increments.
    pub increments: usize,
    /// How long it takes, in the unit of time of the laws; 1 by default.
    pub time: Option<f64>,
    /// Laws of groups, by number, from this phase on.
    pub materials: Vec<(usize, Material)>,
    /// Groups, by number, that are active from this phase on: solids free of stress, interfaces
    /// with the adjacent stress.
    pub activate: Vec<usize>,
    /// Groups, by number, that are not there from this phase on. Their forces are released over the
    /// phase; faces of zero-thickness elements become one.
    pub deactivate: Vec<usize>,
    /// Unit weights of groups, by number, above and below the water, kN/m³, as at the end of the phase.
    pub unit_weight: Vec<(usize, f64)>,
    /// Water table at the end of the phase.
    pub water_level: Option<Profile>,
    /// Whether pore water of groups, by number, leaves freely from this phase on.
    pub drainage: Vec<(usize, Drainage)>,
    /// Lines whose nodes move alike from this phase on: in both directions, without rotation. A
    /// line that reaches the axis of symmetry does not move radially.
    pub rigid: Vec<String>,
    /// What the phase changes, as a factor on the change, by the share of the phase's time, from 0 to 1: pairs of
    /// time and factor, linear between. Empty: a straight ramp from 0 to 1.
    pub course: Vec<[f64; 2]>,
    /// It ends before its time where a quantity reaches a value.
    pub until: Option<Until>,
    /// Stress-free strains of groups, by number, as totals at the end of the phase: components 11 22 33, expansion
    /// positive.
    pub strain: Vec<(usize, [f64; 3])>,
    /// Forces, as totals at the end of the phase.
    pub force: Vec<Force>,
    /// Displacements are counted from the start of this phase.
    pub reset_displacements: bool,
    /// Prescribed displacements, as totals at the end of the phase.
    pub displacement: Vec<Displacement>,
    /// Prescribed displacements given up from this phase on.
    pub free: Vec<Free>,
    /// Pressures, as totals at the end of the phase.
    pub pressure: Vec<Pressure>,
}

impl Phase {
    /// How long it takes.
    pub fn length(&self) -> f64 {
        self.time.unwrap_or(1.0)
    }

    /// Takes over which groups it activates and deactivates; `active` is by group.
    pub fn switch(&self, active: &mut [bool]) {
        for &group in &self.activate {
            active[group] = true;
        }
        for &group in &self.deactivate {
            active[group] = false;
        }
    }

    /// A phase in which nothing changes.
    pub fn new(name: impl Into<String>, increments: usize) -> Self {
        Self {
            name: name.into(),
            increments,
            time: None,
            materials: Vec::new(),
            activate: Vec::new(),
            deactivate: Vec::new(),
            unit_weight: Vec::new(),
            water_level: None,
            drainage: Vec::new(),
            rigid: Vec::new(),
            course: Vec::new(),
            until: None,
            strain: Vec::new(),
            force: Vec::new(),
            reset_displacements: false,
            displacement: Vec::new(),
            free: Vec::new(),
            pressure: Vec::new(),
        }
    }
}

/// Where a phase ends before its time. Whoever watches the simulation measures the quantity.
#[derive(Clone, Debug, PartialEq)]
pub struct Until {
    /// Name of the quantity.
    pub quantity: String,
    /// The value that ends the phase, in the quantity's unit.
    pub reaches: f64,
}

/// Prescribed displacements of a line, m.
#[derive(Clone, Debug, PartialEq)]
pub struct Displacement {
    /// The line.
    pub line: String,
    /// In x (r).
    pub x: Option<f64>,
    /// In y (z).
    pub y: Option<f64>,
}

/// Displacements of a line that become free.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Free {
    /// The line.
    pub line: String,
    /// The components.
    pub components: Vec<Axis>,
}

/// A pressure on a boundary line, kPa.
#[derive(Clone, Debug, PartialEq)]
pub struct Pressure {
    /// The line.
    pub line: String,
    /// Towards the body positive; over the height y (z).
    pub value: Profile,
}

impl Pressure {
    /// Whether it is 0 everywhere: it takes off what was there.
    pub(crate) fn is_none(&self) -> bool {
        self.value.values().all(|value| value == 0.0)
    }
}

/// A force on a line, spread evenly over it: kN of the whole turn, or kN/m.
#[derive(Clone, Debug, PartialEq)]
pub struct Force {
    /// The line.
    pub line: String,
    /// In x (r).
    pub x: Option<f64>,
    /// In y (z).
    pub y: Option<f64>,
}

impl Force {
    /// Whether all that it gives is 0: it takes off what was there.
    pub(crate) fn is_none(&self) -> bool {
        let given = [self.x, self.y].into_iter().flatten();
        given.into_iter().all(|value| value == 0.0)
    }
}

/// A coordinate direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// x, or r.
    X,
    /// y, or z.
    Y,
}

impl Axis {
    /// Its name in an analysis.
    pub fn name(self, analysis: Analysis) -> &'static str {
        match (self, analysis) {
            (Self::X, Analysis::PlaneStrain) => "x",
            (Self::X, Analysis::Axisymmetric) => "r",
            (Self::Y, Analysis::PlaneStrain) => "y",
            (Self::Y, Analysis::Axisymmetric) => "z",
        }
    }
}

/// Kinematics of the plane.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum Analysis {
    /// x is r, y is z; integrals over the whole turn.
    Axisymmetric,
    /// Unit thickness.
    PlaneStrain,
}

impl Analysis {
    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Axisymmetric => "axisymmetric",
            Self::PlaneStrain => "plane_strain",
        }
    }

    /// The unit of a force: of the whole turn, or of a unit thickness.
    pub fn force_unit(self) -> &'static str {
        match self {
            Self::Axisymmetric => "kN",
            Self::PlaneStrain => "kN/m",
        }
    }
}

/// What the elements of a group do.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum Formulation {
    /// Continuum law in global axes.
    Solid,
    /// Interface law, or continuum law in axes of the layer, in a row or column of elements.
    ThinLayer,
    /// Interface law on three double nodes, inserted along `line`.
    ZeroThickness,
}

impl Formulation {
    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Solid => "solid",
            Self::ThinLayer => "thin_layer",
            Self::ZeroThickness => "zero_thickness",
        }
    }
}

/// Integration points of the law, and its strains.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum Integration {
    /// 3 × 3 Gauss points (zero thickness: 3); triangles as `projected`.
    Full,
    /// 2 × 2 Gauss points (zero thickness: 2); triangles 3; not for 9-node quads.
    Reduced,
    /// Solids: as many points as `reduced` (3 along clearly curved sides of quads); exact integral of
    /// nodal forces; 9-node quads as `b_bar`.
    Projected,
    /// Solids: all Gauss points (quads 9, triangles 6), volume strain linear in each element.
    BBar,
    /// Thin layer: 3 points along its mid-surface, mid-thickness nodes tied.
    Mean,
    /// Zero thickness: its three nodes (Newton–Cotes).
    Nodes,
}

/// Elasticity along a thin layer with an interface law.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum InPlane {
    /// E*, ν* of equations (18), (19).
    Elastic,
    /// Stresses along the layer stay.
    None,
}
