//! The case file: what a user writes, key by key. Reading it gives these types; references
//! between them (a group's law, a load's line) are resolved by the modules that use them.

mod one_or_several;
mod read;

pub use one_or_several::{GroupNames, MeasuredTables};
pub use read::Case;

use crate::accuracy_settings::AccuracySettings;
use crate::ground::{ProfileInput, StressInput, WaterChange, WaterInput};
use crate::material::{ParameterTable, ParameterValue, Route, foreign, shear_zone};
use crate::spanned::Given;
use crate::{Error, schema};
use law::ShearZone;
use law::foreign::{Externals, Foreign, Order, Scratch};
use mechanics::Settings;
use mechanics::problem::{self, Analysis, Drainage, Formulation, InPlane, Integration};
use results::output_request::{Output, Reduce};
use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, de};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;
use text::{Named, Source};
use toml::Spanned;

/// The keys of a case file. Units: kN, m, kPa; angles in degrees.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CaseFile {
    /// Title.
    #[serde(default)]
    pub title: String,
    /// Kinematics of the plane.
    pub analysis: Analysis,
    /// Folders with law libraries, relative to the file.
    #[serde(default)]
    #[schemars(with = "Vec<PathBuf>")]
    pub law_path: Vec<Spanned<PathBuf>>,
    /// The mesh.
    pub mesh: MeshInput,
    /// Laws and their parameters, by a name for groups.
    #[schemars(with = "BTreeMap<String, LawInput>")]
    pub laws: Named<LawInput>,
    /// Element groups, by a name for regions.
    #[schemars(with = "BTreeMap<String, GroupInput>")]
    pub groups: Named<GroupInput>,
    /// Ground water; none if left out.
    #[schemars(with = "Option<WaterInput>")]
    pub water: Option<Spanned<WaterInput>>,
    /// Displacements held at zero.
    #[serde(default)]
    pub supports: Vec<SupportInput>,
    /// Loading phases, in order.
    #[serde(rename = "phase")]
    pub phases: Vec<PhaseInput>,
    /// Quantities written for every increment.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, ProbeInput>")]
    pub probes: Named<ProbeInput>,
    /// A pile: forces, friction and settlement of every increment; resistance at the end.
    pub pile: Option<PileInput>,
    /// Curves of probes, drawn when the run ends.
    #[serde(default, rename = "figure")]
    pub figures: Vec<FigureInput>,
    /// Solver settings.
    #[serde(default = "default_solver")]
    #[schemars(with = "Settings")]
    pub solver: Spanned<Settings>,
    /// Output.
    #[serde(default)]
    pub output: Output,
    /// Relative error that the probes may have: a study before the run finds settings that reach it.
    #[serde(default, deserialize_with = "accuracy")]
    #[schemars(with = "Option<f64>", extend("exclusiveMinimum" = 0, "maximum" = 0.5))]
    pub accuracy: Option<Spanned<f64>>,
    /// `accuracy` includes the error of the mesh: the mesh is refined as well.
    #[serde(default)]
    #[schemars(with = "Option<bool>")]
    pub accuracy_with_mesh: Option<Spanned<bool>>,
    /// The settings that such a study chose.
    #[serde(skip)]
    pub chosen: Option<AccuracySettings>,
}

impl CaseFile {
    /// Names of lines or points, wherever the file has one. Every key that takes the name of a line
    /// belongs here: a mesh file is asked for these.
    pub fn line_names(&self) -> impl Iterator<Item = &Spanned<String>> {
        let groups = self.groups.values().map(Spanned::get_ref);
        let probes = self.probes.values().map(Spanned::get_ref);
        let of_phases = self.phases.iter().flat_map(|phase| {
            let displacement = phase.displacement.iter().map(|input| &input.line);
            let free = phase.free.iter().map(|input| &input.line);
            let pressure = phase.pressure.iter().map(|input| &input.line);
            let force = phase.force.iter().map(|input| &input.line);
            displacement
                .chain(free)
                .chain(pressure)
                .chain(force)
                .chain(&phase.rigid)
        });
        let supports = self.supports.iter().map(|input| &input.line);
        groups
            .filter_map(|group| group.line.as_ref())
            .chain(supports)
            .chain(of_phases)
            .chain(probes.filter_map(|probe| probe.line.as_ref()))
            .chain(
                self.pile
                    .iter()
                    .flat_map(|pile| pile.line_names(&self.groups)),
            )
    }
}

/// A mesh: a grid of 8-node quads, or a file of Gmsh.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MeshInput {
    /// Instead of a grid: a file of Gmsh, relative to the case file.
    #[schemars(with = "Option<PathBuf>")]
    pub file: Option<Spanned<PathBuf>>,
    /// Metres in a unit of that file; default 1.
    #[schemars(with = "Option<f64>", extend("exclusiveMinimum" = 0))]
    pub scale: Option<Spanned<f64>>,
    /// Start of columns and rows; default (0, 0).
    #[schemars(with = "Option<[f64; 2]>")]
    pub origin: Option<Spanned<[f64; 2]>>,
    /// Columns, in the direction of x (r).
    #[schemars(with = "Option<Vec<PartInput>>")]
    pub columns: Option<Spanned<Vec<Spanned<PartInput>>>>,
    /// Rows, in the direction of y (z).
    #[schemars(with = "Option<Vec<PartInput>>")]
    pub rows: Option<Spanned<Vec<Spanned<PartInput>>>>,
    /// Groups of elements; later regions override earlier ones.
    #[serde(default, rename = "region")]
    pub regions: Vec<RegionInput>,
    /// Named lines.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, LineInput>")]
    pub lines: Named<LineInput>,
    /// How often each element of the file is divided into four.
    #[serde(skip)]
    pub divisions: u32,
    /// Content of the file if it is not read: a mesh made in memory.
    #[serde(skip)]
    pub content: Option<Arc<[u8]>>,
}

/// Some columns or rows, following the previous ones.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PartInput {
    /// Number.
    pub n: usize,
    /// Coordinate where they end.
    pub to: f64,
    /// Size of each over the size of the one before.
    #[serde(default = "one")]
    pub ratio: f64,
}

fn one() -> f64 {
    1.0
}

/// A rectangle of elements.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[schemars(transform = schema::radius_and_axis)]
#[serde(deny_unknown_fields)]
pub struct RegionInput {
    /// Group of the elements.
    #[schemars(with = "String")]
    pub group: Spanned<String>,
    /// Extent in x (r); default: all.
    #[serde(alias = "r")]
    #[schemars(with = "Option<[f64; 2]>")]
    pub x: Option<Spanned<[f64; 2]>>,
    /// Extent in y (z); default: all.
    #[serde(alias = "z")]
    #[schemars(with = "Option<[f64; 2]>")]
    pub y: Option<Spanned<[f64; 2]>>,
}

/// A line along a coordinate, or a point.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[schemars(transform = schema::radius_and_axis)]
#[serde(deny_unknown_fields)]
pub struct LineInput {
    /// Position or extent in x (r).
    #[serde(alias = "r")]
    pub x: Option<Coordinate>,
    /// Position or extent in y (z).
    #[serde(alias = "z")]
    pub y: Option<Coordinate>,
}

/// A position or an extent.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "expected a number, or an extent such as `[0.0, 1.0]`"
)]
pub enum Coordinate {
    /// A position.
    At(f64),
    /// An extent.
    Between([f64; 2]),
}

/// A law with its parameters.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LawInput {
    /// Id of the law.
    #[schemars(with = "String")]
    pub law: Spanned<String>,
    /// SHA-256 that the law's library must have, in hexadecimal digits.
    #[schemars(with = "Option<String>")]
    pub sha256: Option<Spanned<String>>,
    /// Program that the law's library is made for, if not for the contract; or another law as its
    /// source.
    #[schemars(with = "Option<Route>")]
    pub adapter: Option<Spanned<Route>>,
    /// That library, relative to the file.
    #[schemars(with = "Option<PathBuf>")]
    pub library: Option<Spanned<PathBuf>>,
    /// Its sidecar, or description.
    #[schemars(with = "Option<PathBuf>")]
    pub sidecar: Option<Spanned<PathBuf>>,
    /// Call the law in this process.
    #[schemars(with = "Option<bool>")]
    pub in_process: Option<Spanned<bool>>,
    /// File for the arguments of one call.
    #[schemars(with = "Option<PathBuf>")]
    pub record: Option<Spanned<PathBuf>>,
    /// Routines that the library calls and nobody supplies.
    #[schemars(with = "Option<Externals>")]
    pub externals: Option<Spanned<Externals>>,
    /// Scratch files of the library.
    #[schemars(with = "Option<Scratch>")]
    pub scratch: Option<Spanned<Scratch>>,
    /// UDSM: order of its stiffness in memory; default `columns`.
    #[schemars(with = "Option<Order>")]
    pub tangent_order: Option<Spanned<Order>>,
    /// Shear zone: its thickness, m. `law` is a law of solids, or a table of `laws`.
    #[schemars(with = "Option<f64>", extend("exclusiveMinimum" = 0))]
    pub thickness: Option<Spanned<f64>>,
    /// Shear zone: initial stress along it and out of plane over the normal traction; default 1.
    #[schemars(with = "Option<f64>", range(min = 0))]
    pub lateral_ratio: Option<Spanned<f64>>,
    /// Its parameters: numbers, choices, expressions.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, ParameterValue>")]
    pub parameters: ParameterTable,
    /// Initial internal variables, instead of the law's.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, f64>")]
    pub initial: Named<f64>,
}

impl LawInput {
    /// Its library, if that is made for another program.
    ///
    /// # Errors
    /// [`text::Error::Input`] at the key that does not fit.
    pub fn foreign(&self, source: &Source) -> Result<Option<Foreign>, Error> {
        foreign(source, self)
    }

    /// The zone that its law of solids fills, if it is made so.
    ///
    /// # Errors
    /// [`text::Error::Input`] at the key that does not fit.
    pub fn shear_zone(&self, source: &Source) -> Result<Option<ShearZone>, Error> {
        shear_zone(source, self)
    }

    pub(crate) fn is_shear_zone(&self) -> bool {
        self.adapter.value() == Some(Route::ShearZone)
    }
}

/// A group of elements.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GroupInput {
    /// Kind of element.
    pub formulation: Formulation,
    /// Name under `laws`; phases may swap it.
    #[schemars(with = "String")]
    pub law: Spanned<String>,
    /// Integration points; default: solids `projected`, thin layers `full`, zero thickness `nodes`.
    #[schemars(with = "Option<Integration>")]
    pub integration: Option<Spanned<Integration>>,
    /// Zero thickness: the line of the elements.
    #[schemars(with = "Option<String>")]
    pub line: Option<Spanned<String>>,
    /// Zero thickness: ends of that line on the model's outline; default `open`.
    #[schemars(with = "Option<Ends>")]
    pub ends: Option<Spanned<Ends>>,
    /// Thin layer: direction across it; default: the shorter side.
    #[schemars(with = "Option<Axis>")]
    pub normal: Option<Spanned<Axis>>,
    /// Thin layer with an interface law: elasticity along the layer.
    #[schemars(with = "Option<InPlane>")]
    pub in_plane: Option<Spanned<InPlane>>,
    /// Effective stress before the first phase, tension positive.
    #[schemars(with = "Option<StressInput>")]
    pub initial_stress: Option<Spanned<StressInput>>,
    /// Unit weight above the water, kN/m³; default 0.
    #[schemars(with = "Option<f64>")]
    pub unit_weight: Option<Spanned<f64>>,
    /// Unit weight below the water, kN/m³; default `unit_weight`.
    #[schemars(with = "Option<f64>")]
    pub saturated_unit_weight: Option<Spanned<f64>>,
    /// Water fills the pores below the water table; default true. Laws see effective stresses.
    pub pore_water: Option<bool>,
    /// Present from the start; default true. Phases activate and deactivate.
    pub active: Option<bool>,
    /// Drainage of pore water; default `drained`.
    #[schemars(with = "Option<Drainage>")]
    pub drainage: Option<Spanned<Drainage>>,
    /// Undrained: Poisson's ratio with the pore water; default 0.495.
    #[schemars(with = "Option<f64>")]
    pub undrained_poisson_ratio: Option<Spanned<f64>>,
}

/// Ends of a line along which elements are inserted.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum Ends {
    /// The two sides come apart.
    Open,
    /// They stay joined.
    Joined,
}

/// A coordinate direction.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema, PartialEq, Eq)]
#[schemars(transform = schema::radius_and_axis_names)]
#[serde(rename_all = "snake_case")]
pub enum Axis {
    /// x, or r.
    #[serde(alias = "r")]
    X,
    /// y, or z.
    #[serde(alias = "z")]
    Y,
}

impl From<Axis> for problem::Axis {
    fn from(axis: Axis) -> Self {
        match axis {
            Axis::X => Self::X,
            Axis::Y => Self::Y,
        }
    }
}

/// Displacements of a line held at zero.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SupportInput {
    /// The line.
    #[schemars(with = "String")]
    pub line: Spanned<String>,
    /// The components.
    pub fixed: Vec<Axis>,
}

/// A loading phase. Loads and prescribed displacements stay until a later phase changes them.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PhaseInput {
    /// Name, used in results.
    #[schemars(with = "String")]
    pub name: Spanned<String>,
    /// Number of equal increments.
    #[schemars(with = "usize")]
    pub increments: Spanned<usize>,
    /// Duration, in the laws' unit of time; default 1.
    #[schemars(with = "Option<f64>", extend("exclusiveMinimum" = 0))]
    pub time: Option<Spanned<f64>>,
    /// Laws of groups from this phase on.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, String>")]
    pub laws: Named<String>,
    /// Groups present from this phase on: solids free of stress, interfaces with the adjacent stress.
    #[serde(default)]
    #[schemars(with = "Vec<String>")]
    pub activate: Vec<Spanned<String>>,
    /// Groups absent from this phase on, one at least stays: the phase releases their forces. Name the
    /// interfaces of removed ground, too.
    #[serde(default)]
    #[schemars(with = "Vec<String>")]
    pub deactivate: Vec<Spanned<String>>,
    /// Unit weights of groups at its end, above and below the water, kN/m³.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, f64>")]
    pub unit_weight: Named<f64>,
    /// Water table at its end.
    #[schemars(with = "Option<WaterChange>")]
    pub water: Option<Spanned<WaterChange>>,
    /// Drainage of groups from this phase on. Excess pressure of drained groups goes in the course of
    /// the phase.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, Drainage>")]
    pub drainage: Named<Drainage>,
    /// Lines whose nodes move alike, without turning, in this and all later phases; not radially if a
    /// line reaches the axis.
    #[serde(default)]
    #[schemars(with = "Vec<String>")]
    pub rigid: Vec<Spanned<String>>,
    /// Pairs of the share of its time (0 to 1) and the factor on its changes; default: straight from 0
    /// to 1.
    #[schemars(with = "Option<Vec<[f64; 2]>>")]
    pub course: Option<Spanned<Vec<[f64; 2]>>>,
    /// It ends before that where a quantity reaches a value. Loads and displacements stay where they are
    /// then.
    #[schemars(with = "Option<UntilInput>")]
    pub until: Option<Spanned<UntilInput>>,
    /// Stress-free strains of groups at its end, expansion positive, since the start: heat, swelling,
    /// shrinkage.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, StrainInput>")]
    pub strain: Named<StrainInput>,
    /// Forces at its end.
    #[serde(default)]
    pub force: Vec<ForceInput>,
    /// Count displacements from the start of this phase.
    #[serde(default)]
    pub reset_displacements: bool,
    /// Prescribed displacements at its end, m.
    #[serde(default)]
    pub displacement: Vec<DisplacementInput>,
    /// Displacements given up from this phase on.
    #[serde(default)]
    pub free: Vec<FreeInput>,
    /// Pressures at its end, kPa.
    #[serde(default)]
    pub pressure: Vec<PressureInput>,
}

/// What ends a phase.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct UntilInput {
    /// Probe, or column of the pile in `history.csv`.
    #[schemars(with = "String")]
    pub quantity: Spanned<String>,
    /// The value that ends the phase, from whichever side it is reached.
    pub reaches: f64,
}

/// A stress-free strain, expansion positive.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "expected a strain such as `1e-4`, or one by direction: `{ r = …, z = …, theta = … }` in axisymmetry, \
                 `{ x = …, y = …, z = … }` in plane strain"
)]
pub enum StrainInput {
    /// In all directions.
    Isotropic(f64),
    /// By direction.
    Directed(DirectedStrain),
}

/// A stress-free strain by direction; what is left out is 0.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct DirectedStrain {
    /// Axisymmetry: radial.
    pub r: Option<f64>,
    /// Axisymmetry: around the axis.
    pub theta: Option<f64>,
    /// Plane strain: in the plane.
    pub x: Option<f64>,
    /// Plane strain: in the plane.
    pub y: Option<f64>,
    /// Axisymmetry: along the axis. Plane strain: out of plane.
    pub z: Option<f64>,
}

/// Prescribed displacements of a line, m.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[schemars(transform = schema::radius_and_axis)]
#[serde(deny_unknown_fields)]
pub struct DisplacementInput {
    /// The line.
    #[schemars(with = "String")]
    pub line: Spanned<String>,
    /// In x (r).
    #[serde(alias = "r")]
    pub x: Option<f64>,
    /// In y (z).
    #[serde(alias = "z")]
    pub y: Option<f64>,
}

/// Displacements of a line that become free.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FreeInput {
    /// The line.
    #[schemars(with = "String")]
    pub line: Spanned<String>,
    /// The components.
    pub components: Vec<Axis>,
}

/// A pressure on a boundary line, kPa.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PressureInput {
    /// The line.
    #[schemars(with = "String")]
    pub line: Spanned<String>,
    /// Positive towards the body, kPa.
    #[schemars(with = "ProfileInput")]
    pub value: Spanned<ProfileInput>,
}

/// A force on a line, spread evenly over it: kN over the whole turn, in plane strain kN/m. Refused where an
/// interface stands along the line.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[schemars(transform = schema::radius_and_axis)]
#[serde(deny_unknown_fields)]
pub struct ForceInput {
    /// The line.
    #[schemars(with = "String")]
    pub line: Spanned<String>,
    /// In x (r).
    #[serde(alias = "r")]
    pub x: Option<f64>,
    /// In y (z).
    #[serde(alias = "z")]
    pub y: Option<f64>,
}

/// A quantity written for every increment.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[schemars(transform = schema::radius_and_axis)]
#[serde(deny_unknown_fields)]
pub struct ProbeInput {
    /// Line of nodes.
    #[schemars(with = "Option<String>")]
    pub line: Option<Spanned<String>>,
    /// Group of integration points; with a line, its forces.
    #[schemars(with = "Option<String>")]
    pub group: Option<Spanned<String>>,
    /// On a line `displacement_…`, `reaction_…`, with a group `force_…`. In a group a stress, strain,
    /// traction, jump, internal variable, `pore_pressure`, `excess_pore_pressure` or `total_stress_…`.
    #[schemars(with = "Option<String>")]
    pub quantity: Option<Spanned<String>>,
    /// How values become one; default `sum` for forces, else `mean`.
    pub reduce: Option<Reduce>,
    /// Only points strictly inside this extent.
    #[serde(alias = "r")]
    pub x: Option<[f64; 2]>,
    /// Only points strictly inside this extent.
    #[serde(alias = "z")]
    pub y: Option<[f64; 2]>,
    /// Factor.
    #[serde(default = "one")]
    pub scale: f64,
    /// Instead: a sum of earlier probes with factors.
    #[schemars(with = "Option<BTreeMap<String, f64>>")]
    pub combine: Option<Named<f64>>,
}

/// A pile: what of the model it is.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PileInput {
    /// Group of its elements, or several.
    pub group: GroupNames,
    /// Interface groups of its shaft, from head to toe.
    pub shaft: GroupNames,
    /// Base: an interface group, or its line on the ground.
    #[schemars(with = "String")]
    pub base: Spanned<String>,
    /// Line of its head.
    #[schemars(with = "String")]
    pub head: Spanned<String>,
    /// Diameter (plane strain: width) for its resistance, m; default: twice the largest radius of the
    /// base, in plane strain its extent in x.
    #[schemars(with = "Option<f64>", extend("exclusiveMinimum" = 0))]
    pub diameter: Option<Spanned<f64>>,
}

impl PileInput {
    fn line_names<'a>(
        &'a self,
        groups: &'a Named<GroupInput>,
    ) -> impl Iterator<Item = &'a Spanned<String>> {
        let is_group = groups.contains_key(self.base.get_ref().as_str());
        std::iter::once(&self.head).chain((!is_group).then_some(&self.base))
    }
}

/// Curves of probes over another probe, of a stress over the integration points of a cut, or of what
/// holds along the pile.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FigureInput {
    /// Name of the file, without `.svg`.
    #[schemars(with = "String")]
    pub name: Spanned<String>,
    /// Title; default: the case's.
    pub title: Option<String>,
    /// Horizontal axis: probe, quantity of a point, or column of `pile.csv`.
    #[schemars(with = "String")]
    pub x: Spanned<String>,
    /// Text of this axis.
    pub x_label: Option<String>,
    /// Vertical axis: the same, one or more.
    #[schemars(with = "Vec<String>")]
    pub y: Vec<Spanned<String>>,
    /// Text of this axis.
    pub y_label: Option<String>,
    /// The vertical axis points downward, as for settlements.
    #[serde(default)]
    pub y_reversed: bool,
    /// Only this phase; default: all.
    #[schemars(with = "Option<String>")]
    pub phase: Option<Spanned<String>>,
    /// Integration points of a cut, instead of probes.
    pub points: Option<CutInput>,
    /// Along the pile, instead of probes.
    #[schemars(with = "Option<AlongInput>")]
    pub along_pile: Option<Spanned<AlongInput>>,
    /// Measured points, as markers.
    pub measured: Option<MeasuredTables>,
}

impl FigureInput {
    /// Increments of its phase after which a figure over points or along the pile has a curve.
    pub fn increments(&mut self) -> Option<&mut Vec<usize>> {
        let of_cut = self.points.as_mut().map(|cut| &mut cut.increments);
        let along = self.along_pile.as_mut();
        of_cut.or(along.map(|along| &mut along.get_mut().increments))
    }
}

/// Integration points inside extents (ends excluded), at chosen increments.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[schemars(transform = schema::radius_and_axis)]
#[serde(deny_unknown_fields)]
pub struct CutInput {
    /// Group; default: all.
    #[schemars(with = "Option<String>")]
    pub group: Option<Spanned<String>>,
    /// Extent in x (r).
    #[serde(alias = "r")]
    pub x: Option<[f64; 2]>,
    /// Extent in y (z).
    #[serde(alias = "z")]
    pub y: Option<[f64; 2]>,
    /// A curve after each of these increments of the phase; default: the last one.
    #[serde(default)]
    pub increments: Vec<usize>,
    /// Factor of the vertical axis.
    #[serde(default = "one")]
    pub scale: f64,
}

/// What holds along the pile, at chosen increments.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AlongInput {
    /// A curve after each of these increments of the phase; default: the last one.
    #[serde(default)]
    pub increments: Vec<usize>,
}

/// Points from two columns of a file of comma-separated values.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MeasuredInput {
    /// The file, relative to this one. Columns named in the first line, separated by `,`, `;` or tabs;
    /// lines with `#` and rows without a value do not count.
    #[schemars(with = "PathBuf")]
    pub file: Spanned<PathBuf>,
    /// Column for the horizontal axis.
    #[schemars(with = "String")]
    pub x: Spanned<String>,
    /// Column for the vertical axis.
    #[schemars(with = "String")]
    pub y: Spanned<String>,
    /// Name in the legend.
    #[serde(default = "measured")]
    pub label: String,
    /// Factor of its values.
    #[serde(default = "one")]
    pub x_scale: f64,
    /// Factor of its values.
    #[serde(default = "one")]
    pub y_scale: f64,
    /// Added to its values after the factor.
    #[serde(default)]
    pub x_offset: f64,
    /// Added to its values after the factor.
    #[serde(default)]
    pub y_offset: f64,
}

fn measured() -> String {
    "measured".to_owned()
}

/// For a file without `[solver]`.
fn default_solver() -> Spanned<Settings> {
    Spanned::new(0..0, Settings::default())
}

/// A relative error that can be aimed at.
fn accuracy<'de, D: Deserializer<'de>>(input: D) -> Result<Option<Spanned<f64>>, D::Error> {
    let asked = Spanned::<f64>::deserialize(input)?;
    match *asked.get_ref() {
        value if value > 0.0 && value <= 0.5 => Ok(Some(asked)),
        value => Err(de::Error::custom(format!("{value:?} is outside (0, 0.5]"))),
    }
}
