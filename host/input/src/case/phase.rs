//! The tables `[[phase]]`.

use super::Axis;
use crate::ground::{ProfileInput, WaterChange};
use crate::schema;
use mechanics::problem::Drainage;
use schemars::JsonSchema;
use serde::Deserialize;
use text::{Named, Spanned};

/// A loading phase. Loads and prescribed displacements stay until a later phase changes them.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PhaseInput {
    /// Name, used in results.
    pub name: Spanned<String>,
    /// Number of equal increments.
    pub increments: Spanned<usize>,
    /// Duration, in the laws' unit of time; default 1.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub time: Option<Spanned<f64>>,
    /// Laws of groups from this phase on.
    #[serde(default)]
    pub laws: Named<String>,
    /// Groups present from this phase on: solids free of stress, interfaces with the adjacent stress.
    #[serde(default)]
    pub activate: Vec<Spanned<String>>,
    /// Groups absent from this phase on, one at least stays: the phase releases their forces. Name the
    /// interfaces of removed ground, too.
    #[serde(default)]
    pub deactivate: Vec<Spanned<String>>,
    /// Unit weights of groups at its end, above and below the water, kN/m³.
    #[serde(default)]
    pub unit_weight: Named<f64>,
    /// Water table at its end.
    pub water: Option<Spanned<WaterChange>>,
    /// Drainage of groups from this phase on. Excess pressure of drained groups goes in the course of
    /// the phase.
    #[serde(default)]
    pub drainage: Named<Drainage>,
    /// Lines whose nodes move alike, without turning, in this and all later phases; not radially if a
    /// line reaches the axis.
    #[serde(default)]
    pub rigid: Vec<Spanned<String>>,
    /// Pairs of the share of its time (0 to 1) and the factor on its changes; default: straight from 0
    /// to 1.
    pub course: Option<Spanned<Vec<[f64; 2]>>>,
    /// It ends before that where a quantity reaches a value. Loads, displacements and the excess pore
    /// pressure that `drainage` leaves stay where they are then.
    pub until: Option<Spanned<UntilInput>>,
    /// Stress-free strains of groups at its end, expansion positive, since the start: heat, swelling,
    /// shrinkage.
    #[serde(default)]
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
    pub line: Spanned<String>,
    /// The components.
    pub components: Vec<Axis>,
}

/// A pressure on a boundary line, kPa.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PressureInput {
    /// The line.
    pub line: Spanned<String>,
    /// Positive towards the body, kPa.
    pub value: Spanned<ProfileInput>,
}

/// A force on a line, spread evenly over it: kN over the whole turn, in plane strain kN/m. Refused where an
/// interface stands along the line.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[schemars(transform = schema::radius_and_axis)]
#[serde(deny_unknown_fields)]
pub struct ForceInput {
    /// The line.
    pub line: Spanned<String>,
    /// In x (r).
    #[serde(alias = "r")]
    pub x: Option<f64>,
    /// In y (z).
    #[serde(alias = "z")]
    pub y: Option<f64>,
}
