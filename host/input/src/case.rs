//! The case file: what a user writes, key by key. Reading it gives these types; references
//! between them (a group's law, a load's line) are resolved by the modules that use them.

use crate::accuracy_settings::AccuracySettings;
use crate::ground::{ProfileInput, StressInput, WaterChange, WaterInput};
use crate::material::{ForeignKeys, ParameterTable, ParameterValue, Route, shear_zone};
use crate::{Error, schema};
use law::Opener;
use law::ShearZone;
use law::adapter::{Externals, Foreign, Order, Scratch};
use mechanics::Settings;
use mechanics::problem::{self, Analysis, Drainage, Formulation, InPlane, Integration};
use results::output_request::{Output, Reduce};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Deserializer, de};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use text::{Named, Source, base};
use toml::Spanned;

/// What a driver file looks like among case files.
const DRIVER: base::OtherKind = base::OtherKind {
    keys: &["hypothesis", "segment"],
    message: "this is a driver file, which leads a law at one point; expected a case file",
    command: "pilum point",
};

/// A case file and its text.
#[derive(Clone, Debug)]
pub struct Case {
    /// Text and path, for messages.
    pub source: Source,
    /// Contents.
    pub file: CaseFile,
    /// Name of the variant, if the file stands for several cases.
    pub variant: Option<String>,
    /// Settings for opening the libraries of its laws.
    pub opener: Opener,
}

impl Case {
    /// Reads a case file, or `case.toml` in a folder: one case, or one for each `[[variant]]`.
    ///
    /// # Errors
    /// [`text::Error::Unreadable`], or [`text::Error::Input`] at the place that does not fit.
    pub fn load(path: &Path) -> Result<Vec<Self>, Error> {
        Self::load_with(path, &[])
    }

    /// As [`Case::load`], with settings over what the file says, `KEY=VALUE`, in every variant.
    ///
    /// # Errors
    /// As [`Case::load`]; [`text::Error::Input`] at the place in a setting.
    pub fn load_with(path: &Path, settings: &[String]) -> Result<Vec<Self>, Error> {
        let path = if path.is_dir() {
            path.join("case.toml")
        } else {
            path.to_owned()
        };
        Self::of(Source::read(&path)?.with_settings(settings))
    }

    /// Takes the text of a case file.
    ///
    /// # Errors
    /// [`text::Error::Input`] at the place that does not fit.
    pub fn of(source: Source) -> Result<Vec<Self>, Error> {
        let opener = Opener::default();
        let (source, files) = base::read_kind(source, &DRIVER)?;
        let case = |(variant, file)| Self {
            source: source.clone(),
            file,
            variant,
            opener: opener.clone(),
        };
        Ok(files.into_iter().map(case).collect())
    }

    /// The case, its laws' libraries opened with this; by default with what neither probes nor
    /// isolates.
    #[must_use]
    pub fn opened_by(self, opener: &Opener) -> Self {
        Self {
            opener: opener.clone(),
            ..self
        }
    }

    /// Folder for the results if none is given: `results/<case>`, or `results/<case>/<variant>`.
    pub fn default_folder(&self) -> PathBuf {
        let folder = Path::new("results").join(self.name());
        self.variant
            .iter()
            .fold(folder, |folder, variant| folder.join(variant))
    }

    /// Name of the case: its folder if the file is called `case.toml`, else the file's stem.
    pub fn name(&self) -> String {
        let path = self.source.path();
        let absolute = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        let named = if absolute.file_name().is_some_and(|name| name == "case.toml") {
            absolute.parent().and_then(Path::file_name)
        } else {
            absolute.file_stem()
        };
        named.map_or_else(
            || "case".to_owned(),
            |name| name.to_string_lossy().into_owned(),
        )
    }

    /// Elements of its grid; `None` where the mesh is in a file.
    pub fn n_elements(&self) -> Option<usize> {
        let mesh = &self.file.mesh;
        let [columns, rows] = [mesh.columns.as_ref()?, mesh.rows.as_ref()?].map(|parts| {
            let numbers = parts.get_ref().iter().map(|part| part.get_ref().n);
            numbers.fold(0, usize::saturating_add)
        });
        Some(columns.saturating_mul(rows))
    }

    /// Folders with law libraries, relative to the file that names them.
    ///
    /// # Errors
    /// [`text::Error::Input`] if there is no such folder.
    pub fn law_folders(&self) -> Result<Vec<PathBuf>, Error> {
        let folder = |written: &Spanned<PathBuf>| {
            let file = self.source.path_at(&written.span());
            let folder = file
                .parent()
                .unwrap_or(Path::new("."))
                .join(written.get_ref());
            if folder.is_dir() {
                return Ok(folder);
            }
            let message = format!("`law_path`: there is no folder {}", folder.display());
            Err(self.source.error(written.span(), message).into())
        };
        self.file.law_path.iter().map(folder).collect()
    }
}

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
    /// Its parameters.
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
        self.keys().read(source)
    }

    /// The zone that its law of solids fills, if it is made so.
    ///
    /// # Errors
    /// [`text::Error::Input`] at the key that does not fit.
    pub fn shear_zone(&self, source: &Source) -> Result<Option<ShearZone>, Error> {
        let (thickness, ratio) = (self.thickness.as_ref(), self.lateral_ratio.as_ref());
        shear_zone(source, self.keys(), thickness, ratio)
    }

    pub(crate) fn is_shear_zone(&self) -> bool {
        let adapter = self.adapter.as_ref();
        adapter.is_some_and(|adapter| *adapter.get_ref() == Route::ShearZone)
    }

    fn keys(&self) -> ForeignKeys<'_> {
        ForeignKeys {
            adapter: self.adapter.as_ref(),
            library: self.library.as_ref(),
            sidecar: self.sidecar.as_ref(),
            in_process: self.in_process.as_ref(),
            record: self.record.as_ref(),
            externals: self.externals.as_ref(),
            scratch: self.scratch.as_ref(),
            tangent_order: self.tangent_order.as_ref(),
        }
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

/// Names of groups: one, or a list.
#[derive(Clone, Debug)]
pub struct GroupNames(pub Vec<Spanned<String>>);

impl<'de> Deserialize<'de> for GroupNames {
    fn deserialize<D: Deserializer<'de>>(input: D) -> Result<Self, D::Error> {
        struct OneOrSeveral;
        impl<'de> de::Visitor<'de> for OneOrSeveral {
            type Value = Vec<Spanned<String>>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(
                    "the name of a group, or a list such as [\"shaft_clay\", \"shaft_sand\"]",
                )
            }

            fn visit_str<E: de::Error>(self, name: &str) -> Result<Self::Value, E> {
                Ok(vec![Spanned::new(0..0, name.to_owned())])
            }

            fn visit_seq<S: de::SeqAccess<'de>>(self, names: S) -> Result<Self::Value, S::Error> {
                Vec::deserialize(de::value::SeqAccessDeserializer::new(names))
            }
        }
        struct Names(Vec<Spanned<String>>);
        impl<'de> Deserialize<'de> for Names {
            fn deserialize<D: Deserializer<'de>>(input: D) -> Result<Self, D::Error> {
                input.deserialize_any(OneOrSeveral).map(Self)
            }
        }
        let names = Spanned::<Names>::deserialize(input)?;
        let span = names.span();
        let placed = |name: Spanned<String>| match name.span() {
            // One name alone stands where the value does.
            at if at.is_empty() => Spanned::new(span.clone(), name.into_inner()),
            _ => name,
        };
        Ok(Self(names.into_inner().0.into_iter().map(placed).collect()))
    }
}

impl JsonSchema for GroupNames {
    fn schema_name() -> Cow<'static, str> {
        "GroupNames".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "anyOf": [
            { "type": "string" },
            { "type": "array", "items": { "type": "string" }, "minItems": 1 },
        ] })
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

/// Measured points of a figure: one table of them, or several.
#[derive(Clone, Debug)]
pub struct MeasuredTables(pub Vec<MeasuredInput>);

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
}

fn measured() -> String {
    "measured".to_owned()
}

impl<'de> Deserialize<'de> for MeasuredTables {
    fn deserialize<D: Deserializer<'de>>(input: D) -> Result<Self, D::Error> {
        struct OneOrSeveral;
        impl<'de> de::Visitor<'de> for OneOrSeveral {
            type Value = MeasuredTables;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a table such as { file = \"test.csv\", x = \"w\", y = \"load\" }, or a list of them")
            }

            fn visit_map<M: de::MapAccess<'de>>(self, map: M) -> Result<Self::Value, M::Error> {
                let table = de::value::MapAccessDeserializer::new(map);
                Ok(MeasuredTables(vec![MeasuredInput::deserialize(table)?]))
            }

            fn visit_seq<S: de::SeqAccess<'de>>(self, tables: S) -> Result<Self::Value, S::Error> {
                let tables = de::value::SeqAccessDeserializer::new(tables);
                Ok(MeasuredTables(Vec::deserialize(tables)?))
            }
        }
        input.deserialize_any(OneOrSeveral)
    }
}

impl JsonSchema for MeasuredTables {
    fn schema_name() -> Cow<'static, str> {
        "MeasuredTables".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let one = generator.subschema_for::<MeasuredInput>();
        json_schema!({ "anyOf": [one, { "type": "array", "items": one }] })
    }
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
