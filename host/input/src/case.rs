//! The case file: what a user writes, key by key. Reading it gives these types; references
//! between them (a group's law, a load's line) are resolved by the modules that use them.

mod mesh;
mod one_or_several;
mod outcome;
mod phase;
mod read;

pub use mesh::{Coordinate, LineInput, MeshInput, PartInput, RegionInput};
pub use one_or_several::{GroupNames, MeasuredTables};
pub use outcome::{AlongInput, CutInput, FigureInput, MeasuredInput, PileInput, ProbeInput};
pub use phase::{
    DirectedStrain, DisplacementInput, ForceInput, FreeInput, PhaseInput, PressureInput,
    StrainInput, UntilInput,
};
pub use read::Case;

use crate::accuracy_settings::AccuracySettings;
use crate::ground::{StressInput, WaterInput};
use crate::material::{ParameterTable, Route, foreign, shear_zone};
use crate::spanned::Given;
use crate::{Error, schema};
use law::ShearZone;
use law::foreign::{Externals, Foreign, Order, Scratch};
use mechanics::Settings;
use mechanics::problem::{self, Analysis, Drainage, Formulation, InPlane, Integration};
use results::output_request::Output;
use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, de};
use std::path::PathBuf;
use text::{Named, Source, Spanned};

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
    pub law_path: Vec<Spanned<PathBuf>>,
    /// The mesh.
    pub mesh: MeshInput,
    /// Laws and their parameters, by a name for groups.
    pub laws: Named<LawInput>,
    /// Element groups, by a name for regions.
    pub groups: Named<GroupInput>,
    /// Ground water; none if left out.
    pub water: Option<Spanned<WaterInput>>,
    /// Displacements held at zero.
    #[serde(default)]
    pub supports: Vec<SupportInput>,
    /// Loading phases, in order.
    #[serde(rename = "phase")]
    pub phases: Vec<PhaseInput>,
    /// Quantities written for every increment.
    #[serde(default)]
    pub probes: Named<ProbeInput>,
    /// A pile: forces, friction and settlement of every increment; resistance at the end.
    pub pile: Option<PileInput>,
    /// Curves of probes, drawn when the run ends.
    #[serde(default, rename = "figure")]
    pub figures: Vec<FigureInput>,
    /// Solver settings.
    #[serde(default = "default_solver")]
    pub solver: Spanned<Settings>,
    /// Output.
    #[serde(default)]
    pub output: Output,
    /// Relative error that the probes may have: a study before the run finds settings that reach it.
    #[serde(default, deserialize_with = "accuracy")]
    #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 0.5))]
    pub accuracy: Option<Spanned<f64>>,
    /// `accuracy` includes the error of the mesh: the mesh is refined as well.
    #[serde(default)]
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

/// A law with its parameters.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LawInput {
    /// Id of the law.
    pub law: Spanned<String>,
    /// SHA-256 that the law's library must have, in hexadecimal digits.
    pub sha256: Option<Spanned<String>>,
    /// Program that the law's library is made for, if not for the contract; or another law as its
    /// source.
    pub adapter: Option<Spanned<Route>>,
    /// That library, relative to the file.
    pub library: Option<Spanned<PathBuf>>,
    /// Its sidecar, or description.
    pub sidecar: Option<Spanned<PathBuf>>,
    /// Call the law in this process.
    pub in_process: Option<Spanned<bool>>,
    /// File for the arguments of one call.
    pub record: Option<Spanned<PathBuf>>,
    /// Routines that the library calls and nobody supplies.
    pub externals: Option<Spanned<Externals>>,
    /// Scratch files of the library.
    pub scratch: Option<Spanned<Scratch>>,
    /// UDSM: order of its stiffness in memory; default `columns`.
    pub tangent_order: Option<Spanned<Order>>,
    /// Shear zone: its thickness, m. `law` is a law of solids, or a table of `laws`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub thickness: Option<Spanned<f64>>,
    /// Shear zone: initial stress along it and out of plane over the normal traction; default 1.
    #[schemars(range(min = 0))]
    pub lateral_ratio: Option<Spanned<f64>>,
    /// Its parameters: numbers, choices, expressions.
    #[serde(default)]
    pub parameters: ParameterTable,
    /// Initial internal variables, instead of the law's.
    #[serde(default)]
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
    pub law: Spanned<String>,
    /// Integration points; default: solids `projected`, thin layers `full`, zero thickness `nodes`.
    pub integration: Option<Spanned<Integration>>,
    /// Zero thickness: the line of the elements.
    pub line: Option<Spanned<String>>,
    /// Zero thickness: ends of that line on the model's outline; default `open`.
    pub ends: Option<Spanned<Ends>>,
    /// Thin layer: direction across it; default: the shorter side.
    pub normal: Option<Spanned<Axis>>,
    /// Thin layer with an interface law: elasticity along the layer.
    pub in_plane: Option<Spanned<InPlane>>,
    /// Effective stress before the first phase, tension positive.
    pub initial_stress: Option<Spanned<StressInput>>,
    /// Unit weight above the water, kN/m³; default 0.
    pub unit_weight: Option<Spanned<f64>>,
    /// Unit weight below the water, kN/m³; default `unit_weight`.
    pub saturated_unit_weight: Option<Spanned<f64>>,
    /// Water fills the pores below the water table; default true. Laws see effective stresses.
    pub pore_water: Option<bool>,
    /// Present from the start; default true. Phases activate and deactivate.
    pub active: Option<bool>,
    /// Drainage of pore water; default `drained`.
    pub drainage: Option<Spanned<Drainage>>,
    /// Undrained: Poisson's ratio with the pore water; default 0.495.
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
    pub line: Spanned<String>,
    /// The components.
    pub fixed: Vec<Axis>,
}

fn one() -> f64 {
    1.0
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
